//! `[[table]]`: a function by its values, for expressions.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a table is between its points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Interpolation {
    /// Cubic, monotone where the points are, with a continuous first derivative.
    #[default]
    Pchip,
    /// Straight lines: each point is a kink.
    Linear,
    /// A cubic spline with two continuous derivatives; the second is 0 at the ends.
    Spline,
}

/// What a table is before its first and after its last point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Outside {
    /// The value there.
    #[default]
    Hold,
    /// A straight line along the slope there.
    Slope,
    /// Nothing: the run ends with the name of the table.
    Error,
}

/// `[[table]]`: a function of one number by its values. Expressions call it by its name:
/// `torque(v)`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Its name, unique in the model: letters, digits and `_`, a letter first.
    pub name: String,
    /// Arguments and values, `[[x, y], …]`: at least two, arguments increasing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<[f64; 2]>,
    /// A file of comma-separated values with a line of headings, instead of `points`; its path
    /// starts in the folder of the model file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// The headings of the columns of arguments and values; the first two columns by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub columns: Option<[String; 2]>,
    /// What it is between its points.
    #[serde(default)]
    pub interpolation: Interpolation,
    /// What it is before the first and after the last point.
    #[serde(default)]
    pub outside: Outside,
}

impl Table {
    /// What is wrong with its points, in words.
    pub(crate) fn fault(&self) -> Option<String> {
        let points = &self.points;
        if points.len() < 2 {
            return Some(format!("{} point(s): a table has at least two", points.len()));
        }
        let pair = points.windows(2).zip(1..).find(|(pair, _)| pair[0][0] >= pair[1][0]);
        pair.map(|(pair, row)| {
            let (a, b) = (pair[0][0], pair[1][0]);
            format!("arguments must increase: {a} in row {row} is followed by {b}")
        })
    }
}
