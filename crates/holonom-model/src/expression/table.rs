//! Functions that an expression calls by name: values at points, interpolated.

use std::sync::Arc;

use crate::hermite::{Hermite, SplineEnds};
use crate::types::table::{Interpolation, Outside, Table};

/// A table that is ready to be evaluated. Clones share it.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve(Arc<TableParts>);

#[derive(Debug, PartialEq)]
struct TableParts {
    name: String,
    hermite: Hermite,
    interpolation: Interpolation,
    outside: Outside,
}

/// Parts of the distance between two points by which an argument that is rounded misses the second.
const ROUNDED: f64 = 1e-9;

impl Curve {
    /// Of a table with at least two points and increasing arguments.
    #[must_use]
    pub fn new(table: &Table) -> Self {
        let hermite = through(table.points.iter().copied(), table.interpolation);
        let (name, interpolation) = (table.name.clone(), table.interpolation);
        Self(Arc::new(TableParts { name, hermite, interpolation, outside: table.outside }))
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.0.name
    }

    /// Whether it jumps at its points.
    pub(super) fn jumps(&self) -> bool {
        self.0.interpolation == Interpolation::Steps
    }

    /// The first and the last argument.
    #[must_use]
    pub fn range(&self) -> [f64; 2] {
        let knots = &self.0.hermite.knots;
        [knots[0][0], knots[knots.len() - 1][0]]
    }

    /// Value, first and second derivative; `None` outside of a table that ends there.
    #[must_use]
    pub fn at(&self, x: f64) -> Option<[f64; 3]> {
        let [first, last] = self.range();
        let beyond = x < first || x > last;
        match self.0.outside {
            Outside::Error if beyond => return None,
            Outside::Hold if beyond => {
                let knots = &self.0.hermite.knots;
                let end = if x < first { knots[0] } else { knots[knots.len() - 1] };
                return Some([end[1], 0.0, 0.0]);
            }
            _ => {}
        }
        Some(match self.0.interpolation {
            Interpolation::Linear => line(self.around(x), x),
            Interpolation::Steps => {
                let [from, to] = self.around(x);
                let reached = x >= to[0] - ROUNDED * (to[0] - from[0]);
                [if reached { to[1] } else { from[1] }, 0.0, 0.0]
            }
            Interpolation::Pchip | Interpolation::Spline => self.0.hermite.at(x),
        })
    }

    /// The points on both sides.
    fn around(&self, x: f64) -> [[f64; 3]; 2] {
        let knots = &self.0.hermite.knots;
        let after = knots.partition_point(|knot| knot[0] <= x).clamp(1, knots.len() - 1);
        [knots[after - 1], knots[after]]
    }
}

/// Points with the slopes of an interpolation.
pub(super) fn through(
    points: impl Iterator<Item = [f64; 2]>,
    interpolation: Interpolation,
) -> Hermite {
    match interpolation {
        Interpolation::Spline => Hermite::spline(points, SplineEnds::Natural),
        Interpolation::Pchip | Interpolation::Linear | Interpolation::Steps => {
            Hermite::monotone(points)
        }
    }
}

/// Value, slope and second derivative on the straight line through two knots.
pub(super) fn line([a, b]: [[f64; 3]; 2], x: f64) -> [f64; 3] {
    let slope = (b[1] - a[1]) / (b[0] - a[0]);
    [a[1] + slope * (x - a[0]), slope, 0.0]
}
