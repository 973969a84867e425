//! Parameters alone: a motion of its own for each of their values.
//!
//! ```text
//! J(θ) = Σ weight ½ e²      a term of a sensor is a square: least squares, with exact derivatives beside the run
//! l ≤ c(θ) ≤ u              conditions on sensors
//! ```
//! The method is [`vi_control::constrained_least_squares`].

use super::found::{
    ConditionMet, Found, OptimizeFailure, OptimumReport, ParameterFound, Progress, SEED,
    StartFound, Status, Step, plain,
};
use super::node::node;
use crate::design::{number, refused};
use crate::gradient::prepared::last_node;
use crate::gradient::trial::{From, ModelTrials, SensorRead};
use crate::gradient::{TermValue, equilibrium};
use crate::random::Random;
use crate::shown::reading;
use holonom_model::{
    Condition, ConditionKind, ConditionTime, CountedAt, Model, ModelError, ModelText,
    ObjectiveKind, Optimize, Override, Scheme,
};
use vi_control::constrained_least_squares::{
    Conditions, Design, DesignOutcome, Evaluation, minimise,
};
use vi_control::identification::{MotionResiduals, Series};
use vi_control::least_squares::{FitError, Parameter, Residuals};
use vi_control::program::Iterate;

/// Which rows of the residuals are of what.
struct Rows {
    series: Vec<Series>,
    reads: Vec<SensorRead>,
    /// Of each objective: its rows.
    objectives: Vec<std::ops::Range<usize>>,
    /// Of each condition: its rows.
    conditions: Vec<std::ops::Range<usize>>,
    bounds: Vec<[f64; 2]>,
    count: usize,
}

impl Rows {
    fn new(model: &Model) -> Result<Self, ModelError> {
        if model.settings.scheme == Scheme::Static {
            equilibrium::supported(model, &[])?;
        }
        let (series, reads, objectives) = (Vec::new(), Vec::new(), Vec::new());
        let (conditions, bounds) = (Vec::new(), Vec::new());
        let mut rows = Self { series, reads, objectives, conditions, bounds, count: 0 };
        let (last, h) = (last_step(model), model.settings.step);
        for own in &model.objectives {
            let first = rows.count;
            let key = format!("objective.{}", own.name);
            if own.weight <= 0.0 {
                let help = "write a positive weight: the sum of squares becomes least";
                return Err(refused(
                    &format!("{key}.weight"),
                    "a design that makes a square largest",
                    help,
                ));
            }
            if own.kind == ObjectiveKind::Sensor {
                let sensor = own.sensor.clone().unwrap_or_default();
                let key = format!("{key}.sensor");
                let mut read = |nodes: Vec<usize>, weight: f64| {
                    let sigma = 1.0 / weight.sqrt();
                    rows.read(model, (&key, &sensor), nodes, [own.target, sigma]);
                };
                match own.at {
                    CountedAt::End => read(vec![last], own.weight),
                    CountedAt::Path => {
                        read((1..last).collect(), own.weight * h); // the trapezoidal rule
                        read(vec![0, last], 0.5 * own.weight * h);
                    }
                }
            } else if matches!(own.kind, ObjectiveKind::Value | ObjectiveKind::Momentum) {
                let what = "a design by what is no square of a deviation";
                let help = "write type = \"sensor\" with a `target`, or a [[condition]]";
                return Err(refused(&format!("{key}.type"), what, help));
            } else if own.kind != ObjectiveKind::Time {
                let help = "take a sensor: without controls there is no effort";
                return Err(refused(
                    &format!("{key}.type"),
                    "a design by efforts of controls",
                    help,
                ));
            }
            rows.objectives.push(first..rows.count);
        }
        for own in &model.conditions {
            let first = rows.count;
            let key = format!("condition.{}", own.name);
            if own.kind == ConditionKind::Rest {
                let help =
                    "ask for a sensor at two times, or add a [[control]] that brings it to rest";
                return Err(refused(&format!("{key}.type"), "rest by parameters alone", help));
            }
            let nodes = nodes_of(own, model)?;
            let sensor = own.sensor.clone().unwrap_or_default();
            rows.bounds.extend(vec![own.bounds(); nodes.len()]);
            rows.read(model, (&format!("{key}.sensor"), &sensor), nodes, [0.0, 1.0]);
            rows.conditions.push(first..rows.count);
        }
        if rows.count == 0 {
            let what = "a design without an aim";
            let help = "add an [[objective]] of type \"sensor\", or a [[condition]]";
            return Err(refused("optimize", what, help));
        }
        Ok(rows)
    }

