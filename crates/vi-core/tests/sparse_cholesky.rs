//! The sparse Cholesky factorization.

use vi_core::linear::Singular;
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::sparse_cholesky::SparseCholesky;

#[test]
fn the_factors_solve_and_refuse_indefinite_matrices() {
    let lower = |diagonal: f64| {
        move |out: &mut dyn Entries| {
            (0..4).for_each(|i| out.add(i, i, diagonal));
            (1..4).for_each(|i| out.add(i, i - 1, -1.0));
        }
    };
    let mut matrix = SparseMatrix::assemble(4, 4, lower(2.0));
    let mut cholesky = SparseCholesky::new(&matrix).unwrap();
    cholesky.factorize(&matrix).unwrap();
    let mut x = [0.0, 0.0, 0.0, 5.0]; // second differences of 1, 2, 3, 4
    cholesky.solve(&mut x).unwrap();
    let error = (0..4).map(|i| (x[i] - (i + 1) as f64).abs()).fold(0.0, f64::max);
    println!("largest error {error:e}");
    assert!(error < 1e-14);
    matrix.refill(lower(1.0));
    assert_eq!(cholesky.factorize(&matrix), Err(Singular));
    matrix.refill(lower(f64::NAN));
    assert!(cholesky.factorize(&matrix).is_err() || cholesky.solve(&mut x).is_err());
}
