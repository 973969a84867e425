//! Derivatives of a motion along directions, beside the run.
//!
//! ```text
//! δq_n, δp̄_n, δz_n of each direction by [2.37],   dJ along it: Σ (∂ℓ_n) + ∂Φ
//! ```
//! Multipliers of a node, `hλ`, and their changes are those of the step from there: it is taken,
//! and the run goes back ([`Sensitivities::find_forces`]). Accelerations are those of the steps on
//! both sides, `δa_n = (δq_{n+1} − 2 δq_n + δq_{n−1})/h²`. The price is one linear solve for each
//! step and direction: less than backward where numbers that are wanted outnumber the directions,
//! as residuals of measurements.
//!
//! *Growth.* Along a chaotic motion a tangent grows as `e^{ΛT}`. The derivative of the discrete
//! motion stays exact to its own precision, but a change as small as the rounding of a model then
//! moves the end by more than it can move: beyond [`MEANINGLESS`] a derivative says nothing of the
//! mechanism.

use crate::backward::acceleration;
use crate::controls::Controls;
use crate::gradient::{GradientError, check, check_by_step, check_sampling, step_sources};
use crate::objective::{ByKnown, Known, NodePlace, NotedNode, Objective, StepGradient, Which};
use vi_constraints::costate_sweep::Linearization;
use vi_constraints::design::Design;
use vi_constraints::discretization::Step;
use vi_constraints::linearization::{Costate, LinearizationError, Sources, Tangent};
use vi_constraints::{Constraints, Integrator};
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Slot;
use vi_core::linear::dot;
use vi_core::state::State;

/// Growth `|δq_n|/|δq_0|` beyond which derivatives are meaningless.
pub const MEANINGLESS: f64 = 1e6;

/// A direction in which a run is changed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Direction {
    /// At the start.
    pub start: Tangent,
    /// A parameter that grows at the rate 1, beside what it changes of the start.
    pub parameter: Option<usize>,
    /// Rates of the values of controls, in their order; none where it is empty.
    pub controls: Vec<Vec<f64>>,
    /// Whether the length of all steps grows at the rate 1.
    pub step: bool,
}

impl Direction {
    /// Of the start.
    #[must_use]
    pub fn from(start: Tangent) -> Self {
        Self { start, ..Self::default() }
    }
}

/// The largest growth of a tangent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DerivativeGrowth {
    /// `max_n |δq_n|/|δq_0|`.
    pub largest: f64,
    /// The time of the first node beyond [`MEANINGLESS`], s.
    pub meaningless_from: Option<f64>,
}

impl DerivativeGrowth {
    /// Of what stays as it is.
    pub const NONE: Self = Self { largest: 1.0, meaningless_from: None };
}

/// Tangents beside a run.
#[derive(Debug)]
pub struct Sensitivities {
    directions: Vec<Direction>,
    tangents: Vec<Tangent>,
    rates: Vec<f64>, // of the cost
    growth: Vec<DerivativeGrowth>,
    sizes: Vec<f64>, // |δq_0|
    linearization: Linearization,
    sources: Sources,
    of_step: StepGradient,
    state_rates: Vec<f64>,   // φ_θ, shape of the internal variables
    of_parameters: Vec<f64>, // explicit derivatives of the cost
    step: usize,
    start: f64,  // t_0
    length: f64, // of a macro step, s
    p: Vec<f64>, // n  p̄ of a sub-step
    forces: NodeForces,
    find: bool,        // whether they are to be found
    before: Increment, // of the step that ended at the present node
    keeps: bool,       // whether that is wanted
}

/// The increments of a step with their changes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Increment {
    /// `Δq`, shape `n`.
    pub dq: Vec<f64>,
    /// `δΔq` along each direction, shape `n`.
    pub changes: Vec<Vec<f64>>,
}

impl Increment {
    /// The acceleration of the node between two steps of the length `h`, s, with its changes.
    #[must_use]
    pub fn acceleration(&self, next: &Self, h: f64) -> Self {
        let dq = acceleration([&self.dq, &next.dq], h);
        let pairs = self.changes.iter().zip(&next.changes);
        let changes = pairs.map(|(before, after)| acceleration([before, after], h)).collect();
        Self { dq, changes }
    }

    /// From tangents at the start of a step to those at its end.
    fn between(dq: Vec<f64>, from: &[Tangent], to: &[Tangent]) -> Self {
        let change = |(from, to): (&Tangent, &Tangent)| {
            to.q.iter().zip(&from.q).map(|(to, from)| to - from).collect()
        };
        Self { dq, changes: from.iter().zip(to).map(change).collect() }
    }
}

