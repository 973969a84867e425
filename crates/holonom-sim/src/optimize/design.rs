//! Parameters alone: a motion of its own for each of their values.
//!
//! ```text
//! J(θ) = Σ weight ½ e² + Σ weight y      squares of deviations, and values, with exact derivatives beside the run
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
use crate::gradient::trial::{From, ModelTrials, Read, SensorRead};
use crate::gradient::{TermValue, equilibrium};
use crate::random::Random;
use crate::shown::reading;
use crate::system;
use holonom_model::{
    Condition, ConditionKind, ConditionTime, CountedAt, Model, ModelError, ModelText, Objective,
    ObjectiveKind, Optimize, Override, Scheme,
};
use vi_control::constrained_least_squares::{
    Conditions, Design, DesignOutcome, Evaluation, minimise,
};
use vi_control::identification::{MotionResiduals, Reading, Series};
use vi_control::least_squares::{FitError, Parameter, Residuals};
use vi_control::program::Iterate;

/// Which rows of the residuals are of what.
struct Rows {
    series: Vec<Series>,
    reads: Vec<Read>,
    /// Of each objective: its rows.
    objectives: Vec<std::ops::Range<usize>>,
    /// Of rows that count as they are, after those of squares: what they are weighted with.
    weights: Vec<f64>,
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
        let (weights, conditions, bounds) = (Vec::new(), Vec::new(), Vec::new());
        let mut rows = Self { series, reads, objectives, weights, conditions, bounds, count: 0 };
        rows.objectives = vec![0..0; model.objectives.len()];
        for values in [false, true] {
            for (k, own) in model.objectives.iter().enumerate() {
                if (own.kind == ObjectiveKind::Value) == values {
                    rows.objectives[k] = rows.objective(model, own)?;
                }
            }
        }
        rows.conditions(model)?;
        if rows.count == 0 {
            let what = "a design without an aim";
            let help = "add an [[objective]] of type \"sensor\" or \"value\", or a [[condition]]";
            return Err(refused("optimize", what, help));
        }
        Ok(rows)
    }

    /// Adds an objective; returns its rows.
    fn objective(
        &mut self,
        model: &Model,
        own: &Objective,
    ) -> Result<std::ops::Range<usize>, ModelError> {
        let first = self.count;
        let key = format!("objective.{}", own.name);
        match own.kind {
            ObjectiveKind::Sensor | ObjectiveKind::Momentum if own.weight <= 0.0 => {
                let what = "a design that makes a square largest";
                let help = "write a positive weight: the sum of squares becomes least";
                return Err(refused(&format!("{key}.weight"), what, help));
            }
            ObjectiveKind::Sensor | ObjectiveKind::Value => {
                let (last, h) = (last_step(model), model.settings.step);
                match own.at {
                    CountedAt::End => self.count_at(model, own, vec![last], own.weight),
                    CountedAt::Path => {
                        // the trapezoidal rule
                        self.count_at(model, own, (1..last).collect(), own.weight * h);
                        self.count_at(model, own, vec![0, last], 0.5 * own.weight * h);
                    }
                }
            }
            ObjectiveKind::Time => (),
            ObjectiveKind::Momentum => {
                let key = format!("{key}.type");
                let unknowns = moving(model, &key)?;
                self.momenta(model, (&key, unknowns), [0.0, 1.0 / own.weight.sqrt()]);
            }
            _ => {
                let what = "a design by efforts of controls";
                let help = "take a sensor: without controls there is no effort";
                return Err(refused(&format!("{key}.type"), what, help));
            }
        }
        Ok(first..self.count)
    }

    /// Counts what a sensor shows at some nodes.
    fn count_at(&mut self, model: &Model, own: &Objective, nodes: Vec<usize>, weight: f64) {
        let sensor = own.sensor.clone().unwrap_or_default();
        let key = format!("objective.{}.sensor", own.name);
        let of_row = match own.kind {
            ObjectiveKind::Value => {
                self.weights.extend(nodes.iter().map(|_| weight));
                [0.0, 1.0]
            }
            _ => [own.target, 1.0 / weight.sqrt()],
        };
        self.read(model, (&key, &sensor), nodes, of_row);
    }

    fn conditions(&mut self, model: &Model) -> Result<(), ModelError> {
        for own in &model.conditions {
            let first = self.count;
            let key = format!("condition.{}", own.name);
            if own.kind == ConditionKind::Rest {
                let unknowns = resting(model, own)?;
                self.bounds.extend(vec![[0.0; 2]; unknowns.len()]);
                self.momenta(model, (&format!("{key}.type"), unknowns), [0.0, 1.0]);
                self.conditions.push(first..self.count);
                continue;
            }
            let nodes = nodes_of(own, model)?;
            let sensor = own.sensor.clone().unwrap_or_default();
            self.bounds.extend(vec![own.bounds(); nodes.len()]);
            self.read(model, (&format!("{key}.sensor"), &sensor), nodes, [0.0, 1.0]);
            self.conditions.push(first..self.count);
        }
        Ok(())
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
        let own = SensorRead { key: key.to_owned(), sensor: sensor.to_owned() };
        self.reads.push(Read::Sensor(own));
    }

    /// Momenta along unknowns of the tree at the end.
    fn momenta(
        &mut self,
        model: &Model,
        (key, unknowns): (&str, Vec<usize>),
        [value, sigma]: [f64; 2],
    ) {
        for unknown in unknowns {
            self.count += 1;
            let (sensor, reading) = (self.reads.len(), Reading::Value);
            let steps = vec![last_step(model) as f64];
            self.series.push(Series { sensor, reading, sigma, steps, values: vec![value] });
            self.reads.push(Read::Momentum { key: key.to_owned(), unknown });
        }
    }
}

