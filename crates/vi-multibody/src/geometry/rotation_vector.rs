//! The rotation vector from sine and cosine of a rotation, and how it changes with them.
//!
//! ```text
//! θ = g s,  g = φ/σ,  φ = atan2(σ, κ),  σ = |s|,  N = σ² + κ²      s = sin φ · axis,  κ = cos φ
//! δθ = g δs + s (A s·δs − δκ/N),   A = (κ/N − g)/σ²  → −2/3
//! ∂g/∂s = A s,  ∂g/∂κ = −1/N,  ∂²g/∂s² = A I + B s sᵀ,  ∂²g/∂s∂κ = 2 s/N²,  ∂²g/∂κ² = 2κ/N²
//! B = −(2κ/N² + 3A)/σ²  → 8/5
//! ```
//! `s` and `κ` are any functions: off the circle `N = 1`, too, these are the exact derivatives.
#![allow(non_snake_case)] // A, B, N: the letters above

use nalgebra::{ComplexField, Matrix3, Matrix4, SMatrix, Vector3, Vector4};
use vi_core::num_dual::Dual64;
use vi_core::sparse::Entries;
use vi_core::{Number, Slot};
use vi_rigid::directors::{angular_velocity, director};

/// Below this `σ` the series of `A` and `B` are shorter than their rounding errors.
const SERIES: f64 = 0.1;

/// A rotation vector with what its derivatives are made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RotationVector {
    /// `θ`, rad.
    pub(crate) theta: Vector3<f64>,
    s: Vector3<f64>,
    cosine: f64,
    g: f64,
    A: f64,
    N: f64,
}

impl RotationVector {
    /// Of `s` and `κ`.
    pub(crate) fn of(s: Vector3<f64>, cosine: f64) -> Self {
        let sine = s.norm();
        let N = sine * sine + cosine * cosine;
        let g = if sine < 1e-9 && cosine > 0.0 {
            1.0 / cosine
        } else {
            libm::atan2(sine, cosine) / sine
        };
        let A = if sine < 1e-3 { -2.0 / 3.0 } else { (cosine / N - g) / (sine * sine) };
        Self { theta: g * s, s, cosine, g, A, N }
    }

    /// Of a step of the frame with these coordinates at its ends.
    pub(crate) fn of_step(start: &[f64], end: &[f64]) -> Self {
        Self::of_change(angular_velocity(start, end), start, end)
    }

    /// The same with `s = ½ Σ d_I × Δd_I`, which is known to its own relative precision.
    pub(crate) fn of_change(s: Vector3<f64>, start: &[f64], end: &[f64]) -> Self {
        let trace: f64 = (0..3).map(|i| director(start, i).dot(&director(end, i))).sum();
        Self::of(s, 0.5 * (trace - 1.0))
    }

    /// `∂θ/∂d_I` at the end of a step where `d` is that of the start.
    fn by_director(&self, d: &Vector3<f64>) -> Matrix3<f64> {
        self.change(&(0.5 * d.cross_matrix()), &(0.5 * d.transpose()))
    }

    /// `∂θ/∂d_I`, all three, of a step by the frame at its start or its end: exchanged, they give
    /// `−θ`.
    pub(crate) fn by_node(node: Slot, start: &[f64], end: &[f64]) -> [Matrix3<f64>; 3] {
        let (from, to) = match node {
            Slot::First => (end, start),
            Slot::Second => (start, end),
        };
        let turn = Self::of_step(from, to);
        [0, 1, 2].map(|i| node.sign() * turn.by_director(&director(from, i)))
    }

    /// `δθ`, for any number of changes at once: `by_s` and the row `by_cosine`.
    pub(crate) fn change<const C: usize>(
        &self,
        by_s: &SMatrix<f64, 3, C>,
        by_cosine: &SMatrix<f64, 1, C>,
    ) -> SMatrix<f64, 3, C> {
        let Self { s, g, A, N, .. } = self;
        let along = *A * s.transpose() * by_s - by_cosine / *N;
        *g * by_s + s * along
    }

    /// `(∂θ/∂s)ᵀ a` and `(∂θ/∂κ)ᵀ a`.
    pub(crate) fn transposed(&self, a: &Vector3<f64>) -> (Vector3<f64>, f64) {
        let Self { s, g, A, N, .. } = self;
        let along = s.dot(a);
        (*g * a + along * *A * s, -along / N)
    }

