//! Redundant constraints: null vectors of `Gᵀ` and multipliers of minimum norm.
//!
//! ```text
//! G_d = C G_s        d: rows that depend on the independent ones, s
//! Z   = (−C, I)ᵀ     over (s, d):  Gᵀ Z = 0,   λ ← λ − Z (ZᵀZ)⁻¹ Zᵀ λ     the same force, the least norm
//! [ I   G_sᵀ ] [x]   [G_dᵀ]
//! [ G_s  0   ] [c] = [ 0  ]          x = 0,  c = Cᵀ                        one sparse factorization for all d
//! ```
//! One more right-hand side, `(0, b)` with scattered `b` of size one, estimates `1/σ_min(G_s)` by its `x`.
//!
//! With few constraints, at a configuration that has lost rank, or where the independent rows no longer
//! are, the same comes from a dense pivoted QR.

use crate::null_space::NullSpaceQr;
use crate::saddle_point::IndependentRows;
use nalgebra::{DMatrix, DVector};
use vi_core::linear::{SparseLu, norm_inf};
use vi_core::sparse::{Entries, SparseMatrix};

/// Largest coefficient of a dependent row in the others, and largest estimate of the condition number
/// of these, with which they are trusted.
const LARGEST: f64 = 1e6;
/// Constraints up to which a dense QR is faster.
pub const DENSE_UP_TO: usize = 200;
/// What may be left of a dependent row, relative to its size.
const LEFT: f64 = 1e-9;

/// Unit columns that span `null Gᵀ`, shape `m × (m − rank)`, from an independent set of the rows;
/// `None` where a dense QR is to find them: with few constraints, or where the rows are not clearly
/// independent.
#[must_use]
pub fn null_vectors(jacobian: &SparseMatrix, rows: &IndependentRows) -> Option<DMatrix<f64>> {
    if jacobian.shape().0 <= DENSE_UP_TO { None } else { sparse_null_vectors(jacobian, rows) }
}

/// The same for any number of constraints.
fn sparse_null_vectors(jacobian: &SparseMatrix, rows: &IndependentRows) -> Option<DMatrix<f64>> {
    let ((m, n), r) = (jacobian.shape(), rows.len());
    let dropped: Vec<usize> = rows.redundant().collect();
    let mut sides = DMatrix::zeros(n + r, dropped.len() + 1);
    let matrix = SparseMatrix::assemble(n + r, n + r, |out: &mut dyn Entries| {
        (0..n).for_each(|i| out.add(i, i, 1.0));
        jacobian.for_each(|i, j, value| match rows.rows().binary_search(&i) {
            Ok(k) => {
                out.add(j, n + k, value);
                out.add(n + k, j, value);
            }
            Err(_) => {
                let column = dropped.binary_search(&i).expect("a row is chosen or redundant");
                sides[(j, column)] = value;
            }
        });
    });
    let size = sides.amax();
    let probe = dropped.len();
    (0..r).for_each(|k| sides[(n + k, probe)] = libm::sin(13.7 * ((k + 1) * (k + 1)) as f64));
    SparseLu::new(&matrix).ok()?.solve(&matrix, sides.as_mut_slice()).ok()?;
    if sides.view((0, probe), (n, 1)).amax() * size > LARGEST {
        return None;
    }
    let mut z = DMatrix::zeros(m, dropped.len());
    for (k, (column, &row)) in sides.column_iter().zip(&dropped).enumerate() {
        let (left, c) = column.as_slice().split_at(n);
        if norm_inf(left) > LEFT * size || norm_inf(c) > LARGEST {
            return None;
        }
        rows.rows().iter().zip(c).for_each(|(&i, c)| z[(i, k)] = -c);
        z[(row, k)] = 1.0;
        let norm = z.column(k).norm();
        z.column_mut(k).unscale_mut(norm);
    }
    Some(z)
}

/// Whether all rows are clearly independent: `1/σ_min` is estimated by the right-hand side `(0, b)`.
pub(crate) fn are_independent(jacobian: &SparseMatrix) -> bool {
    sparse_null_vectors(jacobian, &IndependentRows::all(jacobian.shape().0)).is_some()
}

