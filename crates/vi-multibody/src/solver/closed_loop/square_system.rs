//! A small system of equations with several right-hand sides, by Gaussian elimination.
//!
//! Rows are brought to one scale, and the pivot of a column is its largest entry. The rows of loops
//! that few others meet are short: they are stored as a band, nothing is done outside of their
//! envelope, and entries that vanish are passed over.
//!
//! Source: A. George, J. Liu, Computer Solution of Large Sparse Positive Definite Systems (1981),
//! §4, for the envelope.

use super::echelon::Entry;
use vi_core::newton::Fault;

/// Pivots below this part of the largest entry of their row are none.
const SMALLEST: f64 = 1e-30;

/// Rank up to which rows are taken as full.
pub(super) const SMALL: usize = 8;

/// `C x = b` for several `b`; the solutions take their places.
pub(super) struct SquareSystem {
    rank: usize,
    sides: usize,
    before: usize,     // columns before the diagonal for which a row has room
    width: usize,      // columns of a row
    entries: Vec<f64>, // rank × (width + sides), row by row
    ends: Vec<usize>,  // of each row: behind its last entry
    lows: Vec<usize>,  // of each column: below the last row that begins there or before
}

impl SquareSystem {
    /// For a number of unknowns and of right-hand sides, and full rows.
    pub(super) fn new(rank: usize, sides: usize) -> Self {
        let mut full = Self::of_band(rank, sides, rank);
        full.fit([rank; 2]);
        full
    }

    /// With room for rows of some columns.
    pub(super) fn of_band(rank: usize, sides: usize, widest: usize) -> Self {
        let (ends, lows) = (vec![0; rank], vec![0; rank]);
        let entries = Vec::with_capacity(rank * (widest.min(rank) + sides));
        Self { rank, sides, before: 0, width: 0, entries, ends, lows }
    }

    /// Makes room for rows that have entries in some columns before the diagonal, and in some after
    /// it.
    pub(super) fn fit(&mut self, [before, after]: [usize; 2]) {
        self.width = self.rank.min(2 * before + after + 1); // rows that change places included
        self.before = if self.width < self.rank { before } else { self.rank };
        self.entries.resize(self.rank * (self.width + self.sides), 0.0);
    }

    /// The first column for which row `i` has room.
    fn first(&self, i: usize) -> usize {
        i.saturating_sub(self.before)
    }

    /// Row `i` of `C` from the first column for which it has room, and of the right-hand sides, to
    /// be written in full.
    pub(super) fn row_mut(&mut self, i: usize) -> (&mut [f64], &mut [f64]) {
        let size = self.width + self.sides;
        self.entries[i * size..(i + 1) * size].split_at_mut(self.width)
    }

    /// Row `i` of `C`, and of the right-hand sides.
    pub(super) fn write_row(
        &mut self,
        i: usize,
        entries: impl Iterator<Item = Entry>,
        sides: &[f64],
    ) {
        let first = self.first(i);
        let (own, right) = self.row_mut(i);
        own.fill(0.0);
        entries.for_each(|(k, value)| own[k - first] = value);
        right.copy_from_slice(sides);
    }

    /// Unknown `k` for a right-hand side.
    pub(super) fn solution(&self, k: usize, side: usize) -> f64 {
        self.entries[k * (self.width + self.sides) + self.width + side]
    }

    /// Solves for the right-hand sides from `side` on.
    pub(super) fn solve(&mut self, side: usize) -> Result<(), Fault> {
        self.scale_rows();
        for k in 0..self.rank {
            self.take_pivot(k)?;
            self.eliminate(k, side);
        }
        self.back_substitute(side);
        Ok(())
    }

