//! The system of a model, and its run.
//!
//! At order 2 the quantities of a node belong to the step that starts there: the multipliers,
//! `p_n`, `E_d`. A node is therefore handed out after that step has been taken; at the last node
//! one more step is tried for them, and where it fails (or the run does) the node is described by
//! `q_n` and the projected momentum alone, with `H_d` in the place of `E_d`.
//!
//! | file | concept |
//! |---|---|
//! | `begun` | what the assembly found, before the first step |
//! | `control` | what is decided between two steps, what is read of a node |
//! | `members` | simulations of one topology, stepped side by side |
//! | `nodes` | steps and recorded nodes, one after the other |
//! | `failure` | what is said of a step or a node that could not be found |
//! | `resolved` | the step against rotations and the fastest motion: at the start, at the end, where a step fails |

mod begun;
pub mod control;
mod events;
mod failure;
mod measured;
pub mod members;
mod nodes;
mod resolved;
mod taut;

pub use crate::assembly::measures::Measures;
pub use crate::assembly::{AssemblyReport, Closure, SectionCenters, StrainVariant};
pub use crate::run::divided_steps::DividedSteps;
pub use crate::run::outcome::{RunFailure, RunOutcome};

use crate::assembly;
use crate::assembly::agreement;
use crate::assembly::curved_elements::remarks_at;
use crate::assembly::loops::LoopResiduals;
use crate::dynamics::Dynamics;
use crate::event::Events;
use crate::event::switches::PhaseStart;
use crate::experiment::RunnableModel;
use crate::resolution::limits::LimitWatch;
use crate::resolution::rotation::{FastestRotation, RotationWatch};
use crate::run::contacts::ContactWatch;
use crate::run::energies::EnergyTerms;
use crate::run::energy_watch::EnergyWatch;
use crate::run::rolling::RollingWatch;
use crate::run::run_state::{RunState, same_length};
use crate::sample::{Member, MomentaNames, Sample};
use crate::sensor::Sensors;
use crate::start::{StartValues, separation};
use crate::stepper::{AnyStepper, NodeOf, WantedOfNode};
use crate::system::beams::Beams;
use crate::system::bushing;
use crate::system::contact_origin::ContactOrigin;
use crate::system::held::{self, Input};
use crate::system::joint_contact::nonsmooth_options;
use crate::system::law::{self, Laws};
use crate::system::outside::{ExternalActions, JointStart};
use crate::system::signal;
use crate::system::{self, System};
use begun::{Begun, StatedStart};
use control::{Controller, Reading};
use holonom_model::{Columns, Family, Model, ModelError, Settings};
use measured::MeasuredSignals;
use std::io;
use std::time::Duration;
use taut::TautBeams;
pub use vi_constraints::integrator::ResumeError;
use vi_constraints::integrator::{NodeInStep, StepReport};
use vi_constraints::scheme::{ConditionNumbers, StepError};
use vi_constraints::{Constraints, InitialValues, Options, SchemeKind};
use vi_core::contact_state::ContactCounts;
use vi_emscheme::{EmAlgebra, EmIntegrator, EmOptions};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::{MechanismIntegrator, Solver, integrator, with_contacts};

/// Halvings of a step that is refused.
const DIVISIONS: u32 = 10;

/// A system that can be run.
pub struct Simulation {
    pub(crate) settings: Settings,
    assembly: AssemblyReport,
    members: Vec<Member>,
    pub(crate) sensors: Sensors,
    pub(crate) laws: Laws,
    beams: Beams,
    limits: LimitWatch,
    pub(crate) energies: EnergyTerms,
    watch: EnergyWatch,
    pub(crate) rotation: RotationWatch,
    bodies: usize, // of the model, fixed ones included: the first frames
    pub(crate) stepper: AnyStepper,
    pub(crate) divided: DividedSteps,
    loops: LoopResiduals,
    pub(crate) rolling: RollingWatch,
    pub(crate) contacts: ContactWatch,
    pub(crate) events: Option<Box<Events>>,
    iterations: f64, // of the step that led to the present node
    inputs: Vec<Input>,
    controller: Option<Box<dyn Controller>>, // asked before each step
    measured: MeasuredSignals,               // of what signals read
    sample: Sample,                          // recorded last
    velocity: Vec<f64>,                      // n  of the node that was sensed last
    reading: Reading,
    recording: Duration, // of all nodes read and handed out
    taut: Option<Box<TautBeams>>,
}