    /// `θ(end) − θ(start)` to its own relative precision, from `Δs` and `Δκ`.
    /// ```text
    /// Δθ = ḡ Δs + s̄ Δg,   Δφ = atan2(κ_0 Δσ − σ_0 Δκ, κ_0 κ_1 + σ_0 σ_1),   Δσ = (s_0 + s_1)·Δs/(σ_0 + σ_1)
    /// Δg = (Δφ − g_0 Δσ)/σ_1
    /// ```
    pub(crate) fn difference(
        start: &Self,
        end: &Self,
        ds: &Vector3<f64>,
        dcosine: f64,
    ) -> Vector3<f64> {
        let (s0, s1) = (start.s.norm(), end.s.norm());
        let dg = if s0 < 1e-9 || s1 < 1e-9 {
            end.g - start.g // both are 1 but for rounding, or s̄ is small
        } else {
            let dsine = (start.s + end.s).dot(ds) / (s0 + s1);
            let sine = start.cosine * dsine - s0 * dcosine;
            let angle = libm::atan2(sine, start.cosine * end.cosine + s0 * s1);
            (angle - start.g * dsine) / s1
        };
        0.5 * (start.g + end.g) * ds + 0.5 * dg * (start.s + end.s)
    }

    /// `∂²(a·θ)/∂(s, κ)²`, rows and columns `s_1, s_2, s_3, κ`.
    pub(crate) fn second(&self, a: &Vector3<f64>) -> Matrix4<f64> {
        second(&self.s, [self.cosine, self.N], || self.A, a)
    }

    /// How this changes where `(s, κ)` does, `∂³(a·θ)/∂(s, κ)³` times the change.
    pub(crate) fn third(&self, a: &Vector3<f64>, change: &Vector4<f64>) -> Matrix4<f64> {
        let s = self.s.zip_map(&change.xyz(), Dual64::new);
        let cosine = Dual64::new(self.cosine, change.w);
        let square = s.norm_squared();
        let N = square + cosine * cosine;
        let of_sine = || {
            let sine = ComplexField::sqrt(square);
            (cosine / N - sine.arctangent(cosine) / sine) / square
        };
        second(&s, [cosine, N], of_sine, &a.map(Dual64::of)).map(|x| x.eps)
    }

    /// Emits `∂²(a·θ)/∂d_I∂d_J` of a step by the directors of the frame at coordinate `offset`, at
    /// two of its ends.
    pub(crate) fn emit_step_second(
        [start, end]: [&[f64]; 2],
        a: &Vector3<f64>,
        [i, j]: [Slot; 2],
        offset: usize,
        out: &mut dyn Entries,
    ) {
        let turn = Self::of_step(start, end);
        let (second, (c, d)) = (turn.second(a), turn.transposed(a));
        // ∂s = ½ (δd × d' + d × δd'),   ∂κ = ½ (δd·d' + d·δd')
        let rows = |node: Slot, k: usize| {
            let (other, sign) = match node {
                Slot::First => (director(end, k), -0.5),
                Slot::Second => (director(start, k), 0.5),
            };
            let mut rows = SMatrix::<f64, 4, 3>::zeros();
            rows.fixed_view_mut::<3, 3>(0, 0).copy_from(&(sign * other.cross_matrix()));
            rows.fixed_view_mut::<1, 3>(3, 0).copy_from(&(0.5 * other.transpose()));
            rows
        };
        for k in 0..3 {
            let left = rows(i, k).transpose() * second;
            for l in 0..3 {
                let mut block = left * rows(j, l);
                if k == l && i != j {
                    // c·½ (δd × δd') = −½ δdᵀ ĉ δd'
                    let sign = if i == Slot::First { -0.5 } else { 0.5 };
                    block += sign * c.cross_matrix() + Matrix3::from_diagonal_element(0.5 * d);
                }
                out.add_block(offset + 3 + 3 * k, offset + 3 + 3 * l, &block);
            }
        }
    }
}

/// `∂²(a·θ)/∂(s, κ)²`; `of_sine`: `A` where `σ` is not small.
fn second<T: Number>(
    s: &Vector3<T>,
    [cosine, N]: [T; 2],
    of_sine: impl Fn() -> T,
    a: &Vector3<T>,
) -> Matrix4<T> {
    let of = T::of;
    let square = s.norm_squared();
    let is_small = Number::real(square) < SERIES * SERIES && Number::real(cosine) > 0.0;
    let (A, B) = if is_small {
        series(square / (cosine * cosine), cosine)
    } else {
        let A = of_sine();
        (A, -(of(2.0) * cosine / (N * N) + of(3.0) * A) / square)
    };
    let along = a.dot(s);
    let by_s = s * A;
    let mut second = Matrix4::zeros();
    let block = (Matrix3::identity() * A + s * B * s.transpose()) * along
        + a * by_s.transpose()
        + by_s * a.transpose();
    second.fixed_view_mut::<3, 3>(0, 0).copy_from(&block);
    let mixed = s * (along * of(2.0) / (N * N)) - a / N;
    second.fixed_view_mut::<3, 1>(0, 3).copy_from(&mixed);
    second.fixed_view_mut::<1, 3>(3, 0).copy_from(&mixed.transpose());
    second[(3, 3)] = along * of(2.0) * cosine / (N * N);
    second
}

