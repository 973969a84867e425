//! `A` of a convex program, and the factors of `A + V⁻²`: dense or sparse.
#![allow(non_snake_case)] // A

use super::factors::Factors;
use crate::linear::dot;
use crate::sparse::SparseMatrix;
use crate::sparse_cholesky::SparseCholesky;

/// Writes entries by a sink.
type Emit<'a> = &'a mut dyn FnMut(&mut dyn FnMut(usize, usize, f64));

/// A symmetric matrix, to which blocks on the diagonal are added before it is factorized.
pub(super) trait Operator {
    /// `A`, `m × m`, from entries that add up; those on the diagonal blocks are among them.
    fn assemble(&mut self, m: usize, emit: Emit<'_>);

    /// `out ← A x`.
    fn multiply(&self, x: &[f64], out: &mut [f64]);

    /// The matrix of the factors is `A` again.
    fn begin(&mut self);

    /// Adds to it.
    fn add(&mut self, i: usize, j: usize, value: f64);

    fn factorize(&mut self);

    /// `b ← x`, not finite of a singular matrix.
    fn solve(&mut self, b: &mut [f64]);
}

/// All entries.
#[derive(Clone, Debug, Default)]
pub(super) struct Dense {
    A: Vec<f64>, // m × m
    m: usize,
    factors: Factors,
}

impl Operator for Dense {
    fn assemble(&mut self, m: usize, emit: Emit<'_>) {
        let A = &mut self.A;
        self.m = m;
        A.clear();
        A.resize(m * m, 0.0);
        emit(&mut |i, j, value| A[i * m + j] += value);
    }

    fn multiply(&self, x: &[f64], out: &mut [f64]) {
        let rows = self.A.chunks_exact(self.m.max(1));
        out.iter_mut().zip(rows).for_each(|(out, row)| *out = dot(row, x));
    }

    fn begin(&mut self) {
        self.factors.matrix_mut(self.m).as_mut_slice().copy_from_slice(&self.A);
    }

    fn add(&mut self, i: usize, j: usize, value: f64) {
        self.factors.matrix_mut(self.m)[(i, j)] += value;
    }

    fn factorize(&mut self) {
        self.factors.factorize();
    }

    fn solve(&mut self, b: &mut [f64]) {
        self.factors.solve(b);
    }
}

/// The entries that are not zero.
#[derive(Debug, Default)]
pub(super) struct Sparse {
    A: Option<SparseMatrix>, // m × m
    m: usize,
    entries: Vec<(usize, usize, f64)>, // of its lower triangle
    added: Vec<(usize, usize, f64)>,
    lower: Option<SparseMatrix>, // with what is added
    cholesky: Option<SparseCholesky>,
    count: usize, // of `added` in the pattern
    is_singular: bool,
}

impl Operator for Sparse {
    fn assemble(&mut self, m: usize, emit: Emit<'_>) {
        self.m = m;
        self.entries.clear();
        let entries = &mut self.entries;
        emit(&mut |i, j, value| entries.push((i, j, value)));
        let all = &self.entries;
        self.A = Some(SparseMatrix::assemble(m, m, |out| {
            all.iter().for_each(|&(i, j, value)| out.add(i, j, value));
        }));
        self.entries.retain(|(i, j, _)| i >= j);
        (self.lower, self.cholesky) = (None, None);
    }

    fn multiply(&self, x: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        if let Some(A) = &self.A {
            A.mul_add(1.0, x, out);
        }
    }

    fn begin(&mut self) {
        self.added.clear();
    }

    fn add(&mut self, i: usize, j: usize, value: f64) {
        if i >= j {
            self.added.push((i, j, value));
        }
    }

    fn factorize(&mut self) {
        if self.added.len() != self.count {
            (self.lower, self.cholesky, self.count) = (None, None, self.added.len());
        }
        let Self { m, entries, added, lower, cholesky, .. } = self;
        let lower = SparseMatrix::update(lower, (*m, *m), |out| {
            entries.iter().chain(&*added).for_each(|&(i, j, value)| out.add(i, j, value));
        });
        if cholesky.is_none() {
            *cholesky = SparseCholesky::new(lower).ok();
        }
        let factors = cholesky.as_mut().and_then(|own| own.factorize(lower).ok());
        self.is_singular = factors.is_none();
    }

    fn solve(&mut self, b: &mut [f64]) {
        let solved = self.cholesky.as_mut().and_then(|own| own.solve(b).ok());
        if self.is_singular || solved.is_none() {
            b.fill(f64::NAN);
        }
    }
}
