//! Twists, how they pass from one frame to the next, and motions of one step.

use super::MAX_FREEDOMS;
use crate::joint::Placement;
use nalgebra::{Matrix3, Vector3};

/// A twist `(φ̇, ω)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twist {
    /// `φ̇`.
    pub linear: Vector3<f64>,
    /// `ω`.
    pub angular: Vector3<f64>,
}

impl Twist {
    /// A twist.
    #[must_use]
    pub fn new(linear: Vector3<f64>, angular: Vector3<f64>) -> Self {
        Self { linear, angular }
    }

    /// Zero.
    #[must_use]
    pub fn zero() -> Self {
        Self::new(Vector3::zeros(), Vector3::zeros())
    }

    /// `self ← self + factor other`.
    pub(crate) fn add_scaled(&mut self, factor: f64, other: &Self) {
        self.linear += factor * other.linear;
        self.angular += factor * other.angular;
    }

    /// `f·φ̇ + τ·ω` with a wrench `(f, τ)`.
    #[must_use]
    pub fn dot(&self, wrench: &Self) -> f64 {
        self.linear.dot(&wrench.linear) + self.angular.dot(&wrench.angular)
    }
}

/// How the parent's twist enters the child's: `t² = X t¹ + …`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transfer {
    /// `X = [I −â; 0 I]`: the child turns with the parent.
    Rigid(
        /// `a`.
        Vector3<f64>,
    ),
    /// `X = [I −â; 0 0]`: only the point is carried along.
    Point(
        /// `a`.
        Vector3<f64>,
    ),
    /// `X = 0`.
    None,
}

impl Transfer {
    /// `X t`.
    #[must_use]
    pub fn apply(&self, t: &Twist) -> Twist {
        match self {
            Self::Rigid(a) => Twist::new(t.linear + t.angular.cross(a), t.angular),
            Self::Point(a) => Twist::new(t.linear + t.angular.cross(a), Vector3::zeros()),
            Self::None => Twist::zero(),
        }
    }

    /// `Xᵀ w`.
    #[must_use]
    pub fn apply_transposed(&self, w: &Twist) -> Twist {
        match self {
            Self::Rigid(a) => Twist::new(w.linear, w.angular + a.cross(&w.linear)),
            Self::Point(a) => Twist::new(w.linear, a.cross(&w.linear)),
            Self::None => Twist::zero(),
        }
    }
}

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
        at: &Placement,
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
