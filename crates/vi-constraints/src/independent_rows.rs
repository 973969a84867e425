//! Independent constraints: a subset of the rows of `G` with its rank.
//!
//! The rank is decided for each set of rows that is connected by coordinates: other sets have no
//! part in it, and time and memory are linear in their number.

use crate::connected::{Part, connected};
use crate::constraints::Constraints;
use crate::nearby::{self, Nearby};
use vi_core::Configuration;
use vi_core::sparse::{Entries, SparseMatrix};

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

    /// Finds an independent set at `(t, q)` by pivoted QR of each set of rows that is connected by
    /// coordinates: `O(n m²)` there.
    #[must_use]
    pub fn find(constraints: &impl Constraints, t: f64, q: &[f64]) -> Self {
        let jacobian = jacobian(constraints, t, q);
        let parts = connected(&jacobian).into_iter();
        let tolerance = constraints.rank_tolerance();
        let pivots = |part: Part| part.pivots(&jacobian, tolerance);
        let chosen: Vec<usize> = parts.flat_map(pivots).collect();
        Self::choose(constraints.len(), &chosen)
    }

    /// The same, unless more are independent in configurations nearby ([`crate::nearby`]): then
    /// `(t, q)` is singular, and the rank nearby is the error. Rows that many coordinates connect
    /// must all be independent.
    ///
    /// # Errors
    /// The rank nearby; no rank when no closed configuration was found there, or the dense matrices
    /// are too large.
    pub fn find_generic(
        constraints: &impl Constraints,
        t: f64,
        q: &[f64],
    ) -> Result<Self, RankNearby> {
        const MOST: usize = 150;
        let jacobian = jacobian(constraints, t, q);
        let mut chosen = Vec::new();
        for part in connected(&jacobian) {
            match part.is_large() {
                false => chosen.extend(part.pivots(&jacobian, constraints.rank_tolerance())),
                true if part.is_independent(&jacobian) => chosen.extend(part.rows),
                true => return Err(RankNearby::TooLarge { coordinates: part.columns.len() }),
            }
        }
        let rows = Self::choose(constraints.len(), &chosen);
        let at_start = rows.len();
        if at_start == constraints.len().min(q.len()) {
            return Ok(rows);
        }
        let nearby = if q.len() > MOST { None } else { nearby::rank(constraints, t, q) };
        let followers = || match nearby::followers(constraints, &rows, Configuration::new(t, q)) {
            Nearby::Follow => Some(at_start),
            Nearby::Singular { .. } => Some(at_start + 1),
            Nearby::Unknown => None,
        };
        match nearby.or_else(followers) {
            Some(rank) if rank <= at_start => Ok(rows),
            Some(nearby) => Err(RankNearby::Larger { at_start, nearby }),
            None => Err(RankNearby::Unknown),
        }
    }

    /// Chooses as many of each connected set anew, by pivoted QR at `(t, q)`; sets that are too
    /// large for a dense matrix stay as they are. Returns whether they changed.
    pub(crate) fn renew(&mut self, constraints: &impl Constraints, t: f64, q: &[f64]) -> bool {
        let jacobian = jacobian(constraints, t, q);
        let mut chosen = Vec::with_capacity(self.len());
        for part in connected(&jacobian) {
            let own = part.rows.iter().copied().filter(|&row| self.position[row] != DROPPED);
            let own: Vec<usize> = own.collect();
            match own.len() == part.rows.len() || part.is_large() {
                true => chosen.extend(own),
                false => {
                    chosen.extend(part.clearest(&jacobian, own.len(), constraints.allowances()));
                }
            }
        }
        let before = self.clone();
        self.replace(&chosen);
        *self != before
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
        emit(&mut Selected { rows: self, place, out });
    }
}

/// `G` at `(t, q)`.
fn jacobian(constraints: &impl Constraints, t: f64, q: &[f64]) -> SparseMatrix {
    let (m, n) = (constraints.len(), constraints.dim());
    SparseMatrix::assemble(m, n, |out| constraints.jacobian(t, q, out))
}

/// Why the independent constraints of the motion are not known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RankNearby {
    /// More are independent in configurations nearby.
    Larger {
        /// Rank in the configuration.
        at_start: usize,
        /// Rank in configurations nearby, or a lower bound of it.
        nearby: usize,
    },
    /// No closed configuration was found nearby.
    Unknown,
    /// Some of the constraints may depend on others, and their rank needs too large a dense matrix.
    TooLarge {
        /// Coordinates that these constraints connect.
        coordinates: usize,
    },
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

struct Selected<'a> {
    rows: &'a IndependentRows,
    place: JacobianPlace,
    out: &'a mut dyn Entries,
}

impl Entries for Selected<'_> {
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
