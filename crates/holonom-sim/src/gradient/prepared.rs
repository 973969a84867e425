//! A run with what derivatives need: its controls, its costs, its start.

use super::equilibrium::{self, AtEnd};
use super::objective::{Costs, Prices};
use crate::design::relaxed::resting_change;
use crate::design::start::{GivenJoint, GivenStart, StartOf};
use crate::design::stored;
use crate::design::{ModelTangent, refused};
use crate::shown::{all_read, forces, sensors_read, work};
use crate::simulation::Simulation;
use crate::start::independent::TreeCoordinate;
use crate::start::{How, StartValues};
use crate::system::input::Input;
use crate::system::outside::{ExternalActions, JointStart};
use crate::system::works::ForceWork;
use crate::system::{self, System};
use holonom_model::{Control, Model, ModelError, Scheme, SensorKind};
use std::borrow::Borrow;
use std::sync::Arc;
use vi_constraints::linearization::Tangent;
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::{InitialValues, initialization};
use vi_control::controls::{ControlForce, Controls, JointControl, ParticleControl, WrenchControl};
use vi_control::gradient::GradientError;
use vi_control::objective::{Known, NodeCost, NodePlace, NotedNode, Objective, Which};
use vi_control::sampling::Sampling;
use vi_control::sensitivities::{Beside, Increment, NodeForces, Sensitivities};
use vi_control::terminal_rate::{NodeSources, TerminalRateError};
use vi_core::interval::Interval;
use vi_core::{Configuration, MechanicalSystem as _, SparseMatrix, State};
use vi_multibody::design::MechanismDesign;
use vi_multibody::design::start::StartTangent;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::particle_load::ParticleLoad;
use vi_multibody::run::MechanismIntegrator;
use vi_rigid::load::Load;
use vi_rigid::time_history::TimeHistory;

/// Why there is no gradient.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GradientFailure {
    /// The model has none.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The run has none.
    #[error("{0}")]
    Run(GradientError),
}

/// A run with its controls and costs.
pub(crate) struct Prepared {
    /// That of the run: of statics with its loads as they grow.
    pub(crate) model: Arc<Model>,
    pub(crate) simulation: Simulation,
    pub(crate) system: System,
    pub(crate) controls: Controls,
    pub(crate) costs: Costs,
    pub(crate) outside: ExternalActions,
    pub(crate) steps: usize,
}

impl Prepared {
    /// Of a model whose controls have these values, one list for each; zero where there is none.
    pub(crate) fn new(
        model: &Model,
        of: &[String],
        values: &[Vec<f64>],
        outside: &ExternalActions,
    ) -> Result<Self, ModelError> {
        Self::beginning_at(model, of, (values, outside), 0.0)
    }

    /// The same from another time than 0, s.
    pub(crate) fn beginning_at(
        model: &Model,
        of: &[String],
        (values, start): (&[Vec<f64>], &ExternalActions),
        t: f64,
    ) -> Result<Self, ModelError> {
        supported(model)?;
        let is_static = model.settings.scheme == Scheme::Static;
        let steps = if is_static { 0 } else { last_node(model) };
        let inputs: Vec<Input> = model.controls.iter().map(Input::of).collect();
        let counted = [counted(model), start.counted.clone()].concat();
        let works = [works(model, of), start.works.clone()].concat();
        let mut outside =
            ExternalActions { inputs: inputs.clone(), counted, works, ..start.clone() };
        let (mut model, mut t) = (Arc::new(model.clone()), t);
        if is_static {
            equilibrium::supported(&model, of)?;
            let end = AtEnd::of(&model, &outside)?;
            (model, outside, t) = (Arc::new(end.model), end.outside, end.t);
        }
        let (kept, model) = (model.clone(), &*model);
        let mut system = system::build_with(model, &outside)?;
        let mut forces: Vec<Box<dyn ControlForce>> = Vec::new();
        let mut rows = vec![vec![0.0; inputs.len()]; steps];
        for (k, (control, input)) in model.controls.iter().zip(&inputs).enumerate() {
            // none: refused by the checks
            forces.extend(control_force(model, &mut system, control, input));
            for (step, row) in rows.iter_mut().enumerate() {
                let own = values.get(k).map_or(&[][..], Vec::as_slice);
                let weighed = control.shape.weights(control.hold, step);
                let value = |(at, weight): (usize, f64)| weight * own.get(at).unwrap_or(&0.0);
                row[k] = weighed.into_iter().map(value).sum();
            }
        }
        let controls = Controls::new(forces, rows, 1);
        let mut simulation = Simulation::beginning_at(model, &outside, t)?;
        let parts = (&mut system, &*simulation.integrator());
        let costs = Costs::new(model, parts, of, &[])?;
        Ok(Self { model: kept, simulation, system, controls, costs, outside, steps })
    }

