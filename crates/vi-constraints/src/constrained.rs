//! Scheme 1, constrained: LMO08 (22).
//!
//! ```text
//! p̄_n + D_1 L_d(q_n, q_{n+1}) + f_d^- − h G(q_n)ᵀ λ_n = 0,    g(q_{n+1}) = 0
//! unknowns (Δq, h²λ_n); momentum rows times h:
//! [ h D_2(D_1 L_d + f_d^-)   −G(q_n)ᵀ ]
//! [ G(q_{n+1})                 0      ]
//! ```
//! The scaling by powers of `h` makes the condition number independent of `h`; as written it grows
//! like `h⁻³`. Sparse LU with pivoting, symbolic factorization once: `M` may be singular.
//! Redundant constraints: the rows of an independent set are used, and others once these are no longer
//! clearly independent.

use crate::constraints::Constraints;
use crate::saddle_point::{IndependentRows, SaddlePoint};
use crate::scheme::{Condition, Scheme, SchemeKind, StepError, SubStep, solve_step};
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;
use vi_core::linear::{condition_number, norm_inf};
use vi_core::newton::{
    Block, BlockKind, Fault, Newton, NewtonProblem, NewtonReport, NewtonSettings,
};
use vi_core::sparse::{Block as MatrixBlock, Entries, SparseMatrix};
use vi_core::state::State;

/// The constrained scheme.
pub struct Constrained {
    newton: Newton,
    sub_steps: usize,
    x: Vec<f64>, // n + r  (Δq, h²λ)
    work: Work,
}

struct Work {
    s: Interval,
    p: Vec<f64>,                    // n  p̄_n
    g: Vec<f64>,                    // m  all constraints
    force: Vec<f64>,                // n  Gᵀ (h²λ)
    lambda: Vec<f64>,               // m  h²λ over all constraints
    jacobian: Option<SparseMatrix>, // m × n  G(q_n)
    saddle: SaddlePoint,
    blocks: [Block; 2],
}

struct Problem<'a, S, C> {
    system: &'a S,
    constraints: &'a C,
    work: &'a mut Work,
}

impl Constrained {
    /// For `n` coordinates and an independent set of constraints.
    #[must_use]
    pub fn new(
        n: usize,
        rows: IndependentRows,
        m: usize,
        settings: NewtonSettings,
        sub_steps: usize,
    ) -> Self {
        let size = n + rows.len();
        let position = Block { kind: BlockKind::Position, range: 0..n, floor: 1.0 };
        let multiplier = Block { kind: BlockKind::Multiplier, range: n..size, floor: 1.0 };
        let work = Work {
            s: Interval::new(n),
            p: vec![0.0; n],
            g: vec![0.0; m],
            force: vec![0.0; n],
            lambda: vec![0.0; m],
            jacobian: None,
            saddle: SaddlePoint::new(n, rows),
            blocks: [position, multiplier],
        };
        Self { newton: Newton::new(size, settings), sub_steps, x: vec![0.0; size], work }
    }
}

impl<S: DiscreteLagrangian, C: Constraints> NewtonProblem for Problem<'_, S, C> {
    fn blocks(&self) -> &[Block] {
        &self.work.blocks
    }

    fn residual(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        let work = &mut *self.work;
        let n = work.s.dim();
        let (dq, mu) = x.split_at(n);
        let (momentum, closure) = r.split_at_mut(n);
        work.s.dq.copy_from_slice(dq);
        work.s.close_from_increment();
        self.system.forced_d1(&work.s, momentum);
        let rows = work.saddle.rows();
        rows.scatter(mu, &mut work.lambda);
        work.force.fill(0.0);
        let jacobian = work.jacobian.as_ref().expect("filled when the step began");
        jacobian.tr_mul_add(1.0, &work.lambda, &mut work.force);
        for i in 0..n {
            momentum[i] = work.s.h * (momentum[i] + work.p[i]) - work.force[i]; // (22)₁ times h
        }
        self.constraints.value(work.s.end(), &mut work.g);
        rows.gather(&work.g, closure); // (22)₂
        Ok(())
    }

    fn correction(&mut self, _x: &[f64], dx: &mut [f64]) -> Result<(), Fault> {
        let Work { s, saddle, .. } = &mut *self.work;
        let emit = |out: &mut dyn Entries| {
            let (row, column, transposed) = (0, 0, false);
            let mut block = MatrixBlock { into: out, row, column, scale: s.h, transposed };
            self.system.forced_d2_d1(s, &mut block);
        };
        let (upper, lower) = ((s.t, &s.q0[..]), (s.t_end(), &s.q1[..]));
        Ok(saddle.solve(self.constraints, &emit, (upper, -1.0, lower), dx)?)
    }
}

impl<S: DiscreteLagrangian, C: Constraints> Scheme<S, C> for Constrained {
    fn name(&self) -> &'static str {
        SchemeKind::Constrained.name()
    }

    fn advance(
        &mut self,
        system: &S,
        constraints: &C,
        step: SubStep,
        state: &mut State,
    ) -> Result<NewtonReport, StepError> {
        let work = &mut self.work;
        state.history.fit(self.x.len(), self.sub_steps, 0..0);
        work.saddle.recall(&state.memory);
        step.open(&mut work.s, state);
        work.p.copy_from_slice(&state.p);
        let (m, n) = (constraints.len(), constraints.dim());
        let emit = |out: &mut dyn Entries| constraints.jacobian(state.t, &state.q, out);
        SparseMatrix::update(&mut work.jacobian, (m, n), emit);
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
        self.work.saddle.remember(&mut state.memory);
        state.move_to_end(system, &self.work.s);
        Ok(report)
    }

    fn interval(&self) -> &Interval {
        &self.work.s
    }

    fn interval_mut(&mut self) -> &mut Interval {
        &mut self.work.s
    }

    fn condition(&mut self, _system: &S, _constraints: &C) -> Option<Condition> {
        let (n, h) = (self.work.s.dim(), self.work.s.h);
        let scaled = self.work.saddle.matrix()?.to_dense();
        let mut written = scaled.clone(); // columns of λ carry h², momentum rows 1/h
        written.view_mut((0, n), (n, scaled.ncols() - n)).scale_mut(h * h);
        written.view_mut((0, 0), (n, scaled.ncols())).scale_mut(1.0 / h);
        let condition = |a| condition_number(a);
        Some(Condition { as_written: condition(&written), scaled: condition(&scaled) })
    }
}
