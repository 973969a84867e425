//! Multipliers that do not depend on units: of a Jacobian whose rows have length one.
//!
//! ```text
//! G̃ = R G C,   C: what one is for each coordinate,   R: rows of length one                              [5.32]
//! G̃ᵀλ̃ = C w,   |λ̃| least,   λ = R λ̃
//! G̃ ã = R b,   a = C ã
//! ```
//! Lengths in `q` count in lever arms, so rank decisions and the choice among multipliers of
//! redundant constraints are the same in all units of length, mass and time.

use crate::constraints::Constraints;
use crate::least_norm::LeastNorm;
use crate::null_space::NullSpaceQr;
use crate::redundancy::{least_multipliers, scattered};
use vi_core::linear::Singular;
use vi_core::sparse::{Entries, SparseMatrix};

/// Least multipliers in units of their rows, the memory sized once for the pattern of `G`.
#[derive(Debug, Default)]
pub struct UnitRows {
    units: Vec<f64>,              // n  C
    scales: Vec<f64>,             // m  R
    matrix: Option<SparseMatrix>, // m × n  G̃
    least: LeastNorm,
    side: Vec<f64>,  // n  C w
    right: Vec<f64>, // m  R b
}

impl UnitRows {
    /// For constraints, in units of their coordinates.
    #[must_use]
    pub fn of(constraints: &impl Constraints) -> Self {
        let mut units = vec![1.0; constraints.dim()];
        constraints.coordinate_units(&mut units);
        Self::new(units)
    }

    /// For coordinates of which one is `units`.
    #[must_use]
    pub fn new(units: Vec<f64>) -> Self {
        Self { side: vec![0.0; units.len()], units, ..Self::default() }
    }

    /// See [`LeastNorm::decline`].
    pub fn decline(&mut self, declines: bool) {
        self.least.decline(declines);
    }

    /// `G̃`.
    fn scale(&mut self, jacobian: &SparseMatrix) -> &SparseMatrix {
        let Self { units, scales, matrix, .. } = self;
        let shape = jacobian.shape();
        scales.clear();
        scales.resize(shape.0, 0.0);
        jacobian.for_each(|i, j, value| {
            let own = value * units[j];
            scales[i] += own * own;
        });
        let unit = |square: f64| if square > 0.0 { 1.0 / square.sqrt() } else { 1.0 };
        scales.iter_mut().for_each(|scale| *scale = unit(*scale));
        SparseMatrix::update(matrix, shape, |out: &mut dyn Entries| {
            jacobian.for_each(|i, j, value| out.add(i, j, scales[i] * value * units[j]));
        })
    }

    /// `λ ←` multipliers with this `force`, `Gᵀλ`, where `rank` rows are independent; shape `m`.
    pub fn multipliers(
        &mut self,
        jacobian: &SparseMatrix,
        rank: usize,
        force: &[f64],
        lambda: &mut [f64],
    ) {
        self.scale(jacobian);
        let Self { units, scales, matrix, least, side, .. } = self;
        let Some(matrix) = matrix else { return };
        let sides = side.iter_mut().zip(force.iter().zip(units));
        sides.for_each(|(side, (force, unit))| *side = *force * *unit);
        least_multipliers(least, matrix, rank, side, lambda);
        lambda.iter_mut().zip(scales).for_each(|(lambda, scale)| *lambda *= *scale);
    }

    /// `a ←` a solution of `G a = b`, shape `n`, as [`LeastNorm::particular`].
    ///
    /// # Errors
    /// As [`LeastNorm::particular`].
    pub fn particular(
        &mut self,
        jacobian: &SparseMatrix,
        b: &[f64],
        a: &mut [f64],
    ) -> Result<(), Singular> {
        self.scale(jacobian);
        let Self { units, scales, matrix, least, right, .. } = self;
        let matrix = matrix.as_ref().ok_or(Singular)?;
        right.clear();
        right.extend(b.iter().zip(&*scales).map(|(b, scale)| b * scale));
        least.particular(matrix, right, a)?;
        a.iter_mut().zip(&*units).for_each(|(a, unit)| *a *= *unit);
        Ok(())
    }

