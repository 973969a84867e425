//! An integrator in a run: its steps with the sums along them, and its nodes.
//!
//! ```text
//! before ──step──► after        a node is read from the step that starts there: [`Node::StartValues`]
//! ```
//! At order 2 the multipliers, `p_n` and `E_d` belong to that step; the last node takes it on a
//! copy of the state. The multiplier of a node is that of (36), of energy–momentum schemes the mean
//! of the steps beside it; where a node has no such step (at the end, where a step fails, and with
//! a composition) it is taken from the acceleration level. So are accelerations, [`increments`].
//!
//! | file | concept |
//! |---|---|
//! | [`node`] | a node as it is read, and from what |
//! | [`increments`] | accelerations from the steps beside a node |
//! | [`work`] | the work of loads, motors, dampers and prescribed motions |

mod increments;
mod node;
mod work;

pub(crate) use node::{NodeOf, NodeView, WantedOfNode};

use crate::run::run_state::{MotionState, same_length};
use crate::sample::Momenta;
use holonom_model::Settings;
use increments::LastIncrements;
use node::LastRead;
use vi_beam::averaged::times_raised;
use vi_constraints::discretization::{Discretization, Step};
use vi_constraints::initialization::StartReport;
use vi_constraints::integrator::{NodeInStep, ResumeError, StepReport};
use vi_constraints::nonsmooth::{ContactRecord, NamedContacts, NodeRecord, Nonsmooth};
use vi_constraints::saddle_point::{IndependentRows, SaddlePoint};
use vi_constraints::scheme::{ConditionNumbers, StepError};
use vi_constraints::{Constraints, Integrator, Reparametrization};
use vi_core::force::Source;
use vi_core::interval::Interval;
use vi_core::linear::Singular;
use vi_core::{Entries, SeparableSystem, State, shadow_energy};
use vi_emscheme::{EmIntegrator, EmSystem};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::MechanismIntegrator;
use vi_multibody::tree_map::TreeMap;
use work::StepperWork;

