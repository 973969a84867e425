//! What touches: solids of links, planes of the ground.

use std::collections::BTreeMap;

use nalgebra::Isometry3;

use crate::solid::PlacedSolid;

/// Coefficient of friction where none is stated, as in MuJoCo.
pub(crate) const FRICTION: f64 = 1.0;

/// On contact that is not asked for.
pub(crate) const NOT_ASKED: &str =
    "contact: not translated; `--contacts` lets the robot touch the ground and itself";

/// On what only soft contact has.
pub(crate) const SOFT: &str =
    "contact: it is rigid, `solref`, `solimp`, `margin` and `gap` are not used";

/// Bodies of a tree that may touch, by the numbers of their nodes, with their friction.
pub(crate) type BodyPairs = BTreeMap<[usize; 2], f64>;

/// What touches, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TouchingSurface {
    pub(crate) friction: f64,
    /// Its own bits, and those of what it touches.
    pub(crate) groups: [u32; 2],
    /// Whether it is of a pair that is named.
    pub(crate) is_paired: bool,
}

impl Default for TouchingSurface {
    fn default() -> Self {
        Self { friction: FRICTION, groups: [1, 1], is_paired: false }
    }
}

impl TouchingSurface {
    /// Whether two may touch.
    pub(crate) fn touches(&self, other: &Self) -> bool {
        self.groups[0] & other.groups[1] != 0 || other.groups[0] & self.groups[1] != 0
    }
}

/// A solid of a link that touches.
#[derive(Clone, Debug)]
pub(crate) struct TouchingSolid {
    pub(crate) name: Option<String>,
    pub(crate) placed: PlacedSolid,
    pub(crate) surface: TouchingSurface,
}

impl TouchingSolid {
    /// The same in another frame, in which this frame has the given pose.
    pub(crate) fn moved(&self, pose: &Isometry3<f64>) -> Self {
        let (name, placed) = (self.name.clone(), self.placed.moved(pose));
        Self { name, placed, surface: self.surface }
    }
}

/// Two links, by their names, that do not touch.
#[derive(Clone, Debug)]
pub(crate) struct Exclusion(pub(crate) [String; 2]);

/// Geometry of two links, by its names, that touches whatever its groups are.
#[derive(Clone, Debug)]
pub(crate) struct GeomPair {
    pub(crate) geoms: [String; 2],
    /// The larger coefficient of both where none is stated.
    pub(crate) friction: Option<f64>,
}

/// A plane of the ground: the third axis points out of it.
#[derive(Clone, Debug)]
pub(crate) struct GroundPlane {
    pub(crate) name: String,
    pub(crate) pose: Isometry3<f64>,
    pub(crate) surface: TouchingSurface,
}
