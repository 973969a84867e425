//! The two Newton matrices of `em-nodal`, both dense: the derivative of `P̄` by multipliers, and
//! itself.
//!
//! ```text
//! Multipliers           P̄ᵀ (h K + Σ_i μ_i ∂Ḡ_iᵀ/∂q_{n+1}) ∂F_d/∂u
//! NullSpaceDerivative   P̄ᵀ h K ∂F_d/∂u + ∂(P̄ᵀ h B)/∂u          Betsch & Leyendecker 2006
//! ```
//! The roots are the same, and so is the matrix at the root.

use super::equal_error::MeasuredTime;
use super::measure::range;
use super::{ComparisonPlan, Request, distance};
use crate::clock::timed;
use holonom_model::Model;
use holonom_sim::system::{self, System};
use vi_constraints::InitialValues;
use vi_emscheme::{EmAlgebra, EmForm, EmIntegrator, EmLinearization, EmOptions};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::Solver;
use vi_verify::fit::median;

/// Cost of a linearization.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearizationCost {
    /// Newton iterations per step, mean.
    pub iterations: f64,
    /// Time per step, s.
    pub time: MeasuredTime,
}

/// Both linearizations on a model.
#[derive(Clone, Debug, PartialEq)]
pub struct Linearizations {
    /// By multipliers.
    pub multipliers: LinearizationCost,
    /// By the derivative of `P̄`; or why it does not apply.
    pub derivative: Result<LinearizationCost, String>,
    /// Largest difference of a coordinate at the end of both runs.
    pub apart: Option<f64>,
}

/// Repeated runs, and the most steps of one.
const REPEATS: usize = 5;
const STEPS: u64 = 200;

/// Runs `em-nodal` by both linearizations with dense matrices.
///
/// # Errors
/// Why the model does not run by `em-nodal`, or not to the end.
pub fn linearizations(model: &Model, request: &Request) -> Result<Linearizations, String> {
    let plan = ComparisonPlan::new(model, request).map_err(|e| e.to_string())?;
    let steps = plan.steps.min(STEPS);
    let start = |linearization| -> Result<EmIntegrator<Mechanism>, String> {
        let System { mechanism, dynamics, .. } = system::build(model).map_err(|e| e.to_string())?;
        let mut options = EmOptions::new(EmForm::Nodal, plan.step);
        options.newton = model.settings.newton();
        let algebra = EmAlgebra { linearization, solver: Solver::Dense };
        let system = dynamics.energy_momentum(&mechanism);
        let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
        vi_emscheme::run::integrator_at(
            system,
            mechanism,
            options,
            algebra,
            InitialValues::new(0.0, &q, &v),
        )
        .map_err(|e| e.to_string())
    };
    let cost = |linearization| -> Result<(LinearizationCost, Vec<f64>), String> {
        let (mut times, mut iterations, mut end) = (Vec::new(), 0, Vec::new());
        for _ in 0..REPEATS {
            let mut run = start(linearization)?;
            run.step().map_err(|e| e.to_string())?;
            iterations = 0;
            let (seconds, taken) = timed(|| {
                (1..steps).try_for_each(|_| run.step().map(|step| iterations += step.iterations))
            });
            taken.map_err(|e| e.to_string())?;
            times.push(seconds / steps.saturating_sub(1).max(1) as f64);
            end = run.state().q.clone();
        }
        let iterations = iterations as f64 / steps.saturating_sub(1).max(1) as f64;
        let range = range(&times).unwrap_or_default();
        let time = MeasuredTime { median: median(times).unwrap_or_default(), range };
        Ok((LinearizationCost { iterations, time }, end))
    };
    let (multipliers, end) = cost(EmLinearization::Multipliers)?;
    let explicit = cost(EmLinearization::NullSpaceDerivative);
    let apart = explicit.as_ref().ok().map(|(_, other)| distance(&end, other));
    Ok(Linearizations { multipliers, derivative: explicit.map(|(cost, _)| cost), apart })
}
