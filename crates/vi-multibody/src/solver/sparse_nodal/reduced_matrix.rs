//! `P_exᵀ [P_inᵀ K P_in'] P'_ex` in blocks between the unknowns of joints, with a fixed pattern.
//!
//! Where joints have three unknowns and more in the mean, as the free nodes of beams have, the
//! blocks are eliminated as they are ([`BlockLu`]). Elsewhere, and where a pivot block is too
//! small, the entries go to a general sparse LU.
#![allow(non_snake_case)] // K, B, J

use super::layout::{MapColumns, VelocityLayout};
use crate::solver::member_blocks::{MemberBlocks, Span};
use nalgebra::{DMatrix, Matrix6, Vector6};
use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::ops::Range;
use vi_core::block_lu::{BlockLu, inverse_root};
use vi_core::linear::{Singular, SparseLu};
use vi_core::sparse::{Entries, SparseMatrix};

crate::opaque_debug!(ReducedMatrix);

/// Columns of a member that belong to the unknowns of one group.
#[derive(Clone, Debug)]
struct ColumnRun {
    group: usize,
    columns: Range<usize>,
    is_root: bool, // of a free root by its own unknowns
}

/// The matrix between the unknowns of two groups, by rows.
#[derive(Clone, Debug)]
struct Tile {
    row: usize,
    column: usize,
    values: Range<usize>,
}

/// `P_exᵀ [P_inᵀ K P_in'] P'_ex` with its factorization.
#[derive(Default)]
pub struct ReducedMatrix {
    blocks: MemberBlocks,      // of K
    groups: Vec<Range<usize>>, // unknowns of a joint
    runs: Vec<ColumnRun>,
    members: Vec<Range<usize>>, // runs of each member
    tiles: Vec<Tile>,           // by rows, then by columns of groups
    targets: Vec<usize>,        // tile of each product of two runs
    values: Vec<f64>,           // of the tiles
    diagonal: Vec<f64>,         // d
    scale: Vec<f64>,            // d  powers of two
    elimination: OnceCell<Option<BlockLu>>,
    is_eliminated: bool,
    factors: Option<(SparseMatrix, SparseLu)>,
}

impl ReducedMatrix {
    /// Fills the matrix from `K` as `emit` writes it (always the same places in the same order),
    /// with `P` and `P'` as `left` and `right`. `spin`: a 6×6 matrix for each frame that is added
    /// between its twists, or nothing.
    pub fn fill(
        &mut self,
        layout: &VelocityLayout,
        emit: &dyn Fn(&mut dyn Entries),
        left: &MapColumns,
        right: &MapColumns,
        spin: &[Matrix6<f64>],
    ) {
        if self.blocks.is_empty() {
            self.analyse(layout, emit);
        }
        self.blocks.fill(emit, (&left.q, &right.q));
        self.values.fill(0.0);
        let separated = !left.roots.is_empty();
        let mut targets = self.targets.iter();
        for (coupling, B) in self.blocks.reduced() {
            let (mut B, span) = (*B, &layout.members[coupling.row].span);
            if coupling.row == coupling.column && span.size == 12 && !spin.is_empty() {
                B += spin[span.first / 12];
            }
            for b in &self.runs[self.members[coupling.column].clone()] {
                let rows = &self.runs[self.members[coupling.row].clone()];
                if let (true, [root]) = (separated && b.is_root, rows)
                    && root.is_root
                {
                    let tile = targets.next().map_or(0..0, |k| self.tiles[*k].values.clone());
                    add_transposed(&B.data.0, &mut self.values[tile]);
                    continue;
                }
                // B J'
                let mut images: [Vector6<f64>; 6] = std::array::from_fn(|k| B.column(k).into());
                if !(separated && b.is_root) {
                    for (image, J) in images.iter_mut().zip(&right.twists[b.columns.clone()]) {
                        *image = B * J;
                    }
                }
                let images = &images[..b.columns.len()];
                for (a, tile) in rows.iter().zip(&mut targets) {
                    let out = &mut self.values[self.tiles[*tile].values.clone()];
                    match separated && a.is_root {
                        true => add_rows(images, out),
                        false => add_products(&left.twists[a.columns.clone()], images, out),
                    }
                }
            }
        }
        for tile in self.tiles.iter().filter(|tile| tile.row == tile.column) {
            let own = self.groups[tile.row].clone();
            let entries = self.values[tile.values.clone()].iter().step_by(own.len() + 1);
            self.diagonal[own].iter_mut().zip(entries).for_each(|(d, value)| *d = *value);
        }
    }

