//! `[[load]]`: forces and torques on bodies, with a history in time.

use std::f64::consts::TAU;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The frame of a load's components.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Frame {
    /// Fixed in space: a dead load.
    #[default]
    Space,
    /// Fixed in the body: a follower.
    Body,
}

/// A factor in time. Kinks and jumps belong on step boundaries.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "lowercase", deny_unknown_fields)]
pub enum History {
    /// 1 at all times.
    #[default]
    Constant,
    /// 0 before `start`, growing to 1 at `end`, then 1.
    Ramp {
        /// s
        start: f64,
        /// s
        end: f64,
    },
    /// 1 from `start` to `end`, else 0.
    Pulse {
        /// s
        start: f64,
        /// s
        end: f64,
    },
    /// 0 at `start`, 1 at `peak`, 0 at `end` and outside, linear between.
    Triangle {
        /// s
        start: f64,
        /// s
        peak: f64,
        /// s
        end: f64,
    },
    /// `sin(2π frequency t + phase)`.
    Harmonic {
        /// Hz
        frequency: f64,
        /// rad
        #[serde(default)]
        phase: f64,
    },
    /// Linear between the given points, constant outside.
    Table {
        /// Times, s, increasing.
        times: Vec<f64>,
        /// Factors at these times.
        values: Vec<f64>,
    },
}

impl History {
    /// The factor at time `t`, s.
    #[must_use]
    pub fn value(&self, t: f64) -> f64 {
        match self {
            Self::Constant => 1.0,
            &Self::Ramp { start, end } => ramp(t, start, end),
            &Self::Pulse { start, end } => f64::from(u8::from(start <= t && t < end)),
            &Self::Triangle { start, peak, end } => ramp(t, start, peak) - ramp(t, peak, end),
            &Self::Harmonic { frequency, phase } => (TAU * frequency * t + phase).sin(),
            Self::Table { times, values } => table(t, times, values),
        }
    }

    /// What is wrong with it, in words.
    #[must_use]
    pub fn fault(&self) -> Option<String> {
        match self {
            Self::Constant => None,
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
            Self::Table { times, .. } if times.is_empty() => Some("the table is empty".into()),
            Self::Table { times, .. } => times
                .windows(2)
                .find(|w| w[0] >= w[1])
                .map(|w| format!("times must increase: {} is followed by {}", w[0], w[1])),
        }
    }
}

/// 0 before `start`, 1 after `end`, linear between.
fn ramp(t: f64, start: f64, end: f64) -> f64 {
    ((t - start) / (end - start)).clamp(0.0, 1.0)
}

fn table(t: f64, times: &[f64], values: &[f64]) -> f64 {
    let next = times.partition_point(|&x| x <= t);
    if next == 0 || next >= times.len() {
        let end = if next == 0 { values.first() } else { values.last() };
        return end.copied().unwrap_or(0.0);
    }
    let share = (t - times[next - 1]) / (times[next] - times[next - 1]);
    values[next - 1] + share * (values[next] - values[next - 1])
}

/// `[[load]]`: a force at the centre of mass and a torque, times a history.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// Its name, unique in the model.
    pub name: String,
    /// The body it acts on.
    pub body: String,
    /// Force at the centre of mass, N.
    #[serde(default)]
    pub force: [f64; 3],
    /// Torque, N·m.
    #[serde(default)]
    pub torque: [f64; 3],
    /// The frame of the components.
    #[serde(default)]
    pub frame: Frame,
    /// Factor in time, constant by default.
    #[serde(default)]
    pub history: History,
}

#[cfg(test)]
#[allow(clippy::float_cmp)] // exactly representable numbers
mod tests {
    use super::*;

    #[test]
    fn histories_at_their_corners() {
        let triangle = History::Triangle { start: 0.0, peak: 0.5, end: 1.0 };
        assert_eq!(
            [0.0, 0.25, 0.5, 0.75, 1.0, 2.0].map(|t| triangle.value(t)),
            [0.0, 0.5, 1.0, 0.5, 0.0, 0.0]
        );
        let pulse = History::Pulse { start: 1.0, end: 2.0 };
        assert_eq!([0.5, 1.0, 1.5, 2.0].map(|t| pulse.value(t)), [0.0, 1.0, 1.0, 0.0]);
        let table = History::Table { times: vec![0.0, 2.0, 4.0], values: vec![1.0, 3.0, -1.0] };
        assert_eq!([-1.0, 1.0, 2.0, 3.0, 9.0].map(|t| table.value(t)), [1.0, 2.0, 3.0, 1.0, -1.0]);
        assert_eq!(History::Ramp { start: 0.0, end: 4.0 }.value(1.0), 0.25);
        assert!(History::Table { times: vec![], values: vec![] }.fault().is_some());
    }
}