    fn scale_rows(&mut self) {
        let Self { rank, sides, before, width, entries, ends, lows } = self;
        ends.fill(0);
        lows.fill(0);
        for (i, row) in entries.chunks_exact_mut(*width + *sides).enumerate() {
            let (own, sides) = row.split_at_mut(*width);
            let (mut begin, mut end) = (0, *width);
            if *rank > SMALL || *width < *rank {
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
            let first = i.saturating_sub(*before);
            (ends[i], lows[first + begin]) = (first + end, i + 1);
        }
        let mut low = 0;
        lows.iter_mut().for_each(|own| (low, *own) = (low.max(*own), low.max(*own)));
    }

    /// Brings the largest entry of column `k` into row `k`.
    fn take_pivot(&mut self, k: usize) -> Result<(), Fault> {
        let (width, size) = (self.width, self.width + self.sides);
        let (mut largest, mut place) = (SMALLEST, None);
        for i in k..self.lows[k] {
            let entry = self.entries[i * size + k - self.first(i)].abs();
            if entry > largest {
                (largest, place) = (entry, Some(i));
            }
        }
        let i = place.ok_or(Fault::SingularTangent)?;
        if i > k {
            let [of_k, of_i] = [k, i].map(|row| k - self.first(row));
            let count = self.ends[k].max(self.ends[i]) - k;
            let (above, below) = self.entries.split_at_mut(i * size);
            let (upper, upper_sides) = above[k * size..(k + 1) * size].split_at_mut(width);
            let (lower, lower_sides) = below[..size].split_at_mut(width);
            upper[of_k..of_k + count].swap_with_slice(&mut lower[of_i..of_i + count]);
            upper_sides.swap_with_slice(lower_sides);
            self.ends.swap(i, k);
        }
        Ok(())
    }

    /// Takes row `k` out of the rows below.
    fn eliminate(&mut self, k: usize, side: usize) {
        let (before, width, size) = (self.before, self.width, self.width + self.sides);
        let first = |i: usize| i.saturating_sub(before);
        let (above, below) = self.entries.split_at_mut((k + 1) * size);
        let (ends, ends_below) = self.ends.split_at_mut(k + 1);
        let (pivot, pivot_sides) = above[k * size..].split_at(width);
        let (pivot, end) = (&pivot[k - first(k)..], ends[k]);
        let inverse = 1.0 / pivot[0];
        let below = below.chunks_exact_mut(size).zip(ends_below).take(self.lows[k] - k - 1);
        for (i, (row, own_end)) in (k + 1..).zip(below) {
            let (own, sides) = row.split_at_mut(width);
            let own = &mut own[k - first(i)..];
            if own[0] == 0.0 {
                continue;
            }
            let factor = own[0] * inverse;
            *own_end = end.max(*own_end);
            let entries = own[1..end - k].iter_mut().zip(&pivot[1..end - k]);
            entries.for_each(|(x, p)| *x -= factor * p);
            let sides = sides[side..].iter_mut().zip(&pivot_sides[side..]);
            sides.for_each(|(x, p)| *x -= factor * p);
        }
    }

    fn back_substitute(&mut self, side: usize) {
        let (width, size) = (self.width, self.width + self.sides);
        for k in (0..self.rank).rev() {
            let diagonal = k - self.first(k);
            let (above, below) = self.entries.split_at_mut((k + 1) * size);
            let (own, sides) = above[k * size..].split_at_mut(width);
            let (own, sides) = (&own[diagonal..], &mut sides[side..]);
            let later = own[1..self.ends[k] - k].iter().zip(below.chunks_exact(size));
            for (entry, later) in later.filter(|(entry, _)| **entry != 0.0) {
                let known = sides.iter_mut().zip(&later[width + side..]);
                known.for_each(|(x, later)| *x -= entry * later);
            }
            sides.iter_mut().for_each(|x| *x /= own[0]);
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

    /// Rows of a band, the largest entry of a column anywhere in it.
    fn band(n: usize, [before, after]: [usize; 2], sample: &mut Sample) -> Vec<Vec<Entry>> {
        let row = |i: usize| {
            let columns = i.saturating_sub(before)..(i + after + 1).min(n);
            columns
                .map(|k| (k, sample.array::<1>()[0] + 1.5 * f64::from(u8::from(k == i))))
                .collect()
        };
        (0..n).map(row).collect()
    }

    proptest! {
        #[test]
        fn rows_of_a_band_give_the_bits_of_full_rows(
            n in 1_usize..40, before in 0_usize..4, after in 0_usize..4, seed in any::<u64>(),
        ) {
            let mut sample = Sample::new(seed);
            let rows = band(n, [before, after], &mut sample);
            let mut systems = [SquareSystem::new(n, 2), SquareSystem::of_band(n, 2, 4)];
            systems[1].fit([before, after]);
            for (i, row) in rows.iter().enumerate() {
                let sides = sample.array::<2>();
                systems.iter_mut().for_each(|own| own.write_row(i, row.iter().copied(), &sides));
            }
            let [full, narrow] = systems.each_mut().map(|own| own.solve(0));
            prop_assert_eq!(full, narrow);
            prop_assume!(full.is_ok());
            let of = |own: &SquareSystem| {
                let places = (0..n).flat_map(|k| [(k, 0), (k, 1)]);
                places.map(|(k, side)| own.solution(k, side).to_bits()).collect::<Vec<_>>()
            };
            prop_assert_eq!(of(&systems[0]), of(&systems[1]));
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
