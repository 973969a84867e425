//! The fastest motion about a node, and what a step makes of it.
//!
//! ```text
//! K = Pᵀ (∇²V + Σ λ_i D²g_i) P,    M = Pᵀ M P,    ω_max² = max |eig(M⁻¹ K)|
//! ∇²V = −(D_1D_1 + D_2D_2 + D_1D_2 + D_2D_1) L_d(q, q) / h
//! ```
//! The multipliers contain the centrifugal stiffness: a free body that spins at `ω` has
//! `ω_max ≈ ω`. The boundedness of the energy error of variational schemes holds for `h ω_max ≲ 1`
//! (Hairer, Lubich & Wanner, Geometric Numerical Integration, ch. XIII).
#![allow(non_snake_case)] // G, K, M, P

use vi_constraints::Constraints;
use vi_constraints::null_space::null_space_at;
use vi_constraints::saddle_point::IndependentRows;
use vi_core::{Configuration, DiscreteLagrangian, Entries, Interval, SparseMatrix};

/// `h ω_max` above which the fastest motion is not resolved.
pub const RESOLVED: f64 = 1.0;

/// `ω_max` at `at` with the multipliers `λ` (shape `m`), rad/s; 0 without a degree of freedom,
/// `None` where `Pᵀ M P` is not positive definite. Dense.
#[must_use]
pub fn frequency(
    system: &impl DiscreteLagrangian,
    constraints: &impl Constraints,
    rows: &IndependentRows,
    at: Configuration<'_>,
    lambda: &[f64],
) -> Option<f64> {
    let (n, m) = (constraints.dim(), constraints.len());
    let (t, q, P) = (at.t, at.q, null_space_at(constraints, at, rows.len()));
    if P.ncols() == 0 {
        return Some(0.0);
    }
    let mut s = Interval::new(n);
    s.open(t, 1.0, q);
    let square = |emit: &dyn Fn(&mut dyn Entries)| SparseMatrix::assemble(n, n, |out| emit(out));
    let mixed = square(&|out| system.d2_d1(&s, out)).to_dense();
    let mut K = -(square(&|out| system.d1_d1(&s, out)).to_dense()
        + square(&|out| system.d2_d2(&s, out)).to_dense()
        + &mixed
        + mixed.transpose());
    if m > 0 {
        K += square(&|out| constraints.weighted_hessian(t, q, lambda, 1.0, out)).to_dense();
    }
    let (K, M) = (P.tr_mul(&(K * &P)), P.tr_mul(&(system.mass().to_dense() * &P)));
    let L = M.cholesky()?.unpack();
    let half = L.solve_lower_triangular(&K)?;
    let whole = L.solve_lower_triangular(&half.transpose())?;
    let symmetric = 0.5 * (&whole + whole.transpose());
    let largest = symmetric.symmetric_eigenvalues().amax();
    largest.is_finite().then(|| largest.sqrt())
}