    /// The costs with their derivatives by parameters, conditions at their prices.
    pub(crate) fn depend(
        &mut self,
        names: &[String],
        prices: &Prices,
        tangents: &[ModelTangent],
    ) -> Result<(), ModelError> {
        let (model, system) = (&*self.model, &mut self.system);
        let parts = (system, &*self.simulation.integrator());
        self.costs = Costs::priced(model, parts, (names, prices), tangents)?;
        self.sample(tangents)
    }

    /// What is sampled in it, with its derivatives by parameters.
    pub(crate) fn sample(&mut self, tangents: &[ModelTangent]) -> Result<(), ModelError> {
        let Self { model, system, simulation, controls, .. } = self;
        let (model, run) = (&**model, simulation.integrator());
        let signals = system.dynamics.forces.signals.clone();
        let Some(signals) = signals.filter(|_| run.system().is_sampled()) else { return Ok(()) };
        if run.method().stages().is_some() {
            let what = "derivatives of Galerkin steps with signals that are sampled";
            let help = "take steps of order 2, or filters in the place of samples";
            return Err(refused("simulation.method", what, help));
        }
        let measured = system.sensors.signal_gauge().and_then(|gauge| gauge.measured().first());
        if let Some((column, _)) = measured {
            let what = format!(
                "derivatives where a signal samples `{column}`, which is known with the step after a node"
            );
            return Err(refused("signal", what, "sample positions, velocities and rates"));
        }
        let first = run.system().places_of_signals().start;
        let numbers: Vec<_> = tangents.iter().map(|own| own.numbers.clone()).collect();
        let masses = forces::masses((model, system), run, true);
        let sources = NodeSources { level: None, masses };
        let sampling = Sampling::new(signals, first, run, &numbers, sources);
        let refusal = |error: TerminalRateError| {
            refused("signal", error.to_string(), "sample nothing of velocities")
        };
        controls.sample(Some(sampling.map_err(refusal)?));
        Ok(())
    }

    /// `J` of the run from its start.
    pub(crate) fn value(&mut self) -> Result<f64, GradientFailure> {
        let Self { simulation, controls, costs, steps, .. } = self;
        Ok(values_along(simulation, controls, *steps, &[costs])?.iter().sum())
    }

    /// The values of other costs along the run from its start.
    pub(crate) fn values_of(&mut self, costs: &[&Costs]) -> Result<Vec<f64>, GradientFailure> {
        values_along(&mut self.simulation, &self.controls, self.steps, costs)
    }
}

/// What a control acts by.
fn control_force(
    model: &Model,
    system: &mut System,
    control: &Control,
    input: &Input,
) -> Option<Box<dyn ControlForce>> {
    let value = input.effort();
    if let Some(name) = &control.joint {
        let joint = model.joints.iter().position(|own| own.name == *name)?;
        let coordinate = system.mechanism.coordinate(joint, control.freedom)?;
        return Some(Box::new(JointControl { effort: value, coordinate }));
    }
    if let Some(load) = unit_load(system, input) {
        return Some(Box::new(WrenchControl { value, load }));
    }
    let particle =
        model.particles.iter().position(|own| Some(&own.name) == control.body.as_ref())?;
    let mechanism = &system.mechanism;
    let (offset, dimension) =
        (mechanism.particle_offset(particle), mechanism.description().dimension);
    let (force, history) = (control.force.into(), TimeHistory::default());
    let force = ParticleLoad { offset, dimension, force, history };
    Some(Box::new(ParticleControl { value, force }))
}

/// The load of the value 1 of the control that an input of a system is, where it is on a body.
pub(crate) fn unit_load(system: &System, input: &Input) -> Option<Load> {
    let name = input.source();
    let load = system.dynamics.forces.loads(&name).next()?;
    load.clone().with_history(TimeHistory::default()).ok()
}

