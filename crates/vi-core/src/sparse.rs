//! Sparse matrices that are assembled once and refilled for ever.
//!
//! Whoever knows a matrix emits its entries `(row, column, value)` in an order that does not depend
//! on the values. The first emission fixes the pattern (an [`sprs::CsMat`] in compressed columns,
//! repeated entries summed); every later emission only writes numbers, without a search and without
//! an allocation.

use nalgebra::Matrix3;
use sprs::CsMat;

/// A sink of matrix entries; entries at the same place add up.
pub trait Entries {
    /// Adds `value` at `(row, column)`. Zeros are entries too: they keep the pattern fixed.
    fn add(&mut self, row: usize, column: usize, value: f64);
    /// Adds `value I_3` with its upper left corner at `(row, column)`.
    fn add_multiple(&mut self, row: usize, column: usize, value: f64) {
        (0..3).for_each(|k| self.add(row + k, column + k, value));
    }
    /// Adds a block with its upper left corner at `(row, column)`, between two vectors.
    fn add_block(&mut self, row: usize, column: usize, block: &Matrix3<f64>) {
        for i in 0..3 {
            (0..3).for_each(|j| self.add(row + i, column + j, block[(i, j)]));
        }
    }
    /// Adds `value` on the diagonal at the unknown `j` of a step: what acts along it, see
    /// [`crate::coordinate_force`]. Returns whether it was taken; if not, entries follow.
    fn add_along(&mut self, _j: usize, _value: f64) -> bool {
        false
    }
    /// Adds `A Bᵀ`.
    fn add_outer(&mut self, product: &OuterProduct<'_>) {
        let visit: &mut dyn FnMut(usize, usize, f64) = // compiled once for all sinks
            &mut |row, column, value| self.add(row, column, value);
        product.for_each_entry(visit);
    }
    /// Whether it reduces the runs of coordinates that begin at `starts` by `P(q)` and `P(q')`,
    /// with the numbers `at` there in `q` and `q'`: [`Entries::add_reduced`] then stands for
    /// [`Entries::add_outer`].
    fn reduces_at(&self, _starts: &[usize], _at: [&[f64]; 2]) -> bool {
        false
    }
    /// Adds `A Bᵀ` given as `PᵀA` and `P'ᵀB`, `length` rows of each run.
    fn add_reduced(&mut self, _product: &OuterProduct<'_>) {
        debug_assert!(false, "asked only where it reduces");
    }
}

/// `A Bᵀ` between coordinates that stand in runs of equal length, as those of frames do: the rows
/// `run · length + i` of `A` and of `B` belong to the coordinate `starts[run] + i`.
#[derive(Clone, Copy, Debug)]
pub struct OuterProduct<'a> {
    /// First coordinate of each run.
    pub starts: &'a [usize],
    /// Coordinates of a run.
    pub length: usize,
    /// `A`, column by column.
    pub left: &'a [f64],
    /// `B`, column by column; shape of `A`.
    pub right: &'a [f64],
}

impl OuterProduct<'_> {
    /// Visits the entries, by rows: row, column, value.
    pub fn for_each_entry(&self, mut visit: impl FnMut(usize, usize, f64)) {
        let Self { starts, length, left, right } = self;
        let rows = starts.len() * length;
        let place = |i: usize| starts[i / length] + i % length;
        for i in 0..rows {
            for j in 0..rows {
                let pairs = left[i..].iter().step_by(rows).zip(right[j..].iter().step_by(rows));
                visit(place(i), place(j), pairs.map(|(a, b)| a * b).sum());
            }
        }
    }

    /// `out ← out + A (Bᵀ v)`, column by column.
    fn mul_add(&self, v: &[f64], out: &mut [f64]) {
        let Self { starts, length, left, right } = *self;
        let rows = starts.len() * length;
        for (a, b) in left.chunks_exact(rows).zip(right.chunks_exact(rows)) {
            let mut along = 0.0; // b·v
            for (run, b) in starts.iter().zip(b.chunks_exact(length)) {
                along += b.iter().zip(&v[*run..run + length]).map(|(b, v)| b * v).sum::<f64>();
            }
            for (run, a) in starts.iter().zip(a.chunks_exact(length)) {
                let own = &mut out[*run..run + length];
                own.iter_mut().zip(a).for_each(|(o, a)| *o += a * along);
            }
        }
    }
}

