//! Tensions of the bars between point masses, from the constraint force of a node.
//!
//! ```text
//! Σ_k u_k N_k = w,   u_k: unit vector along bar k at its ends,   w: the constraint force on the point masses       [5.33]
//! ```
//! Rows of bars are `D` on their ends, of length `l`. Scaled by the power of two next to `1/l`,
//! which rounds nothing, short and long bars count alike, in all units of length. No other
//! constraint acts on point masses.

use crate::mechanism::{Bar, Mechanism};
use std::ops::Range;
use vi_constraints::least_norm::LeastNorm;
use vi_constraints::redundancy::{least_multipliers, scattered};
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::unit_rows::null_vectors;
use vi_core::sparse::{Entries, SparseMatrix};
use vi_rigid::directors::INTERNAL;

/// Contributions of multipliers of size one below this count as none, N.
const NO_PART: f64 = 1e-8;

/// The force in a bar, or of a scalar constraint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BarTension {
    /// Of a bar, N: positive when it pulls its ends together. Of a scalar constraint, N or N·m.
    pub force: f64,
    /// Whether it is unique.
    pub unique: bool,
}

/// The tensions at one node after the other, their memory sized once.
#[derive(Debug)]
pub(super) struct BarTensions {
    rows: Range<usize>,             // of all bars among the constraints
    first: usize,                   // coordinate of the point masses
    scales: Vec<f64>,               // of the rows
    lengths: Vec<f64>,              // of the bars in units of their rows
    jacobian: Option<SparseMatrix>, // bars × coordinates of the point masses
    least: LeastNorm,
    lambda: Vec<f64>,    // multipliers of the bars
    null: Vec<Vec<f64>>, // contributions to all that is not unique
}

/// Entries in the columns of the point masses.
struct PointEntries<'a> {
    first: usize,
    scale: f64,
    out: &'a mut dyn Entries,
}

impl Entries for PointEntries<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        self.out.add(row, column - self.first, self.scale * value);
    }
}

impl BarTensions {
    /// For a mechanism.
    pub(super) fn new(mechanism: &Mechanism) -> Self {
        let bars = &mechanism.description().bars;
        let rows = match bars.len() {
            0 => 0..0,
            count => mechanism.bar_rows(0).start..mechanism.bar_rows(count - 1).end,
        };
        let scale = |bar: &Bar| libm::scalbn(1.0, -libm::ilogb(bar.length));
        let scales: Vec<f64> = bars.iter().map(scale).collect();
        Self {
            first: mechanism.particle_offset(0),
            lengths: bars.iter().zip(&scales).map(|(bar, scale)| bar.length * scale).collect(),
            jacobian: None,
            least: LeastNorm::default(),
            lambda: vec![0.0; rows.len()],
            null: Vec::new(),
            scales,
            rows,
        }
    }

    /// Finds the tensions at `q` with the constraint force `force`, shape `n`.
    pub(super) fn find(
        &mut self,
        mechanism: &Mechanism,
        q: &[f64],
        force: &[f64],
        independent: &IndependentRows,
    ) {
        let Self { rows, first, scales, jacobian, least, lambda, null, .. } = self;
        if lambda.is_empty() {
            return;
        }
        let rank = independent.rows().iter().filter(|row| rows.contains(row)).count();
        let own = rows.start - INTERNAL * mechanism.description().bodies.len();
        let emit = |out: &mut dyn Entries| {
            for (k, row) in mechanism.rows()[own..own + rows.len()].iter().enumerate() {
                row.emit(q, k, &mut PointEntries { first: *first, scale: scales[k], out });
            }
        };
        let jacobian = SparseMatrix::update(jacobian, (rows.len(), force.len() - *first), emit);
        least_multipliers(least, jacobian, rank, &force[*first..], lambda);
        null.resize_with(usize::from(rank < rows.len()), Vec::new);
        let Some(part) = null.first_mut() else { return };
        part.clear();
        part.extend((0..lambda.len()).map(scattered));
        if least.null_part(jacobian, part).is_err() {
            *null = null_vectors(jacobian, rank);
        }
    }

    /// That of bar `k` of the description.
    pub(super) fn of(&self, k: usize) -> BarTension {
        let length = self.lengths[k];
        let unique = self.null.iter().all(|null| (length * null[k]).abs() < NO_PART);
        BarTension { force: length * self.lambda[k], unique }
    }
}
