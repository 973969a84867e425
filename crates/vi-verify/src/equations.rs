//! The equations of motion of a system, as the verifier evaluates them by itself.
//!
//! ```text
//! M q̈ + ∇V(q) − f(t, q, q̇) + G(q)ᵀ λ = 0,    g(q) = 0                      LMO08 (3)
//! P_inᵀ (M q̈ + ∇V − f + G_otherᵀ λ)_k = Σ_J ± (f_J, m_J + ϱ_J × f_J)         Newton and Euler, body k
//! ```
//! Nothing here comes from an integrator: `M`, `∇V`, `f`, `g` and `G` are those of the system. What
//! an integrator reports (momenta, multipliers, reactions, energies) is compared with these
//! equations along its configurations ([`super::output`]).

use vi_constraints::Constraints;
use vi_constraints::saddle_point::IndependentRows;
use vi_core::linear::norm_inf;
use vi_core::momentum_map::Momentum;
use vi_core::{Configuration, Motion};
use vi_core::{Entries, MechanicalSystem, SparseMatrix};
use vi_multibody::joint::{FrameId, Joint};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::reaction::Reactions;
use vi_rigid::{directors, null_space};

/// Force (N) and moment about the anchor of the child (N·m) on the child of a joint, in space.
pub type ReactionWrench = [f64; 6];

/// What constraints say beyond `g`: momentum maps, and reactions where there are joints.
pub trait Observables: Constraints {
    /// `J(q, p)`, linear in `p`.
    fn momentum_map(&self, q: &[f64], p: &[f64]) -> Momentum;

    /// Reactions of all joints from the multipliers `λ` (shape `m`); empty without joints.
    fn reactions(
        &self,
        _at: Configuration<'_>,
        _lambda: &[f64],
        _rows: &IndependentRows,
    ) -> Vec<ReactionWrench> {
        Vec::new()
    }

    /// `out_k`: wrench (N, N·m about the centre of mass) that body `k` is short of when it feels
    /// the reactions and the generalized force `force` (shape `n`); empty without joints. `force`
    /// is `M q̈ + ∇V − f`, and the part of `−Gᵀλ` that joints do not exert is taken off with `λ`.
    fn unsupported(
        &self,
        _at: Configuration<'_>,
        _force: &[f64],
        _lambda: &[f64],
        _reactions: &[ReactionWrench],
    ) -> Vec<ReactionWrench> {
        Vec::new()
    }
}

impl Observables for Mechanism {
    fn momentum_map(&self, q: &[f64], p: &[f64]) -> Momentum {
        self.momentum(q, p)
    }

    fn reactions(
        &self,
        at: Configuration<'_>,
        lambda: &[f64],
        rows: &IndependentRows,
    ) -> Vec<ReactionWrench> {
        let found = Reactions::at(self, at, lambda, rows);
        let in_space = |r: &vi_multibody::reaction::Reaction| {
            let (f, m) = (r.force_in_space(), r.moment_in_space());
            [f.x, f.y, f.z, m.x, m.y, m.z]
        };
        found.joints.iter().map(in_space).collect()
    }

    fn unsupported(
        &self,
        at: Configuration<'_>,
        force: &[f64],
        lambda: &[f64],
        reactions: &[ReactionWrench],
    ) -> Vec<ReactionWrench> {
        let joints = &self.description().joints;
        if joints.is_empty() {
            return Vec::new();
        }
        let mut rest = lambda.to_vec(); // of the constraints that are no joints
        (0..joints.len()).for_each(|k| rest[self.joint_rows(k)].fill(0.0));
        let (q, mut force) = (at.q, force.to_vec());
        jacobian(self, at.t, q).tr_mul_add(1.0, &rest, &mut force);
        let mut missing: Vec<ReactionWrench> = (0..self.description().bodies.len())
            .map(|k| {
                null_space::pull_back(&q[12 * k..12 * k + 12], &force[12 * k..12 * k + 12]).into()
            })
            .collect();
        for (joint, reaction) in joints.iter().zip(reactions) {
            for (side, sign) in [(&joint.child, -1.0), (&joint.parent, 1.0)] {
                if let FrameId::Frame(k) = side.frame {
                    let wrench = on_body(joint, q, k, reaction);
                    missing[k].iter_mut().zip(wrench).for_each(|(m, w)| *m += sign * w);
                }
            }
        }
        let moves = |k: usize| self.tree().links().iter().any(|l| l.frame == k && l.dof() > 0);
        missing.into_iter().enumerate().filter(|(k, _)| moves(*k)).map(|(_, m)| m).collect()
    }
}

