//! `A` of a convex program as a full matrix.
#![allow(non_snake_case)] // A

use super::factors::ConeFactors;
use super::primal_dual::{Barrier, CoupledFactors, LawInVector};
use crate::linear::dot;

/// Writes entries by a sink.
type Emit<'a> = &'a mut dyn FnMut(&mut dyn FnMut(usize, usize, f64));

/// A matrix, to which blocks on the diagonal are added before it is factorized.
#[derive(Clone, Debug, Default)]
pub(super) struct Operator {
    A: Vec<f64>, // m × m
    m: usize,
    factors: ConeFactors,
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

    /// The matrix of the factors is `A` again.
    fn begin(&mut self) {
        self.factors.matrix_mut(self.m).as_mut_slice().copy_from_slice(&self.A);
    }

    /// Adds to it.
    fn add(&mut self, i: usize, j: usize, value: f64) {
        self.factors.matrix_mut(self.m)[(i, j)] += value;
    }

    /// `b ← (A + εI)⁻¹ b`.
    pub(super) fn resolve(&mut self, shift: f64, b: &mut [f64]) {
        self.begin();
        (0..self.m).for_each(|i| self.add(i, i, shift));
        self.factors.factorize();
        self.factors.solve(b);
    }
}

impl CoupledFactors for Operator {
    fn multiply(&mut self, x: &[f64], out: &mut [f64]) {
        let rows = self.A.chunks_exact(self.m.max(1));
        out.iter_mut().zip(rows).for_each(|(out, row)| *out = dot(row, x));
    }

    fn factorize(&mut self, parts: &[LawInVector], barriers: &[Barrier]) {
        self.begin();
        for (part, barrier) in parts.iter().zip(barriers) {
            let own = barrier.matrix();
            for i in 0..part.size() {
                (0..part.size())
                    .for_each(|j| self.add(part.place + i, part.place + j, own[(i, j)]));
            }
        }
        self.factors.factorize();
    }

    fn solve(&mut self, b: &mut [f64]) {
        self.factors.solve(b);
    }
}
