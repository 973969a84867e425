//! The d'Alembert form, `em-dalembert`: multipliers eliminated by the discrete null space.
//!
//! ```text
//! P̄(q_n, q_{n+1})ᵀ (h B(Δq) + Ḡᵀμ) = 0,    g(q_{n+1}) = 0
//! [ P̄ᵀ (h K + Σ_i μ_i ∂Ḡ_iᵀ/∂q_{n+1}) ]
//! [ G(q_{n+1})                          ]
//! ```
//! Unknown `Δq ∈ R^n`. `μ` is not an unknown: it follows from the bracket, and drops
//! out where `Ḡ P̄ = 0`, which averaged formulas fulfil only once `g(q_{n+1}) = 0`. Dense, `O(n³)` a step: for small systems and comparisons.
//!
//! Letters and the derivative of `P̄`: [`crate::null_space`]. Source: Betsch & Leyendecker 2006.

use crate::balance::Balance;
use crate::constraint::DiscreteConstraints;
use crate::em_system::EmSystem;
use crate::null_space::DiscreteNullSpace;
use crate::scheme::{BEYOND_ROUNDING, EmForm, advance_state};
use crate::tree_multipliers::TreeMultipliers;
use nalgebra::DMatrix;
use vi_constraints::saddle_point::{IndependentRows, JacobianPlace};
use vi_constraints::scheme::{Condition, Scheme, StepError, SubStep, solve_step};
use vi_core::interval::Interval;
use vi_core::linear::{DenseLu, condition_number, norm_inf};
use vi_core::newton::{
    Block, BlockKind, Fault, Newton, NewtonProblem, NewtonReport, NewtonSettings,
};
use vi_core::state::State;

/// The d'Alembert form.
pub struct EmDalembert<N> {
    newton: Newton,
    sub_steps: usize,
    x: Vec<f64>, // n  Δq
    source: N,
    work: Work,
}

struct Work {
    balance: Balance,
    g: Vec<f64>,          // m
    matrix: DMatrix<f64>, // n × n
    lu: DenseLu,
    blocks: [Block; 1],
}

struct Problem<'a, C, N> {
    system: &'a EmSystem,
    constraints: &'a C,
    source: &'a mut N,
    work: &'a mut Work,
}

impl<N> EmDalembert<N> {
    /// For `n` coordinates, an independent set of `m` constraints and a source of `P̄`.
    #[must_use]
    pub fn new(
        n: usize,
        (rows, m): (IndependentRows, usize),
        source: N,
        settings: NewtonSettings,
        sub_steps: usize,
    ) -> Self {
        let work = Work {
            balance: Balance::new(n, (rows, m)),
            g: vec![0.0; m],
            matrix: DMatrix::zeros(n, n),
            lu: DenseLu::new(n),
            blocks: [Block { kind: BlockKind::Position, range: 0..n, floor: 1.0 }],
        };
        Self { newton: Newton::new(n, settings), sub_steps, x: vec![0.0; n], source, work }
    }

    /// With the multipliers of a tree found frame by frame, where there is one.
    #[must_use]
    pub fn on_tree(mut self, tree: Option<TreeMultipliers>) -> Self {
        self.work.balance = self.work.balance.on_tree(tree);
        self
    }
}

impl<C: DiscreteConstraints, N: DiscreteNullSpace<C>> NewtonProblem for Problem<'_, C, N> {
    fn blocks(&self) -> &[Block] {
        &self.work.blocks
    }

    fn residual(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        let Work { balance, g, .. } = &mut *self.work;
        balance.s.dq.copy_from_slice(x);
        balance.s.close_from_increment();
        self.source.null_space(self.constraints, &balance.s, &mut balance.null_space);
        let (work_done, closure) = r.split_at_mut(balance.null_space.ncols());
        balance.projected_residual(self.system, self.constraints, work_done)?;
        self.constraints.value(balance.s.end(), g);
        balance.rows().gather(g, closure);
        Ok(())
    }

    fn resolution(&self) -> f64 {
        BEYOND_ROUNDING
    }

    fn correction(&mut self, _x: &[f64], dx: &mut [f64]) -> Result<(), Fault> {
        let Work { balance, matrix, lu, .. } = &mut *self.work;
        balance.tangent(self.system, self.constraints);
        let (tangent, null_space, row) = balance.parts();
        let (n, d) = null_space.shape();
        matrix.fill(0.0);
        for k in 0..d {
            row.fill(0.0);
            tangent.tr_mul_add(1.0, &null_space.as_slice()[k * n..(k + 1) * n], row);
            for (j, value) in row.iter().enumerate() {
                matrix[(k, j)] = *value; // (K̃ᵀ P̄_k)ᵀ
            }
        }
        let place = JacobianPlace { row: d, column: 0, scale: 1.0, transposed: false };
        let at = (balance.s.t_end(), &balance.s.q1[..]);
        balance.rows().emit_jacobian(self.constraints, at, place, matrix);
        Ok(lu.solve(matrix, dx)?)
    }
}

impl<C: DiscreteConstraints, N: DiscreteNullSpace<C>> Scheme<EmSystem, C> for EmDalembert<N> {
    fn name(&self) -> &'static str {
        EmForm::Dalembert.name()
    }

    fn advance(
        &mut self,
        system: &EmSystem,
        constraints: &C,
        step: SubStep,
        state: &mut State,
    ) -> Result<NewtonReport, StepError> {
        let work = &mut self.work;
        state.history.fit(self.x.len(), self.sub_steps, 0..0);
        work.balance.open(state, step);
        work.blocks[0].floor = 1e-5 * norm_inf(&state.q).max(1e-6);
        let mut problem = Problem { system, constraints, source: &mut self.source, work };
        let (newton, history) = (&mut self.newton, &mut state.history);
        let mut outcome = solve_step(newton, history, step, &mut problem, &mut self.x);
        if problem.work.balance.renew_rows(constraints, outcome.is_ok()) {
            outcome = solve_step(newton, history, step, &mut problem, &mut self.x);
        }
        let report = outcome?;
        let balance = &self.work.balance;
        balance.remember(&mut state.memory);
        let lost = Some(self.newton.lost());
        advance_state(state, system, (&balance.s, &balance.mu), lost, |_, _| {});
        Ok(report)
    }

    fn interval(&self) -> &Interval {
        &self.work.balance.s
    }

    fn interval_mut(&mut self) -> &mut Interval {
        &mut self.work.balance.s
    }

    fn condition(&mut self, _system: &EmSystem, _constraints: &C) -> Option<Condition> {
        let d = self.work.balance.null_space.ncols();
        let scaled = &self.work.matrix;
        let mut written = scaled.clone();
        written.rows_mut(0, d).scale_mut(1.0 / self.work.balance.s.h);
        let as_written = condition_number(&written);
        Some(Condition { as_written, scaled: condition_number(scaled) })
    }
}
