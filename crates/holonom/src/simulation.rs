//! The system of a model, and its run.
//!
//! At order 2 the quantities of a node belong to the step that starts there: the multipliers, `p_n`,
//! `E_d`. A node is therefore handed out after that step has been taken; at the last node one more
//! step is tried for them, and where it fails (or the run does) the node is described by `q_n` and
//! the projected momentum alone, with `H_d` in the place of `E_d`.

pub use crate::assembly::{AssemblyReport, Closure};

use crate::assembly;
use crate::beams::Beams;
use crate::limits::LimitWatch;
use crate::model::{Model, ModelError, Scheme, Settings};
use crate::sample::{Member, Residuals, Sample};
use crate::sensor::{Sensors, View};
use crate::system::{self, System};
use serde::{Deserialize, Serialize};
use vi_constraints::node::Node;
use vi_constraints::scheme::StepError;
use vi_constraints::{Constraints, Options, SchemeKind};
use vi_core::State;
use vi_core::linear::norm_inf;
use vi_multibody::run::{MechanismIntegrator, Solver, integrator};

/// What a placement is told that bends an element too far, and what to do about it.
fn bent_too_far((beam, element, angle): (&str, usize, f64)) -> (String, String) {
    let angle = angle.to_degrees();
    let message = format!(
        "element {element} of beam `{beam}` is bent by {angle:.1}° between its nodes; beyond 90° an element \
         folds at no cost"
    );
    (message, "write more elements".into())
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum RunOutcome {
    /// At its end time.
    Done,
    /// Before.
    Failed(RunFailure),
}

/// Why a run ended before its time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunFailure {
    /// The step that could not be taken.
    pub step: u64,
    /// The time where it began, s.
    pub t: f64,
    /// What happened.
    pub message: String,
    /// What to do about it.
    pub remedy: String,
}

/// A system that can be run.
pub struct Simulation {
    settings: Settings,
    assembly: AssemblyReport,
    members: Vec<Member>,
    sensors: Sensors,
    beams: Beams,
    limits: LimitWatch,
    integrator: MechanismIntegrator,
}

impl From<Scheme> for SchemeKind {
    fn from(scheme: Scheme) -> Self {
        match scheme {
            Scheme::Nodal => Self::Nodal,
            Scheme::Constrained => Self::Constrained,
            Scheme::Dalembert => Self::Dalembert,
            Scheme::Reduced => Self::Reduced,
        }
    }
}

impl Simulation {
    /// Assembles the system of a validated model.
    ///
    /// # Errors
    /// [`ModelError`] when the start is inconsistent, the mass matrix is singular, or the scheme does
    /// not fit the model.
    pub fn new(model: &Model) -> Result<Self, ModelError> {
        Self::with_solver(model, model.settings.solver.into())
    }

    /// The same with the linear solver of the nodal scheme chosen by name.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn with_solver(model: &Model, solver: Solver) -> Result<Self, ModelError> {
        let System { mechanism, system, members, mut sensors, beams, .. } = system::build(model)?;
        let settings = model.settings.clone();
        let (q, v) = mechanism.start();
        let closure = assembly::closure(&mechanism, &q, &v);
        let tolerance = settings.start_tolerance;
        let missed = assembly::velocity_inconsistencies(&mechanism, (&q, &v), tolerance);
        if !missed.is_empty() && !settings.project_start {
            return Err(ModelError::InconsistentStart(missed));
        }
        let mut options = Options::new(settings.scheme.into(), settings.step);
        options.gammas = settings.composition().gammas();
        options.newton = settings.newton();
        let integrator = integrator(mechanism, system, options, solver, (0.0, &q, &v))
            .map_err(|error| assembly::refusal(&error, &settings))?;
        let mut assembly = assembly::report(model, &integrator, &beams, closure);
        let mut limits = LimitWatch::new(&beams);
        if let Err(fault) = limits.follow(0.0, &integrator.state().q) {
            let key = format!("beam.{}.elements", fault.0);
            let (what, help) = bent_too_far(fault);
            return Err(ModelError::Unsupported { key, what, help });
        }
        assembly.warnings.extend(limits.warnings());
        limits.begin();
        sensors.begin(&integrator.state().q);
        Ok(Self { settings, assembly, members, sensors, beams, limits, integrator })
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

