//! Parameters alone: a motion of its own for each of their values.
//!
//! ```text
//! J(θ) = Σ weight ½ e² + Σ weight y      squares of deviations, and values, with exact derivatives beside the run
//! l ≤ c(θ) ≤ u              conditions on sensors
//! ```
//! The method is [`vi_control::constrained_least_squares`].

use super::found::{
    ConditionMet, FoundOptimum, OptimizeFailure, OptimumReport, ParameterFound, ProblemSize, SEED,
    SearchProgress, SearchStatus, SearchStep, StartFound, plain,
};
use super::kept::SearchEnd;
use super::rows::{ResidualRows, last_step};
use super::verdict::missed;
use crate::design::{number, refused};
use crate::gradient::TermValue;
use crate::gradient::trial::{ModelTrials, RunBeginning};
use crate::random::Random;
use holonom_model::{
    ConditionKind, Model, ModelError, ModelText, Objective, ObjectiveKind, Optimize, Override,
};
use vi_control::constrained_least_squares::{
    Conditions, ConstrainedOptimum, DesignOutcome, Evaluation, minimise,
};
use vi_control::identification::MotionResiduals;
use vi_control::least_squares::{FitError, Parameter, Residuals};
use vi_control::program::Iterate;

/// The parameters that are free, at their values.
pub(super) fn free(
    text: &ModelText,
    overrides: &[Override],
    settings: &Optimize,
) -> Result<Vec<Parameter>, ModelError> {
    let names: Vec<String> = settings.parameters.keys().cloned().collect();
    let known = text.tangents_of(overrides, &names)?;
    let mut free = Vec::new();
    for (name, bounds) in &settings.parameters {
        let key = format!("optimize.parameters.{name}");
        let value = number(&key, name, &known)?.value;
        if !(bounds.min..=bounds.max).contains(&value) {
            let what = format!("`{name}` = {value}, outside of its bounds");
            let help = format!("let the parameter begin between {} and {}", bounds.min, bounds.max);
            return Err(refused(&key, what, help));
        }
        let parameter = Parameter::new(name, value);
        let scale = if value == 0.0 { bounds.max - bounds.min } else { parameter.scale };
        free.push(Parameter { bounds: [bounds.min, bounds.max], scale, ..parameter });
    }
    Ok(free)
}

/// Finds the parameters of a model.
pub(super) fn design(
    text: &ModelText,
    overrides: &[Override],
    model: &Model,
    settings: &Optimize,
    progress: &mut dyn FnMut(&SearchProgress) -> bool,
) -> Result<FoundOptimum, OptimizeFailure> {
    if settings.time.is_some() {
        let what = "a free time without controls";
        let help = "remove `time`: the motion of a design lasts until `end`";
        return Err(refused("optimize.time", what, help).into());
    }
    let rows = ResidualRows::new(model)?;
    let parameters = free(text, overrides, settings)?;
    let names: Vec<String> = parameters.iter().map(|own| own.name.clone()).collect();
    let trials = || {
        let (initial, reads) = (Vec::new(), rows.reads.clone());
        let (joints, from) = (Vec::new(), RunBeginning::default());
        ModelTrials { text, overrides, parameters: names.clone(), initial, reads, joints, from }
    };
    let begin: Vec<f64> = parameters.iter().map(|own| own.start).collect();
    trials().trial(&begin)?; // what has no derivative is an error of the model
    let wrong =
        |error: vi_control::identification::SeriesError| OptimizeFailure::Run(error.to_string());
    let mut residuals = MotionResiduals::new(trials(), rows.series.clone()).map_err(wrong)?;
    rows.start_within(model, &mut residuals, &begin)?;
    let first = rows.count - rows.bounds.len();
    let paths = rows.conditions.iter().map(|own| own.start - first..own.end - first).collect();
    let values = rows.weights.clone();
    let conditions = Conditions { values, bounds: rows.bounds.clone(), paths };
    let (mut best, mut starts): (Option<ConstrainedOptimum>, _) = (None, Vec::new());
    let mut steps: Vec<SearchStep> = Vec::new();
    let mut random = Random(SEED);
    for start in 1..=settings.starts {
        let mut own = parameters.clone();
        if start > 1 {
            for parameter in &mut own {
                let [min, max] = parameter.bounds;
                parameter.start = min + 0.5 * (1.0 + random.number()) * (max - min);
            }
        }
        let before = steps.len();
        let mut watch = |at: &Evaluation| {
            let (iteration, infeasibility) = (steps.len() - before, at.violation);
            let cost = at.cost + constant(model);
            steps.push(SearchStep {
                start,
                steps: last_step(model),
                iterate: Iterate { iteration, cost, infeasibility, ..Iterate::default() },
                parameters: at.parameters.clone(),
            });
            progress(&SearchProgress { start, iteration: iteration + 1, cost, infeasibility })
        };
        let found =
            minimise(&mut residuals, &conditions, &own, settings.max_iterations, &mut watch);
        let found = match found {
            Ok(found) => found,
            Err(FitError::Start(refused)) if start > 1 => {
                let status = SearchStatus::Unfinished;
                StartFound::add(&mut starts, status, f64::NAN, refused.0);
                continue;
            }
            Err(FitError::Idle(name)) => {
                let key = format!("optimize.parameters.{name}");
                let what = format!("`{name}`, of which no sensor that counts depends");
                return Err(refused(&key, what, "remove it, or measure what it changes").into());
            }
            Err(error) => return Err(OptimizeFailure::Run(error.to_string())),
        };
        let status = status(found.outcome);
        let cost = found.cost + constant(model);
        StartFound::add(&mut starts, status, cost, String::new());
        let stopped = found.outcome == DesignOutcome::Stopped;
        let rank = |own: &ConstrainedOptimum| (own.outcome != DesignOutcome::Optimal, own.cost);
        if best.as_ref().is_none_or(|other| rank(&found) < rank(other)) {
            best = Some(found);
        }
        if stopped {
            break;
        }
    }
    let Some(found) = best else {
        return Err(OptimizeFailure::Run("no start has a motion".to_owned()));
    };
    report(model, (&rows, &parameters), (&mut residuals, found), (steps, starts), &trials())
}

