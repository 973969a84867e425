//! An estimate in numbers and words.

use super::data::MeasuredColumn;
use crate::digits::rounded;
use holonom_model::Model;
use serde::Serialize;
use vi_control::least_squares::{Estimate, FitOutcome, Parameter, Unseen, probability_of_runs};
use vi_control::sensitivities::DerivativeGrowth;

/// A probability below which something is said.
const UNLIKELY: f64 = 0.001;

/// Part of a standard deviation that residuals of noise have at least.
const SMALL: f64 = 0.01;

/// Growth of a change beyond which a poor estimate may be one of many minima.
const SPREADS: f64 = 1e3;

/// Of a poor estimate: the sum of squares per degree of freedom.
const POOR: f64 = 4.0;

/// Parts of a combination below this are left out of words.
const PART: f64 = 1e-3;

/// A number that was unknown.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EstimatedNumber {
    /// The parameter, or `JOINT.coordinate` and `JOINT.rate` of the start.
    pub name: String,
    /// Where the method started.
    pub start: f64,
    /// The estimate.
    pub value: f64,
    /// Its standard error; none at a bound, and where a combination is not seen.
    pub standard_error: Option<f64>,
    /// Whether it is at one of its bounds.
    pub at_bound: bool,
}

/// A combination of relative changes that the data do not see, or hardly.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Combination {
    /// Its singular value, relative to the largest.
    pub singular_value: f64,
    /// Its parts: the unknown number and its relative change.
    pub parts: Vec<(String, f64)>,
}

/// How well a column is met.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FitOf {
    /// Its heading.
    pub column: String,
    /// The sensor.
    pub sensor: String,
    /// How many values.
    pub values: usize,
    /// The standard deviation that the model states.
    pub sigma: f64,
    /// Root of the mean square of measured less computed values, in the unit of the sensor.
    pub rms: f64,
    /// How likely so unusual a number of runs of equal signs is; none with few values.
    pub probability_of_runs: Option<f64>,
}

/// A measured value beside the computed one.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredRow {
    /// Time, s.
    pub t: f64,
    /// Which measurement of the model.
    pub measurement: usize,
    /// The value.
    pub measured: f64,
    /// Of the model with the estimates.
    pub computed: f64,
    /// Computed less measured, in standard deviations.
    pub residual: f64,
}

/// What the data say of the unknown numbers of a model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Identified {
    /// The model.
    pub model: String,
    /// How the method ended: `converged`, `exhausted`, `stuck` or `interrupted`.
    pub outcome: &'static str,
    /// Iterations made.
    pub iterations: usize,
    /// Runs made.
    pub runs: usize,
    /// Parts of the run that began at states of their own.
    pub segments: usize,
    /// Measured values.
    pub values: usize,
    /// The unknown numbers.
    pub parameters: Vec<EstimatedNumber>,
    /// Their covariance; none where a combination is not seen.
    pub covariance: Option<Vec<Vec<f64>>>,
    /// Their correlations; `null` beside a number at a bound.
    pub correlation: Option<Vec<Vec<f64>>>,
    /// Half the sum of squares, with priors.
    pub half_sum_of_squares: f64,
    /// The sum of squares over the number of values less that of unknowns.
    pub chi_square_per_freedom: f64,
    /// Of the derivatives by relative changes, largest first.
    pub singular_values: Vec<f64>,
    /// Combinations that are not seen.
    pub unseen: Vec<Combination>,
    /// Combinations that are hardly seen.
    pub hardly_seen: Vec<Combination>,
    /// Column by column.
    pub columns: Vec<FitOf>,
    /// The largest growth of a change of the start along the motion.
    pub growth: f64,
    /// From which time on derivatives say nothing of the mechanism, s.
    pub meaningless_from: Option<f64>,
}

impl Combination {
    /// Of a direction by the sizes of the parameters, relative to the values that were found.
    fn of(own: &Unseen, parameters: &[Parameter], values: &[f64]) -> Self {
        let relative = |((parameter, value), part): ((&Parameter, &f64), &f64)| match *value {
            0.0 => *part,
            value => part * parameter.scale / value.abs(),
        };
        let all = parameters.iter().zip(values).zip(&own.direction).map(relative);
        let all: Vec<f64> = all.collect();
        let size = all.iter().map(|part| part * part).sum::<f64>().sqrt();
        let parts = parameters.iter().zip(all).map(|(own, part)| (own.name.clone(), part / size));
        let parts = parts.filter(|(_, part)| part.abs() > PART).collect();
        Self { singular_value: own.singular_value, parts }
    }

    /// In words: ``0.71 `mass` − 0.71 `stiffness` ``.
    #[must_use]
    pub fn words(&self) -> String {
        let mut text = String::new();
        for (i, (name, part)) in self.parts.iter().enumerate() {
            let sign = match (i, *part < 0.0) {
                (0, false) => "",
                (0, true) => "−",
                (_, false) => " + ",
                (_, true) => " − ",
            };
            text += &format!("{sign}{} `{name}`", rounded(part.abs(), 3));
        }
        text
    }
}

