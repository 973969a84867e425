//! In which basis of the tangent space at `q_n` momenta are balanced: `P(q_n)` (28), or
//! `∂F_d/∂u` of the last step (30).

use crate::reparametrization::LastStep;
use crate::scheme::SubStep;
use vi_core::state::State;

/// In which basis of the tangent space at `q_n` momenta are balanced.
pub trait Basis: Send {
    /// Whether a step is remembered for the next one.
    const REMEMBERS: bool;
    /// The last step, whose `∂F_d/∂u` takes the place of `P(q_n)`.
    fn last<'a>(state: &'a State, step: &SubStep) -> Option<LastStep<'a>>;
}

/// `P(q_n)`, LMO08 (28).
#[derive(Clone, Copy, Debug)]
pub struct AtNode;

impl Basis for AtNode {
    const REMEMBERS: bool = false;

    fn last<'a>(_: &'a State, _: &SubStep) -> Option<LastStep<'a>> {
        None
    }
}
