//! Sparse LU of blocks of up to six rows, for a symmetric pattern of blocks.
//!
//! ```text
//! pivot g:   U_gj = D_g⁻¹ A_gj,     A_ij ← A_ij − A_ig U_gj        i, j: neighbours of g that are eliminated later
//! forward    y_g = D_g⁻¹ x_g,       x_i ← x_i − A_ig y_g
//! backward   x_g = y_g − Σ_j U_gj x_j
//! ```
//! `D_g` is factorized with partial pivoting of its rows; between blocks the order is fixed, that of the least number of
//! neighbours (minimum degree). A chain is eliminated from one end to the other, a tree from its leaves: without fill, in
//! linear time. Rows and columns are scaled by powers of two near `|A_kk|^{−1/2}`. An entry of `U` beyond
//! [`LARGEST`] shows a pivot block that is too small for its neighbours: the factorization is then refused, and a
//! factorization with pivoting among all rows is needed.
//!
//! Blocks smaller than 6×6 are completed by those of the identity. Rows of a block are contiguous, and every row is
//! treated as a whole: the sums have the same order whatever the width of the processor.
//!
//! Source: I. S. Duff, A. M. Erisman, J. K. Reid, Direct Methods for Sparse Matrices, 2nd ed., Oxford (2017), §7, §12.
#![allow(non_snake_case)] // D, U

use crate::linear::Singular;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

/// Rows of a block.
pub const SIZE: usize = 6;
/// The largest entry of `D_g⁻¹ A_gj` after scaling: the backward error is below `SIZE · LARGEST · ε ≈ 1e-10`.
pub const LARGEST: f64 = 1e5;

type Row = [f64; SIZE];
/// A block by rows.
pub type Block = [Row; SIZE];

const ZERO: Block = [[0.0; SIZE]; SIZE];

/// The elimination of a group of unknowns.
#[derive(Clone, Debug)]
struct Pivot {
    group: usize,
    diagonal: usize,   // its block
    neighbours: usize, // first of its neighbours
    updates: usize,    // first of its updates
    count: usize,      // neighbours
    order: [u8; SIZE], // row exchanges of the block
}

/// A group that is eliminated after a neighbour, with the blocks between them.
#[derive(Clone, Copy, Debug)]
struct Neighbour {
    group: usize,
    lower: usize, // A_ig
    upper: usize, // A_gi, then U_gi
}

/// The factorization.
#[derive(Clone, Debug)]
pub struct BlockLu {
    sizes: Vec<usize>,          // of the groups
    first: Vec<usize>,          // unknown of each group
    pivots: Vec<Pivot>,         // in the order of elimination
    neighbours: Vec<Neighbour>, // of each pivot
    updates: Vec<usize>,        // blocks A_ij of each pivot, by rows
    places: Vec<usize>,         // block of each place of the matrix
    blocks: Vec<Block>,
    scales: Vec<Row>, // of each group, powers of two
    x: Vec<Row>,
}

/// A power of two near `|x|^{−1/2}`; 1 where there is none.
#[must_use]
pub fn inverse_root(x: f64) -> f64 {
    let exponent = (x.to_bits() >> 52) & 0x7ff;
    if exponent == 0 || exponent == 0x7ff {
        return 1.0;
    }
    // 2^e ≤ |x| < 2^(e+1) with e = exponent − 1023: the exponent −⌊(e + 1)/2⌋
    f64::from_bits((1534 - exponent / 2) << 52)
}

/// The groups in the order of their elimination, each with its neighbours that are not eliminated yet: minimum degree.
/// `None` where there is too much fill.
fn elimination_order(mut adjacent: Vec<BTreeSet<usize>>) -> Option<Vec<(usize, Vec<usize>)>> {
    const MOST: usize = 64; // updates of a pivot, in the mean
    const FEW: usize = 4096; // updates that are never too many
    let most = FEW.max(MOST * adjacent.len());
    let mut updates = 0;
    use std::cmp::Reverse;
    let key = |adjacent: &[BTreeSet<usize>], g: usize| Reverse((adjacent[g].len(), g));
    let mut waiting: BinaryHeap<_> = (0..adjacent.len()).map(|g| key(&adjacent, g)).collect();
    let mut done = vec![false; adjacent.len()];
    let mut order = Vec::with_capacity(adjacent.len());
    while let Some(Reverse((degree, g))) = waiting.pop() {
        if done[g] || degree != adjacent[g].len() {
            continue; // an entry from before its neighbours changed
        }
        done[g] = true;
        updates += degree * degree;
        if updates > most {
            return None;
        }
        let own: Vec<usize> = std::mem::take(&mut adjacent[g]).into_iter().collect();
        for &i in &own {
            adjacent[i].remove(&g);
            adjacent[i].extend(own.iter().filter(|j| **j != i));
            waiting.push(key(&adjacent, i));
        }
        order.push((g, own));
    }
    Some(order)
}

