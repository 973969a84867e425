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
//! The rounding error of the momentum balance is carried to the next step, as is that of `q` (compensated
//! stepping, [`vi_core::state::Compensation`]).
//!
//! The constraints hold by construction; no derivative of `P` appears; the condition number does not
//! depend on `h`. Written against [`NodalOperators`], so trees solve it in linear time.

use crate::reparametrization::{LastStep, NodalOperators};
use crate::scheme::{Condition, Scheme, SchemeKind, StepError, SubStep, solve_step};
use nalgebra::DMatrix;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;
use vi_core::linear::condition_number;
use vi_core::newton::{Block, Fault, Newton, NewtonProblem, NewtonReport, NewtonSettings};
use vi_core::sparse::Entries;
use vi_core::state::State;

/// The nodal scheme, or with `reduced` the reduced variational scheme.
pub struct Nodal<O> {
    operators: O,
    reduced: bool,
    newton: Newton,
    sub_steps: usize,
    u: Vec<f64>,             // d
    first: Option<Vec<f64>>, // d  ν(0), where the first step cannot start from u = 0
    work: Work,
}

struct Work {
    s: Interval,
    p: Vec<f64>,        // n  p̄_n
    residual: Vec<f64>, // n  p̄_n + D_1 L_d + f_d^-
    carried: Vec<f64>,  // d  residual of the last balance
}

struct Problem<'a, S, O> {
    system: &'a S,
    operators: &'a mut O,
    work: &'a mut Work,
}

impl<O> Nodal<O> {
    /// For `n` coordinates and `d` degrees of freedom.
    #[must_use]
    pub fn new(
        operators: O,
        (n, d): (usize, usize),
        reduced: bool,
        settings: NewtonSettings,
        sub_steps: usize,
    ) -> Self {
        let zeros = |k: usize| vec![0.0; k];
        let work = Work { s: Interval::new(n), p: zeros(n), residual: zeros(n), carried: zeros(d) };
        let newton = Newton::new(d, settings);
        Self { operators, reduced, newton, sub_steps, u: zeros(d), first: None, work }
    }

    /// Newton's method of the first step starts from `h ν`: at a singular configuration `u = 0` is no
    /// initial guess.
    #[must_use]
    pub fn starting_with(mut self, rates: Vec<f64>) -> Self {
        self.first = Some(rates);
        self
    }

    /// The operators.
    pub fn operators(&self) -> &O {
        &self.operators
    }

    /// The increment `u` of the last step, shape `d`.
    pub fn increment(&self) -> &[f64] {
        &self.u
    }
}

impl<S: DiscreteLagrangian, O: NodalOperators> NewtonProblem for Problem<'_, S, O> {
    fn blocks(&self) -> &[Block] {
        self.operators.blocks()
    }

    fn residual(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        let Work { s, p, residual, carried } = &mut *self.work;
        self.operators.reparametrize(x, s)?;
        self.system.forced_d1(s, residual);
        residual.iter_mut().zip(p).for_each(|(r, p)| *r += *p);
        self.operators.pull_back(residual, r); // (28)
        r.iter_mut().zip(carried).for_each(|(r, carried)| *r += *carried);
        self.operators.close(r);
        Ok(())
    }

    fn correction(&mut self, x: &[f64], dx: &mut [f64]) -> Result<(), Fault> {
        let s = &self.work.s;
        self.operators.solve(&|out: &mut dyn Entries| self.system.forced_d2_d1(s, out), x, s, dx)
    }

    fn noise(&self) -> f64 {
        self.operators.noise()
    }
}

impl<S: DiscreteLagrangian, C, O: NodalOperators> Scheme<S, C> for Nodal<O> {
    fn name(&self) -> &'static str {
        if self.reduced { SchemeKind::Reduced } else { SchemeKind::Nodal }.name()
    }

    fn advance(
        &mut self,
        system: &S,
        _constraints: &C,
        step: SubStep,
        state: &mut State,
    ) -> Result<NewtonReport, StepError> {
        let Self { operators, reduced, newton, sub_steps, u, first, work } = self;
        state.history.fit(u.len(), *sub_steps, 0..0);
        state.compensation.balance.resize(u.len(), 0.0);
        step.open(&mut work.s, state);
        work.p.copy_from_slice(&state.p);
        work.carried.copy_from_slice(&state.compensation.balance);
        let last = state.memory.last.as_ref().zip(state.history.before(step.index));
        let last = last.filter(|_| *reduced).map(|(s, u)| LastStep { u, s });
        operators.begin(&work.s, &state.memory, last);
        if let Some(rates) = first.as_ref().filter(|_| state.step == 0 && step.index == 0) {
            let increment: Vec<f64> = rates.iter().map(|rate| step.h * rate).collect();
            state.history.remember(step.index, step.h, false, &increment);
        }
        let mut problem = Problem { system, operators, work };
        let report = solve_step(newton, &mut state.history, step, &mut problem, u)?;
        state.compensation.balance.copy_from_slice(newton.residual());
        operators.carry_balance(&mut state.compensation.balance);
        operators.remember(&mut state.memory);
        if *reduced {
            state.memory.keep(&work.s);
        }
        state.move_to_configuration(&work.s, |t, q| operators.clean(t, q));
        system.forced_d2(&work.s, &mut state.p);
        Ok(report)
    }

    fn interval(&self) -> &Interval {
        &self.work.s
    }

    fn interval_mut(&mut self) -> &mut Interval {
        &mut self.work.s
    }

    /// From the inverse, column by column: the operators may have no matrix. On closed loops the rows of
    /// their constraints count among those of the matrix.
    fn condition(&mut self, system: &S, _constraints: &C) -> Option<Condition> {
        let (d, s) = (self.u.len(), &self.work.s);
        let mixed = |out: &mut dyn Entries| system.forced_d2_d1(s, out);
        let mut inverse = DMatrix::identity(d, d);
        for column in inverse.as_mut_slice().chunks_exact_mut(d.max(1)) {
            self.operators.solve(&mixed, &self.u, s, column).ok()?;
        }
        Some(Condition::unscaled(condition_number(&inverse)))
    }
}