/// What nodes cost along a run by the steps beside them, costs after costs.
struct StepCosts {
    before: Option<Increment>, // of the last step
    steps: usize,
    h: f64,
}

impl StepCosts {
    /// What a node costs by its multipliers and, at the ends of the run, by its acceleration.
    fn add_node(
        &self,
        all: &mut [PathCost<&Costs>],
        run: &mut MechanismIntegrator,
        controls: &Controls,
        step: usize,
    ) -> Result<(), GradientFailure> {
        let (is_first, is_last) = (step == 0, step == self.steps);
        let weight = if is_first || is_last { 0.5 * self.h } else { self.h };
        let at = NodePlace { weight, is_last };
        if all.iter().any(|along| along.own.sum.counts_steps()) {
            controls.set(step);
        }
        let mut found = NodeForces::default();
        if !is_first && all.iter().any(|along| along.own.sum.counts_forces()) {
            let beside = Sensitivities::new(run, self.h, Vec::new());
            let mut beside = beside.map_err(GradientFailure::Run)?;
            beside.begin_at(step);
            let with = Beside { controls, design: None, objective: &Objective::new() };
            found.clone_from(beside.find_forces(run, with).map_err(GradientFailure::Run)?);
        }
        let a = self.before.as_ref().filter(|_| !is_last && !found.next.dq.is_empty());
        let a = a.map(|before| before.acceleration(&found.next, self.h).dq);
        let state = run.state();
        for PathCost { own, value, .. } in all {
            let which = if is_first { Which::All } else { Which::OfAccelerations };
            if is_first || is_last {
                *value += own.sum.steps().of(which, state, Known::STATE, at);
            }
            if !is_first {
                let known = Known { lambda: Some(&found.lambda), a: a.as_deref() };
                *value += own.sum.steps().of(Which::OfForces, state, known, at);
            }
        }
        Ok(())
    }

    /// What the node costs by its acceleration where a step of `dq` began.
    fn add_step(&mut self, all: &mut [PathCost<&Costs>], node: &State, dq: Vec<f64>) {
        let next = Increment { dq, ..Increment::default() };
        if let Some(before) = &self.before {
            let a = before.acceleration(&next, self.h).dq;
            let at = NodePlace { weight: self.h, is_last: false };
            for PathCost { own, value, .. } in all {
                let known = Known { a: Some(&a), ..Known::STATE };
                *value += own.sum.steps().of(Which::OfAccelerations, node, known, at);
            }
        }
        self.before = Some(next);
    }
}

/// A cost that is counted along a run, but for what its steps cost by multipliers and
/// accelerations.
pub(super) struct PathCost<C> {
    own: C,
    node: NodeCost,
    value: f64,
}

impl<C: Borrow<Costs>> PathCost<C> {
    /// From the start of a run on, whose first controls act.
    pub(super) fn begin(own: C, start: &State) -> Self {
        let sum = &own.borrow().sum;
        sum.follow(start, NotedNode::First);
        let node = NodeCost::of(sum, start);
        Self { own, node, value: 0.0 }
    }

    /// A (sub-)step with its controls.
    pub(super) fn add_step(&mut self, s: &Interval, w: &[f64]) {
        self.value += self.own.borrow().sum.of_step(s, w);
    }

    /// The node where a macro step ends; the controls of the step from there act.
    pub(super) fn reach(&mut self, node: &State) {
        let sum = &self.own.borrow().sum;
        sum.follow(node, NotedNode::Next);
        self.value += self.node.step_to(sum, node);
    }

    /// Its value at the end.
    pub(super) fn end(&mut self, end: &State, controls: &Controls, h: f64) -> f64 {
        let own = self.own.borrow();
        self.value + (own.sum.of_end(end) + own.rates(controls, h))
    }
}

