//! The complement of a cluster of loops: its Newton matrix after the tree below the apex is
//! eliminated, four rows side by side.
//!
//! ```text
//! û_k, p_k  from U_k      forward sweep along its path:  u − S p,  wrench on the apex
//! v̂_i, p'_i from J'_i     the transposed backward sweep:   J'_i δ = v̂_i·û + p'_i·δt_apex
//! C_ik = v̂_i·û_k,   C μ = (p'_i, g_i − v̂_i·x)       right-hand sides: the unit twists of the apex, then the closure
//! ```
//! Both are stored for the links of the path up to the apex alone, so `C` is sparse where few loops
//! meet. How it is solved depends on its size and on where it has entries
//! ([`super::large_matrix`]).
#![allow(non_snake_case)] // C

use super::complement_matrix::ComplementMatrix;
use super::echelon::Entry;
use super::enforced_rows::EnforcedRows;
use super::four_rows::{FourRows, held, in_registers, load};
use super::path::{Paths, RowPlace};
use super::relief::{Relief, SIDES, first_side};
use crate::geometry::one_tree::One;
use crate::pair::Twist;
use crate::solver::tree_step::part::Links;
use crate::sweep::link::Sums;
use nalgebra::Vector3;
use vi_core::lanes::Register;
use vi_core::newton::Fault;

/// `C` with what it is made of; four of its rows, or columns, are a bundle.
pub(super) struct Complement {
    rank: usize,
    left: Left,
    matrix: ComplementMatrix, // C
    relief: Relief,
    line: Vec<FourRows>, // column of C → its entries in four rows
    marked: Vec<bool>,   // bundles in which some are not zero
    met: Vec<usize>,     // these
}

/// `û`: entries of bundles at each column of a cluster, in the order in which they come.
struct Left {
    entries: Vec<LeftEntry>,
    ends: Vec<[usize; 2]>, // column → its first and last entry; NONE
}

struct LeftEntry {
    bundle: usize,
    u: FourRows,
    next: usize, // of its column; NONE
}

const NONE: usize = usize::MAX;

impl Left {
    fn new(columns: usize, bundles: usize) -> Self {
        let entries = Vec::with_capacity(columns * bundles.min(8));
        Self { entries, ends: vec![[NONE; 2]; columns] }
    }

    fn clear(&mut self) {
        self.entries.clear();
        self.ends.fill([NONE; 2]);
    }

    fn push(&mut self, column: usize, bundle: usize, u: FourRows) {
        let (here, [first, last]) = (self.entries.len(), &mut self.ends[column]);
        match self.entries.get_mut(*last) {
            Some(last) => last.next = here,
            None => *first = here,
        }
        *last = here;
        self.entries.push(LeftEntry { bundle, u, next: NONE });
    }

    #[inline(always)]
    fn of_column(&self, column: usize) -> impl Iterator<Item = &LeftEntry> {
        let first = self.entries.get(self.ends[column][0]);
        std::iter::successors(first, |entry| self.entries.get(entry.next))
    }
}

impl Complement {
    /// For the links of a cluster and the rank of its loops.
    pub(super) fn new(paths: &Paths, rank: usize) -> Self {
        let bundles = rank.div_ceil(4);
        Self {
            rank,
            left: Left::new(paths.columns.len(), bundles),
            matrix: ComplementMatrix::new(rank, first_side(paths.apex)),
            relief: Relief::new(rank),
            line: vec![[0.0; 4]; 4 * bundles],
            marked: vec![false; bundles],
            met: Vec::with_capacity(bundles),
        }
    }

    /// As if it were large.
    #[cfg(test)]
    pub(super) fn make_large(&mut self, paths: &Paths) {
        self.matrix = ComplementMatrix::large(self.rank, first_side(paths.apex));
    }

    /// Solves for the multipliers; the links of the cluster are eliminated, `x` has been swept up
    /// to its apex.
    pub(super) fn eliminate(
        &mut self,
        EnforcedRows { paths, basis, order, chosen, g }: EnforcedRows<'_>,
        at: RowPlace<'_>,
        links: Links<'_>,
        x: &[f64],
    ) -> Result<(), Fault> {
        self.left.clear();
        for bundle in 0..self.rank.div_ceil(4) {
            for (row, k) in (4 * bundle..self.rank).take(4).enumerate() {
                let Paths { four, kept, owner, links, .. } = &mut *paths;
                let mut put = |(column, value): Entry| {
                    four.values[column][row] = value;
                    four.touch(owner[column], links);
                };
                match order.get(k) {
                    Some(&k) => basis.entries(k).for_each(put),
                    None => kept.row(k).iter().for_each(|entry| put(*entry)),
                }
            }
            paths.four.order_touched();
            let wrenches = self.add_columns(bundle, paths, links);
            if paths.apex.is_some() {
                let own = self.relief.wrenches[4 * bundle..].iter_mut().take(4).enumerate();
                own.for_each(|(row, wrench)| *wrench = of_row(&wrenches, row));
            }
            paths.four.clear(&paths.links);
        }
        self.matrix.clear();
        for (bundle, own) in chosen.chunks(4).enumerate() {
            paths.write_four(own, (at, links));
            for &i in own {
                let path = paths.rows[i].path.iter();
                path.for_each(|&k| paths.four.touch(k, &paths.links));
            }
            paths.four.order_touched();
            let (twists, moved) = self.gather_rows(paths, links, x);
            for row in 0..own.len() {
                let i = 4 * bundle + row;
                self.write_row(i, row, &twists, g[i] - moved[row]);
            }
            self.met.drain(..).for_each(|b| self.marked[b] = false);
            paths.four.clear(&paths.links);
        }
        self.matrix.solve(&mut self.relief)
    }

