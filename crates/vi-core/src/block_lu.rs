//! Sparse LU of blocks of up to six rows, for a symmetric pattern of blocks.
//!
//! ```text
//! pivot g:   U_gj = D_g⁻¹ A_gj,     A_ij ← A_ij − A_ig U_gj        i, j: neighbours of g that are eliminated later
//! forward    y_g = D_g⁻¹ x_g,       x_i ← x_i − A_ig y_g
//! backward   x_g = y_g − Σ_j U_gj x_j
//! ```
//! `D_g` is factorized with partial pivoting of its rows; between blocks the order is fixed, that
//! of the least number of neighbours (minimum degree) or of the least fill. A chain is eliminated
//! from one end to the other, a tree from its leaves: without fill, in linear time. Rows and
//! columns are scaled by powers of two near `|A_kk|^{−1/2}`. An entry of `U` beyond [`LARGEST`]
//! shows a pivot block that is too small for its neighbours: the factorization is then refused, and
//! a factorization with pivoting among all rows is needed.
//!
//! Blocks smaller than 6×6 are completed by those of the identity. Rows of a block are contiguous,
//! and every row is treated as a whole: the sums have the same order whatever the width of the
//! processor.
//!
//! Source: I. S. Duff, A. M. Erisman, J. K. Reid, Direct Methods for Sparse Matrices, 2nd ed.,
//! Oxford (2017), §7, §12; E. Rothberg, S. C. Eisenstat, SIAM J. Matrix Anal. Appl. 19 (1998)
//! 682–695.
#![allow(non_snake_case)] // A, B, C, D, U

use crate::linear::Singular;
use pulp::Arch;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;

/// Rows of a block.
pub const SIZE: usize = 6;
/// The largest entry of `D_g⁻¹ A_gj` after scaling: the backward error is below
/// `SIZE · LARGEST · ε ≈ 1e-10`.
pub const LARGEST: f64 = 1e5;

/// Updates of a pivot in the mean, beyond which a general factorization is as fast.
const UPDATES: usize = 64;

/// Limits of a factorization by blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FactorLimits {
    /// Most updates of a pivot, in the mean.
    pub updates: usize,
    /// The largest entry of `D_g⁻¹ A_gj` after scaling. A matrix whose symmetric part is positive
    /// definite needs no limit, nor does a method that looks at its residual.
    pub largest: f64,
    /// Which group is eliminated next.
    pub order: Order,
}

/// Which group is eliminated next; the first one of several.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// That with the least number of neighbours: without fill in chains and trees.
    LeastDegree,
    /// That which leaves the least fill at most, `½ d (d − 1) − ½ c (c − 1)` of `d` neighbours of
    /// which `c` are joined by the elimination of another one (Rothberg & Eisenstat 1998): two
    /// thirds of the updates in beds of thousands of bodies.
    LeastFill,
}

type Row = [f64; SIZE];
/// A block by rows.
pub type RowBlock = [Row; SIZE];

const ZERO: RowBlock = [[0.0; SIZE]; SIZE];

/// The elimination of a group of unknowns: its blocks are `D`, then `A_ig` and `A_gi` (later
/// `U_gi`) of each neighbour.
#[derive(Clone, Debug)]
struct Pivot {
    group: usize,
    blocks: Range<usize>,
    neighbours: Range<usize>,
    updates: usize,    // first of its updates
    order: [u8; SIZE], // row exchanges of the block
}

