//! The constrained form, `em-constrained`.
//!
//! ```text
//! h B(Δq) + Ḡᵀ μ = 0,    g(q_{n+1}) = 0,    μ = h²λ
//! [ h K + Σ_i μ_i ∂Ḡ_iᵀ/∂q_{n+1}    Ḡᵀ ]
//! [ G(q_{n+1})                       0  ]
//! ```
//! `Ḡ` ([`crate::constraint`]) moves with the unknown, which adds the Hessian term to the
//! variational scheme's matrix. The powers of `h` make the condition number independent of `h`; as
//! written it grows like `h⁻³`. Sparse LU with pivoting over an independent set of constraints.
//!
//! Redundant constraints: translations, rotations and `Δq` lie in `null Ḡ`, so a mechanism with at
//! most one internal freedom keeps its redundancy at `q_{n+1/2}`. With more, the rows left out may
//! become independent there by `O(h²)`; energy and constraints are kept all the same (`Ḡ Δq = 0` in
//! every row), but the motion then depends, at the order of the error, on which rows are chosen.
//!
//! Letters: [`crate::em_system`]. Source: Betsch & Leyendecker 2006; scaling as in LMO08 (22).

use crate::constraint::DiscreteConstraints;
use crate::em_system::{EmSystem, Velocity};
use crate::scheme::advance_state;
use std::ops::Range;
use vi_constraints::saddle_point::{IndependentRows, SaddlePoint};
use vi_constraints::scheme::{ConditionNumbers, Scheme, StepError, SubStep};
use vi_constraints::unknowns::{self, coordinates_and_multipliers};
use vi_core::MechanicalSystem;
use vi_core::interval::Interval;
use vi_core::newton::{Fault, Newton, UnknownBlock};
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::state::State;

/// The constrained form.
#[derive(Debug)]
pub struct EmConstrained {
    s: Interval,
    v: Velocity,
    scratch: Vec<f64>,              // n
    g: Vec<f64>,                    // m
    mu: Vec<f64>,                   // m  h²λ over all constraints
    jacobian: Option<SparseMatrix>, // m × n  Ḡ
    saddle: SaddlePoint,
    blocks: [UnknownBlock; 2],
}

impl EmConstrained {
    /// For `n` coordinates and an independent set of `m` constraints.
    #[must_use]
    pub fn new(n: usize, m: usize, rows: IndependentRows) -> Self {
        Self {
            s: Interval::new(n),
            v: Velocity::new(n),
            scratch: vec![0.0; n],
            g: vec![0.0; m],
            mu: vec![0.0; m],
            jacobian: None,
            blocks: coordinates_and_multipliers(n, rows.len()),
            saddle: SaddlePoint::new(n, rows),
        }
    }
}

impl<C: DiscreteConstraints> Scheme<EmSystem, C> for EmConstrained {
    fn blocks(&self) -> &[UnknownBlock] {
        &self.blocks
    }

    fn begin(&mut self, system: &EmSystem, _constraints: &C, step: SubStep, state: &mut State) {
        self.saddle.recall(&state.memory);
        step.open(&mut self.s, state);
        self.v.take(state);
        unknowns::scale(&mut self.blocks, &state.q, system.mass());
    }

    fn residual(
        &mut self,
        system: &EmSystem,
        constraints: &C,
        x: &[f64],
        r: &mut [f64],
    ) -> Result<(), Fault> {
        let n = self.s.dim();
        let (dq, mu) = x.split_at(n);
        let (balance, closure) = r.split_at_mut(n);
        self.s.dq.copy_from_slice(dq);
        self.s.close_from_increment();
        let s = &self.s;
        system.scaled_bracket(s, &self.v, &mut self.scratch, balance);
        let rows = self.saddle.rows();
        rows.scatter(mu, &mut self.mu);
        let emit = |out: &mut dyn Entries| constraints.discrete_jacobian(s, out);
        let jacobian = SparseMatrix::update(&mut self.jacobian, (constraints.len(), n), emit);
        jacobian.tr_mul_add(1.0, &self.mu, balance);
        constraints.value(s.end(), &mut self.g);
        rows.gather(&self.g, closure);
        Ok(())
    }