impl BlockLu {
    /// For groups of `sizes` unknowns (at most [`SIZE`] each) and the places `(row, column)` of blocks between them;
    /// places that are not listed are zero. `None` where there is too much fill: a general factorization is then as fast.
    ///
    /// # Panics
    /// When a group is larger.
    #[must_use]
    pub fn new(sizes: &[usize], places: &[(usize, usize)]) -> Option<Self> {
        assert!(sizes.iter().all(|size| *size <= SIZE), "blocks have up to {SIZE} rows");
        let mut adjacent = vec![BTreeSet::new(); sizes.len()];
        for &(row, column) in places.iter().filter(|(row, column)| row != column) {
            adjacent[row].insert(column);
            adjacent[column].insert(row);
        }
        let (mut pivots, mut neighbours, mut updates) = (Vec::new(), Vec::new(), Vec::new());
        let mut known = BTreeMap::new();
        for (group, own) in elimination_order(adjacent)? {
            let mut block = |row: usize, column: usize| {
                let next = known.len();
                *known.entry((row, column)).or_insert(next)
            };
            let (first, count) = (neighbours.len(), own.len());
            let diagonal = block(group, group);
            neighbours.extend(own.iter().map(|&i| Neighbour {
                group: i,
                lower: block(i, group),
                upper: block(group, i),
            }));
            let (order, start) = ([0; SIZE], updates.len());
            for &i in &own {
                updates.extend(own.iter().map(|&j| block(i, j)));
            }
            pivots.push(Pivot { group, diagonal, neighbours: first, updates: start, count, order });
        }
        let mut next = 0;
        let first = sizes.iter().map(|size| {
            next += size;
            next - size
        });
        Some(Self {
            first: first.collect(),
            sizes: sizes.to_vec(),
            pivots,
            neighbours,
            updates,
            places: places.iter().map(|place| known[place]).collect(),
            blocks: vec![ZERO; known.len()],
            scales: vec![[1.0; SIZE]; sizes.len()],
            x: vec![[0.0; SIZE]; sizes.len()],
        })
    }

    /// Number of blocks, fill included.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.blocks.len()
    }

    /// Factorizes the matrix with the `diagonal` and the given blocks, one for each place in their order, each by rows with
    /// its own number of rows and columns.
    ///
    /// # Errors
    /// [`Singular`] when the pivots are too small for this order of elimination.
    pub fn factorize<'a>(
        &mut self,
        diagonal: &[f64],
        blocks: impl Iterator<Item = ((usize, usize), &'a [f64])>,
    ) -> Result<(), Singular> {
        self.take_scales(diagonal);
        self.blocks.fill(ZERO);
        for (&place, ((row, column), block)) in self.places.iter().zip(blocks) {
            let (left, right) = (&self.scales[row], &self.scales[column]);
            let rows = block.chunks_exact(self.sizes[column].max(1));
            for ((own, row), left) in self.blocks[place].iter_mut().zip(rows).zip(left) {
                for ((own, value), right) in own.iter_mut().zip(row).zip(right) {
                    *own = left * value * right;
                }
            }
        }
        for pivot in &mut self.pivots {
            let own = &mut self.blocks[pivot.diagonal];
            complete(own, self.sizes[pivot.group]);
            factorize(own, &mut pivot.order)?;
            let neighbours = &self.neighbours[pivot.neighbours..][..pivot.count];
            eliminate(pivot, neighbours, &self.updates, &mut self.blocks)?;
        }
        Ok(())
    }

    fn take_scales(&mut self, diagonal: &[f64]) {
        for ((scales, first), size) in self.scales.iter_mut().zip(&self.first).zip(&self.sizes) {
            let own = &diagonal[*first..first + size];
            scales.iter_mut().zip(own).for_each(|(scale, d)| *scale = inverse_root(*d));
        }
    }

    /// Solves with the last factorization; `b` is overwritten by `x`.
    ///
    /// # Errors
    /// [`Singular`] when the answer is not finite.
    pub fn solve(&mut self, b: &mut [f64]) -> Result<(), Singular> {
        let Self { sizes, first, pivots, neighbours, blocks, scales, x, .. } = self;
        for (k, x) in x.iter_mut().enumerate() {
            *x = [0.0; SIZE];
            let own = &b[first[k]..first[k] + sizes[k]];
            own.iter().zip(&scales[k]).zip(x).for_each(|((b, scale), x)| *x = scale * b);
        }
        for pivot in &*pivots {
            let mut own = x[pivot.group];
            solve_row(&blocks[pivot.diagonal], &pivot.order, &mut own);
            x[pivot.group] = own;
            for neighbour in &neighbours[pivot.neighbours..][..pivot.count] {
                subtract(&blocks[neighbour.lower], &own, &mut x[neighbour.group]);
            }
        }
        for pivot in pivots.iter().rev() {
            let mut own = x[pivot.group];
            for neighbour in &neighbours[pivot.neighbours..][..pivot.count] {
                subtract(&blocks[neighbour.upper], &x[neighbour.group], &mut own);
            }
            x[pivot.group] = own;
        }
        let mut finite = true;
        for (k, x) in x.iter().enumerate() {
            let own = &mut b[first[k]..first[k] + sizes[k]];
            for ((b, scale), x) in own.iter_mut().zip(&scales[k]).zip(x) {
                *b = scale * x;
                finite &= b.is_finite();
            }
        }
        if finite { Ok(()) } else { Err(Singular) }
    }
}

