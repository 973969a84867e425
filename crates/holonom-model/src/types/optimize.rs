//! `[optimize]`: what is free in an optimum, and how it is looked for.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `time` of `[optimize]`: the time that the motion takes is free.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FreeTime {
    /// The least, s.
    pub min: f64,
    /// The largest, s.
    pub max: f64,
    /// Where the search begins, s; `end` of the simulation by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub guess: Option<f64>,
}

impl FreeTime {
    /// Whether a time, s, is within the bounds.
    #[must_use]
    pub fn contains(&self, time: f64) -> bool {
        (self.min..=self.max).contains(&time)
    }
}

/// An entry of `parameters` of `[optimize]`: bounds of a parameter that is free.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FreeParameter {
    /// The least value, in the unit of the parameter.
    pub min: f64,
    /// The largest.
    pub max: f64,
}

/// `[optimize]`: what is free beside the controls, and how an optimum is looked for. A run does
/// without it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Optimize {
    /// The time that the motion takes is free; `end` of the simulation by default. The number of
    /// steps is that of the simulation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time: Option<FreeTime>,
    /// The parameters that are free, by name: `{ length = { min = 0.2, max = 0.6 } }`. The search
    /// begins with their values.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, FreeParameter>,
    /// The motion with which the search begins: `"line"` from start to end, `"run"` as the model
    /// moves without controls, or the folder of an earlier optimum.
    #[serde(default = "line")]
    pub guess: String,
    /// How often the steps are halved on the way: 2 begins with a quarter of them.
    #[serde(default = "twice")]
    pub refine: u32,
    /// Iterations at most, of each number of steps.
    #[serde(default = "many")]
    pub max_iterations: usize,
    /// How many searches, the second and further ones from disturbed beginnings.
    #[serde(default = "one")]
    pub starts: usize,
}

impl Default for Optimize {
    fn default() -> Self {
        Self {
            time: None,
            parameters: BTreeMap::new(),
            guess: line(),
            refine: twice(),
            max_iterations: many(),
            starts: one(),
        }
    }
}

fn line() -> String {
    "line".to_owned()
}

fn twice() -> u32 {
    2
}

fn many() -> usize {
    300
}

fn one() -> usize {
    1
}
