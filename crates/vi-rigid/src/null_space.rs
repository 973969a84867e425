//! The null space matrix of the internal constraints.
//!
//! ```text
//!              ⎡ I    0   ⎤
//! P_in(q)  =   ⎢ 0  −d̂_1  ⎥ ∈ R^{12×6},    G(q) P_in(q) = 0,    q̇ = P_in(q) (φ̇, ω)     LMO08 (59)
//!              ⎢ 0  −d̂_2  ⎥
//!              ⎣ 0  −d̂_3  ⎦
//! P_inᵀ w  =   (w_φ, Σ_I d_I × w_I)
//! P_inᵀ M P_in = diag(M_φ I, J)       with the spatial inertia tensor J, on orthonormal directors
//! ```
//! Letters: twist `(φ̇, ω)`, in this order, `ω` in the spatial frame. Applied to a force the
//! transpose gives the resultant force and torque about the centre; applied to a momentum, the
//! linear momentum and the spin.

#![allow(non_snake_case)] // P: the null space matrix

use crate::directors::director;
use crate::rotation::skew;
use nalgebra::{SMatrix, SVector, Vector3};

/// `P_in(q)ᵀ w`, shape 6.
#[must_use]
#[inline]
pub fn pull_back(q: &[f64], w: &[f64]) -> SVector<f64, 6> {
    let mut spin = Vector3::zeros();
    for i in 0..3 {
        spin += director(q, i).cross(&director(w, i));
    }
    SVector::from([w[0], w[1], w[2], spin.x, spin.y, spin.z])
}

/// `out ← P_in(q) t` for a twist `t = (φ̇, ω)`, shape 12.
#[inline]
pub fn push_forward(q: &[f64], twist: &SVector<f64, 6>, out: &mut [f64]) {
    let omega = Vector3::new(twist[3], twist[4], twist[5]);
    out[..3].copy_from_slice(&twist.as_slice()[..3]);
    for i in 0..3 {
        let rate = omega.cross(&director(q, i)); // (59)
        out[3 + 3 * i..6 + 3 * i].copy_from_slice(rate.as_slice());
    }
}

/// `P_in(q)`, dense.
#[must_use]
pub fn matrix(q: &[f64]) -> SMatrix<f64, 12, 6> {
    let mut out = SMatrix::<f64, 12, 6>::zeros();
    out.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
    for i in 0..3 {
        let block = skew(&-director(q, i));
        out.fixed_view_mut::<3, 3>(3 + 3 * i, 3).copy_from(&block);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::directors;
    use nalgebra::DMatrix;
    use vi_testkit::Sample;

    #[test]
    fn its_columns_span_the_null_space() {
        let mut sample = Sample::new(21);
        for _ in 0..200 {
            let q = sample.frame();
            let mut jacobian = DMatrix::zeros(6, 12);
            directors::internal_jacobian(&q, 0, 0, &mut jacobian);
            let product = jacobian * matrix(&q);
            let largest = product.amax();
            assert!(largest < 1e-15, "G P_in = {largest:e}");
            let values = matrix(&q).singular_values();
            // P_inᵀP_in = diag(I, 2I) on orthonormal directors
            let (low, high) = (values.min(), values.max());
            assert!((low - 1.0).abs() < 1e-14, "smallest singular value {low}");
            assert!((high - 2.0_f64.sqrt()).abs() < 1e-14, "largest singular value {high}");
        }
    }

    #[test]
    fn operators_and_matrix_agree() {
        let mut sample = Sample::new(22);
        for _ in 0..100 {
            let mut q = sample.frame();
            let (w, twist): ([f64; 12], [f64; 6]) = (sample.array(), sample.array());
            let P = matrix(&q);
            q[..3].fill(f64::NAN); // the centre is never read
            let pulled = P.tr_mul(&SVector::from(w)) - pull_back(&q, &w);
            let mut pushed = [0.0; 12];
            push_forward(&q, &SVector::from(twist), &mut pushed);
            let pushed = P * SVector::from(twist) - SVector::from(pushed);
            assert!(pulled.amax() < 1e-15, "transpose off by {:e}", pulled.amax());
            assert!(pushed.amax() < 1e-15, "product off by {:e}", pushed.amax());
        }
    }
}
