//! The nodes of an integration, read.

use super::Integrator;
use super::error::ObserveError;
use crate::constraints::Constraints;
use crate::discretization::{Discretization, ObserveNode, Transition};
use crate::fastest_motion::FastestMotions;
use crate::node::{Node, NodeObserver};
use crate::node_solvers::NodeSolvers;
use crate::nonsmooth::Stepping;
use crate::scheme::{StepError, SubStep};
use vi_core::interval::Interval;
use vi_core::linear::Singular;
use vi_core::state::State;
use vi_core::{Configuration, DiscreteLagrangian, Entries};

/// A node, seen from the last macro step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NodeInStep {
    /// Where it started.
    Before,
    /// Where it ended: the present node.
    #[default]
    After,
}

/// A step that was taken on a copy of the state.
pub(super) struct TrialStep {
    end: State,
    interval: Interval,
}

impl Default for TrialStep {
    fn default() -> Self {
        Self { end: State::default(), interval: Interval::new(0) }
    }
}

impl NodeInStep {
    fn of<'a>(self, before: &'a State, after: &'a State) -> &'a State {
        match self {
            Self::Before => before,
            Self::After => after,
        }
    }
}

impl<S: Discretization<C, Observer = NodeObserver>, C: Constraints> Integrator<S, C> {
    /// Reads nodes with what the mechanism offers in the place of the saddle-point matrix.
    #[must_use]
    pub fn reading_with(mut self, solvers: NodeSolvers) -> Self {
        self.observer.solve_with(solvers);
        self
    }

    /// `v̂` of no momentum in the present configuration at the time `t`, s: the least motion that
    /// prescribed motions need. Shape `n`.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn prescribed_velocity(&mut self, t: f64) -> Result<Vec<f64>, Singular>
    where
        S: DiscreteLagrangian,
    {
        let Self { observer, start_observer, system, constraints, state, .. } = self;
        let mut v = vec![0.0; constraints.dim()];
        let observer = observer_at(state, observer, start_observer);
        observer.prescribed_velocity(system, &**constraints, state, t, &mut v)?;
        Ok(v)
    }

    /// The fastest motions about the current node ([`crate::fastest_motion`]): with the stiffness
    /// of potentials and constraint forces, and with that of the forces of those constraints alone
    /// that are `counted`; `stiffness` emits `∇²V`, shape `n × n`.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank, or a direction they leave free has no
    /// mass.
    pub fn fastest_motions(
        &mut self,
        stiffness: &dyn Fn(&S, Configuration<'_>, &mut dyn Entries),
        counted: &dyn Fn(usize) -> bool,
    ) -> Result<FastestMotions, Singular>
    where
        S: DiscreteLagrangian,
    {
        let Self { observer, start_observer, system, constraints, state, .. } = self;
        let emit = |out: &mut dyn Entries| stiffness(system, state.configuration(), out);
        let observer = observer_at(state, observer, start_observer);
        observer.fastest_motions(system, &**constraints, state, &emit, counted)
    }
}

impl<S: Discretization<C>, C: Constraints> Integrator<S, C> {
    /// Whether nodes have multipliers; they do unless said otherwise. Without them a node costs
    /// less than a step. A singular start has them always.
    pub fn record_multipliers(&mut self, wanted: bool) {
        self.observer.record_multipliers(wanted);
    }

    /// The last macro step: the node before it, the step, the node after it.
    #[must_use]
    pub fn transition(&self) -> Transition<'_> {
        let impulse = self.nonsmooth.as_ref().map(|contacts| contacts.impulse());
        Transition::single(&self.before, self.scheme.interval(), &self.state)
            .with_impulse(impulse.unwrap_or_default())
    }

    /// The state of a node next to the last macro step.
    #[must_use]
    pub fn at(&self, when: NodeInStep) -> &State {
        when.of(&self.before, &self.state)
    }

