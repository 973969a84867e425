//! Singular values by rotations of columns (one-sided Jacobi).
//!
//! ```text
//! J V = U Σ,   VᵀV = I,   columns of U orthonormal
//! ```
//! Small singular values are found to round-off relative to the columns they come from. Source:
//! G. H. Golub, C. F. Van Loan, Matrix Computations, 4th ed. (2013), §8.6.3.
#![allow(non_snake_case)] // J, U, V

use nalgebra::{DMatrix, DVector};
use vi_core::linear::dot;

/// `U`, `Σ`, `V`, largest singular value first.
#[derive(Clone, Debug)]
pub struct SingularValues {
    /// Shape `m × p`; columns of vanishing values are zero.
    pub left: DMatrix<f64>,
    /// Shape `p`, not negative.
    pub values: Vec<f64>,
    /// Shape `p × p`.
    pub right: DMatrix<f64>,
}

fn column(A: &DMatrix<f64>, k: usize) -> &[f64] {
    let rows = A.nrows();
    &A.as_slice()[k * rows..(k + 1) * rows]
}

/// Turns columns `i`, `k` by the rotation `(c, s)`.
fn turn(A: &mut DMatrix<f64>, [i, k]: [usize; 2], [c, s]: [f64; 2]) {
    for row in 0..A.nrows() {
        let (a, b) = (A[(row, i)], A[(row, k)]);
        (A[(row, i)], A[(row, k)]) = (c * a - s * b, s * a + c * b);
    }
}

impl SingularValues {
    /// Of a matrix of finite entries.
    #[must_use]
    pub fn of(J: &DMatrix<f64>) -> Self {
        const SWEEPS: usize = 60; // each squares what is left: a handful does
        let p = J.ncols();
        let (mut W, mut V) = (J.clone(), DMatrix::identity(p, p));
        for _ in 0..SWEEPS {
            let mut turned = false;
            for i in 0..p {
                for k in i + 1..p {
                    let (a, b) = (column(&W, i), column(&W, k));
                    let (aa, bb, ab) = (dot(a, a), dot(b, b), dot(a, b));
                    if ab.abs() <= f64::EPSILON * aa.sqrt() * bb.sqrt() {
                        continue;
                    }
                    let zeta = (bb - aa) / (2.0 * ab);
                    let t = f64::copysign(1.0, zeta) / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
                    let c = 1.0 / (1.0 + t * t).sqrt();
                    turn(&mut W, [i, k], [c, c * t]);
                    turn(&mut V, [i, k], [c, c * t]);
                    turned = true;
                }
            }
            if !turned {
                break;
            }
        }
        let size = |k: usize| dot(column(&W, k), column(&W, k)).sqrt();
        let mut order: Vec<usize> = (0..p).collect();
        order.sort_by(|a, b| size(*b).total_cmp(&size(*a)));
        let values: Vec<f64> = order.iter().map(|&k| size(k)).collect();
        let left = order.iter().zip(&values).map(|(&k, value)| {
            let scale = if *value > 0.0 { 1.0 / value } else { 0.0 };
            DVector::from_iterator(W.nrows(), column(&W, k).iter().map(|w| w * scale))
        });
        let left: Vec<DVector<f64>> = left.collect();
        let right: Vec<DVector<f64>> =
            order.iter().map(|&k| DVector::from_column_slice(column(&V, k))).collect();
        let gather = |columns: &[DVector<f64>], rows: usize| {
            DMatrix::from_fn(rows, columns.len(), |i, k| columns[k][i])
        };
        Self { left: gather(&left, J.nrows()), values, right: gather(&right, p) }
    }

    /// `Uᵀ r`.
    #[must_use]
    pub fn left_products(&self, r: &[f64]) -> Vec<f64> {
        (0..self.values.len()).map(|k| dot(column(&self.left, k), r)).collect()
    }

    /// `V c`.
    #[must_use]
    pub fn combine(&self, c: &[f64]) -> Vec<f64> {
        let p = self.values.len();
        (0..p).map(|i| (0..p).map(|k| self.right[(i, k)] * c[k]).sum()).collect()
    }
}
