//! Scalar functions of time that loads are multiplied by.
//!
//! Histories are sampled at `t_{n+1/2}`: those with kinks or jumps keep order 2 when these fall on
//! step boundaries. Where a history jumps, its value is the one after the jump.

use serde::{Deserialize, Serialize};
use std::sync::Arc;
use vi_core::Number;

/// A history that is no function of time.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum HistoryError {
    /// A parameter is NaN or infinite.
    #[error("the {what} of the time history is {value}; it must be a finite number")]
    NotFinite {
        /// Which parameter.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// Two times are in the wrong order.
    #[error("the {later} of the time history, {second} s, is before its {earlier}, {first} s")]
    WrongOrder {
        /// What comes first.
        earlier: &'static str,
        /// Its time, s.
        first: f64,
        /// What comes later.
        later: &'static str,
        /// Its time, s.
        second: f64,
    },
    /// The times of a table decrease.
    #[error(
        "the table of the time history goes back in time: point {index} is at {second} s, after \
         {first} s"
    )]
    UnsortedTable {
        /// Number of the point that is too early, from 1.
        index: usize,
        /// Time of the point before it, s.
        first: f64,
        /// Its time, s.
        second: f64,
    },
    /// A table without points.
    #[error("the table of the time history has no points")]
    EmptyTable,
}

/// A factor as a function of time, `t` in s; amplitudes are 1 unless given.
///
/// ```
/// use vi_rigid::TimeHistory;
///
/// let ramp = TimeHistory::Ramp { start: 1.0, end: 3.0, amplitude: 10.0 };
/// assert_eq!([0.0, 2.0, 4.0].map(|t| ramp.value(t)), [0.0, 5.0, 10.0]);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
#[serde(bound(deserialize = "T: Number + Deserialize<'de>"))]
pub enum TimeHistory<T = f64> {
    /// The same at all times.
    Constant {
        /// The value.
        #[serde(default = "one")]
        amplitude: T,
    },
    /// `slope · t` at all times, also before zero: a load factor that grows with the time of
    /// statics.
    Linear {
        /// 1/s.
        slope: T,
    },
    /// Zero until `start`, then linear up to `amplitude` at `end`, then constant.
    Ramp {
        /// s.
        start: T,
        /// s.
        end: T,
        /// Value from `end` on.
        #[serde(default = "one")]
        amplitude: T,
    },
    /// `amplitude` for `start ≤ t < end`, zero otherwise.
    #[serde(alias = "rectangle")]
    Pulse {
        /// s.
        start: T,
        /// s.
        end: T,
        /// Height.
        #[serde(default = "one")]
        amplitude: T,
    },
    /// Linear from zero at `start` to `amplitude` at `peak` and back to zero at `end`.
    Triangle {
        /// s.
        start: T,
        /// s.
        peak: T,
        /// s.
        end: T,
        /// Height.
        #[serde(default = "one")]
        amplitude: T,
    },
    /// `offset + amplitude sin(2π frequency t + phase)`.
    Harmonic {
        /// Hz.
        frequency: T,
        /// rad.
        #[serde(default = "zero")]
        phase: T,
        /// Amplitude of the oscillation.
        #[serde(default = "one")]
        amplitude: T,
        /// Mean value.
        #[serde(default = "zero")]
        offset: T,
    },
    /// Piecewise linear through points `[t, f]`; zero before the first, constant after the last.
    Table {
        /// Points in the order of time; equal times are a jump.
        points: Vec<[T; 2]>,
    },
    /// One value after the other, each for a time; zero before the first and after the last.
    Steps {
        /// s.
        step: f64,
        /// Values.
        values: Vec<T>,
    },
    /// Any function of the time.
    #[serde(skip)]
    Function(TimeFunction),
}

/// A factor that a function computes; equal to its own clones alone.
#[derive(Clone)]
pub struct TimeFunction(Arc<dyn Fn(f64) -> f64 + Send + Sync>);

impl TimeFunction {
    /// Of the time, s.
    #[must_use]
    pub fn new(value: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Self {
        Self(Arc::new(value))
    }
}

impl std::fmt::Debug for TimeFunction {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("TimeFunction")
    }
}