/// The multipliers of the least norm with the same force `Gᵀλ`.
pub fn minimum_norm(jacobian: &SparseMatrix, rows: &IndependentRows, lambda: &mut [f64]) {
    if rows.len() == lambda.len() {
        return;
    }
    let part = null_vectors(jacobian, rows).and_then(|z| along(&z, lambda));
    match part {
        Some(part) => lambda.iter_mut().zip(part.iter()).for_each(|(l, part)| *l -= part),
        None => dense_minimum_norm(jacobian, rows.len(), lambda),
    }
}

/// `Z (ZᵀZ)⁻¹ Zᵀ λ`.
fn along(z: &DMatrix<f64>, lambda: &[f64]) -> Option<DVector<f64>> {
    let cholesky = z.tr_mul(z).cholesky()?;
    Some(z * cholesky.solve(&z.tr_mul(&DVector::from_column_slice(lambda))))
}

/// The same with the `rank` rows that are most clearly independent here, `G = C G_s`: `λ ← C (CᵀC)⁻¹ Cᵀλ`.
fn dense_minimum_norm(jacobian: &SparseMatrix, rank: usize, lambda: &mut [f64]) {
    let g = jacobian.to_dense();
    let mut qr = NullSpaceQr::new(g.ncols(), g.nrows());
    qr.factorize(&g);
    let chosen = DMatrix::from_fn(rank, g.ncols(), |i, j| g[(qr.pivots()[i], j)]);
    let gram = &chosen * chosen.transpose();
    let Some(cholesky) = gram.cholesky() else { return };
    let c = cholesky.solve(&(&chosen * g.transpose())).transpose(); // G G_sᵀ (G_s G_sᵀ)⁻¹
    let projected = c.transpose() * DVector::from_column_slice(lambda);
    if let Some(cholesky) = (c.transpose() * &c).cholesky() {
        lambda.copy_from_slice((c * cholesky.solve(&projected)).as_slice());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Random rows of which some are combinations of the others.
    #[test]
    fn both_ways_find_the_least_norm_with_the_same_force() {
        let (n, independent, m) = (14, 9, 13);
        let mut count = 0.0_f64;
        let mut next = || {
            count += 1.0;
            (13.7 * count * count).sin()
        };
        let mut dense = DMatrix::zeros(m, n);
        for i in 0..independent {
            (0..n).for_each(|j| dense[(i, j)] = next());
        }
        for i in independent..m {
            let c: [f64; 9] = std::array::from_fn(|_| next());
            (0..n).for_each(|j| dense[(i, j)] = (0..9).map(|k| c[k] * dense[(k, j)]).sum());
        }
        let g = SparseMatrix::assemble(m, n, |out: &mut dyn Entries| {
            (0..m).for_each(|i| (0..n).for_each(|j| out.add(i, j, dense[(i, j)])));
        });
        let rows = IndependentRows::choose(m, &(0..independent).collect::<Vec<_>>());
        let z = sparse_null_vectors(&g, &rows).unwrap();
        assert_eq!(z.ncols(), m - independent);
        assert!((dense.transpose() * &z).amax() < 1e-13);
        let lambda: [f64; 13] = std::array::from_fn(|_| next());
        let (mut sparse, mut full) = (lambda.to_vec(), lambda.to_vec());
        let part = along(&z, &lambda).unwrap();
        sparse.iter_mut().zip(part.iter()).for_each(|(l, part)| *l -= part);
        dense_minimum_norm(&g, independent, &mut full);
        let force = |l: &[f64]| dense.tr_mul(&DVector::from_column_slice(l));
        assert!((force(&lambda) - force(&sparse)).amax() < 1e-13);
        let apart = sparse.iter().zip(&full).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-12, "{apart:e}");
        assert!(sparse_null_vectors(&g, &IndependentRows::choose(m, &[0, 1, 2])).is_none());
        let dependent: Vec<usize> = (4..m).collect(); // 9 of them are independent, but not clearly all
        let dependent = IndependentRows::choose(m, &[dependent, vec![0]].concat());
        assert!(sparse_null_vectors(&g, &dependent).is_none());
    }
}
