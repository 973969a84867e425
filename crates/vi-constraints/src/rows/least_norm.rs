//! Multipliers of the least norm, by one sparse factorization.
//!
//! ```text
//! Gᵀλ = w,  |λ| least:     λ = G y,  GᵀG y = w                                                      [5.25]
//! (GᵀG + αI) δ = w − Gᵀλ,   λ ← λ + G δ           α = 1e-12 max_j (GᵀG)_jj                          [5.26]
//! ```
//! `GᵀG` is as sparse as a mass matrix whose bodies are coupled by the joints, so that the cost is
//! linear in the size of chains, trees and rows of loops, whatever the number of redundant rows.
//! `α` makes it definite on `null G`, where `w` has no part and which `G` does not see; a part of
//! `w` along a singular value `σ` is left over by `α/(σ² + α)` and corrected in the next round.
//!
//! With `w = 0` and a start `λ` the same rounds take away from `λ` all but its part in `null Gᵀ`.
//! The same factors give a solution of `G a = b`, where `b` is in the range of `G`:
//! `(GᵀG + αI) δ = Gᵀ(b − G a)`, `a ← a + δ`. It is the least one but for rounding, which the shift
//! enlarges along `null G` to a part of 1e-4 or so.

use super::normal_matrix::NormalMatrix;
use vi_core::linear::{Singular, norm_inf};
use vi_core::sparse::SparseMatrix;

/// Rounds of [5.26].
const ROUNDS: usize = 12;
/// Last correction with which multipliers are accepted, relative to the largest one.
const SETTLED: f64 = 1e-11;
/// What `w` may have outside the range of `Gᵀ`, relative to its size: the shift enlarges the
/// rounding of that part 1e4 times.
const OUTSIDE: f64 = 1e-6;

/// Finds multipliers of the least norm, its memory sized once for the pattern of `G`.
#[derive(Debug, Default)]
pub struct LeastNorm {
    normal: Option<NormalMatrix>,
    change: Vec<f64>, // m
    rest: Vec<f64>,   // n
    declines: bool,   // rows nearly depend on others: the rounds would take that for a force
}

impl LeastNorm {
    /// Leaves it to others where rows nearly depend on one another: along their singular values,
    /// small but no rounding, the shift neither takes a force nor leaves it.
    pub fn decline(&mut self, nearly: bool) {
        self.declines = nearly;
    }

    /// `λ ←` the solution of least norm of `Gᵀλ = w`, shape `m`; `w` is in the range of `Gᵀ` up to
    /// round-off.
    ///
    /// # Errors
    /// [`Singular`] when it is not found to 1e-11: constraints that are about to lose rank, or a
    /// `w` that has a part outside the range.
    pub fn solve(
        &mut self,
        jacobian: &SparseMatrix,
        w: &[f64],
        lambda: &mut [f64],
    ) -> Result<(), Singular> {
        lambda.fill(0.0);
        self.refine(jacobian, Some(w), lambda)
    }

    /// `λ ←` its part in `null Gᵀ`, shape `m`.
    ///
    /// # Errors
    /// As [`LeastNorm::solve`].
    pub fn null_part(
        &mut self,
        jacobian: &SparseMatrix,
        lambda: &mut [f64],
    ) -> Result<(), Singular> {
        self.refine(jacobian, None, lambda)
    }

    /// `a ←` a solution of `G a = b`, shape `n`, not much larger than the least one; `b` is in the
    /// range of `G` up to round-off.
    ///
    /// # Errors
    /// As [`LeastNorm::solve`].
    pub fn particular(
        &mut self,
        jacobian: &SparseMatrix,
        b: &[f64],
        a: &mut [f64],
    ) -> Result<(), Singular> {
        let (normal, change, rest) = self.factorized(jacobian)?;
        a.fill(0.0);
        rounds(0.0, || {
            change.copy_from_slice(b);
            jacobian.mul_add(-1.0, a, change);
            rest.fill(0.0);
            jacobian.tr_mul_add(1.0, change, rest);
            normal.solve(rest)?;
            a.iter_mut().zip(&*rest).for_each(|(a, change)| *a += change);
            Ok((norm_inf(rest), norm_inf(a)))
        })
    }

    /// The rounds of [5.26]; `w` may be zero.
    fn refine(
        &mut self,
        jacobian: &SparseMatrix,
        w: Option<&[f64]>,
        lambda: &mut [f64],
    ) -> Result<(), Singular> {
        if self.declines {
            return Err(Singular);
        }
        let (normal, change, rest) = self.factorized(jacobian)?;
        let (size, mut left) = (w.map_or(f64::INFINITY, norm_inf), 0.0);
        rounds(norm_inf(lambda), || {
            match w {
                Some(w) => rest.copy_from_slice(w),
                None => rest.fill(0.0),
            }
            jacobian.tr_mul_add(-1.0, lambda, rest);
            left = norm_inf(rest);
            normal.solve(rest)?;
            change.fill(0.0);
            jacobian.mul_add(1.0, rest, change);
            lambda.iter_mut().zip(&*change).for_each(|(lambda, change)| *lambda += change);
            Ok((norm_inf(change), norm_inf(lambda)))
        })?;
        if left <= OUTSIDE * size { Ok(()) } else { Err(Singular) }
    }

    /// The factors of a Jacobian, and memory of shapes `m` and `n`.
    fn factorized(
        &mut self,
        jacobian: &SparseMatrix,
    ) -> Result<(&mut NormalMatrix, &mut [f64], &mut [f64]), Singular> {
        let Self { normal, change, rest, .. } = self;
        let known = normal.take().filter(|normal| normal.is_of(jacobian));
        let normal = normal.insert(known.unwrap_or_else(|| {
            let (m, n) = jacobian.shape();
            (*change, *rest) = (vec![0.0; m], vec![0.0; n]);
            NormalMatrix::new(jacobian)
        }));
        normal.factorize(jacobian)?;
        Ok((normal, change, rest))
    }
}

