//! Members as they are read after their steps.

use super::group::MemberReader;
use crate::mechanism::Mechanism;
use crate::solver::run::MechanismIntegrator;
use vi_constraints::discretization::Transition;
use vi_constraints::node::Node;
use vi_core::SeparableSystem;
use vi_core::linear::Singular;
use vi_core::state::State;

/// A member after a step: what can be read of an integrator that has taken it.
#[derive(Debug)]
pub struct Recorded<'a> {
    index: usize,
    run: &'a mut MechanismIntegrator,
}

impl Recorded<'_> {
    /// Its number in the ensemble.
    #[must_use]
    pub fn index(&self) -> usize {
        self.index
    }

    /// The step, with the nodes before and after it.
    #[must_use]
    pub fn transition(&self) -> Transition<'_> {
        self.run.transition()
    }

    /// The state after the step.
    #[must_use]
    pub fn state(&self) -> &State {
        self.run.state()
    }

    /// All quantities of the node where the step started, see
    /// [`vi_constraints::Integrator::node_before`].
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn node_before(&mut self) -> Result<&Node, Singular> {
        self.run.node_before()
    }

    /// What can be said of the node after the step without a step from there, see
    /// [`vi_constraints::Integrator::observe_state`].
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn observe_state(&mut self) -> Result<&Node, Singular> {
        self.run.observe_state()
    }

    /// Its system.
    #[must_use]
    pub fn system(&self) -> &SeparableSystem {
        self.run.system()
    }

    /// Its mechanism.
    #[must_use]
    pub fn mechanism(&self) -> &Mechanism {
        self.run.constraints()
    }
}

/// Where some members are recorded: the first of them is member `first` of the ensemble.
pub(super) struct Outputs<'a, O, F> {
    pub(super) first: usize,
    pub(super) outputs: &'a mut [Option<O>],
    pub(super) read: &'a F,
}

impl<O, F: Fn(&mut O, Recorded<'_>)> MemberReader for Outputs<'_, O, F> {
    fn wants(&self, member: usize) -> bool {
        self.outputs.get(member).is_some_and(Option::is_some)
    }

    fn read(&mut self, member: usize, run: &mut MechanismIntegrator) {
        if let Some(Some(output)) = self.outputs.get_mut(member) {
            (self.read)(output, Recorded { index: self.first + member, run });
        }
    }
}
