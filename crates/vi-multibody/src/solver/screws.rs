//! Screws as the unknowns of free roots.
//!
//! ```text
//! θ = D y_θ,  u_φ = T(θ) D y_φ + h v̄        with the directors D of q_n
//! J ← J ∂(u_φ, θ)/∂(y_φ, y_θ),        ∂(u_φ, θ)/∂(y_φ, y_θ) = [T D, B D; 0, D],  B = ∂(T(θ)w)/∂θ,  w = D y_φ
//! ```
//! `v̄` is the velocity of the centre of mass of a mechanism that nothing holds, else zero:
//! relative to it the screws of a uniform flight are those of the rotation alone.
#![allow(non_snake_case)] // J, T, B, D, M, R

use crate::mechanism::Mechanism;
use crate::pair::Twist;
use crate::tree::{Tree, TreeLink};
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use vi_core::linear::Singular;
use vi_core::sparse::SparseMatrix;
use vi_rigid::{directors, rotation};

/// The uniform motion to which the screws of a step are relative.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Flight {
    mass: f64,           // of the frames of a mechanism that nothing holds, else 0
    shift: Vector3<f64>, // h v̄
}

impl Flight {
    /// Of a mechanism with the mass matrix `M`.
    pub(super) fn new(mechanism: &Mechanism, M: &SparseMatrix) -> Self {
        let mut mass = 0.0;
        if mechanism.is_unsupported() {
            let frames = 12 * mechanism.tree().links().len();
            let along_x = |i: usize| i < frames && i.is_multiple_of(12);
            for (m, (row, column)) in M.as_sprs() {
                if along_x(row) && along_x(column) {
                    mass += m;
                }
            }
        }
        Self { mass, shift: Vector3::zeros() }
    }

    /// `h v̄` of a step from the momentum `p`, shape `n`, of so many frames.
    pub(super) fn open(&mut self, frames: usize, p: &[f64], h: f64) {
        if self.mass > 0.0 {
            let linear = |frame: &[f64]| Vector3::new(frame[0], frame[1], frame[2]);
            let sum: Vector3<f64> = p[..12 * frames].chunks_exact(12).map(linear).sum();
            self.shift = sum * (h / self.mass);
        }
    }
}

/// The increment of a free root by a screw.
#[derive(Clone, Copy, Debug)]
pub(super) struct RootScrew {
    triad: Matrix3<f64>, // D
    theta: Vector3<f64>, // θ
    w: Vector3<f64>,     // D y_φ
    T: Matrix3<f64>,     // T(θ)
}

impl RootScrew {
    /// Of the unknowns `y` of a root with the directors of `frame`.
    pub(super) fn new(frame: &[f64], y: &[f64]) -> Self {
        let triad = directors::triad(frame);
        let w = triad * Vector3::new(y[0], y[1], y[2]);
        let theta = triad * Vector3::new(y[3], y[4], y[5]);
        Self { triad, theta, w, T: rotation::tangent(&theta) }
    }

    /// No increment.
    pub(super) fn zero(frame: &[f64]) -> Self {
        let (theta, w) = (Vector3::zeros(), Vector3::zeros());
        Self { triad: directors::triad(frame), theta, w, T: Matrix3::identity() }
    }

    /// `y ← (u_φ, θ)`.
    pub(super) fn write_increment(&self, flight: &Flight, y: &mut [f64]) {
        y[..3].copy_from_slice((self.T * self.w + flight.shift).as_slice());
        y[3..].copy_from_slice(self.theta.as_slice());
    }

    /// `∂(u_φ, θ)/∂(y_φ, y_θ)` as `[T D, B D; 0, D]`: the three blocks that are not zero.
    fn derivative(&self) -> [Matrix3<f64>; 3] {
        let B = tangent_derivative(&self.theta, &self.w);
        [self.T * self.triad, B * self.triad, self.triad]
    }

    /// Twist of the root by the unit rates of its unknowns: `diag(I, T)` times the derivative.
    pub(super) fn root_map(&self) -> RootMap {
        let [linear, coupling, _] = self.derivative();
        RootMap::of_blocks(linear, coupling, None)
    }
}

