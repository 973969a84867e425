//! The equations of a step: the interface of all schemes.

use super::condition::ConditionNumbers;
use super::error::StepError;
use super::sub_step::SubStep;
use crate::galerkin::GaussPoint;
use std::ops::Range;
use vi_core::interpolation::StepPolynomial;
use vi_core::interval::Interval;
use vi_core::newton::{Fault, Newton, Precision, UnknownBlock};
use vi_core::predictor::Degree;
use vi_core::state::State;

/// How Newton's method starts from an initial guess.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Guess {
    /// With full corrections.
    Plain,
    /// With a line search.
    Damped,
}

/// One of the schemes: the equations of a step `r(x) = 0`, with their workspace.
///
/// Nothing in it influences a later step but through the [`State`]. Call order within a step:
/// `begin`, then for each iteration `residual`, `correction`; `end` when the step is taken.
/// [`StepSolver`](super::StepSolver) does so.
pub trait Scheme<S, C>: Send {
    /// Units and scales of the unknowns; together the blocks cover all of them.
    fn blocks(&self) -> &[UnknownBlock];
    /// Opens a step at a state.
    fn begin(&mut self, system: &S, constraints: &C, step: SubStep, state: &mut State);
    /// `r ← r(x)`, shape of `x`.
    ///
    /// # Errors
    /// [`Fault`] when `x` is outside the domain of the equations.
    fn residual(
        &mut self,
        system: &S,
        constraints: &C,
        x: &[f64],
        r: &mut [f64],
    ) -> Result<(), Fault>;
    /// `dx ← (∂r/∂x)⁻¹ dx` at the point of the last residual.
    ///
    /// # Errors
    /// [`Fault::SingularTangent`].
    fn correction(
        &mut self,
        system: &S,
        constraints: &C,
        x: &[f64],
        dx: &mut [f64],
    ) -> Result<(), Fault>;
    /// See [`NewtonProblem::settle`](vi_core::newton::NewtonProblem::settle).
    ///
    /// # Errors
    /// [`Fault`] when `x` is outside the domain of the equations.
    fn settle(
        &mut self,
        system: &S,
        constraints: &C,
        x: &[f64],
        r: &mut [f64],
    ) -> Result<(), Fault> {
        self.residual(system, constraints, x, r)
    }
    /// How exactly the equations can be solved, and what is known of the solution.
    fn precision(&self) -> Precision {
        Precision::default()
    }
    /// `Σ_j |K_ij| size_j` of each equation at `x`, with the matrix of the last correction:
    /// rounding changes the residual by a few `ε` of that. `None`: not known. Allocates; asked only
    /// where the residual has stopped to fall.
    fn equation_sizes(&mut self, _constraints: &C, _x: &[f64]) -> Option<Vec<f64>> {
        None
    }
    /// See [`NewtonProblem::rotation`](vi_core::newton::NewtonProblem::rotation).
    fn rotation(&self, _x: &[f64]) -> f64 {
        0.0
    }
    /// Writes an initial guess of the unknowns of the step that was begun, each `attempt` a more
    /// robust one; `None`: no more. By default the extrapolated increment, the last one, and zero
    /// with a line search.
    fn guess(
        &mut self,
        _system: &S,
        attempt: usize,
        step: SubStep,
        state: &State,
        x: &mut [f64],
    ) -> Option<Guess> {
        let degree = if attempt == 0 { self.precision().degree } else { Degree::Zero };
        let known = state.history.predict(step.index, step.h, degree, x);
        match attempt + usize::from(attempt > 0 && !known) {
            0 if known => Some(Guess::Plain),
            0 => {
                x.fill(0.0);
                Some(Guess::Plain)
            }
            1 => Some(Guess::Plain),
            2 => {
                x.fill(0.0);
                Some(Guess::Damped)
            }
            _ => None,
        }
    }
    /// Whether a solution is that of the step.
    ///
    /// # Errors
    /// [`Fault`] when it is not.
    fn accept(&self, _x: &[f64]) -> Result<(), Fault> {
        Ok(())
    }
    /// The unknowns that alternate from step to step around a smooth course.
    fn alternating(&self, _sub_steps: usize) -> Range<usize> {
        0..0
    }
    /// After a step that was `solved` or not: whether other constraints are used from now on. The
    /// history is then void, and the step is to be solved again.
    fn renew(&mut self, _constraints: &C, _solved: bool) -> bool {
        false
    }
    /// Moves the state to the end of the step that `newton` has solved.
    ///
    /// # Errors
    /// [`StepError`]; of the state only history and memory may then have changed.
    fn end(
        &mut self,
        system: &S,
        constraints: &C,
        newton: &Newton,
        state: &mut State,
    ) -> Result<(), StepError>;
    /// Computes the Gauss nodes of the step that was taken, where the scheme has them.
    fn interpolate(&mut self) {}
    /// The Gauss nodes of the last [`Scheme::interpolate`], of Galerkin schemes; the others have
    /// none.
    fn gauss(&self) -> &[GaussPoint] {
        &[]
    }
    /// The polynomial of the last [`Scheme::interpolate`], of Galerkin schemes.
    fn polynomial(&self) -> Option<StepPolynomial<'_>> {
        None
    }
    /// The interval of the last step.
    fn interval(&self) -> &Interval;
    /// The same, to put back the one before a trial step.
    fn interval_mut(&mut self) -> &mut Interval;
    /// Condition numbers of the Newton matrix of the last step, which had the solution `x` (dense:
    /// for studies, not for runs).
    fn condition(&mut self, _system: &S, _constraints: &C, _x: &[f64]) -> Option<ConditionNumbers> {
        None
    }
}