/// `U_gj = D_g⁻¹ A_gj` and the blocks `A_ij` of the neighbours of a pivot.
#[inline]
fn eliminate(
    pivot: &Pivot,
    neighbours: &[Neighbour],
    updates: &[usize],
    blocks: &mut [Block],
) -> Result<(), Singular> {
    let D = blocks[pivot.diagonal];
    let mut largest = 0.0_f64;
    for neighbour in neighbours {
        let U = &mut blocks[neighbour.upper];
        solve_rows(&D, &pivot.order, U);
        largest = U.iter().flatten().fold(largest, |largest, u| largest.max(u.abs()));
    }
    if largest > LARGEST {
        return Err(Singular);
    }
    let mut updates = updates[pivot.updates..].iter();
    for row in neighbours {
        let lower = blocks[row.lower];
        for (column, place) in neighbours.iter().zip(&mut updates) {
            let (upper, mut own) = (blocks[column.upper], blocks[*place]);
            for i in 0..SIZE {
                for k in 0..SIZE {
                    for j in 0..SIZE {
                        own[i][j] -= lower[i][k] * upper[k][j];
                    }
                }
            }
            blocks[*place] = own;
        }
    }
    Ok(())
}

/// Ones on the diagonal beyond the unknowns of a group.
fn complete(block: &mut Block, size: usize) {
    (size..SIZE).for_each(|i| block[i][i] = 1.0);
}

/// LU of a block with row exchanges; reciprocals on the diagonal.
#[inline]
fn factorize(a: &mut Block, order: &mut [u8; SIZE]) -> Result<(), Singular> {
    for k in 0..SIZE {
        let mut largest = k;
        for i in k + 1..SIZE {
            if a[i][k].abs() > a[largest][k].abs() {
                largest = i;
            }
        }
        order[k] = largest as u8;
        a.swap(k, largest);
        let reciprocal = 1.0 / a[k][k];
        if !reciprocal.is_finite() {
            return Err(Singular);
        }
        a[k][k] = reciprocal;
        let row = a[k];
        for own in &mut a[k + 1..] {
            let factor = own[k] * reciprocal;
            own[k] = factor;
            for j in k + 1..SIZE {
                own[j] -= factor * row[j];
            }
        }
    }
    Ok(())
}

/// `b ← D⁻¹ b` for all columns of a block at once.
#[inline]
fn solve_rows(lu: &Block, order: &[u8; SIZE], b: &mut Block) {
    for k in 0..SIZE {
        b.swap(k, usize::from(order[k]));
    }
    for k in 0..SIZE {
        let row = b[k];
        for i in k + 1..SIZE {
            for j in 0..SIZE {
                b[i][j] -= lu[i][k] * row[j];
            }
        }
    }
    for k in (0..SIZE).rev() {
        for j in 0..SIZE {
            b[k][j] *= lu[k][k];
        }
        let row = b[k];
        for i in 0..k {
            for j in 0..SIZE {
                b[i][j] -= lu[i][k] * row[j];
            }
        }
    }
}

/// `b ← D⁻¹ b`.
#[inline]
fn solve_row(lu: &Block, order: &[u8; SIZE], b: &mut Row) {
    for k in 0..SIZE {
        b.swap(k, usize::from(order[k]));
    }
    for k in 0..SIZE {
        for i in k + 1..SIZE {
            b[i] -= lu[i][k] * b[k];
        }
    }
    for k in (0..SIZE).rev() {
        b[k] *= lu[k][k];
        for i in 0..k {
            b[i] -= lu[i][k] * b[k];
        }
    }
}

