//! Multipliers of the constraints that close loops, from the constraint force of a node.
//!
//! ```text
//! Pᵀ c = J_cᵀ λ_c,   c = Gᵀλ                    constraints of the tree do no work in its velocity map P      [5.29]
//! T J_c = U                                      row echelon form of the rows of each cluster; T J_c = 0 in its other rows
//! y_k = (Pᵀ c − Σ_{j<k} y_j U_j) at pivot k,     λ_c = Tᵀ y
//! ```
//! `T` is found beside `U` by elimination of `[J_c I]`. Rows without a pivot follow from the
//! others: their multipliers are what `T` gives them with the pivots, and their own rows of `T`
//! span `null J_cᵀ`. What is left of `Pᵀ c` is round-off, unless `c` has a part in a direction in
//! which the configuration has lost rank.
#![allow(non_snake_case)] // J, T, U

use super::echelon::Echelon;
use super::loops::Loops;
use super::path::{Maps, Paths, RowPlace};
use crate::mechanism::{Mechanism, NearlyRedundant};
use vi_constraints::null_space::RANK_TOLERANCE;
use vi_constraints::redundancy::scattered;
use vi_core::linear::Singular;
use vi_rigid::directors::FRAME;

/// What may be left of `Pᵀ c`, relative to the size of `c`.
const OUTSIDE: f64 = 1e-6;

/// Finds `λ_c`, its memory sized once.
pub(crate) struct ClosureForces {
    loops: Loops,
    forms: Vec<Echelon>,     // [U T] of each cluster
    ranks: Vec<usize>,       // of clusters where more rows nearly follow from others, at most
    constraints: Vec<usize>, // row of g_c → constraint of the mechanism
    arms: Vec<f64>,          // of each frame
    balance: Vec<f64>,       // Pᵀ c
    part: Vec<f64>,          // of a cluster in the null space
}

impl ClosureForces {
    /// For a mechanism; point masses have no part in it.
    pub(crate) fn new(mechanism: &Mechanism) -> Self {
        let loops = Loops::new(mechanism);
        let form = |paths: &Paths| {
            let weights = paths.columns.iter().map(|&column| loops.weights()[column]);
            let rows = paths.rows.len();
            Echelon::new(rows, weights.collect(), rows).of_unit_rows() // scaled so
        };
        let forms = loops.clusters.iter().map(|cluster| form(&cluster.paths)).collect();
        let ranks = vec![usize::MAX; loops.clusters.len()];
        let bodies = mechanism.description().bodies.len();
        let arms = (0..bodies).map(|frame| mechanism.arm_of(frame)).collect();
        let (constraints, balance) = (mechanism.loop_rows(), vec![0.0; loops.dof()]);
        Self { loops, forms, ranks, constraints, arms, balance, part: Vec::new() }
    }

    /// Takes constraints as redundant that nearly are.
    pub(crate) fn accept(&mut self, nearly: Option<&NearlyRedundant>) {
        let Some(nearly) = nearly else { return };
        let own = self.ranks.iter_mut().zip(&nearly.ranks);
        own.for_each(|(own, rank)| *own = rank.unwrap_or(usize::MAX));
    }

    /// The constraints that close loops.
    pub(crate) fn constraints(&self) -> &[usize] {
        &self.constraints
    }

    /// `λ ← λ_c` in the places of these constraints, at the configuration `q` with the constraint
    /// force `c`.
    ///
    /// # Errors
    /// [`Singular`] when `c` has a part that no closure can have, as where the configuration has
    /// lost rank.
    pub(crate) fn solve(
        &mut self,
        q: &[f64],
        c: &[f64],
        lambda: &mut [f64],
    ) -> Result<(), Singular> {
        let Self { loops, forms, ranks, constraints, arms, balance, .. } = self;
        loops.tree.begin(q, None);
        loops.tree.pull_back(q, c, balance);
        constraints.iter().for_each(|&row| lambda[row] = 0.0);
        let outside = OUTSIDE * size(c, arms);
        let Loops { tree, clusters, home, column_of, weights, .. } = loops;
        let at = RowPlace { tree, maps: Maps::Pairs, home, column_of, q, next: false, step: None };
        for ((cluster, form), rank) in clusters.iter_mut().zip(forms).zip(ranks) {
            let paths = &mut cluster.paths;
            eliminate(paths, form, *rank, at);
            let width = paths.columns.len();
            for k in 0..form.pivots().len() {
                let (pivot, rest) = form.row(k);
                let y = std::mem::replace(&mut balance[paths.columns[pivot]], 0.0);
                for &(column, value) in rest {
                    match column.checked_sub(width) {
                        None => balance[paths.columns[column]] -= y * value,
                        Some(i) => lambda[constraints[paths.rows[i].number]] += y * value,
                    }
                }
            }
            let mut left = paths.columns.iter().map(|&at| (weights[at] * balance[at]).abs());
            if !left.all(|left| left <= outside) {
                return Err(Singular);
            }
        }
        Ok(())
    }

    /// Whether multipliers of closures are not unique at the node of the last
    /// [`ClosureForces::solve`]; `λ ←` some that do nothing, the largest of each cluster of size
    /// one in units of its row: all that is not unique has a part in them.
    pub(crate) fn null_part(&mut self, lambda: &mut [f64]) -> bool {
        let Self { loops, forms, constraints, part, .. } = self;
        let mut any = false;
        for (cluster, form) in loops.clusters.iter().zip(forms) {
            let (rows, width) = (&cluster.paths.rows, cluster.paths.columns.len());
            part.clear();
            part.resize(rows.len(), 0.0);
            for (i, entries) in form.others() {
                let factor = scattered(i);
                for &(column, value) in entries.iter().filter(|e| e.0 >= width) {
                    part[column - width] += factor * value;
                }
            }
            let sizes = rows.iter().zip(&*part).map(|(row, part)| (part / row.scale).abs());
            let largest = sizes.fold(0.0, f64::max);
            any |= largest > 0.0;
            let scale = if largest > 0.0 { 1.0 / largest } else { 0.0 };
            rows.iter().zip(&*part).for_each(|(row, part)| {
                lambda[constraints[row.number]] = scale * *part;
            });
        }
        any
    }
}

/// `[U T]` of a cluster, rows scaled as for rank decisions.
fn eliminate(paths: &mut Paths, form: &mut Echelon, rank: usize, at: RowPlace<'_>) {
    form.clear();
    let width = paths.columns.len();
    for i in 0..paths.rows.len() {
        paths.push_row(form, i, at, Some((width + i, 1.0)));
    }
    form.eliminate(rank, RANK_TOLERANCE);
    if rank < usize::MAX {
        form.reduce_others();
    }
}

/// The size of a force on the frames, N·m; on points by their lever arms.
fn size(c: &[f64], arms: &[f64]) -> f64 {
    let largest = |c: &[f64]| c.iter().fold(0.0_f64, |size, c| size.max(c.abs()));
    let of = |(c, arm): (&[f64], &f64)| (arm * largest(&c[..3])).max(largest(&c[3..]));
    c.chunks_exact(FRAME).zip(arms).map(of).fold(0.0, f64::max)
}
