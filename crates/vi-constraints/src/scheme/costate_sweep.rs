//! Costates pulled back over the steps of a motion, by whatever solves with the transposed matrix.
//!
//! ```text
//! a_n = dJ/dq_n,   b_n = dJ/dp̄_n           from those of n + 1, step by step [2.38]
//! ```
//! [`StepLinearization`] solves with the saddle-point matrix of any constraints. What knows the
//! structure of a mechanism may hold another momentum `p̃_n` than `p̄_n` while `q_n` is varied: one
//! without what acts along unknowns of a step, as long as it is held at every node but the first,
//! where the two are one.

use crate::constraints::Constraints;
use crate::design::Costates;
use crate::linearization::{Costate, StepLinearization};
use crate::saddle_point::IndependentRows;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;
use vi_core::linear::Singular;

/// Pulls costates back.
pub trait CostateSweep<S, C> {
    /// `out ←` the momentum `p̃_{n+1}` that is held at the end of a step, shape `n`.
    fn momentum(&self, system: &S, s: &Interval, out: &mut [f64]);

    /// Makes `a`, the derivative by `q_N` with `p̄_N` held, one with `p̃_N` held; `s`: the last
    /// step.
    fn hold(&mut self, system: &S, s: &Interval, costate: &mut Costate);

    /// Replaces the costate at the end of the step, derivatives by `q_{n+1}` included that only
    /// this step has, by that at its start; `p`: `p̃_n`. `a` along [`Tangents`].
    ///
    /// # Errors
    /// [`Singular`].
    fn pull(
        &mut self,
        system: &S,
        constraints: &C,
        s: &Interval,
        p: &[f64],
        costate: &mut Costate,
    ) -> Result<(), Singular>;

    /// The costates of the last step; those of rows count with [`Tangents::OfBodies`].
    fn costates(&self) -> Costates<'_>;

    /// `h λ` of the last step, shape `m`; it counts with [`Tangents::OfBodies`].
    fn impulse(&self) -> &[f64];
}

/// Makes the sweep of a mechanism with these independent constraints; `None` where its structure
/// offers none that is faster.
pub type CostateChoice<S, C> =
    fn(&S, &C, &IndependentRows, Tangents) -> Option<Box<dyn CostateSweep<S, C>>>;

/// Along which changes of a configuration costates count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tangents {
    /// `G δq = 0`.
    OfMechanism,
    /// Any of rigid bodies, as where a parameter moves constraints: `a` is then a derivative along
    /// all of them, and the multipliers and costates of all rows between bodies are found.
    OfBodies,
}

impl<S: DiscreteLagrangian, C: Constraints> CostateSweep<S, C> for StepLinearization {
    fn momentum(&self, system: &S, s: &Interval, out: &mut [f64]) {
        system.forced_d2(s, out);
    }

    fn hold(&mut self, _: &S, _: &Interval, _: &mut Costate) {}

    fn pull(
        &mut self,
        system: &S,
        constraints: &C,
        s: &Interval,
        p: &[f64],
        costate: &mut Costate,
    ) -> Result<(), Singular> {
        self.linearize(system, constraints, s, p)?;
        self.pull(system, constraints, s, costate)
    }

    fn costates(&self) -> Costates<'_> {
        self.costates()
    }

    fn impulse(&self) -> &[f64] {
        self.impulse()
    }
}