/// Adds the work of a (sub-)step.
type AddWork<S> = fn(&mut StepperWork, &S, &Mechanism, Step<'_>);

/// Takes a step, each (sub-)step of which is seen.
type TakeStep<'a, S> = dyn FnMut(
        &mut Integrator<S, Mechanism>,
        &mut dyn FnMut(&S, &Mechanism, Step<'_>),
    ) -> Result<StepReport, StepError>
    + 'a;

/// An integrator of one of the families.
pub(crate) struct Stepper<S: Discretization<Mechanism>> {
    run: Integrator<S, Mechanism>,
    add_work: AddWork<S>,
    variational: bool, // whether there is a discrete Lagrangian, so that a node has an `E_d`
    order: u32,
    ended: [Option<f64>; 2], // J  E_d of the composed steps before and after the last node
    wanted: WantedOfNode,    // what sensors ask for
    momenta: bool,           // whether they are asked for
    map: Option<TreeMap>,    // for the reduced ones
    work: StepperWork,
    sources: Vec<Source>,               // what does it: forces, then contacts
    increments: Option<LastIncrements>, // at order 2, where accelerations are asked for
    seen: LastRead,
    began: f64, // s  where the motion of this mechanism began
}

impl<S: Discretization<Mechanism>> Stepper<S> {
    /// Of the variational schemes, or of those that have no discrete Lagrangian; `sources`: what
    /// exerts the forces, `wanted`: what sensors ask for.
    fn new(
        mut run: Integrator<S, Mechanism>,
        variational: bool,
        mut sources: Vec<Source>,
        add_work: AddWork<S>,
        settings: &Settings,
        wanted: WantedOfNode,
    ) -> Self {
        // the force of a variational scheme is that of its step equation, without multipliers
        run.record_multipliers(settings.momenta || wanted.forces && !variational);
        let Settings { order, momenta, .. } = *settings;
        let map = (momenta && variational).then(|| TreeMap::new(run.constraints()));
        let composed = run.reads_states();
        // the multipliers of an energy–momentum step are at hand
        let driven = variational && run.constraints().is_rheonomic();
        let (p, v) = (&run.state().p, run.initial_velocity());
        let contacts = run.nonsmooth().map_or(&[][..], |contacts| contacts.elements());
        sources.extend(contacts.iter().map(|element| Source::Element(element.source())));
        let work = StepperWork::new(p, v, sources.len(), driven, composed);
        let differences = wanted.accelerations && !composed;
        let increments = differences.then(|| LastIncrements::new(run.state().q.len()));
        let (ended, seen) = ([None; 2], LastRead::default());
        let began = run.state().t;
        Self {
            run,
            add_work,
            variational,
            order,
            ended,
            wanted,
            momenta,
            map,
            work,
            sources,
            increments,
            seen,
            began,
        }
    }

    /// Takes a step as so many equal parts; where it is refused, the state stays what it was.
    fn step(&mut self, parts: u32) -> Result<StepReport, StepError> {
        self.take(&mut |run, each| run.step_in_parts(parts, each))
    }

    /// Takes a step of another length, to the time `t_end`; it counts where it `ends` one of the
    /// own length. Where it is refused, the state stays what it was.
    fn step_of(&mut self, h: f64, t_end: f64, ends: bool) -> Result<StepReport, StepError> {
        self.take(&mut |run, each| run.step_of(h, t_end, ends, each))
    }

    /// Goes back to where the last step started.
    fn take_back(&mut self) {
        self.run.take_back();
        self.work.take_back();
        self.increments.iter_mut().for_each(LastIncrements::take_back);
        self.ended[1] = self.ended[0];
    }

    /// The impulse of a scalar constraint that stops the velocity `v`, N·s or N·m·s, and the rate
    /// of its coordinate before; `None` where it follows from others.
    fn impulse(&self, constraint: &str, v: &[f64]) -> Option<(f64, f64)> {
        let (mechanism, rows) = (self.run.constraints(), self.run.rows());
        let scalars = &mechanism.description().scalars;
        let k = scalars.iter().position(|scalar| scalar.name == constraint)?;
        let row = mechanism.scalar_rows(k).start;
        let place = rows.rows().iter().position(|own| *own == row)?;
        let (n, at) = (v.len(), self.run.state().configuration());
        let mut rates = vec![0.0; mechanism.len()];
        mechanism.time_derivative(at.t, at.q, &mut rates);
        let mut x = vec![0.0; n + rows.len()];
        self.run.system().mass().mul_add(1.0, v, &mut x[..n]);
        rows.gather(&rates, &mut x[n..]);
        x[n..].iter_mut().for_each(|rate| *rate = -*rate);
        let mass = |out: &mut dyn Entries| self.run.system().mass().emit(out);
        let mut saddle = SaddlePoint::new(n, rows.clone());
        saddle.solve(mechanism, &mass, at, 1.0, at, &mut x).ok()?;
        let mut rate = 0.0;
        let first = mechanism.len() - mechanism.rows().len();
        mechanism.rows()[row - first].add_rate(at.q, v, &mut rate);
        Some((-x[n + place], rate))
    }

    fn take(&mut self, take: &mut TakeStep<'_, S>) -> Result<StepReport, StepError> {
        let Self { run, add_work, work, ended, increments, .. } = self;
        let composed = run.reads_states();
        work.begin();
        increments.iter_mut().for_each(LastIncrements::begin);
        ended[0] = ended[1];
        let (mut action_rate, mut length) = (Some(0.0), 0.0); // E_d = −∂/∂h of the action
        let taken = take(run, &mut |system, mechanism, step| {
            add_work(work, system, mechanism, step);
            increments.iter_mut().for_each(|increments| increments.add(step.s));
            if composed {
                let added = action_rate.zip(system.discrete_energy(step));
                action_rate = added.map(|(rate, energy)| rate + step.s.h * energy);
                length += step.s.h;
            }
        });
        if let (Ok(_), Some(contacts)) = (&taken, run.nonsmooth()) {
            work.add_contacts(contacts);
        }
        match taken {
            Ok(_) if composed => ended[1] = action_rate.map(|rate| rate / length),
            Ok(_) => {}
            Err(_) => {
                work.take_back();
                increments.iter_mut().for_each(LastIncrements::take_back);
            }
        }
        taken
    }

    /// The integrator.
    pub(crate) fn integrator(&self) -> &Integrator<S, Mechanism> {
        &self.run
    }

    /// Reads a node; accelerations and constraint forces, where they are wanted.
    fn observe(&mut self, which: NodeOf) -> Result<(), Singular> {
        let of_steps = !self.run.reads_states();
        self.seen.when = which.when();
        self.seen.arrives = which == NodeOf::Arrival;
        self.seen.acceleration.clear();
        // one node is observed at a time: the acceleration level is the first to be
        let mut of_level = false; // whether the constraint force is that
        self.seen.with_step = match which {
            NodeOf::Start { whole } if whole && of_steps => {
                // at the start the multipliers of the step are of first order and no step ends
                let at_start = self.run.before().t <= self.began && self.wanted.any();
                of_level = at_start && self.find_acceleration().is_ok();
                self.run.node_before()?;
                if let Some(increments) = &self.increments {
                    increments.acceleration(&mut self.seen.acceleration);
                }
                true
            }
            NodeOf::Last if of_steps => {
                let at_start = self.run.state().t <= self.began && self.wanted.any();
                if at_start {
                    of_level = self.find_acceleration().is_ok();
                } else if self.wanted.accelerations {
                    self.find_acceleration()?;
                }
                self.run.observe().is_ok()
            }
            _ => false,
        };
        if !self.seen.with_step {
            let motion_alone = matches!(which, NodeOf::State | NodeOf::Arrival);
            let level = !motion_alone && self.wanted.any() || self.momenta;
            if level {
                self.find_acceleration()?;
                of_level = true;
            }
            match which {
                NodeOf::Arrival => self.run.observe_arrival()?,
                _ => self.run.observe_state_at(self.seen.when)?,
            };
        }
        self.finish(of_level);
        Ok(())
    }

    /// `Gᵀλ` of the acceleration level at the node, and its acceleration where that is asked for.
    fn find_acceleration(&mut self) -> Result<(), Singular> {
        let LastRead { when, force, lambda, acceleration, .. } = &mut self.seen;
        let lambda = self.momenta.then_some(lambda);
        let found = self.run.find_acceleration(*when, force, lambda)?;
        if self.wanted.accelerations {
            acceleration.clone_from(&found.acceleration);
        }
        Ok(())
    }

    /// The middle of a step of length `2 half`, s, from the present node: `q + half v`,
    /// `v + half a` with the acceleration of the state.
    fn predict(&mut self, half: f64, q: &mut Vec<f64>, v: &mut Vec<f64>) -> Result<(), Singular> {
        self.run.observe_state_at(NodeInStep::After)?;
        let node = self.run.find_acceleration(NodeInStep::After, &mut self.seen.force, None)?;
        v.clear();
        v.extend(node.v.iter().zip(&node.acceleration).map(|(v, a)| v + half * a));
        let at = self.run.state();
        q.clear();
        let node = self.run.observed(at);
        q.extend(at.q.iter().zip(&node.v).map(|(q, v)| q + half * v));
        Ok(())
    }

    /// The constraint force, if not `of_level` of the acceleration level, and the work at the node.
    fn finish(&mut self, of_level: bool) {
        let Self { run, wanted, seen, work, .. } = self;
        let at = run.at(seen.when);
        let node = run.observed(at);
        if !of_level {
            seen.force.clear();
            if wanted.forces {
                seen.force.extend_from_slice(&node.constraint_force);
            }
        }
        let before = seen.when == NodeInStep::Before;
        work.at(before, node, &mut seen.work);
        let mut parts = std::mem::take(&mut self.seen.work);
        let first = (parts.len() - 1).saturating_sub(self.contact_count());
        for (element, work) in self.works_before() {
            parts[first + element] += work;
        }
        self.seen.work = parts;
    }

    fn contact_count(&self) -> usize {
        self.run.nonsmooth().map_or(0, |contacts| contacts.elements().len())
    }

    /// The node that was read last.
    fn node(&self) -> NodeView<'_> {
        let LastRead { when, force, acceleration, work, .. } = &self.seen;
        let state = self.run.at(*when);
        let node = self.run.observed(state);
        let hamiltonian = node.hamiltonian_projected.total();
        let composed = self.variational && self.run.reads_states();
        let of_step = match (composed, when) {
            (true, NodeInStep::Before) => self.ended[0],
            (true, NodeInStep::After) => self.ended[1],
            (false, _) => Some(node.discrete_energy.total()),
        };
        let shadow = of_step.map(|step| shadow_energy(self.order, hamiltonian, step));
        NodeView { state, node, force, acceleration, work, shadow }
    }

    /// Of the contacts of the node that was read last the element and the work up to the node, J.
    fn works_before(&self) -> impl Iterator<Item = (usize, f64)> {
        let arrives = self.seen.arrives;
        let of_trial = self.run.nonsmooth().filter(|_| arrives);
        let arriving = of_trial.and_then(|contacts| contacts.trial_nodes().next());
        let node = arriving.or_else(|| self.contact_node());
        node.into_iter().flat_map(|(_, contacts)| contacts).map(move |own| {
            let work = if arrives { own.work_arriving } else { own.work_before };
            (own.id.element as usize, work)
        })
    }

    /// The contacts of the node that was read last; `None` where no step from it was taken.
    fn contact_node(&self) -> Option<(&NodeRecord, &[ContactRecord])> {
        let contacts = self.run.nonsmooth().filter(|_| self.seen.with_step)?;
        match self.seen.when {
            NodeInStep::Before => contacts.nodes().next(),
            NodeInStep::After => contacts.trial_nodes().next(),
        }
    }

    /// Momenta of the node that was read last; without a step from there only those of its state.
    fn read_momenta(&self, found: &mut Momenta) {
        let NodeView { state, node, .. } = self.node();
        let step = self.seen.with_step;
        if let Some(map) = &self.map {
            found.p_projected.clone_from(&node.p_projected);
            found.p_reduced.resize(map.dof(), 0.0);
            map.pull_back(&state.q, &node.p_projected, &mut found.p_reduced);
            found.hamiltonian_projected = Some(node.hamiltonian_projected);
            found.discrete_energy = step.then_some(node.discrete_energy);
        }
        found.lambda.clone_from(if step { &node.lambda } else { &self.seen.lambda });
        found.p.clear();
        found.hamiltonian = None;
        if step || !self.variational {
            found.p.clone_from(&node.p);
            found.hamiltonian = node.hamiltonian;
        }
    }

    /// The state of the motion, with the sums along its steps.
    fn state(&self) -> MotionState {
        MotionState {
            state: self.run.state().clone(),
            ended: self.ended[1],
            work: self.work.parts.clone(),
            impulse: self.work.impulse().cloned(),
            increment: self.increments.as_ref().map(LastIncrements::state),
        }
    }

    /// Continues from the state of a motion of the same model.
    fn resume(&mut self, from: MotionState) -> Result<(), ResumeError> {
        let mut work = self.work.clone();
        work.resume(from.work, from.impulse)?;
        let given = usize::from(from.increment.is_some());
        same_length("the list of increments", given, usize::from(self.increments.is_some()))?;
        if let (Some(own), Some(last)) = (&mut self.increments, from.increment) {
            own.resume(last)?;
        }
        self.run.resume(from.state)?;
        (self.work, self.ended) = (work, [from.ended; 2]);
        Ok(())
    }
}

