//! Which rows of `G` are independent at a configuration.
//!
//! The rank is decided for each set of rows that is connected by coordinates: other sets have no
//! part in it, and time and memory are linear in their number.

use super::independent_rows::IndependentRows;
use crate::connected::{ConnectedRows, connected};
use crate::constraints::Constraints;
use vi_core::sparse::SparseMatrix;

impl IndependentRows {
    /// Finds an independent set at `(t, q)` by pivoted QR of each set of rows that is connected by
    /// coordinates: `O(n m²)` there.
    #[must_use]
    pub fn find(constraints: &impl Constraints, t: f64, q: &[f64]) -> Self {
        let jacobian = jacobian(constraints, t, q);
        let parts = connected(&jacobian).into_iter();
        let tolerance = constraints.rank_tolerance();
        let pivots = |part: ConnectedRows| part.pivots(&jacobian, tolerance);
        let chosen: Vec<usize> = parts.flat_map(pivots).collect();
        Self::choose(constraints.len(), &chosen)
    }

    /// Chooses as many of each connected set anew, by pivoted QR at `(t, q)`; sets that are too
    /// large for a dense matrix stay as they are. Returns whether they changed.
    pub(crate) fn renew(&mut self, constraints: &impl Constraints, t: f64, q: &[f64]) -> bool {
        let jacobian = jacobian(constraints, t, q);
        let mut chosen = Vec::with_capacity(self.len());
        for part in connected(&jacobian) {
            let own = part.rows.iter().copied().filter(|&row| !self.is_dropped(row));
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
}

/// `G` at `(t, q)`.
pub(crate) fn jacobian(constraints: &impl Constraints, t: f64, q: &[f64]) -> SparseMatrix {
    let (m, n) = (constraints.len(), constraints.dim());
    SparseMatrix::assemble(m, n, |out| constraints.jacobian(t, q, out))
}
