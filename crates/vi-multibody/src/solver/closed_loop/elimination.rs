//! How a cluster is eliminated at its apex: by dense matrices where it has few links, else row by
//! row.

use super::complement::Complement;
use super::dense_complement::DenseComplement;
use super::echelon::Entry;
use super::path::Paths;
use crate::solver::articulated::Articulated;
use vi_core::newton::Fault;

/// The complement of a cluster, by its size.
pub(super) enum Elimination {
    /// Few links.
    Few(Box<DenseComplement>),
    /// Many.
    Many(Box<Complement>),
}

impl Elimination {
    /// For the links of a cluster and the rank of its loops.
    pub(super) fn new(paths: &Paths, rank: usize) -> Self {
        let many = || Self::of_many(paths, rank);
        DenseComplement::new(paths, rank).map_or_else(many, |few| Self::Few(Box::new(few)))
    }

    /// As if the links were many.
    pub(super) fn of_many(paths: &Paths, rank: usize) -> Self {
        Self::Many(Box::new(Complement::new(paths, rank)))
    }

    pub(super) fn clear(&mut self) {
        if let Self::Many(complement) = self {
            complement.clear();
        }
    }

    /// `û_k`, `p_k` from `U_k`.
    pub(super) fn add_column(
        &mut self,
        k: usize,
        basis: impl Iterator<Item = Entry>,
        paths: &Paths,
        tree: &Articulated,
    ) {
        match self {
            Self::Few(complement) => complement.add_column(k, basis, paths, tree),
            Self::Many(complement) => complement.add_column(k, basis, paths, tree),
        }
    }

    /// Row `k` of `C` with the right-hand sides, from the row of `J'` last written and its `g`.
    pub(super) fn add_row(
        &mut self,
        (k, g): (usize, f64),
        paths: &Paths,
        tree: &Articulated,
        x: &[f64],
    ) {
        match self {
            Self::Few(complement) => complement.add_row((k, g), paths, tree, x),
            Self::Many(complement) => complement.add_row(g, paths, tree, x),
        }
    }

    /// Solves for the multipliers, and relieves the apex of the cluster.
    pub(super) fn solve(
        &mut self,
        apex: Option<usize>,
        tree: &mut Articulated,
    ) -> Result<(), Fault> {
        match self {
            Self::Few(complement) => complement.solve(apex, tree),
            Self::Many(complement) => complement.solve(apex, tree),
        }
    }

    /// Adds what the multipliers do to `x`, now that the motion of the apex is known.
    pub(super) fn release(&mut self, paths: &Paths, tree: &mut Articulated, x: &mut [f64]) {
        match self {
            Self::Few(complement) => complement.release(paths, tree, x),
            Self::Many(complement) => complement.release(paths, tree, x),
        }
    }
}
