//! The exact tangent of a step, and the symplectic form on its tangent vectors.
//!
//! A step `(q, p̄) ↦ (q', p̄')` solves `p̄ + D_1 L_d(q, q') − h G(q)ᵀλ = 0`, `g(q') = 0` and has
//! `p̄' = D_2 L_d(q, q')`, whichever of the four schemes takes it. Differentiated:
//! ```text
//! [ D_2D_1 L_d   −h G(q)ᵀ ] [δq']     [ −δp̄ − (D_1D_1 L_d − h Σ λ_i D²g_i(q)) δq ]
//! [ G(q')         0       ] [δλ ]  =  [  0                                        ]
//! δp̄' = D_1D_2 L_d δq + D_2D_2 L_d δq'
//! ```
//! for `δq` with `G(q) δq = 0` ([`super::linearization`]). The symplectic form of `T*C` is
//! ```text
//! Ω(a, b) = δq_aᵀ δp_b − δp_aᵀ δq_b
//! ```
//! `p̄` counts modulo `range Gᵀ` only: `p̄ + G(q)ᵀμ(q, p̄)` gives the same `Ω` on such vectors,
//! because `G δq = 0` and `D²g_i` is symmetric. `DΦᵀ Ω DΦ = Ω` says that `Ω` of any two vectors
//! stays what it is. On the basis `(P e_i, 0)`, `(0, P e_i)` with `PᵀP = I` the matrix of `Ω` is
//! the canonical one.
//!
//! Discrete forces are left out of the tangent: with forces no form is preserved.
#![allow(non_snake_case)] // P

use crate::constraints::Constraints;
use crate::null_space::null_space_at;
use crate::saddle_point::IndependentRows;
use crate::scheme::linearization::{StepLinearization, Tangent};
use nalgebra::DMatrix;
use vi_core::Configuration;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;
use vi_core::linear::{Singular, norm_inf};

/// Tangent vectors `(δq, δp̄)` at a node, one in each column.
#[derive(Clone, Debug, PartialEq)]
pub struct Tangents {
    /// `δq`, shape `n × k`.
    pub dq: DMatrix<f64>,
    /// `δp̄`, shape `n × k`.
    pub dp: DMatrix<f64>,
}

impl Tangents {
    /// A canonical basis at `at`: `(P e_i, 0)` for all `i`, then `(0, P e_i)`, with `PᵀP = I`.
    #[must_use]
    pub fn canonical(
        constraints: &impl Constraints,
        rows: &IndependentRows,
        at: Configuration<'_>,
    ) -> Self {
        let P = null_space_at(constraints, at, rows.len());
        let (n, d) = P.shape();
        let (mut dq, mut dp) = (DMatrix::zeros(n, 2 * d), DMatrix::zeros(n, 2 * d));
        dq.columns_mut(0, d).copy_from(&P);
        dp.columns_mut(d, d).copy_from(&P);
        Self { dq, dp }
    }

    /// `Ω` of all pairs, shape `k × k`.
    #[must_use]
    pub fn form(&self) -> DMatrix<f64> {
        self.dq.tr_mul(&self.dp) - self.dp.tr_mul(&self.dq)
    }

    /// Largest change of `Ω` against `before`, each pair relative to the size of its terms.
    #[must_use]
    pub fn defect(&self, before: &DMatrix<f64>) -> f64 {
        let (q, p) = (self.dq.abs(), self.dp.abs());
        let size = q.tr_mul(&p) + p.tr_mul(&q);
        let change = self.form() - before;
        let relative = |(c, s): (&f64, &f64)| if *s > 0.0 { c.abs() / s } else { c.abs() };
        norm_inf(&change.iter().zip(size.iter()).map(relative).collect::<Vec<f64>>())
    }
}

/// Why a step has no tangent here.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TangentError {
    /// A discrete force acts.
    #[error("a force without a potential acts: no symplectic form is preserved")]
    Forced,
    /// The linearized step is singular.
    #[error(transparent)]
    Singular(#[from] Singular),
}

/// Carries tangent vectors along the steps of a motion.
#[derive(Debug)]
pub struct TangentMap {
    step: StepLinearization,
    column: Tangent,
    p: Vec<f64>, // n  p̄
}

impl TangentMap {
    /// For motions from the momentum `p̄`, with an independent set of `m` constraints.
    #[must_use]
    pub fn new(m: usize, rows: &IndependentRows, p: &[f64]) -> Self {
        let n = p.len();
        let step = StepLinearization::new(n, m, rows);
        Self { step, column: Tangent::zero(n, 0), p: p.to_vec() }
    }

    /// Replaces vectors at `q_n` by their images at `q_{n+1}`; called for one step after the other.
    ///
    /// # Errors
    /// [`TangentError`].
    pub fn push(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        s: &Interval,
        tangents: &mut Tangents,
    ) -> Result<(), TangentError> {
        if forced(system, s) {
            return Err(TangentError::Forced);
        }
        let Self { step, column, p } = self;
        step.linearize(system, constraints, s, p)?;
        for k in 0..tangents.dq.ncols() {
            column.q.copy_from_slice(tangents.dq.column(k).as_slice());
            column.p.copy_from_slice(tangents.dp.column(k).as_slice());
            step.push_free(system, constraints, s, column)?;
            tangents.dq.column_mut(k).copy_from_slice(&column.q);
            tangents.dp.column_mut(k).copy_from_slice(&column.p);
        }
        system.d2(s, p);
        Ok(())
    }
}

fn forced(system: &impl DiscreteLagrangian, s: &Interval) -> bool {
    let mut force = vec![0.0; s.dim()];
    system.add_force_minus(s, &mut force);
    system.add_force_plus(s, &mut force);
    force.iter().any(|f| *f != 0.0)
}
