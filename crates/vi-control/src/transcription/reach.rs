//! Which conditions the controls can meet, to first order at a point of a program.
//!
//! ```text
//! D_x δx + D_w δw = −d        steps: balances, closures        x: ξ_1 … ξ_N, hλ_0 … hλ_{N−1}
//! C_x δx + C_w δw = b − c     conditions, rest                 w: controls, T, impulses at the end
//! R δw = r,    R = C_w − Y D_w,    r = b − c + Y d,    Y D_x = C_x
//! ```
//! A row of `R` that vanishes is a condition that no control changes; rows that depend on one
//! another change together. Both matter where `r` is not in the range of `R`. `D_x` is block
//! triangular with square blocks: `Y` is found from the last step backward.
#![allow(non_snake_case)] // C, D, R, Y

use super::Transcription;
use super::point::EvaluatedPoint;
use super::problem::{NodeNumber, When};
use crate::program::{Program as _, Undefined};
use crate::singular_values::SingularValues;
use nalgebra::{DMatrix, DVector};

/// Parts of its size below which an entry or a singular value is taken for zero.
const ZERO: f64 = 1e-9;
/// Parts of the sizes of its terms by which a combination of conditions is missed.
const MISSED: f64 = 1e-6;

/// The rows that end a motion, with what they are wanted to become.
struct EndRows {
    rows: Vec<usize>,
    bounds: Vec<[f64; 2]>,
    /// The size of each slope elsewhere in the motion.
    sizes: Vec<f64>,
}

/// The Jacobian by blocks: steps by steps, ends by steps, both by the free variables.
struct ReachBlocks {
    steps: Vec<[DMatrix<f64>; 3]>, // D of rows k, k + 1, k + 2 by the variables of step k
    ends: Vec<DMatrix<f64>>,       // C_x by the variables of step k
    steps_by_free: DMatrix<f64>,
    ends_by_free: DMatrix<f64>,
}

impl Transcription {
    /// The conditions that the controls cannot meet to first order at a point, by name: one alone
    /// that nothing changes, or several that change together.
    ///
    /// # Errors
    /// [`Undefined`].
    pub fn unreached(&self, x: &[f64]) -> Result<Vec<Vec<String>>, Undefined> {
        let point = self.followed_at(x)?;
        let ends = self.ends(&point);
        let mut values = vec![0.0; self.layout.rows];
        self.row_values_at(&point, &mut values);
        let blocks = self.blocks(&point, &ends.rows);
        let Some((R, sizes, r)) = self.reduced(&blocks, &ends, &values) else {
            return Ok(Vec::new()); // a step that is singular is said elsewhere
        };
        let name = |k: usize| self.row_name(ends.rows[k]);
        let mut found: Vec<Vec<String>> = Vec::new();
        let mut equations = Vec::new();
        for k in 0..ends.rows.len() {
            let [low, high] = ends.bounds[k];
            let size = values[ends.rows[k]].abs().max(low.abs().min(high.abs()));
            let slope: f64 = blocks.ends.iter().map(|C| C.row(k).norm_squared()).sum();
            let still = slope.sqrt() <= ZERO * ends.sizes[k].max(size);
            if still || R.row(k).amax() <= ZERO * sizes[k] {
                let miss = (low - r[k]).max(r[k] - high);
                if miss > MISSED * size.max(r[k].abs()) {
                    found.push(vec![name(k)]);
                }
            } else if low.to_bits() == high.to_bits() {
                equations.push(k);
            }
        }
        found.extend(together(&R, &r, &ends, &equations).into_iter().map(|some| {
            let mut names: Vec<String> = some.into_iter().map(name).collect();
            names.dedup();
            names
        }));
        found.dedup();
        Ok(found)
    }

    /// Conditions that are no path, and rest.
    fn ends(&self, point: &EvaluatedPoint) -> EndRows {
        let mut ends = EndRows { rows: Vec::new(), bounds: Vec::new(), sizes: Vec::new() };
        for placed in &self.layout.conditions {
            let own = &self.problem.conditions[placed.condition];
            if own.when == When::Path {
                continue;
            }
            let slope = |n: usize| match &own.quantity {
                NodeNumber::Joint { .. } => 1.0,
                NodeNumber::Configuration(own) => {
                    DVector::from_vec(self.number_along(point, n, &**own)).norm()
                }
                NodeNumber::Node(_) => {
                    let slopes = self.quantity_slope(point, &own.quantity, n);
                    slopes.iter().map(|(_, slope)| slope * slope).sum::<f64>().sqrt()
                }
            };
            ends.rows.push(placed.row);
            ends.bounds.push(own.bounds);
            let nodes = (0..=self.problem.steps).map(|n| self.division.node(n));
            ends.sizes.push(nodes.map(slope).fold(0.0, f64::max));
        }
        for row in self.layout.rest.clone() {
            ends.rows.push(row);
            ends.bounds.push([0.0; 2]);
            ends.sizes.push(0.0);
        }
        ends
    }

