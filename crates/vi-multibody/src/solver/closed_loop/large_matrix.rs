//! A large complement of loops with its right-hand sides: as a band where loops meet few others, by
//! a sparse LU where they branch, by a dense one where chains of loops fill it.

use super::echelon::{CAPACITY, Entry};
use super::square_system::SquareSystem;
use nalgebra::DMatrix;
use vi_core::linear::{DenseLu, Singular, SparseLu};
use vi_core::newton::Fault;
use vi_core::sparse::{Entries, SparseMatrix};

/// Rank up to which the envelope is eliminated, however wide it is.
const MODERATE: usize = 128;
/// Columns of a row up to which a band is eliminated, of any rank.
const NARROW: usize = 64;
/// Part of the entries from which on the matrix counts as full.
const FULL: f64 = 0.2;

/// A matrix with its solver.
enum LargeFactors {
    Sparse(Box<(SparseMatrix, SparseLu)>),
    Dense(DMatrix<f64>, DenseLu),
}

/// A large `C` with its right-hand sides.
pub(super) struct LargeMatrix {
    rank: usize,
    count: usize,           // of right-hand sides
    rows: Vec<ColumnRange>, // of entries
    entries: Vec<Entry>,
    sides: Vec<f64>, // rank × count, row by row
    band: SquareSystem,
    is_band: bool, // at the last solution
    places: Vec<(usize, usize)>,
    known: Vec<(usize, usize)>, // places of the factors
    factors: Option<LargeFactors>,
    solutions: Vec<f64>, // of the factors, column by column
}

type ColumnRange = std::ops::Range<usize>;

impl LargeMatrix {
    /// For a number of rows and of right-hand sides.
    pub(super) fn new(rank: usize, count: usize) -> Self {
        Self {
            rank,
            count,
            rows: Vec::with_capacity(rank),
            entries: Vec::with_capacity(rank * rank.min(CAPACITY)),
            sides: Vec::with_capacity(rank * count),
            band: SquareSystem::of_band(rank, count, MODERATE),
            is_band: true,
            places: Vec::new(),
            known: Vec::new(),
            factors: None,
            solutions: Vec::new(),
        }
    }

    /// Before the rows are written.
    pub(super) fn clear(&mut self) {
        self.rows.clear();
        self.entries.clear();
        self.sides.clear();
    }

    /// Adds a row with its right-hand sides. Its entries are in the order of their columns.
    pub(super) fn push_row(&mut self, entries: impl Iterator<Item = Entry>, sides: &[f64]) {
        let begin = self.entries.len();
        self.entries.extend(entries);
        self.rows.push(begin..self.entries.len());
        self.sides.extend_from_slice(sides);
    }

    /// Unknown `k` for a right-hand side.
    pub(super) fn solution(&self, k: usize, side: usize) -> f64 {
        match self.is_band {
            true => self.band.solution(k, side),
            false => self.solutions[side * self.rank + k],
        }
    }

    /// Solves for the right-hand sides.
    pub(super) fn solve(&mut self) -> Result<(), Fault> {
        let [before, after] = self.extent();
        self.is_band = self.rank <= MODERATE || 2 * before + after < NARROW;
        if self.is_band {
            return self.solve_band([before, after]);
        }
        self.scale_rows();
        Ok(self.solve_factors()?)
    }

    /// Columns before and after the diagonal that a row has entries in.
    fn extent(&self) -> [usize; 2] {
        let mut extent = [0; 2];
        for (i, row) in self.rows.iter().enumerate() {
            if let [(first, _), .., (last, _)] | [(first @ last, _)] = &self.entries[row.clone()] {
                extent = [
                    extent[0].max(i.saturating_sub(*first)),
                    extent[1].max(last.saturating_sub(i)),
                ];
            }
        }
        extent
    }

    fn solve_band(&mut self, extent: [usize; 2]) -> Result<(), Fault> {
        self.band.fit(extent);
        let sides = self.sides.chunks_exact(self.count);
        for (i, (row, sides)) in self.rows.iter().zip(sides).enumerate() {
            self.band.write_row(i, self.entries[row.clone()].iter().copied(), sides);
        }
        self.band.solve(0)
    }

    /// Brings all rows to one scale.
    fn scale_rows(&mut self) {
        let sides = self.sides.chunks_exact_mut(self.count);
        for (row, sides) in self.rows.iter().zip(sides) {
            let own = &mut self.entries[row.clone()];
            let largest = own.iter().map(|e| e.1.abs()).fold(0.0, f64::max);
            let scale = if largest > 0.0 { 1.0 / largest } else { 1.0 };
            own.iter_mut().for_each(|e| e.1 *= scale);
            sides.iter_mut().for_each(|side| *side *= scale);
        }
    }

    fn solve_factors(&mut self) -> Result<(), Singular> {
        let Self { rank, count, rows, entries, sides, places, known, factors, solutions, .. } =
            self;
        places.clear();
        let own = rows.iter().enumerate();
        places.extend(own.flat_map(|(i, row)| entries[row.clone()].iter().map(move |e| (i, e.0))));
        let emit = |out: &mut dyn Entries| {
            places.iter().zip(&*entries).for_each(|(&(i, j), e)| out.add(i, j, e.1));
        };
        let is_full = places.len() as f64 > FULL * (*rank * *rank) as f64;
        match factors {
            Some(LargeFactors::Dense(matrix, _)) if is_full => matrix.fill(0.0),
            Some(LargeFactors::Sparse(own)) if places == known => own.0.refill(emit),
            _ if is_full => {
                let matrix = DMatrix::zeros(*rank, *rank);
                *factors = Some(LargeFactors::Dense(matrix, DenseLu::new(*rank)));
            }
            _ => {
                let matrix = SparseMatrix::assemble(*rank, *rank, emit);
                let lu = SparseLu::new(&matrix)?;
                *factors = Some(LargeFactors::Sparse(Box::new((matrix, lu))));
                known.clone_from(places);
            }
        }
        solutions.clear();
        solutions.extend((0..*count).flat_map(|side| sides[side..].iter().step_by(*count)));
        match factors.as_mut().expect("just written") {
            LargeFactors::Sparse(own) => own.1.solve(&own.0, solutions),
            LargeFactors::Dense(matrix, lu) => {
                places.iter().zip(&*entries).for_each(|(&at, e)| matrix[at] = e.1);
                lu.factorize(matrix);
                solutions.chunks_exact_mut(*rank).try_for_each(|side| lu.solve_factorized(side))
            }
        }
    }
}
