//! Forces along a coordinate that is an unknown of a step, up to its sign [5.28].
//!
//! ```text
//! θ(F_d(u, q_n)) = θ(q_n) + σ u_j,   P(q_n)ᵀ ∇θ(q_n) = σ e_j,   σ = ±1
//! D_1 L_d + f_d^- ∋ (h/2) τ ∇θ(q_n),   D_2 L_d + f_d^+ ∋ (h/2) τ ∇θ(q_{n+1})
//! τ = τ(t_{n+1/2}, θ̄, Δθ/h),   θ̄ = θ(q_n) + σ u_j/2,   Δθ = σ u_j
//! ```
//! The balance of the nodal scheme, LMO08 (28), gets `σ (h/2) τ` in row `j`, its matrix one entry
//! on the diagonal.

use crate::configuration::Configuration;
use crate::interval::{Interval, Slot};

/// An unknown of a step and the sign with which a coordinate grows with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignedUnknown {
    /// `j`.
    pub index: usize,
    /// `σ`: 1 or −1.
    pub sign: f64,
}

/// Derivatives of an effort.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EffortSlopes {
    /// `∂τ/∂θ`.
    pub by_coordinate: f64,
    /// `∂τ/∂θ̇`.
    pub by_rate: f64,
}

impl EffortSlopes {
    /// `∂/∂u_j` of `σ (h/2) τ`.
    #[must_use]
    pub fn by_unknown(self, h: f64) -> f64 {
        self.by_node(h, Slot::Second)
    }

    /// `∂/∂θ` of `(h/2) τ` by the coordinate at a node of a step: `(h/4) τ_θ ± ½ τ_θ̇`.
    #[must_use]
    pub fn by_node(self, h: f64, node: Slot) -> f64 {
        0.25 * h * self.by_coordinate + 0.5 * node.sign() * self.by_rate
    }
}

/// Second derivatives of an effort.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EffortBends {
    /// `∂²τ/∂θ²`.
    pub by_coordinate: f64,
    /// `∂²τ/∂θ∂θ̇`.
    pub mixed: f64,
    /// `∂²τ/∂θ̇²`.
    pub by_rate: f64,
}

impl EffortBends {
    /// `out ←` how `w (∂τ/∂θ, ∂τ/∂θ̇)` change where `(θ, θ̇)` changes by `by`.
    pub fn along(self, by: &[f64], w: f64, out: &mut [f64]) {
        out[0] = w * (self.by_coordinate * by[0] + self.mixed * by[1]);
        out[1] = w * (self.mixed * by[0] + self.by_rate * by[1]);
    }

    /// `∂²/∂θ_i∂θ_j` of `(h/2) τ` by the coordinates at nodes of a step:
    /// `(h/2) [τ_θθ/4 + (s_i + s_j) τ_θθ̇/(2h) + s_i s_j τ_θ̇θ̇/h²]`, `s = ±1`.
    #[must_use]
    pub fn by_nodes(self, h: f64, nodes: [Slot; 2]) -> f64 {
        let [a, b] = nodes.map(|node| node.sign() / h);
        0.5 * h * (0.25 * self.by_coordinate + 0.5 * (a + b) * self.mixed + a * b * self.by_rate)
    }
}

/// The effort of a step with its derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepEffort {
    /// `τ`.
    pub effort: f64,
    /// Its derivatives.
    pub slopes: EffortSlopes,
    /// Its second ones.
    pub bends: EffortBends,
    /// `Δθ/h`.
    pub rate: f64,
}

impl StepEffort {
    /// `∂/∂h` of `(h/2) τ(θ̄, Δθ/h)`: `½ (τ − τ_θ̇ θ̇)`.
    #[must_use]
    pub fn by_length(&self) -> f64 {
        0.5 * (self.effort - self.slopes.by_rate * self.rate)
    }

    /// `∂²/∂h∂θ_i` of it by the coordinate at a node: `¼ τ_θ − ½ θ̇ (τ_θθ̇/2 + s_i τ_θ̇θ̇/h)`.
    #[must_use]
    pub fn by_length_and_node(&self, h: f64, node: Slot) -> f64 {
        let bends = 0.5 * self.bends.mixed + node.sign() * self.bends.by_rate / h;
        0.25 * self.slopes.by_coordinate - 0.5 * self.rate * bends
    }

    /// `∂²/∂h²` of it: `½ τ_θ̇θ̇ θ̇²/h`.
    #[must_use]
    pub fn second_by_length(&self, h: f64) -> f64 {
        0.5 * self.bends.by_rate * self.rate * self.rate / h
    }

    /// As [`crate::force::LengthBends::add_slope_by_length`] of a force with this effort.
    pub fn add_slope_by_length(
        &self,
        force: &dyn CoordinateForce,
        s: &Interval,
        y: [&[f64]; 2],
        by: Slot,
        out: &mut [f64],
    ) {
        let along: f64 = Slot::BOTH.iter().zip(y).map(|(end, y)| force.rate(s.node(*end), y)).sum();
        force.add_gradient(s.node(by), along * self.by_length_and_node(s.h, by), out);
        let own = if by == Slot::First { y[0] } else { y[1] };
        force.add_bend(s.node(by), own, self.by_length(), out);
    }
}

/// What acts along an unknown.
#[derive(Clone, Copy)]
pub struct AlongUnknown<'a> {
    /// `j` and `σ`.
    pub unknown: SignedUnknown,
    /// The effort.
    pub force: &'a dyn CoordinateForce,
}

impl std::fmt::Debug for AlongUnknown<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("AlongUnknown").field("unknown", &self.unknown).finish_non_exhaustive()
    }
}

/// A potential or a force pair along one coordinate.
pub trait CoordinateForce {
    /// `θ(q_n)` at a node, where the angles are those at `q_n`; with its revolutions where it is an
    /// angle.
    fn coordinate(&self, at: Configuration<'_>) -> f64;
    /// `τ(t, θ, θ̇)`, N or N·m.
    fn effort(&self, t: f64, coordinate: f64, rate: f64) -> f64;
    /// `(∂τ/∂θ, ∂τ/∂θ̇)`.
    fn slopes(&self, t: f64, coordinate: f64, rate: f64) -> EffortSlopes;
    /// The second derivatives of `τ` by `θ` and `θ̇`.
    fn bends(&self, t: f64, coordinate: f64, rate: f64) -> EffortBends;
    /// Whether `τ` is an affine function of `θ` and `θ̇`.
    fn is_affine(&self) -> bool;
    /// Whether `τ` is no function of `θ` and `θ̇`: it has no slopes.
    fn is_given(&self) -> bool {
        false
    }
    /// `θ̄` and `Δθ` of a step.
    fn change(&self, s: &Interval) -> [f64; 2];
    /// `∇θ(q)·v`.
    fn rate(&self, q: &[f64], v: &[f64]) -> f64;
    /// `out ← out + scale ∇θ(q)`, shape `n`.
    fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]);
    /// `out ← out + scale D²θ(q) v`, shape `n`.
    fn add_bend(&self, q: &[f64], v: &[f64], scale: f64, out: &mut [f64]);
}