/// An integrator of either family.
pub(crate) enum AnyStepper {
    Variational(Box<Stepper<SeparableSystem>>),
    EnergyMomentum(Box<Stepper<EmSystem>>),
}

macro_rules! either {
    ($any:expr, $own:ident => $of:expr) => {
        match $any {
            Self::Variational($own) => $of,
            Self::EnergyMomentum($own) => $of,
        }
    };
}

impl AnyStepper {
    pub(crate) fn variational(
        run: MechanismIntegrator,
        settings: &Settings,
        wanted: WantedOfNode,
    ) -> Self {
        let (sources, add_work) = (run.system().sources().to_vec(), StepperWork::add);
        Self::Variational(Box::new(Stepper::new(run, true, sources, add_work, settings, wanted)))
    }

    pub(crate) fn energy_momentum(
        run: EmIntegrator<Mechanism>,
        settings: &Settings,
        wanted: WantedOfNode,
    ) -> Self {
        let (sources, add_work) = (run.system().sources().to_vec(), StepperWork::add_em);
        let own = Stepper::new(run, false, sources, add_work, settings, wanted);
        Self::EnergyMomentum(Box::new(own))
    }

    /// Takes a step as so many equal parts; where it is refused, the state stays what it was.
    pub(crate) fn step(&mut self, parts: u32) -> Result<StepReport, StepError> {
        either!(self, own => own.step(parts))
    }

