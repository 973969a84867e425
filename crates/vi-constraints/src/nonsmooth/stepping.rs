//! What the steps of a node are solved with.

use super::ContactFault;
use crate::constraints::Constraints;
use crate::discretization::{Discretization, ObserveNode};
use crate::scheme::{Scheme, StepError, StepSolver, SubStep};
use vi_core::newton::NewtonReport;
use vi_core::state::State;

/// What a step is solved with.
pub(crate) struct Stepping<'a, S: Discretization<C>, C> {
    pub(crate) system: &'a S,
    pub(crate) constraints: &'a C,
    pub(crate) scheme: &'a mut dyn Scheme<S, C>,
    pub(crate) solver: &'a mut StepSolver,
    pub(crate) observer: &'a mut S::Observer,
    pub(crate) end: &'a mut State,   // of the last step that was solved
    pub(crate) is_at_start: bool,    // `end` is still the state where the step starts
    pub(crate) report: NewtonReport, // sums of iterations
}

impl<'a, S: Discretization<C>, C: Constraints> Stepping<'a, S, C> {
    pub(crate) fn new(
        (system, constraints): (&'a S, &'a C),
        scheme: &'a mut dyn Scheme<S, C>,
        solver: &'a mut StepSolver,
        observer: &'a mut S::Observer,
        end: &'a mut State,
    ) -> Self {
        let report = NewtonReport::default();
        Self { system, constraints, scheme, solver, observer, end, is_at_start: true, report }
    }

    /// `end` is that of a step whose start it is; `again`: the same step as the last one, with
    /// another impulse.
    pub(super) fn take(&mut self, step: SubStep, again: bool) -> Result<(), StepError> {
        let Self { system, constraints, scheme, solver, end, .. } = self;
        solver.begin_at_last(again);
        let report = solver.advance(&mut **scheme, system, constraints, step, end)?;
        constraints.follow_angles(&end.q, solver.solution(), &mut end.angles);
        self.report.iterations += report.iterations;
        self.report.restarts += report.restarts;
        self.report.residual = self.report.residual.max(report.residual);
        Ok(())
    }

    /// `v ← v̂` at the end of the step.
    pub(super) fn velocity_at_end(&mut self, h: f64, v: &mut [f64]) -> Result<(), StepError> {
        let Self { system, constraints, observer, end, .. } = self;
        let found = observer.velocity(system, constraints, end, h, &end.p, v);
        found.map_err(|_| ContactFault::RankLost.into())
    }

    /// `v ← v̂` of a momentum at the node of a state.
    pub(super) fn velocity(
        &mut self,
        state: &State,
        h: f64,
        p: &[f64],
        v: &mut [f64],
    ) -> Result<(), StepError> {
        let Self { system, constraints, observer, .. } = self;
        let found = observer.velocity(system, constraints, state, h, p, v);
        found.map_err(|_| ContactFault::RankLost.into())
    }
}
