//! What acts on a mechanism, as both families of schemes receive it.
//!
//! ```text
//!                 variational                        energy–momentum
//! gravity         quadrature of V                     exact, V is linear
//! elements        averaged or midpoint strains        D̄V of averaged strains
//! their damping   f_d^∓ = −(½ ± θ) C τ Δε 𝔹x          f̄ = f(q_{n+1/2}, Δq/h)
//! dissipation     f_d^∓ = −½ h C φ 𝔹x                 none: refused
//! spring          quadrature of V(D·D)                D̄V of the invariant D·D
//! damper          f_d^± = (h/2) f(q_{n+1/2}, Δq/h)    f̄ = f(q_{n+1/2}, Δq/h)
//! joint spring    U_d = ½ k (θ̄ − θ_0)²                D̄V = k (θ̄ − θ_0) D̄θ
//! joint law       f_d^± = (h/2) τ ∇θ                  f̄ = τ D̄θ
//! wrench (f, τ)   P_in(q_n)ᵀ f_d^- = (h/2) (f, τ)     P_in(q_{n+1/2})ᵀ f̄ = (f, τ)
//! ```
//! Only the family that is asked for is assembled.

use crate::system::works::ForceWork;
use std::sync::Arc;
use vi_beam::damping::{self, StrainDamping};
use vi_beam::{BeamElements, StrainRule};
use vi_core::{Quadrature, SeparableSystem};
use vi_emscheme::EmSystem;
use vi_emscheme::beam::BeamGradient;
use vi_emscheme::load::AtMidpoint;
use vi_multibody::builder::ForceElements;
use vi_multibody::mechanism::Mechanism;

/// Elements, gravity and force elements of a model, from which the system of either family is made.
#[derive(Debug)]
pub struct Dynamics {
    /// The elements of beams.
    pub parts: Arc<BeamElements>,
    /// How strains are averaged over a step.
    pub rule: StrainRule,
    /// The quadrature of the other potentials.
    pub quadrature: Quadrature,
    /// Springs, dampers, motors, loads.
    pub forces: ForceElements,
    /// Works that are internal variables of a variational system.
    pub(crate) works: Vec<ForceWork>,
}

impl Dynamics {
    /// The discrete Lagrangian with its forces.
    #[must_use]
    pub fn variational(&self, mechanism: &Mechanism) -> SeparableSystem {
        let system = self.parts.system_by(mechanism, self.rule, self.quadrature);
        let works = self.works.iter().map(ForceWork::working);
        works.fold(self.forces.add_to(system), SeparableSystem::working)
    }

    /// The system of the energy–momentum schemes.
    #[must_use]
    pub fn energy_momentum(&self, mechanism: &Mechanism) -> EmSystem {
        let Self { parts, forces, .. } = self;
        let mut system = EmSystem::with_mass(mechanism, parts.mass_matrix(mechanism));
        if !parts.elements.list().is_empty() {
            system = system.gradient(BeamGradient(parts.elements.clone()));
        }
        if let Some(damping) = StrainDamping::new(&parts.elements) {
            system = system.load_of(damping::SOURCE, AtMidpoint(damping));
        }
        system.force_elements(forces)
    }
}
