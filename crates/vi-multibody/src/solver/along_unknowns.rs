//! What acts along unknowns of a step, and what else acts, in costates.

use super::tree_step::workspace::Workspace;
use vi_core::SeparableSystem;
use vi_core::coordinate_force::{AlongUnknown, SignedUnknown};
use vi_core::interval::{Interval, Slot};
use vi_core::sparse::{Block, Product};

/// What acts along an unknown.
#[derive(Clone, Copy, Debug)]
pub(super) struct EffortAlong {
    pub(super) unknown: SignedUnknown,
    pub(super) link: usize,
    pub(super) impulse: f64,    // (h/2) τ
    pub(super) beta: f64,       // ∇θ(q_{n+1})·b'
    pub(super) slope: [f64; 2], // κ_1, κ_2
    pub(super) moved: f64,      // ∇θ(q_n)·μ_J
}

impl EffortAlong {
    pub(super) fn of(own: AlongUnknown<'_>, at: &Workspace) -> Self {
        let unknown = own.unknown;
        let link = at.links.partition_point(|link| link.unknown <= unknown.index) - 1;
        Self { unknown, link, impulse: 0.0, beta: 0.0, slope: [0.0; 2], moved: 0.0 }
    }

    /// `∇θ(q_n)·μ`.
    pub(super) fn work(&self, m: &[f64]) -> f64 {
        self.unknown.sign * m[self.unknown.index] + self.moved
    }
}

/// `out ← out + Eᵀ v` of what else acts: `D_by` of its part of the equation of an end.
pub(super) fn transposed(
    system: &SeparableSystem,
    s: &Interval,
    [of, by]: [Slot; 2],
    v: &[f64],
    out: &mut [f64],
) {
    let into = &mut Product { v, out };
    let mut into = Block { into, row: 0, column: 0, scale: 1.0, transposed: true };
    system.beside_unknowns_slope(s, of, by, &mut into);
}
