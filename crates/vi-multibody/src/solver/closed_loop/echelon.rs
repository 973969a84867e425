//! Row echelon form of a sparse matrix, which shows its rank, its independent rows and columns.
//!
//! ```text
//! row_i ← row_i − Σ_k row_i[p_k] U_k          pivots k taken so far, p_k their columns
//! U_k   = row / row[p_k]                       largest entry of the row, or one near it
//! ```
//! A row becomes a pivot when it still has an entry above a level, and the level falls by a factor
//! of four from the largest entry on: small pivots wait for all large ones, so no multiplier
//! exceeds a few units and round-off is not amplified. Among entries of similar size the pivot
//! stands in the column that the fewest later rows use, which keeps the rows short. Only nonzero
//! entries are stored.
//!
//! Source: Gaussian elimination with threshold pivoting, Duff, Erisman & Reid, Direct Methods for
//! Sparse Matrices, §5, §7.

use super::pending::Pending;
use std::ops::Range;

/// Factor from one level to the next.
const LEVEL: f64 = 0.25;
/// Entries that may be the pivot of their row, relative to the largest.
const NEAR: f64 = 0.3;
/// Entries of a row for which there is space from the beginning; for more it grows.
pub(crate) const CAPACITY: usize = 32;
/// A row that is left with less than this part of the tolerance is rounding, and is not looked at
/// again.
const SPENT: f64 = 1e-3;
/// Rows up to which a row counts as visited once it was looked at. Among more it does when it
/// becomes a pivot: rows that wait for a lower level count as later rows, and the others stay
/// short.
const SMALL: usize = 100;
const NONE: usize = usize::MAX;

/// A column and its entry.
pub(crate) type Entry = (usize, f64);

#[derive(Clone, Default)]
struct EchelonRow {
    entries: Range<usize>, // a pivot row: without the one at its pivot
    size: f64,             // largest entry in a pivot column, weighted
    seen: usize,           // pivots taken out of it
    pivot: usize,          // column, NONE
    visited: bool,
}

/// Row echelon form without new allocations.
pub(crate) struct Echelon {
    weights: Vec<f64>, // of the columns in which pivots may stand; right-hand sides follow
    rows: Vec<EchelonRow>,
    entries: Vec<Entry>, // of all rows; a row that is reduced moves to the end
    pivots: Vec<usize>,  // rows in pivot order
    order: Vec<usize>,   // column → position of its pivot
    uses: Vec<usize>,    // column → rows not visited yet that have it
    work: Vec<f64>,      // column → entry of the row at hand
    support: Vec<usize>, // its columns
    marked: Vec<bool>,
    pending: Pending, // pivots to be taken out of it
    unit: f64,        // size of a row that does not cancel, 0: not known
    top: f64,         // largest entry of all rows, at least that
    largest: f64,     // entry of all rows
    smallest: f64,
}

impl Echelon {
    /// For `rows` rows over columns of these weights (what one is for each unknown), followed by
    /// `sides` right-hand sides.
    pub(crate) fn new(rows: usize, weights: Vec<f64>, sides: usize) -> Self {
        let (width, all) = (weights.len(), weights.len() + sides);
        Self {
            weights,
            rows: Vec::with_capacity(rows),
            entries: Vec::with_capacity(rows * all.min(CAPACITY)),
            pivots: Vec::with_capacity(rows.min(width)),
            order: vec![NONE; all],
            uses: vec![0; width],
            work: vec![0.0; all],
            support: Vec::with_capacity(all),
            marked: vec![false; all],
            pending: Pending::new(rows.min(width)),
            unit: 0.0,
            top: 0.0,
            largest: 0.0,
            smallest: f64::INFINITY,
        }
    }

    /// For rows of size one where nothing cancels in them: tolerances are then relative to one or
    /// more. Rows that all vanish leave rounding, of which the largest entry is no measure.
    pub(crate) fn of_unit_rows(mut self) -> Self {
        (self.unit, self.top) = (1.0, 1.0);
        self
    }

