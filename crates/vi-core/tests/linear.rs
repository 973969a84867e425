//! Dense and sparse LU, norms.

use nalgebra::{DVector, dmatrix};
use vi_core::linear::{DenseLu, Singular, SparseLu, condition_number, norm_inf};
use vi_core::sparse::{Entries, SparseMatrix};

#[test]
fn dense_and_sparse_lu_agree_and_refuse_singular_matrices() {
    let a = dmatrix![0.0, 2.0, 1.0; 1.0, -1.0, 0.0; 3.0, 0.0, 4.0];
    let emit = |out: &mut dyn Entries| {
        for i in 0..3 {
            for j in 0..3 {
                out.add(i, j, a[(i, j)]);
            }
        }
    };
    let sparse = SparseMatrix::assemble(3, 3, emit);
    let exact = [0.5, -1.5, 2.0];
    let b = &a * DVector::from_column_slice(&exact);
    let (mut x, mut y) = ([b[0], b[1], b[2]], [b[0], b[1], b[2]]);
    DenseLu::new(3).solve(&a, &mut x).unwrap();
    let mut lu = SparseLu::new(&sparse).unwrap();
    lu.solve(&sparse, &mut y).unwrap();
    let mut two = [b[0], b[1], b[2], 2.0 * b[0], 2.0 * b[1], 2.0 * b[2]];
    lu.solve(&sparse, &mut two).unwrap();
    assert!((0..3).all(|i| two[i] == y[i] && (two[3 + i] - 2.0 * y[i]).abs() < 1e-14));
    let c = a.transpose() * DVector::from_column_slice(&exact);
    let (mut again, mut z) = ([b[0], b[1], b[2]], [c[0], c[1], c[2]]);
    lu.solve(&sparse, &mut again).unwrap();
    lu.solve_transposed(&mut z).unwrap();
    assert!((0..3).all(|i| again[i] == y[i] && (z[i] - exact[i]).abs() < 1e-14), "{z:?}");
    for i in 0..3 {
        assert!((x[i] - exact[i]).abs() < 1e-14 && (y[i] - exact[i]).abs() < 1e-14);
    }
    let singular = dmatrix![1.0, 2.0; 2.0, 4.0];
    assert_eq!(DenseLu::new(2).solve(&singular, &mut [1.0, 0.0]), Err(Singular));
    assert!(condition_number(&singular) > 1e15);
}

#[test]
fn the_norm_does_not_hide_nan() {
    assert!(norm_inf(&[1.0, f64::NAN, 2.0]).is_nan());
    assert!(norm_inf(&[f64::NAN, 1.0]).is_nan());
    assert!(norm_inf(&[1.0, f64::NAN]).is_nan());
    assert_eq!(norm_inf(&[1.0, -3.0, 2.0]), 3.0);
    assert_eq!(norm_inf(&[]), 0.0);
}
