//! The cone `|(x_1, x_2)| ≤ x_0`, its own dual: its product and its scaling.
//!
//! ```text
//! a ∘ b = (aᵀb, a_0 b_T + b_0 a_T)
//! V y = V⁻¹ x,   V = η (2 v vᵀ − J),   V² = η² (2 w wᵀ − J),   J = diag(1, −1, −1)
//! ```
//! Source: L. Vandenberghe, The CVXOPT linear and quadratic cone program solvers, 2010.
#![allow(non_snake_case)] // V

use super::residual::norm;
use nalgebra::{Matrix3, Vector3};

/// The scaling of Nesterov and Todd, on the way from `y` to `x`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scaling {
    eta: f64,
    w: Vector3<f64>,
}

fn flip(x: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(x[0], -x[1], -x[2])
}

/// `√(x_0² − |x_T|²)`.
fn depth(x: &Vector3<f64>) -> f64 {
    let tangent = norm([x[1], x[2]]);
    ((x[0] - tangent) * (x[0] + tangent)).max(0.0).sqrt()
}

impl Scaling {
    pub(super) fn of(x: &Vector3<f64>, y: &Vector3<f64>) -> Self {
        let (a, b) = (depth(x), depth(y));
        let (x, y) = (x / a, y / b);
        let gamma = (0.5 * (1.0 + x.dot(&y))).sqrt();
        Self { eta: (a / b).sqrt(), w: (x + flip(&y)) / (2.0 * gamma) }
    }

    /// `V x`; with `flip(w)` in the place of `w` and `1/η` of `η` it is `V⁻¹`.
    fn apply(eta: f64, w: &Vector3<f64>, x: &Vector3<f64>) -> Vector3<f64> {
        let along = w[1] * x[1] + w[2] * x[2];
        let first = w[0] * x[0] + along;
        let part = x[0] + along / (1.0 + w[0]);
        Vector3::new(first, x[1] + part * w[1], x[2] + part * w[2]) * eta
    }

    /// `V x`.
    pub(super) fn scale(&self, x: &Vector3<f64>) -> Vector3<f64> {
        Self::apply(self.eta, &self.w, x)
    }

    /// `V⁻¹ x`.
    pub(super) fn unscale(&self, x: &Vector3<f64>) -> Vector3<f64> {
        Self::apply(1.0 / self.eta, &flip(&self.w), x)
    }

    /// `η² (2 w wᵀ − J)`.
    fn square(eta: f64, w: &Vector3<f64>) -> Matrix3<f64> {
        let minus = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
        (w * w.transpose() * 2.0 - minus) * (eta * eta)
    }

    /// `V²`.
    pub(super) fn squared(&self) -> Matrix3<f64> {
        Self::square(self.eta, &self.w)
    }

    /// `V⁻²`.
    pub(super) fn inverse_squared(&self) -> Matrix3<f64> {
        Self::square(1.0 / self.eta, &flip(&self.w))
    }
}

/// `a ∘ b`.
pub(super) fn product(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(a.dot(b), a[0] * b[1] + b[0] * a[1], a[0] * b[2] + b[0] * a[2])
}

/// `a \ b`: the `x` with `a ∘ x = b`.
pub(super) fn quotient(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    let depth = depth(a);
    let first = (a[0] * b[0] - a[1] * b[1] - a[2] * b[2]) / (depth * depth);
    Vector3::new(first, (b[1] - first * a[1]) / a[0], (b[2] - first * a[2]) / a[0])
}

/// `x − y = z`, `x y = μ`, both positive.
pub(super) fn central(z: f64, mu: f64) -> [f64; 2] {
    let large = 0.5 * (z.abs() + libm::hypot(z, 2.0 * mu.sqrt()));
    if z > 0.0 { [large, mu / large] } else { [mu / large, large] }
}

/// `x − y = z`, `x ∘ y = μe`, both inside the cone: of each eigenvalue of `z`.
pub(super) fn central_disc(z: &Vector3<f64>, mu: f64) -> [Vector3<f64>; 2] {
    let across = norm([z[1], z[2]]);
    let turn = if across > 0.0 { [z[1] / across, z[2] / across] } else { [0.0; 2] };
    let [a, b] = [z[0] + across, z[0] - across].map(|own| central(own, mu));
    std::array::from_fn(|k| {
        let (mean, half) = (0.5 * (a[k] + b[k]), 0.5 * (a[k] - b[k]));
        Vector3::new(mean, half * turn[0], half * turn[1])
    })
}

/// The largest step along `dx` within the cone.
pub(super) fn reach(x: &Vector3<f64>, dx: &Vector3<f64>) -> f64 {
    let (a, b) = (dx.dot(&flip(dx)), x.dot(&flip(dx)));
    let c = depth(x) * depth(x);
    let root = b * b - a * c;
    if root < 0.0 || dx[0] >= norm([dx[1], dx[2]]) {
        return f64::INFINITY;
    }
    // the least positive root of a α² + 2b α + c
    let q = -b - root.sqrt().copysign(b);
    let roots = [q / a, c / q];
    let positive = roots.into_iter().filter(|root| *root > 0.0);
    positive.fold(f64::INFINITY, f64::min)
}