    /// Other weights of the columns: no pivot stands where they are zero.
    pub(crate) fn reweigh(&mut self, weights: impl Iterator<Item = f64>) {
        self.weights.iter_mut().zip(weights).for_each(|(own, weight)| *own = weight);
    }

    /// Forgets all rows.
    pub(crate) fn clear(&mut self) {
        self.pivots.iter().for_each(|&k| self.order[self.rows[k].pivot] = NONE);
        self.pivots.clear();
        self.uses.fill(0);
        self.rows.clear();
        self.entries.clear();
        self.top = self.unit;
        (self.largest, self.smallest) = (0.0, f64::INFINITY);
    }

    /// Adds a row; entries of the same column must not repeat.
    pub(crate) fn push(&mut self, entries: impl Iterator<Item = Entry>) {
        let begin = self.entries.len();
        self.entries.extend(entries);
        let own = &self.entries[begin..];
        let size = size(own, &self.weights);
        self.top = self.top.max(size);
        self.largest = self.largest.max(size);
        for &(column, _) in own.iter().filter(|e| e.0 < self.weights.len()) {
            self.uses[column] += 1;
        }
        let entries = begin..self.entries.len();
        self.rows.push(EchelonRow { entries, size, seen: 0, pivot: NONE, visited: false });
    }

    /// Takes pivots down to `tolerance` times the largest entry, `rank` in all at most; returns
    /// their number.
    pub(crate) fn eliminate(&mut self, rank: usize, tolerance: f64) -> usize {
        let (mut level, floor) = (self.top, tolerance * self.top);
        while self.pivots.len() < rank && level > floor {
            level = (LEVEL * level).max(floor);
            for i in 0..self.rows.len() {
                if self.rows[i].pivot == NONE && self.pivots.len() < rank {
                    if self.rows.len() <= SMALL {
                        self.visit(i);
                    }
                    if self.rows[i].size > SPENT * floor {
                        self.reduce(i);
                    }
                    if self.rows[i].size > level {
                        self.visit(i);
                        self.take(i);
                    }
                }
            }
        }
        self.pivots.len()
    }

    /// Takes all pivots out of the rows that are none.
    pub(crate) fn reduce_others(&mut self) {
        for i in 0..self.rows.len() {
            if self.rows[i].pivot == NONE {
                self.reduce(i);
            }
        }
    }

    fn visit(&mut self, i: usize) {
        let row = &mut self.rows[i];
        if !row.visited {
            row.visited = true;
            let own = &self.entries[row.entries.clone()];
            for &(column, _) in own.iter().filter(|e| e.0 < self.weights.len()) {
                self.uses[column] -= 1;
            }
        }
    }

    /// Takes the pivots out of row `i` that came since it was last looked at.
    fn reduce(&mut self, i: usize) {
        let Self { rows, entries, pivots, order, work, support, marked, pending, weights, .. } =
            self;
        if rows[i].seen == pivots.len() {
            return;
        }
        support.clear();
        let seen = rows[i].seen;
        let mut add = |column: usize, pending: &mut Pending| {
            support.push(column);
            let pivot = order[column];
            if pivot != NONE && pivot >= seen {
                pending.insert(pivot);
            }
        };
        for &(column, value) in &entries[rows[i].entries.clone()] {
            (work[column], marked[column]) = (value, true);
            add(column, pending);
        }
        while let Some(next) = pending.take_lowest() {
            let pivot = &rows[pivots[next]];
            let factor = std::mem::replace(&mut work[pivot.pivot], 0.0);
            for &(column, value) in &entries[pivot.entries.clone()] {
                if !marked[column] {
                    (work[column], marked[column]) = (0.0, true);
                    add(column, pending);
                }
                work[column] -= factor * value;
            }
        }
        let begin = entries.len();
        for &column in support.iter() {
            marked[column] = false;
            if order[column] == NONE {
                entries.push((column, work[column]));
            }
        }
        let row = &mut rows[i];
        row.size = size(&entries[begin..], weights);
        (row.entries, row.seen) = (begin..entries.len(), pivots.len());
    }

