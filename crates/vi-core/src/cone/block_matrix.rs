//! `I + Lᵀ B L` in blocks of the columns of `L` that occur in the same laws, and its factors.
#![allow(non_snake_case)] // L

use crate::block_lu::{BlockLu, FactorLimits, Order, SIZE};
use crate::linear::{Singular, dot};
use std::collections::BTreeMap;
use std::ops::Range;

/// With more updates memory ends before time does.
const UPDATES: usize = 1 << 14;

/// A column of `L` in the rows of a law.
pub(super) type FactorColumn = (usize, [f64; 3]);

/// The matrix and its factors by blocks. With symmetric `B ≥ 0` it is positive definite, and every
/// order of elimination is stable; else the methods that use it look at their residuals.
#[derive(Debug, Default)]
pub(super) struct BlockMatrix {
    columns: Vec<Range<usize>>, // of each block of columns
    group: Vec<usize>,          // r  of each column
    places: Vec<[usize; 2]>,    // of the blocks
    values: Vec<f64>,           // by blocks, then rows
    starts: Vec<usize>,         // of the values of each block
    diagonals: Vec<usize>,      // r  places among the values
    diagonal: Vec<f64>,         // r
    targets: Vec<usize>,        // of the pairs of blocks of each law, in order
    product: Vec<[f64; 3]>,     // scratch: rows of Lᵀ B
    lu: Option<BlockLu>,
}

impl BlockMatrix {
    /// Divides `r` columns into blocks: of each law, its columns in ascending order. There is no
    /// pattern then.
    pub(super) fn divide<'a>(
        &mut self,
        r: usize,
        laws: impl Iterator<Item = &'a [FactorColumn]> + Clone,
    ) {
        let mut begins = vec![false; r + 1];
        (begins[0], begins[r]) = (true, true);
        for own in laws.clone().filter(|own| !own.is_empty()) {
            (begins[own[0].0], begins[own[own.len() - 1].0 + 1]) = (true, true);
            for pair in own.windows(2).filter(|pair| pair[0].0 + 1 < pair[1].0) {
                (begins[pair[0].0 + 1], begins[pair[1].0]) = (true, true);
            }
        }
        self.lu = None;
        self.columns.clear();
        self.group.clear();
        let mut first = 0;
        for column in 1..=r {
            if begins[column] || column - first == SIZE {
                self.group.resize(column, self.columns.len());
                self.columns.push(first..column);
                first = column;
            }
        }
    }

    /// Takes the pattern over of those laws whose blocks [`BlockMatrix::factorize`] adds.
    pub(super) fn analyse<'a>(
        &mut self,
        laws: impl Iterator<Item = &'a [FactorColumn]>,
        order: Order,
    ) {
        let sizes: Vec<usize> = self.columns.iter().map(ExactSizeIterator::len).collect();
        let mut known: BTreeMap<[usize; 2], usize> = BTreeMap::new();
        self.places.clear();
        self.targets.clear();
        let mut place = |at: [usize; 2]| {
            *known.entry(at).or_insert_with(|| {
                self.places.push(at);
                self.places.len() - 1
            })
        };
        (0..sizes.len()).for_each(|group| _ = place([group, group]));
        for own in laws {
            let groups = || runs(&self.group, own).map(|run| self.group[own[run.start].0]);
            groups().for_each(|a| self.targets.extend(groups().map(|b| place([a, b]))));
        }
        self.starts.clear();
        let mut length = 0;
        for [a, b] in &self.places {
            self.starts.push(length);
            length += sizes[*a] * sizes[*b];
        }
        self.values.resize(length, 0.0);
        self.diagonals.clear();
        for (start, size) in self.starts.iter().zip(&sizes) {
            self.diagonals.extend((0..*size).map(|i| start + i * (size + 1)));
        }
        let limits = FactorLimits { updates: UPDATES, largest: f64::INFINITY, order };
        self.lu = BlockLu::with_limits(&sizes, &self.places, limits);
    }

    /// Whether there is a pattern that can be factorized.
    pub(super) fn is_analysed(&self) -> bool {
        self.lu.is_some()
    }

    /// Number of blocks of the factors.
    #[cfg(test)]
    pub(super) fn blocks(&self) -> usize {
        self.lu.as_ref().map_or(0, BlockLu::blocks)
    }

    /// Factorizes the matrix with the columns and blocks `B` of the laws.
    ///
    /// # Errors
    /// [`Singular`].
    pub(super) fn factorize<'a>(
        &mut self,
        laws: impl Iterator<Item = (&'a [FactorColumn], &'a [[f64; 3]; 3])>,
    ) -> Result<(), Singular> {
        let Self { columns, group, places, values, starts, diagonals, diagonal, .. } = self;
        values.fill(0.0);
        diagonals.iter().for_each(|place| values[*place] = 1.0);
        let mut targets = self.targets.iter();
        for (own, B) in laws {
            self.product.clear();
            self.product.extend(own.iter().map(|(_, a)| row(a, B)));
            for rows in runs(group, own) {
                for run in runs(group, own) {
                    let Some(target) = targets.next() else { continue };
                    let [a, b] = [&rows, &run].map(|run| &columns[group[own[run.start].0]]);
                    let values = &mut values[starts[*target]..];
                    for i in rows.clone() {
                        let at = (own[i].0 - a.start) * b.len();
                        for (column, entries) in &own[run.clone()] {
                            values[at + column - b.start] += dot(&self.product[i], entries);
                        }
                    }
                }
            }
        }
        diagonal.clear();
        diagonal.extend(diagonals.iter().map(|place| values[*place]));
        let blocks = places.iter().zip(&*starts).map(|(place, start)| {
            let size = place.map(|own| columns[own].len());
            (*place, &values[*start..start + size[0] * size[1]])
        });
        self.lu.as_mut().ok_or(Singular)?.factorize(diagonal, blocks)
    }

    /// Solves with the last factorization; `u` is overwritten by the solution.
    ///
    /// # Errors
    /// [`Singular`] when it is not finite.
    pub(super) fn solve(&mut self, u: &mut [f64]) -> Result<(), Singular> {
        self.lu.as_mut().ok_or(Singular)?.solve(u)
    }
}

/// Columns of a law in the same block: ranges among them.
fn runs<'a>(
    group: &'a [usize],
    own: &'a [FactorColumn],
) -> impl Iterator<Item = Range<usize>> + 'a {
    let mut first = 0;
    std::iter::from_fn(move || {
        let block = group[own.get(first)?.0];
        let start = first;
        first += own[first..].iter().take_while(|column| group[column.0] == block).count();
        Some(start..first)
    })
}

/// `aᵀ B`.
fn row(a: &[f64; 3], B: &[[f64; 3]; 3]) -> [f64; 3] {
    std::array::from_fn(|j| (0..3).map(|i| a[i] * B[i][j]).sum())
}
