//! A motion in steps, and its steps in the sub-steps of a composition or by the control points of a
//! Galerkin scheme.
//!
//! ```text
//! h_k = γ_i h,   t_k = t(0) + (n + Σ_{j<i} γ_j) h        k = n s + i,  i = 0 … s−1,  n = 0 … N−1    [2.20]
//! t_k = t(0) + (n + c̃_i) h                              control points at Lobatto nodes            [2.25]
//! ```
//! Nodes are all of these, from 0 to `N s`; those where steps meet are every `s`-th one. A piece is
//! what couples neighbours: a sub-step two nodes, a Galerkin step `s + 1`.

use vi_constraints::OrderMethod;
use vi_core::galerkin::GaussLobatto;

/// The nodes of a motion.
#[derive(Clone, Debug)]
pub(super) struct Division {
    /// Lengths of the pieces of a step, in parts of it.
    gammas: Vec<f64>,
    /// Of each node of a step but the last, in parts of it.
    starts: Vec<f64>,
    steps: usize,
    span: usize,
    /// Of Galerkin steps.
    pub(super) constants: Option<GaussLobatto>,
}

impl Division {
    /// Of `steps` steps.
    pub(super) fn new(method: OrderMethod, steps: usize) -> Self {
        let gammas = method.composition().gammas();
        let constants = method.stages().map(GaussLobatto::new);
        let starts: Vec<f64> = match &constants {
            Some(own) => own.nodes[..own.stages()].to_vec(),
            None => (0..gammas.len()).map(|i| gammas[..i].iter().sum()).collect(),
        };
        let span = starts.len() / gammas.len();
        Self { gammas, starts, steps, span, constants }
    }

    /// `N s`: the last node.
    pub(super) fn last(&self) -> usize {
        self.steps * self.each()
    }

    /// `s`: nodes of a step but the last.
    pub(super) fn each(&self) -> usize {
        self.starts.len()
    }

    /// From the first to the last node of a piece.
    pub(super) fn span(&self) -> usize {
        self.span
    }

    /// How many pieces there are.
    pub(super) fn pieces(&self) -> usize {
        self.steps * self.gammas.len()
    }

    /// The pieces at a node, each with the number that the node has in it.
    pub(super) fn pieces_at(&self, node: usize) -> impl Iterator<Item = (usize, usize)> {
        let (piece, own) = (node / self.span, node % self.span);
        let before = (own == 0).then(|| piece.checked_sub(1)).flatten();
        let before = before.map(|piece| (piece, self.span));
        before.into_iter().chain((piece < self.pieces()).then_some((piece, own)))
    }

    /// The length of a piece, in steps.
    pub(super) fn gamma(&self, piece: usize) -> f64 {
        self.gammas[piece % self.gammas.len()]
    }

    /// The step that a piece is of.
    pub(super) fn step_of(&self, piece: usize) -> usize {
        piece / self.gammas.len()
    }

    /// The step that a node, or what begins there, is of.
    pub(super) fn step(&self, node: usize) -> usize {
        node / self.each()
    }

    /// The node where step `n` starts.
    pub(super) fn node(&self, n: usize) -> usize {
        n * self.each()
    }

    /// The step that starts at a node; `None` within one.
    pub(super) fn starting(&self, node: usize) -> Option<usize> {
        node.is_multiple_of(self.each()).then(|| self.step(node))
    }

    /// What is of a node or begins there: by the number of the step, within it also by its own.
    pub(super) fn name(&self, what: &str, node: usize) -> String {
        let (step, own) = (self.step(node), node % self.each());
        match (self.each(), self.span) {
            (1, _) => format!("{what} {step}"),
            (_, 1) => format!("{what} {step}, sub-step {own}"),
            _ => format!("{what} {step}, control point {own}"),
        }
    }

    /// The weights of nodes in an integral by the trapezoidal rule over whole steps, or over the
    /// sub-steps within them, in parts of a step.
    pub(super) fn trapezoids(&self, within: bool) -> Vec<(usize, f64)> {
        let lengths: &[f64] = if within { &self.gammas } else { &[1.0] };
        let (count, span) = (self.steps * lengths.len(), self.each() / lengths.len());
        let half = |part: usize| 0.5 * lengths[part % lengths.len()];
        let weight = |k: usize| {
            let before = k.checked_sub(1).map_or(0.0, half);
            (k * span, if k < count { before + half(k) } else { before })
        };
        (0..=count).map(weight).collect()
    }

    /// `(t_k − t(0))/h`.
    pub(super) fn time(&self, node: usize) -> f64 {
        self.step(node) as f64 + self.starts[node % self.each()]
    }
}
