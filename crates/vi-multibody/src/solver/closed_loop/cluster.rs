//! Loops that share links of the tree, and their part of a Newton step.
//!
//! A row of `g_c` is felt by the links between its two sides and their lowest common carrier, the
//! *apex*. Rows whose paths share a link form a cluster; the cluster's apex carries all of them,
//! and what happens below it is eliminated there, before the recursion goes on towards the root:
//! ```text
//! û_k = L⁻¹ U_kᵀ,  p_k wrench on the apex          leaf → apex, along the path of U_k
//! v̂_i = L'⁻¹ J'_iᵀ,  p'_i                           the same, transposed
//! C   = v̂ᵀ û,   C μ = g − v̂ᵀ û(x) − p'ᵀ δt_apex
//! Â_apex ← Â_apex − p C⁻¹ p'ᵀ,   p_apex ← p_apex + p C⁻¹ (g − v̂ᵀ û(x))
//! ```
//! `C` is sparse where few loops meet; a cluster on few links is solved with dense matrices.
//!
//! Letters: `U_k` basis of `range J_nᵀ`, `J'_i` the rows enforced, `û` unknowns of the forward
//! sweep.
#![allow(non_snake_case)] // U, J, C

use super::complement::Complement;
use super::echelon::{Echelon, Entry};
use super::enforced_rows::EnforcedRows;
use super::path::{Paths, RowPlace};
use crate::geometry::one_tree::One;
use crate::pair::Twist;
use crate::solver::tree_step::part::Links;
use crate::sweep::link::Sums;
use crate::tree::maps::TreeMaps;
use nalgebra::DMatrix;
use vi_constraints::null_space::RANK_TOLERANCE;
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_core::linear::SparseLu;
use vi_core::newton::Fault;
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::state::Memory;

/// Smallest pivot of rows that are clearly independent, relative to their largest entry.
const CLEAR: f64 = 1.0 / 16.0;

/// Smallest pivot of rows that are kept where others nearly follow from them, relative to that of
/// the clearest rows.
const KEPT: f64 = 0.25;

/// Number of rows from which on rows that are long are not tried alone: they are rarely found to be
/// clearly independent.
const MANY: usize = 256;

/// By how much a pivot may change with the increments of a step, relative to these and to the
/// largest entry.
const CHANGE: f64 = 4.0;

/// Reads what [`Cluster::remember`] wrote, cluster by cluster.
pub(crate) struct Recall<'a> {
    indices: &'a [usize],
    values: &'a [f64],
}

/// What a cluster needs of the last node.
struct LastNode<'a> {
    chosen: &'a [usize],
    lengths: &'a [usize], // of the rows of U
    columns: &'a [usize],
    values: &'a [f64],
}

impl<'a> Recall<'a> {
    /// From the beginning.
    pub(crate) fn new(memory: &'a Memory) -> Self {
        Self { indices: &memory.indices, values: &memory.values }
    }

    /// Of the next cluster, with a certain rank; `None` where the memory is of other loops.
    fn next(&mut self, rank: usize, rows: usize, width: usize) -> Option<LastNode<'a>> {
        let (chosen, rest) = self.indices.split_at_checked(rank)?;
        let (count, rest) = rest.split_first()?;
        let (lengths, rest) = rest.split_at_checked(*count)?;
        let entries = lengths.iter().try_fold(0_usize, |sum, &length| sum.checked_add(length))?;
        let (columns, indices) = rest.split_at_checked(entries)?;
        let (own, values) = self.values.split_at_checked(entries)?;
        let fits = chosen.iter().all(|&i| i < rows) && columns.iter().all(|&c| c < width);
        (self.indices, self.values) = (indices, values);
        fits.then_some(LastNode { chosen, lengths, columns, values: own })
    }
}

/// Loops that share links.
pub(crate) struct Cluster {
    pub(crate) paths: Paths,
    rank: usize,                         // generic
    positions: Vec<usize>,               // rows that configurations have to satisfy
    nearly: bool,                        // whether other rows nearly follow from as many
    basis: Echelon,                      // U: rows of J at q_n
    is_of_chosen: bool,                  // whether they are the chosen ones
    next: Echelon,                       // rows of J' at q_{n+1}, or of J wherever it is asked for
    chosen: Vec<usize>,                  // rows enforced at q_{n+1}
    order: Vec<usize>,                   // pivots of U, by their rows
    g: Vec<f64>,                         // of the chosen rows
    complement: Option<Box<Complement>>, // on the sweeps of the tree
}

