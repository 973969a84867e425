//! `path` of motors and prescribed motions: a smooth function of time.
//!
//! ```text
//! θ_ref(t) = offset + rate t + ½ acceleration t² + amplitude (sin(2π f t + phase) − sin(phase))
//!            + Σ by_k s(ξ_k)        rest-to-rest moves, s of [`smooth_step`], ξ_k = (t − start_k)/(end_k − start_k) within [0, 1]
//!            + table(t)             cubic spline with given rates at its ends
//! ```
//! or an expression of `t` and tables, whose derivatives are exact.

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::f64::consts::TAU;

use super::formula_or_table::{self, FormulaOr};
use super::law::Formula;
use crate::expression::ExpressionProgram;
use crate::formula::Curves;
use crate::hermite::{Hermite, SplineEnds};
use crate::smooth_step::smooth_step;
use vi_core::Number;

/// A smooth function of time, a sum of what is stated:
/// `offset + rate t + ½ acceleration t² + amplitude (sin(2π frequency t + phase) − sin(phase))`,
/// moves from rest to rest, a table. Or an expression of `t` and of tables, as a text:
/// `"0.1*sin(3*t)"`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, remote = "MotionPath")]
#[schemars(transform = formula_or_table::or_text)]
pub struct MotionPath {
    /// An expression of `t`, in the place of all others, m or rad.
    #[serde(skip)]
    pub expression: Option<Formula>,
    /// Value at t = 0, m or rad.
    #[serde(default)]
    pub offset: f64,
    /// Rate at t = 0, without the sine, m/s or rad/s.
    #[serde(default)]
    pub rate: f64,
    /// Constant acceleration, m/s² or rad/s².
    #[serde(default)]
    pub acceleration: f64,
    /// Amplitude of the sine, m or rad.
    #[serde(default)]
    pub amplitude: f64,
    /// Frequency of the sine, Hz.
    #[serde(default)]
    pub frequency: f64,
    /// Phase of the sine at t = 0, rad.
    #[serde(default)]
    pub phase: f64,
    /// Moves from rest to rest.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub moves: Vec<Move>,
    /// A cubic spline through points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub table: Option<PathTable>,
}

/// A move from rest to rest: a polynomial of degree 5 whose rate and acceleration vanish at both
/// ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Move")]
pub struct Move<T = f64> {
    /// When it begins, s.
    pub start: T,
    /// When it ends, s.
    pub end: T,
    /// How far it goes, m or rad.
    pub by: T,
}

/// A cubic spline through points; before the first and after the last it goes on at the rate there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PathTable {
    /// Times, s, increasing; at least two.
    pub times: Vec<f64>,
    /// Values at these times, m or rad.
    pub values: Vec<f64>,
    /// Rates at the first and at the last time, m/s or rad/s.
    #[serde(default)]
    pub rates: [f64; 2],
}

/// What a path does not allow.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PathFault {
    /// The key below that of the path.
    pub key: &'static str,
    /// What is wrong.
    pub message: String,
    /// What to write instead.
    pub help: &'static str,
}

impl FormulaOr for MotionPath {
    const EXPECTING: &str = "a path: a table, or a text, an expression of t";
    fn of_formula(formula: Formula) -> Self {
        Self { expression: Some(formula), ..Self::default() }
    }
    fn of_table<'de, D: Deserializer<'de>>(table: D) -> Result<Self, D::Error> {
        Self::deserialize(table)
    }
}

impl<'de> Deserialize<'de> for MotionPath {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        formula_or_table::deserialize(deserializer)
    }
}

impl Serialize for MotionPath {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.expression {
            Some(formula) => formula.serialize(serializer),
            None => Self::serialize(self, serializer),
        }
    }
}

impl MotionPath {
    /// Its expression, compiled.
    #[must_use]
    pub fn program(&self, curves: &Curves<'_>) -> Option<ExpressionProgram> {
        self.expression.as_ref().and_then(|formula| curves.of_time(formula))
    }

    /// Value, rate and acceleration as a function of the time (s), of one that is no expression.
    pub fn function(&self) -> impl Fn(f64) -> [f64; 3] + Send + Sync + use<> {
        self.with_numbers(&mut |_, value| value)
    }

