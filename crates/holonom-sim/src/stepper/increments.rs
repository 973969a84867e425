//! Accelerations of a node from the steps beside it.
//!
//! ```text
//! q̈_n = 2 (Δq_n/h_n − Δq_{n−1}/h_{n−1}) / (h_{n−1} + h_n)          of order 2 for equal steps
//! ```
//! The increments of the steps, not differences of coordinates: these are rounded by `ε|q|`, which
//! `1/h²` would enlarge.

use crate::run::run_state::{StepIncrement, same_length};
use vi_constraints::integrator::ResumeError;
use vi_core::Interval;

/// Increments of the last two steps.
#[derive(Debug)]
pub(super) struct LastIncrements {
    before: StepIncrement,
    last: StepIncrement,
}

impl LastIncrements {
    pub(super) fn new(n: usize) -> Self {
        let none = StepIncrement { dq: vec![0.0; n], h: 0.0 };
        Self { before: none.clone(), last: none }
    }

    /// A step begins.
    pub(super) fn begin(&mut self) {
        std::mem::swap(&mut self.before, &mut self.last);
        self.last.dq.fill(0.0);
        self.last.h = 0.0;
    }

    /// Adds a part of it.
    pub(super) fn add(&mut self, s: &Interval) {
        self.last.dq.iter_mut().zip(&s.dq).for_each(|(sum, dq)| *sum += dq);
        self.last.h += s.h;
    }

    /// It was refused.
    pub(super) fn take_back(&mut self) {
        std::mem::swap(&mut self.before, &mut self.last);
    }

    /// `out ←` the acceleration of the node that the last step started from; `false` where none
    /// ended there.
    pub(super) fn acceleration(&self, out: &mut Vec<f64>) -> bool {
        let [a, b] = [self.before.h, self.last.h];
        if a == 0.0 || b == 0.0 {
            return false;
        }
        let pairs = self.before.dq.iter().zip(&self.last.dq);
        out.clear();
        out.extend(pairs.map(|(before, last)| 2.0 * (last / b - before / a) / (a + b)));
        true
    }

    /// That of the last step.
    pub(super) fn state(&self) -> StepIncrement {
        self.last.clone()
    }

    /// Continues after a step.
    ///
    /// # Errors
    /// [`ResumeError::Shape`].
    pub(super) fn resume(&mut self, last: StepIncrement) -> Result<(), ResumeError> {
        same_length("the increment of a step", last.dq.len(), self.last.dq.len())?;
        self.last = last;
        Ok(())
    }
}
