//! What the solved complement of a cluster does: to its apex, and to the unknowns when the motion
//! of the apex is known.
//!
//! ```text
//! Â_apex ← Â_apex − p C⁻¹ p'ᵀ,   p_apex ← p_apex + p C⁻¹ (g − v̂ᵀ û(x)),   μ = C⁻¹ (g − v̂ᵀ û(x) − p'ᵀ δt_apex)
//! ```
#![allow(non_snake_case)] // C

use crate::pair::Twist;
use nalgebra::Vector3;

/// Right-hand sides of `C`: the unit twists of the apex, then the closure.
pub(super) const SIDES: usize = 7;

/// The first right-hand side that is needed: without an apex, on the ground, the closure alone.
pub(super) fn first_side(apex: Option<usize>) -> usize {
    if apex.is_some() { 0 } else { SIDES - 1 }
}

/// `p_k`, and `C⁻¹` of the right-hand sides.
pub(super) struct Relief {
    pub(super) wrenches: Vec<Twist>, // p_k
    solved: Vec<f64>,                // SIDES × rank
}

impl Relief {
    /// For the rank of a cluster.
    pub(super) fn new(rank: usize) -> Self {
        Self { wrenches: vec![Twist::zero(); rank], solved: vec![0.0; SIDES * rank] }
    }

    /// Takes the solutions, unknown `k` for a right-hand side, from the side `first` on.
    pub(super) fn take(&mut self, solution: impl Fn(usize, usize) -> f64, first: usize) {
        let rank = self.wrenches.len();
        for side in first..SIDES {
            for k in 0..rank {
                self.solved[side * rank + k] = solution(k, side);
            }
        }
    }

    /// What acts on the apex: `p_k`, and the multiplier as it falls with the twist of the apex and
    /// as it is without.
    pub(super) fn parts(&self) -> impl Iterator<Item = (&Twist, Twist, f64)> {
        let closure = (SIDES - 1) * self.wrenches.len();
        let wrenches = self.wrenches.iter().enumerate();
        wrenches.map(move |(k, wrench)| (wrench, self.per_twist(k), self.solved[closure + k]))
    }

    /// By how much multiplier `k` falls for each unit of the twist of the apex.
    fn per_twist(&self, k: usize) -> Twist {
        let rank = self.wrenches.len();
        let part = |first: usize| Vector3::from_fn(|i, _| self.solved[(first + i) * rank + k]);
        Twist::new(part(0), part(3))
    }

    /// The multipliers, now that the twist of the apex is known.
    pub(super) fn multipliers(&mut self, apex: Option<&Twist>) -> &[f64] {
        let closure = (SIDES - 1) * self.wrenches.len();
        if let Some(twist) = apex {
            for k in 0..self.wrenches.len() {
                self.solved[closure + k] -= self.per_twist(k).dot(twist);
            }
        }
        &self.solved[closure..]
    }
}
