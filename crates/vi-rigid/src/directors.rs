//! A frame in twelve coordinates, and the constraints that make its directors a triad.
//!
//! ```text
//! q = (φ, d_1, d_2, d_3)
//! g = (½(d_1·d_1 − 1), ½(d_2·d_2 − 1), ½(d_3·d_3 − 1), d_1·d_2, d_1·d_3, d_2·d_3)     LMO08 (56)
//! φ̇ = v,  ḋ_I = ω × d_I
//! ```
//! Letters: `φ` centre (m), `d_I` directors, `ω` spatial angular velocity (rad/s). Directors are
//! numbered from 0 in code. `g` is quadratic: `D²g` is constant, and
//! `g(q_{n+1}) − g(q_n) = G(q_{n+1/2}) Δq` holds exactly. All slices have length 12.

#![allow(non_snake_case)] // G: the Jacobian of g

use nalgebra::{Matrix3, Scalar, Vector3};
use vi_core::momentum_map::Momentum;
use vi_core::sparse::Entries;

/// Coordinates of a frame.
pub const FRAME: usize = 12;
/// Internal constraints of a frame.
pub const INTERNAL: usize = 6;
/// The pairs of directors in the order of the rows 3, 4, 5 of `g`.
pub const PAIRS: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

/// The centre `φ`, m.
#[must_use]
#[inline]
pub fn center<T: Scalar + Copy>(q: &[T]) -> Vector3<T> {
    Vector3::new(q[0], q[1], q[2])
}

/// The director `d_{i+1}`, `i = 0, 1, 2`.
#[must_use]
#[inline]
pub fn director<T: Scalar + Copy>(q: &[T], i: usize) -> Vector3<T> {
    let k = 3 + 3 * i;
    Vector3::new(q[k], q[k + 1], q[k + 2])
}

/// The matrix with columns `d_1, d_2, d_3`: the rotation from body to spatial components.
#[must_use]
#[inline]
pub fn triad(q: &[f64]) -> Matrix3<f64> {
    Matrix3::from_column_slice(&q[3..FRAME])
}

/// Whether the directors of a frame are left-handed, `(d_1 × d_2)·d_3 < 0`.
#[must_use]
pub fn is_reflected(q: &[f64]) -> bool {
    let [d1, d2, d3] = [3, 6, 9].map(|i| Vector3::from_column_slice(&q[i..i + 3]));
    d1.cross(&d2).dot(&d3) < 0.0
}

/// Writes a frame from its centre and the triad with columns `d_I`.
pub fn set_frame(q: &mut [f64], center: &Vector3<f64>, triad: &Matrix3<f64>) {
    q[..3].copy_from_slice(center.as_slice());
    set_triad(q, triad);
}

/// Writes the directors and leaves the centre alone.
#[inline]
pub fn set_triad(q: &mut [f64], triad: &Matrix3<f64>) {
    q[3..FRAME].copy_from_slice(triad.as_slice());
}

/// `out ← g(q)`, shape 6.
#[inline]
pub fn internal_value(q: &[f64], out: &mut [f64]) {
    for (i, out) in out.iter_mut().enumerate().take(3) {
        *out = 0.5 * (director(q, i).norm_squared() - 1.0); // (56)
    }
    for (row, (i, j)) in PAIRS.into_iter().enumerate() {
        out[3 + row] = director(q, i).dot(&director(q, j));
    }
}

/// Emits `G(q)`, shape `6 × 12`, with its upper left corner at `(row, column)`.
///
/// 27 entries, always the same places in the same order; the columns of `φ` stay empty.
pub fn internal_jacobian(q: &[f64], row: usize, column: usize, out: &mut dyn Entries) {
    let place = |i: usize, k: usize| column + 3 + 3 * i + k;
    for i in 0..3 {
        for k in 0..3 {
            out.add(row + i, place(i, k), q[3 + 3 * i + k]);
        }
    }
    for (pair, (i, j)) in PAIRS.into_iter().enumerate() {
        for k in 0..3 {
            out.add(row + 3 + pair, place(i, k), q[3 + 3 * j + k]);
        }
        for k in 0..3 {
            out.add(row + 3 + pair, place(j, k), q[3 + 3 * i + k]);
        }
    }
}

/// `out_i ← vᵀ D²g_i w`, shape 6; the same at every `q`.
pub fn internal_second_derivative(v: &[f64], w: &[f64], out: &mut [f64]) {
    for (i, out) in out.iter_mut().enumerate().take(3) {
        *out = director(v, i).dot(&director(w, i));
    }
    for (row, (i, j)) in PAIRS.into_iter().enumerate() {
        out[3 + row] = director(v, i).dot(&director(w, j)) + director(v, j).dot(&director(w, i));
    }
}

/// Emits `scale Σ_i w_i D²g_i` of the frame at coordinate `at`; the same at every `q`.
pub fn internal_weighted_hessian(weights: &[f64], scale: f64, at: usize, out: &mut dyn Entries) {
    let place = |i: usize, k: usize| at + 3 + 3 * i + k;
    for i in 0..3 {
        for k in 0..3 {
            out.add(place(i, k), place(i, k), scale * weights[i]);
        }
    }
    for (pair, (i, j)) in PAIRS.into_iter().enumerate() {
        for k in 0..3 {
            out.add(place(i, k), place(j, k), scale * weights[3 + pair]);
            out.add(place(j, k), place(i, k), scale * weights[3 + pair]);
        }
    }
}