impl std::fmt::Debug for Simulation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (step, t, q) = self.stepper.place();
        let mut shown = f.debug_struct("Simulation");
        shown.field("step", &step).field("t", &t).field("q", &q).finish_non_exhaustive()
    }
}

impl Simulation {
    /// Assembles the system of a validated model.
    ///
    /// # Errors
    /// [`ModelError`] when the initial values are inconsistent, the mass matrix is singular, or the
    /// scheme does not fit the model.
    pub fn new(model: &Model) -> Result<Self, ModelError> {
        Self::with_solver(model, model.settings.solver.into())
    }

    /// The same with the linear solver of the nodal scheme chosen by name.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn with_solver(model: &Model, solver: Solver) -> Result<Self, ModelError> {
        Self::assembled(model, solver, &ExternalActions::default(), 0.0)
    }

    /// The same with what acts from outside: inputs that are set between steps, laws, paths, starts
    /// of joints. The simulation holds clones of them.
    ///
    /// # Errors
    /// As [`Simulation::new`], and for what acts on nothing.
    pub fn with_outside(model: &Model, outside: &ExternalActions) -> Result<Self, ModelError> {
        Self::beginning_at(model, outside, 0.0)
    }

    /// The same from another time than 0, s: histories, paths and laws are read there; a path has
    /// to begin where the initial configuration is.
    ///
    /// # Errors
    /// As [`Simulation::with_outside`].
    pub fn beginning_at(
        model: &Model,
        outside: &ExternalActions,
        t: f64,
    ) -> Result<Self, ModelError> {
        Self::assembled(model, model.settings.solver.into(), outside, t)
    }

    fn assembled(
        model: &Model,
        solver: Solver,
        outside: &ExternalActions,
        t: f64,
    ) -> Result<Self, ModelError> {
        outside.prepare(model)?;
        let System { mechanism, dynamics, members, mut sensors, beams, contacts, laws, .. } =
            system::build_with(model, outside)?;
        let h = model.settings.step;
        let start = StartValues::of(model, &mechanism, outside)?;
        let stated = match outside.start == JointStart::default() {
            true => StatedStart::of(&mechanism),
            false => StatedStart::given(&mechanism, &start),
        };
        let start = separation::separated(model, &mechanism, &dynamics, &contacts, t, start)?;
        let at = InitialValues::new(t, &start.q, &start.v).with_angles(&start.angles);
        let rolling = RollingWatch::new(&mechanism);
        let mut wanted = sensors.wanted();
        wanted.forces |= rolling.needs_forces();
        let mut stepper = stepper(mechanism, &dynamics, model, at, solver, wanted)?;
        stepper.observe(NodeOf::State).map_err(|_| match law::fault_within(&laws, t, h) {
            Some(fault) => failure::law_at_start(fault),
            None => assembly::without_mass(model),
        })?;
        let (settings, q) = (model.settings.clone(), stepper.place().2);
        agreement::paths(stepper.mechanism(), stepper.rows(), q, settings.end)?;
        let mut limits = LimitWatch::new(&beams);
        limits.follow(t, q).map_err(failure::bent_at_start)?;
        let mass = &dynamics.parts.mass_matrix(stepper.mechanism());
        let (stated, start) = (&stated, &start);
        let begun = Begun { model, stated, start, stepper: &stepper, beams: &beams, mass };
        let mut assembly = begun.report(&limits);
        let coarse = remarks_at(&beams, q, &assembly.warnings);
        assembly.warnings.extend(coarse);
        assembly.warnings.extend(law::warnings(&laws));
        assembly.warnings.extend(signal::warnings(model));
        assembly.warnings.extend(bushing::warnings(model));
        assembly.warnings.extend(model.contact_remarks());
        assembly.warnings.extend(held::idle_controls(model, outside));
        limits.begin();
        let (forces, node) = (stepper.sources(), stepper.node());
        let energies = EnergyTerms::new(model, stepper.mechanism(), &dynamics, mass, forces, &node);
        let mut rotation = RotationWatch::new(model, stepper.mechanism(), &beams);
        resolved::judge(model, &mut stepper, at, &mut rotation, &mut assembly);
        sensors.begin(stepper.place().2);
        let events = match model.events.is_empty() {
            true => None,
            false => {
                let internal = stepper.at(NodeInStep::After).internal.clone();
                let (q, v) = (start.q.clone(), start.v.clone());
                let first = PhaseStart { step: 0, t, q, v, internal, ..PhaseStart::default() };
                let events = Events::new(model, outside, solver, stepper.mechanism(), first)?;
                Some(Box::new(events))
            }
        };
        let measured = MeasuredSignals::new(sensors.measured());
        let taut = TautBeams::of(model, &beams).map(Box::new);
        let mut simulation = Self {
            settings,
            assembly,
            members,
            sensors,
            laws,
            beams,
            limits,
            watch: EnergyWatch::default(),
            rotation,
            bodies: model.bodies.len(),
            energies,
            stepper,
            divided: DividedSteps::default(),
            loops: LoopResiduals::default(),
            rolling,
            contacts: ContactWatch::new(contacts),
            events,
            iterations: 0.0,
            inputs: outside.inputs.clone(),
            controller: None,
            measured,
            sample: Sample::default(),
            velocity: Vec::new(),
            reading: Reading::default(),
            recording: Duration::ZERO,
            taut,
        };
        simulation.contacts.begin(simulation.stepper.place().2);
        simulation.begin_events().map_err(failure::event_at_start)?;
        Ok(simulation)
    }

    /// What the assembly found.
    #[must_use]
    pub fn assembly(&self) -> &AssemblyReport {
        &self.assembly
    }

    /// The members, in the order of their coordinates.
    #[must_use]
    pub fn members(&self) -> &[Member] {
        &self.members
    }

    /// Names of the momenta of a node; `None` where the model does not ask for them.
    #[must_use]
    pub fn momenta_names(&self) -> Option<MomentaNames> {
        self.settings.momenta.then(|| momenta_names(self.mechanism(), &self.members))
    }

    /// The sensors.
    #[must_use]
    pub fn sensors(&self) -> &Sensors {
        &self.sensors
    }

    /// Names of the parts of the energy and of the work, [`Sample::energies`].
    #[must_use]
    pub fn energy_columns(&self) -> &[String] {
        self.energies.columns()
    }

    /// The beams.
    #[must_use]
    pub fn beams(&self) -> &Beams {
        &self.beams
    }

    /// What is worth knowing of the assembly and of the run so far.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let known = self.assembly.warnings.iter().cloned();
        let locked = self.assembly.counts.dof == 0 && !self.mechanism().is_rheonomic();
        let energy = self.watch.warning().filter(|_| !locked);
        let energy = energy.map(|warning| taut::of_energy(warning, self.taut.as_deref()));
        let found = self.limits.warnings().into_iter().chain(energy);
        let found = found.chain(self.rotation_warning());
        let divided = self.divided.warning().into_iter();
        let rolling = self.rolling.warnings(self.mechanism());
        let events = self.events.iter().flat_map(|events| events.warnings());
        let coarse = remarks_at(&self.beams, self.stepper.place().2, &self.assembly.warnings);
        let found = found.chain(coarse);
        known.chain(found).chain(divided).chain(rolling).chain(events).collect()
    }

    /// The integrator of a variational scheme at its present node; from now on nodes have
    /// multipliers.
    ///
    /// # Panics
    /// When the scheme is one of the energy–momentum schemes: [`Simulation::energy_momentum`].
    pub fn integrator(&mut self) -> &mut MechanismIntegrator {
        let run = self.stepper.as_variational().expect("a variational scheme was asked for");
        run.record_multipliers(true);
        run
    }

    /// The integrator of a variational scheme.
    ///
    /// # Panics
    /// When the scheme is one of the energy–momentum schemes.
    pub(crate) fn into_integrator(self) -> MechanismIntegrator {
        self.stepper.into_variational().expect("a variational scheme was asked for")
    }

    /// The integrator of an energy–momentum scheme, likewise; `None` for the others.
    pub fn energy_momentum(&mut self) -> Option<&mut EmIntegrator<Mechanism>> {
        let run = self.stepper.as_energy_momentum()?;
        run.record_multipliers(true);
        Some(run)
    }

    /// Takes one step of either family, without reading the node.
    ///
    /// # Errors
    /// [`StepError`]; the state is then what it was.
    pub fn step(&mut self) -> Result<StepReport, StepError> {
        self.stepper.step(1)
    }

    /// The present configuration, members one after the other.
    #[must_use]
    pub fn configuration(&self) -> &[f64] {
        self.stepper.place().2
    }

    /// The constraints.
    #[must_use]
    pub fn mechanism(&self) -> &Mechanism {
        self.stepper.mechanism()
    }

    /// Condition numbers of the Newton matrix of the last step; `None` where there is no matrix.
    pub fn condition(&mut self) -> Option<ConditionNumbers> {
        self.stepper.condition()
    }

    /// In how many steps a bound of the tension of beams was raised; `None` where none can be.
    #[must_use]
    pub fn tension_raised(&self) -> Option<u64> {
        self.stepper.tension_raised()
    }

    /// Sets a signal that is a number, for the present node and the steps from it; whether there is
    /// one of this name.
    ///
    /// # Errors
    /// [`ResumeError::NotFinite`]; the signal is then what it was.
    pub fn set_number(&mut self, signal: &str, value: f64) -> Result<bool, ResumeError> {
        let known = self.sensors.numbers().iter().find(|(name, _)| name == signal);
        let Some(place) = known.map(|(_, k)| self.stepper.places_of_signals().start + k) else {
            return Ok(false);
        };
        let mut motion = self.stepper.state();
        motion.state.internal[place] = value;
        self.stepper.resume(motion)?;
        Ok(true)
    }

    /// The state of the run at the present node: between two calls of [`Simulation::run_while`] all
    /// that the rest of the run depends on.
    #[must_use]
    pub fn state(&self) -> RunState {
        RunState {
            motion: self.stepper.state(),
            sensors: self.sensors.state(),
            limits: self.limits.state(),
            energy: self.watch.clone(),
            rotation: self.rotation.fastest,
            divided: self.divided,
            loops: self.loops,
            rolling: self.rolling.state().clone(),
            contacts: self.contacts.state().clone(),
            switches: self.events.as_ref().map(|events| events.switches.clone()),
            iterations: self.iterations,
            held: self.inputs.iter().flat_map(Input::held).collect(),
        }
    }

    /// Continues from a state of a run of the same model: what follows is, bit for bit, what would
    /// have followed there.
    ///
    /// # Errors
    /// [`ResumeError`]; the simulation is then what it was.
    pub fn resume(&mut self, state: RunState) -> Result<(), ResumeError> {
        let RunState {
            motion,
            sensors: followed,
            limits,
            energy,
            rotation,
            divided,
            loops,
            rolling,
            contacts,
            switches,
            iterations,
            held,
        } = state;
        self.sensors.check(&followed)?;
        same_length("the list of beams", limits.len(), self.limits.state().len())?;
        let given = usize::from(switches.is_some());
        same_length("the state of events", given, usize::from(self.events.is_some()))?;
        let width = self.inputs.iter().map(Input::len).sum();
        same_length("the list of values of inputs", held.len(), width)?;
        self.resume_events(switches)?;
        self.stepper.resume(motion)?;
        self.limits.resume(&limits);
        (self.watch, self.divided, self.loops) = (energy, divided, loops);
        self.rotation.fastest = rotation;
        self.rolling.resume(rolling);
        self.contacts.resume(contacts);
        self.sensors.resume(&followed);
        self.iterations = iterations;
        let mut rest = &held[..];
        for input in &self.inputs {
            let (own, others) = rest.split_at(input.len());
            input.set(own);
            rest = others;
        }
        Ok(())
    }
}

