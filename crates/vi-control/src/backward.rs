//! What nodes cost by the steps beside them, in a sweep backward.
//!
//! ```text
//! ψ(q_n, v̂_n, λ_n),   λ_n = (h λ)/h of the step from the node      G μ = −(1/h) ∂ψ/∂λ     [2.38]
//! ψ(q_n, v̂_n, a_n),   a_n = (Δq_n − Δq_{n−1})/h²
//! ∂ψ/∂q_{n±1} = (1/h²) ∂ψ/∂a,   −(2/h²) ∂ψ/∂a in ∂ψ/∂q_n,   h ∂ψ/∂h = −2 a·∂ψ/∂a
//! ```

use crate::objective::{Known, Objective, Place};
use vi_constraints::linearization::Costate;
use vi_core::linear::dot;
use vi_core::state::State;

/// What a node costs by the steps beside it, with its derivatives.
#[derive(Debug)]
pub(crate) struct NodeForces {
    pub(crate) cost: f64,
    pub(crate) by_step: f64, // by the length of all steps, times it
    pub(crate) own: Costate,
    pub(crate) by_force: Vec<f64>, // n  of the first and the last node, by forces there
    pub(crate) neighbours: Vec<f64>, // n  by the nodes on both sides
    lambda: Vec<f64>,              // m
}

impl NodeForces {
    pub(crate) fn zero(n: usize, m: usize, internal: usize) -> Self {
        let [by_force, neighbours] = [(); 2].map(|()| vec![0.0; n]);
        let (own, lambda) = (Costate::zero(n, internal), vec![0.0; m]);
        Self { cost: 0.0, by_step: 0.0, own, by_force, neighbours, lambda }
    }

    pub(crate) fn clear(&mut self) {
        (self.cost, self.by_step) = (0.0, 0.0);
        self.own.clear();
        self.by_force.fill(0.0);
        self.neighbours.fill(0.0);
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
        let Self { cost, by_step, own: of_state, lambda, .. } = self;
        lambda.iter_mut().zip(impulse).for_each(|(lambda, impulse)| *lambda = impulse / h);
        let (slopes, known) = ((of_state, &mut *by_impulse), Known::Multipliers(lambda));
        let [own, along] = objective.forces().add_of((node, known), at, slopes, parameters);
        *cost += own;
        *by_step += along; // the sources of a step are those at fixed λ
        by_impulse.iter_mut().for_each(|by| *by /= h);
    }

    /// Of a node with the increments `Δq` of the steps on both sides.
    pub(crate) fn find_acceleration(
        &mut self,
        objective: &Objective,
        (node, at): (&State, Place),
        (increments, h): ([&[f64]; 2], f64),
        parameters: &mut [f64],
    ) {
        let Self { cost, by_step, own: of_state, neighbours, .. } = self;
        let a = acceleration(increments, h);
        let (slopes, known) = ((&mut *of_state, &mut neighbours[..]), Known::Acceleration(&a));
        let [own, along] = objective.accelerations().add_of((node, known), at, slopes, parameters);
        *cost += own;
        *by_step += along - 2.0 * dot(&a, neighbours);
        neighbours.iter_mut().for_each(|by| *by /= h * h);
        of_state.q.iter_mut().zip(&*neighbours).for_each(|(q, by)| *q -= 2.0 * by);
    }

    /// Of the first or the last node, with the acceleration level.
    pub(crate) fn find_level(
        &mut self,
        objective: &Objective,
        (node, at): (&State, Place),
        parameters: &mut [f64],
    ) {
        let Self { cost, by_step, own: of_state, by_force, .. } = self;
        let forces = (!at.is_last).then_some(objective.forces()); // of the step from the last one
        for terms in forces.into_iter().chain([objective.accelerations()]) {
            let slopes = (&mut *of_state, &mut by_force[..]);
            let [own, along] = terms.add_of((node, Known::State), at, slopes, parameters);
            (*cost, *by_step) = (*cost + own, *by_step + along);
        }
    }
}

/// `(Δq_n − Δq_{n−1})/h²` of the steps on both sides of a node.
pub(crate) fn acceleration([before, after]: [&[f64]; 2], h: f64) -> Vec<f64> {
    // as sensors of accelerations: quotients of each step first
    let pairs = before.iter().zip(after);
    pairs.map(|(before, after)| 2.0 * (after / h - before / h) / (h + h)).collect()
}
