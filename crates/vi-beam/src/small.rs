//! Products and inverses of small matrices.
#![allow(non_snake_case)] // A

use nalgebra::SMatrix;
use vi_core::Number;

/// `A B` of the columns of `A`, column by column; zeros of `B` cost nothing.
#[inline]
pub(crate) fn product<const I: usize, const J: usize, const K: usize>(
    left: &[[f64; I]],
    right: &SMatrix<f64, J, K>,
) -> SMatrix<f64, I, K> {
    let mut out = SMatrix::<f64, I, K>::zeros();
    for (own, factors) in out.data.0.iter_mut().zip(&right.data.0) {
        let mut sum = [0.0; I]; // in registers
        for (column, factor) in left.iter().zip(factors) {
            if *factor != 0.0 {
                sum.iter_mut().zip(column).for_each(|(sum, value)| *sum += factor * value);
            }
        }
        *own = sum;
    }
    out
}

/// `c A`.
#[inline]
pub(crate) fn times<T: Number, const I: usize, const J: usize>(
    c: f64,
    A: &SMatrix<T, I, J>,
) -> SMatrix<T, I, J> {
    *A * T::of(c)
}

/// `A⁻¹` with its derivative, `−A⁻¹A_θA⁻¹`, from a function that inverts its values.
pub(crate) fn inverse<T: Number, const N: usize>(
    A: &SMatrix<T, N, N>,
    of_values: impl FnOnce(SMatrix<f64, N, N>) -> Option<SMatrix<f64, N, N>>,
) -> Option<SMatrix<T, N, N>> {
    let inverse = of_values(A.map(Number::real))?.map(T::of);
    let missed = inverse - inverse * A * inverse;
    Some(inverse + (missed - missed.map(|own| T::of(re(own)))))
}

/// The value of a number.
#[inline]
pub(crate) fn re<T: Number>(x: T) -> f64 {
    Number::real(x)
}
