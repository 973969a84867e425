//! What acts on a joint coordinate: `spring`, `damper`, `motor` of a `[[joint]]`, and the paths that
//! motors and prescribed motions follow.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

use super::load::History;

/// `spring` of a joint: `½ k (θ − rest)²`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointSpring {
    /// Which degree of freedom of the joint, counted from 0: displacements first, then angles.
    #[serde(default)]
    pub freedom: usize,
    /// Stiffness `k`, N/m for displacements, N·m/rad for angles.
    pub stiffness: f64,
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

/// `motor` of a joint: an effort `effort × history(t)`, or control of the coordinate to a path, or both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointMotor {
    /// Which degree of freedom of the joint, counted from 0.
    #[serde(default)]
    pub freedom: usize,
    /// Force, N, or torque, N·m.
    #[serde(default)]
    pub effort: f64,
    /// Factor of the effort in time, constant by default.
    #[serde(default)]
    pub history: History,
    /// Control gain on the coordinate, N/m or N·m/rad.
    #[serde(default)]
    pub proportional: f64,
    /// Control gain on its rate, N·s/m or N·m·s/rad.
    #[serde(default)]
    pub derivative: f64,
    /// The path that the control follows; at rest in the initial configuration by default.
    #[serde(default)]
    pub path: Path,
}

/// A smooth function of time:
/// `offset + rate t + ½ acceleration t² + amplitude (sin(2π frequency t + phase) − sin(phase))`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Path {
    /// Value at t = 0, m or rad.
    #[serde(default)]
    pub offset: f64,
    /// m/s or rad/s.
    #[serde(default)]
    pub rate: f64,
    /// m/s² or rad/s².
    #[serde(default)]
    pub acceleration: f64,
    /// m or rad.
    #[serde(default)]
    pub amplitude: f64,
    /// Hz.
    #[serde(default)]
    pub frequency: f64,
    /// rad.
    #[serde(default)]
    pub phase: f64,
}

impl Path {
    /// Value, rate and acceleration at `t`, s.
    #[must_use]
    pub fn at(&self, t: f64) -> [f64; 3] {
        let w = TAU * self.frequency;
        let (sin, cos) = (w * t + self.phase).sin_cos();
        [
            self.offset
                + t * (self.rate + 0.5 * self.acceleration * t)
                + self.amplitude * (sin - self.phase.sin()),
            self.rate + self.acceleration * t + self.amplitude * w * cos,
            self.acceleration - self.amplitude * w * w * sin,
        ]
    }
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
        path: Path,
    },
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
            | Self::Motion { name, .. } => name,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_has_its_derivatives() {
        let path = Path {
            offset: 0.1,
            rate: 2.0,
            acceleration: -1.0,
            amplitude: 0.3,
            frequency: 1.7,
            phase: 0.4,
        };
        let (t, e) = (0.7, 1e-5);
        let [_, rate, acceleration] = path.at(t);
        let first = (path.at(t + e)[0] - path.at(t - e)[0]) / (2.0 * e);
        let second = (path.at(t + e)[1] - path.at(t - e)[1]) / (2.0 * e);
        assert!((first - rate).abs() < 1e-8 && (second - acceleration).abs() < 1e-7);
        assert!((path.at(0.0)[0] - 0.1).abs() < 1e-16);
    }
}
