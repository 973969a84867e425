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
//! Redundant constraints: the rows of an independent set are used, and others once these are no
//! longer clearly independent.

use crate::constraints::Constraints;
use crate::saddle_point::{IndependentRows, SaddlePoint};
use crate::scheme::{ConditionNumbers, Scheme, StepError, SubStep};
use crate::unknowns::{self, coordinates_and_multipliers};
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;
use vi_core::newton::{Fault, Newton, UnknownBlock};
use vi_core::sparse::{Block as MatrixBlock, Entries, SparseMatrix};
use vi_core::state::State;

/// The constrained scheme.
#[derive(Debug)]
pub struct Constrained {
    s: Interval,
    p: Vec<f64>,                    // n  p̄_n
    g: Vec<f64>,                    // m  all constraints
    force: Vec<f64>,                // n  Gᵀ (h²λ)
    lambda: Vec<f64>,               // m  h²λ over all constraints
    jacobian: Option<SparseMatrix>, // m × n  G(q_n)
    saddle: SaddlePoint,
    blocks: [UnknownBlock; 2],
}

impl Constrained {
    /// For `n` coordinates and an independent set of `m` constraints.
    #[must_use]
    pub fn new(n: usize, m: usize, rows: IndependentRows) -> Self {
        Self {
            s: Interval::new(n),
            p: vec![0.0; n],
            g: vec![0.0; m],
            force: vec![0.0; n],
            lambda: vec![0.0; m],
            jacobian: None,
            blocks: coordinates_and_multipliers(n, rows.len()),
            saddle: SaddlePoint::new(n, rows),
        }
    }
}

impl<S: DiscreteLagrangian, C: Constraints> Scheme<S, C> for Constrained {
    fn blocks(&self) -> &[UnknownBlock] {
        &self.blocks
    }

    fn begin(&mut self, system: &S, constraints: &C, step: SubStep, state: &mut State) {
        self.saddle.recall(&state.memory);
        step.open(&mut self.s, state);
        system.prepare(&mut self.s);
        self.p.copy_from_slice(&state.p);
        let shape = (constraints.len(), constraints.dim());
        let emit = |out: &mut dyn Entries| constraints.jacobian(state.t, &state.q, out);
        SparseMatrix::update(&mut self.jacobian, shape, emit);
        unknowns::scale(&mut self.blocks, &state.q, system.mass());
    }

    fn residual(
        &mut self,
        system: &S,
        constraints: &C,
        x: &[f64],
        r: &mut [f64],
    ) -> Result<(), Fault> {
        let n = self.s.dim();
        let (dq, mu) = x.split_at(n);
        let (momentum, closure) = r.split_at_mut(n);
        self.s.dq.copy_from_slice(dq);
        self.s.close_from_increment();
        system.reach(&mut self.s);
        system.forced_d1(&self.s, momentum);
        let rows = self.saddle.rows();
        rows.scatter(mu, &mut self.lambda);
        self.force.fill(0.0);
        let jacobian = self.jacobian.as_ref().expect("filled when the step began");
        jacobian.tr_mul_add(1.0, &self.lambda, &mut self.force);
        for i in 0..n {
            momentum[i] = self.s.h * (momentum[i] + self.p[i]) - self.force[i]; // (22)₁ times h
        }
        constraints.value(self.s.end(), &mut self.g);
        rows.gather(&self.g, closure); // (22)₂
        Ok(())
    }

    fn correction(
        &mut self,
        system: &S,
        constraints: &C,
        _x: &[f64],
        dx: &mut [f64],
    ) -> Result<(), Fault> {
        let Self { s, saddle, .. } = self;
        let emit = |out: &mut dyn Entries| {
            let (row, column, transposed) = (0, 0, false);
            let mut block = MatrixBlock { into: out, row, column, scale: s.h, transposed };
            system.forced_d2_d1(s, &mut block);
        };
        Ok(saddle.solve(constraints, &emit, s.start(), -1.0, s.end(), dx)?)
    }

    fn renew(&mut self, constraints: &C, solved: bool) -> bool {
        self.saddle.renew(constraints, &self.s, solved)
    }

    fn end(&mut self, system: &S, _: &C, _: &Newton, state: &mut State) -> Result<(), StepError> {
        self.saddle.remember(&mut state.memory);
        state.move_to_end(system, &self.s);
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

    fn condition(&mut self, _system: &S, _constraints: &C, _x: &[f64]) -> Option<ConditionNumbers> {
        ConditionNumbers::of_saddle_point(&self.saddle, &self.s)
    }
}