    /// The sensors.
    #[must_use]
    pub fn sensors(&self) -> &Sensors {
        &self.sensors
    }

    /// The beams.
    #[must_use]
    pub fn beams(&self) -> &Beams {
        &self.beams
    }

    /// What is worth knowing of the assembly and of the run so far.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        self.assembly.warnings.iter().cloned().chain(self.limits.warnings()).collect()
    }

    /// The integrator at its present node.
    pub fn integrator(&mut self) -> &mut MechanismIntegrator {
        &mut self.integrator
    }

    /// Runs to the end; `observe` gets each recorded node and may stop the run by an error;
    /// `progress(step, of)` is called now and then.
    ///
    /// # Errors
    /// Whatever `observe` returns.
    pub fn run<E>(
        &mut self,
        observe: &mut dyn FnMut(&Sample) -> Result<(), E>,
        progress: &mut dyn FnMut(u64, u64),
    ) -> Result<RunOutcome, E> {
        let steps = self.settings.steps();
        let mut iterations = 0.0; // of the step that led to the present node
        self.sensors.follow(&self.integrator.state().q);
        for n in 0..steps {
            if n.is_multiple_of(256) {
                progress(n, steps);
            }
            let recorded = n.is_multiple_of(self.settings.every);
            match self.advance(recorded, &mut iterations) {
                (Some(sample), Ok(())) => observe(&sample)?,
                (None, Ok(())) => {}
                (sample, Err(failure)) => {
                    if let Some(sample) = sample {
                        observe(&sample)?;
                    }
                    progress(n, steps);
                    return Ok(RunOutcome::Failed(failure));
                }
            }
        }
        match self.last_sample(iterations) {
            Ok(sample) => observe(&sample)?,
            Err(failure) => return Ok(RunOutcome::Failed(failure)),
        }
        progress(steps, steps);
        Ok(RunOutcome::Done)
    }

    /// Takes one step; the sample is of the node it started from, when that is to be recorded.
    fn advance(
        &mut self,
        recorded: bool,
        iterations: &mut f64,
    ) -> (Option<Sample>, Result<(), RunFailure>) {
        let composed = self.settings.order > 2;
        let mut sample = None;
        if recorded && composed {
            match self.sample_from_state(*iterations) {
                Ok(found) => sample = Some(found),
                Err(failure) => return (None, Err(failure)),
            }
        }
        let start = if recorded && !composed { self.start_multiplier() } else { None };
        match self.integrator.step() {
            Err(error) => {
                if recorded && !composed {
                    sample = self.sample_from_state(*iterations).ok();
                }
                let failure = self.failure(&error);
                (sample, Err(failure))
            }
            Ok(report) => {
                if recorded && !composed {
                    match self.sample_before(start.as_deref(), *iterations) {
                        Ok(found) => sample = Some(found),
                        Err(failure) => return (None, Err(failure)),
                    }
                }
                let state = self.integrator.state();
                self.sensors.follow(&state.q);
                if let Err(fault) = self.limits.follow(state.t, &state.q) {
                    let (message, remedy) = bent_too_far(fault);
                    let (step, t) = (state.step, state.t);
                    return (sample, Err(RunFailure { step, t, message, remedy }));
                }
                *iterations = report.iterations as f64 / report.sub_steps.max(1) as f64;
                (sample, Ok(()))
            }
        }
    }

    /// The node that the last step started from; `start`: multipliers that replace those of (47).
    fn sample_before(
        &mut self,
        start: Option<&[f64]>,
        iterations: f64,
    ) -> Result<Sample, RunFailure> {
        let node = self.integrator.node_before().cloned();
        let node = node.map_err(|error| self.lost(&error.to_string()))?;
        let lambda = start.unwrap_or(&node.lambda);
        self.sample(self.integrator.before(), &node, lambda, iterations)
    }

    /// At the start the multipliers (47) are of first order; sensors take the acceleration level there.
    fn start_multiplier(&mut self) -> Option<Vec<f64>> {
        let at_start = self.sensors.need_multipliers() && self.integrator.state().step == 0;
        if at_start { self.acceleration_multiplier().ok() } else { None }
    }

    /// The present node with the step from there, where that can be taken.
    fn last_sample(&mut self, iterations: f64) -> Result<Sample, RunFailure> {
        if self.settings.order > 2 {
            return self.sample_from_state(iterations);
        }
        match self.integrator.observe().cloned() {
            Ok(node) => self.sample(self.integrator.state(), &node, &node.lambda, iterations),
            Err(_) => self.sample_from_state(iterations),
        }
    }

    /// The present node, from `q_n` and the projected momentum alone.
    fn sample_from_state(&mut self, iterations: f64) -> Result<Sample, RunFailure> {
        let node = self.integrator.observe_state().cloned();
        let node = node.map_err(|error| self.lost(&error.to_string()))?;
        let lambda = self.acceleration_multiplier()?;
        self.sample(self.integrator.state(), &node, &lambda, iterations)
    }

    /// `λ` of the acceleration level at the present node; empty when no sensor reads it.
    fn acceleration_multiplier(&mut self) -> Result<Vec<f64>, RunFailure> {
        if !self.sensors.need_multipliers() {
            return Ok(Vec::new());
        }
        let lambda = self.integrator.acceleration_multiplier();
        lambda.map_err(|error| self.lost(&error.to_string()))
    }

    /// A node; `lambda` is read by sensors of reactions only.
    fn sample(
        &self,
        at: &State,
        node: &Node,
        lambda: &[f64],
        iterations: f64,
    ) -> Result<Sample, RunFailure> {
        let (mechanism, rows) = (self.integrator.constraints(), self.integrator.rows());
        let view = View { t: at.t, q: &at.q, v: &node.v, lambda };
        let sample = Sample {
            step: at.step,
            t: at.t,
            q: at.q.clone(),
            energy: node.discrete_energy,
            hamiltonian: node.hamiltonian_projected,
            momentum: self.integrator.constraints().momentum(&at.q, &node.p_projected),
            residuals: Residuals {
                position: node.position_residual,
                velocity: node.velocity_residual,
                momentum: node.momentum_residual,
            },
            newton_iterations: iterations,
            sensors: self.sensors.read(mechanism, rows, view),
        };
        let energies = sample.energy.is_finite() && sample.hamiltonian.is_finite();
        if energies && norm_inf(&sample.q).is_finite() {
            return Ok(sample);
        }
        Err(self.lost("a value that is not finite"))
    }

    fn lost(&self, message: &str) -> RunFailure {
        let state = self.integrator.state();
        let remedy = "look for a singular placement near the last rows of the trajectory".into();
        RunFailure { step: state.step, t: state.t, message: message.into(), remedy }
    }

    fn failure(&self, error: &StepError) -> RunFailure {
        let state = self.integrator.state();
        let place = self.culprit(error).map_or_else(String::new, |name| format!(" ({name})"));
        RunFailure {
            step: state.step,
            t: state.t,
            message: format!("{error}{place}"),
            remedy: error.remedy().into(),
        }
    }

    /// The joint, body or particle that a failed step is about.
    fn culprit(&self, error: &StepError) -> Option<String> {
        let mechanism = self.integrator.constraints();
        let (_, unknown) = error.unknown()?;
        match self.settings.scheme {
            Scheme::Nodal | Scheme::Reduced if unknown < mechanism.tree().dof() => {
                let (link, _) = mechanism.tree().owner(unknown)?;
                let body = &mechanism.description().bodies[link.frame].name;
                Some(format!("body `{body}`, carried by `{}`", link.joint.name))
            }
            Scheme::Nodal | Scheme::Reduced => None,
            _ if unknown < mechanism.dim() => {
                Some(format!("`{}`", mechanism.coordinate_name(unknown)))
            }
            _ => None,
        }
    }
}
