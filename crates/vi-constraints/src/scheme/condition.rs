//! Condition numbers of the Newton matrix of a step.

use crate::saddle_point::SaddlePoint;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use vi_core::interval::Interval;
use vi_core::linear::condition_number;
use vi_core::newton::Fault;

/// Condition numbers of a Newton matrix.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConditionNumbers {
    /// Of the matrix as the equations are written.
    pub as_written: f64,
    /// Of the matrix that is factorized (scaled by powers of `h` where that differs).
    pub scaled: f64,
}

impl ConditionNumbers {
    /// Of the saddle-point matrix of a step: multiplier columns carry `h²`, momentum rows `1/h` as
    /// written.
    #[must_use]
    pub fn of_saddle_point(saddle: &SaddlePoint, s: &Interval) -> Option<Self> {
        let scaled = saddle.matrix()?.to_dense();
        let (n, size, h) = (s.dim(), scaled.ncols(), s.h);
        let mut written = scaled.clone();
        written.view_mut((0, n), (n, size - n)).scale_mut(h * h);
        written.view_mut((0, 0), (n, size)).scale_mut(1.0 / h);
        Some(Self { as_written: condition_number(&written), scaled: condition_number(&scaled) })
    }

    /// Of a matrix whose first `d` rows were multiplied by `h`.
    #[must_use]
    pub fn of_scaled_rows(scaled: &DMatrix<f64>, d: usize, h: f64) -> Self {
        let mut written = scaled.clone();
        written.rows_mut(0, d).scale_mut(1.0 / h);
        Self { as_written: condition_number(&written), scaled: condition_number(scaled) }
    }

    /// Of the inverse of a `d × d` matrix that is known by its solutions alone: `solve` turns a
    /// right-hand side into one. `None` where it cannot.
    pub fn of_inverse(
        d: usize,
        mut solve: impl FnMut(&mut [f64]) -> Result<(), Fault>,
    ) -> Option<Self> {
        let mut inverse = DMatrix::identity(d, d);
        for column in inverse.as_mut_slice().chunks_exact_mut(d.max(1)) {
            solve(column).ok()?;
        }
        Some(Self::unscaled(condition_number(&inverse)))
    }

    /// Of a matrix that is factorized as it is written.
    #[must_use]
    pub fn unscaled(number: f64) -> Self {
        Self { as_written: number, scaled: number }
    }
}