    /// The interval of the last (sub-)step.
    pub(crate) fn interval(&self) -> &Interval {
        either!(self, own => own.run.interval())
    }

    /// Takes a step of another length, to the time `t_end`; it counts where it `ends` one of the
    /// own length. Where it is refused, the state stays what it was.
    pub(crate) fn step_of(
        &mut self,
        h: f64,
        t_end: f64,
        ends: bool,
    ) -> Result<StepReport, StepError> {
        either!(self, own => own.step_of(h, t_end, ends))
    }

    /// Goes back to where the last step started.
    pub(crate) fn take_back(&mut self) {
        either!(self, own => own.take_back());
    }

    /// The impulse of a scalar constraint that stops the velocity `v`, N·s or N·m·s, and the rate
    /// of its coordinate before.
    pub(crate) fn impulse(&self, constraint: &str, v: &[f64]) -> Option<(f64, f64)> {
        either!(self, own => own.impulse(constraint, v))
    }

    /// The time of node `n`, s.
    pub(crate) fn time_of(&self, n: u64) -> f64 {
        either!(self, own => own.run.time_of(n))
    }

    /// Continues a motion that began at `t_0` and that another mechanism has brought to `t`, see
    /// [`Integrator::continue_from`].
    pub(crate) fn continue_from(
        &mut self,
        step: u64,
        [t_0, t]: [f64; 2],
        internal: &[f64],
        contacts: &NamedContacts,
    ) {
        either!(self, own => {
            own.run.continue_from(step, t_0, internal, contacts);
            own.began = t;
        });
    }