impl Cluster {
    /// From its rows and links; `weights` say what one is for each unknown of the tree.
    pub(crate) fn new(paths: Paths, weights: &[f64]) -> Self {
        let own: Vec<f64> = paths.columns.iter().map(|&column| weights[column]).collect();
        let rows = paths.rows.len() + paths.rows.len().min(own.len()); // and those of the last node
        let echelon = || Echelon::new(rows, own.clone(), 1).of_unit_rows(); // scaled so
        Self {
            rank: 0,
            positions: Vec::new(),
            nearly: false,
            basis: echelon(),
            is_of_chosen: false,
            next: echelon(),
            chosen: Vec::new(),
            order: Vec::new(),
            g: Vec::new(),
            complement: None,
            paths,
        }
    }

    /// Sets the generic rank, and the rows to enforce as long as nothing better is known.
    pub(crate) fn set_rank(&mut self, pivots: &[usize]) {
        self.rank = pivots.len();
        self.chosen = pivots.to_vec();
        self.chosen.sort_unstable();
        self.g = vec![0.0; self.rank];
        self.order = Vec::with_capacity(self.rank);
    }

    /// Rows that are not among as many nearly follow from them: those enforced are kept as long as
    /// none are much clearer.
    pub(crate) fn keep_rows(&mut self) {
        self.nearly = true;
    }

    /// As if it were large.
    #[cfg(test)]
    pub(super) fn eliminate_as_large(&mut self) {
        if let Some(complement) = &mut self.complement {
            complement.make_large(&self.paths);
        }
    }

    /// The generic rank.
    pub(crate) fn rank(&self) -> usize {
        self.rank
    }

    /// The link of the tree that carries it; `None`: the ground.
    pub(crate) fn apex(&self) -> Option<usize> {
        self.paths.apex
    }

    /// The largest rank it can have.
    pub(crate) fn full_rank(&self) -> usize {
        self.paths.columns.len().min(self.paths.rows.len())
    }

    /// Finds the rank of `J`; `side` gives a right-hand side for each row of `g_c`.
    pub(crate) fn rank_here(&mut self, at: RowPlace<'_>, side: &[f64]) -> usize {
        self.paths.fill(&mut self.next, at, side);
        self.next.eliminate(usize::MAX, RANK_TOLERANCE)
    }

    /// The same with the rows that configurations have to satisfy: all but those of velocities.
    pub(crate) fn rank_of_positions(&mut self, at: RowPlace<'_>, side: &[f64]) -> usize {
        self.positions.clear();
        let rows = self.paths.rows.iter().enumerate();
        let rows = rows.filter(|(_, row)| !row.row.is_of_velocities()).map(|(i, _)| i);
        self.positions.extend(rows);
        self.paths.fill_with(&mut self.next, self.positions.iter().copied(), at, side);
        self.next.eliminate(usize::MAX, RANK_TOLERANCE)
    }

    /// The same with the given rows and another tolerance.
    pub(crate) fn rank_within(
        &mut self,
        rows: &[usize],
        at: RowPlace<'_>,
        side: &[f64],
        tolerance: f64,
    ) -> usize {
        self.paths.fill_with(&mut self.next, rows.iter().copied(), at, side);
        self.next.eliminate(usize::MAX, tolerance)
    }

    /// The smallest of as many pivots as the rank, and the next one, zero where there is none.
    pub(crate) fn pivots_about(
        &mut self,
        rows: &[usize],
        at: RowPlace<'_>,
        rank: usize,
    ) -> [f64; 2] {
        let mut smallest = |most: usize| {
            self.paths.fill_with(&mut self.next, rows.iter().copied(), at, &[]);
            let found = self.next.eliminate(most, RANK_TOLERANCE);
            if found == most { self.next.smallest() } else { 0.0 }
        };
        [smallest(rank), smallest(rank + 1)]
    }

    /// Another measure of rows and columns in rank decisions.
    pub(crate) fn measure(&mut self, scales: &[f64], weights: &[f64]) {
        self.paths.rows.iter_mut().zip(scales).for_each(|(row, scale)| row.scale = *scale);
        self.next.reweigh(weights.iter().copied());
    }

    /// Row `i` of `J` over the columns of the cluster, not scaled.
    pub(crate) fn plain_row(&mut self, i: usize, at: RowPlace<'_>) -> &[Entry] {
        self.paths.write_row(i, at)
    }

    /// The independent rows of the last [`Cluster::rank_here`], the clearest first.
    pub(crate) fn pivots(&self) -> &[usize] {
        self.next.pivots()
    }

