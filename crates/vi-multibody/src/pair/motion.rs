//! Velocity maps of pairs, and motions of one step.

use super::MAX_DOF;
use crate::geometry::twist::{Twist, TwistTransfer};
use crate::pair::joint::JointConfiguration;
use nalgebra::{Matrix3, Vector3};

/// Velocity map of a pair at one configuration: `t² = X t¹ + Σ_k S_k τ_k`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityMap {
    /// `X`.
    pub transfer: TwistTransfer,
    /// Columns of `S`; the first `degrees of freedom` count.
    pub s: [Twist; MAX_DOF],
    /// Number of degrees of freedom.
    pub dof: usize,
}

impl VelocityMap {
    /// From `X` and the columns of `S`.
    #[must_use]
    #[inline(always)]
    pub fn new(transfer: TwistTransfer, columns: &[Twist]) -> Self {
        let mut s = [Twist::zero(); MAX_DOF];
        s[..columns.len()].copy_from_slice(columns);
        Self { transfer, s, dof: columns.len() }
    }

    /// Becomes `X` without columns.
    #[inline]
    pub(super) fn begin(&mut self, transfer: TwistTransfer) {
        (self.transfer, self.dof) = (transfer, 0);
    }

    /// Adds a column of `S`.
    #[inline]
    pub(super) fn push(&mut self, column: Twist) {
        self.s[self.dof] = column;
        self.dof += 1;
    }

    /// The columns of `S`.
    #[must_use]
    #[inline]
    pub fn columns(&self) -> &[Twist] {
        &self.s[..self.dof]
    }
}

/// Motion of a frame in one step, accurate relative to itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameMotion {
    /// `Δφ`.
    pub translation: Vector3<f64>,
    /// `A − 1`.
    pub rotation_minus_identity: Matrix3<f64>,
}

impl FrameMotion {
    /// At rest (the ground).
    #[must_use]
    #[inline]
    pub fn rest() -> Self {
        Self { translation: Vector3::zeros(), rotation_minus_identity: Matrix3::zeros() }
    }

    /// `A x`.
    #[must_use]
    #[inline]
    pub fn transmit(&self, x: &Vector3<f64>) -> Vector3<f64> {
        x + self.rotation_minus_identity * x
    }

    /// The child of a joint with the rotation `A² = A¹ B` (`B − 1` given) and the translation
    /// `slide` (world vector at `q_n`, fixed in the parent):
    /// `Δφ² = Δφ¹ + (A¹−1)(ϱ¹ + r) + A¹ slide − (A²−1) ϱ²`.
    #[must_use]
    #[inline(always)]
    pub fn child(
        &self,
        at: &JointConfiguration,
        relative: &Matrix3<f64>,
        slide: &Vector3<f64>,
        gap: &Vector3<f64>,
    ) -> Self {
        let turn =
            // A¹B − 1
            self.rotation_minus_identity + relative + self.rotation_minus_identity * relative;
        let translation = self.translation // [5.5]
            + self.rotation_minus_identity * (at.rho_parent() + gap)
            + self.transmit(slide)
            - turn * at.rho_child();
        Self { translation, rotation_minus_identity: turn }
    }
}
