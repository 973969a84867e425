//! The matrix `C` of a complement with its right-hand sides, by its size.

use super::echelon::Entry;
use super::large_matrix::LargeMatrix;
use super::relief::{Relief, SIDES};
use super::square_system::{SMALL, SquareSystem};
use vi_core::newton::Fault;

/// `C` and what it is solved for: the unit twists of the apex, where there is one, then the
/// closure.
pub(super) struct ComplementMatrix {
    sides: usize,
    form: MatrixForm,
}

enum MatrixForm {
    Small(SquareSystem),
    Large(Box<LargeMatrix>),
}

impl ComplementMatrix {
    /// For the rank of a cluster and its first right-hand side.
    pub(super) fn new(rank: usize, first: usize) -> Self {
        if rank > SMALL {
            return Self::large(rank, first);
        }
        let sides = SIDES - first;
        Self { sides, form: MatrixForm::Small(SquareSystem::new(rank, sides)) }
    }

    /// The same as if the rank were large.
    pub(super) fn large(rank: usize, first: usize) -> Self {
        let sides = SIDES - first;
        Self { sides, form: MatrixForm::Large(Box::new(LargeMatrix::new(rank, sides))) }
    }

    /// Whether its entries are asked for in the order of their columns, each once.
    pub(super) fn is_large(&self) -> bool {
        matches!(self.form, MatrixForm::Large(_))
    }

    /// Before the rows are written.
    pub(super) fn clear(&mut self) {
        if let MatrixForm::Large(matrix) = &mut self.form {
            matrix.clear();
        }
    }

    /// Row `i` with its right-hand sides.
    pub(super) fn write_row(
        &mut self,
        i: usize,
        entries: impl Iterator<Item = Entry> + Clone,
        sides: [f64; SIDES],
    ) {
        let sides = &sides[SIDES - self.sides..];
        match &mut self.form {
            MatrixForm::Small(matrix) => matrix.write_row(i, entries, sides),
            MatrixForm::Large(matrix) => matrix.push_row(entries, sides),
        }
    }

    /// Solves for the right-hand sides.
    pub(super) fn solve(&mut self, relief: &mut Relief) -> Result<(), Fault> {
        let first = SIDES - self.sides;
        match &mut self.form {
            MatrixForm::Small(matrix) => {
                matrix.solve(0)?;
                relief.take(|k, side| matrix.solution(k, side - first), first);
            }
            MatrixForm::Large(matrix) => {
                matrix.solve()?;
                relief.take(|k, side| matrix.solution(k, side - first), first);
            }
        }
        Ok(())
    }
}
