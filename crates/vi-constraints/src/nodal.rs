//! Schemes 3 and 4: d'Alembert with nodal reparametrization, LMO08 (28), and reduced, LMO08 (30).
//!
//! ```text
//! r(u) = P(q_n)ᵀ [p̄_n + D_1 L_d(q_n, F_d(u, q_n)) + f_d^-] = 0,    q_{n+1} = F_d(u, q_n)     (28)
//! Dr   = P(q_n)ᵀ D_2(D_1 L_d + f_d^-) ∂F_d/∂u
//! ```
//! The reduced scheme (30) puts `∂F_d/∂u (u_{n-1}, q_{n-1})` in the place of `P(q_n)`: its range is
//! the tangent space at `q_n` too, so the roots are the same. Its first step has no last one and
//! takes `P(q_0)`.
//!
//! The rounding error of the momentum balance is carried to the next step, as is that of `q`
//! (compensated stepping, [`vi_core::compensation`]).
//!
//! The constraints hold by construction; no derivative of `P` appears; the condition number does
//! not depend on `h`. Written against [`NodalOperators`], so trees solve it in linear time.

use crate::constraints::Constraints;
use crate::reparametrization::{LastStep, NodalOperators};
use crate::scheme::{Condition, Scheme, StepError, SubStep};
use crate::unknowns::Increments;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;
use vi_core::newton::{Block, Fault, Newton};
use vi_core::predictor::Degree;
use vi_core::sparse::Entries;
use vi_core::state::State;

/// The nodal scheme, or with `reduced` the reduced variational scheme.
#[derive(Debug)]
pub struct Nodal<O> {
    operators: O,
    increments: Increments,
    reduced: bool,
    rates: Option<Vec<f64>>, // d  ν(0), where the first step cannot start from u = 0
    s: Interval,
    p: Vec<f64>,            // n  p̄_n
    residual: Vec<f64>,     // n  p̄_n + D_1 L_d + f_d^-
    compensation: Vec<f64>, // d  rounding error of the last momentum balance
}

impl<O: NodalOperators> Nodal<O> {
    /// For `n` coordinates.
    #[must_use]
    pub fn new(n: usize, operators: O, reduced: bool) -> Self {
        let (s, zeros) = (Interval::new(n), |k: usize| vec![0.0; k]);
        Self {
            increments: Increments::new(operators.blocks().to_vec()),
            reduced,
            rates: None,
            s,
            p: zeros(n),
            residual: zeros(n),
            compensation: zeros(operators.dof()),
            operators,
        }
    }

    /// Newton's method of the first step starts from `h ν`: at a singular configuration `u = 0` is
    /// no initial guess.
    #[must_use]
    pub fn starting_with(mut self, rates: Vec<f64>) -> Self {
        self.rates = Some(rates);
        self
    }
}

impl<S: DiscreteLagrangian, C: Constraints, O: NodalOperators> Scheme<S, C> for Nodal<O> {
    fn blocks(&self) -> &[Block] {
        self.increments.blocks()
    }

    fn begin(&mut self, _system: &S, constraints: &C, step: SubStep, state: &mut State) {
        step.open(&mut self.s, state);
        self.p.copy_from_slice(&state.p);
        state.compensation.open_balance(&mut self.compensation);
        let last = state.memory.last.as_ref().zip(state.history.before(step.index));
        let last = last.filter(|_| self.reduced).map(|(s, u)| LastStep { u, s });
        self.increments.open(constraints, &state.q);
        self.operators.take_momentum(&state.p, step.h);
        // P(q_n), or ∂F_d/∂u of the last step (30)
        self.operators.begin(&self.s, &state.memory, last);
        self.operators.take_balance(&mut self.compensation);
        step.depart(self.rates.as_deref(), state);
    }

    fn residual(
        &mut self,
        system: &S,
        constraints: &C,
        u: &[f64],
        r: &mut [f64],
    ) -> Result<(), Fault> {
        let Self { operators, increments, s, p, residual, compensation, .. } = self;
        operators.reparametrize(u, s)?; // q_{n+1} = F_d(u, q_n)
        increments.reach(constraints, &s.q1);
        system.forced_d1(s, residual);
        residual.iter_mut().zip(p).for_each(|(r, p)| *r += *p);
        operators.pull_back(residual, r); // P(q_n)ᵀ [p̄_n + D_1 L_d + f_d^-]  (28)
        r.iter_mut().zip(compensation).for_each(|(r, error)| *r += *error);
        operators.close(r);
        Ok(())
    }

    fn correction(&mut self, system: &S, _: &C, u: &[f64], du: &mut [f64]) -> Result<(), Fault> {
        let s = &self.s;
        self.operators.solve(&|out: &mut dyn Entries| system.forced_d2_d1(s, out), u, s, du)
    }

    fn noise(&self) -> f64 {
        self.operators.noise()
    }

    fn degree(&self) -> Degree {
        self.operators.degree()
    }

    fn closing_size(&self) -> f64 {
        self.operators.closing_size()
    }

    fn rotation(&self, u: &[f64]) -> f64 {
        self.operators.rotation(u)
    }

    fn end(
        &mut self,
        system: &S,
        _constraints: &C,
        newton: &Newton,
        state: &mut State,
    ) -> Result<(), StepError> {
        let Self { operators, reduced, s, .. } = self;
        state.compensation.balance.copy_from_slice(newton.residual());
        operators.carry_balance(&mut state.compensation.balance);
        state.memory.indices.clear();
        state.memory.values.clear();
        operators.remember(&mut state.memory);
        if *reduced {
            state.memory.keep(s);
        }
        state.move_to_configuration(s, |t, q| operators.clean(t, q));
        state.move_momentum(system, s);
        Ok(())
    }

    fn interval(&self) -> &Interval {
        &self.s
    }

    fn interval_mut(&mut self) -> &mut Interval {
        &mut self.s
    }

    /// From the inverse, column by column: the operators may have no matrix. On closed loops the
    /// rows of their constraints count among those of the matrix.
    fn condition(&mut self, system: &S, _constraints: &C, u: &[f64]) -> Option<Condition> {
        let Self { operators, s, .. } = self;
        let mixed = |out: &mut dyn Entries| system.forced_d2_d1(s, out);
        Condition::of_inverse(u.len(), |column| {
            operators.forget_factors();
            operators.solve(&mixed, u, s, column)
        })
    }
}
