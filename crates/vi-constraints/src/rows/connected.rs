//! Rows of a matrix that are connected by columns, with their rank; up to which size that is
//! decided by dense matrices.

use crate::null_space::NullSpaceQr;
use crate::redundancy;
use nalgebra::DMatrix;
use vi_core::sparse::SparseMatrix;

/// Coordinates of connected constraints up to which their rank, their null space and matrices over
/// their degrees of freedom are dense; beyond, one matrix would take more than 46 MB, and a step
/// many seconds.
pub const DENSE_COORDINATES: usize = 2400;
const NONE: usize = usize::MAX;

/// Rows that columns connect, and these columns; both ascending.
#[derive(Debug, Default)]
pub(crate) struct ConnectedRows {
    pub(crate) rows: Vec<usize>,
    pub(crate) columns: Vec<usize>,
}

/// The first of a set.
fn first(set: &mut [usize], mut i: usize) -> usize {
    while set[i] != i {
        set[i] = set[set[i]];
        i = set[i];
    }
    i
}

/// The number of the set of each column: the smallest column that rows connect it to. `entries`
/// visits `(row, column)`.
pub(crate) fn groups(
    rows: usize,
    columns: usize,
    entries: impl FnOnce(&mut dyn FnMut(usize, usize)),
) -> Vec<usize> {
    let mut set: Vec<usize> = (0..columns).collect();
    let mut first_of = vec![NONE; rows];
    entries(&mut |row, column| {
        if first_of[row] == NONE {
            first_of[row] = column;
        }
        let (a, b) = (first(&mut set, column), first(&mut set, first_of[row]));
        set[a.max(b)] = a.min(b);
    });
    (0..columns).map(|i| first(&mut set, i)).collect()
}

/// The connected parts of a matrix; rows without entries are parts of their own.
pub(crate) fn connected(matrix: &SparseMatrix) -> Vec<ConnectedRows> {
    let (m, n) = matrix.shape();
    let group = groups(m, n, |visit| matrix.for_each(|i, j, _| visit(i, j)));
    let mut part_of_row = vec![NONE; m];
    let mut part_of_group = vec![NONE; n];
    let mut parts: Vec<ConnectedRows> = Vec::new();
    for j in 0..n {
        for (i, _) in matrix.column(j) {
            let part = &mut part_of_group[group[j]];
            if *part == NONE {
                *part = parts.len();
                parts.push(ConnectedRows::default());
            }
            part_of_row[i] = *part;
        }
        if let Some(part) = parts.get_mut(part_of_group[group[j]]) {
            part.columns.push(j);
        }
    }
    for (i, part) in part_of_row.into_iter().enumerate() {
        match parts.get_mut(part) {
            Some(part) => part.rows.push(i),
            None => parts.push(ConnectedRows { rows: vec![i], columns: Vec::new() }),
        }
    }
    parts
}

impl ConnectedRows {
    /// Whether a dense matrix is too large.
    pub(crate) fn is_large(&self) -> bool {
        self.columns.len().max(self.rows.len()) > DENSE_COORDINATES
    }

    /// Independent rows by pivoted QR, the clearest first: all with pivots above the tolerance.
    pub(crate) fn pivots(&self, matrix: &SparseMatrix, tolerance: f64) -> Vec<usize> {
        let qr = NullSpaceQr::new(self.columns.len(), self.rows.len());
        let mut qr = qr.counting_from(tolerance);
        let rank = qr.factorize(&self.dense(matrix));
        qr.pivots()[..rank].iter().map(|&row| self.rows[row]).collect()
    }

    /// As many rows as wanted, the clearest first; of rows with `allowances` as few as possible.
    pub(crate) fn clearest(
        &self,
        matrix: &SparseMatrix,
        wanted: usize,
        allowances: &[f64],
    ) -> Vec<usize> {
        let mut qr = NullSpaceQr::new(self.columns.len(), self.rows.len());
        let of_row = |&row: &usize| allowances.get(row).copied().unwrap_or(0.0);
        let own = self.rows.iter().map(of_row).filter(|_| !allowances.is_empty());
        qr.factorize_preferring(&self.dense(matrix), &own.collect::<Vec<_>>());
        qr.pivots()[..wanted].iter().map(|&row| self.rows[row]).collect()
    }

    fn dense(&self, matrix: &SparseMatrix) -> DMatrix<f64> {
        let mut dense = DMatrix::zeros(self.rows.len(), self.columns.len());
        for (k, &j) in self.columns.iter().enumerate() {
            for (i, value) in matrix.column(j) {
                if let Ok(row) = self.rows.binary_search(&i) {
                    dense[(row, k)] = value;
                }
            }
        }
        dense
    }

    /// Whether all rows are clearly independent, by a sparse factorization.
    pub(crate) fn is_independent(&self, matrix: &SparseMatrix) -> bool {
        if self.rows.len() > self.columns.len() {
            return false;
        }
        let emit = |out: &mut dyn vi_core::sparse::Entries| {
            for (k, &j) in self.columns.iter().enumerate() {
                for (i, value) in matrix.column(j) {
                    if let Ok(row) = self.rows.binary_search(&i) {
                        out.add(row, k, value);
                    }
                }
            }
        };
        let own = SparseMatrix::assemble(self.rows.len(), self.columns.len(), emit);
        redundancy::are_independent(&own)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vi_core::sparse::Entries;

    /// Two rows on the columns 0 and 2, one on 1, one without entries.
    #[test]
    fn parts_are_connected_by_columns() {
        let matrix = SparseMatrix::assemble(4, 4, |out: &mut dyn Entries| {
            out.add(0, 0, 1.0);
            out.add(0, 2, 1.0);
            out.add(3, 2, 2.0);
            out.add(1, 1, 1.0);
        });
        let parts = connected(&matrix);
        let found: Vec<_> = parts.iter().map(|p| (&p.rows[..], &p.columns[..])).collect();
        assert_eq!(found, [(&[0, 3][..], &[0, 2][..]), (&[1], &[1]), (&[2], &[])]);
        assert!(parts[0].is_independent(&matrix));
        assert_eq!(parts[0].pivots(&matrix, 1e-11).len(), 2);
    }
}
