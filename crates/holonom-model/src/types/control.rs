//! `[[control]]` and `[[objective]]`: efforts and wrenches that are free, and what is to be least.

use super::frame::Frame;
use super::load::{History, Load};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[[control]]`: an effort along a joint coordinate, or a wrench on a body, that is free:
/// derivatives and optima are by its values. A run takes them as zero.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Control {
    /// Its name, unique in the model.
    pub name: String,
    /// The joint on which it acts: its values are efforts, N or N·m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Which degree of freedom of the joint, counted from 0: displacements first, then angles.
    #[serde(default)]
    pub freedom: usize,
    /// The body, the node of a beam or the particle on which it acts, in the place of `joint`: its
    /// values are factors of `force` and `torque`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// The force of the value 1, N, at `point`; with a unit vector the values are in N.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub force: [f64; 3],
    /// Where the force acts: body components from the centre of mass, m; the centre by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point: Option<[f64; 3]>,
    /// The torque of the value 1, N·m; with a unit vector the values are in N·m.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub torque: [f64; 3],
    /// The frame of the components of `force` and `torque`: with `"body"` they turn with it.
    #[serde(default)]
    pub frame: Frame,
    /// The frame in whose initial axes `force` and `torque` are stated, in the place of the
    /// inertial ones; only with `frame = "space"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_to: Option<String>,
    /// The least value, of a joint N or N·m; none by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// The largest value, of a joint N or N·m; none by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// Steps for each value.
    #[serde(default = "one_step")]
    pub hold: usize,
    /// How it goes from value to value.
    #[serde(default)]
    pub shape: ControlShape,
}

impl Control {
    /// On the body of a wrench: the load of the value 1, with the name of the control.
    #[must_use]
    pub fn load(&self) -> Option<Load> {
        Some(Load {
            name: self.name.clone(),
            body: Some(self.body.clone()?),
            beam: None,
            at: None,
            force: self.force,
            point: self.point,
            torque: self.torque,
            frame: self.frame,
            relative_to: self.relative_to.clone(),
            history: History::Constant,
        })
    }
}

pub(crate) fn is_zero(vector: &[f64; 3]) -> bool {
    vector.iter().all(|x| *x == 0.0)
}

/// How a control goes from value to value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ControlShape {
    /// Each value holds for `hold` steps.
    #[default]
    Constant,
    /// Values stand at the beginning and end of `hold` steps, linear between them; the middle of a
    /// step counts.
    Linear,
}

impl ControlShape {
    /// How many values a control has in a number of steps.
    #[must_use]
    pub fn values(self, hold: usize, steps: usize) -> usize {
        let pieces = steps.div_ceil(hold.max(1));
        match self {
            Self::Constant => pieces,
            Self::Linear => pieces + 1,
        }
    }

    /// The values that act in a step, with their weights.
    #[must_use]
    pub fn weights(self, hold: usize, step: usize) -> [(usize, f64); 2] {
        let hold = hold.max(1);
        let first = step / hold;
        match self {
            Self::Constant => [(first, 1.0), (first, 0.0)],
            Self::Linear => {
                let part = ((step % hold) as f64 + 0.5) / hold as f64;
                [(first, 1.0 - part), (first + 1, part)]
            }
        }
    }
}

fn one_step() -> usize {
    1
}

/// What a term of the objective is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ObjectiveKind {
    /// `½ Σ h w²` of its controls, N²·s.
    Effort,
    /// `Σ w Δθ` of its controls: the work that they do, J.
    Work,
    /// The time from start to end, s.
    Time,
    /// `½ Σ (Δw)²/h` of its controls: how fast they change from step to step, N²/s.
    Rate,
    /// `½ (y − target)²` of a sensor at the end, or its integral over the path.
    Sensor,
    /// `y` of a sensor at the end, or its integral over the path.
    Value,
    /// `½ Σ p²` of the momenta along all joints at the end: zero at rest.
    Momentum,
}

impl ObjectiveKind {
    /// Whether it is of a sensor.
    #[must_use]
    pub fn reads_sensor(self) -> bool {
        matches!(self, Self::Sensor | Self::Value)
    }
}

/// Where a sensor counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum CountedAt {
    /// At the last node.
    #[default]
    End,
    /// Along the motion, by the trapezoidal rule.
    Path,
}

/// `[[objective]]`: a term of what derivatives are of and optima are least in; the terms add up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Objective {
    /// Its name, unique in the model.
    pub name: String,
    /// What it is.
    #[serde(rename = "type")]
    pub kind: ObjectiveKind,
    /// The controls of an `effort`, a `work` or a `rate`; all of them by default.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub controls: Vec<String>,
    /// Of a `sensor` or a `value` its name, of one of several numbers with the number or its
    /// heading: `"tip.z"`, `"tip.2"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor: Option<String>,
    /// Where a sensor counts.
    #[serde(default)]
    pub at: CountedAt,
    /// The value that a sensor is to have, in its unit.
    #[serde(default)]
    pub target: f64,
    /// Its factor in the sum.
    #[serde(default = "one")]
    pub weight: f64,
}

fn one() -> f64 {
    1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_act_in_their_steps() {
        let constant = ControlShape::Constant;
        assert_eq!((constant.values(3, 7), constant.weights(3, 6)[0]), (3, (2, 1.0)));
        let linear = ControlShape::Linear;
        assert_eq!(linear.values(3, 7), 4);
        let [first, second] = linear.weights(2, 3);
        assert_eq!([first.0, second.0], [1, 2]);
        assert!((first.1 - 0.25).abs() < 1e-15 && (second.1 - 0.75).abs() < 1e-15);
        assert_eq!(linear.values(1, 1), 2);
    }
}
