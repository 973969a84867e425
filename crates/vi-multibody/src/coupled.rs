//! The reduced Newton matrix of a tree whose potential couples bodies, by dense matrices.
#![allow(non_snake_case)] // A, P

use crate::map::TreeMap;
use crate::mechanism::Mechanism;
use nalgebra::DMatrix;
use vi_constraints::Reparametrization;
use vi_core::discrete_lagrangian::MechanicalSystem;
use vi_core::interval::Interval;
use vi_core::linear::DenseLu;
use vi_core::sparse::SparseMatrix;

/// `A⁻¹` when the potential couples bodies: dense, `O(n d² + d³)`.
pub(crate) struct Coupled {
    pub(crate) map: TreeMap,
    pub(crate) P: DMatrix<f64>,        // n × d_tree  P_tree(q_n)
    pub(crate) tangent: DMatrix<f64>,  // n × d_tree  ∂F_d/∂u
    pub(crate) weighted: DMatrix<f64>, // n × d_tree
    pub(crate) A: DMatrix<f64>,        // d_tree × d_tree
    pub(crate) mixed: SparseMatrix,    // n × n
    pub(crate) lu: DenseLu,
}

impl Coupled {
    pub(crate) fn new(mechanism: &Mechanism, system: &impl MechanicalSystem, s: &Interval) -> Self {
        let (n, d) = (system.dim(), mechanism.tree().dof());
        let nd = || DMatrix::zeros(n, d);
        Self {
            map: TreeMap::new(mechanism),
            P: nd(),
            tangent: nd(),
            weighted: nd(),
            A: DMatrix::zeros(d, d),
            mixed: SparseMatrix::assemble(n, n, |out| system.forced_d2_d1(s, out)),
            lu: DenseLu::new(d),
        }
    }

    pub(crate) fn begin(&mut self, q: &[f64], kept: bool) {
        if kept {
            self.P.copy_from(&self.tangent);
        } else {
            self.map.null_space(q, &mut self.P);
        }
    }

    pub(crate) fn factorize(&mut self, system: &impl MechanicalSystem, u: &[f64], s: &Interval) {
        self.mixed.refill(|out| system.forced_d2_d1(s, out));
        self.map.tangent(u, s, &mut self.tangent);
        self.weighted.fill(0.0);
        self.mixed.mul_dense_add(1.0, &self.tangent, &mut self.weighted);
        self.A.gemm_tr(1.0, &self.P, &self.weighted, 0.0);
        self.lu.factorize(&self.A);
    }
}
