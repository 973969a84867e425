//! Constants of the Gauss–Lobatto Galerkin schemes of order `2s`, `s = 1 … 8`.
//!
//! On a step, `q_d(t_n + τh) = Σ_j ℓ_j(τ) q_j` goes through `s + 1` control points at the Lobatto
//! nodes `c̃_j` of `[0, 1]`; the action is integrated at the `s` Gauss nodes `c_k`:
//! ```text
//! E_kj = ℓ_j(c_k),   D_kj = ℓ'_j(c_k),   K = Dᵀ diag(b) D,   b̃ = Eᵀ b                            [2.24]
//! L_d(q_0 … q_s) = (1/2h) Σ_ij K_ij q_iᵀ M q_j − h Σ_k b_k V(Q_k),   Q_k = Σ_j E_kj q_j              [2.25]
//! ```
//! `K` is symmetric, centrosymmetric and positive semi-definite of rank `s`, and its rows sum to
//! zero. In doubles the first two and the last hold exactly: off-diagonal entries are multiples of
//! `2⁻⁴⁴`, the diagonal balances its row. Otherwise the rounding of `K` would act as a force in
//! every step and the momentum maps would drift.
//!
//! Sources: Jay, SIAM J. Numer. Anal. 45 (2007) 1814; Wenger, Ober-Blöbaum & Leyendecker, Adv.
//! Comput. Math. 43 (2017) 1163.
#![allow(non_snake_case)] // A, K, E, D: the matrices of the theory

use crate::configuration::Configuration;
use crate::interval::Interval;
use crate::linear::Singular;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// Spacing of the grid on which the entries of `K` lie.
const GRID: f64 = 1.0 / (1_u64 << 44) as f64;

/// Degree `s` of the polynomial of a step, `1 … 8`: the order is `2s`.
///
/// ```
/// use vi_core::galerkin::Stages;
/// let stages = Stages::of_order(8).unwrap();
/// assert_eq!((stages.count(), stages.order()), (4, 8));
/// assert!(Stages::of_order(5).is_none() && Stages::new(9).is_none());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "usize", into = "usize")]
pub struct Stages(usize);

impl Stages {
    /// The largest degree.
    pub const MAX: usize = 8;

    /// Of degree `s`; `None` beyond `1 … 8`.
    #[must_use]
    pub fn new(s: usize) -> Option<Self> {
        (1..=Self::MAX).contains(&s).then_some(Self(s))
    }

    /// Of order `2s`; `None` for any other order than 2, 4 … 16.
    #[must_use]
    pub fn of_order(order: u32) -> Option<Self> {
        order.is_multiple_of(2).then(|| Self::new(order as usize / 2)).flatten()
    }

    /// `s`.
    #[must_use]
    pub fn count(self) -> usize {
        self.0
    }

    /// `2s`.
    #[must_use]
    pub fn order(self) -> u32 {
        2 * self.0 as u32
    }
}

impl TryFrom<usize> for Stages {
    type Error = &'static str;

    fn try_from(s: usize) -> Result<Self, Self::Error> {
        Self::new(s).ok_or("the degree of the polynomial of a step is 1 … 8")
    }
}

impl From<Stages> for usize {
    fn from(stages: Stages) -> Self {
        stages.0
    }
}

