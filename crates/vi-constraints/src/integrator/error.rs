//! Why a motion is not continued, and why a node is not observed.

use crate::scheme::StepError;
use vi_core::linear::Singular;

/// Why a motion cannot be continued from a state.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ResumeError {
    /// It is the state of another system.
    #[error("{what} of the state has {found} entries where {expected} are needed")]
    Shape {
        /// Which vector.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The right length.
        expected: usize,
    },
    /// It holds a number that is not finite.
    #[error("the state holds a number that is not finite")]
    NotFinite,
    /// The mechanism that was in force cannot be put together again.
    #[error("the mechanism after the event at t = {t} s cannot be continued: {message}")]
    Phase {
        /// When it began, s.
        t: f64,
        /// Why.
        message: String,
    },
    /// It does not satisfy the constraints.
    #[error(transparent)]
    Violated(#[from] StepError),
}

/// Why a node could not be observed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ObserveError {
    /// The step from the node failed.
    #[error(transparent)]
    Step(#[from] StepError),
    /// The constraints have lost rank.
    #[error(transparent)]
    Singular(#[from] Singular),
}