/// The multipliers of a node, those of the step from there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NodeForces {
    /// `λ`, shape `m`.
    pub lambda: Vec<f64>,
    /// `δλ` along each direction, shape `m`.
    pub changes: Vec<Vec<f64>>,
    /// Of that step.
    pub next: Increment,
}

/// What acts and what counts in a run.
#[derive(Clone, Copy)]
pub struct Beside<'a> {
    /// What acts.
    pub controls: &'a Controls,
    /// Parameters of the directions, if any.
    pub design: Option<&'a dyn Design>,
    /// A cost whose rates are wanted.
    pub objective: &'a Objective,
}

impl std::fmt::Debug for Beside<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Beside").finish_non_exhaustive()
    }
}

impl Sensitivities {
    /// From the present state of a run with macro steps of `length`, s.
    ///
    /// # Errors
    /// [`GradientError::NotDifferentiable`].
    pub fn new<S, C>(
        run: &Integrator<S, C>,
        length: f64,
        directions: Vec<Direction>,
    ) -> Result<Self, GradientError>
    where
        S: DiscreteLagrangian + 'static,
        C: Constraints + 'static,
    {
        check(run)?;
        check_by_step(run, directions.iter().any(|own| own.step))?;
        let (state, m) = (run.state(), run.constraints().len());
        let n = state.q.len();
        let parameters = directions.iter().filter_map(|own| own.parameter).max();
        let controls = directions.iter().flat_map(|own| &own.controls).map(Vec::len).max();
        Ok(Self {
            tangents: directions.iter().map(|own| own.start.clone()).collect(),
            rates: vec![0.0; directions.len()],
            growth: vec![DerivativeGrowth::NONE; directions.len()],
            sizes: directions.iter().map(|own| norm(&own.start.q)).collect(),
            directions,
            linearization: Linearization::new(run.method(), n, m, run.rows()),
            sources: Sources::zero(n, m),
            of_step: StepGradient::zero(n, controls.unwrap_or(0)),
            state_rates: vec![0.0; state.internal.len()],
            of_parameters: vec![0.0; parameters.map_or(0, |last| last + 1)],
            step: 0,
            start: state.t,
            length,
            p: state.p.clone(),
            forces: NodeForces::default(),
            find: false,
            before: Increment::default(),
            keeps: false,
        })
    }

    /// Counts the steps from this one on, at whose start the run is: which values of controls act.
    pub fn begin_at(&mut self, step: usize) {
        self.step = step;
    }

    /// The multipliers at the present node, of a run with steps of order 2, those of the step from
    /// there, with their changes. The run stays where it is.
    ///
    /// # Errors
    /// [`GradientError`].
    pub fn find_forces<S, C>(
        &mut self,
        run: &mut Integrator<S, C>,
        beside: Beside<'_>,
    ) -> Result<&NodeForces, GradientError>
    where
        S: DiscreteLagrangian + 'static,
        C: Constraints + 'static,
    {
        if run.reads_states() {
            let what = "multipliers of steps that are not of order 2";
            return Err(GradientError::NotDifferentiable { what });
        }
        let (step, node) = (self.step, run.state().clone());
        let kept = (self.tangents.clone(), self.rates.clone(), self.of_parameters.clone());
        beside.controls.set(step);
        self.p.clone_from(&node.p);
        self.find = true;
        let (mut found, mut dq) = (Ok(()), Vec::new());
        let taken = run.step_with(&mut |system, constraints, taken| {
            dq.clone_from(&taken.s.dq);
            found = self.push(system, constraints, taken, beside);
        });
        self.find = false;
        self.forces.next = Increment::between(dq, &kept.0, &self.tangents);
        (self.tangents, self.rates, self.of_parameters) = kept;
        taken.map_err(|error| GradientError::Step { step: step + 1, error })?;
        run.place_at(&node);
        found?;
        Ok(&self.forces)
    }

    /// Refuses a number with these derivatives by the multipliers of the present node, shape `m`,
    /// where they do not determine it; after [`Sensitivities::find_forces`].
    ///
    /// # Errors
    /// [`GradientError`].
    pub fn check_forces<S, C>(
        &mut self,
        run: &Integrator<S, C>,
        by_multipliers: &[f64],
    ) -> Result<(), GradientError>
    where
        S: DiscreteLagrangian + 'static,
        C: Constraints + 'static,
    {
        let Linearization::Step(own, _) = &mut self.linearization else { return Ok(()) };
        let at = (run.state().t, &run.state().q[..]);
        let found = own.check_determined(run.constraints(), at, by_multipliers);
        found.map_err(|error| GradientError::of_linearization(self.step, error))
    }

