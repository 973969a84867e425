//! All derivatives of the cost of a run, by one sweep backward.
//!
//! ```text
//! a_N = ∂Φ/∂q_N,   b_N = ∂Φ/∂p̄_N;   from step to step [2.38] with ∂ℓ/∂q_{n+1} added before and
//! ∂ℓ/∂q_n after it
//! dJ/dw_n  = ∂ℓ/∂w_n + (f_w^+)ᵀ b' − (f_w^-)ᵀ μ                                         [2.39]
//! dJ/dθ   += ((D_2 L_d + f_d^+)_θ)ᵀ b' − b_θᵀ μ − g_θ(q')ᵀ σ                              [2.40]
//! dJ/dh    likewise, with t_n − t_0 in proportion to h, and ∂ℓ/∂h
//! ```
//! The price is one linear solve for each step, whatever the number of controls and parameters. The
//! four schemes have the same motion, so one recursion serves them all; compositions are their
//! sub-steps. A Galerkin step has [2.50] in the place of [2.38], and [2.39], [2.40] part by part
//! ([`NodePlace`]). What a derivative takes as fixed: the number of steps, the enforced
//! constraints, the revolutions of angles. Newton's method has no derivative: a tolerance other
//! than zero makes one wrong by as much.
//!
//! Source: S. Ober-Blöbaum, O. Junge, J. E. Marsden, ESAIM COCV 17 (2011) 322–352, for the discrete
//! adjoint of forced variational integrators.

use crate::backward::{BackwardForces, StepsBeside};
use crate::checkpoints::{CheckpointSizes, Checkpoints, levels};
use crate::controls::Controls;
use crate::objective::{NodeCost, NodePlace, NotedNode, Objective, StepGradient, Which};
use crate::tape::{Taken, Tape};
use vi_constraints::costate_sweep::{CostateSweep, CostateTangents, Linearization};
use vi_constraints::design::{Design, Place};
use vi_constraints::linearization::{Costate, LinearizationError, Sources};
use vi_constraints::scheme::StepError;
use vi_constraints::{Constraints, Integrator};
use vi_core::discrete_lagrangian::{DiscreteLagrangian, NoStepSlope};
use vi_core::galerkin::Stages;
use vi_core::interval::{Interval, Slot, StepChange};
use vi_core::linear::dot;
use vi_core::sparse::{Block, Product};
use vi_core::state::State;

/// Why a run has no gradient.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GradientError {
    /// A step of the run was refused.
    #[error("step {step} of the run: {error}")]
    Step {
        /// Number of the step, from 1.
        step: usize,
        /// Why.
        error: StepError,
    },
    /// A linearized step is singular.
    #[error("the linearized step {step} is singular")]
    Singular {
        /// Number of the step, from 1.
        step: usize,
    },
    /// A parameter opens a redundant loop.
    #[error(
        "step {step}: with what is changed, constraint {row} of a redundant loop does not hold"
    )]
    Opens {
        /// Number of the step, from 1.
        step: usize,
        /// The constraint.
        row: usize,
    },
    /// A number of multipliers is not determined at a node.
    #[error(
        "step {step}: a reaction, a tension or an effort of a constraint that counts is not \
         determined there, since constraint {row} of a loop depends on the others"
    )]
    Undetermined {
        /// Number of the step from there, from 1.
        step: usize,
        /// The constraint.
        row: usize,
    },
    /// The cost or its derivatives are no numbers.
    #[error(
        "something that counts is not determined on the way, as a reaction in a redundant loop"
    )]
    NotANumber,
    /// Something of the run has no derivative here.
    #[error("a run with {what} has no derivatives")]
    NotDifferentiable {
        /// What.
        what: &'static str,
    },
    /// Something of the run has no derivative by the time step.
    #[error(transparent)]
    TimeStep(#[from] NoStepSlope),
}

impl GradientError {
    /// Of a macro step, by its place.
    pub(crate) fn of_linearization(step: usize, error: LinearizationError) -> Self {
        let step = step + 1;
        match error {
            LinearizationError::Opens { row, .. } => Self::Opens { step, row },
            LinearizationError::Undetermined { row } => Self::Undetermined { step, row },
            _ => Self::Singular { step },
        }
    }
}