    /// `û_k`, `p_k` of a bundle of columns.
    fn add_columns(&mut self, bundle: usize, paths: &mut Paths, at: Links<'_>) -> [FourRows; 6] {
        let Paths { four, links, .. } = paths;
        let mut transmit = || in_registers!(lanes => four.transmit(lanes, links, at));
        let wrenches = transmit();
        for column in four.touched.iter().flat_map(|&k| links[k].columns()) {
            self.left.push(column, bundle, four.values[column]);
        }
        wrenches
    }

    /// `p'_i` and `v̂_i·x` of four rows, and their entries of `C`.
    fn gather_rows(
        &mut self,
        paths: &mut Paths,
        at: Links<'_>,
        x: &[f64],
    ) -> ([FourRows; 6], FourRows) {
        in_registers!(lanes => self.gather_in(lanes, paths, at, x))
    }

    #[inline(always)]
    fn gather_in<T: Register>(
        &mut self,
        lanes: T,
        paths: &mut Paths,
        at: Links<'_>,
        x: &[f64],
    ) -> ([FourRows; 6], FourRows) {
        let Self { left, line, marked, met, .. } = self;
        let Paths { four, links, columns, .. } = paths;
        let twists = four.transmit_transposed(lanes, links, at);
        let mut moved = lanes.splat(0.0);
        for column in four.touched.iter().flat_map(|&k| links[k].columns()) {
            let v = load(lanes, &four.values[column]);
            moved = moved + v * x[columns[column]];
            for LeftEntry { bundle, u, .. } in left.of_column(column) {
                let own = &mut line[4 * bundle..4 * bundle + 4];
                if !marked[*bundle] {
                    marked[*bundle] = true;
                    met.push(*bundle);
                    own.fill([0.0; 4]);
                }
                own[0] = held(load(lanes, &own[0]) + v * u[0]);
                own[1] = held(load(lanes, &own[1]) + v * u[1]);
                own[2] = held(load(lanes, &own[2]) + v * u[2]);
                own[3] = held(load(lanes, &own[3]) + v * u[3]);
            }
        }
        (twists, held(moved))
    }

    /// Row `i` of `C`, one of the four at hand, with its right-hand sides.
    fn write_row(&mut self, i: usize, row: usize, twists: &[FourRows; 6], gap: f64) {
        let Self { rank, matrix, line, met, .. } = self;
        let mut sides = [gap; SIDES];
        sides.iter_mut().zip(twists).for_each(|(side, part)| *side = part[row]);
        if matrix.is_large() {
            met.sort_unstable();
        }
        let columns = met.iter().flat_map(|&b| 4 * b..(4 * b + 4).min(*rank));
        let entries = columns.map(|k| (k, line[k][row])).filter(|e| e.1 != 0.0);
        matrix.write_row(i, entries, sides);
    }

    /// Relieves the apex of the cluster, by the sums over what hangs on it.
    pub(super) fn relieve(&self, sums: &mut Sums<One>) {
        self.relief.parts().for_each(|part| sums.relieve(part));
    }

    /// Adds what the multipliers do to `x`, now that the motion of the apex is known.
    pub(super) fn release(&mut self, paths: &Paths, apex: Option<&Twist>, x: &mut [f64]) {
        let multipliers = self.relief.multipliers(apex);
        for (k, &column) in paths.columns.iter().enumerate() {
            for LeftEntry { bundle, u, .. } in self.left.of_column(k) {
                let own = u.iter().zip(&multipliers[4 * bundle..]);
                x[column] += own.map(|(u, multiplier)| u * multiplier).sum::<f64>();
            }
        }
    }
}

fn of_row(parts: &[FourRows; 6], row: usize) -> Twist {
    let vector = |first: usize| Vector3::from_fn(|i, _| parts[first + i][row]);
    Twist::new(vector(0), vector(3))
}
