//! What acts on a joint coordinate, `spring`, `damper`, `motor` of a `[[joint]]`, and
//! `[[constraint]]`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::body::GROUND;
use super::frame::Frame;
use super::law::Formula;
use super::load::History;
use super::motion_path::MotionPath;
use crate::Model;

/// `spring` of a joint: `½ k (θ − rest)²`, and what a table says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointSpring {
    /// Which degree of freedom of the joint, counted from 0: displacements first, then angles.
    #[serde(default)]
    pub freedom: usize,
    /// Stiffness `k`, N/m for displacements, N·m/rad for angles.
    pub stiffness: f64,
    /// A `[[table]]` of the effort that pulls back, N or N·m, by `θ − rest`, beside the stiffness.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub table: Option<String>,
    /// The joint coordinate at which it is relaxed, m or rad; 0 is the initial configuration.
    #[serde(default)]
    pub rest: f64,
}

/// `damper` of a joint: viscous friction, `−c θ̇`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointDamper {
    /// Which degree of freedom of the joint, counted from 0.
    #[serde(default)]
    pub freedom: usize,
    /// Damping `c`, N·s/m for displacements, N·m·s/rad for angles.
    pub damping: f64,
}

/// `motor` of a joint: an effort `effort × history(t)`, or control of the coordinate to a path, or
/// both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointMotor {
    /// Which degree of freedom of the joint, counted from 0.
    #[serde(default)]
    pub freedom: usize,
    /// Force, N, or torque, N·m.
    #[serde(default)]
    pub effort: f64,
    /// Factor of the effort in time: constant by default, in statics growing from 0 to 1 at the
    /// end.
    #[serde(default, skip_serializing_if = "History::is_unstated")]
    pub history: History,
    /// Control gain on the coordinate, N/m or N·m/rad.
    #[serde(default)]
    pub proportional: f64,
    /// Control gain on its rate, N·s/m or N·m·s/rad.
    #[serde(default)]
    pub derivative: f64,
    /// The path that the control follows; at rest in the initial configuration by default.
    #[serde(default)]
    pub path: MotionPath,
}

/// `[[constraint]]`: a scalar constraint beside the joints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum Constraint {
    /// The distance of two points is constant: a massless rod between bodies.
    Distance {
        /// Its name, unique in the model.
        name: String,
        /// A body, or `ground`.
        from: String,
        /// A body, or `ground`.
        to: String,
        /// The point at `from`, body components from the centre of mass, m (ground: in space).
        #[serde(default)]
        point_from: [f64; 3],
        /// The point at `to`, m.
        #[serde(default)]
        point_to: [f64; 3],
        /// The frame of a point of the ground: a body, a node of a beam, a joint or a `[[frame]]`;
        /// the inertial frame by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        relative_to: Option<String>,
        /// The distance, m; the initial one by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        length: Option<f64>,
    },
    /// A point of the child stays on a line of the parent.
    PointOnLine {
        /// Its name, unique in the model.
        name: String,
        /// A body, or `ground`.
        parent: String,
        /// A body, or `ground`.
        child: String,
        /// The point in space, initially, m.
        position: [f64; 3],
        /// The direction of the line in space, initially.
        axis: [f64; 3],
        /// The frame of position and axis: a body, a node of a beam, a joint or a `[[frame]]`; the
        /// inertial frame by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        relative_to: Option<String>,
    },
    /// A point of the child stays on a plane of the parent.
    PointOnPlane {
        /// Its name, unique in the model.
        name: String,
        /// A body, or `ground`.
        parent: String,
        /// A body, or `ground`.
        child: String,
        /// The point in space, initially, m.
        position: [f64; 3],
        /// The normal of the plane in space, initially.
        axis: [f64; 3],
        /// The frame of position and axis: a body, a node of a beam, a joint or a `[[frame]]`; the
        /// inertial frame by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        relative_to: Option<String>,
    },
    /// `θ_a + ratio θ_b` is constant: gears, racks.
    Gear {
        /// Its name, unique in the model.
        name: String,
        /// The two joints a and b.
        joints: [String; 2],
        /// Their degrees of freedom, counted from 0.
        #[serde(default)]
        freedoms: [usize; 2],
        /// The ratio: teeth of b over teeth of a for gears that rotate in opposite directions.
        ratio: f64,
    },
    /// A joint coordinate follows a path (measured from the initial configuration).
    Motion {
        /// Its name, unique in the model.
        name: String,
        /// The joint.
        joint: String,
        /// Its degree of freedom, counted from 0.
        #[serde(default)]
        freedom: usize,
        /// The path; its rate at t = 0 must be the initial one.
        path: MotionPath,
    },
    /// A wheel or a sphere rolls on a plane without slip; it neither lifts off nor slides.
    Rolling {
        /// Its name, unique in the model.
        name: String,
        /// The body that rolls; the centre of the wheel or sphere is its centre of mass.
        body: String,
        /// The axis of a wheel in space, initially; without it a sphere rolls.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        axis: Option<[f64; 3]>,
        /// The outer radius, m.
        radius: f64,
        /// The radius of the section of a tyre, part of `radius`, m; 0 is a disc with a sharp edge.
        #[serde(default, skip_serializing_if = "is_zero")]
        tube: f64,
        /// The plane; z = 0 of the ground by default.
        #[serde(default)]
        plane: RollingPlane,
        /// The frame of axis and plane: a body, a node of a beam, a joint or a `[[frame]]`; the
        /// inertial frame by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        relative_to: Option<String>,
    },
    /// A point of a body has no velocity along an axis of the body: a blade on ice, a keel, a wheel
    /// of which only the direction counts.
    Blade {
        /// Its name, unique in the model.
        name: String,
        /// The body.
        body: String,
        /// The point of the body, in space, initially, m.
        position: [f64; 3],
        /// The axis of the body along which the point does not move, in space, initially.
        axis: [f64; 3],
        /// The frame of position and axis: a body, a node of a beam, a joint or a `[[frame]]`; the
        /// inertial frame by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        relative_to: Option<String>,
    },
    /// A weighed sum of rates of joint coordinates and of points has a value, `Σ factor ẋ = value`:
    /// any constraint that is affine in the velocities.
    Velocity {
        /// Its name, unique in the model.
        name: String,
        /// What moves, each with its factor.
        terms: Vec<VelocityTerm>,
        /// The value of the sum, an expression of `t`, joint coordinates and places of bodies; 0 by
        /// default. In m/s where factors are numbers and points move, in rad/s for angles.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        value: Option<Formula>,
    },
}

