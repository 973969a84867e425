//! Redundant constraints: independence of rows, multipliers of the least norm where rank is about
//! to be lost.
//!
//! ```text
//! [ I   G_sᵀ ] [x]   [0]
//! [ G_s  0   ] [c] = [b]          scattered b of size one: x estimates 1/σ_min(G_s)
//! Gᵀ = Σ u_k σ_k v_kᵀ,   λ ← Σ_{k ≤ r} v_k u_kᵀ w/σ_k           force w, or what is next to it; the least norm
//! ```
#![allow(non_snake_case)] // G

use crate::least_norm::LeastNorm;
use crate::null_space::NullSpaceQr;
use crate::saddle_point::IndependentRows;
use nalgebra::{DMatrix, DVectorView};
use vi_core::linear::{SparseLu, norm_inf};
use vi_core::sparse::{Entries, SparseMatrix};

/// Largest estimate of the condition number of rows with which they are trusted.
const LARGEST: f64 = 1e6;

/// Number `i` of a fixed sequence in `[−1, 1]` without a pattern: a vector of them has a part in
/// every direction.
#[must_use]
pub fn scattered(i: usize) -> f64 {
    libm::sin(13.7 * ((i + 1) * (i + 1)) as f64)
}

/// Whether all rows are clearly independent.
pub(crate) fn are_independent(jacobian: &SparseMatrix) -> bool {
    let (r, n) = jacobian.shape();
    let matrix = SparseMatrix::assemble(n + r, n + r, |out: &mut dyn Entries| {
        (0..n).for_each(|i| out.add(i, i, 1.0));
        jacobian.for_each(|i, j, value| {
            out.add(j, n + i, value);
            out.add(n + i, j, value);
        });
    });
    let mut x = vec![0.0; n + r];
    (0..r).for_each(|k| x[n + k] = scattered(k));
    let size = norm_inf(&x);
    let solved = SparseLu::new(&matrix).and_then(|mut lu| lu.solve(&matrix, &mut x));
    solved.is_ok() && norm_inf(&x[..n]) * size <= LARGEST
}

/// The multipliers of the least norm with the same `force`, `Gᵀλ`; `least` keeps its memory for the
/// next call.
pub fn minimum_norm(
    least: &mut LeastNorm,
    jacobian: &SparseMatrix,
    rows: &IndependentRows,
    force: &[f64],
    lambda: &mut [f64],
) {
    if rows.len() < lambda.len() {
        least_multipliers(least, jacobian, rows.len(), force, lambda);
    }
}

/// The multipliers of the least norm with this `force`, `Gᵀλ`, where `rank` rows are independent.
pub fn least_multipliers(
    least: &mut LeastNorm,
    jacobian: &SparseMatrix,
    rank: usize,
    force: &[f64],
    lambda: &mut [f64],
) {
    if least.solve(jacobian, force, lambda).is_err() {
        dense_minimum_norm(jacobian, rank, force, lambda);
    }
}

/// `R G C` with rows and columns of length one, all but: of the same rank, whatever the units of
/// rows and coordinates.
fn equilibrated(G: &DMatrix<f64>) -> DMatrix<f64> {
    const SWEEPS: usize = 5;
    let mut scaled = G.clone();
    for _ in 0..SWEEPS {
        for mut column in scaled.column_iter_mut() {
            let norm = column.norm();
            if norm > 0.0 {
                column /= norm;
            }
        }
        for mut row in scaled.row_iter_mut() {
            let norm = row.norm();
            if norm > 0.0 {
                row /= norm;
            }
        }
    }
    scaled
}

/// The same by singular values: as many as there are independent rows, here no more than `rank`.
/// What `force` has outside the range of `Gᵀ` is left out, as where a configuration has lost rank.
fn dense_minimum_norm(jacobian: &SparseMatrix, rank: usize, force: &[f64], lambda: &mut [f64]) {
    let G = jacobian.to_dense();
    let rank = NullSpaceQr::new(G.ncols(), G.nrows()).factorize(&equilibrated(&G)).min(rank);
    let rounds = 100 * lambda.len();
    let Some(svd) = G.transpose().try_svd(true, true, f64::EPSILON, rounds) else { return };
    let (Some(u), Some(v)) = (svd.u, svd.v_t) else { return };
    lambda.fill(0.0);
    for k in 0..rank {
        let part = u.column(k).dot(&DVectorView::from_slice(force, force.len()));
        let factor = part / svd.singular_values[k];
        lambda.iter_mut().zip(&v.row(k)).for_each(|(lambda, v)| *lambda += factor * v);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

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
        let sparse = |rows: usize| {
            SparseMatrix::assemble(rows, n, |out: &mut dyn Entries| {
                (0..rows).for_each(|i| (0..n).for_each(|j| out.add(i, j, dense[(i, j)])));
            })
        };
        let (g, rows) =
            (sparse(m), IndependentRows::choose(m, &(0..independent).collect::<Vec<_>>()));
        let lambda = DVector::from_fn(m, |_, _| next());
        let force = dense.tr_mul(&lambda);
        let (mut found, mut full) = ([0.0; 13], [0.0; 13]);
        minimum_norm(&mut LeastNorm::default(), &g, &rows, force.as_slice(), &mut found);
        dense_minimum_norm(&g, independent, force.as_slice(), &mut full);
        let apart = found.iter().zip(&full).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let missed = (dense.tr_mul(&DVector::from_column_slice(&found)) - force).amax();
        println!("largest difference {apart:e}, force missed by {missed:e}");
        assert!(apart < 1e-12 && missed < 1e-13);
        assert!(are_independent(&sparse(independent)) && !are_independent(&g));
    }

    /// The rank of rows that differ by 1e8 along columns that differ by 1e8, as of lengths in other
    /// units.
    #[test]
    fn the_rank_of_rows_does_not_depend_on_units() {
        let (n, m, independent) = (9, 8, 6);
        let mut count = 0.0_f64;
        let mut next = || {
            count += 1.0;
            (13.7 * count * count).sin()
        };
        let rows = DMatrix::from_fn(independent, n, |_, _| next());
        let all = DMatrix::from_fn(m, independent, |i, k| match i.checked_sub(independent) {
            None => f64::from(u8::from(i == k)),
            Some(_) => next(),
        }) * rows;
        for unit in [1e-8_f64, 1e-4, 1.0, 1e4, 1e8] {
            let scale = |k: usize| if k.is_multiple_of(3) { unit } else { 1.0 };
            let scaled = DMatrix::from_fn(m, n, |i, j| scale(i) * all[(i, j)] * scale(j + 1));
            let rank = NullSpaceQr::new(n, m).factorize(&equilibrated(&scaled));
            println!("{unit:e}: {rank}");
            assert_eq!(rank, independent, "{unit:e}");
        }
    }
}
