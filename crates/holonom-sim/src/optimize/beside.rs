//! Parameters beside controls: the least cost of any controls as a function of the parameters.
//!
//! ```text
//! V(θ) = cost of the optimum of the controls     minimise V over θ_min ≤ θ ≤ θ_max
//! dV/dθ = ∂𝓛/∂θ                                  of the run of these controls, with the prices of conditions  [2.67]
//! ```
//! Each value of `V` is an optimum of its own, judged and replayed, that is looked for from the one
//! before. The method for the parameters is [`vi_control::constrained_least_squares`].

use super::control::{self, search};
use super::design::{free, parameters_found};
use super::found::{
    FoundOptimum, OptimizeFailure, Refinement, SearchStatus, SearchStep, SearchWatch, StartFound,
};
use super::node::take_times;
use super::searched::Searched;
use super::verdict::{is_distance, report, status, with_sensors};
use crate::design::refused;
use crate::gradient::trial::{ModelTrials, RunBeginning};
use crate::gradient::{GradientFailure, Prices, Wanted, priced};
use holonom_model::{
    ControlShape, CountedAt, Model, ModelError, ModelText, Objective, ObjectiveKind, Optimize,
    Override, ParameterTangent,
};
use nalgebra::DMatrix;
use vi_control::constrained_least_squares::{Conditions, DesignOutcome, minimise};
use vi_control::least_squares::{FitError, Parameter, Refused, Residuals};
use vi_control::optimum::{Optimum, OptimumVerdict};
use vi_control::program::NlpSolver;
use vi_control::transcription::HeldPoint;

/// The search of the controls for some parameters.
struct SolvedControls {
    theta: Vec<f64>,
    model: Model,
    found: Optimum,
    refinements: Vec<Refinement>,
}

/// `V`, a residual that counts as it is.
struct LeastCost<'a> {
    trials: ModelTrials<'a>,
    settings: &'a Optimize,
    method: &'a mut dyn NlpSolver,
    progress: &'a SearchWatch,
    /// Where the first search goes on from.
    from: Option<&'a HeldPoint>,
    optima: Vec<SolvedControls>,
    /// The last search that ended elsewhere.
    missed: Option<SolvedControls>,
    /// Whether the last parameters that were tried have no optimum.
    refused: bool,
    /// Of the first search.
    starts: Vec<StartFound>,
    rows: Vec<SearchStep>,
    unknowns: Vec<String>,
    iterations: usize,
    /// What no parameters mend.
    failure: Option<OptimizeFailure>,
}

impl<'a> LeastCost<'a> {
    fn new(
        text: &'a ModelText,
        overrides: &'a [Override],
        settings: &'a Optimize,
        method: &'a mut dyn NlpSolver,
        progress: &'a SearchWatch,
        point: Option<&'a HeldPoint>,
    ) -> Self {
        let parameters = settings.parameters.keys().cloned().collect();
        let (initial, reads, joints) = (Vec::new(), Vec::new(), Vec::new());
        let from = RunBeginning::default();
        let trials = ModelTrials { text, overrides, parameters, initial, reads, joints, from };
        Self {
            trials,
            settings,
            method,
            progress,
            from: point,
            optima: Vec::new(),
            missed: None,
            refused: false,
            starts: Vec::new(),
            rows: Vec::new(),
            unknowns: Vec::new(),
            iterations: 0,
            failure: None,
        }
    }

    /// The optimum for some parameters, looked for from the last one.
    fn solve(&mut self, theta: &[f64]) -> Result<usize, Refused> {
        if let Some(known) = self.optima.iter().position(|own| own.theta == theta) {
            return Ok(known);
        }
        if self.is_stopped() {
            return Err(Refused("it was told to stop".to_owned()));
        }
        self.refused = true;
        let searched = self.searched(theta).map_err(|error| {
            let words = error.to_string();
            self.failure.get_or_insert(error);
            Refused(words)
        })?;
        let (model, Searched { found, mut rows, starts, refinements, unknowns }) = searched;
        self.unknowns = unknowns;
        rows.iter_mut().for_each(|row| row.parameters = theta.to_vec());
        self.rows.append(&mut rows);
        self.iterations += found.iterations;
        if self.optima.is_empty() {
            self.starts = starts;
        }
        let solved = SolvedControls { theta: theta.to_vec(), model, found, refinements };
        self.refused = solved.found.verdict != OptimumVerdict::Optimal;
        if !self.refused {
            self.optima.push(solved);
            return Ok(self.optima.len() - 1);
        }
        let words = status(&solved.found).words().to_owned();
        self.missed = Some(solved);
        Err(Refused(words))
    }

