//! The d'Alembert form, `em-dalembert`: multipliers eliminated by the discrete null space.
//!
//! ```text
//! P̄(q_n, q_{n+1})ᵀ (h B(Δq) + Ḡᵀμ) = 0,    g(q_{n+1}) = 0
//! [ P̄ᵀ (h K + Σ_i μ_i ∂Ḡ_iᵀ/∂q_{n+1}) ]
//! [ G(q_{n+1})                          ]
//! ```
//! Unknown `Δq ∈ R^n`. `μ` is not an unknown: it follows from the bracket, and drops
//! out where `Ḡ P̄ = 0`, which averaged formulas fulfil only once `g(q_{n+1}) = 0`. Dense, `O(n³)`
//! a step: for small systems and comparisons.
//!
//! Letters and the derivative of `P̄`: [`crate::null_space`]. Source: Betsch & Leyendecker 2006.

use crate::balance::Balance;
use crate::constraint::{DiscreteConstraints, HalfTurn};
use crate::em_system::EmSystem;
use crate::null_space::DiscreteNullSpace;
use crate::scheme::advance_state;
use nalgebra::DMatrix;
use vi_constraints::saddle_point::{IndependentRows, JacobianPlace};
use vi_constraints::scheme::{ConditionNumbers, Scheme, StepError, SubStep};
use vi_constraints::unknowns::{position_floor, rotation};
use vi_core::interval::Interval;
use vi_core::linear::DenseLu;
use vi_core::newton::{BlockKind, Fault, Newton, NewtonError, Precision, UnknownBlock};
use vi_core::state::State;
use vi_multibody::tree_multipliers::TreeMultipliers;

/// The d'Alembert form.
#[derive(Debug)]
pub struct EmDalembert<N> {
    source: N,
    balance: Balance,
    g: Vec<f64>,          // m
    matrix: DMatrix<f64>, // n × n
    lu: DenseLu,
    blocks: [UnknownBlock; 1],
    units: Vec<f64>, // n  of the coordinates, from the first step on
}

impl<N> EmDalembert<N> {
    /// For `n` coordinates, an independent set of `m` constraints and a source of `P̄`.
    #[must_use]
    pub fn new(n: usize, m: usize, rows: IndependentRows, source: N) -> Self {
        Self {
            source,
            balance: Balance::new(n, rows, m),
            g: vec![0.0; m],
            matrix: DMatrix::zeros(n, n),
            lu: DenseLu::new(n),
            blocks: [UnknownBlock { kind: BlockKind::Position, range: 0..n, floor: 1.0 }],
            units: Vec::new(),
        }
    }

    /// With the multipliers of a tree found frame by frame, where there is one.
    #[must_use]
    pub fn on_tree(mut self, tree: Option<TreeMultipliers>) -> Self {
        self.balance = self.balance.on_tree(tree);
        self
    }
}

impl<C: DiscreteConstraints, N: DiscreteNullSpace<C>> Scheme<EmSystem, C> for EmDalembert<N> {
    fn blocks(&self) -> &[UnknownBlock] {
        &self.blocks
    }

    fn begin(&mut self, _system: &EmSystem, constraints: &C, step: SubStep, state: &mut State) {
        self.balance.open(state, step);
        self.blocks[0].floor = position_floor(&state.q);
        if self.units.is_empty() {
            self.units.resize(state.q.len(), 1.0);
            constraints.coordinate_units(&mut self.units);
        }
    }

    fn residual(
        &mut self,
        system: &EmSystem,
        constraints: &C,
        x: &[f64],
        r: &mut [f64],
    ) -> Result<(), Fault> {
        let Self { source, balance, g, .. } = self;
        balance.s.dq.copy_from_slice(x);
        balance.s.close_from_increment();
        source.null_space(constraints, &balance.s, &mut balance.null_space);
        let (work_done, closure) = r.split_at_mut(balance.null_space.ncols());
        balance.projected_residual(system, constraints, work_done)?;
        constraints.value(balance.s.end(), g);
        balance.rows().gather(g, closure);
        Ok(())
    }

    /// Without multipliers among the unknowns a remainder of `ε/64` has the same sign in each step
    /// of a steady rotation; the constrained form does not need it.
    fn precision(&self) -> Precision {
        Precision { resolution: 1.0 / 65536.0, ..Precision::default() }
    }

    /// Gaps beside momenta.
    fn rotation(&self, dq: &[f64]) -> f64 {
        rotation(&self.units, dq)
    }

    fn correction(
        &mut self,
        system: &EmSystem,
        constraints: &C,
        _x: &[f64],
        dx: &mut [f64],
    ) -> Result<(), Fault> {
        let Self { balance, matrix, lu, .. } = self;
        balance.tangent(system, constraints);
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
        balance.rows().emit_jacobian(constraints, balance.s.end(), place, matrix);
        Ok(lu.solve(matrix, dx)?)
    }

    fn renew(&mut self, constraints: &C, solved: bool) -> bool {
        self.balance.renew_rows(constraints, solved)
    }

    fn end(
        &mut self,
        system: &EmSystem,
        constraints: &C,
        newton: &Newton,
        state: &mut State,
    ) -> Result<(), StepError> {
        if let Some(HalfTurn { coordinate, angle }) = constraints.half_turn(&self.balance.s) {
            let kind = BlockKind::Rotation;
            let fault = Fault::OutsideChart { kind, unknown: coordinate, size: angle };
            return Err(NewtonError::Refused { fault, iteration: 0 }.into());
        }
        let balance = &self.balance;
        balance.remember(&mut state.memory);
        let rounding = Some(newton.rounding_error());
        advance_state(state, system, &balance.s, &balance.mu, rounding, |_, _| {});
        Ok(())
    }

    fn interval(&self) -> &Interval {
        &self.balance.s
    }

    fn interval_mut(&mut self) -> &mut Interval {
        &mut self.balance.s
    }

    fn condition(&mut self, _system: &EmSystem, _: &C, _x: &[f64]) -> Option<ConditionNumbers> {
        let Balance { null_space, s, .. } = &self.balance;
        Some(ConditionNumbers::of_scaled_rows(&self.matrix, null_space.ncols(), s.h))
    }
}
