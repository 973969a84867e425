//! `[[bar]]`, `[[joint]]` and `[[spring]]`: what connects components.

use super::drive::{JointDamper, JointMotor, JointSpring};
use super::joint_contact::{JointBumper, JointFriction, JointLimits, Limits};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use vi_multibody::pair::PairKind;

/// `[[bar]]`: a rigid massless bar between two particles, or a particle and the ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bar {
    /// Its name, unique in the model.
    pub name: String,
    /// A particle, or `ground`.
    pub from: String,
    /// A particle, or `ground`.
    pub to: String,
    /// The point of the ground it is held at, m; `dimension` numbers. Only with `ground`; the
    /// origin by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point: Option<Vec<f64>>,
    /// The frame of `point`: a body, a node of a beam, a joint or a `[[frame]]`; the inertial frame
    /// by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_to: Option<String>,
    /// Its length, m; the initial distance by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length: Option<f64>,
}

/// Kind of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum JointKind {
    /// A common point; 3 degrees of freedom.
    Spherical,
    /// Rotation about `axis`; 1 degree of freedom.
    Revolute,
    /// Rotation about `axis` and translation along it; 2 degrees of freedom.
    Cylindrical,
    /// Translation along `axis`; 1 degree of freedom.
    Prismatic,
    /// Translation in the plane normal to `axis`, along `first_axis` and across it, and rotation
    /// about `axis`; 3 degrees of freedom.
    Planar,
    /// No relative motion.
    Fixed,
    /// Two crossing axes, `axis` fixed in the parent, `axis2` in the child; 2 degrees of freedom.
    Universal,
    /// Rotation about `axis` with translation along it by `pitch` per revolution; 1 degree of
    /// freedom.
    Screw,
}

impl JointKind {
    /// The kinematic pair; `pitch` of a screw in m per revolution.
    #[must_use]
    pub fn pair(self, pitch: Option<f64>) -> PairKind {
        match self {
            Self::Spherical => PairKind::Spherical,
            Self::Revolute => PairKind::Revolute,
            Self::Cylindrical => PairKind::Cylindrical,
            Self::Prismatic => PairKind::Prismatic,
            Self::Planar => PairKind::Planar,
            Self::Fixed => PairKind::Fixed,
            Self::Universal => PairKind::Universal,
            Self::Screw => {
                let per_revolution = pitch.unwrap_or_default();
                PairKind::Screw((per_revolution / std::f64::consts::TAU).into())
            }
        }
    }

    /// Whether it needs an `axis`.
    #[must_use]
    pub fn has_axis(self) -> bool {
        self.pair(None).has_axis()
    }

    /// Whether it needs an `axis2`.
    #[must_use]
    pub fn has_second_axis(self) -> bool {
        self.pair(None).properties().motion.swaps_axes()
    }

    /// Whether it may state a `first_axis`.
    #[must_use]
    pub fn has_first_axis(self) -> bool {
        self.has_axis() && !self.has_second_axis()
    }

    /// Whether its first axis is one of a body, not of the joint alone, where none is stated.
    pub(crate) fn turns_first_axis(self) -> bool {
        self.pair(None).properties().motion.translates_across_axis()
    }
}

/// One rate, or several.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "rate is a number, or a list of numbers")]
pub enum Rates {
    /// Of a single degree of freedom.
    One(f64),
    /// One for each degree of freedom.
    Many(Vec<f64>),
}

impl Rates {
    /// The numbers.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        match self {
            Self::One(rate) => std::slice::from_ref(rate),
            Self::Many(rates) => rates,
        }
    }
}

