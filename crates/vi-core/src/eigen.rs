//! The symmetric generalized eigenproblem `K x = ω² M x`, accurate where it is soft.
//!
//! ```text
//! M = L Lᵀ,   Lᵀ (K + σM)⁻¹ L y = θ y,   ω² = 1/θ − σ,   x = (L⁻ᵀ y)/√(xᵀMx)
//! ```
//! The usual way, the eigenvalues of `L⁻¹ K L⁻ᵀ`, is wrong by `ε ω_max²`: for slender beams that is
//! more than the lowest `ω²`. The inverse has the soft modes at its upper end and is wrong by
//! `ε (ω² + σ)²/σ`. So the shift comes down, five decades at a time, and every round replaces the
//! modes that are soft beside its shift: those up to `10³ σ`, counted from the lowest; each then is
//! right to `10³ ε` of itself. The last shift is of the size of the seventh mode (a free body has
//! six without stiffness; of small systems the middle one), or of what the rounding of `K` hides.
//! Dense, `O(d³)` for each round; factorizations are faer's.
//!
//! `K + σM` is factorized by Cholesky, whose error does not depend on the scales of the unknowns,
//! and `θ` is then an eigenvalue of `(C⁻¹L)ᵀ(C⁻¹L)`, which has no negative ones. Where it is
//! indefinite a pivoted LU takes its place. Every `ω²` is at last the quotient `xᵀKx/xᵀMx` of its
//! vector: one below zero by more than its noise proves that `K` is indefinite.
//!
//! Source: B. N. Parlett, The Symmetric Eigenvalue Problem, §15, shift and invert.
#![allow(non_snake_case)] // K, M, L, A, T

use crate::linear::Singular;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use nalgebra::DMatrix;

/// Most rounds in which the shift comes down.
const ROUNDS: usize = 6;
/// How far it comes down in one.
const DOWN: f64 = 1e-5;
/// Modes are soft beside a shift up to about this many times its size.
const SOFT: f64 = 1e3;

/// Why there are no eigenvalues.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EigenError {
    /// `M` is not positive definite.
    #[error("the mass matrix is not positive definite")]
    Indefinite,
    /// A matrix holds NaN or infinity, or the iteration did not end.
    #[error("the eigenvalues were not found: a value is not finite, or the iteration did not end")]
    NotFound,
}

impl From<Singular> for EigenError {
    fn from(_: Singular) -> Self {
        Self::NotFound
    }
}

/// Eigenvalues in ascending order with their vectors.
#[derive(Clone, Debug, PartialEq)]
pub struct Eigen {
    /// `ω²`.
    pub squared: Vec<f64>,
    /// How much of each `ω²` may be round-off: in the entries of `K`, `4ε |x|ᵀ|K||x|`, and beside
    /// the shift.
    pub noise: Vec<f64>,
    /// Columns `x` with `xᵀMx = 1`.
    pub vectors: DMatrix<f64>,
    /// `max |Kx − ω²Mx|` over `max |K||x| + |ω²| |M||x|` of the same mode: the largest of all
    /// modes.
    pub residual: f64,
    /// `max |XᵀMX − I|`.
    pub orthogonality: f64,
}

