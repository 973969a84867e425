//! Variational and energy–momentum schemes side by side: same model, same start, same step.
//!
//! ```text
//! distance       max_n |q_n − q^ref_n|_∞        against the nodal (constrained) variational scheme with h/k
//! energy error   max_n |H_n − H_0|              H_d with the projected momentum; H of the EM scheme
//! momentum drift max_n |J_n − J_0|              per component, linear and angular
//! residuals      |g(q_n)|, |Ḡ Δq/h|, |G(q_n) M⁻¹ p_n|       position, velocity, momentum level
//! κ              of the Newton matrix, as written and as factorized, at several h
//! ```
//! Plain data, ready to be written or printed; nothing is judged here.

use crate::integrator::{EmIntegrator, EmOptions, EmSetupError};
use crate::scheme::EmForm;
use crate::subject::Subject;
use serde::{Deserialize, Serialize};
use std::time::Instant;
use vi_constraints::integrator::{Integrator, Options, SetupError};
use vi_constraints::scheme::{Condition, SchemeKind, StepError};
use vi_core::SeparableSystem;
use vi_core::linear::Singular;
use vi_core::momentum_map::Momentum;
use vi_multibody::map::TreeMap;
use vi_multibody::mechanism::Mechanism;

/// What to compare.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComparisonSettings {
    /// Time step `h`, s.
    pub step: f64,
    /// Number of steps.
    pub steps: usize,
    /// The reference makes this many steps in one.
    pub refinement: usize,
    /// Steps at which condition numbers are taken, s.
    pub condition_steps: Vec<f64>,
}

/// Largest values along a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Residuals {
    /// `|g(q_n)|_∞`.
    pub position: f64,
    /// `|G(q_{n+1/2}) Δq/h|_∞`.
    pub velocity: f64,
    /// `|G(q_n) M⁻¹ p_n|_∞`; with `v_n` for energy–momentum schemes.
    pub momentum: f64,
}

/// A condition number at one step size.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConditionAt {
    /// `h`, s.
    pub step: f64,
    /// `κ`; `None` when the scheme has no matrix or the step failed.
    pub condition: Option<Condition>,
}

/// One scheme of the comparison.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SchemeRecord {
    /// Its name in model files.
    pub scheme: String,
    /// Steps that went well.
    pub steps: usize,
    /// Why the run ended early.
    pub failure: Option<String>,
    /// Distance to the reference, in the unit of the coordinates.
    pub distance: f64,
    /// Largest deviation of the energy from its start, J.
    pub energy_error: f64,
    /// Largest deviation of the linear momentum from its start, kg·m/s.
    pub linear_momentum_drift: f64,
    /// Largest deviation of the angular momentum from its start, kg·m²/s.
    pub angular_momentum_drift: f64,
    /// Constraints at three levels.
    pub residuals: Residuals,
    /// Mean number of Newton iterations in a step.
    pub mean_iterations: f64,
    /// Largest number of Newton iterations in a step.
    pub max_iterations: usize,
    /// Wall-clock time of a step without observation, s.
    pub seconds_per_step: f64,
    /// Condition numbers.
    pub conditions: Vec<ConditionAt>,
}

/// All schemes on one subject.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// What was compared.
    pub settings: ComparisonSettings,
    /// The scheme of the reference trajectory.
    pub reference: String,
    /// One record for each scheme that applies.
    pub records: Vec<SchemeRecord>,
}

