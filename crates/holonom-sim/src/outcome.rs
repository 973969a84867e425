//! How a run ended.

use serde::{Deserialize, Serialize};

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum RunOutcome {
    /// At its end time.
    Done,
    /// Before.
    Failed(RunFailure),
}

/// Why a run ended before its time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunFailure {
    /// The step that could not be taken.
    pub step: u64,
    /// The time where it began, s.
    pub t: f64,
    /// What happened.
    pub message: String,
    /// What to do about it.
    pub remedy: String,
}

/// What the continuation along the loads was like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StaticFacts {
    /// Equilibria found, the first one included.
    pub equilibria: u64,
    /// Steps that were halved.
    pub halvings: u64,
    /// Largest force or moment left over in an equilibrium, N or N·m.
    pub max_residual: f64,
    /// Largest time of the loads that was reached, s.
    pub largest_time: f64,
    /// Whether some direction has no stiffness.
    pub neutral: bool,
    /// Whether the path was followed by its arc length.
    pub arc_length: bool,
}

/// A time for a message, s: without the round-off of a sum of steps.
pub(crate) fn twelve_digits(t: f64) -> f64 {
    format!("{t:.11e}").parse().unwrap_or(t)
}
