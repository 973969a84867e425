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
    /// The value of the last point that the argument has reached: it jumps at each point. Not of
    /// two numbers, and not of a spring.
    Steps,
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

/// `[[table]]`: a function of one number by its values, or of two by its values on a grid.
/// Expressions call it by its name: `torque(v)`, `torque(v, heat)`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Its name, unique in the model: letters, digits and `_`, a letter first.
    pub name: String,
    /// Arguments and values, `[[x, y], …]`: at least two, arguments increasing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<[f64; 2]>,
    /// The arguments of a function of two numbers, `[[x, …], [y, …]]`: at least two each,
    /// increasing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axes: Option<[Vec<f64>; 2]>,
    /// Its values: a row for each `x`, in it one for each `y`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub values: Vec<Vec<f64>>,
    /// A file of comma-separated values with a line of headings, instead of `points`; its path
    /// starts in the folder of the model file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// The headings of the columns of arguments and values; the first two columns by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub columns: Option<[String; 2]>,
    /// Whether the file has a grid, instead of `axes` and `values`: `y` in its first line, `x` in
    /// its first column, values elsewhere.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("default" = false))]
    pub grid: bool,
    /// What it is between its points; on a grid the same along both arguments.
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
        if let Some([x, y]) = &self.axes {
            return self.fault_of_grid([x, y]);
        }
        if points.len() < 2 {
            return Some(format!("{} point(s): a table has at least two", points.len()));
        }
        let pair = points.windows(2).zip(1..).find(|(pair, _)| pair[0][0] >= pair[1][0]);
        pair.map(|(pair, row)| {
            let (a, b) = (pair[0][0], pair[1][0]);
            format!("arguments must increase: {a} in row {row} is followed by {b}")
        })
    }

    fn fault_of_grid(&self, axes: [&Vec<f64>; 2]) -> Option<String> {
        if self.interpolation == Interpolation::Steps {
            return Some("a function of two numbers has no steps".to_owned());
        }
        for (axis, own) in ["x", "y"].into_iter().zip(axes) {
            if own.len() < 2 {
                return Some(format!("{} value(s) of {axis}: a grid has at least two", own.len()));
            }
            if let Some(pair) = own.windows(2).find(|pair| pair[0] >= pair[1]) {
                let (a, b) = (pair[0], pair[1]);
                return Some(format!("values of {axis} must increase: {a} is followed by {b}"));
            }
        }
        let (rows, columns) = (axes[0].len(), axes[1].len());
        if self.values.len() != rows {
            return Some(format!("{} row(s) of values for {rows} of x", self.values.len()));
        }
        let row = self.values.iter().zip(1..).find(|(row, _)| row.len() != columns);
        row.map(|(row, k)| format!("row {k} has {} value(s) for {columns} of y", row.len()))
    }
}
