//! How the end of a step answers the impulses at its start.
//!
//! ```text
//! W_s = sym (1/h) B A M (∂q_{n+1}/∂p̄_n) Bᵀ
//! ```
//! The derivative is that of the step that was solved last [2.37]: where `hω` is not small springs,
//! dampers and beams answer less than `W` says, and the outer iteration with `W` is slow. `A M`
//! takes the change of `q_{n+1}` for a tangent at `q_n`: impulses that change no velocity, as those
//! of a robot that stands on more feet than it needs, then have no response, as in `W`.

use super::active_rows::DENSE;
use super::impulses::NodeImpulses;
use super::stepping::Stepping;
use crate::constraints::Constraints;
use crate::discretization::{Discretization, ObserveNode};
use crate::scheme::{StepError, SubStep};
use vi_core::state::State;

/// After so many solutions of a step an iteration is slow if a change is more than this part of the
/// last one.
const PATIENCE: usize = 3;
const SLOW: f64 = 0.25;

impl NodeImpulses {
    /// Whether an iteration calls for the response of its step.
    pub(super) fn is_slow(pass: usize, change: f64, last: f64) -> bool {
        pass >= PATIENCE && change > SLOW * last
    }

    /// Gives it to the islands, where the last step has one; not with many rows, to which sparse
    /// rows belong.
    pub(super) fn respond<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        state: &State,
    ) -> Result<(), StepError> {
        let Self { p, rows, W, lambda, impacts, responses, problems, islands, .. } = self;
        if rows.len() > DENSE {
            return Ok(());
        }
        let n = state.q.len();
        p.copy_from_slice(&state.p);
        responses.clear();
        responses.resize(n * rows.len(), 0.0);
        for (i, response) in responses.chunks_exact_mut(n).enumerate() {
            rows.add_to(i, lambda[i] + impacts[i], p);
            rows.add_to(i, 1.0, response);
        }
        let s = run.scheme.interval();
        if run.observer.step_response(run.system, run.constraints, s, p, responses).is_err() {
            return Ok(());
        }
        for response in responses.chunks_exact_mut(n) {
            p.fill(0.0);
            run.system.add_momentum_of_step(state.configuration(), step.h, response, p);
            run.velocity(state, step.h, p, response)?;
            response.iter_mut().zip(W.at_rest()).for_each(|(v, own)| *v -= own);
        }
        for problem in problems.iter_mut().take(islands.count()) {
            problem.respond(rows, responses, n, step.h);
        }
        Ok(())
    }
}