    fn searched(&mut self, theta: &[f64]) -> Result<(Model, Searched), OptimizeFailure> {
        let model = self.trials.model(theta)?;
        let one = Optimize { refine: 0, starts: 1, ..self.settings.clone() };
        let (from, settings) = match (self.optima.last(), self.from.take()) {
            (Some(own), _) => (control::From::Motion(&own.found.motion), &one),
            (None, Some(held)) => (control::From::Point(held), self.settings),
            (None, None) => (control::From::Guess, self.settings),
        };
        let searched = search(&model, settings, &mut *self.method, self.progress, from)?;
        Ok((model, searched))
    }

    fn is_stopped(&self) -> bool {
        self.missed.as_ref().is_some_and(|own| own.found.verdict == OptimumVerdict::Stopped)
    }

    /// `dV/dθ` at an optimum.
    fn slopes(&self, solved: &SolvedControls) -> Result<Vec<f64>, GradientFailure> {
        let SolvedControls { theta, model, found, .. } = solved;
        let overrides = self.trials.overrides(theta);
        let names = &self.trials.parameters;
        let (mut counted, prices) = with_prices(model, found);
        take_times(&mut counted, &found.motion);
        for own in &mut counted.controls {
            (own.shape, own.hold) = (ControlShape::Constant, 1);
        }
        let values = |k: usize| found.motion.controls.iter().map(|row| row[k]).collect();
        let wanted = Wanted {
            only: names.clone(),
            controls: false,
            initial: false,
            values: (0..model.controls.len()).map(values).collect(),
            ..Wanted::everything()
        };
        let by_motion = priced((self.trials.text, &overrides, &counted), &wanted, &prices)?;
        let known = self.trials.text.tangents_of(&overrides, names)?;
        let slope = |name: &String| {
            let by_motion = by_motion.iter().find(|own| own.name == *name);
            let own = known.iter().find(|own| own.name == *name);
            by_motion.map_or(0.0, |own| own.derivative)
                + own.map_or(0.0, |own| by_bounds(model, found, own))
        };
        Ok(names.iter().map(slope).collect())
    }
}

impl Residuals for LeastCost<'_> {
    fn len(&self) -> usize {
        1
    }

    fn evaluate(
        &mut self,
        theta: &[f64],
        out: &mut [f64],
        jacobian: Option<&mut DMatrix<f64>>,
    ) -> Result<(), Refused> {
        let at = self.solve(theta)?;
        let solved = &self.optima[at];
        out[0] = solved.found.cost();
        if turns_within(&solved.found) {
            let words = "a body turns by as much as a step may within it: take more steps";
            return Err(Refused(words.to_owned()));
        }
        if let Some(jacobian) = jacobian {
            let slopes = self.slopes(solved).map_err(|error| {
                let words = error.to_string();
                self.failure.get_or_insert(match error {
                    GradientFailure::Model(error) => OptimizeFailure::Model(error),
                    error @ GradientFailure::Run(_) => OptimizeFailure::Run(error.to_string()),
                });
                Refused(words)
            })?;
            slopes.into_iter().enumerate().for_each(|(j, slope)| jacobian[(0, j)] = slope);
        }
        Ok(())
    }
}

/// Whether a bound of turns within steps is active: along the run it has no price.
fn turns_within(found: &Optimum) -> bool {
    let largest = found.multipliers.rows.iter().fold(0.0_f64, |most, own| most.max(own.abs()));
    found.turns.iter().any(|own| own.node.is_none() && own.multiplier.abs() > 1e-9 * largest)
}

/// A model with its conditions as objectives, and what these count.
fn with_prices(model: &Model, found: &Optimum) -> (Model, Prices) {
    let (mut counted, mut prices) = (model.clone(), Prices::default());
    prices.rest = found.rest.clone();
    for own in &found.turns {
        let Some(node) = own.node else { continue };
        prices.turns.entry(own.unknown).or_default().push((node, own.multiplier));
    }
    for (k, own) in with_sensors(model).enumerate() {
        let at = found.met.iter().filter(|met| met.condition == k && met.multiplier != 0.0);
        let at: Vec<_> = at.map(|met| (met.node, met.multiplier)).collect();
        if at.is_empty() {
            continue;
        }
        let name = format!("condition.{}", own.name);
        prices.nodes.insert(name.clone(), at);
        let kind = match is_distance(model, own) {
            true => ObjectiveKind::Sensor,
            false => ObjectiveKind::Value,
        };
        counted.objectives.push(Objective {
            name,
            kind,
            controls: Vec::new(),
            sensor: own.sensor.clone(),
            at: CountedAt::Path,
            target: 0.0,
            weight: 1.0,
        });
    }
    (counted, prices)
}

/// `−Σ κ ∂b/∂θ` of the bounds `b` of conditions.
fn by_bounds(model: &Model, found: &Optimum, parameter: &ParameterTangent) -> f64 {
    let mut sum = 0.0;
    for (k, own) in with_sensors(model).enumerate() {
        let of = |part: &str| {
            parameter.keys.get(&format!("condition.{}.{part}", own.name)).copied().unwrap_or(0.0)
        };
        let equals = of("equals");
        let slopes = [of("min") + equals, of("max") + equals];
        for met in found.met.iter().filter(|met| met.condition == k) {
            let side = usize::from(met.multiplier > 0.0);
            let factor = if is_distance(model, own) { own.bounds()[side] } else { 1.0 };
            sum -= met.multiplier * factor * slopes[side];
        }
    }
    sum
}

