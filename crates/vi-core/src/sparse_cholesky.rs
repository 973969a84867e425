//! Sparse Cholesky factors of symmetric positive definite matrices, their memory sized once.
//!
//! The factorization is faer's. Like those of [`crate::linear`], every answer is checked to be
//! finite.

use crate::linear::{Singular, finite, view};
use crate::sparse::SparseMatrix;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{CholeskySymbolicParams, factorize_symbolic_cholesky};
use faer::sparse::linalg::cholesky::{LltRef, SymbolicCholesky, SymmetricOrdering};
use faer::{Conj, MatMut, Par, Side};

/// `A = L Lᵀ` of a symmetric matrix of which the lower triangle is stored: the symbolic
/// factorization is made once for the pattern, the numbers each time.
pub struct SparseCholesky {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>, // of L
    scratch: MemBuffer,
}

impl std::fmt::Debug for SparseCholesky {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SparseCholesky").field("n", &self.symbolic.nrows()).finish_non_exhaustive()
    }
}

impl SparseCholesky {
    /// Analyses the pattern of a lower triangle.
    ///
    /// # Errors
    /// [`Singular`] when the factors do not fit the memory.
    pub fn new(a: &SparseMatrix) -> Result<Self, Singular> {
        // simplicial: the same bits on every processor
        let settings = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SIMPLICIAL,
            ..Default::default()
        };
        let (pattern, ordering) = (view(a).symbolic(), SymmetricOrdering::Amd);
        let symbolic = factorize_symbolic_cholesky(pattern, Side::Lower, ordering, settings)
            .map_err(|_| Singular)?;
        let scratch = MemBuffer::new(
            symbolic
                .factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default())
                .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq)),
        );
        let values = vec![0.0; symbolic.len_val()];
        Ok(Self { symbolic, values, scratch })
    }

    /// Factorizes a matrix of the analysed pattern.
    ///
    /// # Errors
    /// [`Singular`] when it is not positive definite.
    pub fn factorize(&mut self, a: &SparseMatrix) -> Result<(), Singular> {
        let Self { symbolic, values, scratch } = self;
        let (matrix, stack) = (view(a), MemStack::new(scratch));
        let (regularization, settings) = (Default::default(), Default::default());
        let side = Side::Lower;
        symbolic
            .factorize_numeric_llt(values, matrix, side, regularization, Par::Seq, stack, settings)
            .map_err(|_| Singular)?;
        Ok(())
    }

    /// Solves `A x = b` with the last factorization; `b` is overwritten by `x`.
    ///
    /// # Errors
    /// [`Singular`] when the answer is not finite.
    pub fn solve(&mut self, b: &mut [f64]) -> Result<(), Singular> {
        let n = b.len();
        LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(b, n, 1),
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
        finite(b)
    }
}
