//! Newton's method for the steps of any scheme.

use super::equations::{Guess, Scheme};
use super::error::StepError;
use super::sub_step::SubStep;
use vi_core::newton::{
    Fault, Newton, NewtonError, NewtonProblem, NewtonReport, NewtonSettings, Precision,
    UnknownBlock,
};
use vi_core::state::State;

/// Newton's method for the steps of a scheme, with the unknowns.
#[derive(Clone, Debug)]
pub struct StepSolver {
    newton: Newton,
    x: Vec<f64>,
    again: bool,
}

impl StepSolver {
    /// For the unknowns of a scheme.
    #[must_use]
    pub fn new<S, C>(scheme: &dyn Scheme<S, C>, settings: NewtonSettings) -> Self {
        let unknowns = scheme.blocks().iter().map(|block| block.range.end).max().unwrap_or(0);
        Self { newton: Newton::new(unknowns, settings), x: vec![0.0; unknowns], again: false }
    }

    /// The solution of the last step.
    #[must_use]
    pub fn solution(&self) -> &[f64] {
        &self.x
    }

    /// Whether Newton's method of the next steps begins at the solution of the last one before it
    /// takes other guesses: for a step that is taken again with another momentum.
    pub(crate) fn begin_at_last(&mut self, wanted: bool) {
        self.again = wanted;
    }

    /// Takes a sub-step: replaces `(t, q_n, p̄_n)` by the next node.
    ///
    /// # Errors
    /// [`StepError`]; of the state only history and memory may then have changed, which the caller
    /// restores.
    pub fn advance<S, C>(
        &mut self,
        scheme: &mut dyn Scheme<S, C>,
        system: &S,
        constraints: &C,
        step: SubStep,
        state: &mut State,
    ) -> Result<NewtonReport, StepError> {
        let Self { newton, x, again } = self;
        state.history.fit(x.len(), step.count, scheme.alternating(step.count));
        scheme.begin(system, constraints, step, state);
        let mut problem = StepEquations { scheme, system, constraints };
        let mut outcome = solve_step(newton, state, step, *again, &mut problem, x);
        if problem.scheme.renew(constraints, outcome.is_ok()) {
            state.history.clear();
            outcome = solve_step(newton, state, step, false, &mut problem, x);
        }
        let report = outcome?;
        problem.scheme.end(system, constraints, newton, state)?;
        Ok(report)
    }
}

/// The equations of a step as Newton's method sees them.
struct StepEquations<'a, 'b, S, C> {
    scheme: &'a mut (dyn Scheme<S, C> + 'b),
    system: &'a S,
    constraints: &'a C,
}

impl<S, C> NewtonProblem for StepEquations<'_, '_, S, C> {
    fn blocks(&self) -> &[UnknownBlock] {
        self.scheme.blocks()
    }

    fn residual(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        self.scheme.residual(self.system, self.constraints, x, r)
    }

    fn correction(&mut self, x: &[f64], dx: &mut [f64]) -> Result<(), Fault> {
        self.scheme.correction(self.system, self.constraints, x, dx)
    }

    fn settle(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        self.scheme.settle(self.system, self.constraints, x, r)
    }

    fn precision(&self) -> Precision {
        self.scheme.precision()
    }

    fn is_round_off(&mut self, x: &[f64], r: &[f64]) -> bool {
        const PARTS: f64 = 8.0 * f64::EPSILON;
        let sizes = self.scheme.equation_sizes(self.constraints, x);
        sizes.is_some_and(|sizes| r.iter().zip(&sizes).all(|(r, size)| r.abs() <= PARTS * size))
    }

    fn rotation(&self, x: &[f64]) -> f64 {
        self.scheme.rotation(x)
    }
}

/// Solves one step with increasingly robust initial guesses.
fn solve_step<S, C>(
    newton: &mut Newton,
    state: &mut State,
    step: SubStep,
    again: bool,
    problem: &mut StepEquations<'_, '_, S, C>,
    x: &mut [f64],
) -> Result<NewtonReport, StepError> {
    let searching = newton.settings.line_search;
    let mut failure = None;
    for attempt in 0.. {
        let guess = match attempt {
            0 if again => Some(Guess::Plain),
            _ => problem.scheme.guess(problem.system, attempt, step, state, x),
        };
        let Some(guess) = guess.filter(|guess| *guess == Guess::Plain || !searching) else { break };
        newton.settings.line_search = searching || guess == Guess::Damped;
        let outcome = newton.solve(problem, x);
        newton.settings.line_search = searching;
        let accepted = outcome.and_then(|report| match problem.scheme.accept(x) {
            Ok(()) => Ok(report),
            Err(fault) => Err(NewtonError::Refused { fault, iteration: report.iterations }),
        });
        match accepted {
            Ok(mut report) => {
                report.iterations += attempt * newton.settings.max_iterations;
                report.restarts = attempt;
                state.history.remember(step.index, step.h, attempt > 0, x);
                return Ok(report);
            }
            Err(error) => failure = Some(error),
        }
    }
    Err(failure.unwrap_or(NewtonError::Refused { fault: Fault::NotFinite, iteration: 0 }).into())
}
