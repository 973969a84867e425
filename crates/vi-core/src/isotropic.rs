//! A constant matrix as multiples of `I_3` and single entries.
//!
//! In space the masses of points and directors are scalars: `M = Σ m_ij ⊗ I_3` over the vectors
//! `i, j` of `q`. A product with a vector, or its place in a Newton matrix, then costs one number
//! where nine are stored.

use crate::sparse::{Entries, SparseMatrix};
use std::ops::Range;

/// `value I_3` with its upper left corner at `(row, column)`; or one entry.
#[derive(Clone, Copy, Debug, PartialEq)]
struct IsotropicEntry {
    row: usize,
    column: usize,
    value: f64,
}

/// A constant matrix, split.
///
/// ```
/// use vi_core::isotropic::IsotropicBlocks;
/// use vi_core::SparseMatrix;
/// let mass = SparseMatrix::assemble(4, 4, |out| {
///     (0..4).for_each(|i| out.add(i, i, 2.0));
/// });
/// let blocks = IsotropicBlocks::of(&mass);
/// assert_eq!((blocks.multiples(), blocks.entries()), (1, 1));
/// let mut y = [0.0; 4];
/// blocks.mul_add(0.5, &[1.0, 2.0, 3.0, 4.0], &mut y);
/// assert_eq!(y, [1.0, 2.0, 3.0, 4.0]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct IsotropicBlocks {
    multiples: Vec<IsotropicEntry>,
    entries: Vec<IsotropicEntry>,
}

impl IsotropicBlocks {
    /// Of a matrix whose vectors of three coordinates start at multiples of three.
    #[must_use]
    pub fn of(matrix: &SparseMatrix) -> Self {
        let (mut multiples, mut entries) = (Vec::new(), Vec::new());
        matrix.for_each(|row, column, value| {
            let part = IsotropicEntry { row, column, value };
            let within = column % 3;
            let aligned = row % 3 == within;
            match aligned && is_multiple(matrix, row - within, column - within) {
                true if within == 0 => multiples.push(part),
                true => {}
                false => entries.push(part),
            }
        });
        Self { multiples, entries }
    }

    /// Number of multiples of `I_3`.
    #[must_use]
    pub fn multiples(&self) -> usize {
        self.multiples.len()
    }

    /// Number of single entries.
    #[must_use]
    pub fn entries(&self) -> usize {
        self.entries.len()
    }

    /// The multiples of `I_3`: row and column of the upper left corner, value.
    pub fn for_each_multiple(&self, mut visit: impl FnMut(usize, usize, f64)) {
        self.multiples.iter().for_each(|part| visit(part.row, part.column, part.value));
    }

    /// Emits `scale` times the matrix; always the same places in the same order.
    pub fn emit(&self, scale: f64, out: &mut dyn Entries) {
        for part in &self.multiples {
            out.add_multiple(part.row, part.column, scale * part.value);
        }
        for part in &self.entries {
            out.add(part.row, part.column, scale * part.value);
        }
    }

    /// `y ← y + a A x`.
    pub fn mul_add(&self, a: f64, x: &[f64], y: &mut [f64]) {
        let three = |at: usize| -> Range<usize> { at..at + 3 };
        for part in &self.multiples {
            let factor = a * part.value;
            let x = &x[three(part.column)];
            for (y, x) in y[three(part.row)].iter_mut().zip(x) {
                *y += factor * x;
            }
        }
        for part in &self.entries {
            y[part.row] += a * part.value * x[part.column];
        }
    }

    /// `xᵀ A x`.
    #[must_use]
    pub fn quadratic_form(&self, x: &[f64]) -> f64 {
        let mut sums = [0.0; 3]; // over the components of vectors
        for part in &self.multiples {
            let (left, right) = (&x[part.row..part.row + 3], &x[part.column..part.column + 3]);
            for (sum, (a, b)) in sums.iter_mut().zip(left.iter().zip(right)) {
                *sum += part.value * a * b;
            }
        }
        let entries = self.entries.iter().map(|part| x[part.row] * part.value * x[part.column]);
        sums.iter().sum::<f64>() + entries.sum::<f64>()
    }
}

/// Whether the three entries on the diagonal from `(row, column)` on are the same number.
fn is_multiple(matrix: &SparseMatrix, row: usize, column: usize) -> bool {
    let (rows, columns) = matrix.shape();
    if row + 3 > rows || column + 3 > columns {
        return false;
    }
    let at = |k: usize| matrix.as_sprs().get(row + k, column + k).map(|value| value.to_bits());
    at(0).is_some() && at(0) == at(1) && at(1) == at(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two vectors coupled by a scalar, a third with a full block, a single coordinate.
    fn matrix() -> SparseMatrix {
        SparseMatrix::assemble(10, 10, |out| {
            out.add_multiple(0, 0, 2.0);
            out.add_multiple(0, 3, -0.7);
            out.add_multiple(3, 3, 0.3);
            for i in 6..9 {
                for j in 6..9 {
                    out.add(i, j, (i * j) as f64 / 9.0);
                }
            }
            out.add(9, 9, 4.0);
            out.add(9, 0, 1.0);
        })
    }

    #[test]
    fn the_parts_are_the_matrix() {
        let matrix = matrix();
        let blocks = IsotropicBlocks::of(&matrix);
        assert_eq!((blocks.multiples(), blocks.entries()), (3, 11));
        let again = SparseMatrix::assemble(10, 10, |out| blocks.emit(2.0, out));
        assert_eq!(again.to_dense(), matrix.to_dense() * 2.0);
        let x: Vec<f64> = (0..10).map(|i| 1.0 / (i + 1) as f64).collect();
        let (mut product, mut expected) = (vec![0.1; 10], vec![0.1; 10]);
        blocks.mul_add(-1.5, &x, &mut product);
        matrix.mul_add(-1.5, &x, &mut expected);
        for (product, expected) in product.iter().zip(expected) {
            assert!((product - expected).abs() <= 4.0 * f64::EPSILON * expected.abs());
        }
    }
}
