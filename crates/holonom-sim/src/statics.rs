//! `scheme = "static"`: the equilibria of a model along its loads.
//!
//! ```text
//! ∇V(q) − f(t, q) + Gᵀ μ = 0,   g(t, q) = 0,        0 ≤ t ≤ end
//! ```
//! `t` is the time of the loads: loads and motors with a history (also a constant one) and
//! prescribed motions are taken at it. Those without a history grow in proportion, `t/end` times
//! what is stated, so that with `end = 1` it is the load factor. The weight is there from the
//! beginning. The initial configuration is relaxed to the first equilibrium
//! ([`vi_statics::relaxation`]); from there on every equilibrium of the continuation is a row of
//! the trajectory, also those between the steps that halving needed. With `arc_length = true` the
//! path is followed by its arc length, through limit points, until `t` first reaches the end. Every
//! equilibrium says how many directions are unstable ([`vi_statics::stability`]); the first change
//! of it is a warning.

use crate::assembly::agreement;
use crate::assembly::curved_elements::remarks_at;
use crate::assembly::{self, AssemblyReport};
use crate::experiment::RunnableModel;
use crate::resolution::limits::LimitWatch;
use crate::run::contacts::ContactWatch;
pub use crate::run::outcome::StaticFacts;
use crate::run::outcome::{RunFailure, RunOutcome};
use crate::sample::{Member, ResidualsAtLevels, Sample};
use crate::sensor::{Sensors, View};
use crate::system::beams::{Beams, bending_bounds};
use crate::system::contact_origin::ContactOrigin;
use crate::system::law::{self, Laws};
use crate::system::outside::ExternalActions;
use crate::system::{self, System};

use holonom_model::{Bifurcation, Columns, History, Model, ModelError, Scheme, Settings};
use nalgebra::Complex;
use std::io;
use vi_constraints::Constraints;
use vi_constraints::closure::ClosureWatch;
use vi_constraints::saddle_point::IndependentRows;
use vi_core::Configuration;
use vi_core::newton::{Fault, NewtonError};
use vi_core::sparse::SparseMatrix;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::IndependentLoops;
use vi_statics::{
    ArcLengthSettings, Equilibrium, RotationError, StaticError, StaticProblem, StaticSettings,
    SteadyMotion, SteadyMotionError, SteadyRotation,
};

/// Steps of the loads that lead to the equilibrium of a model of motion.
const STEPS: f64 = 10.0;
/// Largest number of equilibria of a continuation by arc length.
const MOST: usize = 2000;
/// What is done where there are no equilibria.
const MOTION: &str =
    "integrate the motion with `holonom run`, or take its modes by `holonom modes --at motion`";

/// A model in search of its equilibria.
#[derive(Debug)]
pub struct Statics {
    settings: Settings,
    assembly: AssemblyReport,
    members: Vec<Member>,
    sensors: Sensors,
    contacts: ContactWatch, // compliant ones
    beams: Beams,
    laws: Laws, // which know why they have no value
    limits: LimitWatch,
    problem: StaticProblem,
    rows: IndependentRows, // with those inside the frames
    mechanism: Mechanism,
    watch: ClosureWatch,
    facts: StaticFacts,
    step: u64,
}

/// A model in search of its equilibria, in the frame of the steady rotation of its initial
/// velocities.
#[derive(Debug)]
pub struct InOwnRotation {
    /// The model.
    pub statics: Statics,
    /// The rotation; `None` where the initial velocities are zero.
    pub rotation: Option<SteadyRotation>,
}

/// An integral rests only where what it integrates vanishes: that is no equation of positions.
fn refuse_integrals(model: &Model) -> Result<(), ModelError> {
    for signal in &model.signals {
        let name = &signal.name;
        let pid = signal.pid.as_ref().filter(|_| signal.every.is_none());
        let (kind, what) = match (pid, &signal.rate) {
            (Some(pid), _) if pid.integral != 0.0 => ("pid.integral", "a controller integrates"),
            (_, Some(_)) => ("rate", "a rate integrates"),
            _ => continue,
        };
        return Err(ModelError::Unsupported {
            key: format!("signal.{name}.{kind}"),
            what: format!("the signal `{name}` has no equilibrium of its own: {what}"),
            help: "remove the integral for statics, or write a `filter`; an equilibrium under control is the end \
                   of a damped motion"
                .into(),
        });
    }
    Ok(())
}

