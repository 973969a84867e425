//! Functions of two numbers that an expression calls by name: values on a grid, interpolated.
//!
//! ```text
//! f, f_y on two lines y = const     cubics in x by f, f_x and by f_y, f_xy at the corners, or lines
//! f(x, y)                           the cubic in y by f, f_y on these lines, or a line
//! f_xy = ½ (slopes of f_x along y + slopes of f_y along x)
//! ```
//! Slopes are those of tables of one number along the rows and the columns of the grid.

use std::sync::Arc;

use super::table::{line, through};
use crate::hermite::cubic;
use crate::types::table::{Interpolation, Outside, Table};

/// A table of two numbers that is ready to be evaluated. Clones share it.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface(Arc<SurfaceParts>);

#[derive(Debug, PartialEq)]
struct SurfaceParts {
    name: String,
    axes: [Vec<f64>; 2],
    corners: Vec<[f64; 4]>, // f, f_x, f_y, f_xy; rows of x
    linear: bool,
    outside: Outside,
}

/// Value, first derivatives `[f_x, f_y]`, second ones `[f_xx, f_xy, f_yy]`.
pub(super) type SurfaceDerivatives = (f64, [f64; 2], [f64; 3]);

/// A place in an interval of an axis.
struct AxisInterval {
    first: usize,
    ends: [f64; 2],
    at: f64,
    beyond: f64, // by how much the argument is outside of the axis
    linear: bool,
    outside: Outside,
}

impl AxisInterval {
    /// Value, slope and second derivative by value and slope at both ends.
    fn between(&self, [start, end]: [[f64; 2]; 2]) -> [f64; 3] {
        if self.beyond != 0.0 && self.outside == Outside::Hold {
            let held = if self.beyond < 0.0 { start } else { end };
            return [held[0], 0.0, 0.0];
        }
        let knots = [[self.ends[0], start[0], start[1]], [self.ends[1], end[0], end[1]]];
        let [f, slope, bend] =
            if self.linear { line(knots, self.at) } else { cubic(knots, self.at) };
        [f + self.beyond * slope, slope, if self.beyond == 0.0 { bend } else { 0.0 }]
    }
}

impl Surface {
    /// Of a table on a valid grid.
    #[must_use]
    pub fn new(table: &Table) -> Option<Self> {
        let ([x, y], rows) = (table.axes.as_ref()?, &table.values);
        let (n, m) = (x.len(), y.len());
        let slopes = |axis: &[f64], values: Vec<f64>| -> Vec<f64> {
            let points = axis.iter().zip(values).map(|(a, f)| [*a, f]);
            through(points, table.interpolation).knots.iter().map(|knot| knot[2]).collect()
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
        Some(Self(Arc::new(SurfaceParts { name, axes, corners, linear, outside: table.outside })))
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
    pub(super) fn at(&self, at: [f64; 2]) -> Option<SurfaceDerivatives> {
        let [x, y] = [self.interval(0, at[0])?, self.interval(1, at[1])?];
        let m = self.0.axes[1].len();
        let along_x = [0, 1].map(|j| {
            let corners = [0, 1].map(|i| self.0.corners[(x.first + i) * m + y.first + j]);
            [0, 2].map(|part| x.between(corners.map(|own| [own[part], own[part + 1]])))
        });
        let along_y = |order: usize| y.between(along_x.map(|[f, f_y]| [f[order], f_y[order]]));
        let ([f, f_y, f_yy], [f_x, f_xy, _], [f_xx, ..]) = (along_y(0), along_y(1), along_y(2));
        Some((f, [f_x, f_y], [f_xx, f_xy, f_yy]))
    }

    fn interval(&self, axis: usize, x: f64) -> Option<AxisInterval> {
        let SurfaceParts { axes, linear, outside, .. } = &*self.0;
        let (knots, [least, most]) = (&axes[axis], self.range(axis));
        let at = x.clamp(least, most);
        let beyond = x - at;
        if beyond != 0.0 && *outside == Outside::Error {
            return None;
        }
        let after = knots.partition_point(|knot| *knot <= at).clamp(1, knots.len() - 1);
        let (first, ends) = (after - 1, [knots[after - 1], knots[after]]);
        Some(AxisInterval { first, ends, at, beyond, linear: *linear, outside: *outside })
    }
}
