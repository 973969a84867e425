//! States and held values of signals beside a motion: filters, integrals, what is sampled.
//!
//! They are internal variables of the [`crate::State`] between those of forces and those of a
//! potential. Laws read them; they exert nothing themselves.

use crate::configuration::Motion;
use crate::galerkin::{GaussLobatto, GaussPoint};
use crate::interval::{Interval, Slot};
use crate::sparse::Entries;
use nalgebra::DMatrix;

/// Rates of `m` continuous states at a node, and their slopes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StateRates {
    /// Where the states stand among all internal variables, shape `m`.
    pub places: Vec<usize>,
    /// `φ(t, q, v, z)`, shape `m`.
    pub rates: Vec<f64>,
    /// `∂φ/∂q`, shape `m × n`.
    pub by_position: DMatrix<f64>,
    /// `∂φ/∂v`, shape `m × n`.
    pub by_velocity: DMatrix<f64>,
    /// `∂φ/∂z`, shape `m × m`.
    pub by_state: DMatrix<f64>,
}

/// How the internal variables of signals change.
pub trait Signals: Send + Sync {
    /// How many there are.
    fn count(&self) -> usize;
    /// Whether any is a continuous state.
    fn has_states(&self) -> bool;
    /// Whether any is sampled at nodes, or kept for later: such a motion is not retraced.
    fn is_sampled(&self) -> bool;
    /// `out ←` them at the start of a motion with the velocity `v`.
    fn begin(&self, at: Motion<'_>, out: &mut [f64]);
    /// `out ←` them at an equilibrium: states where they rest, held values as at the start.
    fn rest(&self, at: Motion<'_>, out: &mut [f64]);
    /// `out ←` how they change at the start of a motion whose configuration and velocity change by
    /// `dq` and `dv`.
    fn begin_change(&self, at: Motion<'_>, change: [&[f64]; 2], out: &mut [f64]);
    /// `out ←` them at the end of a step that started with those of [`Interval::internal`].
    fn advance(&self, s: &Interval, out: &mut [f64]);
    /// Emits the derivative of [`Signals::advance`] by an end of the step, at fixed variables at
    /// its start.
    fn advance_slope(&self, s: &Interval, by: Slot, out: &mut dyn Entries);
    /// Emits the derivative of [`Signals::advance`] by the variables at the start of the step.
    fn advance_internal_slope(&self, s: &Interval, out: &mut dyn Entries);
    /// Takes the continuous states to the Gauss nodes of a Galerkin step, whose positions and
    /// velocities are known, by collocation [2.36]; in their internal variables, and in those at
    /// the `end`, all else is as at the start.
    fn collocate(
        &self,
        s: &Interval,
        constants: &GaussLobatto,
        gauss: &mut [GaussPoint],
        end: &mut [f64],
    );
    /// The rates of the continuous states at a node where all internal variables are listed;
    /// allocates.
    fn rates(&self, at: Motion<'_>) -> StateRates;
    /// Whether any is sampled at the node of this number.
    fn samples(&self, step: u64) -> bool;
    /// Samples at a node with the velocity `v`, of `ᵠp_n`; `at` has no internal variables.
    fn sample(&self, step: u64, at: Motion<'_>, internal: &mut [f64]);
}
