//! What nodes cost by their multipliers, in a sweep backward.
//!
//! ```text
//! ψ(q_n, v̂_n, λ_n),   λ_n = (h λ)/h of the step from the node      G μ = −(1/h) ∂ψ/∂λ     [2.38]
//! ```

use crate::objective::{Objective, Place};
use vi_core::state::State;

/// What a node costs by its multipliers, with its derivatives.
#[derive(Debug)]
pub(crate) struct NodeForces {
    pub(crate) cost: f64,
    pub(crate) by_step: f64,       // by the length of all steps, times it
    pub(crate) q: Vec<f64>,        // n
    pub(crate) p: Vec<f64>,        // n
    pub(crate) by_force: Vec<f64>, // n  of the first node, by forces there
    lambda: Vec<f64>,              // m
}

impl NodeForces {
    pub(crate) fn zero(n: usize, m: usize) -> Self {
        let [q, p, by_force] = [(); 3].map(|()| vec![0.0; n]);
        Self { cost: 0.0, by_step: 0.0, q, p, by_force, lambda: vec![0.0; m] }
    }

    pub(crate) fn clear(&mut self) {
        (self.cost, self.by_step) = (0.0, 0.0);
        self.q.fill(0.0);
        self.p.fill(0.0);
    }

    /// Of a node with the impulse `h λ` of the step from there; `by_impulse ← ∂J/∂(hλ)`.
    pub(crate) fn find(
        &mut self,
        objective: &Objective,
        (node, at): (&State, Place),
        (impulse, h): (&[f64], f64),
        parameters: &mut [f64],
        by_impulse: &mut [f64],
    ) {
        let Self { cost, by_step, q, p, lambda, .. } = self;
        lambda.iter_mut().zip(impulse).for_each(|(lambda, impulse)| *lambda = impulse / h);
        let slopes = [&mut q[..], p, &mut *by_impulse];
        let [own, along] = objective.add_of_forces((node, lambda), at, slopes, parameters);
        *cost += own;
        *by_step += along; // the sources of a step are those at fixed λ
        by_impulse.iter_mut().for_each(|by| *by /= h);
    }

    /// Of the first node, with the multipliers of the acceleration level.
    pub(crate) fn find_first(
        &mut self,
        objective: &Objective,
        (node, at): (&State, Place),
        parameters: &mut [f64],
    ) {
        let Self { cost, by_step, q, p, by_force, .. } = self;
        by_force.fill(0.0);
        let slopes = [&mut q[..], p, by_force];
        let [own, along] = objective.add_of_forces((node, &[]), at, slopes, parameters);
        (*cost, *by_step) = (*cost + own, *by_step + along);
    }
}
