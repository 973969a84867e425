//! The exact tangent of a step, and the symplectic form on its tangent vectors.
//!
//! A step `(q, p̄) ↦ (q', p̄')` solves `p̄ + D_1 L_d(q, q') − h G(q)ᵀλ = 0`, `g(q') = 0` and has
//! `p̄' = D_2 L_d(q, q')`, whichever of the four schemes takes it. Differentiated:
//! ```text
//! [ D_2D_1 L_d   −h G(q)ᵀ ] [δq']     [ −δp̄ − (D_1D_1 L_d − h Σ λ_i D²g_i(q)) δq ]
//! [ G(q')         0       ] [δλ ]  =  [  0                                        ]
//! δp̄' = D_1D_2 L_d δq + D_2D_2 L_d δq'
//! ```
//! for `δq` with `G(q) δq = 0`. The symplectic form of `T*C` is
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
use crate::saddle_point::{IndependentRows, SaddlePoint};
use nalgebra::DMatrix;
use vi_core::Configuration;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;
use vi_core::linear::{Singular, norm_inf};
use vi_core::sparse::{Block, Entries, SparseMatrix};

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
    step: SaddlePoint,       // [h D_2D_1 L_d, −Gᵀ; G', 0]
    multiplier: SaddlePoint, // [I Gᵀ; G 0]
    lambda: Vec<f64>,        // m  h λ over all constraints
    x: Vec<f64>,             // n + r
    p: Vec<f64>,             // n  p̄
}

impl TangentMap {
    /// For motions from the momentum `p̄`, with an independent set of `m` constraints.
    #[must_use]
    pub fn new(m: usize, rows: &IndependentRows, p: &[f64]) -> Self {
        let n = p.len();
        Self {
            step: SaddlePoint::new(n, rows.clone()),
            multiplier: SaddlePoint::new(n, rows.clone()),
            lambda: vec![0.0; m],
            x: vec![0.0; n + rows.len()],
            p: p.to_vec(),
        }
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
        let n = s.dim();
        if forced(system, s) {
            return Err(TangentError::Forced);
        }
        if self.step.is_worn() {
            self.step.choose(constraints, s.t, &s.q0);
        }
        self.find_multiplier(system, constraints, s)?;
        let square =
            |emit: &dyn Fn(&mut dyn Entries)| SparseMatrix::assemble(n, n, |out| emit(out));
        let mixed = square(&|out| system.d2_d1(s, out));
        let second = square(&|out| system.d2_d2(s, out));
        let first = square(&|out| {
            system.d1_d1(s, out);
            constraints.weighted_hessian(s.t, &s.q0, &self.lambda, -1.0, out);
        });
        let emit = |out: &mut dyn Entries| {
            let (row, column, transposed) = (0, 0, false);
            mixed.emit(&mut Block { into: out, row, column, scale: s.h, transposed });
        };
        for k in 0..tangents.dq.ncols() {
            let dq: Vec<f64> = tangents.dq.column(k).iter().copied().collect();
            self.x.fill(0.0);
            first.mul_add(-s.h, &dq, &mut self.x[..n]);
            for (x, dp) in self.x.iter_mut().zip(tangents.dp.column(k).iter()) {
                *x -= s.h * dp;
            }
            self.step.solve(constraints, &emit, s.start(), -1.0, s.end(), &mut self.x)?;
            let dp = &mut tangents.dp.as_mut_slice()[k * n..(k + 1) * n];
            dp.fill(0.0);
            mixed.tr_mul_add(1.0, &dq, dp);
            second.mul_add(1.0, &self.x[..n], dp);
            tangents.dq.column_mut(k).copy_from_slice(&self.x[..n]);
        }
        system.d2(s, &mut self.p);
        Ok(())
    }

    /// `h λ` from `p̄ + D_1 L_d = h Gᵀλ`.
    fn find_multiplier(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        s: &Interval,
    ) -> Result<(), TangentError> {
        let n = s.dim();
        let (mut impulse, zero) = (vec![0.0; n], vec![0.0; constraints.len()]);
        system.d1(s, &mut impulse);
        impulse.iter_mut().zip(&self.p).for_each(|(x, p)| *x += p);
        let identity = |out: &mut dyn Entries| (0..n).for_each(|i| out.add(i, i, 1.0));
        let x = &mut self.x;
        self.multiplier.solve_at(constraints, &identity, s.start(), &impulse, &zero, x)?;
        self.multiplier.rows().scatter(&self.x[n..], &mut self.lambda);
        Ok(())
    }
}

fn forced(system: &impl DiscreteLagrangian, s: &Interval) -> bool {
    let mut force = vec![0.0; s.dim()];
    system.add_force_minus(s, &mut force);
    system.add_force_plus(s, &mut force);
    force.iter().any(|f| *f != 0.0)
}