/// `(φ̇, ω) = [A, C; 0, A'] ν`: the twist of a free root by the rates of its unknowns.
#[derive(Clone, Copy, Debug)]
pub(super) struct RootMap {
    linear: Matrix3<f64>,                // A
    coupling: Matrix3<f64>,              // C
    angular: Matrix3<f64>,               // A'
    inverses: Option<[Matrix3<f64>; 2]>, // of A and A'
}

impl RootMap {
    /// `A`, `C`, and `A'` where it is not `A`.
    fn of_blocks(
        linear: Matrix3<f64>,
        coupling: Matrix3<f64>,
        angular: Option<Matrix3<f64>>,
    ) -> Self {
        let inverse = linear.try_inverse();
        let of_angular = angular.map_or(inverse, |own| own.try_inverse());
        let inverses = inverse.zip(of_angular).map(|(linear, angular)| [linear, angular]);
        Self { linear, coupling, angular: angular.unwrap_or(linear), inverses }
    }

    /// Twists as the unknowns themselves.
    pub(super) fn identity() -> Self {
        Self::of_blocks(Matrix3::identity(), Matrix3::zeros(), None)
    }

    /// Of no increment: `diag(D, D)` with the directors of `frame`.
    pub(super) fn at_rest(frame: &[f64]) -> Self {
        Self::of_blocks(directors::triad(frame), Matrix3::zeros(), None)
    }

    /// With the velocity map of the root.
    pub(super) fn of(columns: &[Twist]) -> Self {
        let of = |first: usize, part: fn(&Twist) -> Vector3<f64>| {
            Matrix3::from_columns(&[0, 1, 2].map(|k| part(&columns[first + k])))
        };
        let (linear, coupling) = (of(0, |t| t.linear), of(3, |t| t.linear));
        Self::of_blocks(linear, coupling, Some(of(3, |t| t.angular)))
    }

    /// `R ν`.
    pub(super) fn apply(&self, nu: &[f64]) -> Vector6<f64> {
        let (a, b) = halves(nu);
        join(&(self.linear * a + self.coupling * b), &(self.angular * b))
    }

    /// `x ← Rᵀ x`.
    pub(super) fn apply_transposed(&self, x: &mut [f64]) {
        let (a, b) = halves(x);
        write(&self.linear.tr_mul(&a), &(self.coupling.tr_mul(&a) + self.angular.tr_mul(&b)), x);
    }

    /// `x ← R⁻¹ x`.
    ///
    /// # Errors
    /// [`Singular`].
    pub(super) fn solve(&self, x: &mut [f64]) -> Result<(), Singular> {
        let (a, b) = halves(x);
        let [linear, angular] = self.inverses.ok_or(Singular)?;
        let b = angular * b;
        write(&(linear * (a - self.coupling * b)), &b, x);
        Ok(())
    }

    /// `x ← R⁻ᵀ x`.
    ///
    /// # Errors
    /// [`Singular`].
    pub(super) fn solve_transposed(&self, x: &mut [f64]) -> Result<(), Singular> {
        let (a, b) = halves(x);
        let [linear, angular] = self.inverses.ok_or(Singular)?;
        let a = linear.tr_mul(&a);
        let b = b - self.coupling.tr_mul(&a);
        write(&a, &angular.tr_mul(&b), x);
        Ok(())
    }

    /// `R`.
    pub(super) fn matrix(&self) -> Matrix6<f64> {
        let mut out = Matrix6::zeros();
        out.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.linear);
        out.fixed_view_mut::<3, 3>(0, 3).copy_from(&self.coupling);
        out.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.angular);
        out
    }
}

fn halves(x: &[f64]) -> (Vector3<f64>, Vector3<f64>) {
    (Vector3::new(x[0], x[1], x[2]), Vector3::new(x[3], x[4], x[5]))
}

fn join(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
}

fn write(a: &Vector3<f64>, b: &Vector3<f64>, x: &mut [f64]) {
    x[..3].copy_from_slice(a.as_slice());
    x[3..6].copy_from_slice(b.as_slice());
}

/// Free roots: `(u_φ, θ) ← (T(D y_θ) D y_φ + h v̄, D y_θ)` with the triad `D` of the root at `q`.
pub(super) fn to_increments(tree: &Tree, flight: &Flight, q: &[f64], y: &mut [f64]) {
    for link in tree.links().iter().filter(|link| link.joint.kind.is_free()) {
        let own = &mut y[link.offset..link.offset + 6];
        RootScrew::new(&q[12 * link.frame..], own).write_increment(flight, own);
    }
}