/// Refuses keys that a search holds.
fn movable(
    text: &ModelText,
    overrides: &[Override],
    parameters: &[Parameter],
) -> Result<(), ModelError> {
    let names: Vec<String> = parameters.iter().map(|own| own.name.clone()).collect();
    let known = text.tangents_of(overrides, &names)?;
    for own in known.iter().filter(|own| names.contains(&own.name)) {
        let is_held = |key: &&String| {
            let parts: Vec<&str> = key.split('.').collect();
            matches!(
                parts[..],
                ["control", _, "min" | "max"] | ["optimize", ..] | ["condition", _, "at"]
            )
        };
        if let Some(key) = own.keys.keys().find(is_held) {
            let what =
                format!("`{}` as a free parameter beside controls, which enters it", own.name);
            return Err(refused(key, what, "state a number there"));
        }
    }
    Ok(())
}

/// Finds the parameters and the controls of a model.
pub(super) fn both(
    (text, overrides, model): (&ModelText, &[Override], &Model),
    settings: &Optimize,
    (method, progress): (&mut dyn NlpSolver, &SearchWatch),
    from: Option<&HeldPoint>,
) -> Result<FoundOptimum, OptimizeFailure> {
    let parameters = free(text, overrides, settings)?;
    movable(text, overrides, &parameters)?;
    let mut least = LeastCost::new(text, overrides, settings, method, progress, from);
    let counts = Conditions { values: vec![1.0], ..Conditions::default() };
    let most = settings.max_iterations;
    let found = minimise(&mut least, &counts, &parameters, most, &mut |_| true);
    let (theta, ended) = match found {
        Ok(found) => (Some(found.parameters), found.outcome),
        Err(FitError::Idle(name)) => {
            let key = format!("optimize.parameters.{name}");
            let what = format!("`{name}`, which changes neither the cost nor what is asked for");
            return Err(refused(&key, what, "remove it, or measure what it changes").into());
        }
        Err(FitError::Start(_)) => (None, DesignOutcome::Infeasible),
        Err(error) => return Err(OptimizeFailure::Run(error.to_string())),
    };
    if let (true, Some(failure)) = (theta.is_none(), least.failure.take()) {
        return Err(failure);
    }
    let stopped = least.is_stopped();
    // no step lowers the cost where none of them has an optimum
    let is_optimal = ended == DesignOutcome::Optimal && !least.refused;
    let solved = match &theta {
        Some(theta) => {
            let at = least.solve(theta).map_err(|error| OptimizeFailure::Run(error.0))?;
            least.optima.swap_remove(at)
        }
        None => match least.missed.take() {
            Some(missed) => missed,
            None => return Err(OptimizeFailure::Run("there is no search".to_owned())),
        },
    };
    let SolvedControls { theta, model: own, found, refinements } = solved;
    let LeastCost { rows, starts, unknowns, iterations, missed: last, .. } = least;
    let mut found = report(&own, Searched { found, rows, starts, refinements, unknowns });
    found.report.iterations = iterations;
    found.report.parameters = parameters_found(&parameters, &theta);
    found.kept.parameters = parameters.iter().map(|own| own.name.clone()).zip(theta).collect();
    if found.report.status.is_found() {
        found.report.status = match found.report.status {
            status if is_optimal => status,
            _ if stopped => SearchStatus::Stopped,
            _ => SearchStatus::Unfinished,
        };
    }
    if found.report.status == SearchStatus::Unfinished && found.report.missed.is_empty() {
        let words =
            "the controls are an optimum, the parameters are not: no step of them lowers the cost";
        let last = last.map(|own| status(&own.found).words());
        found.report.missed = vec![match last {
            Some(last) => format!("{words}; the last other parameters: {last}"),
            None => words.to_owned(),
        }];
    }
    found.report.model.clone_from(&model.header.name);
    Ok(found)
}

/// `V` and `dV/dθ` for some values of the free parameters.
#[cfg(all(test, feature = "pounce"))]
pub(super) fn least_cost(
    text: &ModelText,
    settings: &Optimize,
    theta: &[f64],
    method: &mut dyn NlpSolver,
    progress: &SearchWatch,
) -> Result<(f64, Vec<f64>), Refused> {
    let mut least = LeastCost::new(text, &[], settings, method, progress, None);
    let (mut cost, mut slopes) = ([0.0], DMatrix::zeros(1, theta.len()));
    least.evaluate(theta, &mut cost, Some(&mut slopes))?;
    Ok((cost[0], slopes.as_slice().to_vec()))
}