    /// Keeps the increments of the last step from now on, for accelerations of runs with steps of
    /// order 2.
    pub fn keep_increments(&mut self) {
        self.keeps = true;
    }

    /// Those of the last step; empty before the first one and where they are not kept.
    #[must_use]
    pub fn before(&self) -> &Increment {
        &self.before
    }

    /// Adds what the present node costs by its multipliers and, at the ends of a run, by its
    /// acceleration; nothing where none cost.
    ///
    /// # Errors
    /// [`GradientError`].
    pub fn add_forces<S, C>(
        &mut self,
        run: &mut Integrator<S, C>,
        beside: Beside<'_>,
        is_last: bool,
    ) -> Result<(), GradientError>
    where
        S: DiscreteLagrangian + 'static,
        C: Constraints + 'static,
    {
        let objective = beside.objective;
        if !objective.counts_steps() {
            return Ok(());
        }
        let is_first = self.step == 0;
        beside.controls.set(self.step);
        let weight = if is_first || is_last { 0.5 * self.length } else { self.length };
        let at = NodePlace { weight, is_last };
        let which = if is_first { Which::All } else { Which::OfAccelerations };
        if is_first || is_last {
            let tangents = self.tangents.clone();
            let node = (run.state(), &tangents[..]);
            self.add_of_steps(node, beside, (at, which), (None, None));
        }
        if is_first || !objective.counts_forces() {
            return Ok(());
        }
        self.find_forces(run, beside)?;
        let forces = std::mem::take(&mut self.forces);
        let counts = objective.counts_accelerations() && !is_last;
        let a = counts.then(|| self.before.acceleration(&forces.next, self.length));
        let (tangents, known) = (self.tangents.clone(), (Some(&forces), a.as_ref()));
        let node = (run.state(), &tangents[..]);
        let of_lambda = self.add_of_steps(node, beside, (at, Which::OfForces), known);
        self.forces = forces;
        self.check_forces(run, &of_lambda)
    }

    /// What a node costs by what the steps beside it give, with the acceleration level in the place
    /// of what they do not. Returns the derivatives by its multipliers.
    fn add_of_steps(
        &mut self,
        (node, tangents): (&State, &[Tangent]),
        Beside { controls, objective, .. }: Beside<'_>,
        (at, which): (NodePlace, Which),
        (forces, a): (Option<&NodeForces>, Option<&Increment>),
    ) -> Vec<f64> {
        let mut by = Costate::zero(node.q.len(), node.internal.len());
        let [mut by_a, mut by_force] = [(); 2].map(|()| vec![0.0; node.q.len()]);
        let mut of_lambda = vec![0.0; forces.map_or(0, |own| own.lambda.len())];
        let known =
            Known { lambda: forces.map(|own| &own.lambda[..]), a: a.map(|own| &own.dq[..]) };
        let by_known = ByKnown { lambda: &mut of_lambda, a: &mut by_a, force: &mut by_force };
        let (slopes, parameters) = ((&mut by, by_known), &mut self.of_parameters);
        let [_, along] = objective.steps().add_of((node, known), (at, which), slopes, parameters);
        let by_controls = self.by_controls(node, controls, &by_force);
        for (k, (rate, own)) in self.rates.iter_mut().zip(tangents).enumerate() {
            *rate += by.along(own) + by_controls[k];
            *rate += forces.map_or(0.0, |own| dot(&of_lambda, &own.changes[k]));
            *rate += a.map_or(0.0, |own| dot(&by_a, &own.changes[k]));
            if self.directions[k].step {
                let stretched = a.map_or(0.0, |own| 2.0 * dot(&by_a, &own.dq));
                *rate += (along - stretched) / self.length;
            }
        }
        of_lambda
    }

