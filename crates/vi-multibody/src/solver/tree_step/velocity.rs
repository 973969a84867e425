//! The velocity of a momentum on a tree, by the sweeps of a step.
//!
//! ```text
//! v̂ = P ν,   (PᵀMP) ν = Pᵀp                                                              (16)
//! ```
//! `PᵀMP` is `−h` times the Newton matrix of the step `u = 0` without variable forces, `Pᵀp` its
//! residual.

use super::workspace::Workspace;
use crate::mechanism::Mechanism;
use vi_constraints::node_solvers::MomentumVelocity;
use vi_constraints::reparametrization::Emission;
use vi_core::linear::Singular;
use vi_core::newton::Fault;
use vi_core::state::Memory;
use vi_core::{Configuration, MechanicalSystem, SeparableSystem};

/// [`MomentumVelocity`] of the trees that [`super::TreeStep`] applies to, `O(N)`.
#[derive(Debug)]
pub(in crate::solver) struct TreeVelocity {
    pub(in crate::solver) at: Workspace,
    pub(in crate::solver) rest: Vec<f64>, // d  u = 0
    pub(in crate::solver) nu: Vec<f64>,   // d
    none: Vec<f64>,                       // n  impulse of constant forces
}

impl TreeVelocity {
    /// `None` where the sweeps do not apply. Premise: no constraints but those of bodies and joints
    /// of the tree, or closed loops that are solved for on top.
    pub(in crate::solver) fn new(mechanism: &Mechanism, system: &SeparableSystem) -> Option<Self> {
        let at = Workspace::new(mechanism, system)?;
        let zeros = || vec![0.0; mechanism.tree().dof()];
        Some(Self { at, rest: zeros(), nu: zeros(), none: vec![0.0; system.dim()] })
    }

    /// Opens the step `u = 0` of 1 s, `q_{n+1} = q_n = q`, and `ν ← Pᵀp`.
    pub(in crate::solver) fn stand(&mut self, q: &[f64], p: &[f64]) -> Result<(), Fault> {
        let Self { at, rest, nu, none } = self;
        at.open([q, p, none]);
        at.advance(rest, Some(1.0))?;
        at.pull_back(nu);
        Ok(())
    }

    fn solve(&mut self, q: &[f64], p: &[f64]) -> Result<(), Fault> {
        self.stand(q, p)?;
        let Self { at, rest, nu, .. } = self;
        at.eliminate(0..at.links.len(), &[], nu)?;
        at.substitute(0..at.links.len(), rest, nu); // ν
        Ok(())
    }

    /// `v ← P ν` of the last substitution at `q`.
    pub(in crate::solver) fn push_forward(&self, q: &[f64], v: &mut [f64]) -> Result<(), Singular> {
        self.at.push_forward(q, v);
        if v.iter().all(|v| v.is_finite()) { Ok(()) } else { Err(Singular) }
    }
}

impl MomentumVelocity for TreeVelocity {
    fn velocity(
        &mut self,
        _mass: &Emission<'_>,
        at: Configuration<'_>,
        _: &Memory,
        p: &[f64],
        v: &mut [f64],
    ) -> Result<(), Singular> {
        self.solve(at.q, p).map_err(|_| Singular)?;
        self.push_forward(at.q, v) // v̂ = P ν
    }
}
