//! Null space and rank of `G` by column-pivoted QR.
//!
//! ```text
//! Gᵀ Π = [Q₁ Q₂] [R; 0],   P = Q₂,   rank = #{k : |R_kk| > tol |R_11|}
//! ```
//! The rows of `G` are scaled first (to unit length, or by the caller), so the tolerance is a
//! statement about geometry, not about units. The pivots name a set of independent constraints; the
//! others are redundant.
//!
//! Letters: `G` constraint Jacobian `m × n`, `P` null space matrix `n × d`, `Π` the pivots.
//! Source: LMO08 §2 (b); pivoting after Golub & Van Loan, §5.4.
#![allow(non_snake_case)] // G, P, Q, R

pub use crate::constraints::RANK_TOLERANCE;

use crate::constraints::Constraints;
use nalgebra::DMatrix;
use vi_core::Configuration;
use vi_core::dense::PivotedQr;

/// Pivoted QR of `Gᵀ` with all memory sized once.
///
/// ```
/// use nalgebra::{DMatrix, dmatrix};
/// use vi_constraints::null_space::NullSpaceQr;
/// let g = dmatrix![1.0, 0.0, 0.0; 0.0, 1.0, 0.0; 1.0, 1.0, 0.0]; // the third row is redundant
/// let mut qr = NullSpaceQr::new(3, 3);
/// assert_eq!(qr.factorize(&g), 2);
/// let mut p = DMatrix::zeros(3, 1);
/// qr.null_space(2, &mut p);
/// assert!((g * p).amax() < 1e-15);
/// ```
#[derive(Clone, Debug)]
pub struct NullSpaceQr {
    qr: PivotedQr, // of the scaled Gᵀ, n × m
    rank: usize,
    tolerance: f64,
}

impl NullSpaceQr {
    /// For `m` constraints on `n` coordinates.
    #[must_use]
    pub fn new(n: usize, m: usize) -> Self {
        Self { qr: PivotedQr::new(n, m), rank: 0, tolerance: RANK_TOLERANCE }
    }

    /// With another relative size of pivots that do not count.
    #[must_use]
    pub fn counting_from(mut self, tolerance: f64) -> Self {
        self.tolerance = tolerance;
        self
    }

    /// Factorizes `Gᵀ`, rows of `G` scaled to unit length, and reads off the rank; returns it.
    pub fn factorize(&mut self, G: &DMatrix<f64>) -> usize {
        let norm = |i: usize| G.row(i).norm();
        self.factorize_scaled(G, |i| if norm(i) > 0.0 { 1.0 / norm(i) } else { 1.0 })
    }

    /// The same, taking rows last that nearly follow from others and may keep a residual
    /// ([`Constraints::allowances`]): as many as the rank that is known are enforced, and what is
    /// left out is among those. The rank read off says nothing.
    pub fn factorize_preferring(&mut self, G: &DMatrix<f64>, allowances: &[f64]) {
        const LAST: f64 = 1e-3;
        if allowances.is_empty() {
            self.factorize(G);
            return;
        }
        self.factorize_scaled(G, |i| {
            let (norm, last) = (G.row(i).norm(), allowances.get(i).is_some_and(|g| *g > 0.0));
            let unit = if norm > 0.0 { 1.0 / norm } else { 1.0 };
            if last { LAST * unit } else { unit }
        });
    }

    /// Factorizes `Gᵀ` with row `i` of `G` multiplied by `scale(i)`, and reads off the rank.
    ///
    /// For matrices in which whole rows may vanish up to round-off, so that their own length says
    /// nothing.
    pub fn factorize_scaled(&mut self, G: &DMatrix<f64>, scale: impl Fn(usize) -> f64) -> usize {
        let (m, n) = G.shape();
        let transposed = self.qr.matrix_mut();
        debug_assert_eq!(transposed.shape(), (n, m));
        for i in 0..m {
            let scale = scale(i);
            for j in 0..n {
                transposed[(j, i)] = scale * G[(i, j)];
            }
        }
        self.qr.factorize();
        let size = n.min(m);
        let counts = |k: &usize| self.pivot_size(*k) > self.tolerance * self.pivot_size(0);
        self.rank = (0..size).take_while(counts).count();
        self.rank
    }