/// Receives entries shifted, scaled and possibly transposed: one block of a larger matrix.
pub struct Block<'a> {
    /// Where the entries go.
    pub into: &'a mut dyn Entries,
    /// Offset added to the row.
    pub row: usize,
    /// Offset added to the column.
    pub column: usize,
    /// Factor on each value.
    pub scale: f64,
    /// Swap row and column before the offsets are added.
    pub transposed: bool,
}

impl std::fmt::Debug for Block<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { row, column, scale, transposed, .. } = self;
        f.debug_tuple("Block").field(&(row, column, scale, transposed)).finish()
    }
}

impl Entries for Block<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        let (i, j) = if self.transposed { (column, row) } else { (row, column) };
        self.into.add(self.row + i, self.column + j, self.scale * value);
    }
    fn add_multiple(&mut self, row: usize, column: usize, value: f64) {
        let (i, j) = if self.transposed { (column, row) } else { (row, column) };
        self.into.add_multiple(self.row + i, self.column + j, self.scale * value);
    }
}

/// `out_i ← out_i + A_ij v_j` for every entry: a product without the matrix.
#[derive(Debug)]
pub struct Product<'a> {
    /// Shape: columns of `A`.
    pub v: &'a [f64],
    /// Shape: rows of `A`.
    pub out: &'a mut [f64],
}

impl Entries for Product<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        self.out[row] += value * self.v[column];
    }

    fn add_outer(&mut self, product: &OuterProduct<'_>) {
        product.mul_add(self.v, self.out);
    }
}

impl Entries for nalgebra::DMatrix<f64> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        self[(row, column)] += value;
    }
}

/// A matrix with a fixed sparsity pattern, refilled by replaying its emission.
///
/// ```
/// use vi_core::{Entries, SparseMatrix};
/// let emit = |scale: f64| move |out: &mut dyn Entries| {
///     out.add(0, 0, scale);
///     out.add(0, 0, 1.0); // the same place: adds
///     out.add(1, 0, 3.0);
/// };
/// let mut a = SparseMatrix::assemble(2, 1, emit(2.0));
/// a.refill(emit(4.0));
/// let mut y = [0.0; 2];
/// a.mul_add(1.0, &[1.0], &mut y);
/// assert_eq!(y, [5.0, 3.0]);
/// ```
#[derive(Clone, Debug)]
pub struct SparseMatrix {
    matrix: CsMat<f64>,
    slots: Vec<usize>, // k-th emitted entry → position in the value array
}

struct Collector {
    entries: Vec<(usize, usize, f64)>,
}

impl Entries for Collector {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        self.entries.push((column, row, value));
    }
}

/// The entries in the order of columns, rows and emission.
fn by_columns(entries: &[(usize, usize, f64)], columns: usize) -> Vec<usize> {
    let mut next = vec![0; columns + 1]; // place of the next entry of each column
    entries.iter().for_each(|entry| next[entry.0 + 1] += 1);
    (0..columns).for_each(|j| next[j + 1] += next[j]);
    let mut order = vec![0; entries.len()];
    for (k, (column, ..)) in entries.iter().enumerate() {
        order[next[*column]] = k;
        next[*column] += 1;
    }
    let mut start = 0;
    for &end in &next[..columns] {
        order[start..end].sort_by_key(|&k| entries[k].1);
        start = end;
    }
    order
}

/// Writes the numbers of a matrix in the order of its assembly.
#[derive(Debug)]
pub struct ReplayEntries<'a> {
    values: &'a mut [f64],
    slots: &'a [usize],
    next: usize,
}

impl Entries for ReplayEntries<'_> {
    #[inline]
    fn add(&mut self, _row: usize, _column: usize, value: f64) {
        self.values[self.slots[self.next]] += value;
        self.next += 1;
    }
}