/// An entry of `terms` of a `[[constraint]]` of type `velocity`: a joint coordinate (`joint`), or a
/// point of a body along a direction (`of`, `direction`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VelocityTerm {
    /// The joint whose rate counts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Which degree of freedom of the joint, counted from 0.
    #[serde(default)]
    pub freedom: usize,
    /// The body of the point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub of: Option<String>,
    /// The point, body components from the centre of mass, m; the centre by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point: Option<[f64; 3]>,
    /// The direction along which the velocity of the point counts, times its length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub direction: Option<[f64; 3]>,
    /// Whether the direction is fixed in space or in the body.
    #[serde(default)]
    pub axes: Frame,
    /// The factor of the rate, an expression of joint coordinates and places of bodies.
    #[serde(default = "one")]
    pub factor: Formula,
}

impl Model {
    /// The prescribed motion of a model in which nothing else prescribes rates.
    #[must_use]
    pub fn only_motion(&self) -> Option<&str> {
        let drives = |own: &&Constraint| match own {
            Constraint::Motion { .. } => true,
            Constraint::Velocity { value, .. } => value.is_some(),
            Constraint::Rolling { plane, .. } => plane.spin != 0.0,
            _ => false,
        };
        let mut driven = self.constraints.iter().filter(drives);
        match (driven.next()?, driven.next()) {
            (own @ Constraint::Motion { .. }, None) => Some(own.name()),
            _ => None,
        }
    }
}

fn one() -> Formula {
    Formula("1.0".to_owned())
}

/// `plane` of a `[[constraint]]` of type `rolling`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RollingPlane {
    /// A point of it, in space, m; it turns about its normal through this point.
    #[serde(default)]
    pub position: [f64; 3],
    /// Its normal in space, on the side of the wheel.
    #[serde(default = "upwards")]
    pub normal: [f64; 3],
    /// Its angular velocity about the normal, rad/s: a turntable.
    #[serde(default)]
    pub spin: f64,
    /// What carries it: `ground`, or a body that is fixed.
    #[serde(default = "ground")]
    pub on: String,
}

impl Default for RollingPlane {
    fn default() -> Self {
        Self { position: [0.0; 3], normal: upwards(), spin: 0.0, on: ground() }
    }
}

fn upwards() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

fn ground() -> String {
    GROUND.to_owned()
}

#[allow(clippy::trivially_copy_pass_by_ref)] // as serde calls it
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

impl Constraint {
    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Distance { name, .. }
            | Self::PointOnLine { name, .. }
            | Self::PointOnPlane { name, .. }
            | Self::Gear { name, .. }
            | Self::Motion { name, .. }
            | Self::Rolling { name, .. }
            | Self::Blade { name, .. }
            | Self::Velocity { name, .. } => name,
        }
    }

    /// Whether it constrains velocities, not only configurations: rolling, blades, sums of rates.
    #[must_use]
    pub fn is_of_velocities(&self) -> bool {
        self.carries_a_body() || matches!(self, Self::Velocity { .. })
    }

    /// Whether it is what carries a body at a point and exerts a force there: rolling, blades.
    #[must_use]
    pub fn carries_a_body(&self) -> bool {
        matches!(self, Self::Rolling { .. } | Self::Blade { .. })
    }
}
