//! The equations (28) and (30) from the operators of a mechanism: `P(q_n)ᵀ`, `F_d` and the solution
//! ([`NodalOperators`]).

use super::basis::{AtNode, Basis};
use super::reduced::OfLastStep;
use crate::constraints::Constraints;
use crate::nodal::{Nodal, NodalEquations};
use crate::reparametrization::NodalOperators;
use crate::scheme::{Scheme, SchemeKind, SubStep};
use crate::unknowns::Increments;
use std::marker::PhantomData;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;
use vi_core::newton::{Fault, Newton, Precision, UnknownBlock};
use vi_core::sparse::Entries;
use vi_core::state::State;

/// The nodal scheme, or the reduced one, by operators over `n` coordinates; `rates`: see
/// [`ByOperators::starting_with`].
pub fn by_operators<S, C, O>(
    kind: SchemeKind,
    n: usize,
    operators: O,
    rates: Option<Vec<f64>>,
) -> Box<dyn Scheme<S, C>>
where
    S: DiscreteLagrangian + 'static,
    C: Constraints + 'static,
    O: NodalOperators + 'static,
{
    match kind {
        SchemeKind::Reduced => {
            Box::new(Nodal::new(Reduced::new(n, operators).starting_with(rates)))
        }
        _ => Box::new(Nodal::new(ByOperators::<O>::new(n, operators).starting_with(rates))),
    }
}

/// The nodal equations by operators.
#[derive(Debug)]
pub struct ByOperators<O, B = AtNode> {
    operators: O,
    increments: Increments,
    rates: Option<Vec<f64>>, // d  ν(0), where the first step cannot start from u = 0
    s: Interval,
    p: Vec<f64>,        // n  p̄_n
    residual: Vec<f64>, // n  p̄_n + D_1 L_d + f_d^-
    basis: PhantomData<B>,
}

/// The reduced equations by operators.
pub type Reduced<O> = ByOperators<O, OfLastStep>;

impl<O: NodalOperators, B: Basis> ByOperators<O, B> {
    /// For `n` coordinates.
    #[must_use]
    pub fn new(n: usize, operators: O) -> Self {
        let (s, zeros) = (Interval::new(n), |k: usize| vec![0.0; k]);
        Self {
            increments: Increments::new(operators.blocks().to_vec()),
            rates: None,
            s,
            p: zeros(n),
            residual: zeros(n),
            operators,
            basis: PhantomData,
        }
    }

    /// Newton's method of the first step starts from `h ν`: at a singular configuration `u = 0` is
    /// no initial guess.
    #[must_use]
    pub fn starting_with(mut self, rates: Option<Vec<f64>>) -> Self {
        self.rates = rates;
        self
    }
}

impl<S: DiscreteLagrangian, C: Constraints, O: NodalOperators, B: Basis> NodalEquations<S, C>
    for ByOperators<O, B>
{
    fn blocks(&self) -> &[UnknownBlock] {
        self.increments.blocks()
    }

    fn open(
        &mut self,
        system: &S,
        constraints: &C,
        step: SubStep,
        state: &mut State,
        carried: &mut [f64],
    ) {
        step.open(&mut self.s, state);
        system.prepare(&mut self.s);
        self.p.copy_from_slice(&state.p);
        let last = B::last(state, &step);
        self.increments.open(constraints, &state.q);
        self.operators.take_momentum(&state.p, step.h);
        self.operators.begin(&self.s, &state.memory, last); // P(q_n)
        self.operators.take_balance(carried);
        step.depart(self.rates.as_deref(), state);
    }

    fn advance(&mut self, _system: &S, constraints: &C, u: &[f64]) -> Result<(), Fault> {
        self.operators.reparametrize(u, &mut self.s)?;
        self.increments.reach(constraints, &self.s.q1);
        Ok(())
    }

    fn balance(&mut self, system: &S, _u: &[f64], r: &mut [f64]) {
        let Self { operators, s, p, residual, .. } = self;
        system.reach(s);
        system.forced_d1(s, residual);
        residual.iter_mut().zip(p).for_each(|(r, p)| *r += *p); // p̄_n + D_1 L_d + f_d^-
        operators.pull_back(residual, r);
    }

    fn close(&mut self, _constraints: &C, _u: &[f64], r: &mut [f64]) {
        self.operators.close(r);
    }

    fn solve(&mut self, system: &S, u: &[f64], x: &mut [f64]) -> Result<(), Fault> {
        let s = &self.s;
        self.operators.solve(&|out: &mut dyn Entries| system.forced_d2_d1(s, out), u, s, x)
    }

    fn finish(&mut self, system: &S, newton: &Newton, state: &mut State, _: &[f64]) {
        let Self { operators, s, .. } = self;
        state.compensation.balance.copy_from_slice(newton.residual());
        operators.carry_balance(&mut state.compensation.balance);
        state.memory.indices.clear();
        state.memory.values.clear();
        operators.remember(&mut state.memory);
        if B::REMEMBERS {
            state.memory.keep(s);
        }
        state.move_to_configuration(s, |t, q| operators.clean(t, q));
        state.move_momentum(system, s);
    }

    fn precision(&self) -> Precision {
        self.operators.precision()
    }

    fn rotation(&self, u: &[f64]) -> f64 {
        self.operators.rotation(u)
    }

    fn forget_factors(&mut self) {
        self.operators.forget_factors();
    }

    fn interval(&self) -> &Interval {
        &self.s
    }

    fn interval_mut(&mut self) -> &mut Interval {
        &mut self.s
    }
}
