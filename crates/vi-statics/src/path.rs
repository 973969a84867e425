//! Equilibria, paths of equilibria, and why a path ends.

use crate::limit::LimitReport;
use serde::{Deserialize, Serialize};
use vi_core::newton::{Fault, NewtonError, NewtonSettings};

/// How to walk along the load path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StaticSettings {
    /// First step towards a target, as a part of the way.
    pub first_step: f64,
    /// Smallest step, as a part of the way, before the walk gives up.
    pub smallest_step: f64,
    /// What one step may change.
    pub bounds: StepBounds,
    /// Newton's method.
    pub newton: NewtonSettings,
}

impl Default for StaticSettings {
    fn default() -> Self {
        let newton = NewtonSettings { max_iterations: 25, ..NewtonSettings::default() };
        let bounds = StepBounds::default();
        Self { first_step: 0.25, smallest_step: 1e-4, bounds, newton }
    }
}

/// What one step may change: larger changes are taken for a jump to another equilibrium.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepBounds {
    /// Of the angle between the nodes of an element, rad.
    pub turn: f64,
    /// Turn of a body that is no node of an element, rad.
    pub rotation: f64,
    /// Way of a point, as a part of the size of the system.
    pub travel: f64,
    /// The way, in terms of what the tangent stiffness at the last equilibrium foresees.
    pub excess: f64,
}

impl StepBounds {
    /// Anything goes.
    pub const NONE: Self = Self {
        turn: f64::INFINITY,
        rotation: f64::INFINITY,
        travel: f64::INFINITY,
        excess: f64::INFINITY,
    };
}

impl Default for StepBounds {
    fn default() -> Self {
        Self { turn: 0.3, rotation: 1.0, travel: 0.5, excess: 3.0 }
    }
}

/// An equilibrium.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Equilibrium {
    /// Load parameter: the load factor, or the time at which loads and prescribed motions are taken.
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
    /// `|r|_∞` of the balance of forces left over, N or N·m.
    pub residual: f64,
    /// `|g|_∞` of the constraints.
    pub position_residual: f64,
    /// How far the elements are from their limit.
    pub limit: LimitReport,
}

/// The equilibria on the way.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StaticPath {
    /// In the order of the walk, without the start.
    pub points: Vec<Equilibrium>,
    /// Steps that were halved.
    pub halvings: usize,
}

/// Why a walk ended early; the problem stands at its last equilibrium.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StaticError {
    /// No equilibrium was found however small the step.
    #[error("no equilibrium was found beyond the load factor {factor:.6} ({cause})")]
    NotConverged {
        /// Load factor of the last equilibrium.
        factor: f64,
        /// What the last attempt ended with.
        cause: NewtonError,
        /// The path so far.
        path: Box<StaticPath>,
    },
    /// An element bends too far however small the step.
    #[error("beyond the load factor {factor:.6} {message}")]
    ElementLimit {
        /// Load factor of the last equilibrium.
        factor: f64,
        /// Which element, and what to do.
        message: String,
        /// The path so far.
        path: Box<StaticPath>,
    },
    /// However small the step, the configuration jumps.
    #[error("beyond the load factor {factor:.6} the equilibrium jumps: {what}")]
    Jump {
        /// Load factor of the last equilibrium.
        factor: f64,
        /// What changes too much at once.
        what: String,
        /// The path so far.
        path: Box<StaticPath>,
    },
    /// The load does not reach its end.
    #[error("after {equilibria} equilibria the load factor is {factor:.6}")]
    TooLong {
        /// Load factor of the last equilibrium.
        factor: f64,
        /// How many there were.
        equilibria: usize,
    },
    /// The start does not come to rest.
    #[error("no equilibrium was found from the start at the load factor {factor:.6} ({cause})")]
    NoStart {
        /// Load factor of the start.
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
                "a direction has no stiffness: hold it by a joint or a spring; at a limit or \
                 bifurcation point follow the path by its arc length (arc_length = true)"
            }
            Self::NotConverged { .. } | Self::Jump { .. } => {
                "a limit or bifurcation point may be there: follow the path by its arc length \
                 (arc_length = true), or prescribe a displacement instead of the load; or refine the mesh"
            }
            Self::ElementLimit { .. } => "use more elements",
            Self::TooLong { .. } => "take longer steps, or ask for less load",
            Self::NoStart { .. } => {
                "start nearer to an equilibrium, or hold the directions without stiffness"
            }
        }
    }

    /// The equilibria before the failure.
    #[must_use]
    pub fn path(&self) -> Option<&StaticPath> {
        match self {
            Self::NotConverged { path, .. }
            | Self::ElementLimit { path, .. }
            | Self::Jump { path, .. } => Some(path),
            Self::NoStart { .. } | Self::TooLong { .. } => None,
        }
    }
}