/// Corrects until nothing is left above round-off; each round gives the norms of its correction and
/// of the solution, `size` is that of the start.
fn rounds(
    mut size: f64,
    mut correct: impl FnMut() -> Result<(f64, f64), Singular>,
) -> Result<(), Singular> {
    let mut before = f64::INFINITY;
    for _ in 0..ROUNDS {
        let (now, solution) = correct()?;
        size = size.max(solution);
        if now.is_nan() {
            return Err(Singular);
        }
        let next = if before.is_finite() { now * (now / before) } else { now };
        if now.min(next) <= f64::EPSILON * size {
            return Ok(());
        }
        if now >= 0.5 * before {
            return if now <= SETTLED * size { Ok(()) } else { Err(Singular) };
        }
        before = now;
    }
    if before <= SETTLED * size { Ok(()) } else { Err(Singular) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use vi_core::sparse::Entries;

    /// Rows of which some are combinations of the others, of sizes between 1e-3 and 1e3.
    fn jacobian(m: usize, n: usize, rank: usize) -> DMatrix<f64> {
        let mut count = 0.0_f64;
        let mut next = || {
            count += 1.0;
            (13.7 * count * count).sin()
        };
        let independent = DMatrix::from_fn(rank, n, |_, _| next());
        let mut all = DMatrix::from_fn(m, rank, |_, _| next()) * independent;
        for (i, mut row) in all.row_iter_mut().enumerate() {
            row *= 10.0_f64.powi(i as i32 % 7 - 3);
        }
        all
    }

    fn sparse(dense: &DMatrix<f64>) -> SparseMatrix {
        let (m, n) = dense.shape();
        SparseMatrix::assemble(m, n, |out: &mut dyn Entries| {
            (0..m).for_each(|i| (0..n).for_each(|j| out.add(i, j, dense[(i, j)])));
        })
    }

    #[test]
    fn multipliers_have_the_same_force_and_no_part_in_the_null_space() {
        let (m, n, rank) = (13, 14, 9);
        let dense = jacobian(m, n, rank);
        let given = DVector::from_fn(m, |i, _| (3.1 * (i + 1) as f64).cos());
        let w = dense.tr_mul(&given);
        let (mut least, g) = (LeastNorm::default(), sparse(&dense));
        let (mut lambda, mut null) = (vec![0.0; m], given.as_slice().to_vec());
        least.solve(&g, w.as_slice(), &mut lambda).unwrap();
        least.null_part(&g, &mut null).unwrap();
        let (lambda, null) = (DVector::from_vec(lambda), DVector::from_vec(null));
        let force = (dense.tr_mul(&lambda) - &w).amax() / w.amax();
        let (left, sum) = (dense.tr_mul(&null).amax() / w.amax(), (&lambda + &null - given).amax());
        println!("force {force:e}, Gᵀ of the null part {left:e}, sum of both {sum:e}");
        assert!(force < 1e-14 && left < 1e-14 && sum < 1e-10);
        assert!(null.norm() > 0.1, "redundant rows have a null space");
        assert!((lambda.dot(&null) / lambda.norm()).abs() < 1e-10, "orthogonal to it");
    }

    #[test]
    fn independent_rows_have_no_null_part() {
        let g = sparse(&jacobian(6, 9, 6));
        let mut lambda = [1.0, -2.0, 3.0, 0.5, 0.1, 7.0];
        LeastNorm::default().null_part(&g, &mut lambda).unwrap();
        println!("left {:e}", norm_inf(&lambda));
        assert!(norm_inf(&lambda) < 1e-9);
    }

    #[test]
    fn a_solution_for_given_rates_is_hardly_larger_than_the_least_one() {
        let (m, n, rank) = (13, 14, 9);
        let dense = jacobian(m, n, rank);
        let given = DVector::from_fn(n, |i, _| (3.1 * (i + 1) as f64).cos());
        let b = &dense * &given;
        let mut a = DVector::zeros(n);
        LeastNorm::default().particular(&sparse(&dense), b.as_slice(), a.as_mut_slice()).unwrap();
        let least = dense.clone().pseudo_inverse(1e-9).unwrap() * &b;
        let (left, more) =
            ((&dense * &a - &b).amax() / b.amax(), (&a - &least).norm() / least.norm());
        println!("G a − b {left:e}, beyond the least solution {more:e}");
        assert!(left < 1e-14 && more < 1e-2);
    }

    #[test]
    fn a_part_outside_the_range_is_refused() {
        let (m, n, rank) = (6, 8, 5);
        let mut dense = jacobian(m, n, rank);
        dense.row_iter_mut().for_each(|mut row| _ = row.normalize_mut());
        let (mut least, g) = (LeastNorm::default(), sparse(&dense));
        let mut lambda = vec![0.0; m];
        for k in 1..20_000 {
            let w = DVector::from_fn(n, |i, _| (3.1 * ((i + 1) * k) as f64).cos());
            assert!(least.solve(&g, w.as_slice(), &mut lambda).is_err(), "{k}");
        }
    }

    #[test]
    fn numbers_that_are_not_finite_are_refused() {
        let g = sparse(&DMatrix::from_element(2, 3, f64::NAN));
        assert_eq!(LeastNorm::default().solve(&g, &[1.0; 3], &mut [0.0; 2]), Err(Singular));
    }
}
