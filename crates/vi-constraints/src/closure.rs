//! The residual `g(q_n)` of every step against round-off, and the orientation of bodies.
//!
//! ```text
//! |g_i(q_n)| ≤ max(1e-9, 100 χ_0, 10 τ) Σ_j |G_ij| size_j           i = 1 … m, all constraints
//! ```
//! `size_j` is the size of coordinate `j` in the system, so each row is measured in its own unit;
//! `χ_0` is the same ratio at the start and `τ` the relative tolerance of Newton's method.
//!
//! A scheme solves for independent constraints and relies on the others to follow. Where they do
//! not (prescribed motions that contradict each other, a loop that cannot move, a rank that was
//! misjudged), the residual of a constraint that was left out grows with the motion. Round-off
//! stays below `1e-12` in this measure: the increments are found from `g(q_{n+1}) = 0`, so nothing
//! accumulates, and the enlargement in a constraint that was left out is bounded by the choice of
//! the others ([`crate::saddle_point`]). The bound is three orders above that.
//!
//! Constraints that nearly follow from others keep a residual, which may be as large as stated
//! ([`Constraints::allowances`]); `χ_0` leaves them out.
//!
//! The constraints of rigidity hold for the mirror image of a body, too. Schemes whose unknown is
//! `q_{n+1}` itself may find it in a long step; such a step is refused.

use crate::constraints::Constraints;
use crate::scheme::StepError;
use vi_core::Configuration;

/// Largest residual of round-off, relative to the size of the row.
const ROUND_OFF: f64 = 1e-9;
/// By how much the residual of the start may grow.
const GROWTH: f64 = 100.0;
/// Largest residual that a relative tolerance of Newton's method leaves, in units of it.
const NEWTON: f64 = 10.0;

/// Compares the constraint residual of every node with round-off.
#[derive(Clone, Debug)]
pub struct ClosureWatch {
    g: Vec<f64>,     // m  g(q_n)
    start: Vec<f64>, // m  sizes of the rows at the start, or of the first node that is checked
    sizes: Vec<f64>, // m  those at a node that has moved away: a judgement depends on no other node
    factor: f64,
}

impl ClosureWatch {
    /// From the start `(t, q)`; `tolerance`: relative tolerance of Newton's method.
    #[must_use]
    pub fn new(constraints: &impl Constraints, at: Configuration<'_>, tolerance: f64) -> Self {
        let m = constraints.len();
        let (mut g, mut sizes) = (vec![0.0; m], vec![0.0; m]);
        constraints.value(at, &mut g);
        constraints.row_sizes(at, &mut sizes);
        let allowances = constraints.allowances();
        let ratio = |(i, (g, size)): (usize, (&f64, &f64))| {
            let allowed = allowances.get(i).is_some_and(|allowed| *allowed > 0.0);
            if *size > 0.0 && !allowed { g.abs() / size } else { 0.0 }
        };
        let start = g.iter().zip(&sizes).enumerate().map(ratio).fold(0.0, f64::max);
        let factor = ROUND_OFF.max(GROWTH * start).max(NEWTON * tolerance);
        Self { g, start: sizes.clone(), sizes, factor }
    }

    /// For configurations that are solved for, whatever the residual of the start: `χ_0 = 0`; `m`
    /// constraints.
    #[must_use]
    pub fn of_solved(m: usize, tolerance: f64) -> Self {
        let factor = ROUND_OFF.max(NEWTON * tolerance);
        Self { g: vec![0.0; m], start: Vec::new(), sizes: vec![0.0; m], factor }
    }

    /// Checks the node `(t, q)`.
    ///
    /// # Errors
    /// [`StepError::ConstraintViolated`] with the constraint whose residual is largest relative to
    /// its bound; [`StepError::Reflected`].
    pub fn check(
        &mut self,
        constraints: &impl Constraints,
        at: Configuration<'_>,
    ) -> Result<(), StepError> {
        self.check_residuals(constraints, at)?;
        constraints
            .reflected(at.q)
            .map_or(Ok(()), |coordinate| Err(StepError::Reflected { coordinate }))
    }

    /// The same of a node at which no body can be reflected.
    ///
    /// # Errors
    /// [`StepError::ConstraintViolated`].
    pub fn check_residuals(
        &mut self,
        constraints: &impl Constraints,
        at: Configuration<'_>,
    ) -> Result<(), StepError> {
        constraints.residual(at, &mut self.g);
        let allowances = constraints.allowances();
        if self.holds(&self.start, allowances) {
            return Ok(());
        }
        constraints.row_sizes(at, &mut self.sizes); // the system may have moved away
        if self.start.is_empty() {
            self.start.clone_from(&self.sizes);
        }
        match self.holds(&self.sizes, allowances) {
            true => Ok(()),
            false => Err(self.violation(allowances)),
        }
    }

