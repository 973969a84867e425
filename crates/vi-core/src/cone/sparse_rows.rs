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

impl<'a> SparseRows<'a> {
    /// The entries of a row with their columns, in the order of these.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + use<'a> {
        let own = i.checked_sub(1).map_or(0, |before| self.ends[before])..self.ends[i];
        let places = self.places[own.clone()].iter().map(|place| *place as usize);
        places.zip(self.values[own].iter().copied())
    }
}
