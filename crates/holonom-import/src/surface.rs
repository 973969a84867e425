//! What touches: solids of links, planes of the ground.

use nalgebra::Isometry3;

use crate::solid::PlacedSolid;

/// Coefficient of friction where none is stated, as in MuJoCo.
pub(crate) const FRICTION: f64 = 1.0;

/// On contact that is not asked for.
pub(crate) const NOT_ASKED: &str =
    "contact: not translated; `--contacts` lets the robot stand on the ground";

/// What touches, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Surface {
    pub(crate) friction: f64,
    /// Its own bits, and those of what it touches.
    pub(crate) groups: [u32; 2],
}

impl Default for Surface {
    fn default() -> Self {
        Self { friction: FRICTION, groups: [1, 1] }
    }
}

impl Surface {
    /// Whether two may touch.
    pub(crate) fn touches(&self, other: &Self) -> bool {
        self.groups[0] & other.groups[1] != 0 || other.groups[0] & self.groups[1] != 0
    }
}

/// A solid of a link that touches.
#[derive(Clone, Debug)]
pub(crate) struct Touching {
    pub(crate) placed: PlacedSolid,
    pub(crate) surface: Surface,
}

impl Touching {
    /// The same in another frame, in which this frame has the given pose.
    pub(crate) fn moved(&self, pose: &Isometry3<f64>) -> Self {
        Self { placed: self.placed.moved(pose), surface: self.surface }
    }
}

/// A plane of the ground: the third axis points out of it.
#[derive(Clone, Debug)]
pub(crate) struct GroundPlane {
    pub(crate) name: String,
    pub(crate) pose: Isometry3<f64>,
    pub(crate) surface: Surface,
}
