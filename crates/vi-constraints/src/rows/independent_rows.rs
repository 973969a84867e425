//! Independent constraints: a subset of the rows of `G`.

use crate::constraints::Constraints;
use vi_core::Configuration;
use vi_core::sparse::Entries;

const DROPPED: usize = usize::MAX;

/// An independent subset of the rows of `G`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IndependentRows {
    position: Vec<usize>, // constraint → row among the chosen, or DROPPED
    rows: Vec<usize>,     // chosen constraints, ascending
}

impl IndependentRows {
    /// All of `m` constraints.
    #[must_use]
    pub fn all(m: usize) -> Self {
        Self { position: (0..m).collect(), rows: (0..m).collect() }
    }

    /// The given constraints out of `m`.
    #[must_use]
    pub fn choose(m: usize, chosen: &[usize]) -> Self {
        let mut rows = Self { position: vec![DROPPED; m], rows: Vec::new() };
        rows.replace(chosen);
        rows
    }

    /// Takes the given constraints instead; allocates nothing where they are no more than before.
    pub fn replace(&mut self, chosen: &[usize]) {
        self.rows.clear();
        self.rows.extend_from_slice(chosen);
        self.rows.sort_unstable();
        self.position.fill(DROPPED);
        for (k, &row) in self.rows.iter().enumerate() {
            self.position[row] = k;
        }
    }

    /// Whether a constraint was left out.
    pub(crate) fn is_dropped(&self, row: usize) -> bool {
        self.position[row] == DROPPED
    }

    /// Of how many constraints they are.
    pub(crate) fn of(&self) -> usize {
        self.position.len()
    }

    /// The chosen constraints, ascending.
    #[must_use]
    pub fn rows(&self) -> &[usize] {
        &self.rows
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The constraints left out.
    pub fn redundant(&self) -> impl Iterator<Item = usize> + '_ {
        self.position.iter().enumerate().filter(|(_, p)| **p == DROPPED).map(|(i, _)| i)
    }

    /// Copies the chosen entries of a vector over all constraints.
    pub fn gather(&self, all: &[f64], chosen: &mut [f64]) {
        for (out, &row) in chosen.iter_mut().zip(&self.rows) {
            *out = all[row];
        }
    }

    /// Spreads chosen entries over all constraints, zero elsewhere.
    pub fn scatter(&self, chosen: &[f64], all: &mut [f64]) {
        all.fill(0.0);
        for (value, &row) in chosen.iter().zip(&self.rows) {
            all[row] = *value;
        }
    }

    /// Emits `scale G` (chosen rows only), offset by `row` and `column`; transposed on demand.
    pub fn emit_jacobian(
        &self,
        constraints: &impl Constraints,
        at: Configuration<'_>,
        place: JacobianPlace,
        out: &mut dyn Entries,
    ) {
        self.emit_selected(
            &|out: &mut dyn Entries| constraints.jacobian(at.t, at.q, out),
            place,
            out,
        );
    }

    /// Emits the chosen rows of what `emit` emits over all constraints, as
    /// [`IndependentRows::emit_jacobian`] does.
    pub fn emit_selected(
        &self,
        emit: &dyn Fn(&mut dyn Entries),
        place: JacobianPlace,
        out: &mut dyn Entries,
    ) {
        emit(&mut SelectedRows { rows: self, place, out });
    }
}

/// Where a constraint Jacobian goes in a larger matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JacobianPlace {
    /// First row of the block.
    pub row: usize,
    /// First column of the block.
    pub column: usize,
    /// Factor.
    pub scale: f64,
    /// `Gᵀ` instead of `G`.
    pub transposed: bool,
}

struct SelectedRows<'a> {
    rows: &'a IndependentRows,
    place: JacobianPlace,
    out: &'a mut dyn Entries,
}

impl Entries for SelectedRows<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        let row = self.rows.position[row];
        if row == DROPPED {
            return;
        }
        let JacobianPlace { row: r0, column: c0, scale, transposed } = self.place;
        let (i, j) = if transposed { (column, row) } else { (row, column) };
        self.out.add(r0 + i, c0 + j, scale * value);
    }
}
