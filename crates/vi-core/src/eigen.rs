//! The symmetric generalized eigenproblem `K x = ω² M x`, accurate where it is soft.
//!
//! ```text
//! M = L Lᵀ,   Lᵀ (K + σM)⁻¹ L y = θ y,   ω² = 1/θ − σ,   x = (L⁻ᵀ y)/√(xᵀMx)
//! ```
//! The usual way, the eigenvalues of `L⁻¹ K L⁻ᵀ`, is wrong by `ε ω_max²`: for slender beams that is more than the
//! lowest `ω²`. The inverse has the soft modes at its upper end and is wrong by `ε (ω² + σ)²/σ`. So the
//! shift comes down, in one round where the usual way resolves the mode it aims at, else five decades at a
//! time, and every round replaces the modes that are soft beside its shift; the last shift is of the size of the
//! seventh mode (a free body has six without stiffness; of small systems the middle one). Dense, `O(d³)`
//! for each round; factorizations are faer's.
//!
//! Source: B. N. Parlett, The Symmetric Eigenvalue Problem, §15, shift and invert.
#![allow(non_snake_case)] // K, M, L, A, T

use crate::linear::Singular;
use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef, Side};
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
    /// How much of each `ω²` may be round-off: in the entries of `K`, `4ε |x|ᵀ|K||x|`, and beside the shift.
    pub noise: Vec<f64>,
    /// Columns `x` with `xᵀMx = 1`.
    pub vectors: DMatrix<f64>,
}

/// All solutions of `K x = ω² M x`; `K` symmetric, `M` symmetric and positive definite. Only the lower
/// triangles count.
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
        return Ok(Eigen { squared: Vec::new(), noise: Vec::new(), vectors });
    }
    let (K, M) = (symmetric(K), symmetric(M));
    let cholesky = M.llt(Side::Lower).map_err(|_| EigenError::Indefinite)?;
    let L = cholesky.L().to_owned();
    // the usual way first, for the size of things
    let mut T = K.clone();
    L.as_ref().solve_lower_triangular_in_place(T.as_mut());
    T = T.transpose().to_owned();
    L.as_ref().solve_lower_triangular_in_place(T.as_mut());
    let rough =
        symmetrized(&T).self_adjoint_eigen(Side::Lower).map_err(|_| EigenError::NotFound)?;
    let largest = (0..n).map(|k| rough.S()[k].abs()).fold(0.0, f64::max);
    let mut found: Vec<Mode> = (0..n).map(|k| mode(rough.S()[k], largest, rough.U(), k)).collect();
    found.sort_by(|a, b| a.squared.abs().total_cmp(&b.squared.abs()));
    let size = |found: &[Mode], k: usize| found[k].squared.abs();
    let mut sigma = largest;
    for _ in 0..ROUNDS {
        let wanted = 0.37 * size(&found, 6.min(n / 2)); // no eigenvalue with its sign turned
        if !(sigma > 0.0 && wanted < 0.9 * sigma) {
            break;
        }
        let resolved = 10.0 * f64::EPSILON * n as f64 * sigma;
        sigma = if wanted > resolved { wanted } else { DOWN * sigma };
        let A = Mat::from_fn(n, n, |i, j| K[(i, j)] + sigma * M[(i, j)]);
        let T = symmetrized(&(L.transpose() * A.partial_piv_lu().solve(&L)));
        if (0..n).any(|i| !T[(i, i)].is_finite()) {
            continue; // −σ is an eigenvalue to the last bit
        }
        let inverse = T.self_adjoint_eigen(Side::Lower).map_err(|_| EigenError::NotFound)?;
        let theta = inverse.S();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&i, &j| theta[j].abs().total_cmp(&theta[i].abs()));
        for (slot, &k) in order.iter().enumerate().take(soft_modes(&found, sigma)) {
            found[slot] = mode(1.0 / theta[k] - sigma, sigma, inverse.U(), k);
        }
        found.sort_by(|a, b| a.squared.abs().total_cmp(&b.squared.abs()));
    }
    Ok(finish(&K, &L, found))
}

/// `ω²`, the shift it was found with, and `y`.
struct Mode {
    squared: f64,
    sigma: f64,
    y: Vec<f64>,
}

fn mode(squared: f64, sigma: f64, Y: MatRef<'_, f64>, k: usize) -> Mode {
    Mode { squared, sigma, y: (0..Y.nrows()).map(|i| Y[(i, k)]).collect() }
}

