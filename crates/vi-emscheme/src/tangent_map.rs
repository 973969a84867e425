//! The exact tangent of an energy–momentum step, to show what becomes of the symplectic form.
//!
//! ```text
//! 2 M (q' − q − h v) + h² D̄V(q, q') + G(q_{1/2})ᵀ μ = 0,    g(q') = 0,    v' = (2/h)(q' − q) − v
//!
//! [ 2M + h² D̄V_{,q'} + ½ Σ μ_i D²g_i    G(q_{1/2})ᵀ ] [δq']   [ (2M − h² D̄V_{,q} − ½ Σ μ_i D²g_i) δq + 2h M δv ]
//! [ G(q')                               0           ] [δμ ] = [ 0                                            ]
//! δv' = (2/h)(δq' − δq) − δv
//! ```
//! `D̄V` is symmetric in its arguments, so its derivative by `q` is that by `q'` with the ends
//! exchanged. The vectors are handed on as `(δq, M δv)`.

use crate::em_system::EmSystem;
use nalgebra::DMatrix;
use vi_constraints::Constraints;
use vi_constraints::saddle_point::{IndependentRows, SaddlePoint};
use vi_constraints::tangent_map::{TangentError, Tangents};
use vi_core::MechanicalSystem;
use vi_core::interval::Interval;
use vi_core::sparse::{Entries, SparseMatrix};

/// Carries tangent vectors along the steps of a motion.
#[derive(Debug)]
pub struct EmTangentMap {
    step: SaddlePoint,
    dv: DMatrix<f64>, // n × k
    x: Vec<f64>,      // n + r
}

impl EmTangentMap {
    /// Begins at a node with its canonical vectors ([`Tangents::canonical`]): their `δp` are taken
    /// as `δv`, and `M δv` stands in their place.
    #[must_use]
    pub fn begin(system: &EmSystem, rows: &IndependentRows, tangents: &mut Tangents) -> Self {
        let n = tangents.dq.nrows();
        let dv = tangents.dp.clone();
        tangents.dp.fill(0.0);
        system.mass().mul_dense_add(1.0, &dv, &mut tangents.dp);
        let x = vec![0.0; n + rows.len()];
        Self { step: SaddlePoint::new(n, rows.clone()), dv, x }
    }

    /// Replaces vectors at `q_n` by their images at `q_{n+1}`; `mu`: `h²λ` of the step. Only the
    /// first columns of `tangents` may have been kept.
    ///
    /// # Errors
    /// [`TangentError`].
    pub fn push(
        &mut self,
        system: &EmSystem,
        constraints: &impl Constraints,
        s: &Interval,
        mu: &[f64],
        tangents: &mut Tangents,
    ) -> Result<(), TangentError> {
        if system.has_loads() {
            return Err(TangentError::Forced);
        }
        if self.step.is_worn() {
            self.step.choose(constraints, s.t, &s.q0);
        }
        let n = s.dim();
        let by = |s: &Interval| {
            SparseMatrix::assemble(n, n, |out| {
                system.scaled_bracket_derivative(s, out);
                constraints.weighted_hessian(s.t_mid(), &s.q_mid, mu, 0.5, out);
            })
        };
        let (end, start) = (by(s), by(&s.exchanged()));
        let emit = |out: &mut dyn Entries| end.emit(out);
        for k in 0..tangents.dq.ncols() {
            let dq: Vec<f64> = tangents.dq.column(k).iter().copied().collect();
            let dv: Vec<f64> = self.dv.column(k).iter().copied().collect();
            self.x.fill(0.0);
            start.mul_add(-1.0, &dq, &mut self.x[..n]);
            system.mass().mul_add(4.0, &dq, &mut self.x[..n]);
            system.mass().mul_add(2.0 * s.h, &dv, &mut self.x[..n]);
            self.step.solve(constraints, &emit, s.mid(), 1.0, s.end(), &mut self.x)?;
            for i in 0..n {
                self.dv[(i, k)] = 2.0 / s.h * (self.x[i] - dq[i]) - dv[i];
            }
            tangents.dq.column_mut(k).copy_from_slice(&self.x[..n]);
            let dv: Vec<f64> = self.dv.column(k).iter().copied().collect();
            let dp = &mut tangents.dp.as_mut_slice()[k * n..(k + 1) * n];
            dp.fill(0.0);
            system.mass().mul_add(1.0, &dv, dp);
        }
        Ok(())
    }
}
