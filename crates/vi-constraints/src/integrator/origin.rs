//! The time of nodes: counted, not summed.

use super::error::ResumeError;
use vi_core::state::State;

/// The node from which time is counted: `t_n = t + (n − step) h`, not the sum of rounded steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Origin {
    pub(super) t: f64, // s
    pub(super) step: u64,
}

impl Origin {
    /// `t_n`, s.
    pub(super) fn time(self, n: u64, h: f64) -> f64 {
        self.t + (n - self.step) as f64 * h
    }

    /// The origin after a motion continues from `next` instead of `present`.
    pub(super) fn resume(self, present: &State, next: &State, h: f64) -> Result<Self, ResumeError> {
        for (what, found, expected) in [
            ("q", next.q.len(), present.q.len()),
            ("p", next.p.len(), present.p.len()),
            ("v", next.v.len(), present.v.len()),
            ("the angles", next.angles.len(), present.angles.len()),
            ("the internal variables", next.internal.len(), present.internal.len()),
            ("the compensation of q", next.compensation.q.len(), present.compensation.q.len()),
            ("the compensation of v", next.compensation.v.len(), present.compensation.v.len()),
        ] {
            if found != expected {
                return Err(ResumeError::Shape { what, found, expected });
            }
        }
        let vectors = [&next.q, &next.p, &next.v, &next.angles, &next.internal];
        if !(next.t.is_finite() && vectors.iter().all(|x| x.iter().all(|x| x.is_finite()))) {
            return Err(ResumeError::NotFinite);
        }
        let counts =
            next.step >= self.step && self.time(next.step, h).to_bits() == next.t.to_bits();
        Ok(if counts { self } else { Self { t: next.t, step: next.step } })
    }
}
