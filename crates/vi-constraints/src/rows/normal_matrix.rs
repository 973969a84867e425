//! `GᵀG + αI` of a Jacobian with its factors, the memory sized once for the pattern of `G`.
//!
//! The matrix is factorized in blocks of six columns, half a frame or two particles, one after the
//! other in the order of least degree ([`BlockLu`]). Where that has too much fill, or a block is
//! too small for its neighbours, sparse Cholesky factors take its place.

use vi_core::block_lu::{BlockLu, SIZE};
use vi_core::linear::{Singular, norm_inf};
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::sparse_cholesky::SparseCholesky;

/// `α` in parts of the largest entry of the diagonal.
const SHIFT: f64 = 1e-12;

/// The normal matrix of Jacobians of one pattern.
#[derive(Debug)]
pub(crate) struct NormalMatrix {
    rows: RowPattern,
    numbers: Vec<f64>, // of the Jacobian that the factors are of; empty without factors
    diagonal: Vec<f64>, // n  of GᵀG + αI
    blocks: Option<NormalBlocks>,
    general: General,
    in_blocks: bool, // which of them has the factors
}

/// The pattern of a Jacobian row by row.
#[derive(Debug)]
struct RowPattern {
    shape: (usize, usize),
    starts: Vec<usize>,           // m + 1
    entries: Vec<(usize, usize)>, // column, place among the numbers of G; columns rise along a row
}

/// The matrix in blocks.
#[derive(Debug)]
struct NormalBlocks {
    lu: BlockLu,
    places: Vec<[usize; 2]>,
    starts: Vec<usize>,       // of each block among the values, and their number
    values: Vec<f64>,         // block by block, each by rows
    targets: Vec<[usize; 2]>, // values that each product of a row adds to: (i, j) and (j, i)
    diagonal: Vec<usize>,     // n
}

/// The lower triangle, once it was needed.
#[derive(Debug, Default)]
struct General {
    matrix: Option<SparseMatrix>,
    cholesky: Option<SparseCholesky>,
}

/// A Jacobian, and the diagonal of its normal matrix.
#[derive(Clone, Copy)]
struct GivenJacobian<'a> {
    rows: &'a RowPattern,
    numbers: &'a [f64],
    diagonal: &'a [f64],
}

impl RowPattern {
    fn new(jacobian: &SparseMatrix) -> Self {
        let shape = jacobian.shape();
        let (mut count, mut rows) = (0, vec![Vec::new(); shape.0]);
        jacobian.for_each(|i, j, _| {
            rows[i].push((j, count));
            count += 1;
        });
        let mut starts = vec![0];
        rows.iter().for_each(|row| starts.push(starts[starts.len() - 1] + row.len()));
        Self { shape, starts, entries: rows.concat() }
    }

    /// The columns `i > j` of each product of two entries of a row, and their places among the
    /// numbers of `G`.
    #[inline]
    fn for_each_product(&self, mut visit: impl FnMut([usize; 2], [usize; 2])) {
        for row in self.starts.windows(2).map(|ends| &self.entries[ends[0]..ends[1]]) {
            for (k, &(i, place)) in row.iter().enumerate() {
                row[..k].iter().for_each(|&(j, other)| visit([i, j], [place, other]));
            }
        }
    }
}

