//! Products of small matrices.

use nalgebra::SMatrix;

/// `A B` of the columns of `A`, column by column; zeros of `B` cost nothing.
#[inline]
pub(crate) fn product<const I: usize, const J: usize, const K: usize>(
    left: &[[f64; I]],
    right: &SMatrix<f64, J, K>,
) -> SMatrix<f64, I, K> {
    let mut out = SMatrix::<f64, I, K>::zeros();
    for (own, factors) in out.data.0.iter_mut().zip(&right.data.0) {
        for (column, factor) in left.iter().zip(factors) {
            if *factor != 0.0 {
                own.iter_mut().zip(column).for_each(|(own, value)| *own += factor * value);
            }
        }
    }
    out
}