/// Continuous states of signals have no place in the second-order equations of a steady rotation
/// and of a harmonic response.
pub(crate) fn refuse_states(model: &Model, of: &str) -> Result<(), ModelError> {
    let Some(signal) = model.signals.iter().find(|signal| signal.has_states()) else {
        return Ok(());
    };
    let (name, kind) = (&signal.name, signal.kinds()[0]);
    Err(ModelError::Unsupported {
        key: format!("signal.{name}.{kind}"),
        what: format!("{of} have no continuous states, and the signal `{name}` by `{kind}` has one"),
        help: "write it as a `value`, such as proportional and rate gains, or sample it by `every`: it is then held"
            .into(),
    })
}

/// What rolls or slides on a blade has no equilibria: where it rests depends on how it came there.
pub(crate) fn refuse_rolling(model: &Model, help: &str) -> Result<(), ModelError> {
    let Some(constraint) = model.constraints.iter().find(|c| c.is_of_velocities()) else {
        return Ok(());
    };
    let what = "equilibria, rotations and responses of what rolls or slides on a blade are not \
                computed: they depend on the motion";
    Err(ModelError::Unsupported {
        key: format!("constraint.{}", constraint.name()),
        what: what.into(),
        help: help.into(),
    })
}

impl Statics {
    /// Assembles the system of a validated model, whatever its scheme.
    ///
    /// # Errors
    /// [`ModelError`].
    pub fn new(model: &Model) -> Result<Self, ModelError> {
        Self::with_loads_as_stated(&growing(model))
    }

    /// The same with the loads of a motion: those without a history are there at all times.
    ///
    /// # Errors
    /// [`ModelError`].
    pub fn with_loads_as_stated(model: &Model) -> Result<Self, ModelError> {
        refuse_rolling(model, MOTION)?;
        refuse_integrals(model)?;
        Self::assembled(model)
    }

    /// Of a model of statics along its loads, with what acts on it from outside.
    pub(crate) fn with_outside(
        model: &Model,
        outside: &ExternalActions,
    ) -> Result<Self, ModelError> {
        let model = &growing(model);
        refuse_rolling(model, MOTION)?;
        refuse_integrals(model)?;
        Self::assembled_with(model, outside)
    }

    /// The same of any model, also of one that has no equilibria.
    fn assembled(model: &Model) -> Result<Self, ModelError> {
        Self::assembled_with(model, &ExternalActions::default())
    }

    fn assembled_with(model: &Model, outside: &ExternalActions) -> Result<Self, ModelError> {
        let System { mechanism, dynamics, members, mut sensors, beams, contacts, laws, .. } =
            system::build_with(model, outside)?;
        let system = dynamics.variational(&mechanism);
        let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
        let nearly = IndependentLoops::find(&mechanism, 0.0, &q).ok();
        let mechanism = mechanism.accepting(nearly.and_then(|loops| loops.nearly_redundant()));
        let problem =
            StaticProblem::new(system, mechanism.clone()).with_elements(beams.parts.neighbours());
        let kinds = beams.parts.elements.list().iter().map(|element| element.law.kind());
        let problem = problem.with_bounds(kinds.map(bending_bounds));
        let internal = 6 * mechanism.description().bodies.len();
        let chosen: Vec<usize> =
            (0..internal).chain(problem.rows().rows().iter().copied()).collect();
        let rows = IndependentRows::choose(mechanism.len(), &chosen);
        let closure = assembly::closure(&mechanism, &q, &vec![0.0; q.len()]);
        let mut assembly = assembly::counts(model, &mechanism, &rows, &beams, closure);
        assembly.measure(model, &mechanism, &dynamics.parts.mass_matrix(&mechanism));
        if v.iter().any(|v| *v != 0.0) {
            let note = "the initial velocities of the model are not used in statics";
            assembly.warnings.push(note.into());
        }
        sensors.begin(&q);
        let settings = model.settings.clone();
        let facts = StaticFacts { arc_length: settings.arc_length, ..StaticFacts::default() };
        let (limits, step) = (LimitWatch::new(&beams), 0);
        agreement::paths(&mechanism, &rows, &q, settings.end)?;
        let watch =
            ClosureWatch::new(&mechanism, Configuration::new(0.0, &q), settings.newton_tolerance);
        Ok(Self {
            settings,
            assembly,
            members,
            sensors,
            contacts: ContactWatch::new(contacts),
            beams,
            laws,
            limits,
            problem,
            rows,
            mechanism,
            watch,
            facts,
            step,
        })
    }

