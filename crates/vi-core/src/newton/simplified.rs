//! Simplified Newton iterations: corrections by an approximate tangent.
//!
//! They contract by a constant ratio, and are made until they no longer fall: a bound of `1e-15`
//! would leave a part of each correction that has the same sign in every step, and the momentum
//! maps would drift.
//! ```text
//! stagnation size_k ≥ size_{k-1}/2 and size_k ≤ 64ε, or size_k ≥ size_{k-1}, size_{k-2}/2 and size_k ≤ 1e-9
//! level      size has not fallen by half in three iterations, and the residual is round-off ([`NewtonProblem::is_round_off`])
//! ```
//! The residual after the last correction has no part in it and is not evaluated
//! ([`NewtonProblem::settle`]).

use super::{Fault, LEVEL, Newton, NewtonError, NewtonProblem, NewtonReport, Size};
use crate::linear::norm_inf;

/// Simplified iterations in the place of one.
const SWEEPS: usize = 4;

impl Newton {
    /// See [`Newton::solve`].
    pub(super) fn solve_simplified(
        &mut self,
        problem: &mut impl NewtonProblem,
        x: &mut [f64],
    ) -> Result<NewtonReport, NewtonError> {
        let refused = |iteration| move |fault| NewtonError::Refused { fault, iteration };
        let (limit, noise) = (self.settings.max_iterations * SWEEPS, problem.precision().noise);
        let (mut before, mut earlier) = (f64::INFINITY, f64::INFINITY);
        let (mut level, mut growing) = (0, 0);
        let mut size = Size { relative: f64::INFINITY, block: 0 };
        let mut report = NewtonReport::default();
        loop {
            let iteration = report.iterations + 1;
            problem.residual(x, &mut self.r).map_err(refused(report.iterations))?;
            report.evaluations += 1;
            if level >= LEVEL && self.is_round_off(problem, x) {
                break;
            }
            if report.iterations >= limit || growing >= LEVEL {
                return Err(self.not_converged(problem, report.iterations, size));
            }
            size = self.correct(problem, x).map_err(refused(iteration))?;
            (report.iterations, report.last_correction) = (iteration, size.relative);
            if stagnates(size.relative, before, earlier, noise) {
                problem.settle(x, &mut self.r).map_err(refused(iteration))?;
                break;
            }
            level = if size.relative > 0.5 * before { level + 1 } else { 0 };
            growing = if size.relative > before { growing + 1 } else { 0 };
            (earlier, before) = (before, size.relative);
        }
        report.residual = norm_inf(&self.r);
        match report.residual.is_finite() {
            true => Ok(report),
            false => Err(refused(report.iterations)(Fault::NotFinite)),
        }
    }
}

/// Whether a correction by an approximate tangent has reached round-off, from the sizes of the one
/// `before` and of that `earlier` still; `noise`: what round-off alone may cause. Corrections may
/// fall in pairs, so one that does not fall says nothing.
fn stagnates(size: f64, before: f64, earlier: f64, noise: f64) -> bool {
    const ROUND_OFF: f64 = 64.0 * f64::EPSILON;
    (size >= 0.5 * before && size <= ROUND_OFF)
        || (size >= before && size >= 0.5 * earlier && size <= noise)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::newton::{BlockKind, NewtonSettings, Precision, UnknownBlock};

    /// `x = (1, 1)` with corrections that leave the error `(e_2, e_1/1000)`: their sizes fall in
    /// pairs.
    struct Pairs([UnknownBlock; 1]);
    impl NewtonProblem for Pairs {
        fn blocks(&self) -> &[UnknownBlock] {
            &self.0
        }
        fn residual(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
            (r[0], r[1]) = (x[0] - 1.0, x[1] - 1.0);
            Ok(())
        }
        fn correction(&mut self, _x: &[f64], dx: &mut [f64]) -> Result<(), Fault> {
            (dx[0], dx[1]) = (dx[0] - dx[1], dx[1] - 1e-3 * dx[0]);
            Ok(())
        }
        fn precision(&self) -> Precision {
            Precision { is_simplified: true, ..Precision::default() }
        }
    }

    #[test]
    fn corrections_that_fall_in_pairs_are_made_to_the_end() {
        let block = UnknownBlock { kind: BlockKind::Position, range: 0..2, floor: 1e-8 };
        for start in [1e-3, 1e-8, 1e-10, 1e-11] {
            let mut x = [1.0 + start, 1.0 - 1.1 * start];
            let mut newton = Newton::new(2, NewtonSettings::default());
            let report = newton.solve(&mut Pairs([block.clone()]), &mut x).unwrap();
            let error = (x[0] - 1.0).abs().max((x[1] - 1.0).abs());
            println!("from {start:e} to {error:e} in {} corrections", report.iterations);
            assert!(error <= 2.0 * f64::EPSILON, "from {start:e} to {error:e}");
        }
    }
}
