//! A matrix in sparse rows.

/// The places of a row in ascending order.
#[derive(Clone, Copy, Debug)]
pub struct SparseRows<'a> {
    /// Where each row ends, shape `k`.
    pub ends: &'a [usize],
    /// Columns of the entries.
    pub places: &'a [u32],
    /// The entries.
    pub values: &'a [f64],
}

impl SparseRows<'_> {
    /// Where the entries of a row stand.
    pub(super) fn range(&self, i: usize) -> std::ops::Range<usize> {
        i.checked_sub(1).map_or(0, |before| self.ends[before])..self.ends[i]
    }
}
