//! Ids of the parts of a [`MechanismBuilder`](super::MechanismBuilder), and points of them.

use crate::mechanism::description::{Attachment, BarEnd};
use crate::pair::joint::FrameId;
use nalgebra::Vector3;

/// A body of a builder(super::MechanismBuilder), or a frame without mass of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BodyId(pub(super) usize);

/// A point mass of a builder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ParticleId(pub(super) usize);

/// A joint of a builder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct JointId(pub(super) usize);

/// A joint coordinate: degree of degree of freedom `freedom` of a joint, translations first, then
/// rotations; 0 in the initial configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CoordinateId {
    /// The joint.
    pub joint: JointId,
    /// Which of its degrees of freedom, counted from 0.
    pub freedom: usize,
}

/// A point that is fixed in a body, a point of the ground, or a point mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointOn {
    pub(crate) member: Attachment,
    pub(crate) place: PointPlace,
}

/// Where a point is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum PointPlace {
    /// Body components from the centre of mass, m.
    Components(Vector3<f64>),
    /// Position in space in the initial configuration, m.
    Space(Vector3<f64>),
}

impl BodyId {
    /// Its number among the bodies of the mechanism.
    #[must_use]
    pub fn index(self) -> usize {
        self.0
    }

    /// The point with these components along the axes of the body, from its centre of mass, m.
    #[must_use]
    pub fn point(self, components: impl Into<Vector3<f64>>) -> PointOn {
        PointOn { member: self.into(), place: PointPlace::Components(components.into()) }
    }

    /// The point of the body that is at `position` (m, in space) in the initial configuration.
    #[must_use]
    pub fn point_at(self, position: impl Into<Vector3<f64>>) -> PointOn {
        PointOn { member: self.into(), place: PointPlace::Space(position.into()) }
    }
}

impl ParticleId {
    /// Its number among the point masses of the mechanism.
    #[must_use]
    pub fn index(self) -> usize {
        self.0
    }
}

impl JointId {
    /// Its number among the joints of the mechanism.
    #[must_use]
    pub fn index(self) -> usize {
        self.0
    }

    /// Its coordinate `freedom`, counted from 0, translations first, then rotations.
    #[must_use]
    pub fn coordinate(self, freedom: usize) -> CoordinateId {
        CoordinateId { joint: self, freedom }
    }
}

impl From<BodyId> for FrameId {
    fn from(body: BodyId) -> Self {
        Self::Frame(body.0)
    }
}

impl From<BodyId> for Attachment {
    fn from(body: BodyId) -> Self {
        Self::Body(body.0)
    }
}

impl From<ParticleId> for BarEnd {
    fn from(particle: ParticleId) -> Self {
        Self::Particle(particle.0)
    }
}

/// A point of the ground.
impl From<[f64; 3]> for BarEnd {
    fn from(position: [f64; 3]) -> Self {
        Self::Ground(position.into())
    }
}

impl From<ParticleId> for PointOn {
    fn from(particle: ParticleId) -> Self {
        let place = PointPlace::Components(Vector3::zeros());
        Self { member: Attachment::Particle(particle.0), place }
    }
}

/// A point of the ground.
impl From<[f64; 3]> for PointOn {
    fn from(position: [f64; 3]) -> Self {
        Self { member: Attachment::Ground, place: PointPlace::Space(position.into()) }
    }
}