/// All unknowns of the tree.
fn moving(model: &Model, key: &str) -> Result<Vec<usize>, ModelError> {
    if model.settings.scheme == Scheme::Static {
        let help = "take sensors: at an equilibrium nothing moves";
        return Err(refused(key, "momenta of an equilibrium", help));
    }
    Ok((0..system::build(model)?.mechanism.tree().dof()).collect())
}

/// The unknowns of the tree that are at rest at the end.
fn resting(model: &Model, own: &Condition) -> Result<Vec<usize>, ModelError> {
    let key = format!("condition.{}", own.name);
    let all = moving(model, &format!("{key}.type"))?;
    if own.of.is_empty() {
        return Ok(all);
    }
    let mechanism = system::build(model)?.mechanism;
    let mut unknowns = Vec::new();
    for name in &own.of {
        for freedom in 0..model.joint(name).map_or(0, |joint| joint.pair().dof()) {
            let mut joints = mechanism.description().joints.iter();
            let joint = joints.find(|joint| joint.name == *name);
            let found = joint.and_then(|joint| mechanism.tree().unknown_of(joint, freedom));
            let Some(found) = found else {
                let what = format!("rest of `{name}`, which closes a loop");
                let help = "write `cut = true` at another joint of the loop";
                return Err(refused(&format!("{key}.of"), what, help));
            };
            unknowns.push(found.index);
        }
    }
    Ok(unknowns)
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
    let values = rows.weights.clone();
    let conditions = Conditions { values, bounds: rows.bounds.clone(), paths };
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
            let cost = at.cost + constant(model);
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
        let cost = found.cost + constant(model);
        starts.push(StartFound { start, status, cost, message: String::new() });
        let stopped = found.outcome == DesignOutcome::Stopped;
        let rank = |own: &Design| (own.outcome != DesignOutcome::Optimal, own.cost);
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
    let met = |(own, place): (&Condition, &std::ops::Range<usize>)| {
        let of = place.clone().map(|row| (values[row], found.multipliers[row - first]));
        ConditionMet::of(own, of)
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
        parameters: parameters_found(parameters, &found.parameters),
        conditions: model.conditions.iter().zip(&rows.conditions).map(met).collect(),
        iterations: found.iterations,
        starts: if starts.len() > 1 { starts } else { Vec::new() },
        ..OptimumReport::default()
    };
    let mut model = trials.model(&found.parameters)?;
    plain(&mut model);
    Ok(Found { report, steps, model, costates: Vec::new(), controls: Vec::new() })
}
