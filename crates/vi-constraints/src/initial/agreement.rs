//! Dependent constraints that contradict each other at the start.
//!
//! Constraints may depend on one another, `G_d = C G_s`, as long as they agree: some velocity and
//! some acceleration must satisfy all of them,
//! ```text
//! G v' = −∂g/∂t                                  velocity level
//! G a  = −γ,   γ = D²g[v, v] + ∂²g/∂t²           acceleration level
//! ```
//! The independent rows are solved for `x`, and what is left in the others,
//! `G_d x + b_d = b_d − C b_s`, must vanish. Two prescribed motions of one joint, a prescribed
//! motion of a joint that other constraints lock, and a velocity that a stretched chain cannot have
//! are found here.
//!
//! Letters: `b` is `∂g/∂t` or `γ`; residuals are compared relative to the sizes of their rows.

use crate::constraints::Constraints;
use crate::saddle_point::{IndependentRows, SaddlePoint};
use vi_core::linear::{Singular, norm_inf};
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::{Configuration, Motion};

/// Relative residual from which on dependent constraints contradict each other.
const RELATIVE: f64 = 1e-5;
/// What a consistent start may leave of the velocity, relative: its acceleration terms are as good.
const VELOCITY: f64 = 1e-11;

/// The level at which constraints contradict each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContradictionLevel {
    /// No velocity satisfies all of them.
    Velocity,
    /// No acceleration does, with the velocity of the start.
    Acceleration,
}

impl std::fmt::Display for ContradictionLevel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Velocity => "velocity",
            Self::Acceleration => "acceleration",
        })
    }
}

/// Constraints that depend on one another and cannot all be satisfied.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "constraints that depend on one another contradict each other: no {level} satisfies all of them"
)]
pub struct Contradiction {
    /// The level.
    pub level: ContradictionLevel,
    /// The constraints: one that is left with a residual, then those it depends on by falling
    /// weight.
    pub rows: Vec<usize>,
    /// What is left relative to the size of the row, 1/s or 1/s².
    pub residual: f64,
}

/// `[W Gᵀ; G 0]` at one configuration, with what is left in all rows.
#[derive(Debug)]
pub struct Dependence<'a, C> {
    constraints: &'a C,
    at: Configuration<'a>,
    saddle: SaddlePoint,
    weights: Vec<f64>,      // n  W: one over the squared sizes of the coordinates
    sizes: Vec<f64>,        // m  of the rows
    jacobian: SparseMatrix, // m × n
}

impl<'a, C: Constraints> Dependence<'a, C> {
    /// At `(t, q)`, with the constraints that are independent there.
    #[must_use]
    pub fn new(constraints: &'a C, rows: &IndependentRows, at: Configuration<'a>) -> Self {
        let (n, m, t, q) = (constraints.dim(), constraints.len(), at.t, at.q);
        let (mut weights, mut sizes) = (vec![0.0; n], vec![0.0; m]);
        constraints.coordinate_sizes(q, &mut weights);
        weights.iter_mut().for_each(|size| *size = 1.0 / (*size * *size));
        constraints.row_sizes(at, &mut sizes);
        let jacobian = SparseMatrix::assemble(m, n, |out| constraints.jacobian(t, q, out));
        Self {
            constraints,
            at,
            saddle: SaddlePoint::new(n, rows.clone()),
            weights,
            sizes,
            jacobian,
        }
    }

    /// The sizes of the rows, shape `m`.
    #[must_use]
    pub fn sizes(&self) -> &[f64] {
        &self.sizes
    }

    /// Solves `W x + Gᵀ y = a`, `G x = b` for the independent rows; returns `(x, y)`.
    fn solve(&mut self, a: &[f64], b: &[f64]) -> Result<Vec<f64>, Singular> {
        let n = a.len();
        let mut x = vec![0.0; n + self.saddle.rows().len()];
        x[..n].copy_from_slice(a);
        self.saddle.rows().gather(b, &mut x[n..]);
        let weights = &self.weights;
        let emit = |out: &mut dyn Entries| {
            weights.iter().enumerate().for_each(|(i, w)| out.add(i, i, *w));
        };
        self.saddle.solve(self.constraints, &emit, self.at, 1.0, self.at, &mut x)?;
        if x.iter().all(|x| x.is_finite()) { Ok(x) } else { Err(Singular) }
    }

    /// The least `x`, measured by the sizes of the coordinates, with `G x = −g` in the independent
    /// rows.
    ///
    /// # Errors
    /// [`Singular`] when these are not independent here.
    pub fn correction(&mut self, g: &[f64]) -> Result<Vec<f64>, Singular> {
        let n = self.weights.len();
        let side: Vec<f64> = g.iter().map(|g| -g).collect();
        let mut x = self.solve(&vec![0.0; n], &side)?;
        x.truncate(n);
        Ok(x)
    }

    /// What `G x = −b` leaves in every row, relative to its size; shape `m`, zero in the
    /// independent rows.
    ///
    /// # Errors
    /// [`Singular`] when these are not independent here.
    pub fn left_over(&mut self, b: &[f64]) -> Result<Vec<f64>, Singular> {
        let x = self.correction(b)?;
        let mut left = b.to_vec();
        self.jacobian.mul_add(1.0, &x, &mut left);
        self.saddle.rows().rows().iter().for_each(|&row| left[row] = 0.0);
        left.iter_mut().zip(&self.sizes).for_each(|(left, size)| *left = relative(*left, *size));
        Ok(left)
    }