    /// Of a model of any scheme along its loads; those of a motion grow in [`STEPS`] steps.
    pub(crate) fn along_loads(model: &Model) -> Result<Self, ModelError> {
        Self::new(&as_static(model))
    }

    /// Of a model of any scheme at its initial configuration, under the loads at `t = 0`.
    pub(crate) fn at_start(model: &Model) -> Result<Self, ModelError> {
        match model.settings.scheme {
            Scheme::Static => Self::new(model),
            _ => Self::with_loads_as_stated(&as_static(model)),
        }
    }

    /// The same of a model that may roll or have integrals, and so no equilibria.
    pub(crate) fn in_motion(model: &Model) -> Result<Self, ModelError> {
        match model.settings.scheme {
            Scheme::Static => Self::assembled(&growing(model)),
            _ => Self::assembled(&as_static(model)),
        }
    }

    /// From this configuration instead of the initial one.
    pub(crate) fn beginning_at(self, q: &[f64]) -> Self {
        Self { problem: self.problem.starting_at(q), ..self }
    }

    /// `∂y/∂q δq + ∂y/∂v iω δq − ∂y/∂a ω² δq` of all numbers of sensors in the present state, by
    /// central differences over displacements of a `part` of the size of the system.
    pub(crate) fn sensor_amplitudes(
        &mut self,
        omega: f64,
        dq: &[Complex<f64>],
        part: f64,
    ) -> Vec<Complex<f64>> {
        let q = self.problem.configuration().to_vec();
        let reach = q.iter().fold(0.0, |largest: f64, x| largest.max(x.abs())).max(1e-6);
        let mut derivative = |pick: &dyn Fn(&Complex<f64>) -> f64| -> Vec<f64> {
            let i_omega = Complex::new(0.0, omega);
            let [u, v, a] = [0, 1, 2].map(|order| -> Vec<f64> {
                dq.iter().map(|dq| pick(&(i_omega.powu(order) * dq))).collect()
            });
            let largest = u.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
            let fast = v.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
            if largest.max(fast) == 0.0 {
                return vec![0.0; self.sensors.columns().len()];
            }
            // a phase in which nothing is displaced still moves
            let step = part * reach / if largest > 0.0 { largest } else { fast };
            let mut at = |sign: f64| {
                let scaled =
                    |x: &[f64]| -> Vec<f64> { x.iter().map(|x| sign * step * x).collect() };
                let q: Vec<f64> = q.iter().zip(scaled(&u)).map(|(q, u)| q + u).collect();
                self.read_sensors(&q, &scaled(&v), &scaled(&a))
            };
            let (after, before) = (at(1.0), at(-1.0));
            after.iter().zip(&before).map(|(a, b)| (a - b) / (2.0 * step)).collect()
        };
        let (re, im) = (derivative(&|x| x.re), derivative(&|x| x.im));
        self.sensors.follow(&q);
        re.into_iter().zip(im).map(|(re, im)| Complex::new(re, im)).collect()
    }

    fn read_sensors(&mut self, q: &[f64], v: &[f64], a: &[f64]) -> Vec<f64> {
        let mut values = Vec::new();
        let rest = vec![0.0; q.len()];
        self.sensors.follow(q);
        let (angles, signals, slips) = (&[][..], &[][..], &[][..]); // as at the start
        let t = self.problem.factor();
        self.contacts.read(None, [q, v]);
        let (works, contacts) = (None, self.contacts.seen());
        let view = View { t, q, angles, signals, v, a, force: &rest, works, slips, contacts };
        self.sensors.read(&self.mechanism, &self.rows, view, &mut values);
        values
    }

    /// Time of the loads at the end of the path, s.
    #[must_use]
    pub fn end(&self) -> f64 {
        self.settings.end
    }

    /// The members, in the order of their coordinates.
    #[must_use]
    pub fn members(&self) -> &[Member] {
        &self.members
    }

    /// The beams.
    #[must_use]
    pub fn beams(&self) -> &Beams {
        &self.beams
    }

    /// The problem at its last equilibrium.
    pub fn problem(&mut self) -> &mut StaticProblem {
        &mut self.problem
    }

    /// Joints, bodies, constraints.
    #[must_use]
    pub fn mechanism(&self) -> &Mechanism {
        &self.mechanism
    }

