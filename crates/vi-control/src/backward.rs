//! What pulls costates back, and what nodes cost by their multipliers.
//!
//! ```text
//! ψ(q_n, v̂_n, λ_n),   λ_n = (h λ)/h of the step from the node      G μ = −(1/h) ∂ψ/∂λ     [2.38]
//! ```

use crate::objective::{Objective, Place};
use vi_constraints::Constraints;
use vi_constraints::costate_sweep::{CostateSweep, Linearization, PartVisitor};
use vi_constraints::linearization::Costate;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;
use vi_core::linear::{Singular, dot};
use vi_core::state::State;

/// A sweep that knows the structure of a mechanism, or that of any constraints.
pub(crate) enum Backward<S, C> {
    Fast(Box<dyn CostateSweep<S, C>>),
    General(Box<Linearization>, Vec<f64>), // with ∂J/∂(hλ)
}

impl<S: DiscreteLagrangian, C: Constraints> Backward<S, C> {
    pub(crate) fn new(
        fast: Option<Box<dyn CostateSweep<S, C>>>,
        general: impl FnOnce() -> Linearization,
    ) -> Self {
        fast.map_or_else(|| Self::General(Box::new(general()), Vec::new()), Self::Fast)
    }

    /// As [`CostateSweep::momentum`].
    pub(crate) fn momentum(&mut self, system: &S, points: &[Interval], out: &mut [f64]) {
        match self {
            Self::Fast(own) => own.momentum(system, points, out),
            Self::General(own, _) => {
                CostateSweep::<S, C>::momentum(&mut **own, system, points, out);
            }
        }
    }

    /// As [`CostateSweep::hold`].
    pub(crate) fn hold(&mut self, system: &S, points: &[Interval], costate: &mut Costate) {
        if let Self::Fast(own) = self {
            own.hold(system, points, costate);
        }
    }

    /// As [`CostateSweep::pull`].
    pub(crate) fn pull(
        &mut self,
        system: &S,
        constraints: &C,
        points: &[Interval],
        p: &[f64],
        costate: &mut Costate,
    ) -> Result<(), Singular> {
        match self {
            Self::Fast(own) => own.pull(system, constraints, points, p, costate),
            Self::General(own, _) => own.pull(system, constraints, points, p, costate),
        }
    }

    /// The same where the impulse `h λ` costs, a step of order 2 by its saddle-point matrix: `cost`
    /// takes it and gives `∂J/∂(hλ)`, both of shape `m`.
    pub(crate) fn pull_with(
        &mut self,
        system: &S,
        constraints: &C,
        (points, p): (&[Interval], &[f64]),
        costate: &mut Costate,
        cost: &mut dyn FnMut(&[f64], &mut [f64]),
    ) -> Result<(), Singular> {
        let Self::General(own, by_impulse) = self else { return Err(Singular) };
        let (Linearization::Step(step, _), Some(s)) = (&mut **own, points.last()) else {
            return Err(Singular);
        };
        step.linearize(system, constraints, s, p)?;
        by_impulse.clear();
        by_impulse.resize(step.impulse().len(), 0.0);
        cost(step.impulse(), by_impulse);
        step.pull_with(system, constraints, s, by_impulse, costate)
    }

    /// As [`CostateSweep::for_each_part`].
    pub(crate) fn for_each_part(&self, points: &[Interval], visit: &mut PartVisitor<'_>) {
        match self {
            Self::Fast(own) => own.for_each_part(points, visit),
            Self::General(own, _) => own.for_each_part(points, visit),
        }
    }
}

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
        // λ = (hλ)/h; the weight of the trapezoidal rule grows with h
        *by_step += along - dot(by_impulse, lambda);
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