    fn correction(
        &mut self,
        system: &EmSystem,
        constraints: &C,
        _x: &[f64],
        dx: &mut [f64],
    ) -> Result<(), Fault> {
        let Self { s, saddle, mu, .. } = self;
        let emit = |out: &mut dyn Entries| {
            system.scaled_bracket_derivative(s, out);
            constraints.discrete_hessian(s, mu, out);
        };
        let upper = |out: &mut dyn Entries| constraints.discrete_jacobian(s, out);
        let lower = |out: &mut dyn Entries| constraints.jacobian(s.t_end(), &s.q1, out);
        Ok(saddle.solve_with(&emit, &upper, 1.0, &lower, dx)?)
    }

    /// `μ` of single steps; the two halves of a sub-step of a composition have their own histories.
    fn alternating(&self, sub_steps: usize) -> Range<usize> {
        if sub_steps == 1 { self.blocks[1].range.clone() } else { 0..0 }
    }

    fn renew(&mut self, constraints: &C, solved: bool) -> bool {
        self.saddle.renew(constraints, &self.s, solved)
    }

    fn end(
        &mut self,
        system: &EmSystem,
        _constraints: &C,
        newton: &Newton,
        state: &mut State,
    ) -> Result<(), StepError> {
        self.saddle.remember(&mut state.memory);
        let rounding = Some(&newton.rounding_error()[..self.s.dim()]);
        advance_state(state, system, &self.s, &self.mu, rounding, |_, _| {});
        Ok(())
    }

    fn equation_sizes(&mut self, constraints: &C, x: &[f64]) -> Option<Vec<f64>> {
        self.saddle.equation_sizes(constraints, &self.s.q1, x)
    }

    fn interval(&self) -> &Interval {
        &self.s
    }

    fn interval_mut(&mut self) -> &mut Interval {
        &mut self.s
    }

    fn condition(&mut self, _system: &EmSystem, _: &C, _x: &[f64]) -> Option<ConditionNumbers> {
        ConditionNumbers::of_saddle_point(&self.saddle, &self.s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::{loaded, pair};
    use vi_constraints::Constraints;
    use vi_multibody::PairKind;

    #[test]
    fn the_newton_matrix_against_central_differences() {
        let model = pair(PairKind::Cylindrical, true);
        let (system, constraints) = (loaded(&model), &model.mechanism);
        let (q, v) = (constraints.initial_configuration(), constraints.initial_velocity());
        let (n, m) = (constraints.dim(), constraints.len());
        let rows = IndependentRows::all(m);
        let mut scheme = EmConstrained::new(n, m, rows);
        let h = 0.05;
        scheme.s.open(0.0, h, &q);
        scheme.v.v.copy_from_slice(&v);
        let x: Vec<f64> = (0..n + m).map(|i| 0.03 * (2.3 * i as f64).sin()).collect();
        let mut at = |i: usize, by: f64| {
            let mut x = x.clone();
            x[i] += by;
            let mut r = vec![0.0; n + m];
            scheme.residual(&system, constraints, &x, &mut r).unwrap();
            r
        };
        let e = 1e-5;
        let slopes: Vec<Vec<f64>> = (0..n + m)
            .map(|j| {
                let (plus, minus) = (at(j, e), at(j, -e));
                plus.iter().zip(&minus).map(|(p, m)| (p - m) / (2.0 * e)).collect()
            })
            .collect();
        let mut r = at(0, 0.0);
        scheme.correction(&system, constraints, &x, &mut r).unwrap();
        let exact = scheme.saddle.matrix().unwrap().to_dense();
        let mut worst = 0.0_f64;
        for (j, column) in slopes.iter().enumerate() {
            for (i, slope) in column.iter().enumerate() {
                worst = worst.max((slope - exact[(i, j)]).abs());
            }
        }
        println!("Newton matrix off by {worst:.1e}, largest entry {:.1}", exact.amax());
        assert!(worst < 1e-8, "{worst:e}");
    }
}
