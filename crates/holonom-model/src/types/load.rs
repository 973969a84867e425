//! `[[load]]`: forces and torques on bodies, nodes, beams and point masses, with a history in time.

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use vi_core::Number;
use vi_rigid::time_history::{TimeFunction, TimeHistory};

use super::formula_or_table::{self, FormulaOr};
use super::frame::Frame;
use super::law::Formula;
use crate::expression::ExpressionProgram;
use crate::formula::Curves;

/// Intervals at whose ends an expression is evaluated for its size.
const SAMPLES: u32 = 256;

/// A factor in time: 1 at all times where nothing is stated, in statics `t/end`. Kinks and jumps
/// belong on step boundaries.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "lowercase", deny_unknown_fields, remote = "History")]
#[schemars(transform = formula_or_table::or_text)]
pub enum History {
    /// Nothing is stated.
    #[default]
    #[serde(skip)]
    Unstated,
    /// An expression of `t` and of tables.
    #[serde(skip)]
    Expression(Formula),
    /// A function of the time, s, of no file.
    #[serde(skip)]
    Function(TimeFunction),
    /// 1 at all times, also in statics.
    Constant,
    /// `t/end`: 1 at `end`, and growing beyond.
    Linear {
        /// When it reaches 1, s.
        end: f64,
    },
    /// 0 before `start`, growing to 1 at `end`, then 1.
    Ramp {
        /// Until when it is 0, s.
        start: f64,
        /// From when on it is 1, s.
        end: f64,
    },
    /// 1 from `start` to `end`, else 0.
    Pulse {
        /// When it begins, s.
        start: f64,
        /// When it ends, s.
        end: f64,
    },
    /// 0 at `start`, 1 at `peak`, 0 at `end` and outside, linear between.
    Triangle {
        /// When it begins, s.
        start: f64,
        /// When it is 1, s.
        peak: f64,
        /// When it ends, s.
        end: f64,
    },
    /// `sin(2π frequency t + phase)`.
    Harmonic {
        /// Frequency, Hz.
        frequency: f64,
        /// Phase at t = 0, rad.
        #[serde(default)]
        phase: f64,
    },
    /// Linear between the given points; 0 before the first, constant after the last.
    Table {
        /// Times, s, increasing.
        times: Vec<f64>,
        /// Factors at these times.
        values: Vec<f64>,
    },
    /// One value after the other, each for a step; 0 after the last.
    Steps {
        /// Factors.
        values: Vec<f64>,
        /// How long each holds, s; the step of the simulation by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        step: Option<f64>,
    },
}

impl FormulaOr for History {
    const EXPECTING: &str = "a history: a table with a `type`, or a text, an expression of t";
    fn of_formula(formula: Formula) -> Self {
        Self::Expression(formula)
    }
    fn of_table<'de, D: Deserializer<'de>>(table: D) -> Result<Self, D::Error> {
        Self::deserialize(table)
    }
}

impl<'de> Deserialize<'de> for History {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        formula_or_table::deserialize(deserializer)
    }
}

impl Serialize for History {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Expression(formula) => formula.serialize(serializer),
            _ => Self::serialize(self, serializer),
        }
    }
}

impl History {
    /// Its expression, compiled.
    #[must_use]
    pub fn program(&self, curves: &Curves<'_>) -> Option<ExpressionProgram> {
        match self {
            Self::Expression(formula) => curves.of_time(formula),
            _ => None,
        }
    }

    /// The time history of the rigid-body crate; of an expression not a number where it has no
    /// value.
    #[must_use]
    pub fn time_history(&self, curves: &Curves<'_>) -> TimeHistory {
        self.with_numbers(curves, &mut |_, value| value)
    }