impl RunnableModel for Simulation {
    fn columns(&self) -> &[Columns] {
        &self.settings.columns
    }
    fn assembly(&self) -> &AssemblyReport {
        self.assembly()
    }
    fn members(&self) -> &[Member] {
        self.members()
    }
    fn sensors(&self) -> &Sensors {
        self.sensors()
    }
    fn beams(&self) -> &Beams {
        self.beams()
    }
    fn momenta_names(&self) -> Option<MomentaNames> {
        self.momenta_names()
    }
    fn energy_columns(&self) -> &[String] {
        self.energy_columns()
    }
    fn warnings(&self) -> Vec<String> {
        self.warnings()
    }

    fn divided_steps(&self) -> Option<DividedSteps> {
        Some(self.divided).filter(|divided| divided.count > 0)
    }
    fn loop_residuals(&self) -> Option<LoopResiduals> {
        self.mechanism().nearly_redundant().map(|_| self.loops)
    }
    fn tension_raised(&self) -> Option<u64> {
        self.tension_raised()
    }
    fn events(&self) -> Option<Vec<(String, u64)>> {
        let counts = self.events.as_ref()?.counts();
        Some(counts.map(|(name, count)| (name.to_owned(), count)).collect())
    }
    fn contacts(&self) -> &[ContactOrigin] {
        self.contacts.origins()
    }
    fn contact_counts(&self) -> Option<ContactCounts> {
        let state = self.stepper.at(NodeInStep::After);
        self.contacts.has_impulses().then_some(state.contacts.counts)
    }
    fn writes_contacts(&self) -> bool {
        self.settings.contacts
    }
    fn fastest_rotation(&self) -> Option<FastestRotation> {
        self.rotation.so_far(&self.settings)
    }
    fn place(&self) -> (u64, f64) {
        let (step, t, _) = self.stepper.place();
        (step, t)
    }
    fn recording_seconds(&self) -> Option<f64> {
        Some(self.recording.as_secs_f64())
    }
    fn state(&self) -> Option<RunState> {
        Some(self.state())
    }
    fn resume(&mut self, state: RunState) -> Option<Result<(), ResumeError>> {
        Some(self.resume(state))
    }
    fn run_while(
        &mut self,
        observe: &mut dyn FnMut(&Sample) -> io::Result<()>,
        proceed: &mut dyn FnMut(u64, u64) -> bool,
    ) -> io::Result<Option<RunOutcome>> {
        Self::run_while(self, observe, proceed)
    }
}