/// `q̇ = (φ̇, ω × d_1, ω × d_2, ω × d_3)`.
#[must_use]
pub fn spin_velocity(q: &[f64], velocity: &Vector3<f64>, omega: &Vector3<f64>) -> [f64; 12] {
    let mut out = [0.0; FRAME];
    out[..3].copy_from_slice(velocity.as_slice());
    for i in 0..3 {
        let rate = omega.cross(&director(q, i));
        out[3 + 3 * i..6 + 3 * i].copy_from_slice(rate.as_slice());
    }
    out
}

/// `ω = ½ Σ_I d_I × ḋ_I`, spatial, rad/s; the inverse of [`spin_velocity`] on orthonormal
/// directors.
#[must_use]
pub fn angular_velocity(q: &[f64], v: &[f64]) -> Vector3<f64> {
    0.5 * (0..3).map(|i| director(q, i).cross(&director(v, i))).sum::<Vector3<f64>>()
}

/// Adds the frame's share `p_φ` and `φ × p_φ + Σ_I d_I × p_I` to the momentum of a system.
pub fn add_momentum(q: &[f64], p: &[f64], out: &mut Momentum) {
    for (k, (x, p)) in q.chunks_exact(3).zip(p.chunks_exact(3)).take(4).enumerate() {
        out.add([x[0], x[1], x[2]], [p[0], p[1], p[2]], k == 0);
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp)] // copies and zeros are expected to be exact
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use vi_core::linear::norm_inf;
    use vi_testkit::Sample;

    fn value(q: &[f64]) -> [f64; 6] {
        let mut g = [0.0; 6];
        internal_value(q, &mut g);
        g
    }

    fn jacobian(q: &[f64]) -> DMatrix<f64> {
        let mut G = DMatrix::zeros(6, 12);
        internal_jacobian(q, 0, 0, &mut G);
        G
    }

    #[test]
    fn triads_satisfy_the_constraints_and_read_back() {
        let mut sample = Sample::new(11);
        for _ in 0..100 {
            let q = sample.frame();
            let g = norm_inf(&value(&q));
            assert!(g < 1e-15, "g = {g:e}");
            let mut again = [f64::NAN; 12];
            set_frame(&mut again, &center(&q), &triad(&q));
            assert_eq!(again, q);
            assert_eq!(triad(&q).column(1), director(&q, 1));
        }
    }

    #[test]
    fn derivatives_match_central_differences_and_never_read_the_centre() {
        let mut sample = Sample::new(12);
        for _ in 0..50 {
            let mut q: [f64; 12] = sample.array(); // g is defined off the constraint as well
            q[..3].fill(f64::NAN);
            let (v, w): ([f64; 12], [f64; 12]) = (sample.array(), sample.array());
            let G = jacobian(&q);
            let e = 1e-3; // quadratic: central differences have no truncation error
            let at = |by: f64| std::array::from_fn::<f64, 12, _>(|k| q[k] + by * v[k]);
            let product = &G * DVector::from_column_slice(&v);
            let (plus, minus) = (value(&at(e)), value(&at(-e)));
            let change = (jacobian(&at(e)) - jacobian(&at(-e))) / (2.0 * e);
            let change = change * DVector::from_column_slice(&w);
            let mut second = [0.0; 6];
            internal_second_derivative(&v, &w, &mut second);
            for i in 0..6 {
                let fd = (plus[i] - minus[i]) / (2.0 * e);
                assert!((fd - product[i]).abs() < 1e-11, "G[{i}] v: {} vs {fd}", product[i]);
                let fd = change[i];
                assert!((fd - second[i]).abs() < 1e-11, "D²g[{i}]: {} vs {fd}", second[i]);
            }
        }
    }

    #[test]
    fn the_increment_of_g_is_the_midpoint_jacobian_times_the_increment_of_q() {
        let mut sample = Sample::new(13);
        for _ in 0..50 {
            let (q0, q1): ([f64; 12], [f64; 12]) = (sample.array(), sample.array());
            let mid: [f64; 12] = std::array::from_fn(|k| 0.5 * (q0[k] + q1[k]));
            let dq = DVector::from_iterator(12, q1.iter().zip(q0).map(|(a, b)| a - b));
            let right = jacobian(&mid) * dq;
            let (g0, g1) = (value(&q0), value(&q1));
            for i in 0..6 {
                let error = (g1[i] - g0[i] - right[i]).abs();
                assert!(error < 4e-15, "row {i}: {error:e}");
            }
        }
    }

    #[test]
    fn spinning_keeps_the_triad_and_carries_the_momentum() {
        let mut sample = Sample::new(14);
        for _ in 0..50 {
            let q = sample.frame();
            let (v, omega) = (sample.vector(), sample.vector());
            let rate = spin_velocity(&q, &v, &omega);
            let error = (angular_velocity(&q, &rate) - omega).amax();
            assert!(error < 1e-15, "ω read back off by {error:e}");
            let drift = jacobian(&q) * DVector::from_column_slice(&rate);
            assert!(drift.amax() < 1e-15, "G q̇ = {:e}", drift.amax());
            // unit masses everywhere: Σ d_I × (ω × d_I) = 2 ω
            let mut momentum = Momentum::default();
            add_momentum(&q, &rate, &mut momentum);
            let expected = center(&q).cross(&v) + 2.0 * omega;
            let error = (Vector3::from(momentum.angular) - expected).norm();
            assert!(error < 1e-14, "angular momentum off by {error:e}");
            assert_eq!(momentum.linear, [v.x, v.y, v.z]);
        }
    }
}
