//! What can be said at a node, and of the step that starts there.
//!
//! ```text
//! H_n = ½ v_nᵀ M v_n + V(q_n),    p_n = M v_n
//! λ   of the step n → n+1: belongs to t_{n+1/2},    force Ḡᵀλ
//! residuals   g(q_n),   Ḡ Δq/h  (zero),   G(q_n) v_n  (O(h²))
//! ```
//! Redundant constraints: the force is unique, the multipliers are given in minimum-norm form.

use crate::em_system::EmSystem;
use crate::scheme::EmState;
use vi_constraints::Constraints;
use vi_constraints::node::minimum_norm;
use vi_constraints::saddle_point::IndependentRows;
use vi_core::interval::Interval;
use vi_core::linear::norm_inf;
use vi_core::sparse::{Entries, SparseMatrix};

/// Quantities of the node `n` and of the step to `n + 1`, all buffers sized once.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EmNode {
    /// `H_n`, J.
    pub energy: f64,
    /// `p_n = M v_n`, shape `n`.
    pub p: Vec<f64>,
    /// `λ` of the step, shape `m`; minimum norm when `G` is rank deficient.
    pub lambda_mid: Vec<f64>,
    /// `G(q_{n+1/2})ᵀ λ` of the step, N, shape `n`.
    pub constraint_force_mid: Vec<f64>,
    /// `|g(q_n)|_∞`.
    pub position_residual: f64,
    /// `|G(q_{n+1/2}) Δq/h|_∞` of the step.
    pub velocity_residual: f64,
    /// `|G(q_n) v_n|_∞`: the velocity is not quite tangential.
    pub momentum_residual: f64,
}

/// Computes [`EmNode`]s.
pub(crate) struct EmObserver {
    node: EmNode,
    jacobian: Option<SparseMatrix>, // m × n
    work: Vec<f64>,                 // m
}

impl EmObserver {
    /// For `n` coordinates and `m` constraints.
    pub(crate) fn new(n: usize, m: usize) -> Self {
        let zeros = |k: usize| vec![0.0; k];
        let (p, lambda_mid, constraint_force_mid) = (zeros(n), zeros(m), zeros(n));
        let node = EmNode { p, lambda_mid, constraint_force_mid, ..EmNode::default() };
        Self { node, jacobian: None, work: zeros(m) }
    }

    pub(crate) fn node(&self) -> &EmNode {
        &self.node
    }

    /// The node `state` with the step `s` that starts there and its multipliers `μ = h²λ`.
    pub(crate) fn observe(
        &mut self,
        (system, rows): (&EmSystem, &IndependentRows),
        constraints: &impl Constraints,
        state: &EmState,
        (s, mu): (&Interval, &[f64]),
    ) {
        let node = &mut self.node;
        node.energy = system.energy(&state.q, &state.v);
        node.p.fill(0.0);
        system.mass().mul_add(1.0, &state.v, &mut node.p);
        constraints.value(state.t, &state.q, &mut self.work);
        node.position_residual = norm_inf(&self.work);

        let jacobian = fill(&mut self.jacobian, constraints, (state.t, &state.q));
        self.work.fill(0.0);
        jacobian.mul_add(1.0, &state.v, &mut self.work);
        node.momentum_residual = norm_inf(&self.work);

        let jacobian = fill(&mut self.jacobian, constraints, (s.t_mid(), &s.q_mid));
        self.work.fill(0.0);
        jacobian.mul_add(1.0, &s.v_mid, &mut self.work);
        node.velocity_residual = norm_inf(&self.work);
        for (lambda, mu) in node.lambda_mid.iter_mut().zip(mu) {
            *lambda = mu / (s.h * s.h);
        }
        node.constraint_force_mid.fill(0.0);
        jacobian.tr_mul_add(1.0, &node.lambda_mid, &mut node.constraint_force_mid);
        if rows.len() < constraints.len() {
            minimum_norm(jacobian, rows, &mut node.lambda_mid);
        }
    }
}

fn fill<'a>(
    kept: &'a mut Option<SparseMatrix>,
    constraints: &impl Constraints,
    (t, q): (f64, &[f64]),
) -> &'a SparseMatrix {
    let emit = |out: &mut dyn Entries| constraints.jacobian(t, q, out);
    match kept {
        Some(jacobian) => jacobian.refill(emit),
        None => {
            *kept = Some(SparseMatrix::assemble(constraints.len(), constraints.dim(), emit));
        }
    }
    kept.as_ref().expect("just written")
}
