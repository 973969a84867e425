//! `[[condition]]`: what an optimum has to meet.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::control::CountedAt;

/// What a condition is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ConditionKind {
    /// A sensor has a value, or lies within bounds.
    #[default]
    Sensor,
    /// The joints of `of` are at rest at the end, all that moves by default: their momenta are
    /// zero.
    Rest,
}

/// When a condition holds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "`at` is \"end\", \"path\" or a time in s")]
pub enum ConditionTime {
    /// At the end, or at every node; a start that nothing changes has to meet it.
    Word(CountedAt),
    /// At a time that is a node, s.
    Time(f64),
}

impl Default for ConditionTime {
    fn default() -> Self {
        Self::Word(CountedAt::End)
    }
}

/// `[[condition]]`: what an optimum has to meet. A run does without it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Condition {
    /// Its name, unique in the model.
    pub name: String,
    /// What it is.
    #[serde(rename = "type", default)]
    pub kind: ConditionKind,
    /// The name of a sensor, of one of several numbers with the number or its heading: `"tip.z"`,
    /// `"tip.2"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor: Option<String>,
    /// When it holds.
    #[serde(default)]
    pub at: ConditionTime,
    /// The value of the sensor, in its unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub equals: Option<f64>,
    /// Its least value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// Its largest value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// The joints that are at rest, of a condition of type `rest`; all by default.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub of: Vec<String>,
}

impl Condition {
    /// The least and the largest value of its sensor, infinite where there is none.
    #[must_use]
    pub fn bounds(&self) -> [f64; 2] {
        let [min, max] = [self.min, self.max].map(|bound| self.equals.or(bound));
        [min.unwrap_or(f64::NEG_INFINITY), max.unwrap_or(f64::INFINITY)]
    }
}