    /// The same of numbers that are taken by their keys, those by which its values are continuous:
    /// all but the times of pulses, of a jump at the start of a table, and how long steps hold.
    #[must_use]
    pub fn with_numbers<T: Number>(
        &self,
        curves: &Curves<'_>,
        number: &mut dyn FnMut(&str, f64) -> T,
    ) -> TimeHistory<T> {
        let amplitude = T::of(1.0);
        match self {
            Self::Function(function) => TimeHistory::Function(function.clone()),
            Self::Expression(_) => {
                let program = self.program(curves);
                let value = move |t| {
                    let value = program.as_ref().map(|own| own.value(&[t]));
                    value.and_then(Result::ok).unwrap_or(f64::NAN)
                };
                TimeHistory::Function(TimeFunction::new(value))
            }
            Self::Unstated | Self::Constant => TimeHistory::Constant { amplitude },
            &Self::Linear { end } => TimeHistory::Linear { slope: T::of(1.0) / number("end", end) },
            &Self::Ramp { start, end } => {
                let (start, end) = (number("start", start), number("end", end));
                TimeHistory::Ramp { start, end, amplitude }
            }
            &Self::Pulse { start, end } => {
                TimeHistory::Pulse { start: T::of(start), end: T::of(end), amplitude }
            }
            &Self::Triangle { start, peak, end } => {
                let (start, peak) = (number("start", start), number("peak", peak));
                TimeHistory::Triangle { start, peak, end: number("end", end), amplitude }
            }
            &Self::Harmonic { frequency, phase } => {
                let (frequency, phase) = (number("frequency", frequency), number("phase", phase));
                TimeHistory::Harmonic { frequency, phase, amplitude, offset: T::of(0.0) }
            }
            Self::Table { times, values } => {
                let each = times.iter().zip(values).enumerate();
                let points = each.map(|(k, (t, f))| {
                    let jumps = k == 0 && *f != 0.0;
                    let time = if jumps { T::of(*t) } else { number(&format!("times.{k}"), *t) };
                    [time, number(&format!("values.{k}"), *f)]
                });
                TimeHistory::Table { points: points.collect() }
            }
            Self::Steps { values, step } => {
                let step = step.unwrap_or(f64::NAN); // resolved in a model
                let each = values.iter().enumerate();
                let values = each.map(|(k, f)| number(&format!("values.{k}"), *f)).collect();
                TimeHistory::Steps { step, values }
            }
        }
    }

    /// Fills in the step of the simulation, s.
    pub(crate) fn resolve(&mut self, simulated: f64) {
        if let Self::Steps { step, .. } = self {
            step.get_or_insert(simulated);
        }
    }

    /// Whether nothing is stated.
    #[must_use]
    pub fn is_unstated(&self) -> bool {
        matches!(self, Self::Unstated)
    }

    /// Its largest size from 0 to `until`, s; of an expression at equal distances.
    #[must_use]
    pub fn peak(&self, until: f64, curves: &Curves<'_>) -> f64 {
        match self {
            Self::Expression(_) | Self::Function(_) => {
                let history = self.time_history(curves);
                let times = (0..=SAMPLES).map(|k| until * f64::from(k) / f64::from(SAMPLES));
                times.fold(0.0, |most, t| most.max(history.value(t).abs()))
            }
            Self::Linear { end } => until / end,
            Self::Table { values, .. } | Self::Steps { values, .. } => {
                values.iter().fold(0.0, |most, value| most.max(value.abs()))
            }
            _ => 1.0,
        }
    }

    /// The time from which it stays zero, s; `None` when it never does.
    #[must_use]
    pub fn end(&self) -> Option<f64> {
        match self {
            Self::Pulse { end, .. } | Self::Triangle { end, .. } => Some(*end),
            Self::Table { times, values } => {
                let last = values.iter().rposition(|value| *value != 0.0);
                times.get(last.map_or(0, |k| k + 1)).copied()
            }
            Self::Steps { values, step } => {
                let last = values.iter().rposition(|value| *value != 0.0);
                step.map(|step| last.map_or(0.0, |k| (k + 1) as f64 * step))
            }
            Self::Unstated
            | Self::Expression(_)
            | Self::Function(_)
            | Self::Constant
            | Self::Linear { .. }
            | Self::Ramp { .. }
            | Self::Harmonic { .. } => None,
        }
    }