/// All solutions of `K x = ω² M x`; `K` symmetric, `M` symmetric and positive definite. Only the
/// lower triangles count.
///
/// # Errors
/// [`EigenError`].
pub fn generalized_eigen(K: &DMatrix<f64>, M: &DMatrix<f64>) -> Result<Eigen, EigenError> {
    let n = K.nrows();
    if K.iter().chain(M.iter()).any(|x| !x.is_finite()) {
        return Err(EigenError::NotFound);
    }
    if n == 0 {
        let vectors = DMatrix::zeros(0, 0);
        let (squared, noise) = (Vec::new(), Vec::new());
        return Ok(Eigen { squared, noise, vectors, residual: 0.0, orthogonality: 0.0 });
    }
    let (K, M) = (symmetric(K), symmetric(M));
    let cholesky = M.llt(Side::Lower).map_err(|_| EigenError::Indefinite)?;
    let L = cholesky.L().to_owned();
    // the usual way first, for the size of things
    let mut T = K.clone();
    L.as_ref().solve_lower_triangular_in_place(T.as_mut());
    T = T.transpose().to_owned();
    L.as_ref().solve_lower_triangular_in_place(T.as_mut());
    let (values, Y) = symmetric_eigen(&symmetrized(&T))?;
    let largest = values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    let mut found: Vec<RefinedPair> =
        values.iter().enumerate().map(|(k, value)| mode(*value, largest, &Y, k)).collect();
    found.sort_by(|a, b| a.squared.total_cmp(&b.squared));
    let mut sigma = largest;
    for _ in 0..ROUNDS {
        let mut sizes: Vec<f64> = found.iter().map(|mode| mode.squared.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let wanted = 0.37 * sizes[6.min(n / 2)]; // no eigenvalue with its sign turned
        let target = wanted.max(10.0 * entry_noise(&K, &inverse_transposed(&L, &found[..1]), 0));
        if !(sigma > 0.0 && target < 0.9 * sigma) {
            break;
        }
        sigma = target.max(DOWN * sigma);
        let Some(softer) = beside(&K, &M, &L, sigma)? else { continue };
        // both lists ascend, so a mode has the same place in them
        let soft = soft_modes(&softer, sigma);
        for (slot, mode) in found.iter_mut().zip(softer).take(soft) {
            *slot = mode;
        }
    }
    Ok(finish(&K, &M, &L, &found))
}

/// How many eigenvalues of a symmetric matrix are negative, by the signs of the pivots of
/// `A = L B Lᵀ` (Sylvester's law of inertia). Only the lower triangle counts.
#[must_use]
pub fn negative_eigenvalues(A: &DMatrix<f64>) -> usize {
    let factors = symmetric(A).lblt(Side::Lower);
    let (diagonal, below) = (factors.B_diag().column_vector(), factors.B_subdiag().column_vector());
    let (mut count, mut i) = (0, 0);
    while i < A.nrows() {
        // a pivot of order 2 has one of each sign
        let double = i + 1 < A.nrows() && below[i] != 0.0;
        count += usize::from(double || diagonal[i] < 0.0);
        i += 1 + usize::from(double);
    }
    count
}

/// All modes by a shift `σ`, ascending; `None` where `−σ` is an eigenvalue to the last bit.
fn beside(
    K: &Mat<f64>,
    M: &Mat<f64>,
    L: &Mat<f64>,
    sigma: f64,
) -> Result<Option<Vec<RefinedPair>>, EigenError> {
    let n = K.nrows();
    let A = Mat::from_fn(n, n, |i, j| K[(i, j)] + sigma * M[(i, j)]);
    let T = match A.llt(Side::Lower) {
        Ok(cholesky) => {
            let mut X = L.clone();
            cholesky.L().solve_lower_triangular_in_place(X.as_mut());
            X.transpose() * &X
        }
        Err(_) => symmetrized(&(L.transpose() * A.partial_piv_lu().solve(L))),
    };
    if (0..n).any(|i| !T[(i, i)].is_finite()) {
        return Ok(None);
    }
    let (theta, Y) = symmetric_eigen(&T)?;
    let largest = theta.iter().fold(0.0_f64, |largest, theta| largest.max(theta.abs()));
    let squared = |theta: f64| {
        let stiff = theta.abs() <= f64::EPSILON * n as f64 * largest;
        if stiff { f64::INFINITY } else { 1.0 / theta - sigma }
    };
    let mut modes: Vec<RefinedPair> =
        theta.iter().enumerate().map(|(k, theta)| mode(squared(*theta), sigma, &Y, k)).collect();
    modes.sort_by(|a, b| a.squared.total_cmp(&b.squared));
    Ok(Some(modes))
}

/// Columns `x = L⁻ᵀ y`.
fn inverse_transposed(L: &Mat<f64>, found: &[RefinedPair]) -> Mat<f64> {
    let mut x = Mat::from_fn(L.nrows(), found.len(), |i, k| found[k].y[i]);
    L.as_ref().transpose().solve_upper_triangular_in_place(x.as_mut());
    x
}

/// `4ε |x|ᵀ|K||x|` of column `k`: what the rounding of the entries of `K` may change `ω²` by.
fn entry_noise(K: &Mat<f64>, x: &Mat<f64>, k: usize) -> f64 {
    let n = K.nrows();
    let row = |i: usize| (0..n).map(|j| K[(i, j)].abs() * x[(j, k)].abs()).sum::<f64>();
    4.0 * f64::EPSILON * (0..n).map(|i| x[(i, k)].abs() * row(i)).sum::<f64>()
}

/// `ω²`, the shift it was found with, and `y`.
struct RefinedPair {
    squared: f64,
    sigma: f64,
    y: Vec<f64>,
}

fn mode(squared: f64, sigma: f64, Y: &Mat<f64>, k: usize) -> RefinedPair {
    RefinedPair { squared, sigma, y: (0..Y.nrows()).map(|i| Y[(i, k)]).collect() }
}

/// Eigenvalues and vectors of a symmetric matrix with a residual of the size of round-off.
///
/// The divide-and-conquer method of faer 0.24 is fast; on clustered spectra its residual was found
/// to be `10¹² ε |T|`. It is therefore checked, and the implicit QR method of nalgebra takes over
/// where it is too large.
fn symmetric_eigen(T: &Mat<f64>) -> Result<(Vec<f64>, Mat<f64>), EigenError> {
    let n = T.nrows();
    let found = T.self_adjoint_eigen(Side::Lower).map_err(|_| EigenError::NotFound)?;
    let values: Vec<f64> = (0..n).map(|k| found.S()[k]).collect();
    let Y = found.U().to_owned();
    let TY = T * &Y;
    let entries = (0..n).flat_map(|k| (0..n).map(move |i| (i, k)));
    let residual = largest(entries.map(|(i, k)| TY[(i, k)] - values[k] * Y[(i, k)]));
    if residual <= 100.0 * f64::EPSILON * n as f64 * largest(values.iter().copied()) {
        return Ok((values, Y));
    }
    let eigen = DMatrix::from_fn(n, n, |i, j| T[(i, j)])
        .try_symmetric_eigen(f64::EPSILON, 100 * n.max(10))
        .ok_or(EigenError::NotFound)?;
    let values = eigen.eigenvalues.iter().copied().collect();
    Ok((values, Mat::from_fn(n, n, |i, k| eigen.eigenvectors[(i, k)])))
}

/// How many of the modes, in ascending order, are soft beside `σ`: up to the widest gap near the
/// border.
fn soft_modes(found: &[RefinedPair], sigma: f64) -> usize {
    let border = SOFT * sigma;
    let gap = |k: usize| found[k].squared / found[k - 1].squared.abs().max(f64::MIN_POSITIVE);
    let near = |k: &usize| {
        let (below, above) = (found[k - 1].squared, found[*k].squared);
        below <= 10.0 * border && above >= 0.1 * border
    };
    let widest = (1..found.len()).filter(near).max_by(|a, b| gap(*a).total_cmp(&gap(*b)));
    widest.unwrap_or_else(|| found.iter().filter(|mode| mode.squared <= border).count())
}

/// With `x = L⁻ᵀ y` and `ω² = xᵀKx`, in ascending order; the rounding of `K` alone is left in `ω²`.
fn finish(K: &Mat<f64>, M: &Mat<f64>, L: &Mat<f64>, found: &[RefinedPair]) -> Eigen {
    let n = K.nrows();
    let x = inverse_transposed(L, found);
    let (Kx, Mx) = (K * &x, M * &x);
    let quotient = |k: usize| (0..n).map(|i| x[(i, k)] * Kx[(i, k)]).sum();
    let squared: Vec<f64> = (0..n).map(quotient).collect();
    let noise = |k: usize| {
        let shift = found[k].sigma + squared[k].abs();
        entry_noise(K, &x, k) + f64::EPSILON * n as f64 * shift
    };
    let gram = x.transpose() * &Mx;
    let unit = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
    let entries = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
    let orthogonality = largest(entries.map(|(i, j)| gram[(i, j)] - unit(i, j)));
    let residual = |k: usize| {
        let size = |i: usize| {
            let entry = |j: usize| K[(i, j)].abs() + (squared[k] * M[(i, j)]).abs();
            (0..n).map(|j| entry(j) * x[(j, k)].abs()).sum::<f64>()
        };
        let left = largest((0..n).map(|i| Kx[(i, k)] - squared[k] * Mx[(i, k)]));
        left / largest((0..n).map(size)).max(f64::MIN_POSITIVE)
    };
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| squared[i].total_cmp(&squared[j]));
    Eigen {
        residual: largest((0..n).map(residual)),
        orthogonality,
        noise: order.iter().map(|&k| noise(k)).collect(),
        squared: order.iter().map(|&k| squared[k]).collect(),
        vectors: DMatrix::from_fn(n, n, |i, k| x[(i, order[k])]),
    }
}

/// The largest size; NaN where one is NaN.
pub(crate) fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |max, x| if x.abs() > max || x.is_nan() { x.abs() } else { max })
}

fn symmetric(A: &DMatrix<f64>) -> Mat<f64> {
    Mat::from_fn(A.nrows(), A.nrows(), |i, j| A[(i.max(j), i.min(j))])
}

fn symmetrized(A: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(A.nrows(), A.nrows(), |i, j| 0.5 * (A[(i, j)] + A[(j, i)]))
}
