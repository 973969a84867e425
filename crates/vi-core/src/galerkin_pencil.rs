//! The matrix of a Galerkin step with stiff forces, made diagonal in the control points.
//!
//! With the mass matrix `A`, the damping matrix `B` and the stiffness matrix `C` in unknowns that
//! see no rigid motion, the matrix of a step is `(1/h) (K̂ ⊗ A − h N̂ ⊗ B − h² Ŝ ⊗ C)`. Gauss
//! quadrature makes one matrix of all three:
//! ```text
//! K̂⁻¹ N̂ = −X,  K̂⁻¹ Ŝ = −X²,     X = D̂⁻¹ Ê,   D̂ = D[·; 1 … s],  Ê = E[·; 1 … s]                    [2.33]
//! X T = T Λ,     Λ of 1×1 blocks α and 2×2 blocks [a, b; −b, a],  α = a ± ib
//! (K̂⁻¹ ⊗ I) (matrix) = (1/h) (T ⊗ I) (I ⊗ A + h Λ ⊗ B + h² Λ² ⊗ C) (T⁻¹ ⊗ I)                         [2.34]
//! ```
//! `X` is similar to the matrix of Gauss collocation. Its eigenvectors are the polynomials with
//! `v(0) = 0` and `v = α v'` at the Gauss nodes: `v = Σ_m α^m P_s^{(m)}` with the Legendre
//! polynomial `P_s` of the step, where `v(0) = 0` is the equation of `α`.
//!
//! Rounding of these numbers changes the ratio of an iteration, never its limit.
#![allow(non_snake_case)] // K, N, S, X, T, A, B, C

use crate::galerkin::GaussLobatto;
use nalgebra::{Complex, DMatrix};

/// A diagonal block of `Λ`: a real eigenvalue, `b = 0`, or a pair `a ± ib`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PencilBlock {
    /// `a`.
    pub a: f64,
    /// `b`, not negative.
    pub b: f64,
    /// Its first column of `T`; a pair has two.
    pub first: usize,
}

impl PencilBlock {
    /// Number of columns: 1 or 2.
    #[must_use]
    pub fn size(&self) -> usize {
        if self.b > 0.0 { 2 } else { 1 }
    }

    /// `(1, a, a² − b²)`: factors of `A`, `hB`, `h²C` on the diagonal.
    #[must_use]
    pub fn diagonal(&self) -> [f64; 3] {
        [1.0, self.a, self.a * self.a - self.b * self.b]
    }

    /// `(0, b, 2ab)`: the same beside the diagonal, with the other sign below it.
    #[must_use]
    pub fn beside(&self) -> [f64; 3] {
        [0.0, self.b, 2.0 * self.a * self.b]
    }
}

/// `Λ`, `T` and `T⁻¹ K̂⁻¹` of a number of control points.
#[derive(Clone, Debug, PartialEq)]
pub struct GalerkinPencil {
    /// The blocks of `Λ`.
    pub modes: Vec<PencilBlock>,
    /// `T`, shape `s × s`; row: control point `1 … s`.
    pub T: DMatrix<f64>,
    /// `T⁻¹ K̂⁻¹`, shape `s × s`; column: control point `0 … s − 1`.
    pub from_residual: DMatrix<f64>,
}

impl GalerkinPencil {
    /// Of the constants of a degree.
    #[must_use]
    pub fn new(constants: &GaussLobatto) -> Self {
        let s = constants.stages();
        let legendre = legendre(s);
        let (mut T, mut modes, mut first) = (DMatrix::zeros(s, s), Vec::new(), 0);
        for alpha in eigenvalues(&legendre).into_iter().filter(|alpha| alpha.im >= 0.0) {
            let vector = |j: usize| eigenvector(&legendre, alpha, constants.nodes[j + 1]);
            let scale = vector(s - 1).inv();
            for j in 0..s {
                let v = vector(j) * scale;
                T[(j, first)] = v.re;
                if alpha.im > 0.0 {
                    T[(j, first + 1)] = v.im;
                }
            }
            let mode = PencilBlock { a: alpha.re, b: alpha.im, first };
            first += mode.size();
            modes.push(mode);
        }
        let inverse = T.clone().try_inverse().expect("the eigenvalues are distinct");
        let entry = |i: usize, j: usize| -> f64 {
            (0..s).map(|k| inverse[(i, k)] * constants.K_hat_inverse[(k, j)]).sum()
        };
        Self { modes, from_residual: DMatrix::from_fn(s, s, entry), T }
    }
}

