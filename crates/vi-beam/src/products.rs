//! Products of the quadratic forms of an element with its coordinates.
#![allow(non_snake_case)] // K, A

use crate::helicoidal::{self, FORMS, Forms};
use crate::strain::{ElementCoordinates, SIZE, StrainGradients};
use nalgebra::{Matrix6, SMatrix};

/// `Σ A_kl 𝔹_k x (𝔹_l y)ᵀ + Σ c_k 𝔹_k` of the forms of helicoidal strains.
pub(crate) fn by_forms(
    [x, y]: [&ElementCoordinates; 2],
    length: f64,
    A: &SMatrix<f64, FORMS, FORMS>,
    c: &Forms,
) -> SMatrix<f64, SIZE, SIZE> {
    let left = helicoidal::force(&x.data.0[0], length, &A.transpose());
    let mut K = left * helicoidal::gradients(y, length).transpose();
    add_scalars(&helicoidal::weighted_matrix(c, length), &mut K);
    K
}

/// `columns cᵀ`: column `i` is the sum of `c_ij` times column `j`.
pub(crate) fn weighted(columns: &StrainGradients, c: &Matrix6<f64>) -> StrainGradients {
    let mut out = StrainGradients::zeros();
    for (i, j) in (0..6).flat_map(|i| (0..6).map(move |j| (i, j))) {
        if c[(i, j)] != 0.0 {
            out.column_mut(i).axpy(c[(i, j)], &columns.column(j), 1.0);
        }
    }
    out
}

/// `K ← K + B ⊗ I_3`.
pub(crate) fn add_scalars(B: &SMatrix<f64, 8, 8>, K: &mut SMatrix<f64, SIZE, SIZE>) {
    for (i, j) in (0..8).flat_map(|j| (0..8).map(move |i| (i, j))) {
        (0..3).for_each(|k| K[(3 * i + k, 3 * j + k)] += B[(i, j)]);
    }
}
