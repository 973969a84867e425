//! The complement of a cluster of loops: its Newton matrix after the tree below the apex is
//! eliminated.
//!
//! ```text
//! û_k, p_k  from U_k      forward sweep along its path:  u − S p,  wrench on the apex
//! v̂_i, p'_i from J'_i     the transposed backward sweep:   J'_i δ = v̂_i·û + p'_i·δt_apex
//! C_ik = v̂_i·û_k
//! ```
//! Both are stored for the links of the path up to the apex alone, so `C` is sparse where few loops
//! meet. How it is solved depends on its size and on where it has entries
//! ([`super::large_matrix`]).
#![allow(non_snake_case)] // C

use super::complement_matrix::ComplementMatrix;
use super::echelon::{CAPACITY, Entry};
use super::path::Paths;
use super::relief::{Relief, SIDES, first_side};
use crate::pair::Twist;
use crate::solver::articulated::Articulated;
use vi_core::newton::Fault;

/// `C` with what it is made of.
pub(crate) struct Complement {
    left: Vec<Vec<Entry>>,    // column → (k, û_k)
    right: Vec<Vec<Entry>>,   // i → (column, v̂_i)
    rows: usize,              // rows added
    matrix: ComplementMatrix, // C
    relief: Relief,
    sweep: Sweep,
    line: Vec<f64>,  // a row of C
    met: Vec<usize>, // its nonzero entries
}

/// Scratch of a sweep along paths.
struct Sweep {
    wrenches: Vec<Twist>, // of each link
    values: Vec<f64>,     // of each column
    marked: Vec<bool>,    // links
    touched: Vec<usize>,  // links, deepest first
}

impl Sweep {
    /// Spreads a row over the columns, and finds the links from there to the apex.
    fn take_up(&mut self, row: impl Iterator<Item = Entry>, paths: &Paths) {
        self.touched.clear();
        for (column, value) in row {
            self.values[column] = value;
            let mut at = Some(paths.owner[column]);
            while let Some(k) = at.filter(|&k| !self.marked[k]) {
                self.marked[k] = true;
                self.touched.push(k);
                at = paths.links[k].parent;
            }
        }
        self.touched.sort_unstable();
    }

    /// Sweeps to the apex; `each` sees the values of a link, and turns its wrench into that of its
    /// parent.
    fn run(
        &mut self,
        paths: &Paths,
        transmit: impl Fn(usize, &Twist, &mut [f64]) -> Twist,
        mut keep: impl FnMut(usize, f64),
    ) -> Twist {
        let mut out = Twist::zero();
        for &k in &self.touched {
            let link = &paths.links[k];
            let wrench = std::mem::replace(&mut self.wrenches[k], Twist::zero());
            let own = &mut self.values[link.first..link.first + link.dof];
            let transmitted = transmit(link.link, &wrench, own);
            for (j, value) in own.iter_mut().enumerate() {
                keep(link.first + j, std::mem::replace(value, 0.0));
            }
            self.marked[k] = false;
            match link.parent {
                Some(parent) => self.wrenches[parent].add_scaled(1.0, &transmitted),
                None => out.add_scaled(1.0, &transmitted),
            }
        }
        out
    }
}

impl Complement {
    /// For the links of a cluster and the rank of its loops.
    pub(crate) fn new(paths: &Paths, rank: usize) -> Self {
        let (links, columns) = (paths.links.len(), paths.columns.len());
        let sweep = Sweep {
            wrenches: vec![Twist::zero(); links],
            values: vec![0.0; columns],
            marked: vec![false; links],
            touched: Vec::with_capacity(links),
        };
        let list = || Vec::with_capacity(CAPACITY.min(columns.max(rank)));
        let vec = |count| (0..count).map(|_| list()).collect();
        Self {
            left: vec(columns),
            right: vec(rank),
            rows: 0,
            matrix: ComplementMatrix::new(rank, first_side(paths.apex)),
            relief: Relief::new(rank),
            sweep,
            line: vec![0.0; rank],
            met: Vec::with_capacity(2 * rank),
        }
    }

    pub(crate) fn clear(&mut self) {
        self.left.iter_mut().for_each(Vec::clear);
        self.matrix.clear();
        self.rows = 0;
    }

    /// `û_k`, `p_k` from `U_k`.
    pub(crate) fn add_column(
        &mut self,
        k: usize,
        basis: impl Iterator<Item = Entry>,
        paths: &Paths,
        tree: &Articulated,
    ) {
        let Self { sweep, left, relief, .. } = self;
        sweep.take_up(basis, paths);
        let transmit = |link: usize, p: &Twist, own: &mut [f64]| tree.transmit(link, p, own);
        relief.wrenches[k] =
            sweep.run(paths, transmit, |column, value| left[column].push((k, value)));
    }

    /// `v̂_i`, `p'_i` from the row of `J'` last written, and its row of `C` with the right-hand
    /// sides.
    pub(crate) fn add_row(&mut self, g: f64, paths: &Paths, tree: &Articulated, x: &[f64]) {
        let Self { sweep, left, right, rows, matrix, line, met, .. } = self;
        let own = &mut right[*rows];
        own.clear();
        sweep.take_up(paths.last_row().iter().copied(), paths);
        let transmit =
            |link: usize, p: &Twist, own: &mut [f64]| tree.transmit_transposed(link, p, own);
        let twist = sweep.run(paths, transmit, |column, value| own.push((column, value)));
        let mut closure = g;
        met.clear();
        for &(column, value) in own.iter() {
            closure -= value * x[paths.columns[column]];
            for &(k, other) in &left[column] {
                if line[k] == 0.0 {
                    met.push(k);
                }
                line[k] += value * other;
            }
        }
        let mut sides = [closure; SIDES];
        let along = twist.linear.iter().chain(twist.angular.iter());
        sides.iter_mut().zip(along).for_each(|(side, v)| *side = *v);
        if matrix.is_large() {
            met.sort_unstable();
            met.dedup(); // a sum may have passed through zero
        }
        matrix.write_row(*rows, met.iter().map(|&k| (k, line[k])), sides);
        met.iter().for_each(|&k| line[k] = 0.0);
        *rows += 1;
    }

    /// Solves for the multipliers, and relieves the apex of the cluster.
    pub(crate) fn solve(
        &mut self,
        apex: Option<usize>,
        tree: &mut Articulated,
    ) -> Result<(), Fault> {
        let Self { matrix, relief, .. } = self;
        matrix.solve(relief)?;
        relief.relieve(apex, tree);
        Ok(())
    }

    /// Adds what the multipliers do to `x`, now that the motion of the apex is known.
    pub(crate) fn release(&mut self, paths: &Paths, tree: &mut Articulated, x: &mut [f64]) {
        let apex = paths.apex.map(|apex| *tree.wrench(apex));
        let multipliers = self.relief.multipliers(apex.as_ref());
        for (&column, entries) in paths.columns.iter().zip(&self.left) {
            x[column] += entries.iter().map(|&(k, value)| multipliers[k] * value).sum::<f64>();
        }
    }
}