/// The factorization.
#[derive(Clone, Debug)]
pub struct BlockLu {
    sizes: Vec<usize>,    // of the groups
    first: Vec<usize>,    // unknown of each group
    pivots: Vec<Pivot>,   // in the order of elimination
    neighbours: Vec<u32>, // groups next to each pivot
    updates: Vec<u32>,    // blocks A_ij of each pivot, by rows
    places: Vec<usize>,   // block of each place of the matrix
    fill: Vec<usize>,     // blocks that are no place
    blocks: Vec<RowBlock>,
    scales: Vec<Row>, // of each group, powers of two
    x: Vec<Row>,
    largest: f64, // entry of U
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

/// The groups in the order of their elimination, each with its neighbours that are not eliminated
/// yet, in ascending order. `adjacent`: in ascending order. `None` where there is too much fill.
fn elimination_order(
    mut adjacent: Vec<Vec<u32>>,
    most: usize,
    by: Order,
) -> Option<Vec<(usize, Vec<u32>)>> {
    const FEW: usize = 4096; // updates that are never too many
    let most = FEW.max(most * adjacent.len());
    let (mut updates, mut union) = (0, Vec::new());
    let mut joined = vec![0_usize; adjacent.len()]; // neighbours of each: of one pivot
    let key = |adjacent: &[Vec<u32>], joined: &[usize], g: usize| {
        let (d, c) = (adjacent[g].len(), joined[g]);
        let fill = match by {
            Order::LeastDegree => 0,
            Order::LeastFill => d * d.saturating_sub(1) - c * c.saturating_sub(1),
        };
        Reverse((fill, d, g))
    };
    let all = 0..adjacent.len();
    let mut waiting: BinaryHeap<_> = all.map(|g| key(&adjacent, &joined, g)).collect();
    let mut done = vec![false; adjacent.len()];
    let mut order = Vec::with_capacity(adjacent.len());
    while let Some(next) = waiting.pop() {
        let Reverse((_, degree, g)) = next;
        if done[g] || next != key(&adjacent, &joined, g) {
            continue; // an entry from before its neighbours changed
        }
        done[g] = true;
        updates += degree * degree;
        if updates > most {
            return None;
        }
        let own = std::mem::take(&mut adjacent[g]);
        for i in own.iter().map(|i| *i as usize) {
            unite(&adjacent[i], &own, [g as u32, i as u32], &mut union);
            std::mem::swap(&mut adjacent[i], &mut union);
            joined[i] = (own.len() - 1).max(joined[i].saturating_sub(1));
            waiting.push(key(&adjacent, &joined, i));
        }
        order.push((g, own));
    }
    Some(order)
}

/// `union ← (a ∪ b) \ {without}`, all in ascending order.
fn unite(a: &[u32], b: &[u32], without: [u32; 2], union: &mut Vec<u32>) {
    union.clear();
    let (mut i, mut j) = (0, 0);
    loop {
        let next = match (a.get(i), b.get(j)) {
            (Some(own), Some(other)) => *own.min(other),
            (Some(own), None) | (None, Some(own)) => *own,
            (None, None) => return,
        };
        i += usize::from(a.get(i) == Some(&next));
        j += usize::from(b.get(j) == Some(&next));
        if !without.contains(&next) {
            union.push(next);
        }
    }
}

/// Where the blocks of a factorization stand: of each pivot, one after the other, its diagonal
/// block, then `A_ig` and `A_gi` of each neighbour.
struct Numbering<'a> {
    order: &'a [(usize, Vec<u32>)],
    rank: Vec<usize>,   // of the groups, in the order
    starts: Vec<usize>, // of the pivots, and the number of all blocks
}

impl<'a> Numbering<'a> {
    fn new(order: &'a [(usize, Vec<u32>)]) -> Self {
        let (mut rank, mut starts) = (vec![0; order.len()], vec![0]);
        for (place, (group, own)) in order.iter().enumerate() {
            rank[*group] = place;
            starts.push(starts[place] + 1 + 2 * own.len());
        }
        Self { order, rank, starts }
    }

    fn count(&self) -> usize {
        self.starts[self.order.len()]
    }

    /// The block of two groups that a pivot joins.
    fn block(&self, [row, column]: [usize; 2]) -> usize {
        let [a, b] = [self.rank[row], self.rank[column]];
        let [first, later] = if a < b { [a, column] } else { [b, row] };
        let place = self.order[first].1.partition_point(|own| (*own as usize) < later);
        match row == column {
            true => self.starts[a],
            false => self.starts[first] + 1 + 2 * place + usize::from(a < b),
        }
    }

    /// Appends the blocks `A_ij` of all neighbours of a pivot, by rows.
    fn updates(&self, own: &[u32], updates: &mut Vec<u32>) {
        let (first, size) = (updates.len(), own.len());
        updates.resize(first + size * size, 0);
        for (a, i) in own.iter().enumerate() {
            let rank = self.rank[*i as usize];
            let (start, list) = (self.starts[rank], &self.order[rank].1);
            updates[first + a * size + a] = start as u32;
            let mut place = 0;
            for (b, j) in own.iter().enumerate() {
                if self.rank[*j as usize] > rank {
                    place += list[place..].iter().take_while(|own| *own < j).count();
                    updates[first + a * size + b] = (start + 2 + 2 * place) as u32;
                    updates[first + b * size + a] = (start + 1 + 2 * place) as u32;
                }
            }
        }
    }
}