/// Why no comparison was made. Failures of single runs are part of the records instead.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ComparisonError {
    /// A variational scheme could not be set up.
    #[error(transparent)]
    Variational(#[from] SetupError),
    /// An energy–momentum scheme could not be set up.
    #[error(transparent)]
    EnergyMomentum(#[from] EmSetupError),
    /// The reference run failed.
    #[error("the reference run failed: {0}")]
    Reference(#[from] StepError),
    /// The constraints lost rank.
    #[error(transparent)]
    Singular(#[from] Singular),
}

/// A scheme as the comparison sees it.
trait Runner {
    /// Takes a step; returns the iterations.
    fn step(&mut self) -> Result<usize, StepError>;
    /// The configuration that the last step has reached.
    fn configuration(&self) -> &[f64];
    /// Energy, momenta and residuals of the node that the last step started from.
    fn node(&mut self, mechanism: &Mechanism) -> Result<(f64, Momentum, Residuals), Singular>;
    fn condition(&mut self) -> Option<Condition>;
}

impl Runner for Integrator<SeparableSystem, Mechanism> {
    fn step(&mut self) -> Result<usize, StepError> {
        Self::step(self).map(|report| report.iterations)
    }
    fn configuration(&self) -> &[f64] {
        &self.state().q
    }
    fn node(&mut self, mechanism: &Mechanism) -> Result<(f64, Momentum, Residuals), Singular> {
        let node = self.node_before()?;
        let residuals = Residuals {
            position: node.position_residual,
            velocity: node.velocity_residual,
            momentum: node.momentum_residual,
        };
        let (energy, p) = (node.hamiltonian_projected, node.p_projected.clone());
        Ok((energy, mechanism.momentum(&self.before().q, &p), residuals))
    }
    fn condition(&mut self) -> Option<Condition> {
        Self::condition(self)
    }
}

impl Runner for EmIntegrator<Mechanism> {
    fn step(&mut self) -> Result<usize, StepError> {
        Self::step(self).map(|report| report.iterations)
    }
    fn configuration(&self) -> &[f64] {
        &self.state().q
    }
    fn node(&mut self, mechanism: &Mechanism) -> Result<(f64, Momentum, Residuals), Singular> {
        let node = self.node_before();
        let residuals = Residuals {
            position: node.position_residual,
            velocity: node.velocity_residual,
            momentum: node.momentum_residual,
        };
        let (energy, p) = (node.energy, node.p.clone());
        Ok((energy, mechanism.momentum(&self.before().q, &p), residuals))
    }
    fn condition(&mut self) -> Option<Condition> {
        Self::condition(self)
    }
}

/// A scheme of either family.
#[derive(Clone, Copy)]
enum Which {
    Variational(SchemeKind),
    EnergyMomentum(EmForm),
}

impl Which {
    fn name(self) -> &'static str {
        match self {
            Self::Variational(kind) => kind.name(),
            Self::EnergyMomentum(form) => form.name(),
        }
    }

    fn start(self, subject: &dyn Subject, h: f64) -> Result<Box<dyn Runner>, ComparisonError> {
        let mechanism = subject.mechanism();
        match self {
            Self::Variational(kind) => {
                let (q, v) = mechanism.start();
                let (options, at) = (Options::new(kind, h), (0.0, &q[..], &v[..]));
                let system = subject.variational();
                if mechanism.has_loops() {
                    return Ok(Box::new(Integrator::new(system, mechanism, options, at)?));
                }
                let map = TreeMap::new(&mechanism);
                let run = Integrator::with_reparametrization(system, mechanism, map, options, at)?;
                Ok(Box::new(run))
            }
            Self::EnergyMomentum(form) => {
                let options = EmOptions::new(form, h);
                let system = subject.energy_momentum();
                Ok(Box::new(EmIntegrator::of_mechanism(system, mechanism, options)?))
            }
        }
    }
}

/// Runs every scheme that applies: four and three on trees, two and two on loops.
///
/// # Errors
/// [`ComparisonError`].
pub fn compare(
    subject: &dyn Subject,
    settings: ComparisonSettings,
) -> Result<Comparison, ComparisonError> {
    let loops = subject.mechanism().has_loops();
    let kinds = if loops { &SchemeKind::ALL[..2] } else { &SchemeKind::ALL[..] };
    let forms = if loops { &EmForm::ALL[..2] } else { &EmForm::ALL[..] };
    let best = if loops { SchemeKind::Constrained } else { SchemeKind::Nodal };
    let best = Which::Variational(best);
    let reference = reference(subject, best, &settings)?;
    let variational = kinds.iter().map(|kind| Which::Variational(*kind));
    let all = variational.chain(forms.iter().map(|form| Which::EnergyMomentum(*form)));
    let records =
        all.map(|which| record(subject, which, &settings, &reference)).collect::<Result<_, _>>()?;
    let reference = format!("{}, h/{}", best.name(), settings.refinement);
    Ok(Comparison { settings, reference, records })
}

/// The configurations at the ends of all steps.
fn reference(
    subject: &dyn Subject,
    which: Which,
    settings: &ComparisonSettings,
) -> Result<Vec<Vec<f64>>, ComparisonError> {
    let refinement = settings.refinement.max(1);
    let mut run = which.start(subject, settings.step / refinement as f64)?;
    let mut nodes = Vec::with_capacity(settings.steps);
    for _ in 0..settings.steps {
        for _ in 0..refinement {
            run.step()?;
        }
        nodes.push(run.configuration().to_vec());
    }
    Ok(nodes)
}

fn record(
    subject: &dyn Subject,
    which: Which,
    settings: &ComparisonSettings,
    reference: &[Vec<f64>],
) -> Result<SchemeRecord, ComparisonError> {
    let mechanism = subject.mechanism();
    let mut run = which.start(subject, settings.step)?;
    let mut record = SchemeRecord { scheme: which.name().into(), ..SchemeRecord::default() };
    let (mut iterations, mut seconds, mut first) = (0, 0.0, None);
    for exact in reference {
        let clock = Instant::now();
        let taken = run.step();
        seconds += clock.elapsed().as_secs_f64();
        match taken {
            Ok(spent) => {
                iterations += spent;
                record.max_iterations = record.max_iterations.max(spent);
            }
            Err(error) => {
                record.failure = Some(error.to_string());
                break;
            }
        }
        record.steps += 1;
        raise(&mut record.distance, run.configuration(), exact);
        let (energy, momentum, residuals) = run.node(&mechanism)?;
        let (energy0, momentum0) = *first.get_or_insert((energy, momentum));
        raise(&mut record.energy_error, &[energy], &[energy0]);
        raise(&mut record.linear_momentum_drift, &momentum.linear, &momentum0.linear);
        raise(&mut record.angular_momentum_drift, &momentum.angular, &momentum0.angular);
        raise(&mut record.residuals.position, &[residuals.position], &[0.0]);
        raise(&mut record.residuals.velocity, &[residuals.velocity], &[0.0]);
        raise(&mut record.residuals.momentum, &[residuals.momentum], &[0.0]);
    }
    let steps = record.steps.max(1) as f64;
    (record.mean_iterations, record.seconds_per_step) =
        (iterations as f64 / steps, seconds / steps);
    for &step in &settings.condition_steps {
        let mut run = which.start(subject, step)?;
        let taken = (0..2).try_for_each(|_| run.step().map(|_| ()));
        let condition = taken.ok().and_then(|()| run.condition());
        record.conditions.push(ConditionAt { step, condition });
    }
    Ok(record)
}

/// `worst ← max(worst, |a − b|_∞)`; NaN stays.
fn raise(worst: &mut f64, a: &[f64], b: &[f64]) {
    for (a, b) in a.iter().zip(b) {
        let off = (a - b).abs();
        if !worst.is_nan() && (off.is_nan() || off > *worst) {
            *worst = off;
        }
    }
}