    fn analyse(&mut self, layout: &VelocityLayout, emit: &dyn Fn(&mut dyn Entries)) {
        let spans: Vec<Span> = layout.members.iter().map(|member| member.span).collect();
        self.blocks.analyse(layout.dim(), &spans, emit);
        let d = layout.dof();
        self.groups = layout.groups();
        let mut group_of = vec![0; d];
        for (k, group) in self.groups.iter().enumerate() {
            group_of[group.clone()].fill(k);
        }
        for (k, member) in layout.members.iter().enumerate() {
            let first = self.runs.len();
            for column in member.columns.clone() {
                let group = group_of[layout.unknowns[column]];
                match self.runs[first..].last_mut() {
                    Some(run) if run.group == group => run.columns.end += 1,
                    _ => {
                        let (columns, is_root) = (column..column + 1, layout.is_root(k));
                        self.runs.push(ColumnRun { group, columns, is_root });
                    }
                }
            }
            self.members.push(first..self.runs.len());
        }
        self.find_tiles();
        (self.diagonal, self.scale) = (vec![0.0; d], vec![1.0; d]);
    }

    fn find_tiles(&mut self) {
        let mut places = Vec::new();
        for coupling in self.blocks.couplings() {
            for b in &self.runs[self.members[coupling.column].clone()] {
                let rows = &self.runs[self.members[coupling.row].clone()];
                places.extend(rows.iter().map(|a| (a.group, b.group)));
            }
        }
        let mut known: BTreeMap<_, usize> = places.iter().map(|place| (*place, 0)).collect();
        let mut length = 0;
        for (&(row, column), index) in &mut known {
            *index = self.tiles.len();
            let start = length;
            length += self.groups[row].len() * self.groups[column].len();
            self.tiles.push(Tile { row, column, values: start..length });
        }
        self.targets = places.iter().map(|place| known[place]).collect();
        self.values = vec![0.0; length];
    }

    /// The blocks between groups, by rows and then by columns of groups, each by rows.
    pub(super) fn tiles(&self) -> impl Iterator<Item = ([usize; 2], &[f64])> {
        self.tiles.iter().map(|tile| ([tile.row, tile.column], &self.values[tile.values.clone()]))
    }

    /// One of these.
    pub(super) fn tile(&self, k: usize) -> &[f64] {
        &self.values[self.tiles[k].values.clone()]
    }