/// What is differentiated.
#[derive(Clone, Copy)]
pub struct Task<'a> {
    /// Number of macro steps.
    pub steps: usize,
    /// The cost.
    pub objective: &'a Objective,
    /// What acts.
    pub controls: &'a Controls,
    /// Parameters, if any.
    pub design: Option<&'a dyn Design>,
    /// Whether also by the length of all steps.
    pub by_step: bool,
    /// What is kept of the run.
    pub checkpoints: Checkpoints,
}

impl Task<'_> {
    /// Whether nodes count, or are sampled: each then has the momentum of its velocity.
    fn keeps_nodes(&self) -> bool {
        self.objective.counts_nodes() || self.controls.sampling().is_some()
    }
}

impl std::fmt::Debug for Task<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Task").field("steps", &self.steps).finish_non_exhaustive()
    }
}

/// What is seen of a run while it runs, each once and in order.
#[derive(Clone, Copy, Debug)]
pub enum Passing<'a> {
    /// A (sub-)step of the macro step of this number, from 0.
    Step(&'a Interval, usize),
    /// The node where that macro step ends; controls act as from there.
    Node(&'a State, usize),
}

/// The cost of a run and its derivatives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gradient {
    /// `J`.
    pub value: f64,
    /// By `q_0`, `p̄_0` and the internal variables at the start, on tangents; that of parameters
    /// through the start is [`Gradient::parameters`] without it.
    pub initial: Costate,
    /// By parameters, with the start held.
    pub parameters: Vec<f64>,
    /// By the values of controls, in their order.
    pub controls: Vec<Vec<f64>>,
    /// By the length of all steps at a fixed number of them, where it was asked for.
    pub step: Option<f64>,
    /// By how much the derivatives by a kick, `|b_n|_M`, grow at most where the time to the end of
    /// the run doubles; 1 of runs too short to tell. A motion that drifts has 2, one along whose
    /// path something counts less than [`SUSPECT`]; more is a sign of growth, which
    /// [`crate::growth`] measures.
    pub swelling: f64,
}

/// From which [`Gradient::swelling`] on a motion may be chaotic.
pub const SUSPECT: f64 = 16.0;

/// The largest derivatives by a kick while the time to the end doubles again and again.
#[derive(Default)]
struct Swelling {
    steps: usize,      // to the end
    largest: Vec<f64>, // |b|_M², of steps 2^k … 2^{k+1} − 1
    impulse: Vec<f64>, // M b
}

impl Swelling {
    /// First steps, which tell little.
    const FIRST: usize = 2;

    fn see(&mut self, system: &impl DiscreteLagrangian, b: &[f64]) {
        self.impulse.clear();
        self.impulse.resize(b.len(), 0.0);
        system.mass().mul_add(1.0, b, &mut self.impulse);
        self.steps += 1;
        let k = self.steps.ilog2() as usize;
        self.largest.resize(k + 1, 0.0);
        self.largest[k] = self.largest[k].max(dot(&self.impulse, b));
    }

    fn found(&self) -> f64 {
        let all = self.largest.get(Self::FIRST..).unwrap_or_default().windows(2);
        let ratio = |own: &[f64]| if own[1] > 0.0 { (own[1] / own[0]).sqrt() } else { 1.0 };
        all.map(ratio).fold(1.0, f64::max)
    }
}

/// Refuses runs whose steps have no derivatives here.
pub(crate) fn check<S, C>(run: &Integrator<S, C>) -> Result<(), GradientError>
where
    S: DiscreteLagrangian + 'static,
    C: Constraints + 'static,
{
    let refused = |what| Err(GradientError::NotDifferentiable { what });
    if run.nonsmooth().is_some() {
        return refused("contacts, joint stops or dry friction");
    }
    Ok(())
}

