//! The quadratic eigenproblem `(λ² M + λ C + K) x = 0` of damped and gyroscopic vibrations.
//!
//! ```text
//! x = X y,  Xᵀ M X = I,  Xᵀ K_s X = Λ          undamped modes, K_s = ½ (K + Kᵀ)
//! d/dt [S y; ẏ] = A [S y; ẏ],   A = [ 0, S;  −(Λ + N) S⁻¹, −D ]        S = √|Λ|,  D = XᵀCX,  N = Xᵀ (K − K_s) X
//! (A − σ)⁻¹ z = θ z,   λ = σ + 1/θ
//! ```
//! In these coordinates `λ` is wrong by `ε |λ|²/σ`, whereas the companion form is wrong by
//! `ε ω_max²/ω`, and by the rate of the fastest decay. Every pair asked for is then refined by
//! inverse iteration. Dense, `O(d³)`.
//!
//! Source: F. Tisseur, K. Meerbergen, SIAM Rev. 43 (2001) 235–286; A. Ruhe, SIAM J. Numer. Anal. 10
//! (1973) 674–689.
#![allow(non_snake_case)] // K, C, M, X, D, N, S

use crate::eigen::{Eigen, EigenError, generalized_eigen, largest};
use faer::Mat;
use faer::linalg::solvers::Solve;
use nalgebra::{Complex, DMatrix, DVector};

/// Steps of inverse iteration.
const REFINEMENTS: usize = 4;

/// A solution `x e^{λt}`.
#[derive(Clone, Debug, PartialEq)]
pub struct QuadraticPair {
    /// `λ`, 1/s; of a conjugate pair the one with `Im λ > 0`.
    pub value: Complex<f64>,
    /// `x` with `xᴴ M x = 1`.
    pub vector: DVector<Complex<f64>>,
    /// `|(λ² M + λ C + K) x|` relative to the size of its terms.
    pub residual: f64,
}

/// All eigenvalues, and what refines them.
#[derive(Clone, Debug)]
pub struct QuadraticEigen {
    matrices: [DMatrix<f64>; 3], // K, C, M
    basis: Eigen,
    modal: [DMatrix<f64>; 2],                          // XᵀKX, XᵀCX
    found: Vec<(Complex<f64>, DVector<Complex<f64>>)>, // λ, y
}

impl QuadraticEigen {
    /// `K`, `C`, `M`: shape `d × d`, `M` symmetric and positive definite.
    ///
    /// # Errors
    /// [`EigenError`].
    pub fn new(K: &DMatrix<f64>, C: &DMatrix<f64>, M: &DMatrix<f64>) -> Result<Self, EigenError> {
        if C.iter().any(|c| !c.is_finite()) {
            return Err(EigenError::NotFound);
        }
        let basis = generalized_eigen(&(0.5 * (K + K.transpose())), M)?;
        let (d, X) = (K.nrows(), &basis.vectors);
        let mut stiffness = X.tr_mul(&(0.5 * (K - K.transpose()) * X)); // N
        (0..d).for_each(|i| stiffness[(i, i)] += basis.squared[i]);
        let damping = X.tr_mul(&(C * X));
        let found = first_order(&stiffness, &damping, &basis)?;
        let matrices = [K.clone(), C.clone(), M.clone()];
        Ok(Self { matrices, basis, modal: [stiffness, damping], found })
    }

    /// The undamped modes of the symmetric part of `K`.
    #[must_use]
    pub fn undamped(&self) -> &Eigen {
        &self.basis
    }

    /// All eigenvalues with `Im λ ≥ 0`, 1/s, in no order.
    #[must_use]
    pub fn values(&self) -> Vec<Complex<f64>> {
        self.found.iter().map(|(value, _)| *value).collect()
    }

    /// `|y| = 1` of the `k`-th of [`QuadraticEigen::values`], in the undamped modes.
    #[must_use]
    pub fn modal_shape(&self, k: usize) -> &DVector<Complex<f64>> {
        &self.found[k].1
    }

    /// The pair of the `k`-th of [`QuadraticEigen::values`], refined.
    #[must_use]
    pub fn pair(&self, k: usize) -> QuadraticPair {
        let (mut value, mut y) = self.found[k].clone();
        let mut best = self.judged(value, &y);
        for _ in 0..REFINEMENTS {
            let Some((next, vector)) = self.refined(value, &y) else { break };
            let pair = self.judged(next, &vector);
            let better = pair.residual < best.residual; // false for NaN
            if !better {
                break;
            }
            (value, y, best) = (next, vector, pair);
        }
        best
    }