/// How many of the modes, softest first, are soft beside `σ`: up to the widest gap near the border.
fn soft_modes(found: &[Mode], sigma: f64) -> usize {
    let size = |k: usize| found[k].squared.abs();
    let near = |k: &usize| {
        let (below, above) = (size(k - 1), size(*k));
        below <= 10.0 * SOFT * sigma && above >= 0.1 * SOFT * sigma
    };
    let gap = |k: &usize| size(*k) / size(k - 1).max(f64::MIN_POSITIVE);
    let widest = (1..found.len()).filter(near).max_by(|a, b| gap(a).total_cmp(&gap(b)));
    widest.unwrap_or(found.len())
}

/// In ascending order, with `x = L⁻ᵀ y`.
fn finish(K: &Mat<f64>, L: &Mat<f64>, mut found: Vec<Mode>) -> Eigen {
    let n = K.nrows();
    found.sort_by(|a, b| a.squared.total_cmp(&b.squared));
    let mut x = Mat::from_fn(n, n, |i, k| found[k].y[i]);
    L.as_ref().transpose().solve_upper_triangular_in_place(x.as_mut());
    let noise = |k: usize| {
        let row = |i: usize| (0..n).map(|j| K[(i, j)].abs() * x[(j, k)].abs()).sum::<f64>();
        let entries = (0..n).map(|i| x[(i, k)].abs() * row(i)).sum::<f64>();
        let shift = found[k].sigma + found[k].squared.abs();
        f64::EPSILON * (4.0 * entries + n as f64 * shift)
    };
    Eigen {
        noise: (0..n).map(noise).collect(),
        squared: found.iter().map(|mode| mode.squared).collect(),
        vectors: DMatrix::from_fn(n, n, |i, k| x[(i, k)]),
    }
}

fn symmetric(A: &DMatrix<f64>) -> Mat<f64> {
    Mat::from_fn(A.nrows(), A.nrows(), |i, j| A[(i.max(j), i.min(j))])
}

fn symmetrized(A: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(A.nrows(), A.nrows(), |i, j| 0.5 * (A[(i, j)] + A[(j, i)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::dmatrix;

    #[test]
    fn a_chain_with_a_free_motion() {
        // three masses 1, 2, 1 on two springs: ω² = 0, k/m, 2k/m
        let K = dmatrix![3.0, -3.0, 0.0; -3.0, 6.0, -3.0; 0.0, -3.0, 3.0];
        let M = dmatrix![1.0, 0.0, 0.0; 0.0, 2.0, 0.0; 0.0, 0.0, 1.0];
        let found = generalized_eigen(&K, &M).unwrap();
        for (k, exact) in [0.0, 3.0, 6.0].into_iter().enumerate() {
            assert!((found.squared[k] - exact).abs() < 1e-14, "{:?}", found.squared);
            let x = found.vectors.column(k);
            assert!((&K * x - exact * &M * x).amax() < 1e-14);
            assert!(((x.transpose() * &M * x)[0] - 1.0).abs() < 1e-14);
            assert!(exact > 0.0 || found.squared[k].abs() <= found.noise[k]);
        }
    }

    #[test]
    fn soft_modes_are_accurate_beside_stiff_ones() {
        // a soft unstable pair seen through a stiff rotation of coordinates
        let exact = [-2e-7, 3e-6, 1.0, 1e12];
        let (c, s) = (0.6, 0.8);
        // exact entries: the stiff direction touches the soft ones by the mass matrix alone
        let M = dmatrix![1.0, 0.0, 0.0, 0.0; 0.0, 1.0, 0.0, 0.0; 0.0, 0.0, 1.0, 0.0; 0.0, 0.0, 0.0, 1e-4];
        let K = dmatrix![
            c * c * exact[0] + s * s * exact[1], c * s * (exact[1] - exact[0]), 0.0, 0.0;
            c * s * (exact[1] - exact[0]), s * s * exact[0] + c * c * exact[1], 0.0, 0.0;
            0.0, 0.0, exact[2], 0.0;
            0.0, 0.0, 0.0, 1e-4 * exact[3]
        ];
        let found = generalized_eigen(&K, &M).unwrap();
        for (k, exact) in exact.into_iter().enumerate().take(3) {
            let error = (found.squared[k] / exact - 1.0).abs();
            assert!(error < 1e-9, "{:?}", found.squared); // ε σ with σ = 0.37, not ε 1e12
        }
    }

    #[test]
    fn what_has_no_eigenvalues_is_refused() {
        let (one, nan) = (dmatrix![1.0], dmatrix![f64::NAN]);
        assert_eq!(generalized_eigen(&nan, &one), Err(EigenError::NotFound));
        assert_eq!(generalized_eigen(&one, &dmatrix![0.0]), Err(EigenError::Indefinite));
        let none = DMatrix::zeros(0, 0);
        assert!(generalized_eigen(&none, &none).unwrap().squared.is_empty());
        let still = generalized_eigen(&dmatrix![0.0], &one).unwrap();
        assert_eq!(still.squared, [0.0]);
    }
}