    /// One macro step of the run and of all tangents.
    ///
    /// # Errors
    /// [`GradientError`].
    pub fn advance<S, C>(
        &mut self,
        run: &mut Integrator<S, C>,
        beside: Beside<'_>,
    ) -> Result<(), GradientError>
    where
        S: DiscreteLagrangian + 'static,
        C: Constraints + 'static,
    {
        let step = self.step;
        check_sampling(run, beside.controls)?;
        let (number, any) = (run.state().step + 1, !self.directions.is_empty());
        let sampling = beside.controls.sampling().filter(|own| any && own.is_due(number));
        let sampling = sampling.map(|own| (own, run.state().clone()));
        if step == 0 {
            beside.objective.follow(run.state(), NotedNode::First);
        }
        self.add_node(run.state(), beside);
        self.add_forces(run, beside, false)?;
        beside.controls.set(step);
        self.p.clone_from(&run.state().p);
        let counts = beside.objective.counts_accelerations();
        let follows = (counts || self.keeps) && !run.reads_states();
        let kept = if follows { self.tangents.clone() } else { Vec::new() };
        let node = (counts && step > 0).then(|| run.state().clone());
        let (mut pushed, mut dq) = (Ok(()), Vec::new());
        let taken = run.step_with(&mut |system, constraints, taken| {
            if follows {
                dq.clone_from(&taken.s.dq);
            }
            if any && pushed.is_ok() {
                pushed = self.push(system, constraints, taken, beside);
            }
        });
        taken.map_err(|error| GradientError::Step { step: step + 1, error })?;
        pushed?;
        if let Some((sampling, start)) = sampling {
            let before = sampling.before(&start, run.state());
            let of = |k: usize| self.directions[k].parameter;
            let parameters = (&of as &dyn Fn(usize) -> _, self.of_parameters.len());
            sampling.push(number, &before, &mut self.tangents, parameters);
        }
        if follows {
            let next = Increment::between(dq, &kept, &self.tangents);
            if let Some(node) = node {
                let a = self.before.acceleration(&next, self.length);
                let at = NodePlace { weight: self.length, is_last: false };
                let (place, known) = ((at, Which::OfAccelerations), (None, Some(&a)));
                self.add_of_steps((&node, &kept), beside, place, known);
            }
            self.before = next;
        }
        self.step += 1;
        beside.objective.follow(run.state(), NotedNode::Next);
        let t = run.state().t;
        self.add_node(run.state(), beside);
        for (k, growth) in self.growth.iter_mut().enumerate().filter(|(k, _)| self.sizes[*k] > 0.0)
        {
            let grown = norm(&self.tangents[k].q) / self.sizes[k];
            growth.largest = growth.largest.max(grown);
            if grown > MEANINGLESS && growth.meaningless_from.is_none() {
                growth.meaningless_from = Some(t);
            }
        }
        Ok(())
    }

    /// Adds what a node costs at an end of a macro step; the controls of the step from there act.
    fn add_node(&mut self, node: &State, Beside { controls, objective, .. }: Beside<'_>) {
        if !objective.counts_nodes() {
            return;
        }
        controls.set(self.step);
        let half = 0.5 * self.length;
        let mut by = Costate::zero(node.q.len(), node.internal.len());
        objective.add_of_node(node, half, &mut by);
        let all = self.rates.iter_mut().zip(&self.tangents).zip(&self.directions);
        for ((rate, own), direction) in all {
            *rate += by.along(own);
            if direction.step {
                *rate += 0.5 * objective.of_node(node);
            }
        }
        objective.add_parameters_of_node(node, half, &mut self.of_parameters);
        let mut by_force = vec![0.0; node.q.len()];
        objective.add_forces_of_node(node, half, &mut by_force);
        let by_controls = self.by_controls(node, controls, &by_force);
        self.rates.iter_mut().zip(&by_controls).for_each(|(rate, by)| *rate += by);
    }

    /// What a number changes by along each direction of the controls at the present node, where it
    /// changes so with forces there.
    fn by_controls(&self, node: &State, controls: &Controls, by_force: &[f64]) -> Vec<f64> {
        let by_control = controls.of_force(node.configuration(), by_force);
        let place = controls.place(self.step);
        let along = |own: &Direction| {
            let acting = place.and_then(|place| own.controls.get(place));
            acting.map_or(0.0, |own| dot(&by_control, own))
        };
        self.directions.iter().map(along).collect()
    }

