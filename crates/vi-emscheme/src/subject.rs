//! One mechanical model in both descriptions, so that both families of schemes get the same inputs.
//!
//! ```text
//! spring   V(D·D)      midpoint or trapezoidal U_d           D̄V of the invariant D·D
//! damper   f(q, v)     f_d^± = (h/2) f(q_{n+1/2}, Δq/h)       f̄ = f(q_{n+1/2}, Δq/h)
//! wrench   (f, τ)      P_in(q_n)ᵀ f_d^- = (h/2) (f, τ)        P_in(q_{n+1/2})ᵀ f̄ = (f, τ)
//! ```

use crate::em_system::EmSystem;
use crate::load::AtMidpoint;
use vi_core::force::MidpointForce;
use vi_core::{Quadrature, SeparableSystem};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::spring::{Damper, Spring};
use vi_rigid::load::Load;

/// A mechanism in both descriptions.
pub trait Subject {
    /// Its constraints, tree and start.
    fn mechanism(&self) -> Mechanism;
    /// Mass, discrete potentials and forces of the variational schemes.
    fn variational(&self) -> SeparableSystem;
    /// Mass, discrete derivatives and loads of the energy–momentum schemes.
    fn energy_momentum(&self) -> EmSystem;
}

/// A mechanism with gravity, springs, dampers and loads on its bodies.
#[derive(Clone, Debug)]
pub struct MechanismSubject {
    /// Bodies, joints, gravity, start.
    pub mechanism: Mechanism,
    /// Springs.
    pub springs: Vec<Spring>,
    /// Dampers.
    pub dampers: Vec<Damper>,
    /// Wrenches on frames.
    pub loads: Vec<Load>,
    /// Of the variational schemes.
    pub quadrature: Quadrature,
}

impl MechanismSubject {
    /// A mechanism with gravity alone.
    #[must_use]
    pub fn new(mechanism: Mechanism) -> Self {
        let quadrature = Quadrature::Midpoint;
        let (springs, dampers, loads) = (Vec::new(), Vec::new(), Vec::new());
        Self { mechanism, springs, dampers, loads, quadrature }
    }
}

impl Subject for MechanismSubject {
    fn mechanism(&self) -> Mechanism {
        self.mechanism.clone()
    }

    fn variational(&self) -> SeparableSystem {
        let mut system = self.mechanism.system(self.quadrature);
        for spring in &self.springs {
            system = system.potential(spring.clone());
        }
        for damper in &self.dampers {
            system = system.force(Box::new(MidpointForce(damper.clone())));
        }
        for load in &self.loads {
            system = system.force(Box::new(load.clone()));
        }
        system
    }

    fn energy_momentum(&self) -> EmSystem {
        let mut system = EmSystem::of_mechanism(&self.mechanism);
        for spring in &self.springs {
            system = system.spring(spring.clone());
        }
        for damper in &self.dampers {
            system = system.load(AtMidpoint(damper.clone()));
        }
        for load in &self.loads {
            system = system.load(load.clone());
        }
        system
    }
}