    /// Multipliers in `null Gᵀ` of size one in units of their rows, that contribute to all that is
    /// not unique; none where all rows are independent.
    pub fn null_multipliers(
        &mut self,
        jacobian: &SparseMatrix,
        rank: usize,
        null: &mut Vec<Vec<f64>>,
    ) {
        let m = jacobian.shape().0;
        null.resize_with(usize::from(rank < m), Vec::new);
        let Some(first) = null.first_mut() else { return };
        first.clear();
        first.extend((0..m).map(scattered));
        self.scale(jacobian);
        let Self { scales, matrix, least, .. } = self;
        let Some(matrix) = matrix else { return };
        if least.null_part(matrix, first).is_err() {
            *null = null_vectors(matrix, rank);
        }
        for own in null {
            own.iter_mut().zip(&*scales).for_each(|(lambda, scale)| *lambda *= *scale);
        }
    }
}

/// Unit columns that span the null space of a transposed matrix of which `rank` rows are
/// independent. At a configuration that has lost rank (a flat four-bar) there are more of them.
#[must_use]
pub fn null_vectors(matrix: &SparseMatrix, rank: usize) -> Vec<Vec<f64>> {
    let (m, n) = matrix.shape();
    let mut qr = NullSpaceQr::new(m, n);
    let rank = qr.factorize_scaled(&matrix.to_dense().transpose(), |_| 1.0).min(rank);
    let mut out = nalgebra::DMatrix::zeros(m, m - rank);
    qr.null_space(rank, &mut out);
    out.column_iter().map(|z| z.as_slice().to_vec()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use vi_core::linear::norm_inf;

    /// Two points on a line with rods between them, one of them twice: rows and columns in units
    /// that differ by 1e9.
    #[test]
    fn multipliers_are_those_of_other_units() {
        let rows = [[1.0, 0.3, 0.0], [0.2, -1.0, 0.5], [1.2, -0.7, 0.5], [0.0, 0.4, 1.0]];
        let given = [2.0, -1.0, 0.5, 3.0];
        let found = |length: f64| {
            let (columns, sizes) = ([length, 1.0, length], [1.0, length, 1.0, 1.0 / length]);
            let g = SparseMatrix::assemble(4, 3, |out: &mut dyn Entries| {
                for (i, row) in rows.iter().enumerate() {
                    (0..3).for_each(|j| out.add(i, j, sizes[i] * row[j] / columns[j]));
                }
            });
            let lambda: Vec<f64> = given.iter().zip(sizes).map(|(l, size)| l / size).collect();
            let (mut force, mut own) = (vec![0.0; 3], vec![0.0; 4]);
            g.tr_mul_add(1.0, &lambda, &mut force);
            let mut unit_rows = UnitRows::new(columns.to_vec());
            unit_rows.multipliers(&g, 3, &force, &mut own);
            let mut null = Vec::new();
            unit_rows.null_multipliers(&g, 3, &mut null);
            let mut left = vec![0.0; 3];
            g.tr_mul_add(1.0, &null[0], &mut left);
            let left = left.iter().zip(columns).map(|(x, unit)| x * unit).collect::<Vec<_>>();
            assert!(norm_inf(&left) < 1e-12, "{left:?}");
            own.iter().zip(sizes).map(|(l, size)| l * size).collect::<Vec<f64>>()
        };
        let one = found(1.0);
        for length in [1e-6, 1e-3, 1e3, 1e6] {
            let apart: Vec<f64> = found(length).iter().zip(&one).map(|(a, b)| a - b).collect();
            println!("{length:e}: {:.1e}", norm_inf(&apart));
            assert!(norm_inf(&apart) < 1e-12, "{length:e}: {apart:?}");
        }
    }
}
