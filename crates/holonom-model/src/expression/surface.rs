//! Functions of two numbers that an expression calls by name: values on a grid, interpolated.
//!
//! ```text
//! f(x, y) = Σ_ij w_i(x) w_j(y) c_ij        i, j over value and slope at both ends of an interval
//! c = f, f_x, f_y, f_xy at the corners;    w Hermite's cubics, or the two lines
//! f_xy = ½ (slopes of f_x along y + slopes of f_y along x)
//! ```
//! Slopes are those of tables of one number along the rows and the columns of the grid.

use std::sync::Arc;

use crate::hermite::{Ends, Hermite};
use crate::types::table::{Interpolation, Outside, Table};

/// A table of two numbers that is ready to be evaluated. Clones share it.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface(Arc<Parts>);

#[derive(Debug, PartialEq)]
struct Parts {
    name: String,
    axes: [Vec<f64>; 2],
    corners: Vec<[f64; 4]>, // f, f_x, f_y, f_xy; rows of x
    linear: bool,
    outside: Outside,
}

/// Value, first derivatives `[f_x, f_y]`, second ones `[f_xx, f_xy, f_yy]`.
pub(super) type Bent = (f64, [f64; 2], [f64; 3]);

/// An interval of an axis, and the weights of value and slope at its start and at its end: with
/// their first and second derivatives.
struct Weights {
    first: usize,
    of: [[f64; 4]; 3],
}

impl Surface {
    /// Of a table on a valid grid.
    #[must_use]
    pub fn new(table: &Table) -> Option<Self> {
        let ([x, y], rows) = (table.axes.as_ref()?, &table.values);
        let (n, m) = (x.len(), y.len());
        let slopes = |axis: &[f64], values: Vec<f64>| -> Vec<f64> {
            let points = axis.iter().zip(values).map(|(a, f)| [*a, f]);
            let hermite = match table.interpolation {
                Interpolation::Spline => Hermite::spline(points, Ends::Natural),
                Interpolation::Pchip | Interpolation::Linear => Hermite::monotone(points),
            };
            hermite.knots.iter().map(|knot| knot[2]).collect()
        };
        let mut corners = vec![[0.0; 4]; n * m];
        let along_x = |part: usize, to: usize, scale: f64, corners: &mut Vec<[f64; 4]>| {
            for j in 0..m {
                let values = (0..n).map(|i| corners[i * m + j][part]).collect();
                for (i, slope) in slopes(x, values).into_iter().enumerate() {
                    corners[i * m + j][to] += scale * slope;
                }
            }
        };
        let along_y = |part: usize, to: usize, scale: f64, corners: &mut Vec<[f64; 4]>| {
            for row in corners.chunks_exact_mut(m) {
                let values = row.iter().map(|corner| corner[part]).collect();
                for (corner, slope) in row.iter_mut().zip(slopes(y, values)) {
                    corner[to] += scale * slope;
                }
            }
        };
        for (corner, value) in corners.iter_mut().zip(rows.iter().flatten()) {
            corner[0] = *value;
        }
        along_x(0, 1, 1.0, &mut corners);
        along_y(0, 2, 1.0, &mut corners);
        along_y(1, 3, 0.5, &mut corners);
        along_x(2, 3, 0.5, &mut corners);
        let linear = table.interpolation == Interpolation::Linear;
        let (name, axes) = (table.name.clone(), [x.clone(), y.clone()]);
        Some(Self(Arc::new(Parts { name, axes, corners, linear, outside: table.outside })))
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.0.name
    }

    /// The first and the last argument along an axis, 0 or 1.
    #[must_use]
    pub fn range(&self, axis: usize) -> [f64; 2] {
        let own = &self.0.axes[axis];
        [own[0], own[own.len() - 1]]
    }

    /// `None` outside of a table that ends there.
    pub(super) fn at(&self, at: [f64; 2]) -> Option<Bent> {
        let [x, y] = [self.weights(0, at[0])?, self.weights(1, at[1])?];
        let m = self.0.axes[1].len();
        let sum = |a: usize, b: usize| {
            let mut sum = 0.0;
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let [f, by_x, by_y, by_both] = self.0.corners[(x.first + i) * m + y.first + j];
                let ([v, s], [w, r]) =
                    ([x.of[a][2 * i], x.of[a][2 * i + 1]], [y.of[b][2 * j], y.of[b][2 * j + 1]]);
                sum += v * w * f + s * w * by_x + v * r * by_y + s * r * by_both;
            }
            sum
        };
        Some((sum(0, 0), [sum(1, 0), sum(0, 1)], [sum(2, 0), sum(1, 1), sum(0, 2)]))
    }

    fn weights(&self, axis: usize, x: f64) -> Option<Weights> {
        let Parts { axes, linear, outside, .. } = &*self.0;
        let (knots, [least, most]) = (&axes[axis], self.range(axis));
        let inside = x.clamp(least, most);
        let beyond = x - inside;
        let after = knots.partition_point(|knot| *knot <= inside).clamp(1, knots.len() - 1);
        let (first, h) = (after - 1, knots[after] - knots[after - 1]);
        let s = (inside - knots[first]) / h;
        let mut of = match linear {
            true => [[1.0 - s, 0.0, s, 0.0], [-1.0 / h, 0.0, 1.0 / h, 0.0], [0.0; 4]],
            false => {
                let r = 1.0 - s;
                [
                    [
                        (1.0 + 2.0 * s) * r * r,
                        h * s * r * r,
                        s * s * (3.0 - 2.0 * s),
                        -h * s * s * r,
                    ],
                    [-6.0 * s * r / h, r * (1.0 - 3.0 * s), 6.0 * s * r / h, s * (3.0 * s - 2.0)],
                    [
                        (12.0 * s - 6.0) / (h * h),
                        (6.0 * s - 4.0) / h,
                        (6.0 - 12.0 * s) / (h * h),
                        (6.0 * s - 2.0) / h,
                    ],
                ]
            }
        };
        if beyond != 0.0 {
            match outside {
                Outside::Error => return None,
                Outside::Hold => of[1] = [0.0; 4],
                Outside::Slope => of[0] = std::array::from_fn(|k| of[0][k] + beyond * of[1][k]),
            }
            of[2] = [0.0; 4];
        }
        Some(Weights { first, of })
    }
}
