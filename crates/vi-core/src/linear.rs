//! Linear solvers: dense and sparse LU with their memory sized once, and condition numbers.
//!
//! The sparse factorization is faer's. Every answer is checked to be finite: a sparse LU of a
//! singular matrix may come back without an error and with NaN in it.

pub use crate::vectors::{dot, norm_inf};

use crate::dense;
use crate::sparse::SparseMatrix;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::{SupernodalThreshold, lu as sparse_lu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par};
use nalgebra::DMatrix;

/// The matrix is singular to working precision (or holds NaN or infinity).
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the matrix is singular to working precision")]
pub struct Singular;

/// Dense LU with partial pivoting; nothing is allocated after `new`.
#[derive(Clone, Debug)]
pub struct DenseLu {
    factors: DMatrix<f64>,
    pivots: Vec<usize>,
}

impl DenseLu {
    /// A solver for `n × n` matrices.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self { factors: DMatrix::zeros(n, n), pivots: vec![0; n] }
    }

    /// Solves `A x = b`; `b` is overwritten by `x`.
    ///
    /// # Errors
    /// [`Singular`] when the answer is not finite.
    pub fn solve(&mut self, a: &DMatrix<f64>, b: &mut [f64]) -> Result<(), Singular> {
        self.factorize(a);
        self.solve_factorized(b)
    }

    /// Factorizes `A`.
    pub fn factorize(&mut self, a: &DMatrix<f64>) {
        self.factors.copy_from(a);
        dense::lu(&mut self.factors, &mut self.pivots);
    }

    /// Solves with the last factorization; `b` is overwritten by `x`.
    ///
    /// # Errors
    /// [`Singular`] when the answer is not finite.
    pub fn solve_factorized(&mut self, b: &mut [f64]) -> Result<(), Singular> {
        dense::solve_lu(&self.factors, &self.pivots, b);
        finite(b)
    }
}

/// Sparse LU: the symbolic factorization is made once for the pattern, the numbers each time.
pub struct SparseLu {
    symbolic: sparse_lu::SymbolicLu<usize>,
    numeric: sparse_lu::NumericLu<usize, f64>,
    scratch: MemBuffer,
    columns: usize, // right-hand sides that fit the scratch
}

impl std::fmt::Debug for SparseLu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SparseLu").field("n", &self.symbolic.nrows()).finish_non_exhaustive()
    }
}

impl SparseLu {
    /// Analyses the pattern of a square matrix.
    ///
    /// # Errors
    /// [`Singular`] when the pattern has no full transversal.
    pub fn new(a: &SparseMatrix) -> Result<Self, Singular> {
        // simplicial: refactorizations without a single allocation
        let parameters = sparse_lu::LuSymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SIMPLICIAL,
            ..Default::default()
        };
        let view = view(a);
        let symbolic =
            sparse_lu::factorize_symbolic_lu(view.symbolic(), parameters).map_err(|_| Singular)?;
        let scratch = scratch(&symbolic, 1);
        Ok(Self { symbolic, numeric: sparse_lu::NumericLu::new(), scratch, columns: 1 })
    }

    /// Solves `A x = b` for a matrix of the analysed pattern; `b` is overwritten by `x`. Several
    /// right-hand sides may follow one another in `b`.
    ///
    /// # Errors
    /// [`Singular`] when the factorization fails or the answer is not finite.
    pub fn solve(&mut self, a: &SparseMatrix, b: &mut [f64]) -> Result<(), Singular> {
        self.factorize(a)?;
        self.solve_factorized(b)
    }

    /// Factorizes a matrix of the analysed pattern.
    ///
    /// # Errors
    /// [`Singular`] when the factorization fails.
    pub fn factorize(&mut self, a: &SparseMatrix) -> Result<(), Singular> {
        let Self { symbolic, numeric, scratch, .. } = self;
        let stack = MemStack::new(scratch);
        let factors =
            symbolic.factorize_numeric_lu(numeric, view(a), Par::Seq, stack, Default::default());
        factors.map(|_| ()).map_err(|_| Singular)
    }

    /// Solves `A x = b` with the last factorization; `b` is overwritten by `x`. Several right-hand
    /// sides may follow one another in `b`.
    ///
    /// # Errors
    /// [`Singular`] when the answer is not finite.
    ///
    /// # Panics
    /// When nothing was factorized.
    pub fn solve_factorized(&mut self, b: &mut [f64]) -> Result<(), Singular> {
        let n = self.symbolic.nrows();
        let columns = b.len() / n.max(1);
        debug_assert_eq!(b.len(), n * columns);
        if columns > self.columns {
            (self.scratch, self.columns) = (scratch(&self.symbolic, columns), columns);
        }
        let factors = sparse_lu::LuRef::new_unchecked(&self.symbolic, &self.numeric);
        let side = MatMut::from_column_major_slice_mut(b, n, columns);
        let stack = MemStack::new(&mut self.scratch);
        factors.solve_in_place_with_conj(Conj::No, side, Par::Seq, stack);
        finite(b)
    }

    /// Solves `Aᵀ x = c` with the last factorization; `c` is overwritten by `x`.
    ///
    /// # Errors
    /// [`Singular`] when the answer is not finite.
    ///
    /// # Panics
    /// When nothing was factorized.
    pub fn solve_transposed(&mut self, c: &mut [f64]) -> Result<(), Singular> {
        let factors = sparse_lu::LuRef::new_unchecked(&self.symbolic, &self.numeric);
        let side = MatMut::from_column_major_slice_mut(c, self.symbolic.nrows(), 1);
        let stack = MemStack::new(&mut self.scratch);
        factors.solve_transpose_in_place_with_conj(Conj::No, side, Par::Seq, stack);
        finite(c)
    }
}

fn scratch(symbolic: &sparse_lu::SymbolicLu<usize>, columns: usize) -> MemBuffer {
    MemBuffer::new(
        symbolic
            .factorize_numeric_lu_scratch::<f64>(Par::Seq, Default::default())
            .or(symbolic.solve_in_place_scratch::<f64>(columns, Par::Seq))
            .or(symbolic.solve_transpose_in_place_scratch::<f64>(1, Par::Seq)),
    )
}

pub(crate) fn view(a: &SparseMatrix) -> SparseColMatRef<'_, usize, f64> {
    let matrix = a.as_sprs();
    let (rows, columns) = matrix.shape();
    let symbolic = SymbolicSparseColMatRef::new_checked(
        rows,
        columns,
        a.column_pointers(),
        None,
        matrix.indices(),
    );
    SparseColMatRef::new(symbolic, matrix.data())
}

pub(crate) fn finite(x: &[f64]) -> Result<(), Singular> {
    if x.iter().all(|v| v.is_finite()) { Ok(()) } else { Err(Singular) }
}

/// The 2-norm condition number `σ_max/σ_min`; infinite when singular, NaN when not finite.
#[must_use]
pub fn condition_number(a: &DMatrix<f64>) -> f64 {
    if a.iter().any(|v| !v.is_finite()) {
        return f64::NAN;
    }
    if a.is_empty() {
        return 1.0;
    }
    let values = a.clone().svd(false, false).singular_values;
    values.max() / values.min()
}
