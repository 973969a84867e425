//! The constrained form, `em-constrained`.
//!
//! ```text
//! h B(Δq) + Ḡᵀ μ = 0,    g(q_{n+1}) = 0,    μ = h²λ
//! [ h K + Σ_i μ_i ∂Ḡ_iᵀ/∂q_{n+1}    Ḡᵀ ]
//! [ G(q_{n+1})                       0  ]
//! ```
//! `Ḡ` ([`crate::constraint`]) moves with the unknown, which adds the Hessian term to the variational scheme's
//! matrix. The powers of `h` make the condition number independent of `h`; as written it grows like
//! `h⁻³`. Sparse LU with pivoting over an independent set of constraints.
//!
//! Redundant constraints: translations, rotations and `Δq` lie in `null Ḡ`, so a mechanism with at most
//! one internal freedom keeps its redundancy at `q_{n+1/2}`. With more, the rows left out may become
//! independent there by `O(h²)`; energy and constraints are kept all the same (`Ḡ Δq = 0` in every row),
//! but the motion then depends, at the order of the error, on which rows are chosen.
//!
//! Letters: [`crate::em_system`]. Source: Betsch & Leyendecker 2006; scaling as in LMO08 (22).

use crate::constraint::DiscreteConstraints;
use crate::em_system::{EmSystem, Velocity};
use crate::scheme::{BEYOND_ROUNDING, EmForm, advance_state};
use vi_constraints::saddle_point::{IndependentRows, SaddlePoint};
use vi_constraints::scheme::{Condition, Scheme, StepError, SubStep, solve_step};
use vi_core::MechanicalSystem;
use vi_core::interval::Interval;
use vi_core::linear::{condition_number, norm_inf};
use vi_core::newton::{
    Block, BlockKind, Fault, Newton, NewtonProblem, NewtonReport, NewtonSettings,
};
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::state::State;

/// The constrained form.
pub struct EmConstrained {
    newton: Newton,
    sub_steps: usize,
    x: Vec<f64>, // n + r  (Δq, h²λ)
    work: Work,
}

struct Work {
    s: Interval,
    v: Velocity,
    scratch: Vec<f64>,              // n
    g: Vec<f64>,                    // m
    mu: Vec<f64>,                   // m  h²λ over all constraints
    jacobian: Option<SparseMatrix>, // m × n  Ḡ
    saddle: SaddlePoint,
    blocks: [Block; 2],
}

struct Problem<'a, C> {
    system: &'a EmSystem,
    constraints: &'a C,
    work: &'a mut Work,
}

impl EmConstrained {
    /// For `n` coordinates, an independent set of `m` constraints and a composition of `sub_steps` sub-steps.
    #[must_use]
    pub fn new(
        n: usize,
        (rows, m): (IndependentRows, usize),
        settings: NewtonSettings,
        sub_steps: usize,
    ) -> Self {
        let size = n + rows.len();
        let position = Block { kind: BlockKind::Position, range: 0..n, floor: 1.0 };
        let multiplier = Block { kind: BlockKind::Multiplier, range: n..size, floor: 1.0 };
        let work = Work {
            s: Interval::new(n),
            v: Velocity::new(n),
            scratch: vec![0.0; n],
            g: vec![0.0; m],
            mu: vec![0.0; m],
            jacobian: None,
            saddle: SaddlePoint::new(n, rows),
            blocks: [position, multiplier],
        };
        Self { newton: Newton::new(size, settings), sub_steps, x: vec![0.0; size], work }
    }
}