/// The reaction as a wrench about the centre of body `k`: `(f, m + ϱ × f)`.
fn on_body(joint: &Joint, q: &[f64], k: usize, reaction: &ReactionWrench) -> ReactionWrench {
    let anchor = joint.child.point().at(q);
    let f = nalgebra::Vector3::from_column_slice(&reaction[..3]);
    let m = nalgebra::Vector3::from_column_slice(&reaction[3..]);
    let m = m + (anchor - directors::center(&q[12 * k..12 * k + 12])).cross(&f);
    [f.x, f.y, f.z, m.x, m.y, m.z]
}

fn jacobian(constraints: &(impl Constraints + ?Sized), t: f64, q: &[f64]) -> SparseMatrix {
    let emit = |out: &mut dyn Entries| constraints.jacobian(t, q, out);
    SparseMatrix::assemble(constraints.len(), constraints.dim(), emit)
}

/// The equations of motion of a system.
pub trait Equations {
    /// `M v`, shape `n`.
    fn momentum(&self, v: &[f64]) -> Vec<f64>;
    /// `½ vᵀ M v + V(q)`, J.
    fn energy(&self, q: &[f64], v: &[f64]) -> f64;
    /// `J(q, p)`.
    fn momentum_map(&self, q: &[f64], p: &[f64]) -> Momentum;
    /// `M a + ∇V(q) − f(t, q, v)`, N, shape `n`: what constraints have to supply.
    fn demand(&self, at: Motion<'_>, a: &[f64]) -> Vec<f64>;
    /// The largest entry of `M a`, `∇V(q)` and `f(t, q, v)`, N: what cancels in
    /// [`Equations::demand`].
    fn acting(&self, at: Motion<'_>, a: &[f64]) -> f64;
    /// `G(q)ᵀ λ`, N; of a force `Gᵀλ` itself, which stands for `λ` where constraints are redundant.
    fn constraint_force(&self, at: Configuration<'_>, lambda: &[f64]) -> Vec<f64>;
    /// `|g(t, q)|_∞`.
    fn residual(&self, at: Configuration<'_>) -> f64;
    /// [`Observables::unsupported`].
    fn unsupported(
        &self,
        at: Configuration<'_>,
        force: &[f64],
        lambda: &[f64],
        of: &[ReactionWrench],
    ) -> Vec<ReactionWrench>;
}

/// The equations of a system with its constraints.
#[derive(Debug)]
pub struct OfSystem<'a, S, C> {
    /// `M`, `V`, `f`.
    pub system: &'a S,
    /// `g`.
    pub constraints: &'a C,
    /// Unwrapped joint angles nearby.
    pub angles: &'a [f64],
    /// Whether constraints are redundant.
    pub redundant: bool,
}

impl<S: MechanicalSystem, C: Observables> Equations for OfSystem<'_, S, C> {
    fn momentum(&self, v: &[f64]) -> Vec<f64> {
        let mut p = vec![0.0; v.len()];
        self.system.mass().mul_add(1.0, v, &mut p);
        p
    }

    fn energy(&self, q: &[f64], v: &[f64]) -> f64 {
        let at = Configuration { t: 0.0, q, angles: self.angles, internal: &[] };
        self.system.kinetic_energy(v) + self.system.potential_energy(at)
    }

    fn momentum_map(&self, q: &[f64], p: &[f64]) -> Momentum {
        self.constraints.momentum_map(q, p)
    }

    fn demand(&self, at: Motion<'_>, a: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; at.q.len()];
        let at = Motion { angles: self.angles, ..at };
        self.system.add_force(at, &mut out);
        out.iter_mut().for_each(|f| *f = -*f);
        self.system.add_potential_gradient(at.configuration(), 1.0, &mut out);
        self.system.mass().mul_add(1.0, a, &mut out);
        out
    }

    fn acting(&self, at: Motion<'_>, a: &[f64]) -> f64 {
        let at = Motion { angles: self.angles, ..at };
        let [mut force, mut gradient] = [vec![0.0; at.q.len()], vec![0.0; at.q.len()]];
        self.system.add_force(at, &mut force);
        self.system.add_potential_gradient(at.configuration(), 1.0, &mut gradient);
        norm_inf(&[norm_inf(&force), norm_inf(&gradient), norm_inf(&self.momentum(a))])
    }

    fn constraint_force(&self, at: Configuration<'_>, lambda: &[f64]) -> Vec<f64> {
        if self.redundant {
            return lambda.to_vec();
        }
        let mut out = vec![0.0; at.q.len()];
        jacobian(self.constraints, at.t, at.q).tr_mul_add(1.0, lambda, &mut out);
        out
    }

    fn residual(&self, at: Configuration<'_>) -> f64 {
        let mut g = vec![0.0; self.constraints.len()];
        self.constraints.value(Configuration { angles: self.angles, ..at }, &mut g);
        norm_inf(&g)
    }

    fn unsupported(
        &self,
        at: Configuration<'_>,
        force: &[f64],
        lambda: &[f64],
        of: &[ReactionWrench],
    ) -> Vec<ReactionWrench> {
        self.constraints.unsupported(at, force, lambda, of)
    }
}
