//! What a discrete Legendre transform refuses.

use vi_core::interval::Interval;
use vi_core::linear::{Singular, norm_inf};

/// Why a discrete Legendre transform has no value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LegendreError {
    /// Shapes do not match.
    #[error("{what} has {found} entries where {expected} are needed")]
    Shape {
        /// Which input.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The right length.
        expected: usize,
    },
    /// A time step is zero or not finite, or both steps beside a node cancel.
    #[error("the time step is {0}: it must be a finite number other than zero")]
    Step(f64),
    /// Two intervals that do not meet in one node.
    #[error(
        "the intervals do not meet: coordinate {coordinate} is {end} at the end of the first and \
         {start} at the start of the second"
    )]
    Apart {
        /// The coordinate.
        coordinate: usize,
        /// Its value at the end of the first interval.
        end: f64,
        /// Its value at the start of the second one.
        start: f64,
    },
    /// An input holds a number that is not finite, or the result overflows.
    #[error("{0} is not finite: look for NaN or infinity in the configurations and the momentum")]
    NotFinite(&'static str),
    /// A projection does not exist.
    #[error(
        "the projection is singular at this configuration: the constraints have lost rank, or a \
         direction they leave free carries no mass"
    )]
    Singular(#[from] Singular),
}

pub(super) fn shape(
    what: &'static str,
    found: usize,
    expected: usize,
) -> Result<(), LegendreError> {
    if found == expected { Ok(()) } else { Err(LegendreError::Shape { what, found, expected }) }
}

pub(super) fn step(h: f64) -> Result<(), LegendreError> {
    if h.is_finite() && h != 0.0 { Ok(()) } else { Err(LegendreError::Step(h)) }
}

pub(super) fn finite(what: &'static str, values: &[f64]) -> Result<(), LegendreError> {
    let all = values.iter().all(|x| x.is_finite());
    if all { Ok(()) } else { Err(LegendreError::NotFinite(what)) }
}

/// Round-off may lie between the end of one interval and the start of the next, not more.
pub(super) fn meet(before: &Interval, after: &Interval) -> Result<(), LegendreError> {
    shape("the second interval", after.dim(), before.dim())?;
    let tolerance = 1e-10 * (1e-3 + norm_inf(&after.q0));
    let mut pairs = before.q1.iter().zip(&after.q0).enumerate();
    match pairs.find(|(_, (end, start))| (*end - *start).abs() > tolerance) {
        Some((coordinate, (end, start))) => {
            Err(LegendreError::Apart { coordinate, end: *end, start: *start })
        }
        None => Ok(()),
    }
}
