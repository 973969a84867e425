//! What a macro step took.

/// Newton's work in one macro step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepReport {
    /// Iterations, summed over sub-steps.
    pub iterations: usize,
    /// Sub-steps.
    pub sub_steps: usize,
    /// Largest `|r|_∞` of the last evaluations ([`NewtonReport::residual`](vi_core::NewtonReport)).
    pub residual: f64,
    /// Initial guesses that failed.
    pub restarts: usize,
}
