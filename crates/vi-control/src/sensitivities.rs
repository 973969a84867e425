//! Derivatives of a motion along directions, beside the run.
//!
//! ```text
//! δq_n, δp̄_n, δz_n of each direction by [2.37],   dJ along it: Σ (∂ℓ_n) + ∂Φ
//! ```
//! The price is one linear solve for each step and direction: less than backward where numbers that
//! are wanted outnumber the directions, as residuals of measurements.
//!
//! *Growth.* Along a chaotic motion a tangent grows as `e^{ΛT}`. The derivative of the discrete
//! motion stays exact to its own precision, but a change as small as the rounding of a model then
//! moves the end by more than it can move: beyond [`MEANINGLESS`] a derivative says nothing of the
//! mechanism.

use crate::controls::Controls;
use crate::gradient::{GradientError, check, step_sources};
use crate::objective::{Objective, Seen, StepGradient};
use vi_constraints::costate_sweep::Linearization;
use vi_constraints::design::Design;
use vi_constraints::discretization::Step;
use vi_constraints::linearization::{LinearizationError, Sources, Tangent};
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
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Growth {
    /// `max_n |δq_n|/|δq_0|`.
    pub largest: f64,
    /// The time of the first node beyond [`MEANINGLESS`], s.
    pub meaningless_from: Option<f64>,
}

/// Tangents beside a run.
#[derive(Debug)]
pub struct Sensitivities {
    directions: Vec<Direction>,
    tangents: Vec<Tangent>,
    rates: Vec<f64>, // of the cost
    growth: Vec<Growth>,
    sizes: Vec<f64>, // |δq_0|
    linearization: Linearization,
    sources: Sources,
    of_step: StepGradient,
    of_parameters: Vec<f64>, // explicit derivatives of the cost
    step: usize,
    start: f64,  // t_0
    length: f64, // of a macro step, s
    p: Vec<f64>, // n  p̄ of a sub-step
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
        let (state, m) = (run.state(), run.constraints().len());
        let n = state.q.len();
        let parameters = directions.iter().filter_map(|own| own.parameter).max();
        let controls = directions.iter().flat_map(|own| &own.controls).map(Vec::len).max();
        Ok(Self {
            tangents: directions.iter().map(|own| own.start.clone()).collect(),
            rates: vec![0.0; directions.len()],
            growth: vec![Growth { largest: 1.0, meaningless_from: None }; directions.len()],
            sizes: directions.iter().map(|own| norm(&own.start.q)).collect(),
            directions,
            linearization: Linearization::new(run.method(), (n, m), run.rows()),
            sources: Sources::zero(n, m),
            of_step: StepGradient::zero(n, controls.unwrap_or(0)),
            of_parameters: vec![0.0; parameters.map_or(0, |last| last + 1)],
            step: 0,
            start: state.t,
            length,
            p: state.p.clone(),
        })
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
        if step == 0 {
            beside.objective.follow(run.state(), Seen::First);
        }
        self.add_node(run.state(), beside.objective);
        beside.controls.set(step);
        self.p.clone_from(&run.state().p);
        let (mut pushed, any) = (Ok(()), !self.directions.is_empty());
        let taken = run.step_with(&mut |system, constraints, taken| {
            if any && pushed.is_ok() {
                pushed = self.push(system, constraints, taken, beside);
            }
        });
        taken.map_err(|error| GradientError::Step { step: step + 1, error })?;
        pushed?;
        self.step += 1;
        beside.objective.follow(run.state(), Seen::Next);
        let t = run.state().t;
        self.add_node(run.state(), beside.objective);
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

    /// Adds what a node costs at an end of a macro step.
    fn add_node(&mut self, node: &State, objective: &Objective) {
        if !objective.counts_nodes() {
            return;
        }
        let half = 0.5 * self.length;
        let [mut by_q, mut by_p] = [(); 2].map(|()| vec![0.0; node.q.len()]);
        objective.add_of_node(node, half, &mut by_q, &mut by_p);
        let all = self.rates.iter_mut().zip(&self.tangents).zip(&self.directions);
        for ((rate, own), direction) in all {
            *rate += dot(&by_q, &own.q) + dot(&by_p, &own.p);
            if direction.step {
                *rate += 0.5 * objective.of_node(node);
            }
        }
        objective.add_parameters_of_node(node, half, &mut self.of_parameters);
    }

    fn push(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        taken: Step<'_>,
        Beside { controls, design, objective }: Beside<'_>,
    ) -> Result<(), GradientError> {
        let (step, s, points) = (self.step, taken.s, taken.points());
        let Self { linearization, sources, of_step, p, .. } = self;
        let failed = |error: LinearizationError| match error {
            LinearizationError::Opens { row, .. } => GradientError::Opens { step: step + 1, row },
            _ => GradientError::Singular { step: step + 1 },
        };
        let found = linearization.linearize(system, constraints, points, p);
        found.map_err(|error| failed(error.into()))?;
        let w = controls.at(step);
        of_step.controls.resize(w.len(), 0.0);
        of_step.clear();
        objective.add_of_step(s, w, of_step);
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
                }
                linearization.add_sources(part, sources);
            }
            linearization.push(system, constraints, points, tangent).map_err(failed)?;
            if let (Some(design), Some(parameter)) = (design, direction.parameter) {
                design.add_internal(parameter, s, &mut tangent.z);
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
    pub fn growth(&self) -> &[Growth] {
        &self.growth
    }

    /// The rates of the cost along the directions, where the run ends at this state.
    #[must_use]
    pub fn rates(&self, objective: &Objective, end: &State) -> Vec<f64> {
        let n = end.q.len();
        let (mut by_q, mut by_p) = (vec![0.0; n], vec![0.0; n]);
        objective.add_of_end(end, &mut by_q, &mut by_p);
        let mut of_parameters = self.of_parameters.clone();
        objective.add_parameters_of_end(end, &mut of_parameters);
        let pairs = self.rates.iter().zip(&self.tangents).zip(&self.directions);
        let rates = pairs.map(|((rate, own), direction)| {
            let explicit = direction.parameter.map_or(0.0, |k| of_parameters[k]);
            rate + dot(&by_q, &own.q) + dot(&by_p, &own.p) + explicit
        });
        rates.collect()
    }
}

fn norm(x: &[f64]) -> f64 {
    dot(x, x).sqrt()
}
