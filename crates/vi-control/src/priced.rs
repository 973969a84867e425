//! Conditions of an optimum as terms of a cost, each with its multiplier.
//!
//! ```text
//! V(θ) = min_x f(x; θ)  under  g(x; θ) = 0        dV/dθ = ∂f/∂θ + λᵀ ∂g/∂θ  at the optimum                     [2.67]
//! J = f + Σ_n κ_n c(q_n, v̂_n) + y·M v̂_N           along the run of its controls, which are held: dJ/dθ = dV/dθ
//! ```
//! `κ_n`: multipliers of conditions at nodes. `y = P(q_N) η`: the tangent that the multipliers `η`
//! of rest are. At rest `v̂_N = 0`, so that `P(q_N)ᵀ p̄_N` along `η` and `y·M v̂_N` change alike,
//! whatever `M` and `P` do.
//!
//! Source: A. V. Fiacco, Introduction to Sensitivity and Stability Analysis in Nonlinear
//! Programming (1983), chapter 3.

use crate::node::{Node, NodeQuantity, NodeSlopes};
use crate::objective::{CostTerm, NotedNode};
use vi_constraints::linearization::Costate;
use vi_core::linear::dot;
use vi_core::{Configuration, State};

/// `Σ_n κ_n c(node n)`, to be counted along a path by the trapezoidal rule.
pub struct AtNodes {
    term: Box<dyn CostTerm>,
    start: f64,
    step: f64,
    weights: Vec<f64>, // κ_n over the weight of the rule, 1/s
}

impl std::fmt::Debug for AtNodes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("AtNodes").field("weights", &self.weights).finish_non_exhaustive()
    }
}

impl AtNodes {
    /// A term of single nodes, `(n, κ_n)`, of a run of this many steps from a time, s.
    #[must_use]
    pub fn new(
        term: Box<dyn CostTerm>,
        (start, step, steps): (f64, f64, usize),
        prices: impl IntoIterator<Item = (usize, f64)>,
    ) -> Self {
        let mut weights = vec![0.0; steps + 1];
        for (n, price) in prices {
            let of_rule = if n == 0 || n == steps { 0.5 * step } else { step };
            weights[n] += price / of_rule;
        }
        Self { term, start, step, weights }
    }

    /// `κ_n` of the node at a time, s, over what the trapezoidal rule weighs it with.
    fn weight(&self, t: f64) -> f64 {
        let n = ((t - self.start) / self.step).round().max(0.0);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // a node of the run
        self.weights.get(n as usize).copied().unwrap_or(0.0)
    }
}

impl CostTerm for AtNodes {
    fn of_end(&self, node: &State) -> f64 {
        match self.weight(node.t) {
            0.0 => 0.0,
            weight => weight * self.term.of_end(node),
        }
    }
    fn add_of_end(&self, node: &State, scale: f64, out: &mut Costate) {
        match self.weight(node.t) {
            0.0 => (),
            weight => self.term.add_of_end(node, scale * weight, out),
        }
    }
    fn add_parameters_of_end(&self, node: &State, scale: f64, out: &mut [f64]) {
        match self.weight(node.t) {
            0.0 => (),
            weight => self.term.add_parameters_of_end(node, scale * weight, out),
        }
    }
    fn follow(&self, node: Configuration<'_>, seen: NotedNode) {
        self.term.follow(node, seen);
    }
}

/// `c·v̂` with constant `c`, shape `n`: at rest `c = M y` is the momentum along a tangent `y`.
#[derive(Clone, Debug, PartialEq)]
pub struct VelocityAlong(
    /// `c`, kg m or kg.
    pub Vec<f64>,
);

impl NodeQuantity for VelocityAlong {
    fn value(&self, node: Node<'_>) -> f64 {
        dot(&self.0, node.v)
    }
    fn add_slopes(&self, _node: Node<'_>, scale: f64, out: NodeSlopes<'_>) {
        out.v.iter_mut().zip(&self.0).for_each(|(out, c)| *out += scale * c);
    }
}
