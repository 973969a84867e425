//! What a method reads at a node.

use crate::sample::{Momenta, Residuals};
use vi_core::momentum_map::Momentum;

/// What is asked for of a node beside its state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Wanted {
    /// Constraint forces.
    pub(crate) forces: bool,
    /// Accelerations.
    pub(crate) accelerations: bool,
}

impl Wanted {
    /// Whether anything is.
    pub(crate) fn any(self) -> bool {
        self.forces || self.accelerations
    }
}

/// A node as a method reads it; filled anew at each node.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reading {
    /// Step index.
    pub(crate) step: u64,
    /// `t_n`, s.
    pub(crate) t: f64,
    /// `q_n`.
    pub(crate) q: Vec<f64>,
    /// Unwrapped angles.
    pub(crate) angles: Vec<f64>,
    /// Velocity: `v̂` of the projected momentum, `v_n` of energy–momentum schemes.
    pub(crate) v: Vec<f64>,
    /// `q̈`; empty unless it was asked for.
    pub(crate) acceleration: Vec<f64>,
    /// `G(q_n)ᵀλ_n`, N; empty unless it was asked for.
    pub(crate) force: Vec<f64>,
    /// `E_d` of the step that starts here, where there is one; else as `hamiltonian`.
    pub(crate) energy: f64,
    /// Energy of the node.
    pub(crate) hamiltonian: f64,
    /// Shadow energy; `None` at the start of composed steps.
    pub(crate) shadow: Option<f64>,
    /// Kinetic part of it.
    pub(crate) kinetic: f64,
    /// Work since the start: of each force, then of all prescribed motions.
    pub(crate) work: Vec<f64>,
    /// Momentum maps.
    pub(crate) momentum: Momentum,
    /// Constraint residuals.
    pub(crate) residuals: Residuals,
    /// Multipliers and momenta, where the settings ask for them.
    pub(crate) momenta: Option<Box<Momenta>>,
}
