//! Steps that are unstable about a steady rotation.

use serde::{Deserialize, Serialize};

/// A band of steps of which the linearization about the steady rotation is unstable; the step of
/// the model is in it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnstableSteps {
    /// Angular velocity of the steady rotation, rad/s.
    pub speed: f64,
    /// By how much a vibration grows in a step of the model, `max |z| − 1`.
    pub growth: f64,
    /// The shortest unstable step that was found, s; all between are unstable.
    pub shortest: f64,
    /// The longest, s.
    pub longest: f64,
}

impl UnstableSteps {
    /// What a warning says of it, with the remedy.
    pub(crate) fn warning(&self) -> String {
        let Self { speed, growth, shortest, longest } = self;
        format!(
            "the step is unstable: about the steady rotation of {} rad/s a vibration grows by the factor {:.4} in each step; so \
             it does in steps from {:.3e} s to {:.3e} s; write strain = \"mass_scaled\" or scheme = \"em-nodal\"",
            (1e6 * speed).round() / 1e6,
            1.0 + growth,
            shortest,
            longest
        )
    }
}
