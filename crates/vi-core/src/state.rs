//! The state of a motion: all that its future depends on beside the model.

use crate::compensation::Compensation;
use crate::contact_state::ContactState;
use crate::discrete_lagrangian::DiscreteLagrangian;
use crate::interval::Interval;
use crate::predictor::IncrementHistory;
use serde::{Deserialize, Serialize};

/// Time, configuration and the momentum `p̄_n = D_2 L_d(q_{n-1}, q_n) + f_d^+` of the last step (at
/// the start: `p(0) = M v(0)`), and what finite precision and iterative solution add to them.
///
/// The bits of every later step are a function of the model and of the state: a state that was
/// written and read again continues the motion as if nothing had happened.
///
/// ```
/// use vi_core::State;
/// let start = State::new(0.0, vec![1.0], vec![0.5]); // t_0, q_0, p_0 = M v_0
/// assert_eq!((start.step, start.configuration().q), (0, &[1.0][..]));
/// ```
///
/// On a constrained system only `P(q_n)ᵀ p̄_n` determines the motion; the part of `p̄_n` in
/// `range Gᵀ` is needed for `λ_n` and `p_n` at this node.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Number of steps taken.
    pub step: u64,
    /// `t_n`, s.
    pub t: f64,
    /// `q_n`, shape `n`.
    pub q: Vec<f64>,
    /// `p̄_n`, shape `n`; `M v_n` in energy–momentum schemes.
    pub p: Vec<f64>,
    /// `v_n`, shape `n`, where it is a variable of the scheme (energy–momentum schemes); else
    /// empty.
    pub v: Vec<f64>,
    /// Unwrapped joint angles at `q_n`, rad; see [`crate::Configuration::angles`].
    pub angles: Vec<f64>,
    /// Internal variables at `q_n` of discrete forces with memory, then of a discrete potential;
    /// empty for most systems. See [`crate::force::DiscreteForce::advance`] and
    /// [`crate::potential::DiscretePotential::advance`].
    pub internal: Vec<f64>,
    /// Rounding errors that the next step takes into account.
    pub compensation: Compensation,
    /// Increments of the last steps, from which initial guesses are extrapolated.
    pub history: IncrementHistory,
    /// What a scheme needs of the last step beside its increments.
    pub memory: Memory,
    /// What contacts remember; empty without contacts.
    #[serde(default)]
    pub contacts: ContactState,
}

/// What a scheme needs of the last step beside its increments; empty for most.
///
/// The branch of a closed loop at a singular configuration, the independent constraints in use, the
/// basis of a tangent space: quantities that `q_n` alone does not determine.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// The last interval, for schemes that use derivatives at its end.
    pub last: Option<Interval>,
    /// Constraints or columns chosen.
    pub indices: Vec<usize>,
    /// Numbers that belong to them.
    pub values: Vec<f64>,
    /// `h²λ` of the last interval, shape `m`, for schemes whose nodes need it.
    pub multipliers: Vec<f64>,
    /// By how much the polynomials of the last steps missed the steps after them, for Galerkin
    /// schemes.
    #[serde(default)]
    pub misses: IncrementHistory,
}

impl Memory {
    /// Takes a copy of the last interval; allocates once.
    pub fn keep(&mut self, s: &Interval) {
        match &mut self.last {
            Some(last) => last.copy_from(s),
            none => *none = Some(s.clone()),
        }
    }

    /// Becomes a copy; allocates only when it grows.
    pub fn copy_from(&mut self, other: &Self) {
        match (&mut self.last, &other.last) {
            (Some(own), Some(other)) => own.copy_from(other),
            (own, other) => own.clone_from(other),
        }
        fn copy<T: Copy>(to: &mut Vec<T>, from: &Vec<T>) {
            to.clear();
            to.reserve(from.capacity());
            to.extend_from_slice(from);
        }
        copy(&mut self.indices, &other.indices);
        copy(&mut self.values, &other.values);
        copy(&mut self.multipliers, &other.multipliers);
        self.misses.copy_from(&other.misses);
    }
}