    fn push(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        taken: Step<'_>,
        Beside { controls, design, objective }: Beside<'_>,
    ) -> Result<(), GradientError> {
        let (step, s, points) = (self.step, taken.s, taken.points());
        let Self { linearization, sources, of_step, p, state_rates, .. } = self;
        let failed = |error: LinearizationError| GradientError::of_linearization(step, error);
        let found = linearization.linearize(system, constraints, points, p);
        found.map_err(|error| failed(error.into()))?;
        let w = controls.at(step);
        of_step.controls.resize(w.len(), 0.0);
        of_step.clear();
        objective.add_of_step(s, w, of_step);
        if self.find {
            let impulse = linearization.part(points, 0).1;
            self.forces.lambda.clear();
            self.forces.lambda.extend(impulse.iter().map(|impulse| impulse / s.h));
            self.forces.changes.resize_with(self.directions.len(), Vec::new);
        }
        for (k, direction) in self.directions.iter().enumerate() {
            let tangent = &mut self.tangents[k];
            let rate = &mut self.rates[k];
            *rate += dot(&of_step.start, &tangent.q);
            if direction.step {
                *rate += s.h / self.length * of_step.step;
            }
            let place = controls.place(step);
            let rates = place.and_then(|place| direction.controls.get(place));
            let rates = rates.map_or(&[][..], Vec::as_slice);
            *rate += dot(rates, &of_step.controls[..rates.len()]);
            linearization.clear_sources();
            for part in 0..linearization.parts() {
                sources.clear();
                let (at, impulse) = linearization.part(points, part);
                if direction.step {
                    step_sources(system, constraints, (at, self.start), impulse, sources)?;
                    let Sources { minus, plus, rows } = sources;
                    let all = minus.iter_mut().chain(plus).chain(rows);
                    all.for_each(|x| *x /= self.length); // per unit of a macro step
                }
                let acting = rates.iter().filter(|_| at.has_forces());
                for (dw, force) in acting.zip(controls.forces()) {
                    force.add(at.interval(), Slot::First, *dw, &mut sources.minus);
                    force.add(at.interval(), Slot::Second, *dw, &mut sources.plus);
                }
                if let (Some(design), Some(parameter)) = (design, direction.parameter) {
                    let Sources { minus, plus, rows } = sources;
                    design.add_tangent(parameter, at, impulse, minus, plus, rows);
                    state_rates.fill(0.0);
                    design.add_rates(parameter, at, state_rates);
                    linearization.add_rate_sources(part, state_rates);
                }
                linearization.add_sources(part, sources);
            }
            linearization.push(system, constraints, points, tangent).map_err(failed)?;
            if let (true, Linearization::Step(own, _)) = (self.find, &*linearization) {
                let change = &mut self.forces.changes[k];
                change.resize(self.forces.lambda.len(), 0.0);
                own.impulse_change(s.h, change);
                change.iter_mut().for_each(|change| *change /= s.h); // sources are those at fixed λ
            }
            let internal = design.zip(direction.parameter).filter(|_| !tangent.z.is_empty());
            if let Some((design, parameter)) = internal {
                for part in 0..linearization.parts() {
                    design.add_internal(
                        parameter,
                        linearization.part(points, part).0,
                        &mut tangent.z,
                    );
                }
            }
            *rate += dot(&of_step.end, &tangent.q);
        }
        objective.add_parameters_of_step(s, w, &mut self.of_parameters);
        linearization.momentum_at_end(system, points, p); // p̄ of the next sub-step
        Ok(())
    }

    /// The tangents at the present node.
    #[must_use]
    pub fn tangents(&self) -> &[Tangent] {
        &self.tangents
    }

    /// How much each tangent has grown.
    #[must_use]
    pub fn growth(&self) -> &[DerivativeGrowth] {
        &self.growth
    }

    /// The rates of the cost along the directions, where the run ends at this state; where
    /// multipliers or accelerations cost, after [`Sensitivities::add_forces`] of it.
    #[must_use]
    pub fn rates(&self, beside: Beside<'_>, end: &State) -> Vec<f64> {
        let Beside { controls, objective, .. } = beside;
        controls.set(self.step);
        let mut by_force = vec![0.0; end.q.len()];
        objective.add_forces_of_end(end, &mut by_force);
        let by_controls = self.by_controls(end, controls, &by_force);
        let mut by = Costate::zero(end.q.len(), end.internal.len());
        objective.add_of_end(end, &mut by);
        let mut of_parameters = self.of_parameters.clone();
        objective.add_parameters_of_end(end, &mut of_parameters);
        let pairs = self.rates.iter().zip(&self.tangents).zip(&self.directions);
        let rates = pairs.zip(by_controls).map(|(((rate, own), direction), by_controls)| {
            let explicit = direction.parameter.map_or(0.0, |k| of_parameters[k]);
            rate + by.along(own) + explicit + by_controls
        });
        rates.collect()
    }
}

fn norm(x: &[f64]) -> f64 {
    dot(x, x).sqrt()
}