    /// What is wrong with it, in words.
    #[must_use]
    pub fn fault(&self) -> Option<String> {
        match self {
            Self::Unstated | Self::Expression(_) | Self::Function(_) | Self::Constant => None,
            Self::Linear { end } => (*end <= 0.0).then(|| format!("end = {end} must be positive")),
            Self::Ramp { start, end } | Self::Pulse { start, end } => {
                (start >= end).then(|| format!("start = {start} must be before end = {end}"))
            }
            Self::Triangle { start, peak, end } => (start >= peak || peak >= end).then(|| {
                format!("start = {start}, peak = {peak}, end = {end} must follow one another")
            }),
            Self::Harmonic { frequency, .. } => {
                (*frequency < 0.0).then(|| format!("frequency = {frequency} is negative"))
            }
            Self::Table { times, values } if times.len() != values.len() => {
                Some(format!("{} times but {} values", times.len(), values.len()))
            }
            Self::Steps { values, .. } if values.is_empty() => Some("it has no values".into()),
            Self::Steps { step, .. } => {
                let odd = step.filter(|step| *step <= 0.0);
                odd.map(|step| format!("step = {step} must be positive"))
            }
            Self::Table { times, .. } if times.is_empty() => Some("the table is empty".into()),
            Self::Table { times, .. } => times
                .windows(2)
                .find(|w| w[0] >= w[1])
                .map(|w| format!("times must increase: {} is followed by {}", w[0], w[1])),
        }
    }
}

/// `[[load]]`: a force at a point of a body (or a node of a beam) and a torque, or both per length
/// along a beam, times a history.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// Its name, unique in the model.
    pub name: String,
    /// The body, the node of a beam or the particle it acts on; on a particle a force with axes
    /// fixed in space.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// The beam along which it is distributed, instead of `body`; force and torque are then per
    /// length of the stress-free beam, unless `at` states a place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beam: Option<String>,
    /// A place of the beam: its arc length from the start of the stress-free beam, m. Force and
    /// torque then act there alone, N and N·m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at: Option<f64>,
    /// Force, N, at `point`; N/m along a beam; with `frame = "body"` a pressure that follows.
    #[serde(default)]
    pub force: [f64; 3],
    /// Where the force acts: body components from the centre of mass, m; the centre by default. The
    /// point moves with the body, in both frames.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point: Option<[f64; 3]>,
    /// Torque, N·m; N·m/m along a beam.
    #[serde(default)]
    pub torque: [f64; 3],
    /// The frame of the components.
    #[serde(default)]
    pub frame: Frame,
    /// The frame in whose initial axes `force` and `torque` are stated, in the place of the
    /// inertial ones: a body, a node of a beam, a joint or a `[[frame]]`. They remain fixed in
    /// space; only with `frame = "space"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_to: Option<String>,
    /// Factor in time: constant by default, in statics growing from 0 to 1 at the end.
    #[serde(default, skip_serializing_if = "History::is_unstated")]
    pub history: History,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn histories_end_where_they_stay_zero() {
        let table = |values: [f64; 4]| History::Table {
            times: vec![0.0, 1.0, 2.0, 3.0],
            values: values.into(),
        };
        assert_eq!(table([0.0, 5.0, 0.0, 0.0]).end(), Some(2.0));
        assert_eq!(table([0.0, 5.0, 0.0, 1.0]).end(), None);
        assert_eq!(table([0.0; 4]).end(), Some(0.0));
        assert_eq!(History::Triangle { start: 0.0, peak: 1.0, end: 4.0 }.end(), Some(4.0));
        assert_eq!(History::Constant.end(), None);
    }
}