/// Refuses runs with sampled values of which nothing more is known.
pub(crate) fn check_sampling<S, C>(
    run: &Integrator<S, C>,
    controls: &Controls,
) -> Result<(), GradientError>
where
    S: DiscreteLagrangian + 'static,
    C: Constraints + 'static,
{
    let what = "values that are sampled at nodes";
    match run.system().is_sampled() && controls.sampling().is_none() {
        true => Err(GradientError::NotDifferentiable { what }),
        false => Ok(()),
    }
}

/// Refuses derivatives by the length of the steps of what has internal variables.
pub(crate) fn check_by_step<S, C>(
    run: &Integrator<S, C>,
    by_step: bool,
) -> Result<(), GradientError>
where
    S: DiscreteLagrangian + 'static,
    C: Constraints + 'static,
{
    let what = "internal variables, by the length of its steps,";
    match by_step && run.system().internal_variables() > 0 {
        true => Err(GradientError::NotDifferentiable { what }),
        false => Ok(()),
    }
}

impl Gradient {
    /// Runs from the present state and sweeps back; the run is at its last node then.
    ///
    /// # Errors
    /// [`GradientError`]; the run is then anywhere.
    pub fn of<S, C>(run: &mut Integrator<S, C>, task: &Task<'_>) -> Result<Self, GradientError>
    where
        S: DiscreteLagrangian + 'static,
        C: Constraints + 'static,
    {
        Self::watched(run, task, &mut |_| ())
    }

    /// The same, and `watch` sees the run forward.
    ///
    /// # Errors
    /// As of [`Gradient::of`].
    pub fn watched<S, C>(
        run: &mut Integrator<S, C>,
        task: &Task<'_>,
        watch: &mut dyn FnMut(Passing<'_>),
    ) -> Result<Self, GradientError>
    where
        S: DiscreteLagrangian + 'static,
        C: Constraints + 'static,
    {
        check(run)?;
        check_sampling(run, task.controls)?;
        let state = run.state();
        let (n, m) = (state.q.len(), run.constraints().len());
        let stages = run.method().stages().map_or(1, Stages::count);
        let sizes = CheckpointSizes {
            state: size_of::<f64>() * 13 * n,
            step: Tape::size(n, stages, state.angles.len(), state.internal.len()),
        };
        check_by_step(run, task.by_step)?;
        let levels = levels(task.checkpoints, task.steps, sizes);
        // where nodes cost, p̃ has to be a momentum of their velocity
        let counts_forces = task.objective.counts_forces();
        let counts_steps = task.objective.counts_steps();
        let moves = task.design.is_some_and(Design::moves_constraints);
        let along = match (moves, task.design.is_some_and(Design::reads_moved)) {
            _ if task.keeps_nodes() => CostateTangents::OfBodies,
            (true, true) => CostateTangents::OfMovedMechanism,
            (true, false) => CostateTangents::OfBodies,
            (false, _) => CostateTangents::OfMechanism,
        };
        if counts_steps && (run.reads_states() || task.steps == 0) {
            let what = "multipliers or accelerations of steps that are not of order 2";
            return Err(GradientError::NotDifferentiable { what });
        }
        let fast = run.costate_sweep(along).filter(|own| !counts_forces || own.takes_impulses());
        let general = || Box::new(Linearization::new(run.method(), n, m, run.rows())) as Box<_>;
        let controls = task.controls.values().iter().map(|row| vec![0.0; row.len()]).collect();
        task.objective.follow(state, NotedNode::First);
        let parameters = vec![0.0; task.design.map_or(0, Design::len)];
        let mut sweep = BackwardSweep {
            task,
            watch,
            start: state.t,
            number: state.step,
            costates: fast.unwrap_or_else(general),
            settles: along == CostateTangents::OfMovedMechanism,
            forces: BackwardForces::zero(n, m, state.internal.len()),
            beyond: Tape::default(),
            costate: Costate::zero(n, state.internal.len()),
            p: state.p.clone(),
            dq: vec![0.0; n],
            begin: vec![0.0; n],
            carried: vec![0.0; n],
            nodes: Vec::new(),
            of_step: StepGradient::zero(n, task.controls.count()),
            sources: Sources::zero(n, m),
            sums: vec![0.0; task.design.map_or(0, Design::sums)],
            tape: Tape::default(),
            found: Self { controls, parameters, ..Self::default() },
            by_step: 0.0,
            swelling: Swelling::default(),
            first: true,
        };
        sweep.piece(run, 0..task.steps, &levels)?;
        let BackwardSweep { costate, mut found, by_step, start, sums, swelling, .. } = sweep;
        found.swelling = swelling.found();
        if !found.value.is_finite() || costate.q.iter().any(|a| !a.is_finite()) {
            return Err(GradientError::NotANumber);
        }
        if let Some(design) = task.design {
            design.add_gradient(&sums, &mut found.parameters);
        }
        found.initial = costate;
        // per unit of a macro step
        let length = (run.state().t - start) / task.steps as f64;
        found.step = task.by_step.then(|| by_step / length);
        Ok(found)
    }
}

/// Whether steps leave the momentum that is held in the state: Galerkin steps, by [2.29].
fn keeps_momentum<S, C>(run: &Integrator<S, C>) -> bool
where
    S: DiscreteLagrangian + 'static,
    C: Constraints + 'static,
{
    run.method().stages().is_some()
}

/// A node with the momentum that is held there.
fn holding(node: &State, p: &[f64]) -> State {
    let own = State::new(node.t, node.q.clone(), p.to_vec());
    State { angles: node.angles.clone(), internal: node.internal.clone(), ..own }
}

/// A sweep backward under way.
struct BackwardSweep<'a, S, C> {
    task: &'a Task<'a>,
    watch: &'a mut dyn FnMut(Passing<'_>),
    start: f64,  // t_0
    number: u64, // of the node there
    costates: Box<dyn CostateSweep<S, C>>,
    settles: bool, // the first step finds multipliers, so that its start counts by itself
    forces: BackwardForces,
    beyond: Tape, // the step from the last node, where its multipliers cost
    costate: Costate,
    p: Vec<f64>,       // n  the momentum that is held where the run is
    dq: Vec<f64>,      // n  the increments of the step that ends there
    begin: Vec<f64>,   // n  the same where what is recorded begins
    carried: Vec<f64>, // n  by the node before, of what the node swept back to costs
    nodes: Vec<State>, // of the recorded macro steps, with p̃, where they cost or are sampled
    of_step: StepGradient,
    sources: Sources,
    sums: Vec<f64>, // over the steps, of parameters
    tape: Tape,
    found: Gradient,
    by_step: f64,
    swelling: Swelling,
    first: bool, // the run was not at its end yet
}

