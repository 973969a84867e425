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
    pub(crate) report: NewtonReport, // sums of iterations
}

impl<'a, S: Discretization<C>, C: Constraints> Stepping<'a, S, C> {
    pub(crate) fn new(
        (system, constraints): (&'a S, &'a C),
        scheme: &'a mut dyn Scheme<S, C>,
        solver: &'a mut StepSolver,
        observer: &'a mut S::Observer,
    ) -> Self {
        Self { system, constraints, scheme, solver, observer, report: NewtonReport::default() }
    }

    pub(super) fn take(&mut self, step: SubStep, state: &mut State) -> Result<(), StepError> {
        let Self { system, constraints, scheme, solver, .. } = self;
        let report = solver.advance(&mut **scheme, system, constraints, step, state)?;
        self.report.iterations += report.iterations;
        self.report.restarts += report.restarts;
        self.report.residual = self.report.residual.max(report.residual);
        Ok(())
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
        let found = observer.velocity(system, constraints, (state, h), p, v);
        found.map_err(|_| ContactFault::RankLost.into())
    }
}