impl PartialEq for TimeFunction {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

fn zero<T: Number>() -> T {
    T::of(0.0)
}

fn one<T: Number>() -> T {
    T::of(1.0)
}

impl Default for TimeHistory {
    /// One at all times.
    fn default() -> Self {
        Self::Constant { amplitude: 1.0 }
    }
}

impl<T: Number> TimeHistory<T> {
    /// The factor at time `t`, s.
    #[must_use]
    pub fn value(&self, t: f64) -> T {
        let (zero, time) = (T::of(0.0), T::of(t));
        match *self {
            Self::Constant { amplitude } => amplitude,
            Self::Linear { slope } => slope * time,
            Self::Ramp { start, end, amplitude } => {
                if t < Number::real(start) {
                    zero
                } else if t < Number::real(end) {
                    amplitude * (time - start) / (end - start)
                } else {
                    amplitude
                }
            }
            Self::Pulse { start, end, amplitude } => {
                if Number::real(start) <= t && t < Number::real(end) { amplitude } else { zero }
            }
            Self::Triangle { start, peak, end, amplitude } => {
                if t < Number::real(start) || t >= Number::real(end) {
                    zero
                } else if t < Number::real(peak) {
                    amplitude * (time - start) / (peak - start)
                } else {
                    amplitude * (end - time) / (end - peak)
                }
            }
            Self::Harmonic { frequency, phase, amplitude, offset } => {
                let angle = T::of(std::f64::consts::TAU) * frequency * time + phase;
                offset + amplitude * angle.sine_cosine()[0]
            }
            Self::Table { ref points } => table(points, t),
            Self::Steps { step, ref values } => steps(step, values, t),
            Self::Function(TimeFunction(ref value)) => T::of(value(t)),
        }
    }
}

impl TimeHistory {
    /// The derivative of the factor by the time, 1/s; `None` of histories with kinks or jumps, and
    /// of functions.
    #[must_use]
    pub fn slope(&self, t: f64) -> Option<f64> {
        match *self {
            Self::Constant { .. } => Some(0.0),
            Self::Linear { slope } => Some(slope),
            Self::Harmonic { frequency, phase, amplitude, .. } => {
                let w = std::f64::consts::TAU * frequency;
                Some(amplitude * w * libm::cos(w * t + phase))
            }
            _ => None,
        }
    }

