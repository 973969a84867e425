//! Equilibria, paths of equilibria, and why a path ends.

use crate::limit::LimitReport;
use crate::step_bounds::StepBounds;
use serde::{Deserialize, Serialize};
use vi_core::newton::{Fault, NewtonError, NewtonSettings};

/// Settings of load stepping.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StaticSettings {
    /// First step towards a target load, as a part of the difference.
    pub first_step: f64,
    /// Smallest step, as a part of the difference; below it the path ends.
    pub smallest_step: f64,
    /// Step down to which a place where the equilibrium loses its stability is located, as a part
    /// of the difference.
    pub located: f64,
    /// Whether to leave the path for the branch that bifurcates where it loses its stability.
    pub switches_branch: bool,
    /// What one step may change.
    pub bounds: StepBounds,
    /// Newton's method.
    pub newton: NewtonSettings,
}

impl Default for StaticSettings {
    fn default() -> Self {
        let newton = NewtonSettings { max_iterations: 25, ..NewtonSettings::default() };
        let bounds = StepBounds::default();
        let switches_branch = false;
        let (first_step, smallest_step, located) = (0.25, 1e-4, 1.0 / 64.0);
        Self { first_step, smallest_step, located, switches_branch, bounds, newton }
    }
}

/// An equilibrium.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Equilibrium {
    /// Load parameter: the load factor, or the time at which loads and prescribed motions are
    /// taken.
    pub factor: f64,
    /// Coordinates of all frames and point masses.
    pub q: Vec<f64>,
    /// Multipliers of all constraints: zero where one follows from others, and for those inside the
    /// frames.
    pub multipliers: Vec<f64>,
    /// `V(q)`: of elements, springs and weight (of the weight only where it is a potential), J.
    pub potential_energy: f64,
    /// Newton's iterations.
    pub iterations: usize,
    /// Residual `|r|_∞` of the balance of forces, N or N·m.
    pub residual: f64,
    /// `|g|_∞` of the constraints.
    pub position_residual: f64,
    /// Unwrapped joint angles, rad.
    pub angles: Vec<f64>,
    /// Bending of the elements.
    pub limit: LimitReport,
    /// Motions that leave it by themselves:
    /// [`StaticProblem::unstable_directions`](crate::StaticProblem::unstable_directions).
    #[serde(default)]
    pub unstable: Option<usize>,
}

/// The equilibria along a path.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StaticPath {
    /// In the order in which they were found, without the initial one.
    pub points: Vec<Equilibrium>,
    /// Steps that were halved.
    pub halvings: usize,
    /// Load parameter of the first equilibrium on the branch that was switched to last.
    #[serde(default)]
    pub switched: Option<f64>,
}

/// Why a path ended early; the problem stands at its last equilibrium.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StaticError {
    /// No equilibrium was found with the smallest step.
    #[error("no equilibrium was found beyond the load factor {factor:.6} ({cause})")]
    NotConverged {
        /// Load factor of the last equilibrium.
        factor: f64,
        /// What the last attempt ended with.
        cause: NewtonError,
        /// The path so far.
        path: Box<StaticPath>,
    },
    /// An element bends too far with the smallest step.
    #[error("beyond the load factor {factor:.6} {message}")]
    ElementLimit {
        /// Load factor of the last equilibrium.
        factor: f64,
        /// Which element, and what to do.
        message: String,
        /// The path so far.
        path: Box<StaticPath>,
    },
    /// The configuration jumps with the smallest step.
    #[error("beyond the load factor {factor:.6} the equilibrium jumps: {what}")]
    Jump {
        /// Load factor of the last equilibrium.
        factor: f64,
        /// What changes too much at once.
        what: String,
        /// The path so far.
        path: Box<StaticPath>,
    },
    /// Constraints that depend on one another cannot all be satisfied.
    #[error("beyond the load factor {factor:.6} {what}")]
    Violated {
        /// Load factor of the last equilibrium.
        factor: f64,
        /// Which constraint is violated, and by how much.
        what: String,
        /// The path so far.
        path: Box<StaticPath>,
    },
    /// The load does not reach its final value.
    #[error("after {equilibria} equilibria the load factor is {factor:.6}")]
    TooLong {
        /// Load factor of the last equilibrium.
        factor: f64,
        /// How many there were.
        equilibria: usize,
    },
    /// The initial configuration does not relax to an equilibrium.
    #[error(
        "no equilibrium was found from the initial configuration at the load factor {factor:.6} ({cause})"
    )]
    NoInitialEquilibrium {
        /// Load factor at which it was sought.
        factor: f64,
        /// What the last attempt ended with.
        cause: String,
    },
}

impl StaticError {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::NotConverged {
                cause: NewtonError::Refused { fault: Fault::SingularTangent, .. },
                ..
            } => {
                "a direction has no stiffness: constrain it by a joint or a spring; at a limit or \
                 bifurcation point follow the path by its arc length (arc_length = true)"
            }
            Self::NotConverged { .. } | Self::Jump { .. } => {
                "a limit or bifurcation point may be there: follow the path by its arc length \
                 (arc_length = true), or prescribe a displacement instead of the load; or refine the mesh"
            }
            Self::Violated { .. } => {
                "constraints that depend on one another disagree: remove one of them, or correct lengths, axes \
                 and prescribed motions so that they agree"
            }
            Self::ElementLimit { .. } => "use more elements",
            Self::TooLong { .. } => "take longer steps, or a smaller load",
            Self::NoInitialEquilibrium { .. } => {
                "begin nearer to an equilibrium, or constrain the directions without stiffness"
            }
        }
    }

    /// The equilibria before the failure.
    #[must_use]
    pub fn path(&self) -> Option<&StaticPath> {
        match self {
            Self::NotConverged { path, .. }
            | Self::ElementLimit { path, .. }
            | Self::Violated { path, .. }
            | Self::Jump { path, .. } => Some(path),
            Self::NoInitialEquilibrium { .. } | Self::TooLong { .. } => None,
        }
    }
}
