//! Dense factorizations whose last bits do not depend on the machine.
//!
//! ```text
//! LU    Π A = L U          partial pivoting, column by column         Golub & Van Loan, Alg. 3.4.1
//! QR    A Π = Q [R; 0]     Householder vectors, column pivoting       Golub & Van Loan, Alg. 5.4.1
//! ```
//! Each entry is computed by the same operations in the same order on every processor: products and
//! sums are rounded one by one, and sums have a fixed order. The wide registers of the processor
//! are chosen at run time ([`pulp`]); they change the speed, not a bit. Libraries that use fused
//! multiply-add where they find it do not have this property.
#![allow(non_snake_case)] // A, L, U, Q, R

use crate::vectors::dot;
use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut};
use pulp::Arch;

/// `y ← y + a x`.
#[inline(always)]
fn add_scaled(y: &mut [f64], a: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += a * x;
    }
}

/// `A ← L U` in place, by columns; `pivots[k]` is the row that was exchanged with row `k`.
pub(crate) fn lu(A: &mut DMatrix<f64>, pivots: &mut [usize]) {
    let n = A.nrows();
    Arch::new().dispatch(
        #[inline(always)]
        || {
            for j in 0..n {
                let (left, right) = A.as_mut_slice().split_at_mut(j * n);
                let column = &mut right[..n];
                (0..j).for_each(|k| column.swap(k, pivots[k]));
                for (k, known) in left.chunks_exact(n).enumerate() {
                    let (above, below) = column.split_at_mut(k + 1);
                    add_scaled(below, -above[k], &known[k + 1..]);
                }
                let larger =
                    |p: usize, i: usize| if column[i].abs() > column[p].abs() { i } else { p };
                let p = (j + 1..n).fold(j, larger);
                pivots[j] = p;
                column.swap(j, p);
                left.chunks_exact_mut(n).for_each(|known| known.swap(j, p));
                let (above, below) = column.split_at_mut(j + 1);
                below.iter_mut().for_each(|entry| *entry /= above[j]);
            }
        },
    );
}

/// `b ← A⁻¹ b` with the factors of [`lu`].
pub(crate) fn solve_lu(LU: &DMatrix<f64>, pivots: &[usize], b: &mut [f64]) {
    let n = b.len();
    let column = |k: usize| &LU.as_slice()[k * n..(k + 1) * n];
    Arch::new().dispatch(
        #[inline(always)]
        || {
            pivots.iter().enumerate().for_each(|(k, &p)| b.swap(k, p));
            for k in 0..n {
                let (known, rest) = b.split_at_mut(k + 1);
                add_scaled(rest, -known[k], &column(k)[k + 1..]);
            }
            for k in (0..n).rev() {
                let (rest, known) = b.split_at_mut(k);
                known[0] /= column(k)[k];
                add_scaled(rest, -known[0], &column(k)[..k]);
            }
        },
    );
}

/// Squared lengths that differ by less, relative to the largest, are equal.
const TIE: f64 = 1e-9;

/// Householder QR with column pivoting, its memory sized once.
#[derive(Clone, Debug)]
pub struct PivotedQr {
    // n × m  R, and below its diagonal the Householder vectors, their first entry 1
    factors: DMatrix<f64>,
    squares: Vec<f64>,  // m  squared lengths of what is left of the columns
    scales: Vec<f64>,   // min(n, m)  β of H = I − β v vᵀ
    pivots: Vec<usize>, // m  column of A that stands at each place
}

impl PivotedQr {
    /// For `n × m` matrices.
    #[must_use]
    pub fn new(n: usize, m: usize) -> Self {
        Self {
            factors: DMatrix::zeros(n, m),
            squares: vec![0.0; m],
            scales: vec![0.0; n.min(m)],
            pivots: (0..m).collect(),
        }
    }

    /// For `n × m` matrices from now on, the matrix set to zero; memory is taken only where there
    /// was never as much in use.
    pub fn resize(&mut self, n: usize, m: usize) {
        let matrix = std::mem::replace(&mut self.factors, DMatrix::zeros(0, 0));
        let mut entries: Vec<f64> = matrix.data.into();
        entries.clear();
        entries.resize(n * m, 0.0);
        self.factors = DMatrix::from_vec(n, m, entries);
        self.squares.resize(m, 0.0);
        self.scales.resize(n.min(m), 0.0);
        self.pivots.resize(m, 0);
    }