    /// Whether all residuals are within their bounds; one that is not a number is not.
    fn holds(&self, sizes: &[f64], allowances: &[f64]) -> bool {
        let within = |(g, size): (&f64, &f64)| g.abs() <= self.factor * size;
        if sizes.len() != self.g.len() {
            return false;
        }
        if allowances.is_empty() {
            return self.g.iter().zip(sizes).all(within);
        }
        let all = self.g.iter().zip(sizes).zip(allowances);
        all.into_iter().all(|((g, size), allowed)| within((g, size)) || g.abs() <= *allowed)
    }

    fn violation(&self, allowances: &[f64]) -> StepError {
        let bound = |i: usize| {
            let allowed = allowances.get(i).copied().unwrap_or(0.0);
            allowed.max(self.factor * self.sizes[i])
        };
        let excess = |i: usize| {
            let (g, bound) = (self.g[i].abs(), bound(i));
            if g <= bound {
                0.0
            } else if g.is_nan() {
                f64::INFINITY
            } else {
                g / bound
            }
        };
        let row = (0..self.g.len()).max_by(|&a, &b| excess(a).total_cmp(&excess(b))).unwrap_or(0);
        let (residual, bound) = (self.g[row].abs(), bound(row));
        StepError::ConstraintViolated { row, residual, bound }
    }
}

#[cfg(test)]
#[allow(non_snake_case)] // G
mod tests {
    use super::*;
    use crate::constraints::ConstraintFn;

    /// Two points of the line at distances 1 and 1000.
    fn rods() -> impl Constraints {
        ConstraintFn::new(
            2,
            2,
            |q, g| (g[0], g[1]) = (0.5 * (q[0] * q[0] - 1.0), q[1] - 1000.0),
            |q, G| (G[(0, 0)], G[(1, 1)]) = (q[0], 1.0),
        )
    }

    /// A node far away has large rows. At a later one that is near, they must not excuse a
    /// violation.
    #[test]
    fn a_judgement_does_not_depend_on_earlier_nodes() {
        let rods = rods();
        let start = Configuration::new(0.0, &[1.0, 1000.0]);
        let mut watch = ClosureWatch::new(&rods, start, 0.0);
        let near = Configuration::new(0.0, &[1.0 + 1e-3, 1000.0]);
        let before = watch.check(&rods, near);
        assert!(watch.check(&rods, Configuration::new(0.0, &[1e19, 1000.0])).is_err());
        let after = watch.check(&rods, near);
        println!("{before:?}, {after:?}");
        assert!(before.is_err() && before == after, "{before:?} {after:?}");
    }

    #[test]
    fn round_off_passes_and_a_violation_is_named() {
        let rods = rods();
        let mut watch = ClosureWatch::new(&rods, Configuration::new(0.0, &[1.0, 1000.0]), 0.0);
        assert_eq!(
            watch.check(&rods, Configuration::new(0.0, &[1.0 + 1e-9, 1000.0 - 1e-7])),
            Ok(())
        );
        let violated = watch.check(&rods, Configuration::new(0.0, &[1.0, 1000.01]));
        let Err(StepError::ConstraintViolated { row, residual, bound }) = violated else {
            panic!("{violated:?}");
        };
        assert!(row == 1 && (residual - 0.01).abs() < 1e-9 && bound < 1e-5, "{row} {residual:e}");
        let nan = watch.check(&rods, Configuration::new(0.0, &[f64::NAN, 1000.0]));
        assert!(matches!(nan, Err(StepError::ConstraintViolated { row: 0, .. })), "{nan:?}");
    }

    #[test]
    fn a_loose_tolerance_and_a_start_that_is_off_widen_the_bound() {
        let rods = rods();
        let off = [1.0 + 1e-5, 1000.0];
        let mut strict = ClosureWatch::new(&rods, Configuration::new(0.0, &[1.0, 1000.0]), 0.0);
        assert!(strict.check(&rods, Configuration::new(0.0, &[1.0 + 1e-3, 1000.0])).is_err());
        let mut loose = ClosureWatch::new(&rods, Configuration::new(0.0, &[1.0, 1000.0]), 1e-3);
        assert_eq!(loose.check(&rods, Configuration::new(0.0, &[1.0 + 1e-3, 1000.0])), Ok(()));
        let mut begun_off = ClosureWatch::new(&rods, Configuration::new(0.0, &off), 0.0);
        assert_eq!(begun_off.check(&rods, Configuration::new(0.0, &off)), Ok(()));
    }
}
