//! The exact tangent of a Galerkin step.
//!
//! The step [2.27] differentiated, for `δq_0` with `G(q_n) δq_0 = 0`:
//! ```text
//! δW_i = Σ_j [K_ij M − h² Σ_k b_k E_ki E_kj ∇²V(Q_k)] δq_j                                            [2.31]
//! h δ_i0 δp̄ + δW_i − Σ_c μ_ic D²g_c(q_i) δq_i − G(q_i)ᵀ δμ_i = 0,   i = 0 … s−1
//! G(q_j) δq_j = 0,   j = 1 … s,                                      δp̄' = δW_s/h
//! ```
//! Whichever form finds the step, the control points satisfy these equations; `μ_i` follows from
//! `h w_i = G(q_i)ᵀ μ_i`. The symplectic form is that of [`crate::tangent_map`].
#![allow(non_snake_case)] // K, E, W

use crate::constraints::Constraints;
use crate::discretization::Step;
use crate::galerkin::control_points::ControlPoints;
use crate::saddle_point::{IndependentRows, JacobianPlace, SaddlePoint};
use crate::scheme::SubStep;
use crate::tangent_map::{TangentError, Tangents};
use nalgebra::{DMatrix, DVector};
use vi_core::Configuration;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::galerkin::Stages;
use vi_core::linear::{Singular, SparseLu};
use vi_core::sparse::{Block, Entries, SparseMatrix};
use vi_core::state::State;

/// Carries tangent vectors along the steps of a Galerkin scheme.
#[derive(Debug)]
pub struct GalerkinTangent {
    points: ControlPoints,
    increments: DMatrix<f64>, // s × s  of the control points from h V_k
    multiplier: SaddlePoint,  // [I Gᵀ; G 0]
    rows: IndependentRows,
    state: State,      // p̄_n and angles of the motion
    mu: Vec<Vec<f64>>, // s × m  μ_i
}

impl GalerkinTangent {
    /// For a motion from `state`, with an independent set of `m` constraints.
    ///
    /// # Errors
    /// [`Singular`] never, for the constants of a scheme.
    pub fn new(
        m: usize,
        rows: &IndependentRows,
        stages: Stages,
        state: &State,
    ) -> Result<Self, Singular> {
        let (n, s) = (state.q.len(), stages.count());
        let points = ControlPoints::new(n, stages);
        let rates = points.constants().D.columns(1, s).into_owned();
        Ok(Self {
            increments: rates.try_inverse().ok_or(Singular)?,
            points,
            multiplier: SaddlePoint::new(n, rows.clone()),
            rows: rows.clone(),
            state: state.clone(),
            mu: vec![vec![0.0; m]; s],
        })
    }

    /// Replaces vectors at `q_n` by their images at `q_{n+1}`; called for one step after the other.
    ///
    /// # Errors
    /// [`TangentError`].
    pub fn push(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        step: Step<'_>,
        tangents: &mut Tangents,
    ) -> Result<(), TangentError> {
        self.place(system, step)?;
        self.find_multipliers(system, constraints)?;
        let (n, s, r) = (system.dim(), self.points.stages(), self.rows.len());
        let size = s * (n + r);
        let matrix = SparseMatrix::assemble(size, size, |out| {
            for i in 0..s {
                let mut block = |column: usize, emit: &dyn Fn(&mut dyn Entries)| {
                    let (row, column) = (i * n, column * n);
                    emit(&mut Block { into: out, row, column, scale: 1.0, transposed: false });
                };
                for j in 0..s {
                    block(j, &|out| self.derivative(system, i, j + 1, out));
                }
                if i > 0 {
                    block(i - 1, &|out| self.curvature(constraints, i, out));
                }
            }
            for i in 0..s {
                let multiplier = s * n + i * r;
                let place =
                    JacobianPlace { row: i * n, column: multiplier, scale: -1.0, transposed: true };
                self.rows.emit_jacobian(constraints, self.at(i), place, out);
                let place =
                    JacobianPlace { row: multiplier, column: i * n, scale: 1.0, transposed: false };
                self.rows.emit_jacobian(constraints, self.at(i + 1), place, out);
            }
        });
        let mut right = DMatrix::zeros(size, tangents.dq.ncols());
        for i in 0..s {
            let block = SparseMatrix::assemble(n, n, |out| {
                self.derivative(system, i, 0, out);
                if i == 0 {
                    self.curvature(constraints, 0, out);
                }
            });
            for (mut right, dq) in right.column_iter_mut().zip(tangents.dq.column_iter()) {
                let (dq, mut own) = (dq.into_owned(), vec![0.0; n]);
                block.mul_add(-1.0, dq.as_slice(), &mut own);
                right.rows_mut(i * n, n).copy_from_slice(&own);
            }
        }
        let h = self.points.h();
        right.rows_mut(0, n).zip_apply(&tangents.dp, |x, dp| *x -= h * dp);
        SparseLu::new(&matrix)?.solve(&matrix, right.as_mut_slice())?;

        let last: Vec<SparseMatrix> = (0..=s)
            .map(|j| SparseMatrix::assemble(n, n, |out| self.derivative(system, s, j, out)))
            .collect();
        for k in 0..tangents.dq.ncols() {
            let mut dp = vec![0.0; n];
            last[0].mul_add(1.0 / h, tangents.dq.column(k).into_owned().as_slice(), &mut dp);
            for (j, block) in last.iter().enumerate().skip(1) {
                let dq = right.view(((j - 1) * n, k), (n, 1)).into_owned();
                block.mul_add(1.0 / h, dq.as_slice(), &mut dp);
            }
            tangents.dp.column_mut(k).copy_from_slice(&dp);
            tangents.dq.column_mut(k).copy_from(&right.view(((s - 1) * n, k), (n, 1)));
        }
        self.points.balance(system, s, &mut self.state.p);
        Ok(())
    }