    /// The matrix to factorize; overwritten by [`PivotedQr::factorize`].
    pub fn matrix_mut(&mut self) -> &mut DMatrix<f64> {
        &mut self.factors
    }

    /// Factorizes what [`PivotedQr::matrix_mut`] holds. Of columns that are equally long but for
    /// rounding the first is taken; the others keep their order.
    pub fn factorize(&mut self) {
        let Self { factors: A, squares, scales, pivots } = self;
        let n = A.nrows();
        pivots.iter_mut().enumerate().for_each(|(k, pivot)| *pivot = k);
        Arch::new().dispatch(
            #[inline(always)]
            || {
                for k in 0..scales.len() {
                    for (c, square) in squares.iter_mut().enumerate().skip(k) {
                        let rest = &A.as_slice()[c * n + k..(c + 1) * n];
                        *square = dot(rest, rest);
                    }
                    let most = squares[k..].iter().copied().fold(0.0, f64::max);
                    let longest =
                        squares[k..].iter().position(|square| *square >= (1.0 - TIE) * most);
                    let longest = k + longest.unwrap_or(0); // none: they are not finite
                    let size = squares[longest];
                    pivots[k..=longest].rotate_right(1);
                    (k..longest).rev().for_each(|c| A.swap_columns(c, c + 1));
                    let (left, right) = A.as_mut_slice().split_at_mut((k + 1) * n);
                    let own = &mut left[k * n + k..];
                    scales[k] = reflect(own, size.sqrt());
                    for column in right.chunks_exact_mut(n) {
                        apply(&own[1..], scales[k], &mut column[k..]);
                    }
                }
            },
        );
    }

    /// `R` in the upper triangle; below are the Householder vectors.
    #[must_use]
    pub fn factors(&self) -> &DMatrix<f64> {
        &self.factors
    }

    /// `R_kk`.
    #[must_use]
    pub fn diagonal(&self, k: usize) -> f64 {
        self.factors[(k, k)]
    }

    /// The columns of the matrix in the order of their pivots.
    #[must_use]
    pub fn pivots(&self) -> &[usize] {
        &self.pivots
    }

    /// The Householder vector `k` without its first entry 1.
    fn reflector(&self, k: usize) -> &[f64] {
        let n = self.factors.nrows();
        &self.factors.as_slice()[k * n + k + 1..(k + 1) * n]
    }

    /// `out ← Q out`, shape `n × any`.
    pub fn apply_q(&self, out: &mut DMatrix<f64>) {
        let n = self.factors.nrows();
        out.as_mut_slice().chunks_exact_mut(n.max(1)).for_each(|column| self.apply_q_to(column));
    }

    /// `x ← Q x`, shape `n`.
    pub fn apply_q_to(&self, x: &mut [f64]) {
        Arch::new().dispatch(
            #[inline(always)]
            || {
                for (k, &scale) in self.scales.iter().enumerate().rev() {
                    apply(self.reflector(k), scale, &mut x[k..]);
                }
            },
        );
    }

    /// `x ← Qᵀ x`, shape `n`.
    pub fn apply_q_transposed(&self, x: &mut [f64]) {
        Arch::new().dispatch(
            #[inline(always)]
            || {
                for (k, &scale) in self.scales.iter().enumerate() {
                    apply(self.reflector(k), scale, &mut x[k..]);
                }
            },
        );
    }
}

/// `x ← (∓|x|, v₂, v₃, …)` with the Householder vector `v`, `v₁ = 1`; returns its `β`.
/// `size = |x|`.
#[inline(always)]
fn reflect(x: &mut [f64], size: f64) -> f64 {
    let first = x[0];
    if size == 0.0 {
        return 0.0;
    }
    let image = -size.copysign(first);
    x[1..].iter_mut().for_each(|x| *x /= first - image);
    x[0] = image;
    (image - first) / image
}

/// `x ← x − β v (vᵀ x)`, `v` without its first entry 1.
#[inline(always)]
fn apply(v: &[f64], beta: f64, x: &mut [f64]) {
    let (first, rest) = x.split_at_mut(1);
    let along = beta * (first[0] + dot(v, rest));
    first[0] -= along;
    add_scaled(rest, -along, v);
}

