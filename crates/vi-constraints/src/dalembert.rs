//! Scheme 2, d'Alembert: LMO08 (25).
//!
//! ```text
//! P(q_n)ᵀ [p̄_n + D_1 L_d(q_n, q_{n+1}) + f_d^-] = 0,    g(q_{n+1}) = 0
//! unknown Δq ∈ R^n; balance rows times h:
//! [ h P(q_n)ᵀ D_2(D_1 L_d + f_d^-) ]
//! [ G(q_{n+1})                     ]
//! ```
//! `P` comes from a reparametrization where there is one, else from a pivoted QR of `G(q_n)ᵀ`. Dense,
//! `O(n³)` a step: for small systems and comparisons. As written its condition number grows like
//! `h⁻¹`.

use crate::constraints::Constraints;
use crate::null_space::NullSpaceQr;
use crate::reparametrization::Reparametrization;
use crate::saddle_point::{IndependentRows, JacobianPlace};
use crate::scheme::{Condition, Scheme, SchemeKind, StepError, SubStep, solve_step};
use nalgebra::DMatrix;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;
use vi_core::linear::{DenseLu, condition_number, norm_inf};
use vi_core::newton::{
    Block, BlockKind, Fault, Newton, NewtonProblem, NewtonReport, NewtonSettings,
};
use vi_core::sparse::SparseMatrix;
use vi_core::state::State;

/// Where the null space matrix comes from.
pub trait NullSpaceSource<C>: Send {
    /// `out ← P(q)`, shape `n × d`.
    fn null_space(&mut self, constraints: &C, t: f64, q: &[f64], out: &mut DMatrix<f64>);
    /// Constraints that are independent at the configuration of the last `P`, where it was found from
    /// them.
    fn independent(&self) -> Option<&[usize]> {
        None
    }
}

/// `P` by pivoted QR, always of the generic rank.
pub struct QrSource {
    qr: NullSpaceQr,
    jacobian: DMatrix<f64>, // m × n
    rank: usize,
}

impl QrSource {
    /// For `m` constraints of generic rank `rank` on `n` coordinates.
    #[must_use]
    pub fn new(n: usize, m: usize, rank: usize) -> Self {
        Self { qr: NullSpaceQr::new(n, m), jacobian: DMatrix::zeros(m, n), rank }
    }
}

impl<C: Constraints> NullSpaceSource<C> for QrSource {
    fn null_space(&mut self, constraints: &C, t: f64, q: &[f64], out: &mut DMatrix<f64>) {
        self.jacobian.fill(0.0);
        constraints.jacobian(t, q, &mut self.jacobian);
        self.qr.factorize(&self.jacobian);
        self.qr.null_space(self.rank, out);
    }

    fn independent(&self) -> Option<&[usize]> {
        Some(&self.qr.pivots()[..self.rank])
    }
}

/// `P` from a reparametrization.
pub struct MapSource<R>(pub R);

impl<C, R: Reparametrization> NullSpaceSource<C> for MapSource<R> {
    fn null_space(&mut self, _constraints: &C, _t: f64, q: &[f64], out: &mut DMatrix<f64>) {
        self.0.null_space(q, out);
    }
}

/// The d'Alembert scheme.
pub struct Dalembert<N> {
    newton: Newton,
    sub_steps: usize,
    x: Vec<f64>, // n  Δq
    source: N,
    work: Work,
}

struct Work {
    s: Interval,
    p: Vec<f64>,                 // n  p̄_n
    bracket: Vec<f64>,           // n  p̄_n + D_1 L_d + f_d^-
    g: Vec<f64>,                 // m
    null_space: DMatrix<f64>,    // n × d
    mixed: Option<SparseMatrix>, // n × n
    matrix: DMatrix<f64>,        // n × n
    rows: IndependentRows,
    lu: DenseLu,
    blocks: [Block; 1],
}

struct Problem<'a, S, C> {
    system: &'a S,
    constraints: &'a C,
    work: &'a mut Work,
}

