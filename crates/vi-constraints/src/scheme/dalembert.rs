//! Scheme 2, d'Alembert: LMO08 (25).
//!
//! ```text
//! P(q_n)ᵀ [p̄_n + D_1 L_d(q_n, q_{n+1}) + f_d^-] = 0,    g(q_{n+1}) = 0
//! unknown Δq ∈ R^n; balance rows times h:
//! [ h P(q_n)ᵀ D_2(D_1 L_d + f_d^-) ]
//! [ G(q_{n+1})                     ]
//! ```
//! `P` comes from a reparametrization where there is one, else from a pivoted QR of `G(q_n)ᵀ`.
//! Dense, `O(n³)` a step: for small systems and comparisons. As written its condition number grows
//! like `h⁻¹`.

use crate::constraints::Constraints;
use crate::null_space::NullSpaceQr;
use crate::reparametrization::{Reparametrization, pull_back};
use crate::saddle_point::{IndependentRows, JacobianPlace};
use crate::scheme::{ConditionNumbers, Scheme, StepError, SubStep};
use crate::unknowns::{position_floor, rotation};
use nalgebra::DMatrix;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;
use vi_core::linear::DenseLu;
use vi_core::newton::{BlockKind, Fault, Newton, UnknownBlock};
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::state::State;

/// Where the null space matrix comes from.
pub trait NullSpaceSource<C>: Send {
    /// `out ← P(q)`, shape `n × d`.
    fn null_space(&mut self, constraints: &C, t: f64, q: &[f64], out: &mut DMatrix<f64>);
    /// Constraints that are independent at the configuration of the last `P`, where it was found
    /// from them.
    fn independent(&self) -> Option<&[usize]> {
        None
    }
}

/// `P` by pivoted QR, always of the generic rank.
#[derive(Debug)]
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
        self.qr.factorize_preferring(&self.jacobian, constraints.allowances());
        self.qr.null_space(self.rank, out);
    }

    fn independent(&self) -> Option<&[usize]> {
        Some(&self.qr.pivots()[..self.rank])
    }
}

/// `P` from a reparametrization.
#[derive(Clone, Copy, Debug)]
pub struct MapSource<R>(pub R);

impl<C, R: Reparametrization> NullSpaceSource<C> for MapSource<R> {
    fn null_space(&mut self, _constraints: &C, _t: f64, q: &[f64], out: &mut DMatrix<f64>) {
        self.0.null_space(q, out);
    }
}

/// The d'Alembert scheme.
#[derive(Debug)]
pub struct Dalembert<N> {
    source: N,
    s: Interval,
    p: Vec<f64>,                 // n  p̄_n
    bracket: Vec<f64>,           // n  p̄_n + D_1 L_d + f_d^-
    g: Vec<f64>,                 // m
    null_space: DMatrix<f64>,    // n × d
    mixed: Option<SparseMatrix>, // n × n
    matrix: DMatrix<f64>,        // n × n
    rows: IndependentRows,
    lu: DenseLu,
    blocks: [UnknownBlock; 1],
    units: Vec<f64>, // n  of the coordinates, from the first step on
}

impl<N> Dalembert<N> {
    /// For `n` coordinates, an independent set of `m` constraints and a source of `P`.
    #[must_use]
    pub fn new(n: usize, m: usize, rows: IndependentRows, source: N) -> Self {
        Self {
            source,
            s: Interval::new(n),
            p: vec![0.0; n],
            bracket: vec![0.0; n],
            g: vec![0.0; m],
            null_space: DMatrix::zeros(n, n - rows.len()),
            mixed: None,
            matrix: DMatrix::zeros(n, n),
            rows,
            lu: DenseLu::new(n),
            blocks: [UnknownBlock { kind: BlockKind::Position, range: 0..n, floor: 1.0 }],
            units: Vec::new(),
        }
    }
}

impl<S: DiscreteLagrangian, C: Constraints, N: NullSpaceSource<C>> Scheme<S, C> for Dalembert<N> {
    fn blocks(&self) -> &[UnknownBlock] {
        &self.blocks
    }

    fn begin(&mut self, system: &S, constraints: &C, step: SubStep, state: &mut State) {
        step.open(&mut self.s, state);
        system.prepare(&mut self.s);
        self.p.copy_from_slice(&state.p);
        self.blocks[0].floor = position_floor(&state.q);
        if self.units.is_empty() {
            self.units.resize(state.q.len(), 1.0);
            constraints.coordinate_units(&mut self.units);
        }
        self.source.null_space(constraints, state.t, &state.q, &mut self.null_space);
        if let Some(rows) = self.source.independent() {
            self.rows.replace(rows);
        }
    }

    fn residual(
        &mut self,
        system: &S,
        constraints: &C,
        x: &[f64],
        r: &mut [f64],
    ) -> Result<(), Fault> {
        self.s.dq.copy_from_slice(x);
        self.s.close_from_increment();
        system.reach(&mut self.s);
        system.forced_d1(&self.s, &mut self.bracket);
        self.bracket.iter_mut().zip(&self.p).for_each(|(b, p)| *b += p);
        let (balance, closure) = r.split_at_mut(self.null_space.ncols());
        pull_back(&self.null_space, &self.bracket, balance);
        balance.iter_mut().for_each(|r| *r *= self.s.h); // (25)₁ times h
        constraints.value(self.s.end(), &mut self.g);
        self.rows.gather(&self.g, closure); // (25)₂
        Ok(())
    }

    /// Gaps beside momenta.
    fn rotation(&self, dq: &[f64]) -> f64 {
        rotation(&self.units, dq)
    }

    fn correction(
        &mut self,
        system: &S,
        constraints: &C,
        _x: &[f64],
        dx: &mut [f64],
    ) -> Result<(), Fault> {
        let Self { s, matrix, null_space, .. } = self;
        let (n, d) = null_space.shape();
        let emit = |out: &mut dyn Entries| system.forced_d2_d1(s, out);
        let mixed = SparseMatrix::update(&mut self.mixed, (n, n), emit);
        matrix.fill(0.0);
        for k in 0..d {
            // row k: h (Kᵀ P_k)ᵀ
            self.bracket.fill(0.0);
            let column = &null_space.as_slice()[k * n..(k + 1) * n];
            mixed.tr_mul_add(s.h, column, &mut self.bracket);
            for (j, value) in self.bracket.iter().enumerate() {
                matrix[(k, j)] = *value;
            }
        }
        let place = JacobianPlace { row: d, column: 0, scale: 1.0, transposed: false };
        self.rows.emit_jacobian(constraints, s.end(), place, matrix);
        Ok(self.lu.solve(matrix, dx)?)
    }

    fn end(&mut self, system: &S, _: &C, _: &Newton, state: &mut State) -> Result<(), StepError> {
        state.move_to_end(system, &self.s);
        Ok(())
    }

    fn interval(&self) -> &Interval {
        &self.s
    }

    fn interval_mut(&mut self) -> &mut Interval {
        &mut self.s
    }

    fn condition(&mut self, _system: &S, _constraints: &C, _x: &[f64]) -> Option<ConditionNumbers> {
        Some(ConditionNumbers::of_scaled_rows(&self.matrix, self.null_space.ncols(), self.s.h))
    }
}