    /// The same of numbers that are taken by their keys.
    pub fn with_numbers<T: Number>(
        &self,
        number: &mut dyn FnMut(&str, f64) -> T,
    ) -> impl Fn(f64) -> [T; 3] + Send + Sync + use<T> {
        let own = Elementary {
            offset: number("offset", self.offset),
            rate: number("rate", self.rate),
            acceleration: number("acceleration", self.acceleration),
            amplitude: number("amplitude", self.amplitude),
            frequency: number("frequency", self.frequency),
            phase: number("phase", self.phase),
        };
        let moves = self.moves.iter().enumerate().map(|(k, part)| {
            let mut at = |key, value| number(&format!("moves.{k}.{key}"), value);
            Move { start: at("start", part.start), end: at("end", part.end), by: at("by", part.by) }
        });
        let moves: Vec<Move<T>> = moves.collect();
        let mut at = |key: &str, value| number(&format!("table.{key}"), value);
        let spline = self.table.as_ref().map(|table| table.spline(&mut at));
        move |t| {
            let parts = moves.iter().map(|part| part.at(t));
            let parts = parts.chain(spline.as_ref().map(|spline| spline.at(t)));
            parts.fold(own.at(t), |sum, part| std::array::from_fn(|i| sum[i] + part[i]))
        }
    }

    /// What is wrong with it: the key below the path, the message, what to write instead.
    #[must_use]
    pub fn fault(&self) -> Option<PathFault> {
        let fault = |key, message, help| PathFault { key, message, help };
        let backwards = self.moves.iter().find(|part| part.start >= part.end);
        if let Some(Move { start, end, .. }) = backwards {
            let message = format!("a move starts at {start} s and ends at {end} s");
            return Some(fault("moves", message, "put start before end"));
        }
        let PathTable { times, values, .. } = self.table.as_ref()?;
        if times.len() != values.len() || times.len() < 2 {
            let message = format!("{} time(s) and {} value(s)", times.len(), values.len());
            return Some(fault("table", message, "write as many values as times, at least two"));
        }
        let pair = times.windows(2).find(|pair| pair[0] >= pair[1])?;
        let message = format!("times must increase: {} is followed by {}", pair[0], pair[1]);
        Some(fault("table.times", message, "put the times in order"))
    }
}

/// Polynomial and sinusoid.
struct Elementary<T> {
    offset: T,
    rate: T,
    acceleration: T,
    amplitude: T,
    frequency: T,
    phase: T,
}

impl<T: Number> Elementary<T> {
    fn at(&self, t: f64) -> [T; 3] {
        let (t, half) = (T::of(t), T::of(0.5));
        let w = T::of(TAU) * self.frequency;
        let [sin, cos] = (w * t + self.phase).sine_cosine();
        let [start, _] = self.phase.sine_cosine();
        [
            self.offset
                + t * (self.rate + half * self.acceleration * t)
                + self.amplitude * (sin - start),
            self.rate + self.acceleration * t + self.amplitude * w * cos,
            self.acceleration - self.amplitude * w * w * sin,
        ]
    }
}

impl PathTable {
    fn spline<T: Number>(&self, number: &mut dyn FnMut(&str, f64) -> T) -> Hermite<T> {
        let each = self.times.iter().zip(&self.values).enumerate();
        let mut points = Vec::with_capacity(self.times.len());
        for (k, (t, x)) in each {
            points.push([number(&format!("times.{k}"), *t), number(&format!("values.{k}"), *x)]);
        }
        let rates = [0, 1].map(|k| number(&format!("rates.{k}"), self.rates[k]));
        Hermite::spline(points.into_iter(), SplineEnds::Clamped(rates))
    }
}

