//! A large complement of loops with its right-hand sides, by an LU: sparse, or dense where chains of loops fill it.

use super::echelon::Entry;
use super::relief::SIDES;
use nalgebra::DMatrix;
use vi_core::linear::{DenseLu, Singular, SparseLu};
use vi_core::sparse::{Entries, SparseMatrix};

/// Part of the entries from which on the matrix counts as full.
const FULL: f64 = 0.2;

/// A matrix with its solver.
enum Factors {
    Sparse(Box<(SparseMatrix, SparseLu)>),
    Dense(DMatrix<f64>, DenseLu),
}

/// A large `C` with its right-hand sides.
pub(super) struct LargeMatrix {
    rank: usize,
    places: Vec<(usize, usize)>,
    values: Vec<f64>,
    sides: Vec<f64>,            // rank × SIDES, column by column
    known: Vec<(usize, usize)>, // places of the factors
    factors: Option<Factors>,
}

impl LargeMatrix {
    /// For a number of rows.
    pub(super) fn new(rank: usize) -> Self {
        let (places, known) = (Vec::new(), Vec::new());
        Self { rank, places, values: Vec::new(), sides: Vec::new(), known, factors: None }
    }

    /// Before the rows are written.
    pub(super) fn clear(&mut self) {
        self.places.clear();
        self.values.clear();
        self.sides.clear();
        self.sides.resize(SIDES * self.rank, 0.0);
    }

    /// Adds a row with its right-hand sides, all brought to one scale. Its entries are in the order of their columns.
    pub(super) fn push_scaled(
        &mut self,
        row: usize,
        entries: impl Iterator<Item = Entry> + Clone,
        sides: impl Iterator<Item = f64>,
    ) {
        let largest = entries.clone().map(|e| e.1.abs()).fold(0.0, f64::max);
        let scale = if largest > 0.0 { 1.0 / largest } else { 1.0 };
        for (k, value) in entries {
            self.places.push((row, k));
            self.values.push(scale * value);
        }
        for (side, value) in sides.enumerate() {
            self.sides[side * self.rank + row] = scale * value;
        }
    }

    /// Unknown `k` for a right-hand side.
    pub(super) fn solution(&self, k: usize, side: usize) -> f64 {
        self.sides[side * self.rank + k]
    }

    /// Solves for the right-hand sides from `first` on, in their place.
    pub(super) fn solve(&mut self, first: usize) -> Result<(), Singular> {
        let Self { rank, places, values, sides, known, factors } = self;
        let emit = |out: &mut dyn Entries| {
            places.iter().zip(&*values).for_each(|(&(i, j), value)| out.add(i, j, *value));
        };
        let is_full = places.len() as f64 > FULL * (*rank * *rank) as f64;
        match factors {
            Some(Factors::Dense(matrix, _)) if is_full => matrix.fill(0.0),
            Some(Factors::Sparse(own)) if places == known => own.0.refill(emit),
            _ if is_full => {
                let matrix = DMatrix::zeros(*rank, *rank);
                *factors = Some(Factors::Dense(matrix, DenseLu::new(*rank)));
            }
            _ => {
                let matrix = SparseMatrix::assemble(*rank, *rank, emit);
                let lu = SparseLu::new(&matrix)?;
                *factors = Some(Factors::Sparse(Box::new((matrix, lu))));
                known.clone_from(places);
            }
        }
        let sides = &mut sides[first * *rank..];
        match factors.as_mut().expect("just written") {
            Factors::Sparse(own) => own.1.solve(&own.0, sides),
            Factors::Dense(matrix, lu) => {
                places.iter().zip(&*values).for_each(|(&at, value)| matrix[at] = *value);
                lu.factorize(matrix);
                sides.chunks_exact_mut(*rank).try_for_each(|side| lu.solve_factorized(side))
            }
        }
    }
}
