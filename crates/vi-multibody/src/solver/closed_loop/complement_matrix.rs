//! The matrix `C` of a complement with its right-hand sides, by its size.

use super::echelon::Entry;
use super::large_matrix::LargeMatrix;
use super::relief::{Relief, SIDES};
use super::square_system::SquareSystem;
use vi_core::newton::Fault;

/// Rank from which on `C` is solved by a sparse LU.
const LARGE: usize = 128;

/// `C` and what it is solved for: the unit twists of the apex, then the closure.
pub(super) enum ComplementMatrix {
    /// By Gaussian elimination.
    Small(SquareSystem),
    /// By a sparse LU.
    Large(Box<LargeMatrix>),
}

impl ComplementMatrix {
    /// For the rank of a cluster.
    pub(super) fn new(rank: usize) -> Self {
        match rank > LARGE {
            true => Self::Large(Box::new(LargeMatrix::new(rank))),
            false => Self::Small(SquareSystem::new(rank, SIDES)),
        }
    }

    /// Whether its entries are asked for in the order of their columns, each once.
    pub(super) fn is_large(&self) -> bool {
        matches!(self, Self::Large(_))
    }

    /// Before the rows are written.
    pub(super) fn clear(&mut self) {
        if let Self::Large(matrix) = self {
            matrix.clear();
        }
    }

    /// Row `i` with its right-hand sides.
    pub(super) fn write_row(
        &mut self,
        i: usize,
        entries: impl Iterator<Item = Entry> + Clone,
        sides: impl Iterator<Item = f64>,
    ) {
        match self {
            Self::Large(matrix) => matrix.push_scaled(i, entries, sides),
            Self::Small(matrix) => {
                let (own, right) = matrix.row_mut(i);
                own.fill(0.0);
                entries.for_each(|(k, value)| own[k] = value);
                right.iter_mut().zip(sides).for_each(|(right, side)| *right = side);
            }
        }
    }

    /// Solves for the right-hand sides from `first` on.
    pub(super) fn solve(&mut self, first: usize, relief: &mut Relief) -> Result<(), Fault> {
        match self {
            Self::Small(matrix) => {
                matrix.solve(first)?;
                relief.take(|k, side| matrix.solution(k, side), first);
            }
            Self::Large(matrix) => {
                matrix.solve(first)?;
                relief.take(|k, side| matrix.solution(k, side), first);
            }
        }
        Ok(())
    }
}
