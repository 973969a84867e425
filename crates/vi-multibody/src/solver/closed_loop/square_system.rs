//! A small system of equations with several right-hand sides, by Gaussian elimination.
//!
//! Rows are brought to one scale, and the pivot of a column is its largest entry. The rows of loops that few others meet are
//! short: nothing is done outside of their envelope, and entries that vanish are passed over.
//!
//! Source: A. George, J. Liu, Computer Solution of Large Sparse Positive Definite Systems (1981), §4, for the envelope.

use vi_core::newton::Fault;

/// Pivots below this part of the largest entry of their row are none.
const SMALLEST: f64 = 1e-30;

/// Rank up to which rows are taken as full.
const SMALL: usize = 8;

/// `C x = b` for several `b`; the solutions take their places.
pub(super) struct SquareSystem {
    rank: usize,
    sides: usize,
    entries: Vec<f64>, // rank × (rank + sides), row by row
    ends: Vec<usize>,  // of each row: behind its last entry
    lows: Vec<usize>,  // of each column: below the last row that begins there or before
}

impl SquareSystem {
    /// For a number of unknowns and of right-hand sides.
    pub(super) fn new(rank: usize, sides: usize) -> Self {
        let (entries, none) = (vec![0.0; rank * (rank + sides)], vec![0; rank]);
        Self { rank, sides, entries, ends: none.clone(), lows: none }
    }

    /// Row `i` of `C`, and of the right-hand sides, to be written in full.
    pub(super) fn row_mut(&mut self, i: usize) -> (&mut [f64], &mut [f64]) {
        let size = self.rank + self.sides;
        self.entries[i * size..(i + 1) * size].split_at_mut(self.rank)
    }

    /// Unknown `k` for a right-hand side.
    pub(super) fn solution(&self, k: usize, side: usize) -> f64 {
        self.entries[k * (self.rank + self.sides) + self.rank + side]
    }

    /// Solves for the right-hand sides from `first` on.
    pub(super) fn solve(&mut self, first: usize) -> Result<(), Fault> {
        self.scale_rows();
        for k in 0..self.rank {
            self.take_pivot(k)?;
            self.eliminate(k, first);
        }
        self.back_substitute(first);
        Ok(())
    }

    fn scale_rows(&mut self) {
        let Self { rank, sides, entries, ends, lows } = self;
        lows.fill(0);
        for (i, row) in entries.chunks_exact_mut(*rank + *sides).enumerate() {
            let (own, sides) = row.split_at_mut(*rank);
            let (mut begin, mut end) = (0, *rank);
            if *rank > SMALL {
                let Some(first) = own.iter().position(|x| *x != 0.0) else { continue };
                begin = first;
                end = own.iter().rposition(|x| *x != 0.0).map_or(begin, |last| last + 1);
            }
            let own = &mut own[begin..end];
            let largest = own.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
            if largest == 0.0 {
                continue;
            }
            let scale = 1.0 / largest;
            own.iter_mut().for_each(|x| *x *= scale);
            sides.iter_mut().for_each(|x| *x *= scale);
            (ends[i], lows[begin]) = (end, i + 1);
        }
        let mut low = 0;
        lows.iter_mut().for_each(|own| (low, *own) = (low.max(*own), low.max(*own)));
    }

    /// Brings the largest entry of column `k` into row `k`.
    fn take_pivot(&mut self, k: usize) -> Result<(), Fault> {
        let Self { rank, sides, entries, ends, lows } = self;
        let size = *rank + *sides;
        let (mut largest, mut place) = (SMALLEST, None);
        for i in k..lows[k] {
            let entry = entries[i * size + k].abs();
            if entry > largest {
                (largest, place) = (entry, Some(i));
            }
        }
        let i = place.ok_or(Fault::SingularTangent)?;
        if i > k {
            let (above, below) = entries.split_at_mut(i * size);
            above[k * size..(k + 1) * size].swap_with_slice(&mut below[..size]);
            ends.swap(i, k);
        }
        Ok(())
    }

    /// Takes row `k` out of the rows below.
    fn eliminate(&mut self, k: usize, first: usize) {
        let (rank, size) = (self.rank, self.rank + self.sides);
        let (above, below) = self.entries.split_at_mut((k + 1) * size);
        let (ends, ends_below) = self.ends.split_at_mut(k + 1);
        let (pivot, end) = (&above[k * size..], ends[k]);
        let inverse = 1.0 / pivot[k];
        let below = below.chunks_exact_mut(size).zip(ends_below).take(self.lows[k] - k - 1);
        for (row, own_end) in below.filter(|(row, _)| row[k] != 0.0) {
            let factor = row[k] * inverse;
            *own_end = end.max(*own_end);
            let (own, sides) = row.split_at_mut(rank + first);
            let entries = own[k + 1..end].iter_mut().zip(&pivot[k + 1..end]);
            entries.for_each(|(x, p)| *x -= factor * p);
            let sides = sides.iter_mut().zip(&pivot[rank + first..]);
            sides.for_each(|(x, p)| *x -= factor * p);
        }
    }

    fn back_substitute(&mut self, first: usize) {
        let (rank, size) = (self.rank, self.rank + self.sides);
        for k in (0..rank).rev() {
            let (above, below) = self.entries.split_at_mut((k + 1) * size);
            let (own, sides) = above[k * size..].split_at_mut(rank);
            let sides = &mut sides[first..];
            for (entry, later) in own[k + 1..self.ends[k]].iter().zip(below.chunks_exact(size)) {
                if *entry != 0.0 {
                    let known = sides.iter_mut().zip(&later[rank + first..]);
                    known.for_each(|(x, later)| *x -= entry * later);
                }
            }
            sides.iter_mut().for_each(|x| *x /= own[k]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;
    use vi_testkit::Sample;

    proptest! {
        #[test]
        fn solutions_satisfy_sparse_rows_of_any_scale(n in 1_usize..12, seed in any::<u64>()) {
            let mut sample = Sample::new(seed);
            let mut next = || sample.array::<1>()[0];
            let a = DMatrix::from_fn(n, n, |i, j| {
                let value = next();
                if i == j || value > 0.3 { value * 10_f64.powi(i as i32 % 5) } else { 0.0 }
            });
            let unit = DMatrix::from_fn(n, n, |i, j| a[(i, j)] / a.row(i).amax().max(1e-300));
            prop_assume!(unit.singular_values().min() > 1e-2);
            let exact = DVector::from_fn(n, |i, _| 1.0 - 0.7 * i as f64);
            let side = &a * &exact;
            let mut system = SquareSystem::new(n, 2);
            for i in 0..n {
                let (row, sides) = system.row_mut(i);
                row.iter_mut().enumerate().for_each(|(j, x)| *x = a[(i, j)]);
                sides.copy_from_slice(&[f64::NAN, side[i]]);
            }
            prop_assert_eq!(system.solve(1), Ok(()));
            let error = (0..n).map(|k| (system.solution(k, 1) - exact[k]).abs()).fold(0.0, f64::max);
            prop_assert!(error < 1e-11, "{error:e}");
        }
    }

    #[test]
    fn dependent_rows_are_refused() {
        let mut system = SquareSystem::new(2, 1);
        for i in 0..2 {
            system.row_mut(i).0.copy_from_slice(&[1.0, 2.0]);
        }
        assert_eq!(system.solve(0), Err(Fault::SingularTangent));
    }
}