impl BlockLu {
    /// For groups of `sizes` unknowns (at most [`SIZE`] each) and the places `[row, column]` of
    /// blocks between them; places that are not listed are zero. `None` where there is too much
    /// fill: a general factorization is then as fast.
    ///
    /// # Panics
    /// When a group is larger.
    #[must_use]
    pub fn new(sizes: &[usize], places: &[[usize; 2]]) -> Option<Self> {
        let order = Order::LeastDegree;
        Self::with_limits(sizes, places, FactorLimits { updates: UPDATES, largest: LARGEST, order })
    }

    /// The same with other limits.
    ///
    /// # Panics
    /// As [`BlockLu::new`].
    #[must_use]
    pub fn with_limits(
        sizes: &[usize],
        places: &[[usize; 2]],
        limits: FactorLimits,
    ) -> Option<Self> {
        let FactorLimits { updates: most, largest, order: by } = limits;
        assert!(sizes.iter().all(|size| *size <= SIZE), "blocks have up to {SIZE} rows");
        let mut adjacent = vec![Vec::new(); sizes.len()];
        for &[row, column] in places.iter().filter(|[row, column]| row != column) {
            adjacent[row].push(column as u32);
            adjacent[column].push(row as u32);
        }
        for own in &mut adjacent {
            own.sort_unstable();
            own.dedup();
        }
        let order = elimination_order(adjacent, most, by)?;
        let numbering = Numbering::new(&order);
        let (mut pivots, mut neighbours, mut updates) = (Vec::new(), Vec::new(), Vec::new());
        for (&start, (group, own)) in numbering.starts.iter().zip(&order) {
            let first = neighbours.len();
            neighbours.extend_from_slice(own);
            pivots.push(Pivot {
                group: *group,
                blocks: start..start + 1 + 2 * own.len(),
                neighbours: first..neighbours.len(),
                updates: updates.len(),
                order: [0; SIZE],
            });
            numbering.updates(own, &mut updates);
        }
        let places: Vec<usize> = places.iter().map(|place| numbering.block(*place)).collect();
        let mut is_fill = vec![true; numbering.count()];
        places.iter().for_each(|&place| is_fill[place] = false);
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
            places,
            fill: (0..is_fill.len()).filter(|&k| is_fill[k]).collect(),
            blocks: vec![ZERO; is_fill.len()],
            scales: vec![[1.0; SIZE]; sizes.len()],
            x: vec![[0.0; SIZE]; sizes.len()],
            largest,
        })
    }

    /// Number of blocks, fill included.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.blocks.len()
    }

    /// Factorizes the matrix with the `diagonal` and the given blocks, one for each place in their
    /// order, each by rows with its own number of rows and columns.
    ///
    /// # Errors
    /// [`Singular`] when the pivots are too small for this order of elimination.
    pub fn factorize<'a>(
        &mut self,
        diagonal: &[f64],
        blocks: impl Iterator<Item = ([usize; 2], &'a [f64])>,
    ) -> Result<(), Singular> {
        self.take_scales(diagonal);
        let Self { sizes, pivots, updates, places, fill, scales, blocks: all, largest, .. } = self;
        Arch::new().dispatch(
            #[inline(always)]
            || {
                fill.iter().for_each(|&k| all[k] = ZERO);
                for (&place, ([row, column], block)) in places.iter().zip(blocks) {
                    let (left, right) = (&scales[row], &scales[column]);
                    take(block, sizes[column], left, right, &mut all[place]);
                }
                for pivot in pivots {
                    let (own, later) = all.split_at_mut(pivot.blocks.end);
                    let own = &mut own[pivot.blocks.start..];
                    complete(&mut own[0], sizes[pivot.group]);
                    factorize(&mut own[0], &mut pivot.order)?;
                    let targets = &updates[pivot.updates..];
                    let later = (later, pivot.blocks.end);
                    eliminate(own, &pivot.order, targets, later, *largest)?;
                }
                Ok(())
            },
        )
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
        Arch::new().dispatch(
            #[inline(always)]
            || {
                for pivot in &*pivots {
                    let (mut own, parts) = (x[pivot.group], &blocks[pivot.blocks.clone()]);
                    solve_row(&parts[0], &pivot.order, &mut own);
                    x[pivot.group] = own;
                    let pairs =
                        parts[1..].chunks_exact(2).zip(&neighbours[pivot.neighbours.clone()]);
                    pairs.for_each(|(pair, group)| {
                        subtract(&pair[0], &own, &mut x[*group as usize])
                    });
                }
                for pivot in pivots.iter().rev() {
                    let (mut own, parts) = (x[pivot.group], &blocks[pivot.blocks.clone()]);
                    let pairs =
                        parts[1..].chunks_exact(2).zip(&neighbours[pivot.neighbours.clone()]);
                    pairs.for_each(|(pair, group)| {
                        subtract(&pair[1], &x[*group as usize], &mut own)
                    });
                    x[pivot.group] = own;
                }
            },
        );
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

/// Writes a block by rows of the given number of columns, scaled.
#[inline(always)]
fn take(block: &[f64], columns: usize, left: &Row, right: &Row, out: &mut RowBlock) {
    if let Ok(block) = <&[f64; SIZE * SIZE]>::try_from(block) {
        for i in 0..SIZE {
            for j in 0..SIZE {
                out[i][j] = left[i] * block[SIZE * i + j] * right[j];
            }
        }
        return;
    }
    *out = ZERO; // a failed factorization may have left anything beyond the unknowns
    for ((own, row), left) in out.iter_mut().zip(block.chunks_exact(columns.max(1))).zip(left) {
        for ((own, value), right) in own.iter_mut().zip(row).zip(right) {
            *own = left * value * right;
        }
    }
}

/// `U_gj = D_g⁻¹ A_gj` of a pivot with its blocks, and the blocks `A_ij` of its neighbours, which
/// are `later` from the block `first` on.
#[inline(always)]
fn eliminate(
    own: &mut [RowBlock],
    order: &[u8; SIZE],
    targets: &[u32],
    (later, first): (&mut [RowBlock], usize),
    largest: f64,
) -> Result<(), Singular> {
    let (D, pairs) = own.split_at_mut(1);
    let mut is_large = false;
    for pair in pairs.chunks_exact_mut(2) {
        solve_rows(&D[0], order, &mut pair[1]);
        is_large |= pair[1].iter().flatten().fold(false, |large, u| large | (u.abs() > largest));
    }
    if is_large {
        return Err(Singular);
    }
    let mut targets = targets.iter();
    for row in pairs.chunks_exact(2) {
        for (column, target) in pairs.chunks_exact(2).zip(&mut targets) {
            subtract_product(&row[0], &column[1], &mut later[*target as usize - first]);
        }
    }
    Ok(())
}

/// `C ← C − A B`.
#[inline(always)]
fn subtract_product(A: &RowBlock, B: &RowBlock, C: &mut RowBlock) {
    for i in 0..SIZE {
        let mut row = C[i];
        for k in 0..SIZE {
            for j in 0..SIZE {
                row[j] -= A[i][k] * B[k][j];
            }
        }
        C[i] = row;
    }
}

/// Ones on the diagonal beyond the unknowns of a group.
#[inline(always)]
fn complete(block: &mut RowBlock, size: usize) {
    (size..SIZE).for_each(|i| block[i][i] = 1.0);
}

/// LU of a block with row exchanges; reciprocals on the diagonal.
#[inline(always)]
fn factorize(a: &mut RowBlock, order: &mut [u8; SIZE]) -> Result<(), Singular> {
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
#[inline(always)]
fn solve_rows(lu: &RowBlock, order: &[u8; SIZE], b: &mut RowBlock) {
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
#[inline(always)]
fn solve_row(lu: &RowBlock, order: &[u8; SIZE], b: &mut Row) {
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
#[inline(always)]
fn subtract(a: &RowBlock, x: &Row, y: &mut Row) {
    for i in 0..SIZE {
        for j in 0..SIZE {
            y[i] -= a[i][j] * x[j];
        }
    }
}

#[cfg(test)]
mod tests;
