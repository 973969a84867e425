//! What acts on a mechanism, as both families of schemes receive it.
//!
//! ```text
//!                 variational                        energy–momentum
//! gravity         quadrature of V                     exact, V is linear
//! elements        averaged or midpoint strains        D̄V of averaged strains
//! spring          quadrature of V(D·D)                D̄V of the invariant D·D
//! damper          f_d^± = (h/2) f(q_{n+1/2}, Δq/h)    f̄ = f(q_{n+1/2}, Δq/h)
//! joint spring    U_d = ½ k (θ̄ − θ_0)²                D̄V = k (θ̄ − θ_0) D̄θ
//! joint law       f_d^± = (h/2) τ ∇θ                  f̄ = τ D̄θ
//! wrench (f, τ)   P_in(q_n)ᵀ f_d^- = (h/2) (f, τ)     P_in(q_{n+1/2})ᵀ f̄ = (f, τ)
//! ```
//! One walk over a model fills both.

use vi_beam::high_order::AveragedHighOrder;
use vi_beam::{BeamModel, StrainRule};
use vi_core::force::MidpointForce;
use vi_core::{Quadrature, SeparableSystem};
use vi_emscheme::EmSystem;
use vi_emscheme::beam::{BeamGradient, HighOrderGradient};
use vi_emscheme::load::AtMidpoint;
use vi_multibody::joint_force::{JointForce, JointLaw, JointSpring};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::spring::{Damper, Spring};
use vi_rigid::load::Load;

/// The same system in the descriptions of both families.
pub struct Dynamics {
    /// Mass, discrete potentials and forces.
    pub variational: SeparableSystem,
    /// Mass, discrete derivatives and loads.
    pub energy_momentum: EmSystem,
}

impl Dynamics {
    /// Bodies and elements with their masses, gravity and elastic energy.
    #[must_use]
    pub fn new(
        parts: &BeamModel,
        mechanism: &Mechanism,
        rule: StrainRule,
        quadrature: Quadrature,
    ) -> Self {
        let variational = parts.system_by(mechanism, rule, quadrature);
        let mass = parts.mass_matrix(mechanism);
        let weight = mechanism.system_with_mass(mass, Quadrature::Midpoint);
        let mut energy_momentum = EmSystem::of_linear(&weight);
        if !parts.elements.list().is_empty() {
            energy_momentum = energy_momentum.gradient(BeamGradient(parts.elements.clone()));
        }
        if !parts.high_order.is_empty() {
            let gradient = HighOrderGradient(AveragedHighOrder(parts.high_order.clone()));
            energy_momentum = energy_momentum.gradient(gradient);
        }
        Self { variational, energy_momentum }
    }

    /// Adds a spring.
    #[must_use]
    pub fn spring(self, spring: Spring) -> Self {
        Self {
            variational: self.variational.potential(spring.clone()),
            energy_momentum: self.energy_momentum.spring(spring),
        }
    }

    /// Adds a damper between two points.
    #[must_use]
    pub fn damper(self, damper: Damper) -> Self {
        Self {
            variational: self.variational.force(Box::new(MidpointForce(damper.clone()))),
            energy_momentum: self.energy_momentum.load(AtMidpoint(damper)),
        }
    }

    /// Adds a spring on a joint coordinate.
    #[must_use]
    pub fn joint_spring(self, spring: JointSpring) -> Self {
        Self {
            variational: self.variational.discrete_potential(Box::new(spring.clone())),
            energy_momentum: self.energy_momentum.gradient(spring),
        }
    }

    /// Adds a damper, a motor or a control on a joint coordinate.
    #[must_use]
    pub fn joint_force<L: JointLaw + Clone + 'static>(self, force: JointForce<L>) -> Self {
        Self {
            variational: self.variational.force(Box::new(force.clone())),
            energy_momentum: self.energy_momentum.load(force),
        }
    }

    /// Adds a wrench on a frame.
    #[must_use]
    pub fn load(self, load: Load) -> Self {
        Self {
            variational: self.variational.force(Box::new(load.clone())),
            energy_momentum: self.energy_momentum.load(load),
        }
    }
}