    /// The steady rotation of the initial velocities; `None` at rest.
    ///
    /// # Errors
    /// [`RotationError::NotRigid`].
    pub fn rotation(&self) -> Result<Option<SteadyRotation>, RotationError> {
        let (q, v) = (self.mechanism.initial_configuration(), self.mechanism.initial_velocity());
        SteadyRotation::of_velocities(&self.mechanism, &q, &v)
    }

    /// Whether joints and forces let the whole system rotate so.
    ///
    /// # Errors
    /// [`RotationError`].
    pub fn admits(&self, rotation: &SteadyRotation) -> Result<(), RotationError> {
        self.problem.admits(rotation)
    }

    /// In the frame of a rotation that the system admits, from the configuration `from` or the
    /// initial one.
    #[must_use]
    pub fn in_rotation(self, rotation: &SteadyRotation, from: Option<&[f64]>) -> Self {
        let problem = self.problem.in_rotation(rotation);
        let problem = match from {
            Some(q) => problem.starting_at(q),
            None => problem,
        };
        Self { problem, ..self }
    }

    /// In the frame of the steady rotation of the initial velocities; unchanged where these are
    /// zero.
    ///
    /// # Errors
    /// [`RotationError`].
    pub fn in_own_rotation(self) -> Result<InOwnRotation, RotationError> {
        let rotation = self.rotation()?;
        let statics = match &rotation {
            Some(rotation) => {
                self.admits(rotation)?;
                self.in_rotation(rotation, None)
            }
            None => self,
        };
        Ok(InOwnRotation { statics, rotation })
    }

    /// In the frame that moves with the steady motion of the initial velocities.
    ///
    /// # Errors
    /// [`SteadyMotionError`].
    pub(crate) fn in_own_motion(self) -> Result<(Self, SteadyMotion), SteadyMotionError> {
        let (q, v) = (self.mechanism.initial_configuration(), self.mechanism.initial_velocity());
        let motion = self.problem.steady_motion(&q, &v)?;
        let problem = self.problem.in_motion(&motion);
        Ok((Self { problem, ..self }, motion))
    }

    /// Goes to the equilibrium under the present loads.
    ///
    /// # Errors
    /// [`RunFailure`].
    pub fn relax(&mut self) -> Result<(), RunFailure> {
        match self.problem.equilibrate() {
            Ok(point) => self.check(&point),
            Err(error) => Err(self.failure(&error)),
        }
    }

    /// Continuation to the end of the loads without recording anything.
    ///
    /// # Errors
    /// [`RunFailure`].
    pub fn reach_end(&mut self) -> Result<(), RunFailure> {
        let mut ignore = |_: &Sample| Ok(());
        match RunnableModel::run(self, &mut ignore, &mut |_, _| {}) {
            Ok(RunOutcome::Failed(failure)) => Err(failure),
            _ => Ok(()),
        }
    }

    /// The trajectory's row of an equilibrium.
    fn sample(&mut self, point: &Equilibrium) -> Sample {
        self.sensors.follow(&point.q);
        // what is too far the problem refuses itself
        let _ = self.limits.follow(point.factor, &point.q);
        self.facts.equilibria += 1;
        self.facts.max_residual = self.facts.max_residual.max(point.residual);
        self.facts.largest_time = self.facts.largest_time.max(point.factor);
        let lost = point.unstable.is_some_and(|count| count > 0) && !self.facts.is_lost();
        let flutters = lost && self.problem.flutters();
        self.facts.follow_stability(point.factor, point.unstable, flutters);
        let rest = vec![0.0; point.q.len()];
        let force = self.constraint_force(point);
        let (angles, signals) = (&point.angles[..], &[][..]); // as at the start
        self.contacts.read(None, [&point.q, &rest]);
        let contacts = self.contacts.seen();
        let view = View {
            t: point.factor,
            q: &point.q,
            angles,
            signals,
            v: &rest,
            a: &rest,
            force: &force,
            works: None,
            slips: &[],
            contacts,
        };
        let recorded = contacts.filter(|_| self.settings.contacts).unwrap_or_default();
        let mut sample = Sample {
            step: self.step,
            t: point.factor,
            energy: point.potential_energy,
            hamiltonian: point.potential_energy,
            residuals: ResidualsAtLevels {
                position: point.position_residual,
                ..ResidualsAtLevels::default()
            },
            newton_iterations: point.iterations as f64,
            q: point.q.clone(),
            unstable: point.unstable,
            contacts: recorded.to_vec(),
            ..Sample::default()
        };
        self.sensors.read(&self.mechanism, &self.rows, view, &mut sample.sensors);
        self.step += 1;
        sample
    }