    /// The quantities of the node that the last macro step started from, by
    /// [`Integrator::transition`].
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn node_before(&mut self) -> Result<&Node, Singular> {
        if self.reads_states() {
            return self.observe_state_at(NodeInStep::Before);
        }
        let Self { observer, start_observer, system, constraints, before, state, scheme, .. } =
            self;
        let impulse = self.nonsmooth.as_ref().map(|contacts| contacts.impulse());
        let impulse = impulse.unwrap_or_default();
        let observer = observer_at(before, observer, start_observer);
        let taken = Transition::single(before, scheme.interval(), state).with_impulse(impulse);
        observer.observe(system, constraints, taken)
    }

    /// The quantities of the current node. At order 2 most of them belong to the step that starts
    /// here: it is taken on a copy of the state.
    ///
    /// # Errors
    /// [`ObserveError`] when that step fails or the constraints have lost rank.
    pub fn observe(&mut self) -> Result<&Node, ObserveError> {
        if self.reads_states() {
            return Ok(self.observe_state()?);
        }
        self.try_step()?;
        let Self { observer, start_observer, system, constraints, state, trial, .. } = self;
        let observer = observer_at(state, observer, start_observer);
        let impulse = self.nonsmooth.as_ref().map(|contacts| contacts.trial_impulse());
        let taken = Transition::single(state, &trial.interval, &trial.end)
            .with_impulse(impulse.unwrap_or_default());
        Ok(observer.observe(system, constraints, taken)?)
    }

    /// Takes the step from the present node on a copy of the state.
    fn try_step(&mut self) -> Result<(), StepError> {
        let t_end = self.origin.time(self.state.step + 1, self.step);
        let Self { observer, start_observer, system, constraints, state, scheme, watch, .. } = self;
        let TrialStep { end, interval } = &mut *self.trial;
        end.copy_from(state);
        if interval.dim() != end.q.len() {
            *interval = Interval::new(end.q.len());
        }
        interval.copy_from(scheme.interval());
        let sub_step = SubStep { index: 0, count: 1, h: self.gammas[0] * self.step, t_end };
        let observer = observer_at(state, observer, start_observer);
        let solver = &mut self.solver;
        let kept = self.nonsmooth.as_mut().map(|contacts| contacts.set_aside());
        let taken = match &mut self.nonsmooth {
            None => solver.advance(&mut **scheme, system, &**constraints, sub_step, end),
            Some(contacts) => {
                let parts = (&*system, &**constraints);
                let mut run = Stepping::new(parts, &mut **scheme, solver, observer, end);
                contacts.advance(&mut run, sub_step, Some(state), &mut None)
            }
        };
        let taken = taken.and_then(|_| watch.check(&**constraints, end.configuration()));
        let taken = taken.map(|_| ());
        std::mem::swap(scheme.interval_mut(), interval);
        if let (Some(kept), Some(contacts)) = (kept, &mut self.nonsmooth) {
            contacts.put_back(kept, taken.is_ok());
        }
        taken
    }

    /// Finds what contacts add to the momentum of the present node up to the arrival there, of a
    /// step on a copy of the state: nothing where that step is not found.
    fn find_arrival(&mut self) {
        if self.nonsmooth.is_some() {
            let _ = self.try_step();
        }
    }

    /// The present node as the last step arrives there: what stays closed holds, nothing is hit.
    /// Without contacts that is [`Integrator::observe_state`]; with them the nodes of the trial are
    /// those of [`crate::nonsmooth::Nonsmooth::trial_nodes`].
    ///
    /// # Errors
    /// As [`Integrator::observe_state`].
    pub fn observe_arrival(&mut self) -> Result<&Node, Singular> {
        self.find_arrival();
        let h = if self.reads_states() { 0.0 } else { self.step };
        let Self { observer, start_observer, system, constraints, state, nonsmooth, .. } = self;
        let impulse = nonsmooth.as_ref().map_or(&[][..], |contacts| contacts.trial_arrival());
        let observer = observer_at(state, observer, start_observer);
        observer.observe_state(system, constraints, state, impulse, h)
    }

