//! The state of the future.

use crate::discrete_lagrangian::MechanicalSystem;
use crate::interval::Interval;
use serde::{Deserialize, Serialize};

/// Time, configuration and the momentum `p̄_n = D_2 L_d(q_{n-1}, q_n) + f_d^+` carried from the last
/// step (at the start: `p(0) = M v(0)`).
///
/// On a constrained system only `P(q_n)ᵀ p̄_n` decides the future; the part of `p̄_n` in `range Gᵀ`
/// is needed for `λ_n` and `p_n` at this node.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Number of steps taken.
    pub step: u64,
    /// `t_n`, s.
    pub t: f64,
    /// `q_n`, shape `n`.
    pub q: Vec<f64>,
    /// `p̄_n`, shape `n`.
    pub p: Vec<f64>,
}

impl State {
    /// Moves to the end of an interval that the step equation holds on: `q_{n+1}`, and
    /// `p̄_{n+1} = D_2 L_d(q_n, q_{n+1}) + f_d^+`.
    pub fn move_to_end(&mut self, system: &impl MechanicalSystem, s: &Interval) {
        self.q.copy_from_slice(&s.q1);
        system.forced_d2(s, &mut self.p);
        self.t = s.t_end();
        self.step += 1;
    }

    /// The start of a motion at time `t`.
    #[must_use]
    pub fn new(t: f64, q: Vec<f64>, p: Vec<f64>) -> Self {
        Self { step: 0, t, q, p }
    }
}
