//! `LU` of a matrix, with memory that grows to the largest one.

use crate::dense;
use nalgebra::DMatrix;

#[derive(Clone, Debug)]
pub(super) struct ConeFactors {
    matrix: DMatrix<f64>, // m × m
    pivots: Vec<usize>,   // m
}

impl Default for ConeFactors {
    fn default() -> Self {
        Self { matrix: DMatrix::zeros(0, 0), pivots: Vec::new() }
    }
}

impl ConeFactors {
    /// The matrix to factorize, `m × m`, to be filled.
    pub(super) fn matrix_mut(&mut self, m: usize) -> &mut DMatrix<f64> {
        if self.matrix.nrows() != m {
            let matrix = std::mem::replace(&mut self.matrix, DMatrix::zeros(0, 0));
            let mut entries: Vec<f64> = matrix.data.into();
            entries.resize(m * m, 0.0);
            self.matrix = DMatrix::from_vec(m, m, entries);
            self.pivots.resize(m, 0);
        }
        &mut self.matrix
    }

    pub(super) fn factorize(&mut self) {
        dense::lu(&mut self.matrix, &mut self.pivots);
    }

    /// `b ← x`, not finite of a singular matrix.
    pub(super) fn solve(&self, b: &mut [f64]) {
        dense::solve_lu(&self.matrix, &self.pivots, b);
    }
}
