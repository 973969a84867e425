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
    /// The step that resolves the rotation or the vibration for which the first of them was
    /// refused, s; `None` where there is none.
    #[serde(default)]
    pub resolving: Option<f64>,
}

impl DividedSteps {
    /// One more, that starts at `t` (s); `resolving`: the step that would do, asked of the first.
    pub(crate) fn add(&mut self, t: f64, parts: u32, resolving: Option<f64>) {
        if self.count == 0 {
            (self.first, self.resolving) = (t, resolving);
        }
        self.count += 1;
        self.most_parts = self.most_parts.max(parts);
    }

    /// What a summary says of them.
    pub(crate) fn warning(&self) -> Option<String> {
        let Self { count, most_parts, first, resolving } = self;
        let step = resolving.map_or_else(String::new, |step| format!(" to {step:.1e} s"));
        let steps = if *count == 1 { "step was" } else { "steps were" };
        (*count > 0).then(|| {
            format!(
                "{count} {steps} refused as a whole and taken in up to {most_parts} equal parts, first from t = {} s; where the \
                 energy error has to stay bounded, reduce the time step{step}",
                (1e6 * first).round() / 1e6
            )
        })
    }
}