    fn read(
        &mut self,
        model: &Model,
        (key, sensor): (&str, &str),
        nodes: Vec<usize>,
        [value, sigma]: [f64; 2],
    ) {
        self.count += nodes.len();
        let values = vec![value; nodes.len()];
        let steps = nodes.into_iter().map(|node| node as f64).collect();
        self.series.push(Series {
            sensor: self.reads.len(),
            reading: reading(model, sensor),
            sigma,
            steps,
            values,
        });
        self.reads.push(SensorRead { key: key.to_owned(), sensor: sensor.to_owned() });
    }
}

/// The number of the last node: of statics that of the run that stands at the last equilibrium.
fn last_step(model: &Model) -> usize {
    match model.settings.scheme {
        Scheme::Static => 0,
        _ => last_node(model),
    }
}

/// The nodes at which a condition holds.
fn nodes_of(own: &Condition, model: &Model) -> Result<Vec<usize>, ModelError> {
    let last = last_step(model);
    if model.settings.scheme == Scheme::Static {
        let key = format!("condition.{}", own.name);
        let sensor = own.sensor.as_deref().unwrap_or_default();
        equilibrium::resting(model, &format!("{key}.sensor"), sensor)?;
        if own.at != ConditionTime::Word(CountedAt::End) {
            let what = "a condition along a path of equilibria";
            let help = "remove `at`: a condition of statics is that of the last equilibrium";
            return Err(refused(&format!("{key}.at"), what, help));
        }
    }
    Ok(match own.at {
        ConditionTime::Word(CountedAt::End) => vec![last],
        ConditionTime::Word(CountedAt::Path) => (1..=last).collect(),
        ConditionTime::Time(time) => vec![node(model, &own.name, time)?],
    })
}