fn momenta_names(mechanism: &Mechanism, members: &[Member]) -> MomentaNames {
    let rates = mechanism.tree().dof() + mechanism.particle_tree().dof();
    let of = |m: &Member| m.kind.columns().iter().map(|c| format!("{}.{c}", m.name)).collect();
    MomentaNames {
        constraints: counted((0..mechanism.len()).map(|row| mechanism.constraint_name(row))),
        coordinates: members.iter().map(of).collect::<Vec<Vec<String>>>().concat(),
        rates: counted((0..rates).map(|rate| mechanism.rate_name(rate))),
    }
}

/// `NAME.k`, `k` counting neighbours of one name from 1.
fn counted<'a>(names: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut last = ("", 0);
    let mut next = |name: &'a str| {
        last = (name, if name == last.0 { last.1 + 1 } else { 1 });
        format!("{name}.{}", last.1)
    };
    names.map(&mut next).collect()
}

/// How the steps of a variational scheme are taken.
fn options(kind: SchemeKind, settings: &Settings) -> Options {
    let mut options = Options::new(kind, settings.step);
    options.method = settings.method();
    options.newton = settings.newton();
    options
}

/// The integrator of a variational scheme.
pub(crate) fn variational(
    (mechanism, dynamics): (Mechanism, &Dynamics),
    model: &Model,
    (kind, at, solver): (SchemeKind, InitialValues<'_>, Solver),
) -> Result<MechanismIntegrator, ModelError> {
    let settings = &model.settings;
    let system = dynamics.variational(&mechanism);
    let run = integrator(mechanism, system, options(kind, settings), solver, at);
    let contacts = dynamics.forces.contacts.clone();
    let run = run.and_then(|run| with_contacts(run, kind, contacts, nonsmooth_options(settings)));
    run.map_err(|error| assembly::refusal(&error, model))
}

/// The scheme of the settings, ready to step.
pub(crate) fn stepper(
    mechanism: Mechanism,
    dynamics: &Dynamics,
    model: &Model,
    at: InitialValues<'_>,
    solver: Solver,
    wanted: WantedOfNode,
) -> Result<AnyStepper, ModelError> {
    let settings = &model.settings;
    match settings.scheme.family() {
        Family::Variational(kind) => {
            let run = variational((mechanism, dynamics), model, (kind, at, solver))?;
            Ok(AnyStepper::variational(run, settings, wanted))
        }
        Family::EnergyMomentum(_) if model.dissipates_algorithmically() => {
            Err(ModelError::Unsupported {
                key: "simulation.strain".into(),
                what: "energy–momentum schemes have no dissipative strains".into(),
                help: "write a variational scheme, such as \"nodal\", or remove `strain`".into(),
            })
        }
        Family::EnergyMomentum(form) => {
            let mut options = EmOptions::new(form, settings.step);
            options = options.composition(settings.composition());
            options.newton = settings.newton();
            let algebra = EmAlgebra { solver, ..EmAlgebra::default() };
            let system = dynamics.energy_momentum(&mechanism);
            let run = vi_emscheme::run::integrator_at(system, mechanism, options, algebra, at)
                .map_err(|error| assembly::em_refusal(&error, model))?;
            Ok(AnyStepper::energy_momentum(run, settings, wanted))
        }
        Family::Static => Err(ModelError::Unsupported {
            key: "simulation.scheme".into(),
            what: "`static` computes equilibria, no motion".into(),
            help: "take the equilibria of the model, or another scheme".into(),
        }),
    }
}
