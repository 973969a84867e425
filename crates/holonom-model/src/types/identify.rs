//! `[[measurement]]` and `[identify]`: what was measured, and what is to be found from it.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[[measurement]]`: a sensor beside a column of measured values, for `holonom identify`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Measurement {
    /// The name of a sensor, of one of several numbers with the number or its heading: `"tip.z"`,
    /// `"tip.2"`.
    pub sensor: String,
    /// The heading of the column of the data; that of `sensor` by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub column: Option<String>,
    /// The standard deviation of a measured value, in the unit of the sensor.
    pub sigma: f64,
}

impl Measurement {
    /// The heading of its column.
    #[must_use]
    pub fn column(&self) -> &str {
        self.column.as_deref().unwrap_or(&self.sensor)
    }
}

/// `[identify]`: the numbers that `holonom identify` finds from measurements.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Identify {
    /// Unknown numbers of `[parameters]`, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, Unknown>,
    /// Joints whose coordinates and rates at the start are unknown, too.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub initial: Vec<String>,
    /// Iterations of the method at most.
    #[serde(default = "hundred")]
    pub max_iterations: usize,
    /// Parts of the run that begin at states of their own until they meet: for long data, whose
    /// residuals have many minima.
    #[serde(default = "one")]
    pub segments: usize,
}

fn one() -> usize {
    1
}

fn hundred() -> usize {
    100
}

/// What is known of an unknown number.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Unknown {
    /// Where the method starts; the value under `[parameters]` by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<f64>,
    /// The least value; none by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// The largest value; none by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// What is known of it from elsewhere, as one more measured value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prior: Option<Prior>,
}

/// A value that is known with a standard deviation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Prior {
    /// The value.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
}
