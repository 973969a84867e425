//! How the stiffness of an equilibrium changes along the path of its loads, in its own geometry.
//!
//! ```text
//! K u' = −∂r/∂t,   σ' = C ∇ε·(P u'),   μ'                     the linear response to the loads of the path
//! K_1 = Pᵀ (Σ w σ'·∇²ε + Σ μ'_i D²g_i + dK_o/dt) P + Σ_I ŵ'_I d̂_I          K_o: of springs, loads, weight
//! ```
//! The strains of the elements change their stresses, not their shape: the classical stiffness of
//! stresses. What is no strain of a beam is differentiated along the path.
#![allow(non_snake_case)] // K

use super::EquilibriumEquations;
use nalgebra::{DMatrix, DVector};
use vi_constraints::Constraints;
use vi_core::linear::norm_inf;
use vi_core::newton::Fault;
use vi_core::sparse::{Block, Entries, SparseMatrix};
use vi_core::{Configuration, MechanicalSystem};

impl EquilibriumEquations {
    /// `K_1` in the velocities of all frames and point masses, per unit of the load parameter, at
    /// the last equilibrium with these multipliers.
    ///
    /// # Errors
    /// [`Fault`] where the stiffness is singular.
    pub(crate) fn path_stiffness(&mut self, mu: &[f64]) -> Result<SparseMatrix, Fault> {
        let d = self.unknowns();
        let mut x = vec![0.0; d + mu.len()];
        x[d..].copy_from_slice(mu);
        let mut rates = vec![0.0; x.len()];
        self.evaluate(&x, &mut rates)?;
        self.fill_tangent(&x);
        self.parameter_slope(&mut rates);
        self.solve(&mut rates)?;
        rates.iter_mut().for_each(|rate| *rate = -*rate); // (u', μ')
        let mut dq = vec![0.0; self.s.dim()];
        self.layout.velocity(&self.right, &rates[..d], &mut dq);
        let sigma = self.stress_rates(&dq);
        let mut multipliers = vec![0.0; self.mechanism.len()];
        self.rows.scatter(&rates[d..], &mut multipliers);

        let length = 1e-5 * self.size() / norm_inf(&dq).max(f64::MIN_POSITIVE);
        let step = (1e-4 * self.t.abs().max(1.0)).min(length);
        let moved = |sign: f64| -> Vec<f64> {
            self.s.q1.iter().zip(&dq).map(|(q, dq)| q + sign * step * dq).collect()
        };
        let (after, before) = (moved(1.0), moved(-1.0));
        let at = |sign: f64, q| Configuration { t: self.t + sign * step, q, ..self.here() };
        let ends =
            [(at(1.0, after.as_slice()), 0.5 / step), (at(-1.0, before.as_slice()), -0.5 / step)];

        let mut force = vec![0.0; dq.len()]; // w'
        let mut own = vec![0.0; dq.len()];
        for (at, scale) in ends {
            self.system.net_force_beside_strains(at.moving(&self.v), &mut own);
            force.iter_mut().zip(&own).for_each(|(sum, f)| *sum += scale * f);
        }
        self.add_stress_force(&sigma, &mut force);
        let mut reactions = super::Transposed { mu: &multipliers, out: &mut force };
        self.mechanism.jacobian(self.t, &self.s.q1, &mut reactions);
        let mut spin = self.spin.clone();
        self.spin_of(&force, &mut spin);
        spin.iter_mut().for_each(|spin| *spin = 0.5 * (*spin + spin.transpose()));

        let emit = |out: &mut dyn Entries| {
            let mut rest = sigma.as_slice();
            for energy in self.system.strain_energies() {
                let (own, others) = rest.split_at(energy.stress_count());
                energy.add_geometric_stiffness(&self.s.q1, own, 1.0, out);
                rest = others;
            }
            self.mechanism.weighted_hessian(self.t, &self.s.q1, &multipliers, 1.0, out);
            for (at, scale) in ends {
                let mut part = Block { into: out, row: 0, column: 0, scale, transposed: false };
                self.system.stiffness_beside_strains(at.moving(&self.v), &mut part);
            }
        };
        Ok(self.frame_matrix(&emit, &spin))
    }

    /// `P_inᵀ M v` at the point last evaluated.
    pub(crate) fn mass_times(&self, v: &[f64]) -> DVector<f64> {
        let mut momentum = vec![0.0; v.len()];
        self.system.mass().mul_add(1.0, v, &mut momentum);
        let mut out = DVector::zeros(self.unknowns());
        self.layout.pull_back(&self.left, &momentum, out.as_mut_slice());
        out
    }

    /// Columns `v = P_in x` of all coordinates at the point last evaluated, shape `n × k`.
    pub(crate) fn velocities(&self, x: &DMatrix<f64>) -> DMatrix<f64> {
        let mut out = DMatrix::zeros(self.s.dim(), x.ncols());
        let mut v = vec![0.0; self.s.dim()];
        for (k, x) in x.column_iter().enumerate() {
            self.layout.velocity(&self.left, x.clone_owned().as_slice(), &mut v);
            out.column_mut(k).copy_from_slice(&v);
        }
        out
    }
}
