//! What can be said at a node, and of the step that starts there.
//!
//! ```text
//! H_n = ½ v_nᵀ M v_n + V(q_n),    p_n = M v_n
//! λ_{n+1/2}   of the step n → n+1,    force Ḡᵀ λ_{n+1/2}
//! λ_n         = ½ (λ_{n-1/2} + λ_{n+1/2}),    force likewise
//! residuals   g(q_n),   Ḡ Δq/h  (zero; rheonomic: Δg/h),   G(q_n) v_n + ∂g/∂t  (O(h²))
//! ```
//! *Order of the multipliers.* `v_{n+1} = (2/h)Δq − v_n` turns the sign of the part of `v_n` that is not
//! tangential; a start with `G(q_0) v(0) = 0` misses the smooth solution there by `O(h²)`, so this part
//! alternates from node to node for ever, and `λ_{n+1/2} ~ M(v_{n+1} − v_n)/h` with it, by `O(h)`: order
//! 1 by itself, unless the start is at rest. The mean of two neighbours does not see the alternation: it
//! belongs to the node and has order 2, as `q_n` and `p_n` have.
//!
//! Redundant constraints: the force is unique, the multipliers are given in minimum-norm form.

use crate::constraint::DiscreteConstraints;
use crate::em_system::EmSystem;
use vi_constraints::projection::minimum_norm;
use vi_constraints::saddle_point::IndependentRows;
use vi_core::interval::Interval;
use vi_core::linear::norm_inf;
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::state::State;

/// Quantities of the node `n` and of the step to `n + 1`, all buffers sized once.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EmNode {
    /// `H_n`, J.
    pub energy: f64,
    /// `p_n = M v_n`, shape `n`.
    pub p: Vec<f64>,
    /// `λ_n`, mean of the steps before and after the node (order 2); at the start that of the step
    /// after it. Shape `m`; minimum norm when `G` is rank deficient.
    pub lambda: Vec<f64>,
    /// The constraint force of `λ_n`, N, shape `n`; at the start that of the step after it.
    pub constraint_force: Vec<f64>,
    /// `λ_{n+1/2}` of the step, shape `m`; minimum norm when `G` is rank deficient.
    pub lambda_mid: Vec<f64>,
    /// `Ḡᵀ λ` of the step, N, shape `n`.
    pub constraint_force_mid: Vec<f64>,
    /// `|g(q_n)|_∞`.
    pub position_residual: f64,
    /// `|Ḡ Δq/h|_∞` of the step; for rheonomic constraints `|Δg/h|_∞`.
    pub velocity_residual: f64,
    /// `|G(q_n) v_n + ∂g/∂t|_∞`: the velocity is not quite tangential.
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
        let node = EmNode {
            p: zeros(n),
            lambda: zeros(m),
            constraint_force: zeros(n),
            lambda_mid: zeros(m),
            constraint_force_mid: zeros(n),
            ..EmNode::default()
        };
        Self { node, jacobian: None, work: zeros(m) }
    }

    pub(crate) fn node(&self) -> &EmNode {
        &self.node
    }

    /// What the node `state` says by itself: energy, momentum, residuals; no multipliers.
    pub(crate) fn observe_state(
        &mut self,
        system: &EmSystem,
        constraints: &impl DiscreteConstraints,
        state: &State,
    ) {
        let node = &mut self.node;
        node.energy = system.energy(state.configuration(), &state.v);
        node.p.fill(0.0);
        system.mass().mul_add(1.0, &state.v, &mut node.p);
        constraints.value(state.configuration(), &mut self.work);
        node.position_residual = norm_inf(&self.work);

        let shape = (constraints.len(), constraints.dim());
        let emit = |out: &mut dyn Entries| constraints.jacobian(state.t, &state.q, out);
        let jacobian = SparseMatrix::update(&mut self.jacobian, shape, emit);
        constraints.time_derivative(state.t, &state.q, &mut self.work);
        jacobian.mul_add(1.0, &state.v, &mut self.work);
        node.momentum_residual = norm_inf(&self.work);
        node.velocity_residual = node.momentum_residual;
    }

    /// The node `state`, which remembers the step before, with the step `s` that starts there and its
    /// multipliers `μ = h²λ`.
    pub(crate) fn observe(
        &mut self,
        (system, rows): (&EmSystem, &IndependentRows),
        constraints: &impl DiscreteConstraints,
        state: &State,
        (s, mu): (&Interval, &[f64]),
    ) {
        let before = state.memory.last.as_ref();
        self.observe_state(system, constraints, state);
        let shape = (constraints.len(), constraints.dim());
        let node = &mut self.node;
        let scale = 1.0 / (s.h * s.h);
        let (lambda, force) = (&mut node.lambda, &mut node.constraint_force);
        if let Some(before) = before {
            let emit = |out: &mut dyn Entries| constraints.discrete_jacobian(before, out);
            let jacobian = SparseMatrix::update(&mut self.jacobian, shape, emit);
            multipliers(jacobian, rows, (&state.memory.multipliers, scale), lambda, force);
        }
        let emit = |out: &mut dyn Entries| constraints.discrete_jacobian(s, out);
        let jacobian = SparseMatrix::update(&mut self.jacobian, shape, emit);
        if constraints.is_rheonomic() {
            constraints.value(s.end(), &mut self.work);
            node.velocity_residual = norm_inf(&self.work) / s.h.abs();
        } else {
            self.work.fill(0.0);
            jacobian.mul_add(1.0, &s.v_mid, &mut self.work);
            node.velocity_residual = norm_inf(&self.work);
        }
        let (lambda_mid, force_mid) = (&mut node.lambda_mid, &mut node.constraint_force_mid);
        multipliers(jacobian, rows, (mu, scale), lambda_mid, force_mid);
        if before.is_some() {
            lambda.iter_mut().zip(lambda_mid).for_each(|(a, b)| *a = 0.5 * (*a + *b));
            force.iter_mut().zip(force_mid).for_each(|(a, b)| *a = 0.5 * (*a + *b));
        } else {
            lambda.copy_from_slice(lambda_mid);
            force.copy_from_slice(force_mid);
        }
    }
}

/// `λ = scale μ`, in minimum-norm form where rows are redundant, and `Gᵀλ`.
fn multipliers(
    jacobian: &SparseMatrix,
    rows: &IndependentRows,
    (mu, scale): (&[f64], f64),
    lambda: &mut [f64],
    force: &mut [f64],
) {
    for (lambda, mu) in lambda.iter_mut().zip(mu) {
        *lambda = scale * mu;
    }
    force.fill(0.0);
    jacobian.tr_mul_add(1.0, lambda, force);
    if rows.len() < lambda.len() {
        minimum_norm(jacobian, rows.len(), lambda);
    }
}
