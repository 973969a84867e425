//! Generalized eigenproblems.
#![allow(non_snake_case)] // K, M

use nalgebra::{DMatrix, dmatrix};
use vi_core::eigen::{EigenError, generalized_eigen};

#[test]
fn a_chain_with_a_free_motion() {
    // three masses 1, 2, 1 on two springs: ω² = 0, k/m, 2k/m
    let K = dmatrix![3.0, -3.0, 0.0; -3.0, 6.0, -3.0; 0.0, -3.0, 3.0];
    let M = dmatrix![1.0, 0.0, 0.0; 0.0, 2.0, 0.0; 0.0, 0.0, 1.0];
    let found = generalized_eigen(&K, &M).unwrap();
    for (k, exact) in [0.0, 3.0, 6.0].into_iter().enumerate() {
        assert!((found.squared[k] - exact).abs() < 1e-14, "{:?}", found.squared);
        let x = found.vectors.column(k);
        assert!((&K * x - exact * &M * x).amax() < 1e-14);
        assert!(((x.transpose() * &M * x)[0] - 1.0).abs() < 1e-14);
        assert!(exact > 0.0 || found.squared[k].abs() <= found.noise[k]);
    }
}

#[test]
fn soft_modes_are_accurate_beside_stiff_ones() {
    // a soft unstable pair seen through a stiff rotation of coordinates
    let exact = [-2e-7, 3e-6, 1.0, 1e12];
    let (c, s) = (0.6, 0.8);
    // exact entries: the stiff direction touches the soft ones by the mass matrix alone
    let M =
        dmatrix![1.0, 0.0, 0.0, 0.0; 0.0, 1.0, 0.0, 0.0; 0.0, 0.0, 1.0, 0.0; 0.0, 0.0, 0.0, 1e-4];
    let K = dmatrix![
        c * c * exact[0] + s * s * exact[1], c * s * (exact[1] - exact[0]), 0.0, 0.0;
        c * s * (exact[1] - exact[0]), s * s * exact[0] + c * c * exact[1], 0.0, 0.0;
        0.0, 0.0, exact[2], 0.0;
        0.0, 0.0, 0.0, 1e-4 * exact[3]
    ];
    let found = generalized_eigen(&K, &M).unwrap();
    for (k, exact) in exact.into_iter().enumerate().take(3) {
        let error = (found.squared[k] / exact - 1.0).abs();
        assert!(error < 1e-9, "{:?}", found.squared); // ε σ with σ = 0.37, not ε 1e12
    }
}

#[test]
fn what_has_no_eigenvalues_is_refused() {
    let (one, nan) = (dmatrix![1.0], dmatrix![f64::NAN]);
    assert_eq!(generalized_eigen(&nan, &one), Err(EigenError::NotFound));
    assert_eq!(generalized_eigen(&one, &dmatrix![0.0]), Err(EigenError::Indefinite));
    let none = DMatrix::zeros(0, 0);
    assert!(generalized_eigen(&none, &none).unwrap().squared.is_empty());
    let still = generalized_eigen(&dmatrix![0.0], &one).unwrap();
    assert_eq!(still.squared, [0.0]);
}