/// The parameters that are free, at their values.
fn free(
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
    progress: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Found, OptimizeFailure> {
    if settings.time.is_some() {
        let what = "a free time without controls";
        let help = "remove `time`: the motion of a design lasts until `end`";
        return Err(refused("optimize.time", what, help).into());
    }
    let rows = Rows::new(model)?;
    let parameters = free(text, overrides, settings)?;
    let names: Vec<String> = parameters.iter().map(|own| own.name.clone()).collect();
    let trials = || {
        let (initial, reads) = (Vec::new(), rows.reads.clone());
        let (joints, from) = (Vec::new(), From::default());
        ModelTrials { text, overrides, parameters: names.clone(), initial, reads, joints, from }
    };
    let begin: Vec<f64> = parameters.iter().map(|own| own.start).collect();
    trials().trial(&begin)?; // what has no derivative is an error of the model
    let wrong =
        |error: vi_control::identification::SeriesError| OptimizeFailure::Run(error.to_string());
    let mut residuals = MotionResiduals::new(trials(), rows.series.clone()).map_err(wrong)?;
    let first = rows.count - rows.bounds.len();
    let paths = rows.conditions.iter().map(|own| own.start - first..own.end - first).collect();
    let conditions = Conditions { bounds: rows.bounds.clone(), paths };
    let (mut best, mut starts): (Option<(Design, Vec<Step>)>, _) = (None, Vec::new());
    let mut random = Random(SEED);
    for start in 1..=settings.starts {
        let mut own = parameters.clone();
        if start > 1 {
            for parameter in &mut own {
                let [min, max] = parameter.bounds;
                parameter.start = min + 0.5 * (1.0 + random.number()) * (max - min);
            }
        }
        let mut steps = Vec::new();
        let mut watch = |at: &Evaluation| {
            let (iteration, infeasibility) = (steps.len(), at.violation);
            let cost = at.half_sum_of_squares + constant(model);
            steps.push(Step {
                start,
                steps: last_step(model),
                iterate: Iterate { iteration, cost, infeasibility, ..Iterate::default() },
                parameters: at.parameters.clone(),
            });
            progress(&Progress { start, iteration: iteration + 1, cost, infeasibility })
        };
        let found =
            minimise(&mut residuals, &conditions, &own, settings.max_iterations, &mut watch);
        let found = match found {
            Ok(found) => found,
            Err(FitError::Start(refused)) if start > 1 => {
                let status = Status::Unfinished;
                starts.push(StartFound { start, status, cost: f64::NAN, message: refused.0 });
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
        let cost = found.half_sum_of_squares + constant(model);
        starts.push(StartFound { start, status, cost, message: String::new() });
        let stopped = found.outcome == DesignOutcome::Stopped;
        let rank = |own: &Design| (own.outcome != DesignOutcome::Optimal, own.half_sum_of_squares);
        if best.as_ref().is_none_or(|(other, _)| rank(&found) < rank(other)) {
            best = Some((found, Vec::new()));
        }
        if let Some((_, all)) = &mut best {
            all.append(&mut steps);
        }
        if stopped {
            break;
        }
    }
    let Some((found, steps)) = best else {
        return Err(OptimizeFailure::Run("no start has a motion".to_owned()));
    };
    report(model, (&rows, &parameters), (&mut residuals, found), (steps, starts), &trials())
}

/// What terms of time add to the cost.
fn constant(model: &Model) -> f64 {
    let time = |own: &&holonom_model::Objective| own.kind == ObjectiveKind::Time;
    model.objectives.iter().filter(time).fold(0.0, |sum, own| sum + own.weight * model.settings.end)
}

fn status(outcome: DesignOutcome) -> Status {
    match outcome {
        DesignOutcome::Optimal => Status::Optimal,
        DesignOutcome::Infeasible => Status::Infeasible,
        DesignOutcome::Stopped => Status::Stopped,
        DesignOutcome::Exhausted | DesignOutcome::Stuck => Status::Unfinished,
    }
}

fn report(
    model: &Model,
    (rows, parameters): (&Rows, &[Parameter]),
    (residuals, found): (&mut dyn Residuals, Design),
    (steps, starts): (Vec<Step>, Vec<StartFound>),
    trials: &ModelTrials<'_>,
) -> Result<Found, OptimizeFailure> {
    let mut values = vec![0.0; rows.count];
    residuals
        .evaluate(&found.parameters, &mut values, None)
        .map_err(|error| OptimizeFailure::Run(error.0))?;
    let first = rows.count - rows.bounds.len();
    let term = |(own, place): (&holonom_model::Objective, &std::ops::Range<usize>)| {
        let squares: f64 = values[place.clone()].iter().map(|r| 0.5 * r * r).sum();
        let time =
            if own.kind == ObjectiveKind::Time { own.weight * model.settings.end } else { 0.0 };
        TermValue { name: own.name.clone(), value: squares + time }
    };
    let met = |(own, place): (&Condition, &std::ops::Range<usize>)| {
        let of = place.clone().map(|row| (values[row], found.multipliers[row - first]));
        ConditionMet::of(own, of)
    };
    let parameter = |(k, own): (usize, &Parameter)| ParameterFound {
        name: own.name.clone(),
        value: found.parameters[k],
        start: own.start,
        min: own.bounds[0],
        max: own.bounds[1],
        at_bound: found.at_bounds.contains(&k),
    };
    let terms: Vec<TermValue> = model.objectives.iter().zip(&rows.objectives).map(term).collect();
    let report = OptimumReport {
        model: model.header.name.clone(),
        status: status(found.outcome),
        steps: last_step(model),
        step: model.settings.step,
        time: model.settings.end,
        cost: terms.iter().map(|own| own.value).fold(0.0, |sum, value| sum + value),
        terms,
        parameters: parameters.iter().enumerate().map(parameter).collect(),
        conditions: model.conditions.iter().zip(&rows.conditions).map(met).collect(),
        iterations: found.iterations,
        starts: if starts.len() > 1 { starts } else { Vec::new() },
        ..OptimumReport::default()
    };
    let mut model = trials.model(&found.parameters)?;
    plain(&mut model);
    Ok(Found { report, steps, model, costates: Vec::new(), controls: Vec::new() })
}
