//! The linear system of the tangent, scaled by powers of two: rows and columns of the size of 1.
//! ```text
//! D (K + σ S) D (D⁻¹ x) = D r          D diagonal
//! ```
#![allow(non_snake_case)] // K, S, D

use super::EquilibriumEquations;
use vi_core::linear::{Singular, SparseLu};
use vi_core::sparse::{Entries, SparseMatrix};

/// Least stiffness that the matrix is scaled by, relative to the largest.
const SOFTEST: f64 = 1e-8;

impl EquilibriumEquations {
    /// `x ← K⁻¹ x` with the tangent last filled.
    pub(crate) fn solve(&mut self, x: &mut [f64]) -> Result<(), Singular> {
        self.solve_with(1.0, x)
    }

    /// The same with `part` of the stiffness: 0 leaves `σ S` alone.
    pub(super) fn solve_with(&mut self, part: f64, x: &mut [f64]) -> Result<(), Singular> {
        self.set_scales(part);
        let d = self.unknowns();
        let Self { stiffness, upper, lower, scale, factors, metric, sigma, .. } = self;
        let scaled = |out: &mut dyn Entries| {
            stiffness.emit(&mut ScaledEntries { out, scale, part, place: |i, j| (i, j) });
            for (i, s) in metric.iter().enumerate() {
                out.add(i, i, scale[i] * *sigma * s * scale[i]);
            }
            upper.emit(&mut ScaledEntries { out, scale, part: 1.0, place: |i, j| (j, d + i) });
            lower.emit(&mut ScaledEntries { out, scale, part: 1.0, place: |i, j| (d + i, j) });
        };
        match factors {
            Some((matrix, _)) => matrix.refill(scaled),
            None => {
                let matrix = SparseMatrix::assemble(scale.len(), scale.len(), scaled);
                let lu = SparseLu::new(&matrix)?;
                *factors = Some((matrix, lu));
            }
        }
        let (matrix, lu) = factors.as_mut().expect("just written");
        x.iter_mut().zip(scale.iter()).for_each(|(x, s)| *x *= s);
        lu.solve(matrix, x)?;
        x.iter_mut().zip(scale.iter()).for_each(|(x, s)| *x *= s);
        Ok(())
    }

    /// Powers of two that bring the diagonal of the stiffness and the constraint rows near 1; what
    /// is softer than [`SOFTEST`] may be round-off of a rigid body that has no stiffness of its
    /// own.
    fn set_scales(&mut self, part: f64) {
        let d = self.unknowns();
        let near = |size: f64, exponent: f64| {
            let usable = size.is_finite() && size > f64::MIN_POSITIVE;
            if usable { libm::exp2((exponent * libm::log2(size)).round()) } else { 1.0 }
        };
        let least = SOFTEST * part * self.stiffest();
        for (i, scale) in self.scale[..d].iter_mut().enumerate() {
            let size = part * self.stiffness.diagonal()[i] + self.sigma * self.metric[i];
            *scale = near(size.abs().max(least * self.metric[i]), -0.5);
        }
        let mut largest = vec![0.0_f64; self.rows.len()];
        self.lower.emit(&mut RowMaxima { scale: &self.scale, out: &mut largest });
        for (scale, size) in self.scale[d..].iter_mut().zip(largest) {
            *scale = near(size, -1.0);
        }
    }
}

/// Multiplies entries by the scales of their row and column.
struct ScaledEntries<'a, F> {
    out: &'a mut dyn Entries,
    scale: &'a [f64],
    part: f64,
    place: F,
}

impl<F: Fn(usize, usize) -> (usize, usize)> Entries for ScaledEntries<'_, F> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        let (i, j) = (self.place)(row, column);
        self.out.add(i, j, self.scale[i] * (self.part * value) * self.scale[j]);
    }
}

/// The largest entry of each row, columns scaled.
struct RowMaxima<'a> {
    scale: &'a [f64],
    out: &'a mut [f64],
}

impl Entries for RowMaxima<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        let size = (value * self.scale[column]).abs();
        self.out[row] = self.out[row].max(size);
    }
}