    /// `(t, q)` of control point `i`.
    fn at(&self, i: usize) -> Configuration<'_> {
        Configuration::new(self.points.time(i), self.points.q(i))
    }

    /// Puts the control points where the step had them.
    fn place(
        &mut self,
        system: &impl DiscreteLagrangian,
        step: Step<'_>,
    ) -> Result<(), TangentError> {
        let (n, s, h) = (system.dim(), step.gauss.len(), step.s.h);
        self.state.t = step.s.t;
        self.state.q.copy_from_slice(&step.s.q0);
        self.state.angles.clone_from(&step.s.angles);
        self.state.compensation.q.fill(0.0);
        self.points
            .open(SubStep { t_end: step.s.t_end(), ..SubStep::single(step.s.t, h) }, &self.state);
        for j in 0..s {
            let point = self.points.point_mut(j + 1);
            for i in 0..n {
                let parts = step.gauss.iter().enumerate();
                let dq = parts.map(|(k, node)| self.increments[(j, k)] * h * node.v[i]).sum();
                point.increment(i, dq);
            }
            point.close();
        }
        let mut force = vec![0.0; n];
        for node in step.gauss {
            system.add_force(Configuration::new(node.t, &node.q), &node.v, &mut force);
        }
        if force.iter().any(|f| *f != 0.0) {
            return Err(TangentError::Forced);
        }
        self.points.evaluate(system);
        Ok(())
    }

    /// `μ_i` from `h w_i = G(q_i)ᵀ μ_i`.
    fn find_multipliers(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
    ) -> Result<(), TangentError> {
        let (n, h) = (system.dim(), self.points.h());
        let (mut impulse, zero) = (vec![0.0; n], vec![0.0; constraints.len()]);
        let mut x = vec![0.0; n + self.rows.len()];
        let identity = |out: &mut dyn Entries| (0..n).for_each(|i| out.add(i, i, 1.0));
        for (i, mu) in self.mu.iter_mut().enumerate() {
            self.points.balance(system, i, &mut impulse);
            let scaled: DVector<f64> = DVector::from_column_slice(&impulse) * h;
            let at = Configuration::new(self.points.time(i), self.points.q(i));
            let impulse = scaled.as_slice();
            self.multiplier.solve_at(constraints, &identity, at, impulse, &zero, &mut x)?;
            self.multiplier.rows().scatter(&x[n..], mu);
        }
        Ok(())
    }

    /// Emits `∂W_i/∂q_j` [2.31].
    fn derivative(
        &self,
        system: &impl DiscreteLagrangian,
        i: usize,
        j: usize,
        out: &mut dyn Entries,
    ) {
        let (constants, h) = (self.points.constants(), self.points.h());
        let scale = constants.K[(i, j)];
        system.mass().emit(&mut Block { into: out, row: 0, column: 0, scale, transposed: false });
        if let Some(strains) = system.interpolation() {
            strains.add_derivative(&self.points.polynomial(), (i, j), h, out);
        }
        for (k, node) in self.points.gauss().iter().enumerate() {
            let weight = node.weight * constants.E[(k, i)] * constants.E[(k, j)];
            system.gauss_hessian(node.place(self.points.step()), -h * h * weight, out);
        }
    }

    /// Emits `−Σ_c μ_ic D²g_c(q_i)`.
    fn curvature(&self, constraints: &impl Constraints, i: usize, out: &mut dyn Entries) {
        let Configuration { t, q, .. } = self.at(i);
        constraints.weighted_hessian(t, q, &self.mu[i], -1.0, out);
    }
}