    /// `Gᵀλ` of an equilibrium.
    fn constraint_force(&self, point: &Equilibrium) -> Vec<f64> {
        let mut force = vec![0.0; point.q.len()];
        let jacobian = SparseMatrix::assemble(point.multipliers.len(), force.len(), |out| {
            self.mechanism.jacobian(point.factor, &point.q, out);
        });
        jacobian.tr_mul_add(1.0, &point.multipliers, &mut force);
        force
    }

    /// Whether an equilibrium satisfies all constraints.
    fn check(&mut self, point: &Equilibrium) -> Result<(), RunFailure> {
        let at =
            Configuration { t: point.factor, q: &point.q, angles: &point.angles, internal: &[] };
        self.watch.check(&self.mechanism, at).map_err(|error| {
            let name = error.constraint().map_or("", |row| self.mechanism.constraint_name(row));
            RunFailure {
                step: self.step,
                t: point.factor,
                message: format!("{error} (`{name}`)"),
                remedy: error.remedy().into(),
            }
        })
    }

    fn failure(&self, error: &StaticError) -> RunFailure {
        let (step, t) = (self.step.saturating_sub(1), self.problem.factor());
        let undefined = matches!(
            error,
            StaticError::NotConverged {
                cause: NewtonError::Refused { fault: Fault::NotFinite, .. },
                ..
            }
        );
        let fault = law::fault_within(&self.laws, t, self.settings.step.max(self.settings.end - t));
        if let Some(fault) = fault.filter(|_| undefined) {
            return fault.failure(step, t);
        }
        RunFailure { step, t, message: error.to_string(), remedy: error.remedy().into() }
    }

    /// Steps of the loads, halved where they need it.
    fn by_steps(
        &mut self,
        observe: &mut Observe<'_>,
        proceed: &mut dyn FnMut(u64, u64) -> bool,
    ) -> io::Result<Result<Reached, RunFailure>> {
        let steps = self.settings.steps();
        let settings = StaticSettings {
            first_step: 1.0,
            switches_branch: self.switches_branch(),
            newton: self.newton(),
            ..StaticSettings::default()
        };
        for n in 1..=steps {
            if !proceed(n, steps) {
                return Ok(Ok(Reached::Paused));
            }
            let target = self.settings.end * n as f64 / steps as f64;
            let walked = self.problem.solve(&[target], &settings);
            let (path, error) = match walked {
                Ok(path) => (Some(path), None),
                Err(error) => (error.path().cloned(), Some(error)),
            };
            let path = path.unwrap_or_default();
            self.facts.halvings += path.halvings as u64;
            self.facts.switched = path.switched.or(self.facts.switched);
            let recorded = n.is_multiple_of(self.settings.every) || n == steps || error.is_some();
            for point in &path.points {
                if let Err(failure) = self.check(point) {
                    return Ok(Err(failure));
                }
                let sample = self.sample(point);
                if recorded {
                    observe(&sample)?;
                }
            }
            if let Some(error) = error {
                return Ok(Err(self.failure(&error)));
            }
        }
        Ok(Ok(Reached::End))
    }

    /// The path by its arc length, to the first point where the time of the loads is the end.
    fn by_arc(
        &mut self,
        observe: &mut Observe<'_>,
        proceed: &mut dyn FnMut(u64, u64) -> bool,
    ) -> io::Result<Result<Reached, RunFailure>> {
        let end = self.settings.end;
        let length = self.settings.step / end;
        let settings = ArcLengthSettings {
            first_length: 0.2 * length,
            largest_length: length,
            full_load: end,
            switches_branch: self.switches_branch(),
            newton: vi_core::NewtonSettings { max_iterations: 15, ..self.newton() },
            ..ArcLengthSettings::default()
        };
        let mut continuation = self.problem.continuation(&settings);
        for n in 0..MOST {
            if !proceed(n as u64, MOST as u64) {
                return Ok(Ok(Reached::Paused));
            }
            let point = match self.problem.next_equilibrium(&mut continuation) {
                Ok(point) => point,
                Err(error) => return Ok(Err(self.failure(&error))),
            };
            if let Err(failure) = self.check(&point) {
                return Ok(Err(failure));
            }
            self.facts.halvings = continuation.halvings() as u64;
            self.facts.switched = continuation.switched();
            if point.factor >= end {
                let settings =
                    StaticSettings { newton: self.newton(), ..StaticSettings::default() };
                return match self.problem.solve(&[end], &settings) {
                    Ok(path) => {
                        let last = path.points.last().unwrap_or(&point).clone();
                        let sample = self.sample(&last);
                        observe(&sample).map(|()| Ok(Reached::End))
                    }
                    Err(error) => Ok(Err(self.failure(&error))),
                };
            }
            let sample = self.sample(&point);
            observe(&sample)?;
        }
        let factor = self.problem.factor();
        Ok(Err(self.failure(&StaticError::TooLong { factor, equilibria: MOST })))
    }

