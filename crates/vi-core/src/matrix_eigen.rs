//! The eigenvalues of a matrix that is not symmetric, `A x = λ x`, those that are zero apart.
//!
//! ```text
//! D⁻¹ A D                          D: powers of two, rows and columns alike in size
//! A Q = [A Q_c, 0],  A ← Q_cᵀ A Q_c      as long as A has a null space: zero eigenvalues, with chains
//! (A − λ) u = x,  λ ← λ + xᴴx/xᴴu        refinement of each pair that is asked for
//! ```
//! Motions of a free system have eigenvalues of zero in chains, a velocity with the position that
//! grows by it: rounding would spread such a cluster over the root of `ε`. Dense, `O(n³)`.
//!
//! Source: G. H. Golub, J. H. Wilkinson, SIAM Rev. 18 (1976) 578–619 (null spaces one after the
//! other); B. N. Parlett, C. Reinsch, Numer. Math. 13 (1969) 293–304 (balancing).
#![allow(non_snake_case)] // A, D, Q

use crate::eigen::{EigenError, largest};
use faer::Mat;
use nalgebra::{Complex, DMatrix, DVector};

/// Singular values below this part of the largest are zero.
const ZERO: f64 = 1e-12;
/// Rounds of balancing at most.
const ROUNDS: usize = 40;
/// Scales of balancing at most, and their inverse at least: what is zero but for rounding is no
/// size to balance by.
const SCALE: f64 = 4096.0;
/// Steps of inverse iteration.
const REFINEMENTS: usize = 6;

/// `x e^{λt}`.
#[derive(Clone, Debug, PartialEq)]
pub struct EigenPair {
    /// `λ`; of a conjugate pair the one with `Im λ > 0`.
    pub value: Complex<f64>,
    /// `x`, of the length 1 where it is balanced.
    pub vector: DVector<Complex<f64>>,
    /// `|(A − λ) x|` relative to the size of its terms.
    pub residual: f64,
}

/// All eigenvalues of a matrix.
#[derive(Clone, Debug)]
pub struct MatrixEigen {
    balanced: DMatrix<f64>,
    scale: Vec<f64>, // D
    kernel: DMatrix<f64>,
    values: Vec<Complex<f64>>,
}

impl MatrixEigen {
    /// Of a square matrix.
    ///
    /// # Errors
    /// [`EigenError::NotFound`].
    pub fn new(A: &DMatrix<f64>) -> Result<Self, EigenError> {
        if A.iter().any(|a| !a.is_finite()) {
            return Err(EigenError::NotFound);
        }
        let (balanced, scale) = balance(A);
        let (rest, kernel) = without_zeros(&balanced)?;
        let values = nonzero(&rest)?;
        Ok(Self { balanced, scale, kernel, values })
    }

    /// All eigenvalues with `Im λ ≥ 0` but those that are zero, in no order.
    #[must_use]
    pub fn values(&self) -> &[Complex<f64>] {
        &self.values
    }

    /// Columns that span the null space.
    #[must_use]
    pub fn kernel(&self) -> DMatrix<f64> {
        let mut kernel = self.kernel.clone();
        for (mut row, scale) in kernel.row_iter_mut().zip(&self.scale) {
            row *= *scale;
        }
        kernel
    }

    /// The pair of the `k`-th of [`MatrixEigen::values`], refined.
    #[must_use]
    pub fn pair(&self, k: usize) -> EigenPair {
        let (n, mut value) = (self.scale.len(), self.values[k]);
        let start = |i: usize| 0.5 + (1.0 + i as f64).sqrt().fract(); // in no symmetry
        let mut x = DVector::from_fn(n, |i, _| Complex::new(start(i), 0.0));
        let mut best: Option<EigenPair> = None;
        for _ in 0..REFINEMENTS {
            let Some((next, vector)) = self.refined(value, &x, best.is_some()) else { break };
            let residual = self.residual(next, &vector);
            let better = best.as_ref().is_none_or(|best| residual < best.residual);
            if !better {
                break;
            }
            (value, x) = (next, vector.clone());
            best = Some(EigenPair { value, vector, residual });
        }
        let mut pair = best.unwrap_or(EigenPair { value, vector: x, residual: f64::NAN });
        pair.vector.iter_mut().zip(&self.scale).for_each(|(x, scale)| *x *= *scale);
        pair
    }

    /// A step of inverse iteration, beside the value by round-off where the matrix is singular.
    fn refined(
        &self,
        value: Complex<f64>,
        x: &DVector<Complex<f64>>,
        corrects: bool,
    ) -> Option<(Complex<f64>, DVector<Complex<f64>>)> {
        let size = value.norm().max(f64::EPSILON * largest(self.balanced.iter().map(|a| a.abs())));
        [0.0, 1e-13, 1e-10].into_iter().find_map(|aside| {
            let near = value + aside * size;
            let n = x.len();
            let entry = |i: usize, j: usize| {
                let own = if i == j { near } else { Complex::default() };
                Complex::new(self.balanced[(i, j)], 0.0) - own
            };
            let u = DMatrix::from_fn(n, n, entry).lu().solve(x)?;
            let next = if corrects { near + x.dotc(x) / x.dotc(&u) } else { value };
            let norm = u.norm();
            let usable =
                norm.is_finite() && norm > 0.0 && next.re.is_finite() && next.im.is_finite();
            usable.then(|| (next, u.unscale(norm)))
        })
    }

