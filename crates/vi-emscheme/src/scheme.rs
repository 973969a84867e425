//! The three equivalent forms of the energy–momentum scheme, and the end of a step.
//!
//! All of them advance the same state `(q_n, v_n) → (q_{n+1}, v_{n+1})` with
//! `v_{n+1} = (2/h) Δq − v_n`, and differ only in how `q_{n+1}` is found. Their trajectories agree
//! to solver tolerance.

use crate::em_system::{EmSystem, lag};
use vi_core::interval::Interval;
use vi_core::state::State;
use vi_core::{Composition, MechanicalSystem};

/// The sub-steps of a macro step, in parts of `h`: each `γ_j` of the composition as two steps of
/// `γ_j/2`; `[1]` without composition.
///
/// A single step turns the sign of the part of `v` that is not tangential, so it is no small change
/// of `(q, v)` and the conditions of order do not apply to it. Two equal steps turn it back: their
/// map is self-adjoint and close to the identity on all `(q, v)`, and its compositions have the
/// full order in `q` and `v`.
#[must_use]
pub fn sub_steps(composition: Composition) -> Vec<f64> {
    let gammas = composition.gammas();
    if gammas.len() == 1 {
        return gammas;
    }
    gammas.iter().flat_map(|gamma| [0.5 * gamma; 2]).collect()
}

/// Replaces the node by the end of a step; `v_0 = v(0)`, and later `v_n` is not in `null G(q_n)`,
/// but `O(h²)` off: `v_{n+1} = (2/h) Δq − v_n = v_n + 2 (Δq − h v_n)/h`, with the rounding error of
/// `Δq` where that is the unknown; `mu`: `h²λ` of the step; `clean(t, q)` may remove round-off from
/// `q_{n+1}`.
///
/// No `Δq` in its format balances the momentum exactly. In a steady rotation the errors have the
/// same sign at some steps `h`, up to 0.05 `ε` a step: `rounding` takes them out of the velocity.
pub(crate) fn advance_state(
    state: &mut State,
    system: &EmSystem,
    s: &Interval,
    mu: &[f64],
    rounding: Option<&[f64]>,
    clean: impl FnOnce(f64, &mut [f64]),
) {
    state.move_to_configuration(s, clean);
    for i in 0..state.v.len() {
        let (v, error) = (state.v[i], state.compensation.v[i]);
        let of_increment = rounding.map_or(0.0, |rounding| rounding[i]);
        let change = 2.0 * (lag(s.dq[i], s.h, v, error) + of_increment) / s.h + error;
        state.v[i] = v + change;
        state.compensation.v[i] = (v - state.v[i]) + change;
    }
    state.p.fill(0.0);
    system.mass().mul_add(1.0, &state.v, &mut state.p);
    state.memory.keep(s);
    state.memory.multipliers.clear();
    state.memory.multipliers.extend_from_slice(mu);
}