/// The values of costs along a run of this many steps.
fn values_along(
    simulation: &mut Simulation,
    controls: &Controls,
    steps: usize,
    costs: &[&Costs],
) -> Result<Vec<f64>, GradientFailure> {
    let h = simulation.settings.step;
    let run = simulation.integrator();
    controls.set(0);
    let mut all: Vec<_> = costs.iter().map(|own| PathCost::begin(*own, run.state())).collect();
    let accelerate = costs.iter().any(|own| own.sum.counts_accelerations());
    let mut beside = StepCosts { before: None, steps, h };
    for step in 0..steps {
        beside.add_node(&mut all, run, controls, step)?;
        controls.set(step);
        let w = controls.at(step);
        let (node, mut dq) = (accelerate.then(|| run.state().clone()), Vec::new());
        let taken = run.step_with(&mut |_, _, taken| {
            all.iter_mut().for_each(|own| own.add_step(taken.s, w));
            if accelerate {
                dq.clone_from(&taken.s.dq);
            }
        });
        taken
            .map_err(|error| GradientFailure::Run(GradientError::Step { step: step + 1, error }))?;
        if let Some(node) = node {
            beside.add_step(&mut all, &node, dq);
        }
        controls.set(step + 1); // those of the step from a node act there
        all.iter_mut().for_each(|own| own.reach(run.state()));
    }
    beside.add_node(&mut all, run, controls, steps)?;
    let state = run.state();
    Ok(all.iter_mut().map(|own| own.end(state, controls, h)).collect())
}

/// The joint coordinates that sensors show, or along which they show efforts, with their
/// revolutions.
fn counted(model: &Model) -> Vec<(String, usize)> {
    let inner = model.sensors.iter().flat_map(|own| sensors_read(model, &own.name));
    let all = model.sensors.iter().cloned().chain(inner);
    let shown = all.filter(|own| {
        matches!(
            own.kind,
            SensorKind::JointCoordinate | SensorKind::Effort | SensorKind::Power | SensorKind::Work
        )
    });
    let all = shown.flat_map(|own| {
        let count = model.joint(&own.of).map_or(0, |joint| joint.pair().coordinate_count());
        (0..count).map(move |freedom| (own.of.clone(), freedom))
    });
    all.collect()
}

/// The forces whose works the objectives of these names count, all where there are none.
fn works(model: &Model, of: &[String]) -> Vec<String> {
    let chosen = model.objectives.iter().filter(|own| of.is_empty() || of.contains(&own.name));
    let names = chosen.filter_map(|own| own.sensor.as_deref());
    work::forces_of(model, all_read(model, names).iter())
}

/// The number of the last node of a run; of statics that of the last step of the loads.
pub(crate) fn last_node(model: &Model) -> usize {
    usize::try_from(model.settings.steps()).unwrap_or(usize::MAX)
}

/// Refuses what has no derivative, by its key.
fn supported(model: &Model) -> Result<(), ModelError> {
    let settings = &model.settings;
    let help =
        "derivatives are those of the schemes constrained, dalembert, nodal, reduced and static";
    if matches!(settings.scheme.family(), holonom_model::Family::EnergyMomentum(_)) {
        let what = "derivatives of this scheme";
        return Err(refused("simulation.scheme", what, help));
    }
    if let Some(event) = model.events.first() {
        let key = format!("event.{}", event.name);
        return Err(refused(&key, "derivatives across events", "remove the [[event]]"));
    }
    Ok(())
}

/// The start of a prepared run.
pub(crate) struct Begin {
    pub(crate) mass: SparseMatrix,
    rows: IndependentRows,
    pub(crate) q: Vec<f64>,
    pub(crate) v: Vec<f64>,
    stated_v: Vec<f64>,
    pub(crate) t: f64,
    how: How,
    kept: Vec<TreeCoordinate>,
    works: Vec<ForceWork>,
    /// Of the model itself, where joints are given.
    own: Option<Box<Self>>,
}

impl Begin {
    pub(crate) fn new(prepared: &mut Prepared) -> Result<Self, ModelError> {
        let Prepared { model, simulation, system, outside, .. } = prepared;
        let model = &**model;
        let stated = StartValues::of(model, &system.mechanism, outside)?;
        let run = simulation.integrator();
        let rows = run.rows().clone();
        let at = InitialValues::new(run.state().t, &stated.q, &stated.v);
        let begun =
            initialization::start(run.system(), run.constraints(), &rows, at).map_err(|error| {
                refused("simulation.start", error.to_string(), "state a consistent start")
            })?;
        let mass = system.dynamics.parts.mass_matrix(&system.mechanism);
        let State { t, q, .. } = begun.state;
        let (v, stated_v, how) = (begun.v, stated.v, stated.how);
        if let How::Standing { .. } = how {
            let mut state = run.state().clone();
            let at = Configuration { internal: &[], ..run.state().configuration() };
            run.system().rest_signals(at.moving(&v), &mut state.internal);
            run.place_at(&state);
        }
        let own = match outside.start == JointStart::default() {
            true => None,
            false => {
                let mechanism = &system.mechanism;
                let stated_v = StartValues::of(model, mechanism, &ExternalActions::default())?.v;
                let StartValues { q, v, how, .. } = StartValues::consistent(model, mechanism)?;
                let (mass, rows, kept) = (mass.clone(), rows.clone(), Vec::new());
                let (works, own) = (Vec::new(), None);
                Some(Box::new(Self { mass, rows, q, v, stated_v, t, how, kept, works, own }))
            }
        };
        let (kept, works) = (stated.kept, system.dynamics.works.clone());
        Ok(Self { mass, rows, q, v, stated_v, t, how, kept, works, own })
    }