    /// What can be said of the current node without a step from there: `v̂`, `ᵠp_n`, `H_d(ᵠp_n)`.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn observe_state(&mut self) -> Result<&Node, Singular> {
        self.observe_state_at(NodeInStep::After)
    }

    /// The same of either node next to the last macro step.
    ///
    /// # Errors
    /// As [`Integrator::observe_state`].
    pub fn observe_state_at(&mut self, when: NodeInStep) -> Result<&Node, Singular> {
        let h = if self.reads_states() { 0.0 } else { self.step };
        let Self { observer, start_observer, system, constraints, before, state, .. } = self;
        let at = when.of(before, state);
        let observer = observer_at(at, observer, start_observer);
        observer.observe_state(system, constraints, at, &[], h)
    }

    /// `v̂` of the present node alone, shape `n`, as the last step arrives there: what was observed
    /// of a node stays. Of variational schemes.
    ///
    /// # Errors
    /// As [`Integrator::observe_state`].
    pub fn velocity(&mut self, v: &mut [f64]) -> Result<(), Singular> {
        self.find_arrival();
        let h = if self.reads_states() { 0.0 } else { self.step };
        let Self { observer, start_observer, system, constraints, state, nonsmooth, .. } = self;
        let observer = observer_at(state, observer, start_observer);
        let Some(contacts) = nonsmooth else {
            return observer.velocity(system, constraints, state, h, &state.p, v);
        };
        let p = &mut self.trial.end.p; // which nobody reads any more
        p.copy_from_slice(&state.p);
        p.iter_mut().zip(contacts.trial_arrival()).for_each(|(p, impulse)| *p += impulse);
        observer.velocity(system, constraints, state, h, p, v)
    }

    /// What was last observed at the node of a state: [`Integrator::state`], or
    /// [`Integrator::before`] after [`Integrator::node_before`].
    #[must_use]
    pub fn observed(&self, at: &State) -> &Node {
        match &self.start_observer {
            Some(own) if at.step == 0 => own.node(),
            _ => self.observer.node(),
        }
    }

    /// The acceleration-level multiplier at the current node, with the velocity of the projected
    /// momentum; it has the order of the composition.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn acceleration_multiplier(&mut self) -> Result<Vec<f64>, Singular> {
        let (mut force, mut lambda) = (Vec::new(), Vec::new());
        self.find_acceleration(NodeInStep::After, &mut force, Some(&mut lambda))?;
        Ok(lambda)
    }

    /// `Gᵀλ` of this multiplier at a node next to the last macro step, written to `force`, which
    /// gets the shape `n`; `λ`, which gets the shape `m`, where it is asked for. Of the node that
    /// is returned [`Node::acceleration`] is that of the acceleration level.
    ///
    /// # Errors
    /// As [`Integrator::acceleration_multiplier`].
    pub fn find_acceleration(
        &mut self,
        when: NodeInStep,
        force: &mut Vec<f64>,
        lambda: Option<&mut Vec<f64>>,
    ) -> Result<&Node, Singular> {
        let Self { observer, start_observer, system, constraints, before, state, .. } = self;
        let at = when.of(before, state);
        let observer = observer_at(at, observer, start_observer);
        force.resize(constraints.dim(), 0.0);
        let lambda = lambda.map(|lambda| {
            lambda.resize(constraints.len(), 0.0);
            &mut lambda[..]
        });
        observer.acceleration_force(system, constraints, at, force, lambda)?;
        Ok(observer.node())
    }

    /// Whether nodes are read from their states alone: with a composition or a Galerkin scheme no
    /// quantity of a node belongs to the step from there.
    #[must_use]
    pub fn reads_states(&self) -> bool {
        self.gammas.len() > 1 || self.method.stages().is_some()
    }
}

/// The observer of a node: the start may have its own.
pub(super) fn observer_at<'a, O>(
    node: &State,
    observer: &'a mut O,
    of_the_start: &'a mut Option<O>,
) -> &'a mut O {
    match of_the_start {
        Some(own) if node.step == 0 => own,
        _ => observer,
    }
}
