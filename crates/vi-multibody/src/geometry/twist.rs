//! Twists, and how they pass from one frame to the next.

use nalgebra::{Vector3, Vector6};

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
    #[inline]
    pub fn new(linear: Vector3<f64>, angular: Vector3<f64>) -> Self {
        Self { linear, angular }
    }

    /// Zero.
    #[must_use]
    #[inline]
    pub fn zero() -> Self {
        Self::new(Vector3::zeros(), Vector3::zeros())
    }

    /// From `(φ̇, ω)` in one vector.
    #[must_use]
    #[inline]
    pub fn from_vector(t: &Vector6<f64>) -> Self {
        Self::new(Vector3::new(t[0], t[1], t[2]), Vector3::new(t[3], t[4], t[5]))
    }

    /// `(φ̇, ω)` in one vector.
    #[must_use]
    #[inline]
    pub fn to_vector(&self) -> Vector6<f64> {
        let (v, w) = (&self.linear, &self.angular);
        Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z)
    }

    /// `self ← self + factor other`.
    #[inline]
    pub(crate) fn add_scaled(&mut self, factor: f64, other: &Self) {
        self.linear += factor * other.linear;
        self.angular += factor * other.angular;
    }

    /// `f·φ̇ + τ·ω` with a wrench `(f, τ)`.
    #[must_use]
    #[inline]
    pub fn dot(&self, wrench: &Self) -> f64 {
        self.linear.dot(&wrench.linear) + self.angular.dot(&wrench.angular)
    }
}

/// How the parent's twist enters the child's: `t² = X t¹ + …`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TwistTransfer {
    /// `X = [I −â; 0 I]`: the child rotates with the parent.
    Rigid(
        /// `a`.
        Vector3<f64>,
    ),
    /// `X = [I −â; 0 0]`: only the point moves with the parent.
    Point(
        /// `a`.
        Vector3<f64>,
    ),
    /// `X = 0`.
    None,
}

impl TwistTransfer {
    /// `X t`.
    #[must_use]
    #[inline]
    pub fn apply(&self, t: &Twist) -> Twist {
        match self {
            Self::Rigid(a) => Twist::new(t.linear + t.angular.cross(a), t.angular),
            Self::Point(a) => Twist::new(t.linear + t.angular.cross(a), Vector3::zeros()),
            Self::None => Twist::zero(),
        }
    }

    /// `Xᵀ w`.
    #[must_use]
    #[inline]
    pub fn apply_transposed(&self, w: &Twist) -> Twist {
        match self {
            Self::Rigid(a) => Twist::new(w.linear, w.angular + a.cross(&w.linear)),
            Self::Point(a) => Twist::new(w.linear, a.cross(&w.linear)),
            Self::None => Twist::zero(),
        }
    }
}
