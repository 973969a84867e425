//! The steps of a motion, each taken in the sub-steps of a composition.
//!
//! ```text
//! h_k = γ_i h,   t_k = t(0) + (n + Σ_{j<i} γ_j) h        k = n s + i,  i = 0 … s−1,  n = 0 … N−1    [2.20]
//! ```
//! Nodes are those of sub-steps, from 0 to `N s`; those of the steps are every `s`-th one.

use vi_core::Composition;

/// The sub-steps of a motion.
#[derive(Clone, Debug)]
pub(super) struct SubSteps {
    gammas: Vec<f64>,
    starts: Vec<f64>, // of each sub-step of a step, in parts of it
    steps: usize,
}

impl SubSteps {
    /// Of `steps` steps by a composition.
    pub(super) fn new(composition: Composition, steps: usize) -> Self {
        let gammas = composition.gammas();
        let start = |i: usize| gammas[..i].iter().sum();
        let starts = (0..gammas.len()).map(start).collect();
        Self { gammas, starts, steps }
    }

    /// `N s`: how many there are, and the last node.
    pub(super) fn count(&self) -> usize {
        self.steps * self.each()
    }

    /// `s`.
    pub(super) fn each(&self) -> usize {
        self.gammas.len()
    }

    /// `h_k/h`.
    pub(super) fn gamma(&self, k: usize) -> f64 {
        self.gammas[k % self.each()]
    }

    /// The step that a sub-step is of.
    pub(super) fn step(&self, k: usize) -> usize {
        k / self.each()
    }

    /// The node where step `n` starts.
    pub(super) fn node(&self, n: usize) -> usize {
        n * self.each()
    }

    /// The step that starts at a node; `None` within one.
    pub(super) fn starting(&self, k: usize) -> Option<usize> {
        k.is_multiple_of(self.each()).then(|| self.step(k))
    }

    /// What is of a node or a sub-step: by the number of the step, within it also by its own.
    pub(super) fn name(&self, what: &str, k: usize) -> String {
        let (step, own) = (self.step(k), k % self.each());
        match self.each() {
            1 => format!("{what} {step}"),
            _ => format!("{what} {step}, sub-step {own}"),
        }
    }

    /// `(t_k − t(0))/h`.
    pub(super) fn time(&self, k: usize) -> f64 {
        self.step(k) as f64 + self.starts[k % self.each()]
    }
}