impl State {
    /// The start of a motion at time `t`.
    #[must_use]
    pub fn new(t: f64, q: Vec<f64>, p: Vec<f64>) -> Self {
        let compensation = Compensation { q: vec![0.0; q.len()], ..Compensation::default() };
        Self { t, q, p, compensation, ..Self::default() }
    }

    /// `(t_n, q_n)` with the angles.
    #[must_use]
    pub fn configuration(&self) -> crate::Configuration<'_> {
        crate::Configuration {
            t: self.t,
            q: &self.q,
            angles: &self.angles,
            internal: &self.internal,
        }
    }

    /// Opens a step of length `h` (s) here, with the angles, internal variables and compensation.
    pub fn open(&self, s: &mut Interval, h: f64) {
        s.open(self.t, h, &self.q);
        s.angles.extend_from_slice(&self.angles);
        s.internal.extend_from_slice(&self.internal);
        s.compensation.copy_from_slice(&self.compensation.q);
    }

    /// As [`State::open`], with [`Interval::open_start`].
    pub fn open_start(&self, s: &mut Interval, h: f64) {
        s.open_start(self.t, h, &self.q, &self.compensation.q);
        s.angles.extend_from_slice(&self.angles);
        s.internal.extend_from_slice(&self.internal);
    }

    /// Moves to the end of an interval that the step equation holds on: `q_{n+1}`, and
    /// `p̄_{n+1} = D_2 L_d(q_n, q_{n+1}) + f_d^+`.
    pub fn move_to_end(&mut self, system: &impl DiscreteLagrangian, s: &Interval) {
        self.move_to_configuration(s, |_, _| {});
        self.move_momentum(system, s);
    }

    /// `p̄_{n+1} = D_2 L_d(q_n, q_{n+1}) + f_d^+`, and the internal variables at `q_{n+1}`.
    pub fn move_momentum(&mut self, system: &impl DiscreteLagrangian, s: &Interval) {
        system.forced_d2(s, &mut self.p);
        system.advance_internal(s, &mut self.internal);
    }

    /// Moves time and configuration to the end of an interval, with the rounding error of
    /// `q_{n+1}`; `clean(t, q)` may remove round-off from it.
    pub fn move_to_configuration(&mut self, s: &Interval, clean: impl FnOnce(f64, &mut [f64])) {
        self.t = s.t_end();
        self.step += 1;
        self.q.copy_from_slice(&s.q1);
        clean(self.t, &mut self.q);
        s.rounding_error(&self.q, &mut self.compensation.q);
    }

    /// Becomes a copy of another state of the same motion; allocates only when that has grown.
    pub fn copy_from(&mut self, other: &Self) {
        (self.step, self.t) = (other.step, other.t);
        self.q.clone_from(&other.q);
        self.p.clone_from(&other.p);
        self.v.clone_from(&other.v);
        self.angles.clone_from(&other.angles);
        self.internal.clone_from(&other.internal);
        self.compensation.copy_from(&other.compensation);
        self.history.copy_from(&other.history);
        self.memory.copy_from(&other.memory);
        self.contacts.copy_from(&other.contacts);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn increments_add_up_to_the_last_digit() {
        let (mut s, mut state) = (Interval::new(1), State::new(0.0, vec![0.7], vec![0.0]));
        for _ in 0..100_000 {
            state.open(&mut s, 0.1);
            s.dq[0] = 1e-7 / 3.0;
            s.close_from_increment();
            state.q.copy_from_slice(&s.q1);
            s.rounding_error(&state.q, &mut state.compensation.q);
        }
        let off = (state.q[0] - (0.7 + 1e-2 / 3.0)).abs();
        println!("after 100000 increments off by {off:.1e}");
        assert!(off <= f64::EPSILON, "{off:e}");
        s.open(0.0, 0.1, &[5.0]);
        s.close_from_increment();
        assert_eq!(s.q1, [5.0], "another motion starts without compensation");
    }
}