    /// Refuses parameters that are not finite and times in the wrong order.
    ///
    /// # Errors
    /// [`HistoryError`].
    pub fn validate(&self) -> Result<(), HistoryError> {
        match *self {
            Self::Constant { amplitude } => finite(&[("amplitude", amplitude)]),
            Self::Linear { slope } => finite(&[("slope", slope)]),
            Self::Ramp { start, end, amplitude } | Self::Pulse { start, end, amplitude } => {
                finite(&[("start", start), ("end", end), ("amplitude", amplitude)])?;
                ordered("start", start, "end", end)
            }
            Self::Triangle { start, peak, end, amplitude } => {
                finite(&[("start", start), ("peak", peak), ("end", end)])?;
                finite(&[("amplitude", amplitude)])?;
                ordered("start", start, "peak", peak)?;
                ordered("peak", peak, "end", end)
            }
            Self::Harmonic { frequency, phase, amplitude, offset } => {
                finite(&[("frequency", frequency), ("phase", phase)])?;
                finite(&[("amplitude", amplitude), ("offset", offset)])
            }
            Self::Table { ref points } => {
                if points.is_empty() {
                    return Err(HistoryError::EmptyTable);
                }
                for [t, f] in points {
                    finite(&[("table", *t), ("table", *f)])?;
                }
                for (k, pair) in points.windows(2).enumerate() {
                    let (first, second) = (pair[0][0], pair[1][0]);
                    if second < first {
                        return Err(HistoryError::UnsortedTable { index: k + 2, first, second });
                    }
                }
                Ok(())
            }
            Self::Steps { step, ref values } => {
                if values.is_empty() {
                    return Err(HistoryError::EmptyTable);
                }
                finite(&[("step", step)])?;
                ordered("start", 0.0, "step", step)?;
                values.iter().try_for_each(|value| finite(&[("values", *value)]))
            }
            Self::Function(_) => Ok(()),
        }
    }
}

/// Parts of a step by which a time that is rounded misses the beginning of one.
const ROUNDED: f64 = 1e-9;

/// The value of the step in which `t` lies; at its beginning its own.
fn steps<T: Number>(step: f64, values: &[T], t: f64) -> T {
    let at = libm::floor(t / step + ROUNDED);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // whole and not negative
    let own = if at >= 0.0 { values.get(at as usize) } else { None };
    own.copied().unwrap_or(T::of(0.0))
}

/// Binary search for the points around `t`, then linear interpolation.
fn table<T: Number>(points: &[[T; 2]], t: f64) -> T {
    let after = points.partition_point(|point| Number::real(point[0]) <= t);
    if after == 0 {
        return T::of(0.0);
    }
    let [t0, f0] = points[after - 1];
    match points.get(after) {
        None => f0,
        Some(&[t1, f1]) => f0 + (f1 - f0) * ((T::of(t) - t0) / (t1 - t0)),
    }
}

fn finite(values: &[(&'static str, f64)]) -> Result<(), HistoryError> {
    match values.iter().find(|(_, value)| !value.is_finite()) {
        Some(&(what, value)) => Err(HistoryError::NotFinite { what, value }),
        None => Ok(()),
    }
}

fn ordered(
    earlier: &'static str,
    first: f64,
    later: &'static str,
    second: f64,
) -> Result<(), HistoryError> {
    if first <= second {
        Ok(())
    } else {
        Err(HistoryError::WrongOrder { earlier, first, later, second })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(history: &TimeHistory, pairs: &[(f64, f64)]) {
        history.validate().unwrap();
        for &(t, expected) in pairs {
            let value = history.value(t);
            assert!((value - expected).abs() < 1e-14, "{history:?} at {t}: {value}");
        }
    }

    #[test]
    fn histories_take_their_values() {
        check(&TimeHistory::default(), &[(-1.0, 1.0), (5.0, 1.0)]);
        let ramp = TimeHistory::Ramp { start: 1.0, end: 3.0, amplitude: 4.0 };
        check(&ramp, &[(0.9, 0.0), (1.0, 0.0), (2.5, 3.0), (3.0, 4.0), (9.0, 4.0)]);
        check(&TimeHistory::Linear { slope: 0.5 }, &[(-1.0, -0.5), (3.0, 1.5)]);
        let step = TimeHistory::Ramp { start: 1.0, end: 1.0, amplitude: 4.0 };
        check(&step, &[(0.9, 0.0), (1.0, 4.0)]);
        let pulse = TimeHistory::Pulse { start: 1.0, end: 3.0, amplitude: 4.0 };
        check(&pulse, &[(0.9, 0.0), (1.0, 4.0), (2.9, 4.0), (3.0, 0.0)]);
        let triangle = TimeHistory::Triangle { start: 0.0, peak: 0.5, end: 1.0, amplitude: 100.0 };
        check(&triangle, &[(-0.1, 0.0), (0.25, 50.0), (0.5, 100.0), (0.9, 20.0), (1.0, 0.0)]);
        let saw = TimeHistory::Triangle { start: 0.0, peak: 0.0, end: 2.0, amplitude: 1.0 };
        check(&saw, &[(-0.1, 0.0), (0.0, 1.0), (1.0, 0.5)]);
        let wave =
            TimeHistory::Harmonic { frequency: 0.5, phase: 0.0, amplitude: 2.0, offset: 1.0 };
        check(&wave, &[(0.0, 1.0), (0.5, 3.0), (1.5, -1.0)]);
        let steps = TimeHistory::Steps { step: 0.1, values: vec![2.0, -1.0, 3.0, 4.0] };
        check(&steps, &[(-0.05, 0.0), (0.0, 2.0), (0.15, -1.0), (3.0 * 0.1, 4.0), (0.4, 0.0)]);
        let points = vec![[1.0, 2.0], [2.0, 4.0], [2.0, 0.0], [4.0, 1.0]];
        let table = TimeHistory::Table { points };
        check(&table, &[(0.9, 0.0), (1.0, 2.0), (1.5, 3.0), (2.0, 0.0), (3.0, 0.5), (5.0, 1.0)]);
    }

    #[test]
    fn impossible_histories_are_refused() {
        let message = |history: TimeHistory| history.validate().unwrap_err().to_string();
        assert_eq!(
            message(TimeHistory::Pulse { start: 2.0, end: 1.0, amplitude: 1.0 }),
            "the end of the time history, 1 s, is before its start, 2 s"
        );
        assert_eq!(
            message(TimeHistory::Constant { amplitude: f64::NAN }),
            "the amplitude of the time history is NaN; it must be a finite number"
        );
        assert_eq!(
            message(TimeHistory::Table { points: vec![[0.0, 1.0], [2.0, 1.0], [1.5, 0.0]] }),
            "the table of the time history goes back in time: point 3 is at 1.5 s, after 2 s"
        );
        assert_eq!(
            message(TimeHistory::Table { points: vec![] }),
            HistoryError::EmptyTable.to_string()
        );
    }
}