/// What terms of time add to the cost.
fn constant(model: &Model) -> f64 {
    let time = |own: &&Objective| own.kind == ObjectiveKind::Time;
    model.objectives.iter().filter(time).fold(0.0, |sum, own| sum + own.weight * model.settings.end)
}

/// What parameters are found.
pub(super) fn parameters_found(parameters: &[Parameter], theta: &[f64]) -> Vec<ParameterFound> {
    let one = |(own, &value): (&Parameter, &f64)| ParameterFound {
        name: own.name.clone(),
        value,
        start: own.start,
        min: own.bounds[0],
        max: own.bounds[1],
        at_bound: value <= own.bounds[0] || value >= own.bounds[1],
    };
    parameters.iter().zip(theta).map(one).collect()
}

fn status(outcome: DesignOutcome) -> SearchStatus {
    match outcome {
        DesignOutcome::Optimal => SearchStatus::Optimal,
        DesignOutcome::Infeasible => SearchStatus::Infeasible,
        DesignOutcome::Stopped => SearchStatus::Stopped,
        DesignOutcome::Exhausted | DesignOutcome::Stuck => SearchStatus::Unfinished,
    }
}

/// Why a design is no optimum.
fn why(outcome: DesignOutcome, conditions: &[ConditionMet]) -> Vec<String> {
    let what = match outcome {
        DesignOutcome::Optimal | DesignOutcome::Stopped => return Vec::new(),
        DesignOutcome::Infeasible => None,
        DesignOutcome::Exhausted => Some("`max_iterations` of [optimize] were made"),
        DesignOutcome::Stuck => Some("no step of the parameters brings it nearer"),
    };
    what.map(str::to_owned).into_iter().chain(missed(conditions)).collect()
}

fn report(
    model: &Model,
    (rows, parameters): (&ResidualRows, &[Parameter]),
    (residuals, found): (&mut dyn Residuals, ConstrainedOptimum),
    (steps, starts): (Vec<SearchStep>, Vec<StartFound>),
    trials: &ModelTrials<'_>,
) -> Result<FoundOptimum, OptimizeFailure> {
    let mut values = vec![0.0; rows.count];
    residuals
        .evaluate(&found.parameters, &mut values, None)
        .map_err(|error| OptimizeFailure::Run(error.0))?;
    let first = rows.count - rows.bounds.len();
    let squares = first - rows.weights.len();
    let term = |(own, place): (&Objective, &std::ops::Range<usize>)| {
        let value = match own.kind {
            ObjectiveKind::Time => own.weight * model.settings.end,
            ObjectiveKind::Value => {
                place.clone().map(|row| rows.weights[row - squares] * values[row]).sum()
            }
            _ => values[place.clone()].iter().map(|r| 0.5 * r * r).sum(),
        };
        TermValue { name: own.name.clone(), value }
    };
    let mut joints = rows.resting.iter().cloned();
    let mut conditions = Vec::new();
    for (own, place) in model.conditions.iter().zip(&rows.conditions) {
        let mut at = place.clone().map(|row| (values[row], found.multipliers[row - first]));
        match own.kind {
            ConditionKind::Sensor => conditions.push(ConditionMet::of(own, at)),
            ConditionKind::Rest => {
                let joints = joints.by_ref();
                let each = std::iter::from_fn(|| Some((at.next()?, joints.next()?)));
                conditions.extend(each.map(|(at, joint)| ConditionMet::of_rest(own, joint, at)));
            }
        }
    }
    let is_equation = |bounds: &&[f64; 2]| bounds[0].to_bits() == bounds[1].to_bits();
    let equations = rows.bounds.iter().filter(is_equation).count();
    let terms: Vec<TermValue> = model.objectives.iter().zip(&rows.objectives).map(term).collect();
    let report = OptimumReport {
        model: model.header.name.clone(),
        status: status(found.outcome),
        missed: why(found.outcome, &conditions),
        problem: ProblemSize {
            unknowns: parameters.len(),
            equations,
            inequalities: rows.bounds.len() - equations,
            ..ProblemSize::default()
        },
        steps: last_step(model),
        step: model.settings.step,
        time: model.settings.end,
        cost: terms.iter().map(|own| own.value).fold(0.0, |sum, value| sum + value),
        terms,
        parameters: parameters_found(parameters, &found.parameters),
        conditions,
        iterations: found.iterations,
        starts: StartFound::several(starts),
        ..OptimumReport::default()
    };
    let mut model = trials.model(&found.parameters)?;
    plain(&mut model);
    let names = parameters.iter().map(|own| own.name.clone());
    let kept = SearchEnd { parameters: names.zip(found.parameters).collect(), point: None };
    Ok(FoundOptimum {
        report,
        steps,
        model,
        costates: Vec::new(),
        prices: Vec::new(),
        controls: Vec::new(),
        kept,
    })
}
