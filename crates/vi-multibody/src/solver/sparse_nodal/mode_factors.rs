//! Factors of `A + h α B + h² α² C` for the modes of a Galerkin step [2.34].
//!
//! A pair of modes `α = a ± ib` is one real matrix of twice the size, the unknowns of a joint
//! beside each other:
//! ```text
//! [  X  Y ]      X = A + h a B + h² (a² − b²) C
//! [ −Y  X ]      Y =     h b B + h² 2ab C
//! ```
//! By blocks where that takes little fill ([`BlockLu`]), else by a general sparse LU.
#![allow(non_snake_case)] // A, B, C, X, Y

use super::layout::{MapColumns, VelocityLayout};
use super::reduced_matrix::ReducedMatrix;
use std::collections::BTreeMap;
use std::ops::Range;
use vi_core::block_lu::{BlockLu, inverse_root};
use vi_core::galerkin_pencil::{GalerkinPencil, PencilBlock};
use vi_core::linear::{Singular, SparseLu};
use vi_core::sparse::{Entries, SparseMatrix};

crate::opaque_debug!(ModeFactors);

/// The matrix between the unknowns of two joints.
struct JointBlock {
    row: usize,
    column: usize,
    values: Range<usize>,
    tiles: [Option<usize>; 3], // of A, B, C
}

/// The factors of one mode.
struct FactoredMode {
    mode: PencilBlock,
    blocks: Option<BlockLu>,
    is_eliminated: bool,
    sparse: Option<(SparseMatrix, SparseLu)>,
    scale: Vec<f64>, // of the rows and columns of `sparse`, powers of two
}

/// `A`, `B`, `C` with the factors of all modes.
pub struct ModeFactors {
    matrices: [ReducedMatrix; 3],
    groups: Vec<Range<usize>>,
    places: Vec<JointBlock>,
    values: [Vec<f64>; 3], // X, Y, −Y
    diagonal: Vec<f64>,
    factors: Vec<FactoredMode>,
    x: Vec<f64>, // 2d  joint by joint
}

impl ModeFactors {
    /// For the modes of a scheme.
    #[must_use]
    pub fn new(layout: &VelocityLayout, pencil: &GalerkinPencil) -> Self {
        let factors = |mode: &PencilBlock| FactoredMode {
            mode: *mode,
            blocks: None,
            is_eliminated: false,
            sparse: None,
            scale: Vec::new(),
        };
        Self {
            matrices: std::array::from_fn(|_| ReducedMatrix::default()),
            groups: layout.groups(),
            places: Vec::new(),
            values: Default::default(),
            diagonal: Vec::new(),
            factors: pencil.modes.iter().map(factors).collect(),
            x: vec![0.0; 2 * layout.dof()],
        }
    }

    /// Factorizes all modes for steps `h` with `A`, `B`, `C` between the `columns`, as `emit`
    /// writes the `n × n` matrices: always the same places in the same order.
    pub fn factorize(
        &mut self,
        layout: &VelocityLayout,
        columns: &MapColumns,
        emit: [&dyn Fn(&mut dyn Entries); 3],
        h: f64,
    ) {
        for (matrix, emit) in self.matrices.iter_mut().zip(emit) {
            matrix.fill(layout, emit, columns, columns, &[]);
        }
        if self.places.is_empty() {
            self.analyse();
        }
        for k in 0..self.factors.len() {
            let mode = self.factors[k].mode;
            let powers = [1.0, h, h * h];
            let weights = |factors: [f64; 3]| -> [f64; 3] {
                std::array::from_fn(|part| factors[part] * powers[part])
            };
            self.combine(0, weights(mode.diagonal()));
            self.combine(1, weights(mode.beside()));
            let [_, Y, minus] = &mut self.values;
            minus.iter_mut().zip(Y).for_each(|(minus, y)| *minus = -*y);
            self.take_diagonal(mode.size());
            let Self { places, values, diagonal, factors, .. } = self;
            let own = &mut factors[k];
            own.is_eliminated = own.blocks.as_mut().is_some_and(|lu| {
                lu.factorize(diagonal, blocks(places, values, mode.size())).is_ok()
            });
            if !own.is_eliminated {
                self.assemble(k);
            }
        }
    }

    fn analyse(&mut self) {
        let mut known: BTreeMap<[usize; 2], [Option<usize>; 3]> = BTreeMap::new();
        for (part, matrix) in self.matrices.iter().enumerate() {
            for (k, (place, _)) in matrix.tiles().enumerate() {
                known.entry(place).or_default()[part] = Some(k);
            }
        }
        let mut length = 0;
        for ([row, column], tiles) in known {
            let start = length;
            length += self.groups[row].len() * self.groups[column].len();
            self.places.push(JointBlock { row, column, values: start..length, tiles });
        }
        self.values = std::array::from_fn(|_| vec![0.0; length]);
        for own in &mut self.factors {
            let copies = own.mode.size();
            let sizes = self.groups.iter().flat_map(|group| vec![group.len(); copies]);
            let places: Vec<_> =
                blocks(&self.places, &self.values, copies).map(|(place, _)| place).collect();
            own.blocks = BlockLu::new(&sizes.collect::<Vec<_>>(), &places);
        }
    }