impl Identified {
    /// Whether the method has converged and every combination is seen.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.outcome == "converged" && self.unseen.is_empty()
    }

    /// That the motion spreads so much that residuals have many minima.
    fn growth_of_changes(&self) -> Option<String> {
        let is_met = self.outcome == "converged" && self.chi_square_per_freedom < POOR;
        let grown = match self.meaningless_from {
            Some(t) => {
                format!(
                    "from t = {} s on a change of the motion has grown by more than 1e6",
                    rounded(t, 6)
                )
            }
            None if self.growth > SPREADS && !is_met => {
                format!("a change of the motion grows by {} over the data", rounded(self.growth, 2))
            }
            None => return None,
        };
        let remedy = match self.segments {
            1 => "write `segments` under [identify], or leave later values out",
            _ => "take more segments, and see whether the estimate stays",
        };
        Some(format!("{grown}: residuals have many minima; {remedy}"))
    }

    /// What the reader of the estimate has to know, in words.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let mut all = Vec::new();
        match self.outcome {
            "exhausted" => all.push(format!(
                "the method has not converged in {} iterations: the estimate is its last iterate",
                self.iterations
            )),
            "stuck" => all.push(
                "no change of the unknown numbers decreases the sum of squares, though its slope is not zero: runs fail \
                 beyond, or the data have many minima; start nearer, or state bounds"
                    .to_owned(),
            ),
            _ => {}
        }
        for own in &self.unseen {
            all.push(format!(
                "the data do not see the relative change {}: state a `prior` of one of them, or leave one out",
                own.words()
            ));
        }
        for own in &self.hardly_seen {
            all.push(format!("the data hardly see the relative change {}", own.words()));
        }
        for own in self.parameters.iter().filter(|own| own.at_bound) {
            all.push(format!("`{}` is at a bound: it has no standard error", own.name));
        }
        // residuals of rounding have no noise
        let odd = |own: &&FitOf| {
            own.rms > SMALL * own.sigma && own.probability_of_runs.is_some_and(|p| p < UNLIKELY)
        };
        for own in self.columns.iter().filter(odd) {
            all.push(format!(
                "residuals of `{}` keep their signs longer than those of noise: the model misses something, or `sigma` of \
                 values that are not independent is too small",
                own.column
            ));
        }
        all.extend(self.growth_of_changes());
        all
    }
}

/// The estimate in numbers, and all values beside one another.
pub(super) fn of(
    model: &Model,
    parameters: &[Parameter],
    data: &[MeasuredColumn],
    (fit, interrupted, runs): (&Estimate, bool, usize),
    growth: DerivativeGrowth,
) -> (Identified, Vec<MeasuredRow>) {
    let errors = fit.standard_errors();
    let number = |(j, own): (usize, &Parameter)| {
        let at_bound = fit.at_bounds.contains(&j);
        EstimatedNumber {
            name: own.name.clone(),
            start: own.start,
            value: fit.parameters[j],
            standard_error: errors.as_ref().map(|all| all[j]).filter(|_| !at_bound),
            at_bound,
        }
    };
    let rows_of = |matrix: nalgebra::DMatrix<f64>| -> Vec<Vec<f64>> {
        matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
    };
    let (mut rows, mut columns, mut first) = (Vec::new(), Vec::new(), 0);
    for (measurement, (stated, own)) in model.measurements.iter().zip(data).enumerate() {
        let residuals = &fit.residuals[first..first + own.values.len()];
        first += own.values.len();
        for ((t, measured), residual) in own.times.iter().zip(&own.values).zip(residuals) {
            let (t, measured, residual) = (*t, *measured, *residual);
            let computed = measured + stated.sigma * residual;
            rows.push(MeasuredRow { t, measurement, measured, computed, residual });
        }
        let square: f64 = residuals.iter().map(|r| r * r).sum();
        columns.push(FitOf {
            column: stated.column().to_owned(),
            sensor: stated.sensor.clone(),
            values: own.values.len(),
            sigma: stated.sigma,
            rms: stated.sigma * (square / own.values.len() as f64).sqrt(),
            probability_of_runs: probability_of_runs(residuals),
        });
    }
    let outcome = match fit.outcome {
        _ if interrupted => "interrupted",
        FitOutcome::Converged => "converged",
        FitOutcome::Exhausted => "exhausted",
        FitOutcome::Stuck => "stuck",
    };
    let one = |own: &Unseen| Combination::of(own, parameters, &fit.parameters);
    let combinations = |all: &[Unseen]| all.iter().map(one).collect();
    let found = Identified {
        model: model.header.name.clone(),
        outcome,
        iterations: fit.iterations,
        runs,
        segments: model.identify.as_ref().map_or(1, |own| own.segments),
        values: fit.residuals.len(),
        parameters: parameters.iter().enumerate().map(number).collect(),
        covariance: fit.covariance.clone().map(rows_of),
        correlation: fit.correlation().map(rows_of),
        half_sum_of_squares: fit.half_sum_of_squares,
        chi_square_per_freedom: fit.chi_square_per_freedom,
        singular_values: fit.singular_values.clone(),
        unseen: combinations(&fit.unseen),
        hardly_seen: combinations(&fit.hardly_seen),
        columns,
        growth: growth.largest,
        meaningless_from: growth.meaningless_from,
    };
    (found, rows)
}
