//! `P_exᵀ [P_inᵀ K P_in'] P'_ex` as a sparse matrix with a fixed pattern.
#![allow(non_snake_case)] // K, B, J

use super::layout::{Columns, VelocityLayout};
use crate::solver::member_blocks::{MemberBlocks, Span, inverse_root};
use nalgebra::{DMatrix, Matrix6};
use vi_core::linear::{Singular, SparseLu};
use vi_core::sparse::{Entries, SparseMatrix};

crate::opaque_debug!(ReducedMatrix);

/// `P_exᵀ [P_inᵀ K P_in'] P'_ex` as a sparse matrix with its factorization.
#[derive(Default)]
pub struct ReducedMatrix {
    blocks: MemberBlocks,        // of K
    places: Vec<(usize, usize)>, // (row, column) of each product
    products: Vec<f64>,          // J_iᵀ B_ij J'_j of all couplings
    diagonal: Vec<f64>,          // d
    scale: Vec<f64>,             // d  powers of two
    factors: Option<(SparseMatrix, SparseLu)>,
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
        if self.blocks.is_empty() {
            self.analyse(layout, emit);
        }
        self.blocks.fill(emit);
        self.diagonal.fill(0.0);
        let mut next = 0;
        for coupling in self.blocks.couplings() {
            let (a, b) = (&layout.members[coupling.row], &layout.members[coupling.column]);
            let mut B = self.blocks.reduced(coupling, (&a.span, &b.span), (&left.q, &right.q));
            if coupling.row == coupling.column && a.span.size == 12 && !spin.is_empty() {
                B += spin[a.span.first / 12];
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
        let spans: Vec<Span> = layout.members.iter().map(|member| member.span).collect();
        self.blocks.analyse(layout.dim(), &spans, emit);
        let d = layout.dof();
        for coupling in self.blocks.couplings() {
            let (a, b) = (&layout.members[coupling.row], &layout.members[coupling.column]);
            for j in b.columns.clone() {
                for i in a.columns.clone() {
                    self.places.push((layout.unknowns[i], layout.unknowns[j]));
                }
            }
        }
        self.products = vec![0.0; self.places.len()];
        (self.diagonal, self.scale) = (vec![0.0; d], vec![1.0; d]);
    }

    /// `x ← A⁻¹ x` for the matrix last filled; several right-hand sides may follow one another in `x`.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn solve(&mut self, x: &mut [f64]) -> Result<(), Singular> {
        for (scale, diagonal) in self.scale.iter_mut().zip(&self.diagonal) {
            *scale = inverse_root(*diagonal);
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