/// The constants of degree `s`; control points are numbered `0 … s`, Gauss nodes `0 … s − 1`.
#[derive(Clone, Debug, PartialEq)]
pub struct GaussLobatto {
    /// `c̃_j`, shape `s + 1`.
    pub nodes: Vec<f64>,
    /// `b̃_j`, shape `s + 1`.
    pub weights: Vec<f64>,
    /// `c_k`, shape `s`.
    pub gauss_nodes: Vec<f64>,
    /// `b_k`, shape `s`.
    pub gauss_weights: Vec<f64>,
    /// `E_kj`, shape `s × (s + 1)`.
    pub E: DMatrix<f64>,
    /// `D_kj`, shape `s × (s + 1)`.
    pub D: DMatrix<f64>,
    /// `K_ij` on the grid, shape `(s + 1) × (s + 1)`.
    pub K: DMatrix<f64>,
    /// `S = Eᵀ diag(b) E`, shape `(s + 1) × (s + 1)`: weights of products of strains.
    pub S: DMatrix<f64>,
    /// `N = Eᵀ diag(b) D`, shape `(s + 1) × (s + 1)`: weights of products of strains and strain
    /// rates.
    pub N: DMatrix<f64>,
    /// The inverse of `K̂ = K[0 … s−1; 1 … s]`, shape `s × s`; row: control point `1 … s`, column:
    /// `0 … s − 1`.
    pub K_hat_inverse: DMatrix<f64>,
    /// `ℓ_j(1 + c̃_i)`, shape `s × (s + 1)`; row: `i = 1 … s`. The polynomial of a step at the next
    /// control points.
    pub extrapolation: DMatrix<f64>,
    /// `A_kj = ∫ ℓ̂_j over [0, c_k]` of the Lagrange polynomials at the Gauss nodes, shape `s × s`:
    /// collocation of first-order equations.
    pub A: DMatrix<f64>,
}

/// A Gauss node of a step. Integrals over the step are `h Σ_k b_k` of functions there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GaussPoint {
    /// `b_k`.
    pub weight: f64,
    /// `t_n + c_k h`, s.
    pub t: f64,
    /// `Q_k = Σ_j E_kj q_j`, shape `n`; leaves the constraint manifold by intent.
    pub q: Vec<f64>,
    /// `V_k = (1/h) Σ_j D_kj q_j`, shape `n`.
    pub v: Vec<f64>,
    /// Internal variables there; none where they are those of the start of the step.
    pub internal: Vec<f64>,
}

impl GaussPoint {
    /// Where potentials and forces are evaluated; `s`: the step.
    #[must_use]
    pub fn place<'a>(&'a self, s: &'a Interval) -> Configuration<'a> {
        let internal = if self.internal.is_empty() { &s.internal } else { &self.internal };
        Configuration { t: self.t, q: &self.q, angles: &s.angles, internal }
    }
}

impl GaussLobatto {
    /// Of degree `s`.
    #[must_use]
    pub fn new(stages: Stages) -> Self {
        let s = stages.count();
        let (nodes, weights) = lobatto(s);
        let (gauss_nodes, gauss_weights) = gauss(s);
        let E = DMatrix::from_fn(s, s + 1, |k, j| lagrange(&nodes, j, gauss_nodes[k]));
        let D = DMatrix::from_fn(s, s + 1, |k, j| lagrange_rate(&nodes, j, gauss_nodes[k]));
        let exact = D.transpose() * DMatrix::from_diagonal(&gauss_weights.clone().into()) * &D;
        let K = on_grid(&exact); // [2.24]
        let weighted = |A: &DMatrix<f64>| {
            let product = |i: usize, j: usize| {
                (0..s).map(|k| gauss_weights[k] * E[(k, i)] * A[(k, j)]).sum::<f64>()
            };
            DMatrix::from_fn(s + 1, s + 1, product)
        };
        let (S, N) = (weighted(&E), weighted(&D)); // [6.33], [6.34]
        let K_hat_inverse = inverse(&K.view((0, 1), (s, s)).into_owned())
            .expect("the polynomial of a step is determined by its control points");
        let extrapolation =
            DMatrix::from_fn(s, s + 1, |i, j| lagrange(&nodes, j, 1.0 + nodes[i + 1]));
        let A = DMatrix::from_fn(s, s, |k, j| {
            let c = gauss_nodes[k];
            let at = |m: usize| gauss_weights[m] * lagrange(&gauss_nodes, j, c * gauss_nodes[m]);
            c * (0..s).map(at).sum::<f64>()
        });
        Self {
            A,
            nodes,
            weights,
            gauss_nodes,
            gauss_weights,
            E,
            D,
            K,
            S,
            N,
            K_hat_inverse,
            extrapolation,
        }
    }

    /// `s`.
    #[must_use]
    pub fn stages(&self) -> usize {
        self.gauss_nodes.len()
    }