impl<T: Number> Move<T> {
    fn at(&self, t: f64) -> [T; 3] {
        let duration = self.end - self.start;
        let x = (T::of(t) - self.start) / duration;
        smooth_step(x, [self.by, self.by / duration, self.by / (duration * duration)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn full() -> MotionPath {
        MotionPath {
            expression: None,
            offset: 0.1,
            rate: 2.0,
            acceleration: -1.0,
            amplitude: 0.3,
            frequency: 1.7,
            phase: 0.4,
            moves: vec![
                Move { start: 0.2, end: 1.1, by: 0.7 },
                Move { start: 1.0, end: 2.0, by: -2.0 },
            ],
            table: Some(PathTable {
                times: vec![0.0, 0.4, 1.3, 1.5, 2.2],
                values: vec![0.0, 1.0, -0.5, 0.2, 0.3],
                rates: [0.5, -0.2],
            }),
        }
    }

    #[test]
    fn a_path_has_its_derivatives() {
        let path = full().function();
        let (e, mut worst) = (1e-5, [0.0_f64; 2]);
        for t in [-0.3, 0.11, 0.7, 1.05, 1.4, 1.9, 2.6] {
            let [_, rate, acceleration] = path(t);
            let first = (path(t + e)[0] - path(t - e)[0]) / (2.0 * e);
            let second = (path(t + e)[1] - path(t - e)[1]) / (2.0 * e);
            worst[0] = worst[0].max((first - rate).abs());
            worst[1] = worst[1].max((second - acceleration).abs());
        }
        println!("rate off by {:.1e}, acceleration by {:.1e}", worst[0], worst[1]);
        assert!(worst[0] < 1e-7 && worst[1] < 1e-7);
        assert!((path(0.0)[0] - 0.1).abs() < 1e-15);
    }

    #[test]
    #[allow(clippy::float_cmp)] // exact zeros
    fn moves_begin_and_end_at_rest() {
        let moves = vec![Move { start: 0.5, end: 1.5, by: 0.7 }];
        let path = MotionPath { moves, ..MotionPath::default() }.function();
        assert_eq!(path(0.4), [0.0; 3]);
        assert_eq!(path(0.5), [0.0; 3]);
        let end = path(1.5);
        assert!((end[0] - 0.7).abs() < 1e-15 && end[1] == 0.0 && end[2] == 0.0, "{end:?}");
        assert!((path(1.0)[0] - 0.35).abs() < 1e-15);
    }

    /// The spline passes through its points with continuous acceleration, and repeats a cubic
    /// exactly.
    #[test]
    fn a_table_is_a_spline() {
        let MotionPath { table, .. } = full();
        let table = table.unwrap();
        let path = MotionPath { table: Some(table.clone()), ..MotionPath::default() }.function();
        let (e, mut jump) = (1e-12, 0.0_f64);
        for (t, x) in table.times.iter().zip(&table.values) {
            assert!((path(*t)[0] - x).abs() < 1e-14);
        }
        for t in &table.times[1..4] {
            jump = jump.max((path(t + e)[2] - path(t - e)[2]).abs());
        }
        let cubic = |t: f64| 0.3 - t + 2.0 * t * t - 0.7 * t * t * t;
        let times = vec![0.0, 0.3, 1.1, 2.0];
        let values = times.iter().map(|t| cubic(*t)).collect();
        let rates = [-1.0, -1.0 + 8.0 - 2.1 * 4.0];
        let own = PathTable { times, values, rates };
        let path = MotionPath { table: Some(own), ..MotionPath::default() }.function();
        let error =
            [0.1, 0.7, 1.8].map(|t| (path(t)[0] - cubic(t)).abs()).into_iter().fold(0.0, f64::max);
        println!("acceleration jumps by {jump:.1e}; cubic off by {error:.1e}");
        assert!(jump < 1e-9 && error < 1e-14);
    }

    #[test]
    fn faults_are_named() {
        let moves = vec![Move { start: 1.0, end: 1.0, by: 1.0 }];
        assert_eq!(MotionPath { moves, ..MotionPath::default() }.fault().unwrap().key, "moves");
        let table = |times: &[f64], values: &[f64]| {
            let (times, values) = (times.to_vec(), values.to_vec());
            let table = Some(PathTable { times, values, rates: [0.0; 2] });
            MotionPath { table, ..MotionPath::default() }.fault()
        };
        assert_eq!(table(&[0.0], &[1.0]).unwrap().key, "table");
        assert_eq!(table(&[0.0, 1.0], &[1.0]).unwrap().key, "table");
        assert_eq!(table(&[0.0, 1.0, 1.0], &[1.0, 2.0, 3.0]).unwrap().key, "table.times");
        assert!(table(&[0.0, 1.0], &[1.0, 2.0]).is_none());
    }
}