    /// The independent rows that `row` depends on, by falling weight; empty when they are not
    /// independent here.
    pub fn partners(&mut self, row: usize) -> Vec<usize> {
        let (m, n) = (self.sizes.len(), self.weights.len());
        let mut unit = vec![0.0; m];
        unit[row] = 1.0;
        let mut gradient = vec![0.0; n];
        self.jacobian.tr_mul_add(1.0, &unit, &mut gradient);
        let Ok(x) = self.solve(&gradient, &vec![0.0; m]) else { return Vec::new() };
        let rows = self.saddle.rows().rows();
        let weight = |(c, &row): (&f64, &usize)| (c.abs() * self.sizes[row], row);
        let mut all: Vec<(f64, usize)> = x[n..].iter().zip(rows).map(weight).collect();
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        let largest = all.first().map_or(0.0, |first| first.0);
        all.into_iter().filter(|(w, _)| *w > 1e-6 * largest).map(|(_, row)| row).collect()
    }
}

fn relative(value: f64, size: f64) -> f64 {
    if size > 0.0 { value / size } else { value }
}

/// Looks for constraints that contradict each other at `at` with the velocity `v`; `rows` are
/// independent there. `None` when all agree, or when nothing can be said because the rows are not.
#[must_use]
pub fn contradiction<C: Constraints>(
    constraints: &C,
    rows: &IndependentRows,
    at: Motion<'_>,
) -> Option<Contradiction> {
    rows.redundant().next()?;
    let m = constraints.len();
    let mut dependence = Dependence::new(constraints, rows, at.configuration());
    let rate = at.v.iter().zip(&dependence.weights).map(|(v, w)| v.abs() * w.sqrt());
    let rate = rate.fold(0.0, f64::max); // 1/s
    let mut b = vec![0.0; m];
    constraints.time_derivative(at.t, at.q, &mut b);
    let found = dependence.contradiction(ContradictionLevel::Velocity, &b, VELOCITY * rate);
    found.or_else(|| {
        constraints.acceleration_terms(at.t, at.q, at.v, &mut b);
        dependence.contradiction(
            ContradictionLevel::Acceleration,
            &b,
            VELOCITY * (1.0 + rate) * rate,
        )
    })
}

impl<C: Constraints> Dependence<'_, C> {
    fn contradiction(
        &mut self,
        level: ContradictionLevel,
        b: &[f64],
        floor: f64,
    ) -> Option<Contradiction> {
        if norm_inf(b) <= 0.0 {
            return None;
        }
        let left = self.left_over(b).ok()?;
        let size = b.iter().zip(&self.sizes).map(|(b, size)| relative(b.abs(), *size));
        let size = size.fold(0.0, f64::max);
        let allowances = self.constraints.allowances();
        let over = |i: usize| {
            // what nearly follows from others leaves that much of its size
            let nearly = allowances.get(i).map_or(0.0, |g| 10.0 * relative(*g, self.sizes[i]));
            left[i].abs() / (RELATIVE.max(nearly) * size + floor)
        };
        let worst = (0..left.len()).max_by(|&a, &b| over(a).total_cmp(&over(b)))?;
        if over(worst) <= 1.0 {
            return None;
        }
        let residual = left[worst].abs();
        let rows = std::iter::once(worst).chain(self.partners(worst)).collect();
        Some(Contradiction { level, rows, residual })
    }
}

#[cfg(test)]
#[allow(non_snake_case)] // G
mod tests {
    use super::*;
    use crate::constraints::ConstraintFn;

    /// A point of the plane on a circle of radius 1, twice.
    fn circle() -> impl Constraints {
        ConstraintFn::new(
            2,
            2,
            |q, g| {
                g[0] = 0.5 * (q[0] * q[0] + q[1] * q[1] - 1.0);
                g[1] = 3.0 * g[0];
            },
            |q, G| (0..2).for_each(|j| (G[(0, j)], G[(1, j)]) = (q[j], 3.0 * q[j])),
        )
    }

    /// Two circles that touch at (1, 0): there the gradients are parallel.
    fn touching() -> impl Constraints {
        ConstraintFn::new(
            2,
            2,
            |q, g| {
                g[0] = 0.5 * (q[0] * q[0] + q[1] * q[1] - 1.0);
                g[1] = 0.5 * ((q[0] - 3.0).powi(2) + q[1] * q[1] - 4.0);
            },
            |q, G| {
                (0..2).for_each(|j| G[(0, j)] = q[j]);
                (G[(1, 0)], G[(1, 1)]) = (q[0] - 3.0, q[1]);
            },
        )
    }

    #[test]
    fn constraints_that_agree_are_let_through_and_others_are_named() {
        let at = Configuration::new(0.0, &[1.0, 0.0]);
        for v in [0.0, 1e-17, 1e-8, 1.0, 1e6] {
            let circle = circle();
            let rows = IndependentRows::find(&circle, at.t, at.q);
            assert_eq!(contradiction(&circle, &rows, at.moving(&[0.0, v])), None, "{v:e}");
        }
        let touching = touching();
        let rows = IndependentRows::find(&touching, at.t, at.q);
        assert_eq!(rows.len(), 1);
        assert_eq!(contradiction(&touching, &rows, at.moving(&[0.0, 0.0])), None);
        for v in [1e-6, 1.0, 1e6] {
            let found = contradiction(&touching, &rows, at.moving(&[0.0, v])).unwrap();
            assert_eq!(found.level, ContradictionLevel::Acceleration);
            let mut named = found.rows.clone();
            named.sort_unstable();
            assert_eq!(named, [0, 1]);
        }
    }
}
