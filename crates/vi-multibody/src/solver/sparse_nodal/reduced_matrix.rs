//! `P_exᵀ [P_inᵀ K P_in'] P'_ex` as a sparse matrix with a fixed pattern.
#![allow(non_snake_case)] // K, B, J

use super::layout::{Columns, Member, VelocityLayout};
use nalgebra::{DMatrix, Matrix6, Vector6};
use std::collections::BTreeMap;
use vi_core::linear::{Singular, SparseLu};
use vi_core::sparse::{Entries, SparseMatrix};

crate::opaque_debug!(ReducedMatrix);

/// A dense block of `K`: rows of one member, columns of another.
#[derive(Clone, Copy, Debug)]
struct Coupling {
    row: usize,
    column: usize,
    values: usize, // where its values start, column by column
}

/// `P_exᵀ [P_inᵀ K P_in'] P'_ex` as a sparse matrix with its factorization.
#[derive(Default)]
pub struct ReducedMatrix {
    couplings: Vec<Coupling>,
    slots: Vec<usize>,           // k-th emitted entry → place in `values`
    values: Vec<f64>,            // dense blocks of K
    places: Vec<(usize, usize)>, // (row, column) of each product
    products: Vec<f64>,          // J_iᵀ B_ij J'_j of all couplings
    diagonal: Vec<f64>,          // d
    scale: Vec<f64>,             // d  powers of two
    factors: Option<(SparseMatrix, SparseLu)>,
}

/// Collects the places of the first emission.
struct Places(Vec<(usize, usize)>);

impl Entries for Places {
    fn add(&mut self, row: usize, column: usize, _value: f64) {
        self.0.push((row, column));
    }
}

struct Replay<'a> {
    values: &'a mut [f64],
    slots: std::slice::Iter<'a, usize>,
}

impl Entries for Replay<'_> {
    fn add(&mut self, _row: usize, _column: usize, value: f64) {
        let slot = self.slots.next().expect("as many entries as at the first emission");
        self.values[*slot] += value;
    }
}

impl ReducedMatrix {
    /// Fills the matrix from `K` as `emit` writes it (always the same places in the same order), with
    /// `P` and `P'` as `left` and `right`. `spin`: a 6×6 matrix for each frame that is added between
    /// its twists, or nothing.
    pub fn fill(
        &mut self,
        layout: &VelocityLayout,
        emit: &dyn Fn(&mut dyn Entries),
        (left, right): (&Columns, &Columns),
        spin: &[Matrix6<f64>],
    ) {
        if self.couplings.is_empty() {
            self.analyse(layout, emit);
        }
        self.values.fill(0.0);
        emit(&mut Replay { values: &mut self.values, slots: self.slots.iter() });
        self.diagonal.fill(0.0);
        let mut next = 0;
        for coupling in &self.couplings {
            let (a, b) = (&layout.members[coupling.row], &layout.members[coupling.column]);
            let mut B = block(a, b, &self.values[coupling.values..], (&left.q, &right.q));
            if coupling.row == coupling.column && a.size == 12 && !spin.is_empty() {
                B += spin[a.first / 12];
            }
            for j in b.columns.clone() {
                let y = B * right.twists[j];
                for i in a.columns.clone() {
                    let product = left.twists[i].dot(&y);
                    self.products[next] = product;
                    let (row, column) = self.places[next];
                    if row == column {
                        self.diagonal[row] += product;
                    }
                    next += 1;
                }
            }
        }
    }