    /// `x ← A⁻¹ x` for the matrix last filled; several right-hand sides may follow one another in
    /// `x`.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn solve(&mut self, x: &mut [f64]) -> Result<(), Singular> {
        let Self { groups, tiles, values, diagonal, elimination, .. } = self;
        elimination.get_or_init(|| elimination_of(groups, tiles));
        self.is_eliminated = false;
        if let Some(Some(lu)) = elimination.get_mut() {
            let blocks = tiles.iter().map(|t| ([t.row, t.column], &values[t.values.clone()]));
            self.is_eliminated = lu.factorize(diagonal, blocks).is_ok();
        }
        if self.is_eliminated { self.solve_again(x) } else { self.solve_by_entries(x) }
    }

    /// Whether [`ReducedMatrix::solve_again`] has factors.
    #[must_use]
    pub fn is_eliminated(&self) -> bool {
        self.is_eliminated
    }

    /// `x ← A⁻¹ x` with the factors of the last [`ReducedMatrix::solve`], where its blocks were
    /// eliminated.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn solve_again(&mut self, x: &mut [f64]) -> Result<(), Singular> {
        let Some(Some(lu)) = self.elimination.get_mut() else { return Err(Singular) };
        x.chunks_exact_mut(self.diagonal.len().max(1)).try_for_each(|x| lu.solve(x))
    }

    /// The same by a general sparse LU.
    fn solve_by_entries(&mut self, x: &mut [f64]) -> Result<(), Singular> {
        for (scale, diagonal) in self.scale.iter_mut().zip(&self.diagonal) {
            *scale = inverse_root(*diagonal);
        }
        let mut factors = self.factors.take();
        let scale = &self.scale;
        let emit = |out: &mut dyn Entries| {
            self.for_each_entry(|i, j, value| out.add(i, j, scale[i] * value * scale[j]));
        };
        match &mut factors {
            Some((matrix, _)) => matrix.refill(emit),
            None => {
                let matrix = SparseMatrix::assemble(scale.len(), scale.len(), emit);
                let lu = SparseLu::new(&matrix)?;
                factors = Some((matrix, lu));
            }
        }
        let (matrix, lu) = self.factors.insert(factors.expect("just written"));
        let weigh = |x: &mut [f64]| {
            let columns = x.chunks_exact_mut(scale.len());
            columns.for_each(|x| x.iter_mut().zip(scale).for_each(|(x, s)| *x *= s));
        };
        weigh(x);
        lu.solve(matrix, x)?;
        weigh(x);
        Ok(())
    }

    /// The entries of the matrix last filled.
    pub(super) fn for_each_entry(&self, mut visit: impl FnMut(usize, usize, f64)) {
        for tile in &self.tiles {
            let (rows, columns) = (&self.groups[tile.row], &self.groups[tile.column]);
            let own = self.values[tile.values.clone()].chunks_exact(columns.len());
            for (i, row) in rows.clone().zip(own) {
                columns.clone().zip(row).for_each(|(j, value)| visit(i, j, *value));
            }
        }
    }

    /// Emits the matrix last filled; always the same places in the same order.
    pub fn emit(&self, out: &mut dyn Entries) {
        self.for_each_entry(|i, j, value| out.add(i, j, value));
    }

    /// The diagonal of the matrix last filled, shape `d`.
    #[must_use]
    pub fn diagonal(&self) -> &[f64] {
        &self.diagonal
    }

    /// Dense copy of the matrix last filled, unscaled; for studies and small problems.
    #[must_use]
    pub fn to_dense(&self) -> DMatrix<f64> {
        let d = self.scale.len();
        let mut dense = DMatrix::zeros(d, d);
        self.for_each_entry(|i, j, value| dense[(i, j)] += value);
        dense
    }
}

/// The elimination of the blocks, where they are large and fill in little.
fn elimination_of(groups: &[Range<usize>], tiles: &[Tile]) -> Option<BlockLu> {
    const SMALLEST: usize = 3; // unknowns of a group, in the mean
    let d = groups.last().map_or(0, |group| group.end);
    if d < SMALLEST * groups.len() {
        return None;
    }
    let sizes: Vec<usize> = groups.iter().map(ExactSizeIterator::len).collect();
    let places: Vec<_> = tiles.iter().map(|tile| [tile.row, tile.column]).collect();
    BlockLu::new(&sizes, &places)
}

/// Adds a block, column by column, by rows.
#[inline]
fn add_transposed(B: &[[f64; 6]; 6], out: &mut [f64]) {
    for (i, row) in out.as_chunks_mut::<6>().0.iter_mut().enumerate() {
        row.iter_mut().zip(B).for_each(|(value, column)| *value += column[i]);
    }
}

/// Adds `B J'_j` by rows.
#[inline]
fn add_rows(images: &[Vector6<f64>], out: &mut [f64]) {
    for (i, row) in out.chunks_exact_mut(images.len()).enumerate() {
        row.iter_mut().zip(images).for_each(|(value, image)| *value += image[i]);
    }
}

/// Adds `J_i · (B J'_j)` by rows.
#[inline]
fn add_products(left: &[Vector6<f64>], images: &[Vector6<f64>], out: &mut [f64]) {
    for (J, row) in left.iter().zip(out.chunks_exact_mut(images.len())) {
        for (image, value) in images.iter().zip(row) {
            *value += J.dot(image);
        }
    }
}
