//! What nodes cost by the steps beside them, in a sweep backward.
//!
//! ```text
//! ψ(q_n, v̂_n, λ_n),   λ_n = (h λ)/h of the step from the node      G μ = −(1/h) ∂ψ/∂λ     [2.38]
//! ψ(q_n, v̂_n, a_n),   a_n = (Δq_n − Δq_{n−1})/h²
//! ∂ψ/∂q_{n±1} = (1/h²) ∂ψ/∂a,   −(2/h²) ∂ψ/∂a in ∂ψ/∂q_n,   h ∂ψ/∂h = −2 a·∂ψ/∂a
//! ```

use crate::objective::{ByKnown, Known, NodePlace, Objective, Which};
use vi_constraints::linearization::Costate;
use vi_core::linear::dot;
use vi_core::state::State;

/// What a node costs by the steps beside it, with its derivatives.
#[derive(Debug)]
pub(crate) struct BackwardForces {
    pub(crate) cost: f64,
    pub(crate) by_step: f64, // by the length of all steps, times it
    pub(crate) own: Costate,
    pub(crate) by_force: Vec<f64>, // n  of the first and the last node, by forces there
    pub(crate) neighbours: Vec<f64>, // n  by the nodes on both sides
    lambda: Vec<f64>,              // m
    by_a: Vec<f64>,                // n
}

/// What the steps beside a node give.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepsBeside<'a> {
    /// `h λ` of the step from there, shape `m`, where that is known.
    pub(crate) impulse: Option<&'a [f64]>,
    /// `Δq` of the steps on both sides, shape `n`, where they are known.
    pub(crate) increments: Option<[&'a [f64]; 2]>,
    /// Their length, s.
    pub(crate) h: f64,
}

impl BackwardForces {
    pub(crate) fn zero(n: usize, m: usize, internal: usize) -> Self {
        let [by_force, neighbours, by_a] = [(); 3].map(|()| vec![0.0; n]);
        let (own, lambda) = (Costate::zero(n, internal), vec![0.0; m]);
        Self { cost: 0.0, by_step: 0.0, own, by_force, neighbours, lambda, by_a }
    }

    pub(crate) fn clear(&mut self) {
        (self.cost, self.by_step) = (0.0, 0.0);
        self.own.clear();
        self.by_force.fill(0.0);
        self.neighbours.fill(0.0);
    }

    /// Of a node with what the steps beside it give; `by_impulse ← ∂J/∂(hλ)` where multipliers are
    /// known, `by_end` takes `∂J/∂q_{n+1}`.
    pub(crate) fn find(
        &mut self,
        objective: &Objective,
        (node, at, which): (&State, NodePlace, Which),
        StepsBeside { impulse, increments, h }: StepsBeside<'_>,
        parameters: &mut [f64],
        [by_impulse, by_end]: [&mut [f64]; 2],
    ) {
        let Self { cost, by_step, own: of_state, by_force, neighbours, lambda, by_a } = self;
        let all = lambda.iter_mut().zip(impulse.unwrap_or_default());
        all.for_each(|(lambda, impulse)| *lambda = impulse / h);
        let a = increments.map(|own| acceleration(own, h));
        let known = Known { lambda: impulse.map(|_| &lambda[..]), a: a.as_deref() };
        by_a.fill(0.0);
        let by_known = ByKnown { lambda: &mut *by_impulse, a: &mut *by_a, force: by_force };
        let slopes = (&mut *of_state, by_known);
        let [own, along] = objective.steps().add_of((node, known), (at, which), slopes, parameters);
        *cost += own;
        *by_step += along; // the sources of a step are those at fixed λ
        by_impulse.iter_mut().for_each(|by| *by /= h);
        let Some(a) = a else { return };
        *by_step -= 2.0 * dot(&a, by_a);
        for (k, by) in by_a.iter().enumerate() {
            let by = by / (h * h);
            neighbours[k] += by;
            by_end[k] += by;
            of_state.q[k] -= 2.0 * by;
        }
    }

    /// Of the first or the last node, with the acceleration level.
    pub(crate) fn find_level(
        &mut self,
        objective: &Objective,
        node: &State,
        at: NodePlace,
        parameters: &mut [f64],
    ) {
        // multipliers of the last node are those of the step from there
        let which = if at.is_last { Which::OfAccelerations } else { Which::All };
        let level = StepsBeside { impulse: None, increments: None, h: 1.0 };
        self.find(objective, (node, at, which), level, parameters, [&mut [], &mut []]);
    }
}

/// `(Δq_n − Δq_{n−1})/h²` of the steps on both sides of a node.
pub(crate) fn acceleration([before, after]: [&[f64]; 2], h: f64) -> Vec<f64> {
    // as sensors of accelerations: quotients of each step first
    let pairs = before.iter().zip(after);
    pairs.map(|(before, after)| 2.0 * (after / h - before / h) / (h + h)).collect()
}
