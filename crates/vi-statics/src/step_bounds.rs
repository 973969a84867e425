//! What one step may change, and why a step fails.

use serde::{Deserialize, Serialize};
use vi_core::newton::{Fault, NewtonError};

/// What one step may change: larger changes are taken for a jump to another equilibrium.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepBounds {
    /// Change of the angle between the nodes of an element, rad.
    pub bending: f64,
    /// Rotation of a body that is no node of an element, rad.
    pub rotation: f64,
    /// Displacement of a point, as a part of the size of the system.
    pub displacement: f64,
    /// Norm of the increment, relative to the prediction of the tangent at the last equilibrium.
    pub prediction: f64,
}

impl StepBounds {
    /// No bounds.
    pub const NONE: Self = Self {
        bending: f64::INFINITY,
        rotation: f64::INFINITY,
        displacement: f64::INFINITY,
        prediction: f64::INFINITY,
    };
}

impl Default for StepBounds {
    fn default() -> Self {
        Self { bending: 0.3, rotation: 1.0, displacement: 0.5, prediction: 3.0 }
    }
}

/// Why one step was refused.
#[derive(Debug)]
pub(crate) enum StepFailure {
    Newton(NewtonError),
    Limit(String),
    Jump(String),
    Violated(String),
}

impl StepFailure {
    /// A fault of the first evaluation.
    pub(crate) fn fault(fault: Fault) -> Self {
        Self::Newton(NewtonError::Refused { fault, iteration: 0 })
    }
}

impl std::fmt::Display for StepFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Newton(error) => error.fmt(f),
            Self::Limit(message) | Self::Jump(message) | Self::Violated(message) => {
                f.write_str(message)
            }
        }
    }
}