    /// The piece and the place in it of each variable and each row of the motion.
    fn stages(&self) -> [Vec<Option<(usize, usize)>>; 2] {
        let (size, span) = (self.chart.dof() + self.closures.len(), self.division.span());
        let mut places = [vec![None; self.layout.variables], vec![None; self.layout.rows]];
        for k in 0..self.division.last() {
            for i in 0..size {
                let place = Some((k / span, k % span * size + i));
                places[0][self.layout.impulse(k) + i] = place;
                places[1][self.layout.balance(k) + i] = place;
            }
        }
        places
    }

    /// How large the square blocks of the motion are, and how many pieces it has.
    fn shape(&self) -> (usize, usize) {
        let size = self.chart.dof() + self.closures.len();
        (self.division.span() * size, self.division.pieces())
    }

    fn blocks(&self, point: &EvaluatedPoint, ends: &[usize]) -> ReachBlocks {
        let (size, steps) = self.shape();
        let [variables, rows] = self.stages();
        let mut free = vec![None; variables.len()];
        let mut count = 0;
        for (at, place) in variables.iter().enumerate() {
            if place.is_none() {
                free[at] = Some(count);
                count += 1;
            }
        }
        let square = || DMatrix::zeros(size, size);
        let mut blocks = ReachBlocks {
            steps: (0..steps).map(|_| [square(), square(), square()]).collect(),
            ends: vec![DMatrix::zeros(ends.len(), size); steps],
            steps_by_free: DMatrix::zeros(steps * size, count),
            ends_by_free: DMatrix::zeros(ends.len(), count),
        };
        self.emit_jacobian(point, &mut |row, column, value| {
            let of_end = ends.iter().position(|own| *own == row);
            match (rows[row], of_end, variables[column], free[column]) {
                (Some((n, i)), _, Some((k, j)), _) => blocks.steps[k][n - k][(i, j)] += value,
                (Some((n, i)), _, _, Some(w)) => {
                    blocks.steps_by_free[(n * size + i, w)] += value;
                }
                (_, Some(e), Some((k, j)), _) => blocks.ends[k][(e, j)] += value,
                (_, Some(e), _, Some(w)) => blocks.ends_by_free[(e, w)] += value,
                _ => {} // turns and conditions along the path
            }
        });
        blocks
    }

    /// `R`, the sizes of its rows without cancellation, and what the ends become by `−D_x⁻¹ d`.
    fn reduced(
        &self,
        blocks: &ReachBlocks,
        ends: &EndRows,
        values: &[f64],
    ) -> Option<(DMatrix<f64>, Vec<f64>, Vec<f64>)> {
        let (size, steps) = self.shape();
        let mut Y = DMatrix::<f64>::zeros(ends.rows.len(), steps * size);
        for k in (0..steps).rev() {
            let mut own = blocks.ends[k].clone();
            for (later, D) in blocks.steps[k].iter().enumerate().skip(1) {
                if k + later < steps {
                    own -= Y.columns((k + later) * size, size) * D;
                }
            }
            let solved = blocks.steps[k][0].transpose().lu().solve(&own.transpose())?;
            Y.columns_mut(k * size, size).copy_from(&solved.transpose());
        }
        let mut d = DVector::zeros(steps * size);
        for (value, place) in values.iter().zip(&self.stages()[1]) {
            place.iter().for_each(|(k, i)| d[k * size + i] = *value);
        }
        let R = &blocks.ends_by_free - &Y * &blocks.steps_by_free;
        let sums = blocks.ends_by_free.abs() + Y.abs() * blocks.steps_by_free.abs();
        let sizes = sums.row_iter().map(|row| row.max()).collect();
        let moved = &Y * d;
        let r = ends.rows.iter().enumerate().map(|(k, row)| values[*row] - moved[k]).collect();
        R.iter().all(|entry| entry.is_finite()).then_some((R, sizes, r))
    }
}

/// Groups of equations that change together and are not met together.
fn together(R: &DMatrix<f64>, r: &[f64], ends: &EndRows, equations: &[usize]) -> Vec<Vec<usize>> {
    let sizes: Vec<f64> = equations.iter().map(|&k| R.row(k).norm()).collect();
    let scaled =
        DMatrix::from_fn(R.ncols(), equations.len(), |w, e| R[(equations[e], w)] / sizes[e]);
    let values = SingularValues::of(&scaled);
    let largest = values.values.first().copied().unwrap_or(0.0);
    let mut groups = Vec::new();
    for (k, value) in values.values.iter().enumerate() {
        if *value > ZERO * largest {
            continue;
        }
        let u = values.right.column(k);
        let (mut sum, mut size) = (0.0, 0.0);
        for (e, &row) in equations.iter().enumerate() {
            let (factor, wanted) = (u[e] / sizes[e], ends.bounds[row][0]);
            sum += factor * (wanted - r[row]);
            size += factor.abs() * wanted.abs().max(r[row].abs());
        }
        if sum.abs() > MISSED * size {
            let most = u.amax();
            let named = equations.iter().enumerate().filter(|(e, _)| u[*e].abs() > 0.05 * most);
            groups.push(named.map(|(_, row)| *row).collect());
        }
    }
    groups
}
