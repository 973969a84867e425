//! Derivatives along random directions against central differences of whole runs.
//!
//! ```text
//! (J(+ε) − J(−ε))/2ε at ε and ε/2, extrapolated
//! ```

use super::prepared::Prepared;
use super::{GradientFailure, ModelGradient, Wanted};
use crate::random::Random;
use crate::system::outside::{JointStart, Outside};
use holonom_model::{Model, ModelText, Override};
use serde::Serialize;

/// Directions for each kind of derivative.
const DIRECTIONS: usize = 3;
/// The longer change, in parts of the size of a number or of 1.
const CHANGE: f64 = 1e-3;

/// A comparison along a direction.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    /// By what: `parameters`, `controls`, `coordinates` or `rates`.
    pub by: String,
    /// Number of the direction, from 1.
    pub direction: usize,
    /// The derivative along it.
    pub derivative: f64,
    /// By differences.
    pub difference: f64,
    /// How far apart they are, in parts of the larger sum of moduli that the derivative has.
    pub relative: f64,
}

/// What is changed.
#[derive(Clone, Copy, PartialEq)]
enum By {
    Parameters,
    Controls,
    Coordinates,
    Rates,
}

/// The model that is run again and again.
pub(super) struct Runs<'a> {
    pub(super) text: &'a ModelText,
    pub(super) overrides: &'a [Override],
    pub(super) model: &'a Model,
    pub(super) wanted: &'a Wanted,
}

impl Runs<'_> {
    /// `J` where a kind of numbers is changed by `e` times a direction.
    fn value(
        &self,
        gradient: &ModelGradient,
        by: By,
        direction: &[f64],
        e: f64,
    ) -> Result<f64, GradientFailure> {
        let mut overrides = self.overrides.to_vec();
        let (mut start, mut values) = (JointStart::default(), self.wanted.values.clone());
        match by {
            By::Parameters => {
                for (own, d) in gradient.parameters.iter().zip(direction) {
                    let key = format!("parameters.{}", own.name);
                    overrides.retain(|one| one.key != key);
                    overrides.push(Override::new(key, format!("{:?}", own.value + e * d)));
                }
            }
            By::Controls => {
                let mut rest = direction;
                for (k, own) in gradient.controls.iter().enumerate() {
                    let (own, others) = rest.split_at(own.derivatives.len());
                    let at = |i: usize| {
                        let known = self.wanted.values.get(k).and_then(|own| own.get(i));
                        known.copied().unwrap_or_default()
                    };
                    let changed = own.iter().enumerate().map(|(i, d)| at(i) + e * d).collect();
                    values.resize_with(values.len().max(k + 1), Vec::new);
                    values[k] = changed;
                    rest = others;
                }
            }
            By::Coordinates | By::Rates => {
                for (own, d) in gradient.initial.iter().zip(direction) {
                    let [moved, faster] = [by == By::Coordinates, by == By::Rates]
                        .map(|changes| if changes { e * d } else { 0.0 });
                    let rate = self.rate(&own.name, own.freedom) + faster;
                    if moved != 0.0 {
                        start.coordinates.push((own.name.clone(), own.freedom, moved));
                    }
                    start.rates.push((own.name.clone(), own.freedom, rate));
                }
            }
        }
        let outside = Outside { start, ..Outside::default() };
        let changed = match by {
            By::Parameters => self.text.model(&overrides)?,
            _ => self.model.clone(),
        };
        Prepared::new(&changed, &self.wanted.of, (&values, &outside))?.value()
    }

    /// The rate that a joint states.
    fn rate(&self, joint: &str, freedom: usize) -> f64 {
        let own = self.model.joint(joint).and_then(|joint| joint.rate.as_ref());
        own.and_then(|rates| rates.values().get(freedom).copied()).unwrap_or_default()
    }

    /// Compares along random directions.
    pub(super) fn compare(&self, gradient: &ModelGradient) -> Result<Vec<Check>, GradientFailure> {
        let mut checks = Vec::new();
        let mut random = Random(20_080_131);
        let joints = gradient.initial.iter().all(|own| self.model.joint(&own.name).is_some());
        let starts = |of: fn(&super::ByStart) -> f64| -> Vec<f64> {
            if joints { gradient.initial.iter().map(of).collect() } else { Vec::new() }
        };
        let kinds: [(By, &str, Vec<f64>); 4] = [
            (
                By::Parameters,
                "parameters",
                gradient.parameters.iter().map(|own| own.derivative).collect(),
            ),
            (
                By::Controls,
                "controls",
                gradient.controls.iter().flat_map(|own| own.derivatives.clone()).collect(),
            ),
            (By::Coordinates, "coordinates", starts(|own| own.coordinate)),
            (By::Rates, "rates", starts(|own| own.rate)),
        ];
        for (by, name, exact) in kinds.into_iter().filter(|kind| !kind.2.is_empty()) {
            for number in 1..=DIRECTIONS {
                let direction: Vec<f64> = (0..exact.len())
                    .map(|k| {
                        let size = match by {
                            By::Parameters => gradient.parameters[k].value.abs(),
                            _ => 0.0,
                        };
                        random.number() * if size > 0.0 { size } else { 1.0 }
                    })
                    .collect();
                let derivative: f64 = exact.iter().zip(&direction).map(|(a, b)| a * b).sum();
                let size: f64 = exact.iter().zip(&direction).map(|(a, b)| (a * b).abs()).sum();
                let central = |e: f64| -> Result<f64, GradientFailure> {
                    let [plus, minus] = [e, -e].map(|e| self.value(gradient, by, &direction, e));
                    Ok((plus? - minus?) / (2.0 * e))
                };
                let (long, short) = (central(CHANGE)?, central(0.5 * CHANGE)?);
                let difference = (4.0 * short - long) / 3.0;
                let apart = (difference - derivative).abs();
                let relative = if apart == 0.0 { 0.0 } else { apart / size.max(difference.abs()) };
                let (by, direction) = (name.to_owned(), number);
                checks.push(Check { by, direction, derivative, difference, relative });
            }
        }
        Ok(checks)
    }
}

impl ModelGradient {
    /// Compares with central differences of whole runs along random directions.
    ///
    /// # Errors
    /// [`GradientFailure`] of one of the runs.
    pub fn check(
        &mut self,
        text: &ModelText,
        overrides: &[Override],
        model: &Model,
        wanted: &Wanted,
    ) -> Result<(), GradientFailure> {
        let runs = Runs { text, overrides, model, wanted };
        self.checks = runs.compare(self)?;
        Ok(())
    }

    /// The largest deviation of the comparisons.
    #[must_use]
    pub fn worst(&self) -> f64 {
        let worst = self.checks.iter().map(|own| own.relative).max_by(f64::total_cmp);
        worst.unwrap_or(0.0)
    }
}