impl NormalBlocks {
    /// `None` where there is too much fill.
    fn new(rows: &RowPattern) -> Option<Self> {
        let n = rows.shape.1;
        let sizes: Vec<usize> = (0..n).step_by(SIZE).map(|first| SIZE.min(n - first)).collect();
        let mut places: Vec<[usize; 2]> = (0..sizes.len()).map(|g| [g, g]).collect();
        rows.for_each_product(|[i, j], _| {
            places.extend([[i / SIZE, j / SIZE], [j / SIZE, i / SIZE]]);
        });
        places.sort_unstable();
        places.dedup();
        let lu = BlockLu::new(&sizes, &places)?;
        let mut starts = vec![0];
        let size = |[row, column]: &[usize; 2]| sizes[*row] * sizes[*column];
        places.iter().for_each(|place| starts.push(starts[starts.len() - 1] + size(place)));
        let value = |i: usize, j: usize| {
            let (row, column) = (i / SIZE, j / SIZE);
            let block = places.binary_search(&[row, column]).ok();
            block.map(|block| starts[block] + (i % SIZE) * sizes[column] + j % SIZE)
        };
        let mut targets = Vec::new();
        rows.for_each_product(|[i, j], _| targets.extend(value(i, j).zip(value(j, i))));
        let targets = targets.into_iter().map(|(lower, upper)| [lower, upper]).collect();
        let diagonal = (0..n).filter_map(|j| value(j, j)).collect();
        let values = vec![0.0; starts[places.len()]];
        Some(Self { lu, places, starts, values, targets, diagonal })
    }

    fn factorize(&mut self, of: GivenJacobian<'_>) -> Result<(), Singular> {
        let Self { lu, places, starts, values, targets, diagonal: own } = self;
        values.fill(0.0);
        let mut targets = targets.iter();
        of.rows.for_each_product(|_, [a, b]| {
            let Some(&[lower, upper]) = targets.next() else { return };
            let product = of.numbers[a] * of.numbers[b];
            values[lower] += product;
            values[upper] += product;
        });
        own.iter().zip(of.diagonal).for_each(|(&place, value)| values[place] = *value);
        let blocks = starts.windows(2).map(|ends| &values[ends[0]..ends[1]]);
        lu.factorize(of.diagonal, places.iter().copied().zip(blocks))
    }
}

impl General {
    fn factorize(&mut self, of: GivenJacobian<'_>) -> Result<(), Singular> {
        let n = of.diagonal.len();
        let matrix = SparseMatrix::update(&mut self.matrix, (n, n), |out| of.emit_lower(out));
        let known = self.cholesky.take();
        let cholesky = known.map_or_else(|| SparseCholesky::new(matrix), Ok)?;
        self.cholesky.insert(cholesky).factorize(matrix)
    }
}

impl GivenJacobian<'_> {
    /// The lower triangle, row by row of `G`.
    fn emit_lower(&self, out: &mut dyn Entries) {
        let Self { rows, numbers, diagonal } = self;
        rows.for_each_product(|[i, j], [a, b]| out.add(i, j, numbers[a] * numbers[b]));
        (0..).zip(*diagonal).for_each(|(j, value)| out.add(j, j, *value));
    }
}

impl NormalMatrix {
    /// Of Jacobians with the pattern of this one.
    pub(crate) fn new(jacobian: &SparseMatrix) -> Self {
        let rows = RowPattern::new(jacobian);
        let (blocks, diagonal) = (NormalBlocks::new(&rows), vec![0.0; rows.shape.1]);
        let numbers = Vec::with_capacity(rows.entries.len());
        Self { rows, numbers, diagonal, blocks, general: General::default(), in_blocks: false }
    }

    /// Whether a Jacobian has this pattern, as far as its shape and the number of its entries tell.
    pub(crate) fn is_of(&self, jacobian: &SparseMatrix) -> bool {
        let RowPattern { shape, entries, .. } = &self.rows;
        *shape == jacobian.shape() && entries.len() == jacobian.as_sprs().nnz()
    }

    /// Does nothing for the Jacobian that was factorized last.
    ///
    /// # Errors
    /// [`Singular`] for entries that are not finite.
    pub(crate) fn factorize(&mut self, jacobian: &SparseMatrix) -> Result<(), Singular> {
        let Self { rows, numbers: known, diagonal, blocks, general, in_blocks } = self;
        let numbers = jacobian.as_sprs().data();
        if known == numbers {
            return Ok(());
        }
        known.clear();
        diagonal.fill(0.0);
        rows.entries.iter().for_each(|&(j, place)| diagonal[j] += numbers[place].powi(2));
        let shift = SHIFT * norm_inf(diagonal);
        diagonal.iter_mut().for_each(|value| *value += shift);
        let of = GivenJacobian { rows, numbers, diagonal };
        *in_blocks = blocks.as_mut().is_some_and(|blocks| blocks.factorize(of).is_ok());
        if !*in_blocks {
            general.factorize(of)?;
        }
        known.extend_from_slice(numbers);
        Ok(())
    }