    fn switches_branch(&self) -> bool {
        self.settings.bifurcation == Bifurcation::Switch
    }

    fn newton(&self) -> vi_core::NewtonSettings {
        let asked = self.settings.newton();
        vi_core::NewtonSettings { max_iterations: asked.max_iterations.min(25), ..asked }
    }
}

/// The model as one of statics.
fn as_static(model: &Model) -> Model {
    let mut model = model.clone();
    if model.settings.scheme != Scheme::Static {
        model.settings.scheme = Scheme::Static;
        model.settings.step = model.settings.end / STEPS;
    }
    model
}

/// How far a continuation came without a failure.
enum Reached {
    End,
    Paused,
}

type Observe<'a> = dyn FnMut(&Sample) -> io::Result<()> + 'a;

impl RunnableModel for Statics {
    fn columns(&self) -> &[Columns] {
        &self.settings.columns
    }

    fn assembly(&self) -> &AssemblyReport {
        &self.assembly
    }

    fn members(&self) -> &[Member] {
        &self.members
    }

    fn sensors(&self) -> &Sensors {
        &self.sensors
    }

    fn contacts(&self) -> &[ContactOrigin] {
        self.contacts.origins()
    }

    fn writes_contacts(&self) -> bool {
        self.settings.contacts
    }

    fn beams(&self) -> &Beams {
        &self.beams
    }

    fn warnings(&self) -> Vec<String> {
        let stability =
            self.facts.stability_warning().into_iter().chain(self.facts.unjudged_warning());
        let stability = stability.chain(self.facts.branch_note());
        self.assembly
            .warnings
            .iter()
            .cloned()
            .chain(self.limits.warnings())
            .chain(remarks_at(&self.beams, self.problem.configuration(), &self.assembly.warnings))
            .chain(stability)
            .collect()
    }

    fn statics(&self) -> Option<StaticFacts> {
        Some(self.facts)
    }

    fn place(&self) -> (u64, f64) {
        (self.step.saturating_sub(1), self.problem.factor())
    }

    fn run_while(
        &mut self,
        observe: &mut Observe<'_>,
        proceed: &mut dyn FnMut(u64, u64) -> bool,
    ) -> io::Result<Option<RunOutcome>> {
        let first = match self.problem.equilibrate() {
            Ok(point) => point,
            Err(error) => return Ok(Some(RunOutcome::Failed(self.failure(&error)))),
        };
        if let Err(failure) = self.check(&first) {
            return Ok(Some(RunOutcome::Failed(failure)));
        }
        self.facts.neutral = self.problem.is_neutral();
        let sample = self.sample(&first);
        observe(&sample)?;
        let walked = if self.settings.arc_length {
            self.by_arc(observe, proceed)?
        } else {
            self.by_steps(observe, proceed)?
        };
        Ok(match walked {
            Ok(Reached::End) => Some(RunOutcome::Done),
            Ok(Reached::Paused) => None,
            Err(failure) => Some(RunOutcome::Failed(failure)),
        })
    }
}

/// The model with loads that grow where they have no history.
pub(crate) fn growing(model: &Model) -> Model {
    let mut model = model.clone();
    let end = model.settings.end;
    let loads = model.loads.iter_mut().map(|load| &mut load.history);
    let motors = model.joints.iter_mut().filter_map(|joint| joint.motor.as_mut());
    for history in loads.chain(motors.map(|motor| &mut motor.history)) {
        if history.is_unstated() {
            *history = History::Linear { end };
        }
    }
    model
}