    /// [`Integrator::named_contacts`].
    pub(crate) fn named_contacts(&self) -> NamedContacts {
        either!(self, own => own.run.named_contacts())
    }

    /// The present node, between two of the grid, counts as the next.
    pub(crate) fn end_here(&mut self) {
        either!(self, own => own.run.end_here());
    }

    /// Reads a node.
    pub(crate) fn observe(&mut self, which: NodeOf) -> Result<(), Singular> {
        either!(self, own => own.observe(which))
    }

    /// `v ←` the velocities `v̂` of the present node, shape `n`, and nothing else of it; of
    /// energy–momentum schemes the node is read.
    pub(crate) fn velocity(&mut self, v: &mut Vec<f64>) -> Result<(), Singular> {
        match self {
            Self::Variational(own) => {
                v.resize(own.run.state().q.len(), 0.0);
                own.run.velocity(v)
            }
            Self::EnergyMomentum(own) => {
                own.observe(NodeOf::Arrival)?;
                v.clone_from(&own.node().node.v);
                Ok(())
            }
        }
    }

    /// The middle of the step from the present node, predicted.
    pub(crate) fn predict(
        &mut self,
        half: f64,
        q: &mut Vec<f64>,
        v: &mut Vec<f64>,
    ) -> Result<(), Singular> {
        either!(self, own => own.predict(half, q, v))
    }

