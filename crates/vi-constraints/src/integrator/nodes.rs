//! The nodes of an integration, read.

use super::Integrator;
use super::error::ObserveError;
use crate::constraints::Constraints;
use crate::discretization::{Discretization, ObserveNode, Step};
use crate::fastest_motion::FastestMotions;
use crate::node::{Node, NodeObserver};
use crate::node_solvers::NodeSolvers;
use crate::scheme::SubStep;
use vi_core::linear::Singular;
use vi_core::state::State;
use vi_core::{Configuration, DiscreteLagrangian, Entries};

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
        observer.prescribed_velocity(system, &**constraints, (state, t), &mut v)?;
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
        observer.fastest_motions(system, &**constraints, state, (&emit, counted))
    }
}

impl<S: Discretization<C>, C: Constraints> Integrator<S, C> {
    /// Whether nodes have multipliers; they do unless said otherwise. Without them a node costs
    /// less than a step. A singular start has them always.
    pub fn record_multipliers(&mut self, wanted: bool) {
        self.observer.record_multipliers(wanted);
    }

    /// The quantities of the node that the last macro step has left (the node before the state's).
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn node_before(&mut self) -> Result<&Node, Singular> {
        let of_state = self.reads_states();
        let Self { observer, start_observer, system, constraints, before, state, scheme, .. } =
            self;
        let observer = observer_at(before, observer, start_observer);
        if of_state {
            return observer.observe_state(system, constraints, before, 0.0);
        }
        let step = Step::single(scheme.interval(), &state.memory.multipliers);
        observer.observe(system, constraints, before, step)
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
        let (mut next, last) = (self.state.clone(), self.scheme.interval().clone());
        let t_end = self.origin.time(self.state.step + 1, self.step);
        let Self { observer, start_observer, system, constraints, state, scheme, watch, .. } = self;
        let sub_step = SubStep { index: 0, count: 1, h: self.gammas[0] * self.step, t_end };
        let trial = self
            .solver
            .advance(&mut **scheme, system, &**constraints, sub_step, &mut next)
            .and_then(|_| watch.check(&**constraints, next.configuration()));
        let s = std::mem::replace(scheme.interval_mut(), last);
        trial?;
        let observer = observer_at(state, observer, start_observer);
        let step = Step::single(&s, &next.memory.multipliers);
        Ok(observer.observe(system, constraints, state, step)?)
    }

    /// What can be said of the current node without a step from there: `v̂`, `ᵠp_n`, `H_d(ᵠp_n)`.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn observe_state(&mut self) -> Result<&Node, Singular> {
        let h = if self.reads_states() { 0.0 } else { self.step };
        let Self { observer, start_observer, system, constraints, state, .. } = self;
        let observer = observer_at(state, observer, start_observer);
        observer.observe_state(system, constraints, state, h)
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
        self.find_acceleration_force(&mut force, Some(&mut lambda))?;
        Ok(lambda)
    }

    /// `Gᵀλ` of this multiplier, written to `force`, which gets the shape `n`; `λ`, which gets the
    /// shape `m`, where it is asked for.
    ///
    /// # Errors
    /// As [`Integrator::acceleration_multiplier`].
    pub fn find_acceleration_force(
        &mut self,
        force: &mut Vec<f64>,
        lambda: Option<&mut Vec<f64>>,
    ) -> Result<(), Singular> {
        let Self { observer, start_observer, system, constraints, state, .. } = self;
        let observer = observer_at(state, observer, start_observer);
        force.resize(constraints.dim(), 0.0);
        let lambda = lambda.map(|lambda| {
            lambda.resize(constraints.len(), 0.0);
            &mut lambda[..]
        });
        observer.acceleration_force(system, constraints, state, force, lambda)
    }

    /// Whether nodes are read from their states alone: with a composition or a Galerkin scheme no
    /// quantity of a node belongs to the step from there.
    #[must_use]
    pub fn reads_states(&self) -> bool {
        self.gammas.len() > 1 || self.method.stages().is_some()
    }
}

/// The observer of a node: the start may have its own.
fn observer_at<'a, O>(
    node: &State,
    observer: &'a mut O,
    of_the_start: &'a mut Option<O>,
) -> &'a mut O {
    match of_the_start {
        Some(own) if node.step == 0 => own,
        _ => observer,
    }
}