    /// Solves with the last factors; `b` is overwritten by `x`.
    ///
    /// # Errors
    /// [`Singular`] when the answer is not finite, or without factors.
    pub(crate) fn solve(&mut self, b: &mut [f64]) -> Result<(), Singular> {
        match (&mut self.blocks, &mut self.general.cholesky) {
            (Some(blocks), _) if self.in_blocks => blocks.lu.solve(b),
            (_, Some(cholesky)) => cholesky.solve(b),
            _ => Err(Singular),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ring of `count` bodies of eight coordinates, three rows between neighbours of which one
    /// repeats another.
    fn ring(count: usize, scale: f64) -> SparseMatrix {
        let number = |row: usize, k: usize| scale * libm::sin((13 * row * row + 7 * k + 1) as f64);
        SparseMatrix::assemble(3 * count, 8 * count, |out: &mut dyn Entries| {
            for row in 0..3 * count {
                let (body, same) = (row / 3, row - usize::from(row % 3 == 2));
                for k in (0..16).step_by(3) {
                    out.add(row, (8 * body + k) % (8 * count), number(same, k));
                }
            }
        })
    }

    /// `|G(x − y)| / |G x|` of both factorizations: `x` and `y` may differ along `null G`.
    fn apart(jacobian: &SparseMatrix, normal: &mut NormalMatrix) -> f64 {
        let (m, n) = jacobian.shape();
        let (mut x, mut of_x, mut of_gap) = (vec![0.0; n], vec![0.0; m], vec![0.0; m]);
        let given: Vec<f64> = (0..m).map(|i| libm::cos(i as f64)).collect();
        jacobian.tr_mul_add(1.0, &given, &mut x);
        let mut y = x.clone();
        normal.factorize(jacobian).unwrap();
        assert!(normal.in_blocks);
        normal.solve(&mut x).unwrap();
        normal.blocks = None;
        normal.numbers.clear();
        normal.factorize(jacobian).unwrap();
        assert!(!normal.in_blocks);
        normal.solve(&mut y).unwrap();
        jacobian.mul_add(1.0, &x, &mut of_x);
        x.iter_mut().zip(&y).for_each(|(x, y)| *x -= y);
        jacobian.mul_add(1.0, &x, &mut of_gap);
        norm_inf(&of_gap) / norm_inf(&of_x)
    }

    #[test]
    fn blocks_and_general_factors_give_the_same_forces() {
        for count in [2, 3, 10, 41] {
            let jacobian = ring(count, 1.0);
            let gap = apart(&jacobian, &mut NormalMatrix::new(&jacobian));
            println!("{count} bodies: {gap:.1e}");
            assert!(gap < 1e-9, "{gap:e}");
        }
    }

    #[test]
    fn new_numbers_of_the_pattern_are_factorized_anew() {
        let (first, second) = (ring(5, 1.0), ring(5, 3.0));
        let mut normal = NormalMatrix::new(&first);
        let mut solve = |jacobian: &SparseMatrix| {
            assert!(normal.is_of(jacobian));
            normal.factorize(jacobian).unwrap();
            let mut x = vec![0.0; 40];
            jacobian.tr_mul_add(1.0, &[1.0; 15], &mut x);
            normal.solve(&mut x).unwrap();
            let mut forces = vec![0.0; 15];
            jacobian.mul_add(1.0, &x, &mut forces);
            forces
        };
        let (a, b) = (solve(&first), solve(&second)); // projections onto one range
        let gaps: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
        let gap = norm_inf(&gaps);
        println!("{gap:.1e}");
        assert!(gap < 1e-9, "{gap:e}");
    }
}
