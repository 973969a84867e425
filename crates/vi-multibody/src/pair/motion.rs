//! Velocity maps of pairs, and motions of one step.

use super::MAX_FREEDOMS;
use crate::geometry::twist::{Transfer, Twist};
use crate::pair::joint::JointConfiguration;
use nalgebra::{Matrix3, Vector3};

/// Velocity map of a pair at one configuration: `t² = X t¹ + Σ_k S_k τ_k`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityMap {
    /// `X`.
    pub transfer: Transfer,
    /// Columns of `S`; the first `freedoms` count.
    pub s: [Twist; MAX_FREEDOMS],
    /// Number of degrees of freedom.
    pub freedoms: usize,
}

impl VelocityMap {
    /// From `X` and the columns of `S`.
    #[must_use]
    pub fn new(transfer: Transfer, columns: &[Twist]) -> Self {
        let mut s = [Twist::zero(); MAX_FREEDOMS];
        s[..columns.len()].copy_from_slice(columns);
        Self { transfer, s, freedoms: columns.len() }
    }

    /// The columns of `S`.
    #[must_use]
    pub fn columns(&self) -> &[Twist] {
        &self.s[..self.freedoms]
    }
}

/// Motion of a frame in one step, accurate relative to itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// `Δφ`.
    pub translation: Vector3<f64>,
    /// `A − 1`.
    pub turn: Matrix3<f64>,
}

impl Motion {
    /// At rest (the ground).
    #[must_use]
    pub fn rest() -> Self {
        Self { translation: Vector3::zeros(), turn: Matrix3::zeros() }
    }

    /// `A x`.
    #[must_use]
    pub fn carry(&self, x: &Vector3<f64>) -> Vector3<f64> {
        x + self.turn * x
    }

    /// The child of a joint that turns by `A² = A¹ B` (`B − 1` given) and slides by `slide` (world
    /// vector at `q_n`, fixed in the parent):
    /// `Δφ² = Δφ¹ + (A¹−1)(ϱ¹ + r) + A¹ slide − (A²−1) ϱ²`.
    #[must_use]
    pub fn child(
        &self,
        at: &JointConfiguration,
        relative: &Matrix3<f64>,
        slide: &Vector3<f64>,
        gap: &Vector3<f64>,
    ) -> Self {
        let turn = self.turn + relative + self.turn * relative; // A¹B − 1
        let translation = self.translation + self.turn * (at.rho_parent + gap) + self.carry(slide)
            - turn * at.rho_child;
        Self { translation, turn }
    }
}