/// `C ← A B`, column by column.
pub fn set_product(
    mut C: DMatrixViewMut<'_, f64>,
    A: DMatrixView<'_, f64>,
    B: DMatrixView<'_, f64>,
) {
    C.fill(0.0);
    add_product(C, 1.0, A, B);
}

/// `C ← C + a A B`, column by column.
pub fn add_product(
    mut C: DMatrixViewMut<'_, f64>,
    a: f64,
    A: DMatrixView<'_, f64>,
    B: DMatrixView<'_, f64>,
) {
    Arch::new().dispatch(
        #[inline(always)]
        || {
            for (mut column, factors) in C.column_iter_mut().zip(B.column_iter()) {
                for (b, known) in factors.iter().zip(A.column_iter()) {
                    add_scaled(column.as_mut_slice(), a * b, known.as_slice());
                }
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use vi_testkit::Sample;

    fn matrix(n: usize, m: usize, seed: u64) -> DMatrix<f64> {
        Sample::new(seed).matrix(n, m)
    }

    proptest! {
        #[test]
        fn lu_solves_to_round_off(n in 1_usize..24, seed in any::<u64>()) {
            let A = matrix(n, n, seed);
            let (mut LU, mut pivots) = (A.clone(), vec![0; n]);
            lu(&mut LU, &mut pivots);
            let b = matrix(n, 1, seed ^ 7);
            let mut x = b.clone();
            solve_lu(&LU, &pivots, x.as_mut_slice());
            let (residual, size) = ((&A * &x - &b).amax(), x.amax().max(1.0));
            prop_assert!(residual < 1e-13 * size, "{residual:e} of {size:e}");
        }

        #[test]
        fn qr_gives_the_matrix_back(n in 1_usize..20, m in 1_usize..20, seed in any::<u64>()) {
            let A = matrix(n, m, seed);
            let mut qr = PivotedQr::new(n, m);
            qr.matrix_mut().copy_from(&A);
            qr.factorize();
            let mut back = qr.factors.upper_triangle();
            qr.apply_q(&mut back);
            let placed = DMatrix::from_fn(n, m, |i, k| A[(i, qr.pivots()[k])]);
            prop_assert!((back - placed).amax() < 1e-14 * (n + m) as f64);
            let mut Q = DMatrix::identity(n, n);
            qr.apply_q(&mut Q);
            prop_assert!((Q.tr_mul(&Q) - DMatrix::identity(n, n)).amax() < 1e-14);
            let sizes: Vec<f64> = (0..n.min(m)).map(|k| qr.diagonal(k).abs()).collect();
            prop_assert!(sizes.windows(2).all(|pair| pair[1] <= pair[0] * (1.0 + TIE)), "{sizes:?}");
        }

        #[test]
        fn products_and_sums(n in 0_usize..9, m in 0_usize..9, l in 0_usize..9, seed in any::<u64>()) {
            let (A, B, mut C) = (matrix(n, m, seed), matrix(m, l, seed ^ 1), matrix(n, l, seed ^ 2));
            let exact = &C + 0.7 * (&A * &B);
            add_product(C.as_view_mut(), 0.7, A.as_view(), B.as_view());
            prop_assert!(C.is_empty() || (C - exact).amax() < 1e-14);
        }
    }

    /// The bits of sums in the plain order of their definition, whatever registers are used.
    #[test]
    fn wide_registers_change_no_bit() {
        let n = 37;
        let A = matrix(n, n, 5);
        let (mut wide, mut pivots) = (A.clone(), vec![0; n]);
        lu(&mut wide, &mut pivots);
        let mut plain = A;
        for j in 0..n {
            (0..j).for_each(|k| plain.swap((k, j), (pivots[k], j)));
            for k in 0..j {
                for i in k + 1..n {
                    let product = plain[(k, j)] * plain[(i, k)];
                    plain[(i, j)] -= product;
                }
            }
            (0..=j).for_each(|c| plain.swap((j, c), (pivots[j], c)));
            for i in j + 1..n {
                plain[(i, j)] /= plain[(j, j)];
            }
        }
        assert_eq!(wide, plain);
    }
}