    /// A step of inverse iteration: `Q(λ) u = Q'(λ) y`, `λ − (yᴴy)/(yᴴu)`.
    fn refined(
        &self,
        value: Complex<f64>,
        y: &DVector<Complex<f64>>,
    ) -> Option<(Complex<f64>, DVector<Complex<f64>>)> {
        let ([K, C], d) = (&self.modal, y.len());
        let entry = |i: usize, j: usize| {
            let square = if i == j { value * value } else { Complex::default() };
            square + value * C[(i, j)] + K[(i, j)]
        };
        let slope = y * (2.0 * value) + C.map(|c| Complex::new(c, 0.0)) * y;
        let u = DMatrix::from_fn(d, d, entry).lu().solve(&slope)?;
        let next = value - y.dotc(y) / y.dotc(&u);
        let size = u.norm();
        let usable = size.is_finite() && size > 0.0 && next.re.is_finite() && next.im.is_finite();
        usable.then(|| (next, u / Complex::new(size, 0.0)))
    }

    /// `(λ, Xy)` with what is left of the equation.
    fn judged(&self, value: Complex<f64>, y: &DVector<Complex<f64>>) -> QuadraticPair {
        let [K, C, M] = &self.matrices;
        let complex = |A: &DMatrix<f64>, x: &DVector<Complex<f64>>| {
            let (re, im) = (A * x.map(|x| x.re), A * x.map(|x| x.im));
            re.zip_map(&im, Complex::new)
        };
        let x = complex(&self.basis.vectors, y);
        let scale = x.dotc(&complex(M, &x)).re.sqrt();
        let x = x.unscale(scale);
        let (Kx, Cx, Mx) = (complex(K, &x), complex(C, &x), complex(M, &x));
        let left = &Kx + &Cx * value + &Mx * (value * value);
        let sizes = x.map(|x| x.norm());
        let weighted = |A: &DMatrix<f64>| A.abs() * &sizes;
        let (k, c, m) = (weighted(K), weighted(C) * value.norm(), weighted(M) * value.norm_sqr());
        let size = (k + c + m).amax().max(f64::MIN_POSITIVE);
        let residual = largest(left.iter().map(|x| x.norm())) / size;
        QuadraticPair { value, vector: x, residual }
    }
}

/// Eigenvalues with `Im λ ≥ 0` and their `y`, from `(A − σ)⁻¹` of the matrix of first order.
fn first_order(
    stiffness: &DMatrix<f64>,
    damping: &DMatrix<f64>,
    basis: &Eigen,
) -> Result<Vec<(Complex<f64>, DVector<Complex<f64>>)>, EigenError> {
    let d = stiffness.nrows();
    let mut sizes: Vec<f64> = basis.squared.iter().map(|square| square.abs().sqrt()).collect();
    sizes.sort_by(f64::total_cmp);
    let soft = sizes.get(6.min(d / 2)).copied().unwrap_or(0.0).max(damping.amax().min(1.0));
    let floor = if soft > 0.0 { soft } else { 1.0 };
    let sigma = 0.73 * floor;
    let S: Vec<f64> = basis.squared.iter().map(|square| square.abs().sqrt().max(floor)).collect();
    let unit = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
    let Q = Mat::from_fn(d, d, |i, j| {
        sigma * sigma * unit(i, j) + sigma * damping[(i, j)] + stiffness[(i, j)]
    });
    // x = −Q⁻¹ (b + (D + σ) S⁻¹ a),  y = σ x + S⁻¹ a
    let right = Mat::from_fn(d, 2 * d, |i, j| match j.checked_sub(d) {
        Some(j) => -unit(i, j),
        None => -(damping[(i, j)] + sigma * unit(i, j)) / S[j],
    });
    let x = Q.partial_piv_lu().solve(&right);
    let A = Mat::from_fn(2 * d, 2 * d, |i, j| match i.checked_sub(d) {
        None => S[i] * x[(i, j)],
        Some(i) => sigma * x[(i, j)] + unit(i, j) / S[i],
    });
    if (0..2 * d).any(|j| (0..2 * d).any(|i| !A[(i, j)].is_finite())) {
        return Err(EigenError::NotFound);
    }
    let eigen = A.eigen().map_err(|_| EigenError::NotFound)?;
    let (inverses, vectors) = (eigen.S(), eigen.U());
    let mut found = Vec::new();
    for k in 0..2 * d {
        let value = Complex::new(inverses[k].re, inverses[k].im).inv() + sigma;
        if !(value.re.is_finite() && value.im.is_finite()) {
            return Err(EigenError::NotFound);
        }
        if value.im < 0.0 {
            continue;
        }
        let y = DVector::from_fn(d, |i, _| {
            let z = vectors[(i, k)];
            Complex::new(z.re, z.im) / S[i]
        });
        let norm = y.norm();
        let unit = if norm > 0.0 { y.unscale(norm) } else { y };
        found.push((value, unit));
    }
    Ok(found)
}