    /// Makes row `i` a pivot.
    fn take(&mut self, i: usize) {
        let Self { rows, entries, pivots, order, uses, weights, .. } = self;
        let row = &mut rows[i];
        let own = &mut entries[row.entries.clone()];
        let near = NEAR * row.size;
        let weighted = |e: &Entry| weights[e.0] * e.1.abs();
        let candidates = own.iter().enumerate();
        let candidates = candidates.filter(|(_, e)| e.0 < weights.len() && weighted(e) >= near);
        let best = candidates
            .min_by(|(_, a), (_, b)| {
                uses[a.0].cmp(&uses[b.0]).then(weighted(b).total_cmp(&weighted(a)))
            })
            .map(|(at, _)| at);
        let Some(at) = best else { return };
        let last = own.len() - 1;
        own.swap(at, last);
        let (column, value) = own[last];
        self.smallest = self.smallest.min(weights[column] * value.abs());
        own[..last].iter_mut().for_each(|e| e.1 /= value);
        row.entries.end -= 1;
        row.pivot = column;
        order[column] = pivots.len();
        pivots.push(i);
    }

    /// The rows that are pivots, in pivot order.
    pub(crate) fn pivots(&self) -> &[usize] {
        &self.pivots
    }

    /// The `k`-th pivot row: its column, where it is one, and the rest of it.
    pub(crate) fn row(&self, k: usize) -> (usize, &[Entry]) {
        let row = &self.rows[self.pivots[k]];
        (row.pivot, &self.entries[row.entries.clone()])
    }

    /// The `k`-th pivot row as a whole.
    pub(crate) fn entries(&self, k: usize) -> impl Iterator<Item = Entry> + '_ {
        let (pivot, rest) = self.row(k);
        std::iter::once((pivot, 1.0)).chain(rest.iter().copied())
    }

    /// The rows that are no pivots, each with its place among all, as the pivots left them.
    pub(crate) fn others(&self) -> impl Iterator<Item = (usize, &[Entry])> {
        let rows = self.rows.iter().enumerate().filter(|(_, row)| row.pivot == NONE);
        rows.map(|(i, row)| (i, &self.entries[row.entries.clone()]))
    }

    /// The largest entry of all rows, weighted.
    pub(crate) fn largest(&self) -> f64 {
        self.largest
    }

    /// The smallest pivot, weighted.
    pub(crate) fn smallest(&self) -> f64 {
        self.smallest
    }
}