/// `J ← J ∂(u_φ, θ)/∂(y_φ, y_θ)` in the six columns of a free root, at the screws `y` of all and
/// the triads of `q`; without `y`: at zero, without `B`.
pub(super) fn chain(root: &TreeLink, q: &[f64], y: Option<&[f64]>, columns: &mut [Vector6<f64>]) {
    let frame = &q[12 * root.frame..];
    let screw = match y {
        None => RootScrew::zero(frame),
        Some(y) => RootScrew::new(frame, &y[root.offset..root.offset + 6]),
    };
    let [TD, BD, D] = screw.derivative();
    let J: [Vector6<f64>; 6] = std::array::from_fn(|k| columns[k]);
    for k in 0..3 {
        columns[k] = (0..3).map(|l| J[l] * TD[(l, k)]).sum();
        columns[3 + k] = (0..3).map(|l| J[l] * BD[(l, k)] + J[3 + l] * D[(l, k)]).sum();
    }
}

/// `a'/x` and `b'/x` as power series in `x²`, see [`tangent_derivative`].
const COSINE_GAP: [f64; 9] = slopes(4);
const SINE_GAP: [f64; 9] = slopes(5);

/// `(−1)^{k+1} (2k + 2)/(2k + first)!`, `k = 0 … 8`.
const fn slopes(first: usize) -> [f64; 9] {
    let (mut out, mut k, mut factorial, mut known) = ([0.0; 9], 0, 1.0, 1);
    while k < 9 {
        while known < 2 * k + first {
            known += 1;
            factorial *= known as f64;
        }
        let sign = if k % 2 == 0 { -1.0 } else { 1.0 };
        out[k] = sign * (2 * k + 2) as f64 / factorial;
        k += 1;
    }
    out
}

/// `B = ∂(T(θ)w)/∂θ` with `T = I + a θ̂ + b θ̂²`, `a = (1 − cos x)/x²`, `b = (x − sin x)/x³`,
/// `x = |θ|`: `B dθ = (a'/x θ×w + b'/x θ×(θ×w)) (θ·dθ) + a dθ×w + b (dθ×(θ×w) + θ×(dθ×w))`.
fn tangent_derivative(theta: &Vector3<f64>, w: &Vector3<f64>) -> Matrix3<f64> {
    let square = theta.norm_squared();
    let x = square.sqrt();
    let (a, b) = (rotation::cosine_gap(x), rotation::sine_gap(x));
    // a'/x = (b x² − a − … ) has no accurate closed form near zero: series up to x = 1
    let (da, db) = if square < 1.0 {
        let sum = |c: [f64; 9]| c.iter().rev().fold(0.0, |sum, c| sum * square + c);
        (sum(COSINE_GAP), sum(SINE_GAP))
    } else {
        let (sin, cos) = libm::sincos(x);
        ((sin / x - 2.0 * a) / square, ((1.0 - cos) / square - 3.0 * b) / square)
    };
    let hat = rotation::skew(theta);
    let (once, twice) = (hat * w, hat * (hat * w));
    let along = (da * once + db * twice) * theta.transpose();
    along - a * rotation::skew(w) - b * (rotation::skew(&once) + hat * rotation::skew(w))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_derivative_of_the_tangent_map() {
        let (direction, w) = (Vector3::new(0.6, -0.48, 0.64), Vector3::new(0.4, 1.1, -0.7));
        let mut worst = 0.0_f64;
        for angle in [0.0, 1e-3, 0.3, 0.999, 1.001, 2.0, 3.1] {
            let theta = angle * direction;
            let exact = tangent_derivative(&theta, &w);
            for k in 0..3 {
                let e = 1e-5 * Vector3::ith(k, 1.0);
                let change = rotation::tangent(&(theta + e)) - rotation::tangent(&(theta - e));
                worst = worst.max((change * w / 2e-5 - exact.column(k)).amax());
            }
        }
        println!("∂(T(θ)w)/∂θ off by {worst:.1e}");
        assert!(worst < 1e-9, "{worst:e}");
    }
}