/// `A` and `B` by the series of `g = (1/κ) Σ (−u)^k/(2k + 1)`, `u = σ²/κ²`.
fn series<T: Number>(u: T, cosine: T) -> (T, T) {
    let (mut A, mut B, mut power) = (T::of(0.0), T::of(0.0), T::of(1.0));
    for k in 1..10 {
        let k = f64::from(k);
        // k-th term of A: 2k (−1)^k u^(k−1)/(2k+1); of B: 4k(k+1) (−1)^(k+1) u^(k−1)/(2k+3)
        A -= T::of(2.0 * k / (2.0 * k + 1.0)) * power;
        B += T::of(4.0 * k * (k + 1.0) / (2.0 * k + 3.0)) * power;
        power *= -u;
    }
    let cube = cosine * cosine * cosine;
    (A / cube, B / (cube * cosine * cosine))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: &Vector4<f64>) -> RotationVector {
        RotationVector::of(x.xyz(), x[3])
    }

    fn vectors() -> Vec<Vector4<f64>> {
        let axis = Vector3::new(0.6, -0.64, 0.48);
        [0.0, 1e-6, 2e-3, 0.05, 0.099, 0.101, 0.5, 1.5, 2.0, 2.9]
            .iter()
            .map(|&angle: &f64| {
                let s = libm::sin(angle) * axis;
                Vector4::new(s.x, s.y, s.z, libm::cos(angle))
            })
            .collect()
    }

    #[test]
    fn derivatives_against_central_differences() {
        let a = Vector3::new(0.3, 1.1, -0.7);
        let mut worst: [f64; 3] = [0.0; 3];
        for x in vectors() {
            let e = 1e-5;
            let second = at(&x).second(&a);
            let change = Vector4::new(0.4, -0.2, 0.7, 0.5);
            let moved = |by: f64| at(&(x + by * change)).second(&a);
            let bend = (moved(e) - moved(-e)) / (2.0 * e);
            let third = at(&x).third(&a, &change);
            worst[2] = worst[2].max((third - bend).amax() / (1.0 + bend.amax()));
            for k in 0..4 {
                let moved = |by: f64| {
                    let mut x = x;
                    x[k] += by;
                    at(&x)
                };
                let (plus, minus) = (moved(e), moved(-e));
                let slope = (plus.theta - minus.theta) / (2.0 * e);
                let mut by_s = Vector3::zeros();
                let mut by_cosine = SMatrix::<f64, 1, 1>::zeros();
                if k < 3 {
                    by_s[k] = 1.0
                } else {
                    by_cosine[0] = 1.0
                }
                worst[0] = worst[0].max((at(&x).change(&by_s, &by_cosine) - slope).amax());
                let (ps, pc) = plus.transposed(&a);
                let (ms, mc) = minus.transposed(&a);
                let bend = Vector4::new(ps.x - ms.x, ps.y - ms.y, ps.z - ms.z, pc - mc) / (2.0 * e);
                worst[1] = worst[1].max((second.column(k) - bend).amax() / (1.0 + bend.amax()));
            }
        }
        println!("largest errors of first, second and third derivatives: {worst:?}");
        assert!(worst.iter().all(|error| *error < 1e-6));
    }

    #[test]
    fn small_changes_keep_their_relative_precision() {
        let axis = Vector3::new(0.6, -0.64, 0.48);
        let mut worst: f64 = 0.0;
        for angle in [0.0, 1e-7, 0.01, 0.7, 2.5] {
            for by in [1e-12, 1e-8, 1e-4, 0.1] {
                // the same axis: sines and cosines of a difference by addition theorems
                let middle: f64 = angle + 0.5 * by;
                let half = libm::sin(0.5 * by);
                let ds = 2.0 * libm::cos(middle) * half * axis;
                let dcosine = -2.0 * libm::sin(middle) * half;
                let of = |angle: f64| RotationVector::of(libm::sin(angle) * axis, libm::cos(angle));
                let found = RotationVector::difference(&of(angle), &of(angle + by), &ds, dcosine);
                worst = worst.max((found - by * axis).amax() / by);
            }
        }
        println!("largest relative error of a difference: {worst:.1e}");
        assert!(worst < 1e-8, "{worst:e}");
    }
}