fn size(entries: &[Entry], weights: &[f64]) -> f64 {
    let own = entries.iter().filter(|e| e.0 < weights.len());
    own.map(|e| weights[e.0] * e.1.abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut x = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        move || {
            x ^= x << 13;
            x ^= x >> 7;
            x ^= x << 17;
            (x % 20_001) as f64 / 10_000.0 - 1.0
        }
    }

    /// Sparse random rows, some of them combinations of others, `small` times a combination added.
    fn rows(m: usize, n: usize, redundant: usize, seed: u64) -> DMatrix<f64> {
        let mut next = numbers(seed);
        let mut a = DMatrix::zeros(m + redundant, n);
        for i in 0..m {
            for j in 0..n {
                if next() > 0.0 || j == i {
                    a[(i, j)] = next();
                }
            }
        }
        for k in 0..redundant {
            let (one, two) = (next(), next());
            let mix = one * a.row(k % m) + two * a.row((k + 1) % m);
            a.row_mut(m + k).copy_from(&mix);
        }
        a
    }

    impl Echelon {
        /// Solves for the unknowns in the pivot columns with the right-hand side `side`; the others
        /// are as `x` has them.
        fn back_substitute(&self, side: usize, x: &mut [f64]) {
            let width = self.weights.len();
            for k in (0..self.pivots.len()).rev() {
                let (pivot, rest) = self.row(k);
                let mut value = 0.0;
                for &(column, entry) in rest {
                    if column < width {
                        value -= entry * x[column];
                    } else if column == width + side {
                        value += entry;
                    }
                }
                x[pivot] = value;
            }
        }
    }

    fn push(echelon: &mut Echelon, a: &DMatrix<f64>, sides: Option<&DVector<f64>>) {
        for i in 0..a.nrows() {
            let own = (0..a.ncols()).map(|j| (j, a[(i, j)])).filter(|e| e.1 != 0.0);
            echelon.push(own.chain(sides.map(|b| (a.ncols(), b[i]))));
        }
    }

    proptest! {
        #[test]
        fn rank_and_row_space_are_those_of_the_matrix(
            m in 1_usize..8, extra in 0_usize..5, redundant in 0_usize..4, seed in any::<u64>()
        ) {
            let n = m + extra;
            let a = rows(m, n, redundant, seed);
            prop_assume!(a.rows(0, m).clone_owned().singular_values().min() > 1e-2);
            let mut echelon = Echelon::new(m, vec![1.0; n], 1);
            let x = DVector::from_fn(n, |i, _| i as f64 - 1.5);
            for _ in 0..2 {
                echelon.clear();
                push(&mut echelon, &a, Some(&(&a * &x)));
                prop_assert_eq!(echelon.eliminate(m + redundant, 1e-11), m);
            }
            // every null vector of the form is one of the matrix, and the right side belongs to x
            for k in 0..m {
                let row: f64 = echelon.entries(k).filter(|e| e.0 < n).map(|(j, v)| v * x[j]).sum();
                let side: f64 = echelon.entries(k).filter(|e| e.0 == n).map(|e| e.1).sum();
                prop_assert!((row - side).abs() < 1e-9, "{row} {side}");
            }
            let mut z: Vec<f64> = x.iter().map(|x| 0.3 + x * x).collect();
            let free = z.clone();
            let homogeneous = DVector::zeros(m + redundant);
            echelon.clear();
            push(&mut echelon, &a, Some(&homogeneous));
            echelon.eliminate(m, 1e-11);
            echelon.back_substitute(0, &mut z);
            let defect = (&a * DVector::from_column_slice(&z)).amax();
            prop_assert!(defect < 1e-9 * (1.0 + free.iter().sum::<f64>()), "|a z| = {defect:e}");
        }

        #[test]
        fn square_systems_are_solved(n in 1_usize..12, seed in any::<u64>()) {
            let a = rows(n, n, 0, seed);
            prop_assume!(a.singular_values().min() > 1e-2);
            let exact = DVector::from_fn(n, |i, _| 1.0 - 0.7 * i as f64);
            let mut echelon = Echelon::new(n, vec![1.0; n], 1);
            push(&mut echelon, &a, Some(&(&a * &exact)));
            prop_assert_eq!(echelon.eliminate(n, 0.0), n);
            let mut x = vec![0.0; n];
            echelon.back_substitute(0, &mut x);
            let error = (DVector::from_column_slice(&x) - exact).amax();
            prop_assert!(error < 1e-10, "{error:e}");
        }
    }

    #[test]
    fn small_pivots_wait_for_large_ones() {
        // the first row all but depends on the others; its remainder is not blown up into them
        let a = DMatrix::from_row_slice(
            4,
            4,
            &[1e-9, 1e-9, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 1.0],
        );
        let mut echelon = Echelon::new(4, vec![1.0; 4], 0);
        push(&mut echelon, &a, None);
        assert_eq!(echelon.eliminate(4, 1e-11), 3);
        assert_eq!(echelon.pivots()[2], 0, "{:?}", echelon.pivots());
        assert!(echelon.smallest() > 1e-10, "{:e}", echelon.smallest());
    }

    #[test]
    fn rows_that_all_vanish_but_for_rounding_have_no_rank() {
        let rounding = DMatrix::from_row_slice(2, 2, &[1e-17, -3e-17, 2e-17, 0.0]);
        for unit in [false, true] {
            let echelon = Echelon::new(2, vec![1.0; 2], 0);
            let mut echelon = if unit { echelon.of_unit_rows() } else { echelon };
            for _ in 0..2 {
                echelon.clear();
                push(&mut echelon, &rounding, None);
                assert_eq!(echelon.eliminate(2, 1e-11), if unit { 0 } else { 2 });
            }
        }
    }
}