    fn residual(&self, value: Complex<f64>, x: &DVector<Complex<f64>>) -> f64 {
        let parts = [x.map(|x| x.re), x.map(|x| x.im)];
        let [re, im] = parts.map(|x| &self.balanced * x);
        let left = re.zip_map(&im, Complex::new) - x * value;
        let sizes = x.map(|x| x.norm());
        let size = (self.balanced.abs() * &sizes).amax() + value.norm() * sizes.amax();
        largest(left.iter().map(|x| x.norm())) / size.max(f64::MIN_POSITIVE)
    }
}

/// `D⁻¹ A D` and `D`.
fn balance(A: &DMatrix<f64>) -> (DMatrix<f64>, Vec<f64>) {
    let (n, mut A) = (A.nrows(), A.clone());
    let mut scale = vec![1.0; n];
    for _ in 0..ROUNDS {
        let mut changed = false;
        for i in 0..n {
            let others = || (0..n).filter(|j| *j != i);
            let row: f64 = others().map(|j| A[(i, j)].abs()).sum();
            let column: f64 = others().map(|j| A[(j, i)].abs()).sum();
            if row == 0.0 || column == 0.0 {
                continue;
            }
            let mut factor = 1.0; // of the column
            while column * factor * 2.0 < row / factor {
                factor *= 2.0;
            }
            while column * factor > 2.0 * row / factor {
                factor *= 0.5;
            }
            factor = (scale[i] * factor).clamp(1.0 / SCALE, SCALE) / scale[i];
            // powers of two: what is not 1 is 1/2 or 2 at least
            if !(0.75..1.5).contains(&factor) {
                changed = true;
                scale[i] *= factor;
                (0..n).for_each(|j| A[(j, i)] *= factor);
                (0..n).for_each(|j| A[(i, j)] /= factor);
            }
        }
        if !changed {
            break;
        }
    }
    (A, scale)
}

/// The matrix without its eigenvalues of zero, and columns that span its null space.
fn without_zeros(A: &DMatrix<f64>) -> Result<(DMatrix<f64>, DMatrix<f64>), EigenError> {
    let n = A.nrows();
    let (mut rest, mut kernel) = (A.clone(), DMatrix::zeros(n, 0));
    let mut floor = None;
    while !rest.is_empty() {
        let svd = rest.clone().svd(false, true);
        let floor = *floor.get_or_insert(ZERO * svd.singular_values.amax());
        let right = svd.v_t.ok_or(EigenError::NotFound)?;
        let (zeros, others): (Vec<usize>, Vec<usize>) =
            (0..rest.nrows()).partition(|&k| svd.singular_values[k] <= floor);
        if zeros.is_empty() {
            break;
        }
        if kernel.ncols() == 0 {
            kernel = right.select_rows(&zeros).transpose();
        }
        let kept = right.select_rows(&others); // Q_cᵀ
        rest = &kept * rest * kept.transpose();
    }
    Ok((rest, kernel))
}

/// Eigenvalues with `Im λ ≥ 0`.
fn nonzero(A: &DMatrix<f64>) -> Result<Vec<Complex<f64>>, EigenError> {
    let n = A.nrows();
    if n == 0 {
        return Ok(Vec::new());
    }
    let dense = Mat::from_fn(n, n, |i, j| A[(i, j)]);
    let found = dense.eigenvalues().map_err(|_| EigenError::NotFound)?;
    let values = found.iter().map(|value| Complex::new(value.re, value.im));
    Ok(values.filter(|value| value.im >= 0.0).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block with known eigenvalues in badly scaled coordinates, beside a chain of zeros.
    #[test]
    fn eigenvalues_are_found_beside_chains_of_zeros() {
        let n = 7;
        let mut A = DMatrix::zeros(n, n);
        (A[(0, 1)], A[(1, 2)]) = (1.0, 1.0); // λ³ = 0
        (A[(3, 3)], A[(3, 4)], A[(4, 3)], A[(4, 4)]) = (-0.25, 3.0, -3.0, -0.25);
        (A[(5, 5)], A[(6, 6)], A[(5, 6)]) = (2.0, -1e-3, 40.0);
        // similar by a dense matrix and by scales
        let mix = DMatrix::from_fn(n, n, |i, j| {
            let own = if i == j { 2.0 } else { 0.0 };
            own + (1.0 + (3 * i + j) as f64).sqrt().fract()
        });
        let inverse = mix.clone().try_inverse().unwrap();
        let mut B = &mix * A * inverse;
        let scales: Vec<f64> = (0..n).map(|k| 10.0_f64.powi(2 * k as i32 - 6)).collect();
        for i in 0..n {
            (0..n).for_each(|j| B[(i, j)] *= scales[i] / scales[j]);
        }
        let found = MatrixEigen::new(&B).unwrap();
        assert_eq!(found.kernel().ncols(), 1);
        let mut values: Vec<EigenPair> = (0..found.values().len()).map(|k| found.pair(k)).collect();
        values.sort_by(|a, b| a.value.re.total_cmp(&b.value.re));
        println!("{:?}", values.iter().map(|pair| (pair.value, pair.residual)).collect::<Vec<_>>());
        let expected = [(-0.25, 3.0), (-1e-3, 0.0), (2.0, 0.0)];
        assert_eq!(values.len(), expected.len());
        for (pair, (re, im)) in values.iter().zip(expected) {
            assert!((pair.value - Complex::new(re, im)).norm() < 1e-11, "{}", pair.value);
            assert!(pair.residual < 1e-13);
        }
    }
}
