//! Derivatives along random directions against central differences of whole runs.
//!
//! ```text
//! (J(+ε) − J(−ε))/2ε at ε and ε/2, extrapolated
//! r = S(ε) − 4 S(ε/2),   S(ε) = J(+ε) + J(−ε) − 2 J        what is left of curvature: rounding of J
//! ```
//! Differences resolve nothing below some `r/ε`: eight times the largest of the directions of a
//! kind does not count as apart. Rounding alone, as of a number that nothing changes, is taken for
//! an error in one of 30 000 comparisons then; it were one of 50 without the factor. What is zero
//! by symmetry is a number of `ε²` at most that is no more than rounding.
//!
//! Where the first `ε` does not resolve a derivative, or both part, `ε` is divided by 16 again and
//! again, as often as the growth of a change of the motion asks for; what the difference moved by
//! tells what is left of its own error. The `ε` that resolves most counts. Where none resolves 1e-6
//! of the derivative, the comparison says so; nor does it judge derivatives that mean nothing.

use super::objective::with_sensors;
use super::prepared::{Begin, Prepared};
use super::{ByStart, GradientFailure, ModelGradient, Wanted};
use crate::design::key_of;
use crate::random::Random;
use crate::system::outside::{ExternalActions, JointStart};
use holonom_model::{Model, ModelText, Override};
use serde::Serialize;
use vi_core::Configuration;
use vi_multibody::joint_coordinate::JointCoordinate;

/// Directions for each kind of derivative.
const DIRECTIONS: usize = 3;
/// The longest change, in parts of the size of a number or of 1.
const CHANGE: f64 = 1e-3;
/// What the next one is divided by.
const FINER: f64 = 16.0;
/// Changes at most: the last is a thousand roundings.
const LEVELS: f64 = 9.0;
/// The error of a difference, in parts of what it moved by from the longer change; that of the
/// order of the method is 1/65536.
const LEFT: f64 = 1.0 / 256.0;
/// What differences resolve where they are good, in parts of the derivative.
const FINE: f64 = 1e-7;
/// What they have to resolve.
const COARSE: f64 = 1e-6;
/// How far beyond the largest of few draws rounding may be.
const DRAWS: f64 = 8.0;

/// A comparison along a direction.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    /// By what: `parameters`, `controls`, `coordinates`, `rates` or `step`.
    pub by: String,
    /// Number of the direction, from 1.
    pub direction: usize,
    /// The derivative along it.
    pub derivative: f64,
    /// By differences.
    pub difference: f64,
    /// How far apart they are beyond what differences resolve, in parts of the larger sum of moduli
    /// that the derivative has.
    pub relative: f64,
    /// Whether differences resolve 1e-6 of it; they compare nothing otherwise, and `relative` is 0.
    pub resolved: bool,
}

/// What is changed.
#[derive(Clone, Copy, PartialEq)]
enum ChangedBy {
    Parameters,
    Controls,
    Coordinates,
    Rates,
    Step,
}

/// The model that is run again and again.
pub(super) struct Runs<'a> {
    pub(super) text: &'a ModelText,
    pub(super) overrides: &'a [Override],
    pub(super) model: &'a Model,
    pub(super) wanted: &'a Wanted,
    /// Of each initial coordinate: its value and its rate; none where a run cannot be given one.
    pub(super) start: Vec<[f64; 2]>,
}

/// Along a direction: the difference, the derivative, the sum of its moduli, what is not resolved.
#[derive(Clone, Copy)]
struct DirectionalCheck {
    difference: f64,
    derivative: f64,
    size: f64,
    rounding: f64,   // of the cost
    unresolved: f64, // of the difference
}

impl DirectionalCheck {
    fn apart(&self) -> f64 {
        (self.difference - self.derivative).abs()
    }

    fn scale(&self) -> f64 {
        self.size.max(self.difference.abs())
    }

    /// Whether a shorter change is of no use.
    fn is_fine(&self, level: usize) -> bool {
        let agrees = self.apart() <= self.unresolved;
        self.unresolved <= FINE * self.scale() && (agrees || level > 0)
    }
}

