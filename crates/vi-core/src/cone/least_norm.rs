//! `min |x|` among the `x` that minimize `|Ax − b|`, by a complete orthogonal decomposition.
//!
//! ```text
//! A Π = Q [R; 0],   Rᵀ Π' = Q' [R'; 0]   ⇒   x = Π Q' [R'⁻ᵀ Π'ᵀ (Qᵀb)_1; 0]     Golub & Van Loan, §5.5.1
//! ```
#![allow(non_snake_case)] // A, Q, R

use crate::dense::PivotedQr;
use nalgebra::DMatrix;

/// Columns shorter than this part of the longest one depend on the others. Above the rounding
/// errors of a Delassus matrix, below what a mass ratio of 10⁸ leaves.
pub(super) const RANK: f64 = 1e-12;

#[derive(Clone, Debug)]
pub(super) struct ConeLeastNorm {
    left: PivotedQr,  // k × k
    right: PivotedQr, // k × rank
    image: Vec<f64>,  // k
}

impl Default for ConeLeastNorm {
    fn default() -> Self {
        Self { left: PivotedQr::new(0, 0), right: PivotedQr::new(0, 0), image: Vec::new() }
    }
}

impl ConeLeastNorm {
    /// The matrix to solve with, `k × k`, to be filled; memory grows only.
    pub(super) fn matrix_mut(&mut self, k: usize) -> &mut DMatrix<f64> {
        self.left.resize(k, k);
        self.left.matrix_mut()
    }

    /// `b ← x`.
    pub(super) fn solve(&mut self, b: &mut [f64]) {
        let k = b.len();
        self.left.factorize();
        self.left.apply_q_transposed(b);
        let least = RANK * self.left.diagonal(0).abs();
        let rank = (0..k).take_while(|&i| self.left.diagonal(i).abs() > least).count();
        self.right.resize(k, rank);
        let (R, transposed) = (self.left.factors(), self.right.matrix_mut());
        for i in 0..rank {
            for j in 0..k {
                transposed[(j, i)] = if j < i { 0.0 } else { R[(i, j)] };
            }
        }
        self.right.factorize();
        self.image.clear();
        self.image.resize(k, 0.0);
        let R = self.right.factors();
        for i in 0..rank {
            let known: f64 = (0..i).map(|j| R[(j, i)] * self.image[j]).sum();
            self.image[i] = (b[self.right.pivots()[i]] - known) / R[(i, i)];
        }
        self.right.apply_q_to(&mut self.image);
        for (place, value) in self.left.pivots().iter().zip(&self.image) {
            b[*place] = *value;
        }
    }
}