    /// `ℓ'_j(τ)`, `j = 0 … s`.
    #[must_use]
    pub fn lagrange_rate(&self, j: usize, tau: f64) -> f64 {
        lagrange_rate(&self.nodes, j, tau)
    }

    /// `ℓ_j(τ)`, `j = 0 … s`.
    #[must_use]
    pub fn lagrange(&self, j: usize, tau: f64) -> f64 {
        lagrange(&self.nodes, j, tau)
    }
}

/// `K` with off-diagonal entries on the grid, symmetric, centrosymmetric, with row sums of exactly
/// zero.
fn on_grid(exact: &DMatrix<f64>) -> DMatrix<f64> {
    let (size, last) = (exact.nrows(), exact.nrows() - 1);
    let mut K = DMatrix::zeros(size, size);
    for i in 0..size {
        for j in (0..size).filter(|&j| j != i) {
            // the first of the four places that symmetry and centrosymmetry make equal
            let places = [(i, j), (j, i), (last - i, last - j), (last - j, last - i)];
            let (row, column) = places.into_iter().min().unwrap_or((i, j));
            K[(i, j)] = (exact[(row, column)] / GRID).round() * GRID;
        }
        K[(i, i)] = -K.row(i).sum(); // exact: all are multiples of the grid
    }
    K
}

fn inverse(matrix: &DMatrix<f64>) -> Result<DMatrix<f64>, Singular> {
    matrix.clone().try_inverse().ok_or(Singular)
}

/// `ℓ_j(x) = Π_{i≠j} (x − c_i)/(c_j − c_i)`.
fn lagrange(nodes: &[f64], j: usize, x: f64) -> f64 {
    let others = (0..nodes.len()).filter(|&i| i != j);
    others.map(|i| (x - nodes[i]) / (nodes[j] - nodes[i])).product()
}

/// `ℓ'_j(x) = Σ_{m≠j} 1/(c_j − c_m) Π_{i≠j,m} (x − c_i)/(c_j − c_i)`.
fn lagrange_rate(nodes: &[f64], j: usize, x: f64) -> f64 {
    let without = |m: usize| {
        let others = (0..nodes.len()).filter(|&i| i != j && i != m);
        others.map(|i| (x - nodes[i]) / (nodes[j] - nodes[i])).product::<f64>()
    };
    (0..nodes.len()).filter(|&m| m != j).map(|m| without(m) / (nodes[j] - nodes[m])).sum()
}

/// `P_s(x)`, `P_{s−1}(x)` by Bonnet's recursion.
fn legendre(s: usize, x: f64) -> (f64, f64) {
    let (mut previous, mut present) = (0.0, 1.0);
    for k in 1..=s {
        let k = k as f64;
        (previous, present) = (present, ((2.0 * k - 1.0) * x * present - (k - 1.0) * previous) / k);
    }
    (present, previous)
}

/// Gauss nodes and weights on `[0, 1]`: the roots of `P_s`.
fn gauss(s: usize) -> (Vec<f64>, Vec<f64>) {
    let n = s as f64;
    // (1 − x²) P'_s = s (P_{s−1} − x P_s)
    let slope = |x: f64, (p, before): (f64, f64)| n * (before - x * p) / (1.0 - x * x);
    let part = |k: f64| (k + 0.75) / (n + 0.5);
    let roots = symmetric_roots(s, part, |x| {
        let values = legendre(s, x);
        values.0 / slope(x, values)
    });
    let weight = |x: &f64| {
        let rate = slope(*x, legendre(s, *x));
        1.0 / ((1.0 - x * x) * rate * rate)
    };
    (roots.iter().map(|x| 0.5 * (1.0 + x)).collect(), roots.iter().map(weight).collect())
}