impl SparseMatrix {
    /// Assembles a `rows × columns` matrix from the entries that `emit` writes.
    ///
    /// # Panics
    /// When an entry lies outside the shape: the emitter is broken, not the data.
    pub fn assemble(rows: usize, columns: usize, emit: impl FnOnce(&mut dyn Entries)) -> Self {
        let mut collector = Collector { entries: Vec::new() };
        emit(&mut collector);
        Self::of_entries(rows, columns, &collector.entries)
    }

    /// The sums of all entries `(column, row, value)` with the same place.
    fn of_entries(rows: usize, columns: usize, entries: &[(usize, usize, f64)]) -> Self {
        for &(column, row, _) in entries {
            assert!(row < rows && column < columns, "entry ({row}, {column}) outside the matrix");
        }
        let order = by_columns(entries, columns);
        let mut indptr = vec![0_usize; columns + 1];
        let mut indices = Vec::with_capacity(entries.len());
        let mut values: Vec<f64> = Vec::with_capacity(entries.len());
        let mut slots = vec![0; entries.len()];
        let mut last = None;
        for k in order {
            let (column, row, value) = entries[k];
            if last != Some((column, row)) {
                indices.push(row);
                values.push(0.0);
                indptr[column + 1] += 1;
                last = Some((column, row));
            }
            slots[k] = values.len() - 1;
            *values.last_mut().expect("pushed above") += value;
        }
        for j in 0..columns {
            indptr[j + 1] += indptr[j];
        }
        let matrix = CsMat::new_csc((rows, columns), indptr, indices, values);
        Self { matrix, slots }
    }

    /// Overwrites the values; `emit` must write the same places in the same order as at assembly.
    pub fn refill(&mut self, emit: impl FnOnce(&mut dyn Entries)) {
        self.refill_with(|replay| emit(replay));
    }

