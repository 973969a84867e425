//! Scheme 3: d'Alembert with nodal reparametrization, LMO08 (28).
//!
//! ```text
//! r(u) = P(q_n)ᵀ [p̄_n + D_1 L_d(q_n, F_d(u, q_n)) + f_d^-] = 0,    q_{n+1} = F_d(u, q_n)     (28)
//! Dr   = P(q_n)ᵀ D_2(D_1 L_d + f_d^-) ∂F_d/∂u
//! ```
//! The rounding error of the momentum balance is carried to the next step, as is that of `q`
//! (compensated stepping, [`vi_core::compensation`]).
//!
//! The constraints hold by construction; no derivative of `P` appears; the condition number does
//! not depend on `h`. How `F_d`, `Pᵀ` and the solution are computed is known to the
//! [`NodalEquations`] of a mechanism: trees in sweeps over their links, others by operators
//! ([`crate::nodal_operators`]).

use crate::scheme::{ConditionNumbers, Scheme, StepError, SubStep};
use vi_core::interval::Interval;
use vi_core::newton::{Fault, Newton, Precision, UnknownBlock};
use vi_core::state::State;

/// The equations (28) of a mechanism in its unknowns `u`.
///
/// Call order within a step: `open`, then for each iteration `advance`, `balance`, `close`,
/// `solve`; `finish` when the step is taken.
pub trait NodalEquations<S, C>: Send {
    /// Units and scales of the unknowns; together the blocks cover all of them.
    fn blocks(&self) -> &[UnknownBlock];
    /// Opens a step at a state: all that depends on `P(q_n)` alone. `carried`: what the last step
    /// has left of its balance, which is written in the basis of this one.
    fn open(
        &mut self,
        system: &S,
        constraints: &C,
        step: SubStep,
        state: &mut State,
        carried: &mut [f64],
    );
    /// `q_{n+1} = F_d(u, q_n)`.
    ///
    /// # Errors
    /// [`Fault`] when `u` is outside the domain of the map.
    fn advance(&mut self, system: &S, constraints: &C, u: &[f64]) -> Result<(), Fault>;
    /// `r ← P(q_n)ᵀ [p̄_n + D_1 L_d + f_d^-]` at the increments of [`NodalEquations::advance`].
    fn balance(&mut self, system: &S, u: &[f64], r: &mut [f64]);
    /// Where `u` has to close loops, too, their constraints take the place of as many balances.
    fn close(&mut self, _constraints: &C, _u: &[f64], _r: &mut [f64]) {}
    /// `x ← (∂r/∂u)⁻¹ x` at the increments of the last balance.
    ///
    /// # Errors
    /// [`Fault::SingularTangent`].
    fn solve(&mut self, system: &S, u: &[f64], x: &mut [f64]) -> Result<(), Fault>;
    /// Takes `u` as the solution without its balance; `false` where that is needed.
    ///
    /// # Errors
    /// [`Fault`] when `u` is outside the domain of the map.
    fn settle(&mut self, _system: &S, _u: &[f64]) -> Result<bool, Fault> {
        Ok(false)
    }
    /// Moves the state to the end of the step, with what is left of the balance; `carried`: what
    /// was left by the step before.
    fn finish(&mut self, system: &S, newton: &Newton, state: &mut State, carried: &[f64]);
    /// How exactly they can be solved.
    fn precision(&self) -> Precision;
    /// See [`vi_core::newton::NewtonProblem::rotation`].
    fn rotation(&self, _u: &[f64]) -> f64 {
        0.0
    }
    /// The next correction is one by the matrix of its own iterate.
    fn forget_factors(&mut self) {}
    /// The interval of the last step.
    fn interval(&self) -> &Interval;
    /// The same, to put back the one before a trial step.
    fn interval_mut(&mut self) -> &mut Interval;
}

/// The nodal scheme.
#[derive(Debug)]
pub struct Nodal<E> {
    equations: E,
    carried: Vec<f64>, // d  rounding error of the last momentum balance
}

impl<E> Nodal<E> {
    /// Of the equations of a mechanism.
    #[must_use]
    pub fn new(equations: E) -> Self {
        Self { equations, carried: Vec::new() }
    }
}

impl<S, C, E: NodalEquations<S, C>> Scheme<S, C> for Nodal<E> {
    fn blocks(&self) -> &[UnknownBlock] {
        self.equations.blocks()
    }

    fn begin(&mut self, system: &S, constraints: &C, step: SubStep, state: &mut State) {
        if self.carried.is_empty() {
            let blocks = self.equations.blocks().iter();
            self.carried.resize(blocks.map(|block| block.range.end).max().unwrap_or(0), 0.0);
        }
        state.compensation.open_balance(&mut self.carried);
        self.equations.open(system, constraints, step, state, &mut self.carried);
    }

    fn residual(
        &mut self,
        system: &S,
        constraints: &C,
        u: &[f64],
        r: &mut [f64],
    ) -> Result<(), Fault> {
        let Self { equations, carried } = self;
        equations.advance(system, constraints, u)?; // q_{n+1} = F_d(u, q_n)  (27)
        equations.balance(system, u, r); // P(q_n)ᵀ [p̄_n + D_1 L_d + f_d^-]  (28)
        r.iter_mut().zip(carried).for_each(|(r, error)| *r += *error);
        equations.close(constraints, u, r);
        Ok(())
    }

    fn settle(
        &mut self,
        system: &S,
        constraints: &C,
        u: &[f64],
        r: &mut [f64],
    ) -> Result<(), Fault> {
        match self.equations.settle(system, u)? {
            true => Ok(()),
            false => self.residual(system, constraints, u, r),
        }
    }

    fn correction(&mut self, system: &S, _: &C, u: &[f64], du: &mut [f64]) -> Result<(), Fault> {
        self.equations.solve(system, u, du)
    }

    fn precision(&self) -> Precision {
        self.equations.precision()
    }

    fn rotation(&self, u: &[f64]) -> f64 {
        self.equations.rotation(u)
    }

    fn end(
        &mut self,
        system: &S,
        _: &C,
        newton: &Newton,
        state: &mut State,
    ) -> Result<(), StepError> {
        self.equations.finish(system, newton, state, &self.carried);
        Ok(())
    }

    fn interval(&self) -> &Interval {
        self.equations.interval()
    }

    fn interval_mut(&mut self) -> &mut Interval {
        self.equations.interval_mut()
    }

    /// From the inverse, column by column: the equations may have no matrix. On closed loops the
    /// rows of their constraints count among those of the matrix.
    fn condition(&mut self, system: &S, constraints: &C, u: &[f64]) -> Option<ConditionNumbers> {
        self.residual(system, constraints, u, &mut vec![0.0; u.len()]).ok()?;
        ConditionNumbers::of_inverse(u.len(), |column| {
            self.equations.forget_factors();
            self.equations.solve(system, u, column)
        })
    }
}
