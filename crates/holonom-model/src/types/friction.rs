//! Smooth friction: `model` of the friction of a joint, and part of the `model` of a contact.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The course of smooth friction: `[1 + (r − 1) exp(−(v/v_s)²)] tanh(v/v_t)` of that of sliding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionCourse {
    /// `v_t`, m/s or rad/s.
    pub transition_velocity: f64,
    /// `r`.
    pub static_ratio: f64,
    /// `v_s`, m/s or rad/s.
    pub stribeck_velocity: Option<f64>,
}

/// `model` of the friction of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum FrictionModel {
    /// A smooth function of the rate `v`, for every scheme and order: the effort times
    /// `[1 + (r − 1) exp(−(v/v_s)²)] tanh(v/v_t)` against the motion. Nothing sticks: under a load
    /// the joint creeps.
    Stribeck {
        /// `v_t`, at which friction has three quarters of its size, m/s or rad/s.
        transition_velocity: f64,
        /// `r`: static over sliding friction, 1 or more.
        #[serde(default = "one")]
        static_ratio: f64,
        /// `v_s`: over which friction falls from static to sliding, m/s or rad/s.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        stribeck_velocity: Option<f64>,
    },
}

pub(crate) fn one() -> f64 {
    1.0
}

impl FrictionModel {
    /// Its course.
    #[must_use]
    pub fn course(&self) -> FrictionCourse {
        let Self::Stribeck { transition_velocity, static_ratio, stribeck_velocity } = *self;
        FrictionCourse { transition_velocity, static_ratio, stribeck_velocity }
    }
}