    /// The node that was read last.
    pub(crate) fn node(&self) -> NodeView<'_> {
        either!(self, own => own.node())
    }

    /// The contacts of the last step.
    pub(crate) fn contacts(&self) -> Option<&Nonsmooth> {
        either!(self, own => own.run.nonsmooth())
    }

    /// The contacts of the node that was read last; `None` where no step from it was taken.
    pub(crate) fn contact_node(&self) -> Option<(&NodeRecord, &[ContactRecord])> {
        either!(self, own => own.contact_node())
    }

    /// Its multipliers and momenta, where the settings ask for them.
    pub(crate) fn read_momenta(&self, found: &mut Option<Box<Momenta>>) {
        either!(self, own => if own.momenta { own.read_momenta(found.get_or_insert_default()) });
    }

    /// The state of a node next to the last step.
    pub(crate) fn at(&self, when: NodeInStep) -> &State {
        either!(self, own => own.run.at(when))
    }

    /// Step index, time and configuration of the present node.
    pub(crate) fn place(&self) -> (u64, f64, &[f64]) {
        let state = self.at(NodeInStep::After);
        (state.step, state.t, &state.q)
    }

    /// The internal variables of signals in a state.
    pub(crate) fn signals<'a>(&self, state: &'a State) -> &'a [f64] {
        state.internal.get(self.places_of_signals()).unwrap_or_default()
    }

    /// Where the internal variables of signals are among those of a state.
    pub(crate) fn places_of_signals(&self) -> std::ops::Range<usize> {
        match self {
            Self::Variational(own) => own.run.system().places_of_signals(),
            Self::EnergyMomentum(_) => 0..0,
        }
    }

    /// How often a bound of the tension of beams was raised; `None` where none can be.
    pub(crate) fn tension_raised(&self) -> Option<u64> {
        let Self::Variational(own) = self else { return None };
        let system = own.run.system();
        times_raised(system.variables_of_potentials(&self.at(NodeInStep::After).internal))
    }

    /// The state of the motion, with the sums along its steps.
    pub(crate) fn state(&self) -> MotionState {
        either!(self, own => own.state())
    }

    /// Continues from the state of a motion of the same model.
    pub(crate) fn resume(&mut self, from: MotionState) -> Result<(), ResumeError> {
        either!(self, own => own.resume(from))
    }

    /// What does work: each force of the system, each contact.
    pub(crate) fn sources(&self) -> &[Source] {
        either!(self, own => &own.sources)
    }

    /// Constraints.
    pub(crate) fn mechanism(&self) -> &Mechanism {
        either!(self, own => own.run.constraints())
    }

    /// Independent constraints.
    pub(crate) fn rows(&self) -> &IndependentRows {
        either!(self, own => own.run.rows())
    }

    /// Consistency of the initial values.
    pub(crate) fn start_report(&self) -> &StartReport {
        either!(self, own => own.run.start_report())
    }

    /// Condition numbers of the last Newton matrix.
    pub(crate) fn condition(&mut self) -> Option<ConditionNumbers> {
        either!(self, own => own.run.condition())
    }

    /// The integrator, of a variational scheme.
    pub(crate) fn as_variational(&mut self) -> Option<&mut MechanismIntegrator> {
        match self {
            Self::Variational(own) => Some(&mut own.run),
            Self::EnergyMomentum(_) => None,
        }
    }

    /// The same, without the stepper.
    pub(crate) fn into_variational(self) -> Option<MechanismIntegrator> {
        match self {
            Self::Variational(own) => Some(own.run),
            Self::EnergyMomentum(_) => None,
        }
    }

    /// The integrator, of an energy–momentum scheme.
    pub(crate) fn as_energy_momentum(&mut self) -> Option<&mut EmIntegrator<Mechanism>> {
        match self {
            Self::Variational(_) => None,
            Self::EnergyMomentum(own) => Some(&mut own.run),
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::simulation::Simulation;
    use holonom_model::Model;

    #[test]
    fn the_shadow_energy_belongs_to_a_step_or_is_that_of_the_node() {
        for (scheme, order) in
            [("nodal", 2), ("nodal", 4), ("em-dalembert", 2), ("em-dalembert", 4)]
        {
            let text = format!(
                "model = {{ name = \"pendulum\", dimension = 2, gravity = [0.0, -9.81] }}\n\
                 particle = [{{ name = \"bob\", mass = 1.0, position = [1.0, 0.0] }}]\n\
                 bar = [{{ name = \"rod\", from = \"ground\", to = \"bob\" }}]\n\
                 simulation = {{ step = 0.05, end = 1.0, scheme = \"{scheme}\", order = {order} }}\n"
            );
            let model = Model::from_toml(&text).unwrap();
            let mut simulation = Simulation::new(&model).unwrap();
            let composed = scheme == "nodal" && order > 2;
            let mut apart = 0.0_f64;
            for sample in simulation.samples() {
                let sample = sample.unwrap_or_else(|failure| panic!("{}", failure.message));
                assert_eq!(
                    sample.shadow.is_none(),
                    composed && sample.step == 0,
                    "{scheme} {order}"
                );
                let shadow = sample.shadow.unwrap_or(sample.hamiltonian);
                apart = apart.max((shadow - sample.hamiltonian).abs());
            }
            println!("{scheme}, order {order}: shadow energy apart from H by {apart:.1e} J");
            assert_eq!(apart > 0.0, scheme == "nodal", "{scheme} {order}: {apart:e}");
        }
    }
}