impl<S: DiscreteLagrangian + 'static, C: Constraints + 'static> BackwardSweep<'_, S, C> {
    /// Sweeps back over macro steps; the run is where they start, and afterwards where they end.
    fn piece(
        &mut self,
        run: &mut Integrator<S, C>,
        steps: std::ops::Range<usize>,
        levels: &[usize],
    ) -> Result<(), GradientError> {
        let [_, lower @ ..] = levels else { return Ok(()) };
        let Some(&length) = lower.first() else {
            self.record(run, steps)?;
            return self.back(run);
        };
        let mut kept: Vec<(usize, State, [Vec<f64>; 2])> = Vec::new();
        let (first, mut at) = (self.first, steps.start);
        while at < steps.end {
            kept.push((at, run.state().clone(), [self.p.clone(), self.dq.clone()]));
            let end = (at + length).min(steps.end);
            if end < steps.end {
                self.forward(run, at..end, first)?;
            }
            at = end;
        }
        let mut end = steps.end;
        let mut last = None;
        for (at, state, [p, dq]) in kept.iter().rev() {
            run.place_at(state);
            self.p.copy_from_slice(p);
            self.dq.copy_from_slice(dq);
            self.first &= end == steps.end;
            self.piece(run, *at..end, lower)?;
            last.get_or_insert_with(|| run.state().clone());
            end = *at;
        }
        if let Some(last) = last {
            run.place_at(&last);
        }
        Ok(())
    }

    /// Takes macro steps; their cost counts where it was not counted before.
    fn forward(
        &mut self,
        run: &mut Integrator<S, C>,
        steps: std::ops::Range<usize>,
        counts: bool,
    ) -> Result<(), GradientError> {
        let Task { objective, controls, .. } = *self.task;
        let keeps = keeps_momentum(run);
        let Self { found, costates, p, dq, watch, .. } = self;
        let last = steps.end - 1;
        controls.set(steps.start);
        let mut nodes = counts.then(|| NodeCost::of(objective, run.state()));
        for step in steps {
            controls.set(step);
            let w = controls.at(step);
            let taken = run.step_with(&mut |system, _, taken| {
                if counts {
                    found.value += objective.of_step(taken.s, w);
                    watch(Passing::Step(taken.s, step));
                }
                if step == last {
                    if !keeps {
                        costates.momentum(system, taken.s, p);
                    }
                    dq.copy_from_slice(&taken.s.dq);
                }
            });
            taken.map_err(|error| GradientError::Step { step: step + 1, error })?;
            if step == last && keeps {
                p.copy_from_slice(&run.state().p);
            }
            if let Some(nodes) = &mut nodes {
                controls.set(step + 1); // those of the step from a node act there
                objective.follow(run.state(), NotedNode::Next);
                found.value += nodes.step_to(objective, run.state());
                watch(Passing::Node(run.state(), step));
            }
        }
        Ok(())
    }

    /// The same, recorded.
    fn record(
        &mut self,
        run: &mut Integrator<S, C>,
        steps: std::ops::Range<usize>,
    ) -> Result<(), GradientError> {
        let Task { objective, controls, .. } = *self.task;
        let (keeps, keeps_nodes) = (keeps_momentum(run), self.task.keeps_nodes());
        let (state, stages) = (run.state(), run.method().stages().map_or(1, Stages::count));
        self.tape.clear();
        controls.set(steps.start);
        let sizes = [state.q.len(), stages, state.angles.len(), state.internal.len()];
        self.tape.reserve(steps.len(), sizes);
        let Self { tape, nodes, found, first, costates, p, dq, begin, watch, .. } = self;
        nodes.clear();
        begin.clone_from(dq);
        let ends = steps.end == self.task.steps;
        let mut costs = first.then(|| NodeCost::of(objective, run.state()));
        for step in steps {
            if keeps_nodes {
                nodes.push(holding(run.state(), p));
            }
            controls.set(step);
            let w = controls.at(step);
            let taken = run.step_with(&mut |system, _, taken| {
                if *first {
                    found.value += objective.of_step(taken.s, w);
                    watch(Passing::Step(taken.s, step));
                }
                tape.push(step, taken.points(), p);
                if !keeps {
                    costates.momentum(system, taken.s, p);
                }
                dq.copy_from_slice(&taken.s.dq);
            });
            taken.map_err(|error| GradientError::Step { step: step + 1, error })?;
            if keeps {
                p.copy_from_slice(&run.state().p);
            }
            if let Some(costs) = &mut costs {
                controls.set(step + 1);
                objective.follow(run.state(), NotedNode::Next);
                found.value += costs.step_to(objective, run.state());
                watch(Passing::Node(run.state(), step));
            }
        }
        if keeps_nodes {
            nodes.push(holding(run.state(), p));
        }
        if ends && *first {
            self.end(run)?;
        }
        Ok(())
    }

    /// The step from the last node, which the run does not take: its multipliers are those of the
    /// node.
    fn step_beyond(&mut self, run: &mut Integrator<S, C>) -> Result<(), GradientError> {
        let step = self.task.steps;
        let last = run.state().clone();
        self.task.controls.set(step);
        let Self { beyond, p, .. } = self;
        beyond.clear();
        let taken = run.step_with(&mut |_, _, taken| beyond.push(step, taken.points(), p));
        taken.map_err(|error| GradientError::Step { step: step + 1, error })?;
        run.place_at(&last);
        let node = holding(&last, &self.p);
        let mut tape = std::mem::take(&mut self.beyond);
        let pulled = self.pull(run, tape.at(0), (Some(&node), &[]), false);
        self.beyond = tape;
        pulled
    }

    /// The last node.
    fn end(&mut self, run: &mut Integrator<S, C>) -> Result<(), GradientError> {
        if self.task.objective.counts_forces() {
            self.step_beyond(run)?;
        }
        let Task { objective, controls, steps, .. } = *self.task;
        controls.set(steps);
        let (state, costate) = (run.state(), &mut self.costate);
        self.found.value += objective.of_end(state);
        objective.add_of_end(state, costate);
        objective.add_parameters_of_end(state, &mut self.found.parameters);
        if let Some(place) = controls.place(steps) {
            self.forces.by_force.fill(0.0);
            objective.add_forces_of_end(state, &mut self.forces.by_force);
            let own = controls.of_force(state.configuration(), &self.forces.by_force);
            add(&own, &mut self.found.controls[place]);
        }
        if costate.q.iter().any(|a| !a.is_finite()) {
            return Err(GradientError::NotANumber);
        }
        if let Some(last) = self.tape.len().checked_sub(1) {
            self.costates.hold(run.system(), self.tape.at(last).points, costate);
        }
        Ok(())
    }

    /// What node `k` of some in a row costs, where this step begins, with steps of equal length on
    /// both sides of it but at the ends of the run.
    fn node(&mut self, nodes: &[State], k: usize, step: usize) {
        let Task { objective, controls, design, by_step, steps, .. } = *self.task;
        let Some(node) = nodes.get(k) else { return };
        let [from, to] = if k + 1 < nodes.len() { [k, k + 1] } else { [k - 1, k] };
        let length = nodes[to].t - nodes[from].t;
        let weight = if step == 0 || step == steps { 0.5 * length } else { length };
        let Self { costate, found, forces, .. } = self;
        controls.set(step);
        objective.add_of_node(node, weight, costate);
        if design.is_some() {
            objective.add_parameters_of_node(node, weight, &mut found.parameters);
        }
        if let Some(place) = controls.place(step) {
            forces.by_force.fill(0.0);
            objective.add_forces_of_node(node, weight, &mut forces.by_force);
            let own = controls.of_force(node.configuration(), &forces.by_force);
            add(&own, &mut found.controls[place]);
        }
        if by_step {
            self.by_step += weight * objective.of_node(node);
        }
    }

    /// Back over what is sampled where this step ends, between nodes `k` and `k + 1` of some.
    fn unsample(&mut self, nodes: &[State], k: usize, step: usize) {
        let Some(sampling) = self.task.controls.sampling() else { return };
        let number = self.number + step as u64 + 1;
        if let (true, [start, end, ..]) = (sampling.is_due(number), &nodes[k..]) {
            let before = sampling.before(start, end);
            let parameters = &mut self.found.parameters[..];
            sampling.pull(number, &before, &mut self.costate, parameters);
        }
    }

    /// What the last node costs by its acceleration, that of the level; `h`: of the last step.
    fn last_acceleration(&mut self, node: &State, h: f64) {
        let Task { objective, controls, steps, .. } = *self.task;
        let Self { forces, costate, found, .. } = self;
        forces.clear();
        controls.set(steps);
        let at = NodePlace { weight: 0.5 * h, is_last: true };
        forces.find_level(objective, node, at, &mut found.parameters);
        if let Some(place) = controls.place(steps) {
            add(
                &controls.of_force(node.configuration(), &forces.by_force),
                &mut found.controls[place],
            );
        }
        found.value += forces.cost;
        self.by_step += forces.by_step;
        costate.add(&forces.own);
    }

    /// Back over what is recorded.
    fn back(&mut self, run: &Integrator<S, C>) -> Result<(), GradientError> {
        let mut tape = std::mem::take(&mut self.tape);
        let nodes = std::mem::take(&mut self.nodes);
        for k in (0..tape.len()).rev() {
            if tape.step(k) + 1 == self.task.steps && k + 1 == tape.len() {
                self.node(&nodes, nodes.len().saturating_sub(1), self.task.steps);
                if let (true, [.., before, last]) =
                    (self.task.objective.counts_accelerations(), &nodes[..])
                {
                    self.last_acceleration(last, last.t - before.t);
                }
            }
            let step = tape.step(k);
            if k + 1 == tape.len() || tape.step(k + 1) != step {
                self.unsample(&nodes, step - tape.step(0), step);
            }
            let starts = k == 0 || tape.step(k - 1) != step;
            let node = step - tape.step(0);
            let before = match (self.task.objective.counts_steps(), k.checked_sub(1)) {
                (false, _) => Vec::new(),
                (true, Some(k)) => tape.increments(k).to_vec(),
                (true, None) => self.begin.clone(),
            };
            let node = (nodes.get(node).filter(|_| starts), &before[..]);
            self.pull(run, tape.at(k), node, k == 0 && step == 0)?;
            if starts {
                self.swelling.see(run.system(), &self.costate.p);
                self.node(&nodes, step - tape.step(0), step);
            }
        }
        (self.tape, self.nodes) = (tape, nodes);
        Ok(())
    }

    /// Back over a (sub-)step, the first one of the run or another; `node`: where it starts, of a
    /// macro step, with the increments of the step that ends there.
    fn pull(
        &mut self,
        run: &Integrator<S, C>,
        taken: Taken<'_>,
        (node, before): (Option<&State>, &[f64]),
        is_first: bool,
    ) -> Result<(), GradientError> {
        let Task { objective, controls, design, by_step, steps, .. } = *self.task;
        let (system, constraints) = (run.system(), run.constraints());
        let Self { costates, costate, of_step, sources, sums, forces, found, .. } = self;
        let Taken { step, points, p } = taken;
        let s = points.last().expect("a step has an end");
        let failed = |error| GradientError::of_linearization(step, error);
        controls.set(step);
        of_step.clear();
        let is_counted = step < steps; // else it is that beyond the last node
        if is_counted {
            objective.add_of_step(s, controls.at(step), of_step);
        }
        add(&of_step.end, &mut costate.q);
        let of_internal = costate.z.clone(); // y'
        let counts_steps = objective.counts_steps();
        let node = node.filter(|_| counts_steps);
        if counts_steps {
            forces.clear();
        }
        let increments = Some([before, &s.dq[..]]).filter(|_| is_counted); // of both steps
        if let (Some(node), true) = (node, step > 0 && increments.is_some()) {
            let at = NodePlace { weight: s.h, is_last: false };
            let beside = StepsBeside { impulse: None, increments, h: s.h };
            let node = (node, at, Which::OfAccelerations);
            let parameters = &mut found.parameters;
            forces.find(objective, node, beside, parameters, [&mut [], &mut costate.q]);
        }
        if let (Some(node), true) = (node, step > 0 && objective.counts_forces()) {
            let weight = if is_counted { s.h } else { 0.5 * s.h };
            let at = NodePlace { weight, is_last: !is_counted };
            let parameters = &mut found.parameters[..];
            let mut cost = |impulse: &[f64], out: [&mut [f64]; 2]| {
                let beside = StepsBeside { impulse: Some(impulse), increments, h: s.h };
                let node = (node, at, Which::OfForces);
                forces.find(objective, node, beside, parameters, out);
            };
            costates.pull_with(system, constraints, points, p, costate, &mut cost)
        } else if self.settles && is_first {
            costates.pull_by_rows(system, constraints, points, p, costate).map_err(Into::into)
        } else {
            costates.pull(system, constraints, points, p, costate).map_err(Into::into)
        }
        .map_err(|error| match costate.q.iter().all(|a| a.is_finite()) {
            true => failed(error),
            false => GradientError::NotANumber,
        })?;
        if let (Some(node), 0) = (node, step) {
            let at = NodePlace { weight: 0.5 * s.h, is_last: false };
            forces.find_level(objective, node, at, &mut found.parameters);
        }
        if let (Some(node), Some(place)) =
            (node.filter(|_| step == 0 || !is_counted), controls.place(step))
        {
            let own = controls.of_force(node.configuration(), &forces.by_force);
            add(&own, &mut found.controls[place]);
        }
        if counts_steps {
            found.value += forces.cost;
            self.by_step += forces.by_step;
            costate.add(&forces.own);
        }
        if counts_steps && is_counted {
            add(&self.carried, &mut costate.q);
            self.carried.copy_from_slice(&forces.neighbours);
        }
        add(&of_step.start, &mut costate.q);
        let place = controls.place(step);
        if let Some(place) = place {
            add(&of_step.controls, &mut found.controls[place]);
        }
        if design.is_some() && is_counted {
            objective.add_parameters_of_step(s, controls.at(step), &mut found.parameters);
        }
        if by_step {
            self.by_step += s.h * of_step.step;
        }
        let (mut along, mut refused) = (0.0, None);
        costates.for_each_part(points, &mut |at, impulse, costates| {
            if let Some(place) = place.filter(|_| at.has_forces()) {
                let own = found.controls[place].iter_mut().zip(controls.forces());
                for (gradient, force) in own {
                    *gradient += force.along(at.interval(), Slot::Second, costates.momentum)
                        - force.along(at.interval(), Slot::First, costates.step); // [2.39]
                }
            }
            if let Some(design) = design {
                design.add_adjoint(at, impulse, costates, sums); // [2.40]
                if !of_internal.is_empty() {
                    design.add_internal_adjoint(at, &of_internal, sums);
                }
            }
            if by_step {
                let at = (at, self.start);
                let slopes = step_sources(system, constraints, at, impulse, sources);
                refused = slopes.err().or(refused.take());
                let Sources { minus, plus, rows } = &*sources;
                along += dot(plus, costates.momentum) - dot(minus, costates.step);
                if at.0.has_rows() && !costates.rows.is_empty() {
                    along -= dot(rows, costates.rows);
                }
            }
        });
        refused.map_or(Ok(()), Err)?;
        self.by_step += along;
        Ok(())
    }
}