    pub(crate) fn rows(&self) -> &IndependentRows {
        &self.rows
    }

    pub(crate) fn at(&self) -> InitialValues<'_> {
        InitialValues::new(self.t, &self.q, &self.v)
    }

    /// Its tangent, with that of the internal variables, which begin with what they read; `own`: of
    /// the parameter that changes it, if one does.
    pub(crate) fn tangent(
        &self,
        run: &MechanismIntegrator,
        change: &StartTangent,
        own: Option<&ModelTangent>,
    ) -> Tangent {
        let StartTangent { q, v, p } = change;
        let at = Configuration::new(self.t, &self.q);
        let mut z = run.system().internal_change_at_start(at.moving(&self.v), [q, v]);
        if let Some(elements) = own.and_then(|own| own.numbers.elements.as_ref()) {
            elements.add_begin(&self.q, &mut z);
        }
        if let Some(signals) = own.and_then(|own| own.numbers.signals.as_ref()) {
            signals.add_begin(at.moving(&self.v), &mut z);
        }
        if let How::Standing { .. } = self.how {
            // states stay where they rest
            let at = run.state().configuration();
            let mut rates = vec![0.0; z.len()];
            if let Some(signals) = own.and_then(|own| own.numbers.signals.as_ref()) {
                signals.add_rates(at.moving(&self.v), &mut rates);
            }
            match resting_change(run, at, q, rates) {
                Ok(own) => run.system().places_of_signals().for_each(|k| z[k] = own[k]),
                Err(_) => z.fill(f64::NAN),
            }
        }
        // V_θ(q_0)
        let places = run.system().places_of_works();
        for (place, work) in places.zip(&self.works).filter(|_| own.is_some()) {
            let (Some(of), Some(own)) = (&work.stored, own) else { continue };
            let by = stored::by_parameter(of, &work.force, run.constraints(), own);
            z[place] += by.map_or(0.0, |by| by(at));
        }
        Tangent { q: q.clone(), p: p.clone(), z }
    }

    /// How it changes with parameters.
    ///
    /// # Errors
    /// [`ModelError`] where that is not known.
    pub(crate) fn changes(
        &self,
        of: &StartOf<'_>,
        run: &MechanismIntegrator,
        design: &MechanismDesign,
        tangents: &[ModelTangent],
    ) -> Result<Vec<StartTangent>, ModelError> {
        match self.how {
            How::Relaxed { .. } | How::Standing { .. } => of.of_equilibrium(run, design, tangents),
            _ => tangents.iter().map(|own| of.change(own)).collect(),
        }
    }

    /// How it changes.
    pub(crate) fn of<'a>(&'a self, model: &'a Model, mechanism: &'a Mechanism) -> StartOf<'a> {
        let (mass, rows, at) = (&self.mass, &self.rows, self.at());
        let stated_v = &self.stated_v;
        let kept = &self.kept;
        StartOf { model, mechanism, mass, rows, at, stated_v, how: self.how, kept }
    }

    /// How it changes where joints are given.
    ///
    /// # Errors
    /// As of [`StartOf::given`].
    pub(crate) fn given(
        &self,
        of: &StartOf<'_>,
        tangents: &[ModelTangent],
        first: &[GivenJoint],
    ) -> Result<GivenStart, ModelError> {
        match &self.own {
            Some(own) => of.given(&own.of(of.model, of.mechanism), tangents, first),
            None => of.given(of, tangents, first),
        }
    }
}
