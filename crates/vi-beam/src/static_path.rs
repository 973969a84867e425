//! Equilibria, paths of equilibria, and why a path ends.

use crate::limit::LimitReport;
use serde::{Deserialize, Serialize};
use vi_core::newton::{NewtonError, NewtonSettings};

/// How to walk along the load path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StaticSettings {
    /// First step towards a target, as a part of the way.
    pub first_step: f64,
    /// Smallest step, as a part of the way, before the walk gives up.
    pub smallest_step: f64,
    /// Largest change of the angle between the nodes of an element in one step, rad: larger ones
    /// are taken for a jump to another equilibrium.
    pub largest_turn: f64,
    /// Newton's method.
    pub newton: NewtonSettings,
}

impl Default for StaticSettings {
    fn default() -> Self {
        let newton = NewtonSettings { max_iterations: 25, ..NewtonSettings::default() };
        Self { first_step: 0.25, smallest_step: 1e-4, largest_turn: 0.3, newton }
    }
}

/// An equilibrium.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Equilibrium {
    /// Load factor `λ`.
    pub factor: f64,
    /// Coordinates of all frames.
    pub q: Vec<f64>,
    /// Energy of the elements, J.
    pub strain_energy: f64,
    /// Newton's iterations.
    pub iterations: usize,
    /// `|r|_∞` left over, N or N·m.
    pub residual: f64,
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

/// A mechanism whose equilibrium is not sought here.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StaticSetupError {
    /// Joints close a loop.
    #[error(
        "joint `{joint}` closes a loop of joints: statics needs joints that form a tree; loops \
         that close through beam elements or springs are fine"
    )]
    ClosedLoop {
        /// A joint that closes one.
        joint: String,
    },
    /// There are point masses.
    #[error("point masses take no part in statics: give them a rigid body or a node instead")]
    Particles,
}

/// Why a walk ended early; the problem stands at its last equilibrium.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StaticError {
    /// No equilibrium was found however small the step.
    #[error(
        "no equilibrium was found beyond the load factor {factor:.6} ({cause}); a limit or \
         bifurcation point may be there: follow the path by its arc length, or refine the mesh"
    )]
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
    /// However small the step, the placement jumps.
    #[error(
        "beyond the load factor {factor:.6} the equilibrium jumps: element {element} bends by \
         {turn:.3} rad at once; follow the path by its arc length, or refine the mesh"
    )]
    Jump {
        /// Load factor of the last equilibrium.
        factor: f64,
        /// The element that bends most.
        element: usize,
        /// Change of the angle between its nodes, rad.
        turn: f64,
        /// The path so far.
        path: Box<StaticPath>,
    },
}