/// Lobatto nodes and weights on `[0, 1]`: the ends and the roots of `P'_s`.
fn lobatto(s: usize) -> (Vec<f64>, Vec<f64>) {
    let n = s as f64;
    // with (1 − x²) P'_s = s (P_{s−1} − x P_s) and [(1 − x²) P'_s]' = −s (s + 1) P_s
    let part = |k: f64| (k + 1.0) / n; // Chebyshev
    let roots = symmetric_roots(s - 1, part, |x| {
        let (p, before) = legendre(s, x);
        -(before - x * p) / ((n + 1.0) * p)
    });
    let all: Vec<f64> = [-1.0].into_iter().chain(roots).chain([1.0]).collect();
    let weight = |x: &f64| 1.0 / (n * (n + 1.0) * legendre(s, *x).0.powi(2));
    (all.iter().map(|x| 0.5 * (1.0 + x)).collect(), all.iter().map(weight).collect())
}

/// The `count` roots in `(−1, 1)`, ascending and exactly symmetric, of a function with Newton
/// corrections `f/f'`, from the cosines of parts of `π`.
fn symmetric_roots(
    count: usize,
    part: impl Fn(f64) -> f64,
    correction: impl Fn(f64) -> f64,
) -> Vec<f64> {
    let mut roots = vec![0.0; count];
    for k in 0..count / 2 {
        let mut x = -libm::cos(std::f64::consts::PI * part(k as f64));
        for _ in 0..20 {
            x -= correction(x);
        }
        (roots[k], roots[count - 1 - k]) = (x, -x);
    }
    roots
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> impl Iterator<Item = GaussLobatto> {
        (1..=Stages::MAX).map(|s| GaussLobatto::new(Stages::new(s).expect("in range")))
    }

    #[test]
    fn the_grid_keeps_the_structure_exactly() {
        for constants in all() {
            let (K, s) = (&constants.K, constants.stages());
            for i in 0..=s {
                assert_eq!(K.row(i).iter().sum::<f64>(), 0.0, "s = {s}: row {i}");
                for j in 0..=s {
                    assert_eq!(K[(i, j)], K[(j, i)], "s = {s}");
                    assert_eq!(K[(i, j)], K[(s - i, s - j)], "s = {s}");
                    assert_eq!((K[(i, j)] / GRID).fract(), 0.0, "s = {s}");
                }
            }
        }
    }

    /// Polynomials of degree `2s − 1`, and the action of constant velocities.
    #[test]
    fn the_quadratures_have_their_degrees() {
        for constants in all() {
            let s = constants.stages();
            let rules = [
                (&constants.nodes, &constants.weights),
                (&constants.gauss_nodes, &constants.gauss_weights),
            ];
            for (nodes, weights) in rules {
                for degree in 0..2 * s as i32 {
                    let sum: f64 = nodes.iter().zip(weights).map(|(x, w)| w * x.powi(degree)).sum();
                    let error = (sum - 1.0 / f64::from(degree + 1)).abs();
                    assert!(error < 4e-16, "s = {s}, degree {degree}: {error:e}");
                }
            }
            let b = nalgebra::DVector::from_vec(constants.gauss_weights.clone());
            let weights = constants.E.tr_mul(&b);
            for (found, weight) in weights.iter().zip(&constants.weights) {
                assert!((found - weight).abs() < 1e-15, "b̃ = Eᵀ b, s = {s}");
            }
            // K c̃ = (−1, 0 … 0, 1): the momentum of a constant velocity
            let momentum = &constants.K * nalgebra::DVector::from_vec(constants.nodes.clone());
            for (i, p) in momentum.iter().enumerate() {
                let expected = f64::from(i == s) - f64::from(i == 0);
                assert!((p - expected).abs() < 1e-12, "s = {s}: {p}");
            }
        }
    }

    #[test]
    fn a_polynomial_of_the_degree_is_continued_exactly() {
        for constants in all() {
            let s = constants.stages();
            let q = |t: f64| (0..=s as i32).map(|k| t.powi(k) / f64::from(k + 1)).sum::<f64>();
            for i in 0..s {
                let found: f64 =
                    (0..=s).map(|j| constants.extrapolation[(i, j)] * q(constants.nodes[j])).sum();
                let exact = q(1.0 + constants.nodes[i + 1]);
                assert!((found / exact - 1.0).abs() < 1e-10, "s = {s}: {found} for {exact}");
            }
        }
    }
}