    /// The same where `emit` is compiled for this sink.
    pub fn refill_with(&mut self, emit: impl FnOnce(&mut ReplayEntries<'_>)) {
        let values = self.matrix.data_mut();
        values.fill(0.0);
        let mut replay = ReplayEntries { values, slots: &self.slots, next: 0 };
        emit(&mut replay);
        debug_assert_eq!(replay.next, self.slots.len(), "emission shorter than at assembly");
    }

    /// Refills the matrix in `kept`; the first time it is assembled, with this shape.
    pub fn update(
        kept: &mut Option<Self>,
        shape: (usize, usize),
        emit: impl FnOnce(&mut dyn Entries),
    ) -> &Self {
        match kept {
            Some(matrix) => {
                matrix.refill(emit);
                matrix
            }
            None => kept.insert(Self::assemble(shape.0, shape.1, emit)),
        }
    }

    /// Emits the stored entries (for nesting in a larger matrix).
    pub fn emit(&self, out: &mut dyn Entries) {
        self.for_each(|i, j, value| out.add(i, j, value));
    }

    /// The matrix in compressed columns.
    #[must_use]
    pub fn as_sprs(&self) -> &CsMat<f64> {
        &self.matrix
    }

    /// Column pointers of the compressed columns, `columns + 1` of them.
    #[must_use]
    pub fn column_pointers(&self) -> &[usize] {
        self.matrix.indptr().into_raw_storage()
    }

    /// `(rows, columns)`.
    #[must_use]
    pub fn shape(&self) -> (usize, usize) {
        self.matrix.shape()
    }

    /// `y ← y + a A x`.
    pub fn mul_add(&self, a: f64, x: &[f64], y: &mut [f64]) {
        self.for_each(|i, j, value| y[i] += a * value * x[j]);
    }

    /// `y ← y + a Aᵀ x`.
    pub fn tr_mul_add(&self, a: f64, x: &[f64], y: &mut [f64]) {
        self.for_each(|i, j, value| y[j] += a * value * x[i]);
    }

    /// `xᵀ A y`.
    #[must_use]
    pub fn bilinear(&self, x: &[f64], y: &[f64]) -> f64 {
        let mut sum = 0.0;
        self.for_each(|i, j, value| sum += x[i] * value * y[j]);
        sum
    }

    /// `out ← out + a A X` for dense `X` (column by column).
    pub fn mul_dense_add(
        &self,
        a: f64,
        x: &nalgebra::DMatrix<f64>,
        out: &mut nalgebra::DMatrix<f64>,
    ) {
        let (rows, columns) = self.shape();
        for c in 0..x.ncols() {
            let xc = &x.as_slice()[c * columns..(c + 1) * columns];
            let yc = &mut out.as_mut_slice()[c * rows..(c + 1) * rows];
            self.mul_add(a, xc, yc);
        }
    }

    /// Dense copy, for tests and small problems.
    #[must_use]
    pub fn to_dense(&self) -> nalgebra::DMatrix<f64> {
        let (rows, columns) = self.shape();
        let mut dense = nalgebra::DMatrix::zeros(rows, columns);
        self.for_each(|i, j, value| dense[(i, j)] += value);
        dense
    }

    /// The stored entries of a column: row, value.
    pub fn column(&self, j: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let own = self.matrix.indptr().outer_inds_sz(j);
        let (rows, values) = (&self.matrix.indices()[own.clone()], &self.matrix.data()[own]);
        rows.iter().copied().zip(values.iter().copied())
    }

    /// Visits the stored entries: row, column, value.
    pub fn for_each(&self, mut visit: impl FnMut(usize, usize, f64)) {
        let (indices, values) = (self.matrix.indices(), self.matrix.data());
        let starts = self.column_pointers();
        for j in 0..self.matrix.cols() {
            for k in starts[j]..starts[j + 1] {
                visit(indices[k], j, values[k]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn emit(scale: f64) -> impl Fn(&mut dyn Entries) {
        move |out| {
            out.add(1, 0, 2.0 * scale);
            out.add(0, 1, 3.0 * scale);
            out.add(1, 0, 0.5 * scale); // same place again: adds
            let mut block = Block { into: out, row: 1, column: 1, scale: 10.0, transposed: true };
            block.add(0, 1, scale); // lands at (2, 1)
        }
    }

    #[test]
    fn an_outer_product_is_that_of_its_factors() {
        let (left, right) = ([1.0, 2.0, 3.0, 4.0, -1.0, 0.5, 0.0, 2.0], [0.5; 8]);
        let product = OuterProduct { starts: &[4, 0], length: 2, left: &left, right: &right };
        let found = SparseMatrix::assemble(6, 6, |out| out.add_outer(&product)).to_dense();
        let place = |i: usize| [4, 5, 0, 1][i];
        for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
            assert_eq!(found[(place(i), place(j))], 0.5 * (left[i] + left[4 + i]), "({i}, {j})");
        }
        assert_eq!(found.row(2).amax() + found.column(3).amax(), 0.0);
        let (v, mut out) = ([3.0, -1.0, 7.0, 9.0, 2.0, 0.5], [1.0; 6]);
        Product { v: &v, out: &mut out }.add_outer(&product);
        let expected = found * nalgebra::DVector::from_row_slice(&v);
        let off = out.iter().zip(&expected).map(|(out, sum)| out - 1.0 - sum);
        let off: Vec<f64> = off.collect();
        println!("product without the matrix off by {:e}", crate::linear::norm_inf(&off));
        assert!(crate::linear::norm_inf(&off) < 1e-14);
    }

    #[test]
    fn refilling_replays_the_assembly() {
        let mut a = SparseMatrix::assemble(3, 2, emit(1.0));
        assert_eq!(a.as_sprs().nnz(), 3, "pattern");
        assert_eq!(a.to_dense(), nalgebra::dmatrix![0.0, 3.0; 2.5, 0.0; 0.0, 10.0]);
        a.refill(emit(-2.0));
        assert_eq!(a.to_dense(), nalgebra::dmatrix![0.0, -6.0; -5.0, 0.0; 0.0, -20.0]);
        let mut y = [1.0; 3];
        a.mul_add(1.0, &[1.0, 2.0], &mut y);
        assert_eq!(y, [-11.0, -4.0, -39.0]);
        let mut x = [0.0; 2];
        a.tr_mul_add(1.0, &[1.0, 1.0, 1.0], &mut x);
        assert_eq!(x, [-5.0, -26.0]);
        assert_eq!(a.bilinear(&[1.0, 1.0, 1.0], &[1.0, 2.0]), -5.0 - 52.0);
    }
}