/// The coefficients of `P_s` on `[0, 1]`, of `x^0 … x^s`: `(−1)^{s+k} (s + k)!/((k!)² (s − k)!)`.
fn legendre(s: usize) -> Vec<f64> {
    let mut coefficients = vec![if s.is_multiple_of(2) { 1.0 } else { -1.0 }];
    for k in 0..s {
        let ratio = ((s + k + 1) * (s - k)) as f64 / ((k + 1) * (k + 1)) as f64;
        coefficients.push(-coefficients[k] * ratio);
    }
    coefficients
}

/// `Σ_m α^m P^{(m)}(x)`.
fn eigenvector(P: &[f64], alpha: Complex<f64>, x: f64) -> Complex<f64> {
    let (mut derivative, mut power) = (P.to_vec(), Complex::new(1.0, 0.0));
    let mut sum = Complex::new(0.0, 0.0);
    while !derivative.is_empty() {
        sum += power * derivative.iter().rev().fold(0.0, |value, c| value * x + c);
        derivative = derivative.iter().enumerate().skip(1).map(|(k, c)| k as f64 * c).collect();
        power *= alpha;
    }
    sum
}

/// The roots of `Σ_m α^m P^{(m)}(0)` by the iteration of Weierstrass (Durand–Kerner): the real one,
/// and of pairs those with positive imaginary parts.
fn eigenvalues(P: &[f64]) -> Vec<Complex<f64>> {
    const REAL: f64 = 1e-9; // all others are farther from the axis
    let (s, mut factorial) = (P.len() - 1, 1.0);
    let mut coefficients: Vec<f64> = Vec::with_capacity(P.len());
    for (m, p) in P.iter().enumerate() {
        factorial *= m.max(1) as f64;
        coefficients.push(p * factorial);
    }
    let value = |x: Complex<f64>| {
        let terms = coefficients.iter().rev().map(|c| c / coefficients[s]);
        terms.fold(Complex::new(0.0, 0.0), |value, c| value * x + c)
    };
    let mut start = Complex::new(0.2, 0.0);
    let mut roots = vec![start; s];
    for root in &mut roots {
        *root = start;
        start *= Complex::new(0.4, 0.9);
    }
    for _ in 0..200 {
        for k in 0..s {
            let others = (0..s).filter(|i| *i != k).map(|i| roots[k] - roots[i]);
            let product = others.fold(Complex::new(1.0, 0.0), |product, gap| product * gap);
            let correction = value(roots[k]) / product;
            roots[k] -= correction;
        }
    }
    let upper = roots.into_iter().filter(|root| root.im > -REAL);
    upper.map(|root| if root.im < REAL { Complex::new(root.re, 0.0) } else { root }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::galerkin::Stages;

    /// [2.34] with random numbers in the place of `A`, `B`, `C`.
    #[test]
    fn the_matrix_of_a_step_is_diagonal_in_the_modes() {
        for s in 1..=Stages::MAX {
            let constants = GaussLobatto::new(Stages::new(s).expect("in range"));
            let pencil = GalerkinPencil::new(&constants);
            assert_eq!(pencil.modes.iter().map(PencilBlock::size).sum::<usize>(), s);
            let hat = |matrix: &DMatrix<f64>| matrix.view((0, 1), (s, s)).into_owned();
            let [A, B, C] = [1.3, 0.4, 7.0];
            let matrix = hat(&constants.K) * A - hat(&constants.N) * B - hat(&constants.S) * C;
            let found = &pencil.from_residual * matrix * &pencil.T;
            let mut expected = DMatrix::zeros(s, s);
            for mode in &pencil.modes {
                let [on, beside] =
                    [mode.diagonal(), mode.beside()].map(|[m, d, k]| m * A + d * B + k * C);
                for k in mode.first..mode.first + mode.size() {
                    expected[(k, k)] = on;
                }
                if mode.size() == 2 {
                    expected[(mode.first, mode.first + 1)] = beside;
                    expected[(mode.first + 1, mode.first)] = -beside;
                }
            }
            let error = (&found - &expected).amax();
            println!("s = {s}: off by {error:.1e}");
            assert!(error < 1e-9, "s = {s}: {found} for {expected}");
        }
    }
}