    /// The numerical rank found by the last factorization.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// The last diagonal entry of `R` that counts, relative to the first: near zero next to a
    /// configuration that loses rank.
    #[must_use]
    pub fn smallest(&self) -> f64 {
        match self.rank {
            0 => 1.0,
            rank => self.pivot_size(rank - 1) / self.pivot_size(0),
        }
    }

    /// The constraints in pivot order: the first `rank` are independent, the rest redundant.
    #[must_use]
    pub fn pivots(&self) -> &[usize] {
        self.qr.pivots()
    }

    /// Size of pivot `k`, the diagonal entry `|R_kk|` of the last factorization.
    #[must_use]
    pub fn pivot_size(&self, k: usize) -> f64 {
        self.qr.diagonal(k).abs()
    }

    /// `out ← P`: the last `n − rank` columns of the orthogonal factor, shape `n × (n − rank)`.
    ///
    /// `rank` is the caller's: the generic rank of the system, which a momentary loss must not
    /// change.
    pub fn null_space(&mut self, rank: usize, out: &mut DMatrix<f64>) {
        self.orthogonal_columns(rank, out); // (5)
    }

    /// `out ← Q₁`: an orthonormal basis of `range Gᵀ`, shape `n × rank`.
    pub fn range(&mut self, out: &mut DMatrix<f64>) {
        self.orthogonal_columns(0, out);
    }

    /// Columns `first ..` of the orthogonal factor, as many as `out` has.
    fn orthogonal_columns(&mut self, first: usize, out: &mut DMatrix<f64>) {
        out.fill(0.0);
        for k in 0..out.ncols() {
            out[(first + k, k)] = 1.0;
        }
        self.qr.apply_q(out);
    }
}

/// `P(q)` by QR with orthonormal columns, shape `n × (n − rank)`; `rank` as in
/// [`NullSpaceQr::null_space`]. Allocates: for a look at one configuration.
#[must_use]
pub fn null_space_at(
    constraints: &impl Constraints,
    at: Configuration<'_>,
    rank: usize,
) -> DMatrix<f64> {
    let (n, m) = (constraints.dim(), constraints.len());
    let mut P = DMatrix::identity(n, n - rank);
    if m > 0 {
        let mut G = DMatrix::zeros(m, n);
        constraints.jacobian(at.t, at.q, &mut G);
        let mut qr = NullSpaceQr::new(n, m);
        qr.factorize(&G);
        qr.null_space(rank, &mut P);
    }
    P
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use vi_testkit::Sample;

    fn matrix(m: usize, n: usize, seed: u64) -> DMatrix<f64> {
        Sample::new(seed).matrix(m, n)
    }

    proptest! {
        #[test]
        fn null_space_is_orthonormal_and_annihilated(
            m in 1_usize..9, extra in 0_usize..6, redundant in 0_usize..4, seed in any::<u64>()
        ) {
            let n = m + extra;
            let independent = matrix(m, n, seed);
            // further rows: combinations of the others, in other units
            let mix = matrix(redundant, m, seed ^ 77) * 1e3;
            let mut G = DMatrix::zeros(m + redundant, n);
            G.rows_mut(0, m).copy_from(&independent);
            G.rows_mut(m, redundant).copy_from(&(mix * &independent));
            let mut qr = NullSpaceQr::new(n, m + redundant);
            let rank = qr.factorize(&G);
            prop_assume!(independent.singular_values().min() > 1e-3);
            prop_assert_eq!(rank, m);
            let mut P = DMatrix::zeros(n, n - rank);
            qr.null_space(rank, &mut P);
            let annihilated = (&G * &P).amax() / G.amax();
            let defect = (P.transpose() * &P - DMatrix::identity(n - rank, n - rank)).amax();
            prop_assert!(extra == 0 || annihilated < 1e-13, "|G P| = {annihilated:e}");
            prop_assert!(extra == 0 || defect < 1e-13, "|PᵀP − I| = {defect:e}");
            let mut chosen = DMatrix::zeros(rank, n);
            for (k, &row) in qr.pivots()[..rank].iter().enumerate() {
                chosen.row_mut(k).copy_from(&G.row(row));
            }
            prop_assert_eq!(NullSpaceQr::new(n, rank).factorize(&chosen), rank);
        }
    }
}
