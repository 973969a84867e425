//! Efforts along an unknown of a step by several quantities: controllers that read other joints,
//! other members, states of signals.
//!
//! ```text
//! D_1 L_d + f_d^- ∋ (h/2) τ ∇θ(q_n),   D_2 L_d + f_d^+ ∋ (h/2) τ ∇θ(q_{n+1}),   τ = τ(y)
//! y_j of a coordinate x(q_n) + σ u_k/2, of its rate σ u_k/h,   of anything else a function of the step
//! ```
//! The balance of the nodal scheme, LMO08 (28), gets `σ (h/2) τ` in the row of `θ`
//! ([`crate::coordinate_force`]), its matrix a product of one column and one row.

use crate::configuration::Configuration;
use crate::coordinate_force::SignedUnknown;
use crate::interval::Interval;

/// What a quantity depends on in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepQuantity {
    /// Nothing: time, what is held.
    Fixed,
    /// It is a coordinate that is an unknown of the step, up to its sign.
    Coordinate(SignedUnknown),
    /// The rate of one.
    Rate(SignedUnknown),
    /// The end of the step.
    Configuration,
}

/// An effort along one coordinate by several quantities.
pub trait QuantityEffort {
    /// The unknown along which it acts.
    fn unknown(&self) -> SignedUnknown;
    /// How many quantities it reads.
    fn count(&self) -> usize;
    /// What the quantity `j` is.
    fn quantity(&self, j: usize) -> StepQuantity;
    /// The quantity `j`, a coordinate, at `q_n`; with its revolutions where it is an angle.
    fn at_start(&self, j: usize, at: Configuration<'_>) -> f64;
    /// The quantity `j` in a step; of a fixed one the end is not read.
    fn in_step(&self, j: usize, s: &Interval) -> f64;
    /// The entries of the derivative of the quantity `j` by `q_{n+1}`, always in the same order.
    fn for_each_slope(&self, j: usize, s: &Interval, visit: &mut dyn FnMut(usize, f64));
    /// `τ`, N or N·m, at the quantities `y`.
    fn effort(&self, s: &Interval, y: &[f64]) -> f64;
    /// The same with `slopes ← dτ/dy`.
    fn effort_and_slopes(&self, s: &Interval, y: &[f64], slopes: &mut [f64]) -> f64;
    /// Whether `τ` is an affine function of all quantities that are not fixed.
    fn is_affine(&self) -> bool;
    /// `out ← out + scale ∇θ(q)`, shape `n`.
    fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]);
}
