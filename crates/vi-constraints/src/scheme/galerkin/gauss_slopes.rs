//! What acts in a Galerkin step, differentiated by its control points.
//!
//! ```text
//! Σ_k b_k E_ki (h² E_kj F_q + h D_kj F_v)(Q_k, V_k),   F = f − ∇V                       part of h H_ij  [2.49]
//! ```
//! Interpolated strains add what they are.
#![allow(non_snake_case)] // D, E, F, H

use super::control_points::ControlPoints;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::galerkin::{GaussPoint, Stages};
use vi_core::sparse::{Block, Entries, SparseMatrix};

/// `F_q`, `F_v` at the Gauss nodes, shape `n × n`.
#[derive(Debug)]
pub struct GaussSlopes(Vec<[Option<SparseMatrix>; 2]>);

impl GaussSlopes {
    /// At the nodes of a step.
    #[must_use]
    pub fn new(stages: Stages) -> Self {
        Self((0..stages.count()).map(|_| [None, None]).collect())
    }

    /// Finds them where the forces of the control points were evaluated.
    pub fn differentiate(&mut self, system: &impl DiscreteLagrangian, points: &ControlPoints) {
        self.differentiate_with(system, points, &mut |_, _, _| {});
    }

    /// The same with what acts beside the system, which emits its own
    /// [`DiscreteLagrangian::gauss_slopes`] at a node.
    pub fn differentiate_with(
        &mut self,
        system: &impl DiscreteLagrangian,
        points: &ControlPoints,
        beside: &mut dyn FnMut(&GaussPoint, [f64; 2], &mut dyn Entries),
    ) {
        let (n, s) = (system.dim(), points.step());
        for (node, slopes) in points.gauss().iter().zip(&mut self.0) {
            for (slopes, by) in slopes.iter_mut().zip([[1.0, 0.0], [0.0, 1.0]]) {
                let emit = |out: &mut dyn Entries| {
                    system.gauss_slopes(node.place(s).moving(&node.v), by, out);
                    beside(node, by, out);
                };
                SparseMatrix::update(slopes, (n, n), emit);
            }
        }
    }

    /// `out_j ← out_j + (h H_ij)ᵀ v`, `j = 0 … s`, without inertia, the curvature of constraints
    /// and interpolated strains.
    pub fn add_transposed(
        &self,
        points: &ControlPoints,
        i: usize,
        v: &[f64],
        out: &mut [Vec<f64>],
    ) {
        let (constants, h) = (points.constants(), points.h());
        let mut product = vec![0.0; v.len()];
        for (k, slopes) in self.0.iter().enumerate() {
            let weight = h * constants.gauss_weights[k] * constants.E[(k, i)];
            for (part, slopes) in slopes.iter().enumerate() {
                let Some(slopes) = slopes else { continue };
                product.fill(0.0);
                slopes.tr_mul_add(weight, v, &mut product);
                for (j, out) in out.iter_mut().enumerate() {
                    let by = [h * constants.E[(k, j)], constants.D[(k, j)]][part];
                    out.iter_mut().zip(&product).for_each(|(out, x)| *out += by * x);
                }
            }
        }
    }

    /// Emits `h H_ij` without inertia and the curvature of constraints; for each `(i, j)` always
    /// the same places in the same order.
    pub fn emit(
        &self,
        system: &impl DiscreteLagrangian,
        points: &ControlPoints,
        i: usize,
        j: usize,
        out: &mut dyn Entries,
    ) {
        let (constants, h) = (points.constants(), points.h());
        if let Some(strains) = system.interpolation() {
            strains.add_derivative(&points.polynomial(), (i, j), h, out);
        }
        for (k, slopes) in self.0.iter().enumerate() {
            let weight = h * constants.gauss_weights[k] * constants.E[(k, i)];
            for (slopes, by) in slopes.iter().zip([h * constants.E[(k, j)], constants.D[(k, j)]]) {
                if let Some(slopes) = slopes {
                    let (into, scale) = (&mut *out, weight * by);
                    let mut scaled = Block { into, row: 0, column: 0, scale, transposed: false };
                    slopes.emit(&mut scaled);
                }
            }
        }
    }
}