    fn analyse(&mut self, layout: &VelocityLayout, emit: &dyn Fn(&mut dyn Entries)) {
        let (n, d) = (layout.dim(), layout.dof());
        let mut member_of = vec![usize::MAX; n];
        for (k, member) in layout.members.iter().enumerate() {
            member_of[member.first..member.first + member.size].fill(k);
        }
        let mut places = Places(Vec::new());
        emit(&mut places);
        let mut starts: BTreeMap<(usize, usize), usize> =
            (0..layout.members.len()).map(|k| ((k, k), 0)).collect();
        for &(row, column) in &places.0 {
            starts.insert((member_of[row], member_of[column]), 0);
        }
        let mut length = 0;
        for (&(row, column), values) in &mut starts {
            *values = length;
            self.couplings.push(Coupling { row, column, values: length });
            let (a, b) = (&layout.members[row], &layout.members[column]);
            length += a.size * b.size;
            for j in b.columns.clone() {
                for i in a.columns.clone() {
                    self.places.push((layout.unknowns[i], layout.unknowns[j]));
                }
            }
        }
        let slot = |&(row, column): &(usize, usize)| {
            let (a, b) = (member_of[row], member_of[column]);
            let (i, j) = (row - layout.members[a].first, column - layout.members[b].first);
            starts[&(a, b)] + i + j * layout.members[a].size
        };
        self.slots = places.0.iter().map(slot).collect();
        self.values = vec![0.0; length];
        self.products = vec![0.0; self.places.len()];
        (self.diagonal, self.scale) = (vec![0.0; d], vec![1.0; d]);
    }

    /// `x ← A⁻¹ x` for the matrix last filled; several right-hand sides may follow one another in `x`.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn solve(&mut self, x: &mut [f64]) -> Result<(), Singular> {
        for (scale, diagonal) in self.scale.iter_mut().zip(&self.diagonal) {
            let size = diagonal.abs();
            let usable = size.is_finite() && size > f64::MIN_POSITIVE;
            *scale = if usable { libm::exp2((-0.5 * libm::log2(size)).round()) } else { 1.0 };
        }
        let Self { places, products, scale, factors, .. } = self;
        let emit = |out: &mut dyn Entries| {
            for (&(i, j), product) in places.iter().zip(products.iter()) {
                out.add(i, j, scale[i] * product * scale[j]);
            }
        };
        match factors {
            Some((matrix, _)) => matrix.refill(emit),
            None => {
                let matrix = SparseMatrix::assemble(scale.len(), scale.len(), emit);
                let lu = SparseLu::new(&matrix)?;
                *factors = Some((matrix, lu));
            }
        }
        let (matrix, lu) = factors.as_mut().expect("just written");
        let weigh = |x: &mut [f64]| {
            let columns = x.chunks_exact_mut(scale.len());
            columns.for_each(|x| x.iter_mut().zip(scale.iter()).for_each(|(x, s)| *x *= s));
        };
        weigh(x);
        lu.solve(matrix, x)?;
        weigh(x);
        Ok(())
    }

    /// Emits the matrix last filled; always the same places in the same order.
    pub fn emit(&self, out: &mut dyn Entries) {
        for (&(i, j), product) in self.places.iter().zip(&self.products) {
            out.add(i, j, *product);
        }
    }

    /// The diagonal of the matrix last filled, shape `d`.
    #[must_use]
    pub fn diagonal(&self) -> &[f64] {
        &self.diagonal
    }

    /// Dense copy of the matrix last filled, unscaled; for studies and small problems.
    #[must_use]
    pub fn to_dense(&self) -> DMatrix<f64> {
        let d = self.scale.len();
        let mut dense = DMatrix::zeros(d, d);
        for (&place, product) in self.places.iter().zip(&self.products) {
            dense[place] += product;
        }
        dense
    }
}

/// `P_in(q)ᵀ K_ab P_in(q')`, 6×6 (fewer rows and columns count for particles).
fn block(a: &Member, b: &Member, K: &[f64], (q, q_right): (&[f64], &[f64])) -> Matrix6<f64> {
    let mut rows = [Vector6::zeros(); 12]; // K_ab P_in(q')
    for (i, row) in rows.iter_mut().enumerate().take(a.size) {
        *row = b.shrink(q_right, |j| K[i + j * a.size]);
    }
    let mut B = Matrix6::zeros();
    for j in 0..6 {
        B.set_column(j, &a.shrink(q, |i| rows[i][j]));
    }
    B
}
