//! How the efforts that laws and bushings state at a node change with its state.
//!
//! ```text
//! δτ = Σ_j ∂τ/∂y_j δy_j        y: what the law reads, joint coordinates, points, ξ of a bushing
//! ```
//! Of [`NamedForce::efforts`] and [`ForceElements::bushing_efforts`].

use super::force::{ElementForce, ForceElements, NamedForce};
use crate::force::joint_force::JointForce;
use crate::geometry::six_coordinates::Vector6;
use vi_core::Motion;

impl NamedForce {
    /// `q ← q + scale ∂τ_k/∂q`, `of_v ← of_v + scale ∂τ_k/∂v`, both of shape `n`, and
    /// `of_z ← of_z + scale ∂τ_k/∂z` by the internal variables of signals, of number `k` of the
    /// efforts at a node; nothing where it is no law.
    pub fn add_effort_slopes(
        &self,
        at: Motion<'_>,
        k: usize,
        scale: f64,
        [q, of_v, of_z]: [&mut [f64]; 3],
    ) {
        match &self.force {
            ElementForce::Joint(JointForce { coordinate, law }) => {
                let slopes = law.slopes(
                    at.t,
                    coordinate.at(at.configuration()),
                    coordinate.rate(at.q, at.v),
                );
                let by_rate = scale * slopes.by_rate;
                coordinate.add_gradient(at.q, scale * slopes.by_coordinate, q);
                coordinate.for_each_bend(at.q, at.v, by_rate, |i, slope| q[i] += slope);
                coordinate.add_gradient(at.q, by_rate, of_v);
            }
            ElementForce::Tension(force) => {
                force.add_tension_slopes(at.t, at.q, at.v, scale, [q, of_v]);
            }
            ElementForce::Wrench(force) => {
                force.add_effort_slopes(at.t, at.q, at.v, k, scale, [q, of_v]);
            }
            ElementForce::Law(force) => {
                force.add_effort_slopes(at, k, scale, [q, of_v, of_z]);
            }
            _ => {}
        }
    }

    /// `q ← q + scale ∂²τ_k/∂q∂(q, v)` times `changes` of both, `of_v` likewise, of number `k` of
    /// the efforts at a node; nothing where it is no law, or one with states.
    pub fn add_effort_bends(
        &self,
        at: Motion<'_>,
        (k, scale): (usize, f64),
        changes: [&[f64]; 2],
        [q, of_v]: [&mut [f64]; 2],
    ) {
        let (node, out) = ((at.t, at.q, at.v), [q, of_v]);
        match &self.force {
            ElementForce::Joint(force) => {
                force.add_effort_bends(at, scale, changes, out);
            }
            ElementForce::Tension(force) => force.add_tension_bends(node, scale, changes, out),
            ElementForce::Wrench(force) => {
                force.add_effort_bends(node, (k, scale), changes, out);
            }
            ElementForce::Law(force) => force.add_effort_bends(at, k, scale, changes, out),
            _ => {}
        }
    }
}

impl ForceElements {
    /// `q ← q + scale ∂²τ_k/∂q∂(q, v)` times `changes` of both, `of_v` likewise, of number `k` of
    /// the efforts of the bushing of this name at a node; nothing of a law with states.
    pub fn add_bushing_bends(
        &self,
        name: &str,
        at: Motion<'_>,
        (effort, scale): (usize, f64),
        changes: [&[f64]; 2],
        [q, of_v]: [&mut [f64]; 2],
    ) {
        for own in self.bushings.iter().filter(|own| own.name == name) {
            own.spring.add_effort_bends(at.q, effort, scale, changes[0], q);
        }
        for own in self.forces.iter().filter(|own| own.name == name) {
            if let ElementForce::Six(force) = &own.force {
                force.add_effort_bends(at, effort, scale, changes, [&mut *q, &mut *of_v]);
            }
        }
    }

    /// `q ← q + Σ w_i ∂τ_i/∂q`, `of_v ← of_v + Σ w_i ∂τ_i/∂v`, both of shape `n`, and
    /// `of_z ← of_z + Σ w_i ∂τ_i/∂z` by the internal variables of signals, of the efforts of the
    /// bushing of this name at a node.
    pub fn add_bushing_slopes(
        &self,
        name: &str,
        at: Motion<'_>,
        w: &Vector6,
        [q, of_v, of_z]: [&mut [f64]; 3],
    ) {
        for own in self.bushings.iter().filter(|own| own.name == name) {
            own.spring.add_slopes(at.q, w, q);
        }
        for own in self.forces.iter().filter(|own| own.name == name) {
            if let ElementForce::Six(force) = &own.force {
                force.add_slopes(at, w, [&mut *q, &mut *of_v, &mut *of_z]);
            }
        }
    }
}
