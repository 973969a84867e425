//! Joints of a builder: position and axes in space in the initial configuration.

use super::error::finite;
use super::{BuildError, JointId};
use crate::mechanism::description::{BodySpec, joint_at};
use crate::pair::PairKind;
use crate::pair::joint::{FrameId, Joint, axes_along, complete_axis, complete_axis_in};
use nalgebra::{Matrix3, Vector3};

/// A joint as it was described.
#[derive(Clone, Debug)]
pub(super) struct JointPart {
    pub(super) name: String,
    pub(super) rates: Option<Vec<f64>>,
    pub(super) cut: bool,
    geometry: Geometry,
}

#[derive(Clone, Debug)]
enum Geometry {
    Space(Box<Described>),
    Sides(Box<Joint>),
}

#[derive(Clone, Debug)]
struct Described {
    kind: PairKind,
    frames: [FrameId; 2],
    anchors: Option<[Vector3<f64>; 2]>, // on the parent, on the child
    axis: Option<Vector3<f64>>,
    second_axis: Option<Vector3<f64>>,
}

impl JointPart {
    pub(super) fn new(name: &str, kind: PairKind, parent: FrameId, child: FrameId) -> Self {
        let frames = [parent, child];
        let described = Described { kind, frames, anchors: None, axis: None, second_axis: None };
        let geometry = Geometry::Space(Box::new(described));
        Self { name: name.to_owned(), rates: None, cut: false, geometry }
    }

    pub(super) fn given(joint: Joint) -> Self {
        let name = joint.name.clone();
        Self { name, rates: None, cut: false, geometry: Geometry::Sides(Box::new(joint)) }
    }

    pub(super) fn frames(&self) -> [FrameId; 2] {
        match &self.geometry {
            Geometry::Space(described) => described.frames,
            Geometry::Sides(joint) => [joint.parent.frame, joint.child.frame],
        }
    }

    /// Both sides in the components of their frames.
    pub(super) fn resolve(&self, bodies: &[BodySpec]) -> Result<Joint, BuildError> {
        let (name, described) = match &self.geometry {
            Geometry::Space(described) => (&self.name, described),
            Geometry::Sides(joint) => return Ok(Joint::clone(joint)),
        };
        let (kind, frames) = (described.kind, described.frames);
        let points = described.anchors.or(kind.is_free().then(Default::default));
        let points = points.ok_or_else(|| BuildError::MissingAnchor { joint: name.clone() })?;
        if kind.has_axis() && described.axis.is_none() {
            let pair = kind.name();
            return Err(BuildError::MissingAxis { joint: name.clone(), pair });
        }
        let element = || format!("joint `{name}`");
        for point in &points {
            finite(element, "position", point.as_slice())?;
        }
        if let Some(pitch) = kind.pitch() {
            finite(element, "pitch", &[pitch])?;
        }
        let axes = match (&described.axis, &described.second_axis) {
            (Some(axis), None) => {
                let n = direction(element, "axis", axis)?;
                match kind.properties().motion.translates_across_axis() {
                    true => complete_axis_in(&carrier(frames, bodies), &n),
                    false => complete_axis(&n),
                }
            }
            (Some(axis), Some(second)) => {
                let n = direction(element, "axis", axis)?;
                direction(element, "second axis", second)?;
                let across = second - n * n.dot(second);
                if across.norm() <= 1e-9 * second.norm() {
                    return Err(BuildError::ParallelAxes { joint: name.clone() });
                }
                axes_along(axis, second)
            }
            (None, _) => Matrix3::identity(),
        };
        Ok(joint_at(name, kind, frames, points, &axes, bodies))
    }
}

/// The axes of the parent, of the child where the parent is the ground.
fn carrier(frames: [FrameId; 2], bodies: &[BodySpec]) -> Matrix3<f64> {
    let triad = |frame| match frame {
        FrameId::Frame(k) => bodies.get(k).map(|body| body.triad),
        FrameId::Ground => None,
    };
    frames.into_iter().find_map(triad).unwrap_or_else(Matrix3::identity)
}

/// The unit vector along `axis`.
pub(super) fn direction(
    element: impl Fn() -> String,
    what: &'static str,
    axis: &Vector3<f64>,
) -> Result<Vector3<f64>, BuildError> {
    finite(&element, what, axis.as_slice())?;
    let unit = axis.normalize();
    if !unit.iter().all(|component| component.is_finite()) {
        return Err(BuildError::ZeroAxis { element: element(), what });
    }
    Ok(unit)
}

/// A joint that was added; its place, and the axis of pairs that have one, are needed.
#[derive(Debug)]
pub struct JointEntry<'a> {
    id: JointId,
    joint: &'a mut JointPart,
}

impl<'a> JointEntry<'a> {
    pub(super) fn new(id: JointId, joint: &'a mut JointPart) -> Self {
        Self { id, joint }
    }

    fn describe(self, change: impl FnOnce(&mut Described)) -> Self {
        if let Geometry::Space(described) = &mut self.joint.geometry {
            change(described);
        }
        self
    }

    /// Its position in space, m.
    pub fn at(self, position: impl Into<Vector3<f64>>) -> Self {
        let position = position.into();
        self.anchors(position, position)
    }

    /// Its positions on the parent and on the child, in space, m: for pairs that slide, and for
    /// loops whose initial configuration is not closed yet.
    pub fn anchors(self, parent: impl Into<Vector3<f64>>, child: impl Into<Vector3<f64>>) -> Self {
        let anchors = [parent.into(), child.into()];
        self.describe(|joint| joint.anchors = Some(anchors))
    }

    /// Its axis `n` in space: of rotation, of translation, or the normal of a planar joint. Any
    /// length but zero.
    pub fn axis(self, axis: impl Into<Vector3<f64>>) -> Self {
        let axis = axis.into();
        self.describe(|joint| joint.axis = Some(axis))
    }

    /// The axis `m_1` of a universal joint that is fixed in the child, in space; the part along the
    /// first axis is removed. For other pairs: the direction `m_1` of the parent from which angles
    /// are measured, along which a planar pair has its first displacement. Of a planar pair it is
    /// by default fixed in the frame of the parent, of the child where the parent is the ground.
    pub fn second_axis(self, axis: impl Into<Vector3<f64>>) -> Self {
        let axis = axis.into();
        self.describe(|joint| joint.second_axis = Some(axis))
    }

    /// The initial rates of its degrees of freedom, translations first (m/s), then rotations
    /// (rad/s). The velocities of bodies without one of their own then follow along the tree.
    pub fn rates(self, rates: &[f64]) -> Self {
        self.joint.rates = Some(rates.to_vec());
        self
    }

    /// The initial rate of its only freedom, m/s or rad/s; see [`JointEntry::rates`].
    pub fn rate(self, rate: f64) -> Self {
        self.rates(&[rate])
    }

    /// Cut the loop that the joint closes here: the spanning tree leaves it out.
    pub fn cut(self) -> Self {
        self.joint.cut = true;
        self
    }

    /// By which later parts refer to it.
    #[must_use]
    pub fn id(self) -> JointId {
        self.id
    }
}
