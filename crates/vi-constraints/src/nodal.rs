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
//! No `u` in its format balances exactly; what is left of a balance belongs to the momentum `p̄_{n+1}` and is handed
//! to the next one. The momentum maps then change by what rounding makes of `q`, which is carried, too.
//!
//! The constraints hold by construction; no derivative of `P` appears; the condition number does not
//! depend on `h`. Written against [`NodalOperators`], so trees solve it in linear time.

use crate::reparametrization::NodalOperators;
use crate::scheme::{Condition, Scheme, SchemeKind, StepError, SubStep, solve_step};
use nalgebra::DMatrix;
use vi_core::discrete_lagrangian::MechanicalSystem;
use vi_core::interval::Interval;
use vi_core::linear::condition_number;
use vi_core::newton::{Block, Fault, Newton, NewtonProblem, NewtonReport, NewtonSettings};
use vi_core::predictor::Predictor;
use vi_core::state::State;

/// The nodal scheme, or with `reduced` the reduced variational scheme.
pub struct Nodal<O> {
    operators: O,
    reduced: bool,
    newton: Newton,
    predictor: Predictor,
    u: Vec<f64>,             // d
    last: Option<Vec<f64>>,  // d  u_{n-1}, when the last interval ends at the current node
    first: Option<Vec<f64>>, // d  ν(0), where the first step cannot start from u = 0
    work: Work,
}

struct Work {
    s: Interval,
    p: Vec<f64>,       // n  p̄_n
    bracket: Vec<f64>, // n  p̄_n + D_1 L_d + f_d^-
    left: Vec<f64>,    // d  what the last step has left of its balance
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
        lanes: usize,
    ) -> Self {
        let work = Work {
            s: Interval::new(n),
            p: vec![0.0; n],
            bracket: vec![0.0; n],
            left: vec![0.0; d],
        };
        let (newton, predictor) = (Newton::new(d, settings), Predictor::new(d, lanes));
        let u = vec![0.0; d];
        Self { operators, reduced, newton, predictor, u, last: None, first: None, work }
    }

    /// Newton's method of the first step starts from `h ν`: at a singular placement `u = 0` is no
    /// start value.
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

impl<S: MechanicalSystem, O: NodalOperators<S>> NewtonProblem for Problem<'_, S, O> {
    fn blocks(&self) -> &[Block] {
        self.operators.blocks()
    }

    fn residual(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        let work = &mut *self.work;
        self.operators.reparametrize(x, &mut work.s)?;
        self.system.forced_d1(&work.s, &mut work.bracket);
        for (b, p) in work.bracket.iter_mut().zip(&work.p) {
            *b += p;
        }
        self.operators.pull_back(&work.bracket, r); // (28)
        r.iter_mut().zip(&work.left).for_each(|(r, left)| *r += left);
        self.operators.close(r);
        Ok(())
    }

    fn correction(&mut self, x: &[f64], dx: &mut [f64]) -> Result<(), Fault> {
        self.operators.solve(self.system, x, &self.work.s, dx)
    }

    fn noise(&self) -> f64 {
        self.operators.noise()
    }
}

impl<S: MechanicalSystem, C, O: NodalOperators<S>> Scheme<S, C> for Nodal<O> {
    fn kind(&self) -> SchemeKind {
        if self.reduced { SchemeKind::Reduced } else { SchemeKind::Nodal }
    }

    fn advance(
        &mut self,
        system: &S,
        _constraints: &C,
        step: SubStep,
        state: &mut State,
    ) -> Result<NewtonReport, StepError> {
        let last = self.last.as_deref().filter(|_| self.reduced);
        // the tangent of the last step must be taken before its interval is overwritten
        let kept = last.is_some_and(|u| self.operators.keep_tangent(u, &self.work.s));
        step.open(&mut self.work.s, state.t, &state.q);
        self.work.p.copy_from_slice(&state.p);
        self.operators.begin(system, &self.work.s, kept);
        if let Some(rates) = self.first.as_ref().filter(|_| state.step == 0 && step.lane == 0) {
            let increment: Vec<f64> = rates.iter().map(|rate| step.h * rate).collect();
            self.predictor.remember(step.lane, step.h, &increment);
        }
        let mut problem = Problem { system, operators: &mut self.operators, work: &mut self.work };
        let (newton, predictor) = (&mut self.newton, &mut self.predictor);
        let solved = solve_step(newton, predictor, step, &mut problem, &mut self.u);
        let report = match solved {
            Ok(report) => report,
            Err(error) => {
                // neither the interval nor what was left belongs to the last step any more
                self.last = None;
                self.work.left.fill(0.0);
                return Err(error);
            }
        };
        if self.reduced {
            match &mut self.last {
                Some(last) => last.copy_from_slice(&self.u),
                None => self.last = Some(self.u.clone()),
            }
        }
        self.work.left.copy_from_slice(self.newton.residual());
        self.operators.keep_balance(&mut self.work.left);
        state.move_to_end(system, &self.work.s);
        self.operators.clean(state.t, &mut state.q);
        Ok(report)
    }

    fn interval(&self) -> &Interval {
        &self.work.s
    }

    /// From the inverse, column by column: the operators may have no matrix. On closed loops the rows of
    /// closure count among those of the matrix.
    fn condition(&mut self, system: &S, _constraints: &C) -> Option<Condition> {
        let d = self.u.len();
        let mut inverse = DMatrix::identity(d, d);
        for column in inverse.as_mut_slice().chunks_exact_mut(d.max(1)) {
            self.operators.solve(system, &self.u, &self.work.s, column).ok()?;
        }
        Some(Condition::unscaled(condition_number(&inverse)))
    }

    fn reset(&mut self) {
        self.predictor.clear();
        self.work.left.fill(0.0);
        self.last = None;
    }
}