/// `y ← y − A x`.
#[inline]
fn subtract(a: &Block, x: &Row, y: &mut Row) {
    for i in 0..SIZE {
        for j in 0..SIZE {
            y[i] -= a[i][j] * x[j];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use vi_testkit::Sample;

    /// Groups of several sizes with their blocks, and the same matrix dense; `weight` of the diagonal.
    fn random(
        sample: &mut Sample,
        (sizes, places): (&[usize], &[(usize, usize)]),
        weight: f64,
    ) -> (Vec<Vec<f64>>, DMatrix<f64>) {
        let first = |group: usize| sizes[..group].iter().sum::<usize>();
        let d = first(sizes.len());
        let mut dense = DMatrix::zeros(d, d);
        let mut blocks = Vec::new();
        for &(row, column) in places {
            let mut block = Vec::new();
            for i in 0..sizes[row] {
                for j in 0..sizes[column] {
                    let own = if (row, i) == (column, j) { weight } else { 0.0 };
                    // two of three unknowns of another unit
                    let unit = |k: usize| if k % 3 == 0 { 1.0 } else { 1e4 };
                    let value = (sample.number() + own) * unit(i) * unit(j);
                    dense[(first(row) + i, first(column) + j)] = value;
                    block.push(value);
                }
            }
            blocks.push(block);
        }
        (blocks, dense)
    }

    fn both_ways(pairs: &[(usize, usize)], groups: usize) -> Vec<(usize, usize)> {
        let own = (0..groups).map(|g| (g, g));
        own.chain(pairs.iter().flat_map(|&(a, b)| [(a, b), (b, a)])).collect()
    }

    fn relative_error(
        lu: &mut BlockLu,
        blocks: &[Vec<f64>],
        places: &[(usize, usize)],
        a: &DMatrix<f64>,
    ) -> f64 {
        let d = a.nrows();
        let diagonal: Vec<f64> = a.diagonal().iter().copied().collect();
        lu.factorize(&diagonal, places.iter().copied().zip(blocks.iter().map(|b| &b[..]))).unwrap();
        let b = DVector::from_fn(d, |i, _| (1.0 + i as f64).sin());
        let mut x = b.clone();
        lu.solve(x.as_mut_slice()).unwrap();
        let size = a.abs() * x.abs() + b.abs();
        (a * x - b).component_div(&size).amax()
    }

    #[test]
    fn it_solves_chains_trees_rings_and_what_fills_in() {
        let mut sample = Sample::new(71);
        let chain: Vec<_> = (1..9).map(|k| (k - 1, k)).collect();
        let star: Vec<_> = (1..9).map(|k| (0, k)).collect();
        let ring: Vec<_> = chain.iter().copied().chain([(8, 0)]).collect();
        let grid: Vec<_> =
            (0..9).flat_map(|k| [(k, k + 1), (k, k + 3)]).filter(|p| p.1 < 9).collect();
        let sizes = [6, 6, 1, 3, 6, 2, 6, 0, 5];
        for (name, pairs, count) in
            [("chain", chain, 25), ("star", star, 25), ("ring", ring, 39), ("grid", grid, 0)]
        {
            let places = both_ways(&pairs, 9);
            let mut lu = BlockLu::new(&sizes, &places).unwrap();
            assert!(lu.blocks() == count || count == 0, "{name}: {} blocks", lu.blocks());
            for _ in 0..3 {
                let (blocks, dense) = random(&mut sample, (&sizes, &places), 8.0);
                let error = relative_error(&mut lu, &blocks, &places, &dense);
                println!("{name}: {} blocks, backward error {error:.1e}", lu.blocks());
                assert!(error < 1e-14, "{name}: {error:e}");
            }
        }
    }

    #[test]
    fn a_pivot_block_that_is_too_small_is_refused() {
        let places = both_ways(&[(0, 1)], 2);
        let mut lu = BlockLu::new(&[6, 6], &places).unwrap();
        let (mut blocks, _) = random(&mut Sample::new(72), (&[6, 6], &places), 0.0);
        let mut factorize = |size: f64| {
            blocks[0].fill(0.0);
            (0..SIZE).for_each(|i| blocks[0][7 * i] = size);
            let blocks = blocks.iter().map(|block| &block[..]);
            lu.factorize(&[1.0; 12], places.iter().copied().zip(blocks))
        };
        assert_eq!(factorize(0.0), Err(Singular));
        assert_eq!(factorize(1e-9), Err(Singular));
        assert_eq!(factorize(1e5), Ok(()));
    }

    #[test]
    fn a_dense_matrix_is_left_to_others() {
        let pairs: Vec<_> = (0..60).flat_map(|a| (0..a).map(move |b| (b, a))).collect();
        assert!(BlockLu::new(&[6; 60], &both_ways(&pairs, 60)).is_none());
    }

    #[test]
    fn scales_are_powers_of_two_near_the_inverse_root() {
        for k in -600..600 {
            let x = 1.37_f64.powi(k);
            let unit = inverse_root(-x) * inverse_root(x) * x;
            assert!((0.5..2.0).contains(&unit), "{x:e}: {unit}");
            assert!(inverse_root(x).log2().fract() == 0.0);
        }
        for x in [0.0, f64::NAN, f64::INFINITY, 1e-310] {
            assert!(inverse_root(x) == 1.0);
        }
    }
}