impl<N> Dalembert<N> {
    /// For `n` coordinates, `m` constraints and an independent set of them.
    #[must_use]
    pub fn new(
        n: usize,
        (rows, m): (IndependentRows, usize),
        source: N,
        settings: NewtonSettings,
        sub_steps: usize,
    ) -> Self {
        let d = n - rows.len();
        let work = Work {
            s: Interval::new(n),
            p: vec![0.0; n],
            bracket: vec![0.0; n],
            g: vec![0.0; m],
            null_space: DMatrix::zeros(n, d),
            mixed: None,
            matrix: DMatrix::zeros(n, n),
            rows,
            lu: DenseLu::new(n),
            blocks: [Block { kind: BlockKind::Position, range: 0..n, floor: 1.0 }],
        };
        Self { newton: Newton::new(n, settings), sub_steps, x: vec![0.0; n], source, work }
    }
}

impl<S: DiscreteLagrangian, C: Constraints> NewtonProblem for Problem<'_, S, C> {
    fn blocks(&self) -> &[Block] {
        &self.work.blocks
    }

    fn residual(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        let work = &mut *self.work;
        work.s.dq.copy_from_slice(x);
        work.s.close_from_increment();
        self.system.forced_d1(&work.s, &mut work.bracket);
        for (b, p) in work.bracket.iter_mut().zip(&work.p) {
            *b += p;
        }
        let (balance, closure) = r.split_at_mut(work.null_space.ncols());
        for (r, column) in balance.iter_mut().zip(work.null_space.column_iter()) {
            let work_done: f64 = column.iter().zip(&work.bracket).map(|(p, b)| p * b).sum();
            *r = work.s.h * work_done; // (25)₁ times h
        }
        self.constraints.value(work.s.end(), &mut work.g);
        work.rows.gather(&work.g, closure); // (25)₂
        Ok(())
    }

    fn correction(&mut self, _x: &[f64], dx: &mut [f64]) -> Result<(), Fault> {
        let work = &mut *self.work;
        let n = work.s.dim();
        let emit = |out: &mut dyn vi_core::Entries| self.system.forced_d2_d1(&work.s, out);
        let mixed = SparseMatrix::update(&mut work.mixed, (n, n), emit);
        let d = work.null_space.ncols();
        work.matrix.fill(0.0);
        for k in 0..d {
            // row k: h (K ᵀ P_k)ᵀ
            work.bracket.fill(0.0);
            let column = &work.null_space.as_slice()[k * n..(k + 1) * n];
            mixed.tr_mul_add(work.s.h, column, &mut work.bracket);
            for (j, value) in work.bracket.iter().enumerate() {
                work.matrix[(k, j)] = *value;
            }
        }
        let place = JacobianPlace { row: d, column: 0, scale: 1.0, transposed: false };
        let at = (work.s.t_end(), &work.s.q1[..]);
        work.rows.emit_jacobian(self.constraints, at, place, &mut work.matrix);
        Ok(work.lu.solve(&work.matrix, dx)?)
    }
}

impl<S: DiscreteLagrangian, C: Constraints, N: NullSpaceSource<C>> Scheme<S, C> for Dalembert<N> {
    fn name(&self) -> &'static str {
        SchemeKind::Dalembert.name()
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
        step.open(&mut work.s, state);
        work.p.copy_from_slice(&state.p);
        work.blocks[0].floor = 1e-5 * norm_inf(&state.q).max(1e-6);
        self.source.null_space(constraints, state.t, &state.q, &mut work.null_space);
        if let Some(rows) = self.source.independent() {
            work.rows.replace(rows);
        }
        let mut problem = Problem { system, constraints, work };
        let (newton, history) = (&mut self.newton, &mut state.history);
        let report = solve_step(newton, history, step, &mut problem, &mut self.x)?;
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
        let (d, h) = (self.work.null_space.ncols(), self.work.s.h);
        let scaled = &self.work.matrix;
        let mut written = scaled.clone();
        written.rows_mut(0, d).scale_mut(1.0 / h);
        let as_written = condition_number(&written);
        Some(Condition { as_written, scaled: condition_number(scaled) })
    }
}
