//! Scheme 4: the reduced variational scheme, LMO08 (30).
//!
//! ```text
//! r(u) = [∂F_d/∂u (u_{n-1}, q_{n-1})]ᵀ [p̄_n + D_1 L_d(q_n, F_d(u, q_n)) + f_d^-] = 0           (30)
//! ```
//! It puts `∂F_d/∂u` of the last step in the place of `P(q_n)`: its range is the tangent space at
//! `q_n` too, so the roots are those of the nodal scheme. Its first step has no last one and takes
//! `P(q_0)`.

use super::basis::Basis;
use crate::reparametrization::LastStep;
use crate::scheme::SubStep;
use vi_core::state::State;

/// `∂F_d/∂u (u_{n-1}, q_{n-1})`.
#[derive(Clone, Copy, Debug)]
pub struct OfLastStep;

impl Basis for OfLastStep {
    const REMEMBERS: bool = true;

    fn last<'a>(state: &'a State, step: &SubStep) -> Option<LastStep<'a>> {
        let last = state.memory.last.as_ref().zip(state.history.before(step.index));
        last.map(|(s, u)| LastStep { u, s }) // ∂F_d/∂u (u_{n-1}, q_{n-1})  (30)
    }
}