/// `[[joint]]`: a kinematic pair of two bodies, or of a body and the ground. Its place is
/// `position`, or `anchor_parent` and `anchor_child`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Joint {
    /// Its name, unique in the model.
    pub name: String,
    /// Kind of the joint.
    #[serde(rename = "type")]
    pub kind: JointKind,
    /// A body, or `ground`.
    pub parent: String,
    /// A body, or `ground`.
    pub child: String,
    /// Its place in space in the initial configuration, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<[f64; 3]>,
    /// Its place on the parent: body components from the centre of mass, m (ground: in space).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub anchor_parent: Option<[f64; 3]>,
    /// Its place on the child: body components from the centre of mass, m (ground: in space).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub anchor_child: Option<[f64; 3]>,
    /// Its axis in space in the initial configuration; any length but zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<[f64; 3]>,
    /// Universal joints: the axis fixed in the child, in space in the initial configuration,
    /// perpendicular to `axis`, which is fixed in the parent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis2: Option<[f64; 3]>,
    /// The first axis of the joint frame, in space in the initial configuration; its part along
    /// `axis` is left out. Displacement 0 of a planar joint is along it, displacement 1 along
    /// `axis` × `first_axis`, and reactions are given along both. By default a direction that is
    /// fixed in the frame of the parent of a planar joint (of the child where the parent is the
    /// ground), of other joints in the frame of `relative_to`. Of universal joints it is `axis2`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_axis: Option<[f64; 3]>,
    /// The frame of its position and axes (and of anchors on the ground): a body, a node of a beam,
    /// a joint or a `[[frame]]`; the inertial frame by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_to: Option<String>,
    /// Rates of its degrees of freedom initially (displacements first, then angles; m/s, rad/s): a
    /// number, or a list for several. The velocity of the child then follows from that of the
    /// parent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate: Option<Rates>,
    /// Cut the loop that the joint closes here; by default the spanning tree is found from the
    /// ground on, with short loops, and the joints left over are cut.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("default" = false))]
    pub cut: bool,
    /// Screw joints: advance along `axis` per right-handed revolution, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pitch: Option<f64>,
    /// A spring on a joint coordinate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spring: Option<JointSpring>,
    /// A damper (viscous friction) on a joint coordinate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damper: Option<JointDamper>,
    /// A motor on a joint coordinate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motor: Option<JointMotor>,
    /// Stops of a joint coordinate: `[lower, upper]`, or a table.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<Limits>,
    /// Elastic stops in the place of rigid ones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bumper: Option<JointBumper>,
    /// Dry friction of a joint coordinate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<JointFriction>,
}

impl Joint {
    /// Its kinematic pair.
    #[must_use]
    pub fn pair(&self) -> PairKind {
        self.kind.pair(self.pitch)
    }

    /// Its rigid stops: limits without a bumper.
    #[must_use]
    pub fn stops(&self) -> Option<JointLimits> {
        self.limits.filter(|_| self.bumper.is_none()).map(|own| own.table())
    }

    /// Its dry friction: friction without a smooth `model`.
    #[must_use]
    pub fn dry_friction(&self) -> Option<JointFriction> {
        self.friction.filter(|own| own.model.is_none())
    }

    /// Whether impulses act on it: rigid stops, dry friction.
    #[must_use]
    pub fn is_nonsmooth(&self) -> bool {
        self.dry_friction().is_some() || self.stops().is_some()
    }
}

/// Energy of a spring of length `l`, natural length `l0` and stiffness `k`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpringLaw {
    /// `V = ½ k (l − l0)²`; `k` in N/m.
    #[default]
    Linear,
    /// `V = ½ k (l² − l0²)²`; `k` in N/m³.
    QuadraticStretch,
}

/// `[[spring]]`: a spring, with an optional damper, between two components or a component and the
/// ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Spring {
    /// Its name, unique in the model.
    pub name: String,
    /// A body, a particle, or `ground`.
    pub from: String,
    /// A body, a particle, or `ground`.
    pub to: String,
    /// Where it is held at `from`, m: body components from the centre of mass, or a point of the
    /// ground; the centre or the origin by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point_from: Option<Vec<f64>>,
    /// Where it is held at `to`, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point_to: Option<Vec<f64>>,
    /// The frame of points of the ground: a body, a node of a beam, a joint or a `[[frame]]`; the
    /// inertial frame by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_to: Option<String>,
    /// Stiffness `k`: N/m (`linear`), N/m³ (`quadratic_stretch`).
    pub stiffness: f64,
    /// Natural length `l0`, m; the initial distance by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub natural_length: Option<f64>,
    /// Force with which it pulls in the initial configuration, N, negative where it pushes; instead
    /// of `natural_length`, for a linear spring.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tension: Option<f64>,
    /// Its energy as a function of its length.
    #[serde(default)]
    pub law: SpringLaw,
    /// Damping along the line, N·s/m.
    #[serde(default)]
    pub damping: f64,
}