    /// The rank of some of its rows alone.
    pub(crate) fn rank_of(&mut self, rows: &[usize], at: RowPlace<'_>) -> usize {
        self.paths.fill_with(&mut self.next, rows.iter().copied(), at, &[]);
        self.next.eliminate(usize::MAX, RANK_TOLERANCE)
    }

    /// The `k`-th pivot row of the last [`Cluster::rank_here`] over the unknowns of the tree.
    pub(crate) fn pivot_row(&self, k: usize) -> impl Iterator<Item = Entry> + '_ {
        let columns = &self.paths.columns;
        let own = self.next.entries(k).filter(|e| e.0 < columns.len());
        own.map(|(column, value)| (columns[column], value))
    }

    /// Adds to `out` the shortest `x`, measured by the `weights` of the unknowns, with `J x` equal
    /// to the right-hand side in the independent rows of the last [`Cluster::rank_here`].
    pub(crate) fn add_shortest(&self, weights: &[f64], out: &mut [f64]) {
        let (rank, width) = (self.next.pivots().len(), self.paths.columns.len());
        let mut by_column: Vec<Vec<Entry>> = vec![Vec::new(); width + 1];
        for k in 0..rank {
            self.next.entries(k).for_each(|(column, value)| by_column[column].push((k, value)));
        }
        let square = |column: usize| weights[self.paths.columns[column]].powi(2);
        let gram = SparseMatrix::assemble(rank, rank, |out: &mut dyn Entries| {
            for i in 0..rank {
                for (column, value) in self.next.entries(i).filter(|e| e.0 < width) {
                    for &(k, other) in &by_column[column] {
                        out.add(i, k, value * other * square(column));
                    }
                }
            }
        });
        let mut y = vec![0.0; rank];
        by_column[width].iter().for_each(|&(k, side)| y[k] = side);
        let solved = SparseLu::new(&gram).and_then(|mut lu| lu.solve(&gram, &mut y));
        if solved.is_err() {
            return; // nothing is known of the step
        }
        for (column, entries) in by_column[..width].iter().enumerate() {
            let sum: f64 = entries.iter().map(|&(k, value)| value * y[k]).sum();
            out[self.paths.columns[column]] += square(column) * sum;
        }
    }

    /// The null space of the node before the first is the orthogonal complement of the columns of
    /// `range`.
    pub(crate) fn leave_along(&mut self, range: &DMatrix<f64>) {
        self.basis.clear();
        for column in range.column_iter() {
            let own = self.paths.columns.iter().enumerate();
            self.basis.push(own.map(|(k, &at)| (k, column[at])));
        }
        self.basis.eliminate(self.rank, RANK_TOLERANCE);
    }

    /// Appends what the next node needs of this step: the rows enforced, and `U`.
    pub(crate) fn remember(&self, memory: &mut Memory) {
        let rows = 0..self.basis.pivots().len();
        memory.indices.extend_from_slice(&self.chosen);
        memory.indices.push(rows.len());
        memory.indices.extend(rows.clone().map(|k| self.basis.row(k).1.len() + 1));
        for (column, value) in rows.flat_map(|k| self.basis.entries(k)) {
            memory.indices.push(column);
            memory.values.push(value);
        }
    }

    /// `U` at `q_n`: from the rows that were enforced last as long as they are clearly independent,
    /// else from all. At a configuration that loses rank the rows that are missing are those of the
    /// last `U` that do not depend on the new ones.
    pub(crate) fn begin(&mut self, at: RowPlace<'_>, memory: &mut Recall<'_>) {
        let (rows, width) = (self.paths.rows.len(), self.paths.columns.len());
        let last = memory.next(self.rank, rows, width);
        let mut own = 0.0; // smallest pivot of the rows enforced last, where they are independent
        if let Some(last) = &last {
            self.chosen.copy_from_slice(last.chosen);
        }
        if let Some(last) = last.as_ref().filter(|_| rows <= MANY || self.paths.are_short) {
            self.paths.fill_with(&mut self.basis, last.chosen.iter().copied(), at, &[]);
            self.is_of_chosen = self.basis.eliminate(self.rank, RANK_TOLERANCE) == self.rank
                && self.basis.smallest() >= CLEAR * self.basis.largest();
            if self.is_of_chosen {
                return;
            }
            if self.nearly && self.basis.pivots().len() == self.rank {
                own = self.basis.smallest();
            }
        }
        self.is_of_chosen = false;
        self.paths.fill(&mut self.basis, at, &[]);
        let complete = self.basis.eliminate(self.rank, RANK_TOLERANCE) == self.rank;
        if own > KEPT * self.basis.smallest() {
            self.paths.fill_with(&mut self.basis, self.chosen.iter().copied(), at, &[]);
            self.is_of_chosen = self.basis.eliminate(self.rank, RANK_TOLERANCE) == self.rank;
            return;
        }
        let Some(last) = last else { return };
        if complete || last.lengths.is_empty() {
            return;
        }
        let (mut columns, mut values) = (last.columns, last.values);
        for &length in last.lengths {
            let (own, rest) = columns.split_at(length);
            let (numbers, others) = values.split_at(length);
            self.basis.push(own.iter().copied().zip(numbers.iter().copied()));
            (columns, values) = (rest, others);
        }
        self.basis.eliminate(self.rank, RANK_TOLERANCE);
    }

    /// Chooses the rows to enforce: those of `U` where no increment, at most of the size `reach`,
    /// can make them dependent; else from the first trial of `q_{n+1}`. Where they lose rank there,
    /// the last ones stay. Returns the smallest pivot, or a bound of it.
    pub(crate) fn choose_rows(&mut self, at: RowPlace<'_>, reach: f64) -> f64 {
        let smallest = self.basis.smallest();
        let change = CHANGE * reach * self.basis.largest();
        if change <= 0.5 * smallest && self.take_rows_of_basis() {
            return smallest - change;
        }
        if self.nearly && self.is_of_chosen {
            return smallest; // of rows that `begin` compared with the clearest
        }
        self.is_of_chosen = false;
        self.paths.fill(&mut self.next, at, &[]);
        if self.next.eliminate(self.rank, RANK_TOLERANCE) < self.rank {
            return RANK_TOLERANCE;
        }
        self.chosen.copy_from_slice(self.next.pivots());
        self.chosen.sort_unstable(); // neighbours stay neighbours
        self.next.smallest()
    }

    /// Enforces the rows that `U` was found from; `false` where the node has lost rank.
    pub(crate) fn take_rows_of_basis(&mut self) -> bool {
        if self.is_of_chosen {
            return true;
        }
        let (pivots, rows) = (self.basis.pivots(), self.paths.rows.len());
        let complete = pivots.len() == self.rank && pivots.iter().all(|&i| i < rows);
        if complete {
            self.chosen.copy_from_slice(pivots);
            self.chosen.sort_unstable();
        }
        complete
    }

    /// The unknowns of the tree in which the pivots of `U` stand.
    pub(crate) fn dependent(&self) -> impl Iterator<Item = usize> + '_ {
        let rows = 0..self.basis.pivots().len();
        rows.map(|k| self.paths.columns[self.basis.row(k).0])
    }

    /// Lets pivots of `U` stand in `dependent` unknowns alone; `weights` as in [`Cluster::new`].
    pub(crate) fn pivot_in(&mut self, dependent: &[bool], weights: &[f64]) {
        let own = self.paths.columns.iter();
        self.basis.reweigh(own.map(|&at| if dependent[at] { weights[at] } else { 0.0 }));
    }

    /// `U` from the rows that another cluster of the same loops enforces, which are enforced here,
    /// too. Returns the smallest pivot.
    ///
    /// # Errors
    /// [`Fault::SingularTangent`] where they are dependent.
    pub(crate) fn take_rows_of(&mut self, other: &Self, at: RowPlace<'_>) -> Result<f64, Fault> {
        self.chosen.copy_from_slice(&other.chosen);
        self.paths.fill_with(&mut self.basis, self.chosen.iter().copied(), at, &[]);
        if self.basis.eliminate(self.rank, RANK_TOLERANCE) < self.rank {
            return Err(Fault::SingularTangent);
        }
        self.is_of_chosen = self.basis.smallest() >= CLEAR * self.basis.largest();
        Ok(self.basis.smallest())
    }

    /// What a step leaves of the chosen rows: `g_c`, `h A_d`.
    pub(crate) fn close_step(&mut self, s: &Interval) {
        self.paths.gaps(&self.chosen, s, &mut self.g);
    }

    /// `g_c` of the chosen rows.
    pub(crate) fn close(&mut self, at: Configuration<'_>) {
        self.paths.values(&self.chosen, at, &mut self.g);
    }

    /// `−∂g_c/∂t` of the chosen rows in the place of `g_c`: the rates `ν` satisfy `J ν = −∂g_c/∂t`.
    pub(crate) fn close_rates(&mut self, at: Configuration<'_>) {
        for (g, &i) in self.g.iter_mut().zip(&self.chosen) {
            *g = -self.paths.rows[i].row.drift(at);
        }
    }

    /// Takes the part along `range J_nᵀ` out of `b`, and puts `g/h` into the places of the pivots:
    /// rows of both kinds then grow like `1/h`, and the condition number does not depend on `h`.
    pub(crate) fn project(&self, h: f64, b: &mut [f64]) {
        self.project_balance(b);
        self.put_gaps(h, b);
    }

    /// Puts `g/h` into the places of the pivots.
    pub(crate) fn put_gaps(&self, h: f64, b: &mut [f64]) {
        let columns = &self.paths.columns;
        for (k, g) in self.g.iter().enumerate().take(self.basis.pivots().len()) {
            b[columns[self.basis.row(k).0]] = *g / h;
        }
    }

    /// Takes the part along `range J_nᵀ` out of `b`: nothing is left in the places of the pivots.
    pub(crate) fn project_balance(&self, b: &mut [f64]) {
        let columns = &self.paths.columns;
        for k in 0..self.rank.min(self.basis.pivots().len()) {
            let (pivot, rest) = self.basis.row(k);
            let along = std::mem::replace(&mut b[columns[pivot]], 0.0);
            for &(column, value) in rest {
                b[columns[column]] -= along * value;
            }
        }
    }

    /// Leaves nothing in the places of `g`.
    pub(crate) fn clear_closure(&self, b: &mut [f64]) {
        for k in 0..self.basis.pivots().len() {
            b[self.paths.columns[self.basis.row(k).0]] = 0.0;
        }
    }

    /// Takes `g` out of its places again.
    pub(crate) fn split(&mut self, h: f64, x: &mut [f64]) -> Result<(), Fault> {
        if self.basis.pivots().len() < self.rank {
            return Err(Fault::SingularTangent);
        }
        for (k, g) in self.g.iter_mut().enumerate() {
            let place = &mut x[self.paths.columns[self.basis.row(k).0]];
            *g = h * std::mem::replace(place, 0.0);
        }
        Ok(())
    }

    /// Prepares for the sweeps of the tree: rows that are products refer to their links.
    pub(super) fn carry(&mut self, tree: &TreeMaps, home: &[(usize, usize)], links: Links<'_>) {
        self.paths.compact_rows(tree, home, links);
        self.complement = Some(Box::new(Complement::new(&self.paths, self.rank)));
    }

    /// Eliminates the cluster at its apex: all of its links are eliminated, `x` has been swept up
    /// to there.
    pub(super) fn eliminate(
        &mut self,
        place: RowPlace<'_>,
        links: Links<'_>,
        x: &[f64],
    ) -> Result<(), Fault> {
        let Self { paths, basis, chosen, order, g, complement, .. } = self;
        order.clear();
        // neighbours among the rows are neighbours among the columns of `C`
        if !self.is_of_chosen {
            order.extend(0..chosen.len());
            order.sort_unstable_by_key(|&k| basis.pivots()[k]);
        }
        let Some(complement) = complement else { return Err(Fault::SingularTangent) };
        complement.eliminate(EnforcedRows { paths, basis, order, chosen, g }, place, links, x)
    }

    /// Relieves the apex, by the sums over what hangs on it.
    pub(super) fn relieve(&self, sums: &mut Sums<One>) {
        if let Some(complement) = &self.complement {
            complement.relieve(sums);
        }
    }

    /// The multipliers are known with the motion of the apex: their part of `x`.
    pub(super) fn release(&mut self, apex: Option<&Twist>, x: &mut [f64]) {
        if let Some(complement) = &mut self.complement {
            complement.release(&self.paths, apex, x);
        }
    }

    /// Visits the entries of `U` over the unknowns of the tree: `(k, column, value)`.
    pub(crate) fn for_each_entry(&self, mut visit: impl FnMut(usize, usize, f64)) {
        for k in 0..self.rank {
            let columns = &self.paths.columns;
            self.basis.entries(k).for_each(|(column, value)| visit(k, columns[column], value));
        }
    }

    /// The same for the rows enforced at `q_{n+1}`.
    pub(crate) fn for_each_enforced(
        &mut self,
        at: RowPlace<'_>,
        mut visit: impl FnMut(usize, usize, f64),
    ) {
        let Self { paths, chosen, .. } = self;
        for (k, &i) in chosen.iter().enumerate() {
            paths.write_row(i, at);
            for &(column, value) in paths.last_row() {
                visit(k, paths.columns[column], value);
            }
        }
    }

    /// `g` of the chosen rows.
    pub(crate) fn gaps(&self) -> &[f64] {
        &self.g
    }
}