impl Runs<'_> {
    /// `J` where a kind of numbers is changed by `e` times a direction.
    fn value(
        &self,
        gradient: &ModelGradient,
        by: ChangedBy,
        direction: &[f64],
        e: f64,
    ) -> Result<f64, GradientFailure> {
        let mut overrides = self.overrides.to_vec();
        let (mut start, mut values) = (self.wanted.start.clone(), self.wanted.values.clone());
        match by {
            ChangedBy::Parameters => {
                for (own, d) in gradient.parameters.iter().zip(direction) {
                    let key = key_of(&own.name);
                    overrides.retain(|one| one.key != key);
                    overrides.push(Override::new(key, format!("{:?}", own.value + e * d)));
                }
            }
            ChangedBy::Controls => {
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
            ChangedBy::Step => {}
            ChangedBy::Coordinates | ChangedBy::Rates => {
                let all = gradient.initial.iter().zip(&self.start).zip(direction);
                for ((own, [value, rate]), d) in all {
                    let [moved, faster] = [ChangedBy::Coordinates, ChangedBy::Rates]
                        .map(|own| if own == by { e * d } else { 0.0 });
                    give(&mut start.coordinates, own, value + moved);
                    if own.rate.is_some() {
                        give(&mut start.rates, own, rate + faster);
                    }
                }
            }
        }
        let mut changed = match by {
            ChangedBy::Parameters => with_sensors(&self.text.model(&overrides)?, &self.wanted.of),
            _ => self.model.clone(),
        };
        if by == ChangedBy::Step {
            let steps = changed.settings.steps();
            changed.settings.step += e * direction[0];
            changed.settings.end = changed.settings.step * steps as f64;
        }
        let stated = by == ChangedBy::Parameters && start == JointStart::default();
        if stated && !changed.settings.project_start {
            // off the constraints by the square of a change, which is the same on both sides
            changed.settings.start_tolerance = changed.settings.start_tolerance.max(CHANGE);
        }
        let outside = ExternalActions { start, ..ExternalActions::default() };
        Prepared::new(&changed, &self.wanted.of, &values, &outside)?.value()
    }

    /// Differences along a direction with the longer change `e`.
    fn along(
        &self,
        gradient: &ModelGradient,
        value: f64,
        by: ChangedBy,
        e: f64,
        exact: &[f64],
        direction: &[f64],
    ) -> Result<DirectionalCheck, GradientFailure> {
        let parts = || exact.iter().zip(direction).map(|(a, b)| a * b);
        let both = |e: f64| -> Result<[f64; 2], GradientFailure> {
            let [plus, minus] = [e, -e].map(|e| self.value(gradient, by, direction, e));
            let (plus, minus) = (plus?, minus?);
            Ok([(plus - minus) / (2.0 * e), plus + minus - 2.0 * value])
        };
        let ([long, bent], [short, less]) = (both(e)?, both(0.5 * e)?);
        Ok(DirectionalCheck {
            difference: (4.0 * short - long) / 3.0,
            derivative: parts().sum(),
            size: parts().map(f64::abs).sum(),
            rounding: (bent - 4.0 * less).abs().max(f64::EPSILON * value.abs().max(f64::EPSILON)),
            unresolved: f64::INFINITY,
        })
    }

    /// The differences that resolve most along each of some directions.
    fn resolving_most(
        &self,
        gradient: &ModelGradient,
        value: f64,
        by: ChangedBy,
        exact: &[f64],
        directions: &[Vec<f64>],
    ) -> Result<Vec<DirectionalCheck>, GradientFailure> {
        let levels = 4.0 + (gradient.growth.unwrap_or(1.0).ln() / FINER.ln()).ceil();
        let mut best: Vec<DirectionalCheck> = Vec::new();
        let mut before: Vec<f64> = Vec::new();
        let mut e = CHANGE;
        for level in 0..levels.min(LEVELS) as usize {
            let one = |direction: &Vec<f64>| self.along(gradient, value, by, e, exact, direction);
            let mut found = directions.iter().map(one).collect::<Result<Vec<_>, _>>()?;
            let rounding = found.iter().map(|own| own.rounding).fold(0.0, f64::max);
            for (k, own) in found.iter_mut().enumerate() {
                let moved = before.get(k).map_or(0.0, |before| (own.difference - before).abs());
                own.unresolved = DRAWS * rounding / e + LEFT * moved;
            }
            before = found.iter().map(|own| own.difference).collect();
            let is_fine = found.iter().all(|own| own.is_fine(level));
            // rounding alone is left, unless the changes are far beyond what is linear
            let pairs = found.iter().zip(&best);
            let is_worse = level > 0
                && gradient.growth.is_none()
                && pairs.into_iter().all(|(own, best)| own.unresolved > best.unresolved);
            match level {
                0 => best = found,
                _ => best.iter_mut().zip(found).for_each(|(best, own)| {
                    if own.unresolved < best.unresolved {
                        *best = own;
                    }
                }),
            }
            if is_fine || is_worse {
                break;
            }
            e /= FINER;
        }
        Ok(best)
    }

    /// A part of a direction: as large as the number that changes, or 1.
    fn part(gradient: &ModelGradient, by: ChangedBy, random: &mut Random, k: usize) -> f64 {
        let size = match by {
            ChangedBy::Parameters => gradient.parameters[k].value.abs(),
            ChangedBy::Step => gradient.step,
            _ => 0.0,
        };
        random.number() * if size > 0.0 { size } else { 1.0 }
    }

    /// Compares along random directions.
    pub(super) fn compare(&self, gradient: &ModelGradient) -> Result<Vec<Check>, GradientFailure> {
        let mut checks = Vec::new();
        let unchanged = ChangedBy::Controls; // of the model as it is
        let none = vec![0.0; gradient.controls.iter().map(|own| own.derivatives.len()).sum()];
        let value = self.value(gradient, unchanged, &none, 0.0)?;
        let mut random = Random(20_080_131);
        let starts = |of: fn(&ByStart) -> f64| -> Vec<f64> {
            match self.start.is_empty() {
                true => Vec::new(),
                false => gradient.initial.iter().map(of).collect(),
            }
        };
        let parameters = gradient.parameters.iter().map(|own| own.derivative).collect();
        let controls = gradient.controls.iter().flat_map(|own| own.derivatives.clone()).collect();
        let kinds: [(ChangedBy, &str, Vec<f64>); 5] = [
            (ChangedBy::Parameters, "parameters", parameters),
            (ChangedBy::Controls, "controls", controls),
            (ChangedBy::Coordinates, "coordinates", starts(|own| own.coordinate)),
            (ChangedBy::Rates, "rates", starts(|own| own.rate.unwrap_or(0.0))),
            (ChangedBy::Step, "step", gradient.by_step.into_iter().collect()),
        ];
        for (by, name, exact) in kinds.into_iter().filter(|kind| !kind.2.is_empty()) {
            let mut one = |k| Self::part(gradient, by, &mut random, k);
            let direction = |_| (0..exact.len()).map(&mut one).collect();
            let directions: Vec<Vec<f64>> = (0..DIRECTIONS).map(direction).collect();
            let found = self.resolving_most(gradient, value, by, &exact, &directions)?;
            for (k, own) in found.into_iter().enumerate() {
                let DirectionalCheck { difference, derivative, size, unresolved, .. } = own;
                let (apart, scale) = (own.apart() - unresolved, own.scale());
                let relative = if apart <= 0.0 { 0.0 } else { apart / scale };
                let is_judged = gradient.meaningless_from.is_none() || relative <= COARSE;
                // nothing is left to be resolved of a number on which nothing depends
                let shows = relative > 0.0
                    || relative.is_nan()
                    || size == 0.0
                    || unresolved <= COARSE * scale;
                let resolved = is_judged && shows;
                let relative = if resolved { relative } else { 0.0 };
                let (by, direction) = (name.to_owned(), k + 1);
                checks.push(Check { by, direction, derivative, difference, relative, resolved });
            }
        }
        Ok(checks)
    }
}

/// Gives a coordinate of a joint, or its rate.
fn give(list: &mut Vec<(String, usize, f64)>, own: &ByStart, value: f64) {
    list.retain(|(name, freedom, _)| (name, *freedom) != (&own.name, own.freedom));
    list.push((own.name.clone(), own.freedom, value));
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
        let model = &with_sensors(model, &wanted.of);
        let mut prepared = Prepared::new(model, &wanted.of, &wanted.values, &wanted.outside())?;
        let begin = Begin::new(&mut prepared)?;
        let start = |own: &ByStart| {
            let joints = &prepared.system.mechanism.description().joints;
            let joint = joints.iter().find(|joint| joint.name == own.name)?;
            let own = JointCoordinate::principal(joint, own.freedom)?;
            Some([own.at(Configuration::new(begin.t, &begin.q)), own.rate(&begin.q, &begin.v)])
        };
        let start = self.initial.iter().map(start).collect::<Option<_>>().unwrap_or_default();
        let runs = Runs { text, overrides, model, wanted, start };
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
