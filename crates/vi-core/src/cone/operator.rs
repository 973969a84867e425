//! `A` of a convex program, and the factors of `A + V⁻²`.
#![allow(non_snake_case)] // A

use super::factors::Factors;
use crate::linear::dot;

/// Writes entries by a sink.
type Emit<'a> = &'a mut dyn FnMut(&mut dyn FnMut(usize, usize, f64));

/// A symmetric matrix, to which blocks on the diagonal are added before it is factorized.
#[derive(Clone, Debug, Default)]
pub(super) struct Operator {
    A: Vec<f64>, // m × m
    m: usize,
    factors: Factors,
}

impl Operator {
    /// `A`, `m × m`, from entries that add up.
    pub(super) fn assemble(&mut self, m: usize, emit: Emit<'_>) {
        let A = &mut self.A;
        self.m = m;
        A.clear();
        A.resize(m * m, 0.0);
        emit(&mut |i, j, value| A[i * m + j] += value);
    }

    /// `out ← A x`.
    pub(super) fn multiply(&self, x: &[f64], out: &mut [f64]) {
        let rows = self.A.chunks_exact(self.m.max(1));
        out.iter_mut().zip(rows).for_each(|(out, row)| *out = dot(row, x));
    }

    /// The matrix of the factors is `A` again.
    pub(super) fn begin(&mut self) {
        self.factors.matrix_mut(self.m).as_mut_slice().copy_from_slice(&self.A);
    }

    /// Adds to it.
    pub(super) fn add(&mut self, i: usize, j: usize, value: f64) {
        self.factors.matrix_mut(self.m)[(i, j)] += value;
    }

    pub(super) fn factorize(&mut self) {
        self.factors.factorize();
    }

    /// `b ← x`, not finite of a singular matrix.
    pub(super) fn solve(&mut self, b: &mut [f64]) {
        self.factors.solve(b);
    }
}