fn add(x: &[f64], to: &mut [f64]) {
    to.iter_mut().zip(x).for_each(|(to, x)| *to += x);
}

/// The sources of a part of a step where all steps and times since `t_0` grow in proportion: its
/// length by itself, its middle or its Gauss node by the time since then. A Galerkin step has fixed
/// control points: `∂L_d/∂h` is minus the energy at its Gauss nodes.
pub(crate) fn step_sources(
    system: &impl DiscreteLagrangian,
    constraints: &impl Constraints,
    (at, t_0): (Place<'_>, f64),
    impulse: &[f64],
    out: &mut Sources,
) -> Result<(), GradientError> {
    out.clear();
    let s = at.interval();
    let change = StepChange { length: s.h, middle: s.t_mid() - t_0 };
    let Sources { minus, plus, rows } = out;
    constraints.add_step_change(s, change, rows)?;
    match at {
        Place::Step(s) => {
            system.add_step_slope(s, Slot::First, change, minus)?;
            system.add_step_slope(s, Slot::Second, change, plus)?;
            let into = &mut Product { v: impulse, out: minus };
            let mut transposed = Block { into, row: 0, column: 0, scale: -1.0, transposed: true };
            constraints.jacobian(s.t, &s.q0, &mut transposed); // −Gᵀ hλ
        }
        Place::Gauss(s, _) => {
            system.gauss_step_slope(s.mid().moving(&s.v_mid), s.h, change, minus)?;
            minus.iter_mut().zip(&mut *plus).for_each(|(minus, plus)| {
                *minus *= 0.5;
                *plus = *minus;
            });
            for (slot, own) in [(Slot::First, minus), (Slot::Second, plus)] {
                system.mass().mul_add(-slot.sign() * change.length / s.h, &s.v_mid, own); // ∓M V
            }
        }
        Place::Points(_) => {} // constraints know no step
        Place::Strains(step, i) => {
            if let Some(strains) = system.interpolation() {
                strains.add_step_slope(&step, i, change.length, plus);
            }
        }
    }
    Ok(())
}