    /// `X` or `Y` from `A`, `B`, `C`.
    fn combine(&mut self, out: usize, weights: [f64; 3]) {
        let Self { matrices, places, values, .. } = self;
        let values = &mut values[out];
        values.fill(0.0);
        for place in places {
            for ((matrix, tile), weight) in matrices.iter().zip(place.tiles).zip(weights) {
                let Some(tile) = tile else { continue };
                let own = values[place.values.clone()].iter_mut().zip(matrix.tile(tile));
                own.for_each(|(value, entry)| *value += weight * entry);
            }
        }
    }

    fn take_diagonal(&mut self, copies: usize) {
        let Self { groups, places, values, diagonal, .. } = self;
        diagonal.clear();
        for place in places.iter().filter(|place| place.row == place.column) {
            let own = &values[0][place.values.clone()];
            let entries = own.iter().step_by(groups[place.row].len() + 1);
            (0..copies).for_each(|_| diagonal.extend(entries.clone()));
        }
    }

    /// The matrix of a mode for a general factorization.
    fn assemble(&mut self, k: usize) {
        let Self { groups, places, values, diagonal, factors, .. } = self;
        let own = &mut factors[k];
        own.scale.clear();
        own.scale.extend(diagonal.iter().map(|d| inverse_root(*d)));
        let (copies, scale) = (own.mode.size(), &own.scale);
        // unknowns before those of a copy of a joint
        let first = |g: usize| {
            let group = &groups[g / copies];
            copies * group.start + (g % copies) * group.len()
        };
        let emit = |out: &mut dyn Entries| {
            for ([row, column], values) in blocks(places, values, copies) {
                let size = groups[column / copies].len();
                for (entry, value) in values.iter().enumerate() {
                    let (i, j) = (first(row) + entry / size, first(column) + entry % size);
                    out.add(i, j, scale[i] * value * scale[j]);
                }
            }
        };
        match &mut own.sparse {
            Some((matrix, _)) => matrix.refill(emit),
            none => {
                let matrix = SparseMatrix::assemble(scale.len(), scale.len(), emit);
                *none = SparseLu::new(&matrix).ok().map(|lu| (matrix, lu));
            }
        }
    }

    /// Solves for the mode `k`; `x`: its one or two columns, one after the other.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn solve(&mut self, k: usize, x: &mut [f64]) -> Result<(), Singular> {
        let Self { groups, factors, x: inner, .. } = self;
        let own = &mut factors[k];
        let (copies, d) = (own.mode.size(), x.len() / own.mode.size());
        let inner = &mut inner[..x.len()];
        let places = || {
            let copy = move |group: &Range<usize>, copy: usize| {
                let start = copies * group.start + copy * group.len();
                (copy * d + group.start..copy * d + group.end, start..start + group.len())
            };
            groups.iter().flat_map(move |group| (0..copies).map(move |k| copy(group, k)))
        };
        for (outer, own) in places() {
            inner[own].copy_from_slice(&x[outer]);
        }
        if own.is_eliminated {
            own.blocks.as_mut().ok_or(Singular)?.solve(inner)?;
        } else {
            let (matrix, lu) = own.sparse.as_mut().ok_or(Singular)?;
            inner.iter_mut().zip(&own.scale).for_each(|(x, scale)| *x *= scale);
            lu.solve(matrix, inner)?;
            inner.iter_mut().zip(&own.scale).for_each(|(x, scale)| *x *= scale);
        }
        for (outer, own) in places() {
            x[outer].copy_from_slice(&inner[own]);
        }
        Ok(())
    }
}

/// The blocks of the matrix of a mode, each at its place among the copies of the joints.
fn blocks<'a>(
    places: &'a [JointBlock],
    values: &'a [Vec<f64>; 3],
    copies: usize,
) -> impl Iterator<Item = ([usize; 2], &'a [f64])> {
    let [X, Y, minus] = values;
    let parts = [(0, 0, X), (0, 1, Y), (1, 0, minus), (1, 1, X)];
    let count = copies * copies;
    places.iter().flat_map(move |place| {
        parts.into_iter().take(count).map(move |(i, j, values)| {
            let at = [copies * place.row + i, copies * place.column + j];
            (at, &values[place.values.clone()])
        })
    })
}
