//! Steps that were taken in smaller parts, because a whole one was refused.

use serde::{Deserialize, Serialize};

/// How many steps were divided, and how far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DividedSteps {
    /// Steps that were divided.
    pub count: u64,
    /// Parts of the step that was divided most.
    pub most_parts: u32,
    /// Time at which the first of them starts, s.
    pub first: f64,
}

impl DividedSteps {
    /// One more, that starts at `t` (s).
    pub(crate) fn add(&mut self, t: f64, parts: u32) {
        if self.count == 0 {
            self.first = t;
        }
        self.count += 1;
        self.most_parts = self.most_parts.max(parts);
    }

    /// What a summary says of them.
    pub(crate) fn warning(&self) -> Option<String> {
        let Self { count, most_parts, first } = self;
        let steps = if *count == 1 { "step was" } else { "steps were" };
        (*count > 0).then(|| {
            format!(
                "{count} {steps} refused as a whole and taken in up to {most_parts} equal parts, first from t = {} s; where the \
                 energy error has to stay bounded, reduce the time step",
                (1e6 * first).round() / 1e6
            )
        })
    }
}