impl<C: DiscreteConstraints> NewtonProblem for Problem<'_, C> {
    fn blocks(&self) -> &[Block] {
        &self.work.blocks
    }

    fn residual(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        let work = &mut *self.work;
        let n = work.s.dim();
        let (dq, mu) = x.split_at(n);
        let (balance, closure) = r.split_at_mut(n);
        work.s.dq.copy_from_slice(dq);
        work.s.close_from_increment();
        self.system.scaled_bracket(&work.s, &work.v, &mut work.scratch, balance);
        let rows = work.saddle.rows();
        rows.scatter(mu, &mut work.mu);
        let (constraints, s) = (self.constraints, &work.s);
        let emit = |out: &mut dyn Entries| constraints.discrete_jacobian(s, out);
        let jacobian = SparseMatrix::update(&mut work.jacobian, (constraints.len(), n), emit);
        jacobian.tr_mul_add(1.0, &work.mu, balance);
        constraints.value(s.end(), &mut work.g);
        rows.gather(&work.g, closure);
        Ok(())
    }

    fn resolution(&self) -> f64 {
        BEYOND_ROUNDING
    }

    fn correction(&mut self, _x: &[f64], dx: &mut [f64]) -> Result<(), Fault> {
        let Work { s, saddle, mu, .. } = &mut *self.work;
        let emit = |out: &mut dyn Entries| {
            self.system.scaled_bracket_derivative(s, out);
            self.constraints.discrete_hessian(s, mu, out);
        };
        let upper = |out: &mut dyn Entries| self.constraints.discrete_jacobian(s, out);
        let lower = |out: &mut dyn Entries| self.constraints.jacobian(s.t_end(), &s.q1, out);
        Ok(saddle.solve_with(&emit, (&upper, 1.0, &lower), dx)?)
    }
}

impl<C: DiscreteConstraints> Scheme<EmSystem, C> for EmConstrained {
    fn name(&self) -> &'static str {
        EmForm::Constrained.name()
    }

    fn advance(
        &mut self,
        system: &EmSystem,
        constraints: &C,
        step: SubStep,
        state: &mut State,
    ) -> Result<NewtonReport, StepError> {
        let work = &mut self.work;
        // μ of single steps alternates; the two halves of a sub-step of a composition have their own histories
        let (n, size) = (state.q.len(), self.x.len());
        let alternating = if self.sub_steps == 1 { n..size } else { 0..0 };
        state.history.fit(size, self.sub_steps, alternating);
        work.saddle.recall(&state.memory);
        step.open(&mut work.s, state);
        work.v.take(state);
        let length = norm_inf(&state.q).max(1e-6);
        work.blocks[0].floor = 1e-5 * length;
        work.blocks[1].floor = 1e-5 * length * norm_inf(system.mass().as_sprs().data());
        let mut problem = Problem { system, constraints, work };
        let (newton, history) = (&mut self.newton, &mut state.history);
        let mut outcome = solve_step(newton, history, step, &mut problem, &mut self.x);
        let Work { s, saddle, .. } = &mut *problem.work;
        if saddle.renew(constraints, s, outcome.is_ok()) {
            history.clear(); // of other multipliers
            outcome = solve_step(newton, history, step, &mut problem, &mut self.x);
        }
        let report = outcome?;
        let Work { s, saddle, mu, .. } = &self.work;
        saddle.remember(&mut state.memory);
        let lost = Some(&self.newton.lost()[..n]);
        advance_state(state, system, (s, mu), lost, |_, _| {});
        Ok(report)
    }

    fn interval(&self) -> &Interval {
        &self.work.s
    }

    fn interval_mut(&mut self) -> &mut Interval {
        &mut self.work.s
    }

    fn condition(&mut self, _system: &EmSystem, _constraints: &C) -> Option<Condition> {
        let (n, h) = (self.work.s.dim(), self.work.s.h);
        let scaled = self.work.saddle.matrix()?.to_dense();
        let mut written = scaled.clone(); // columns of λ carry h², balance rows 1/h
        written.view_mut((0, n), (n, scaled.ncols() - n)).scale_mut(h * h);
        written.view_mut((0, 0), (n, scaled.ncols())).scale_mut(1.0 / h);
        let as_written = condition_number(&written);
        Some(Condition { as_written, scaled: condition_number(&scaled) })
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
        let mut scheme = EmConstrained::new(n, (rows, m), NewtonSettings::default(), 1);
        let h = 0.05;
        scheme.work.s.open(0.0, h, &q);
        scheme.work.v.v.copy_from_slice(&v);
        let mut problem = Problem { system: &system, constraints, work: &mut scheme.work };
        let x: Vec<f64> = (0..n + m).map(|i| 0.03 * (2.3 * i as f64).sin()).collect();
        let mut at = |i: usize, by: f64| {
            let mut x = x.clone();
            x[i] += by;
            let mut r = vec![0.0; n + m];
            problem.residual(&x, &mut r).unwrap();
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
        problem.correction(&x, &mut r).unwrap();
        let exact = scheme.work.saddle.matrix().unwrap().to_dense();
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
