//! Discrete Legendre transforms without constraints, and the energy of a step.
//!
//! ```text
//! p_n^-     = −D_1 L_d(q_n, q_{n+1}) − f_d^-(q_n, q_{n+1})
//! p_{n+1}^+ = +D_2 L_d(q_n, q_{n+1}) + f_d^+(q_n, q_{n+1})
//! E_d       = ½ (Δq/h)ᵀ M (Δq/h) + U_d(q_n, q_{n+1})                                LMO08 (52)
//! ```
//! With added masses (selective mass scaling) their `K_d` belongs to the kinetic part of `E_d`.
//! The discrete Euler–Lagrange equations say `p_n^+ = p_n^-`. Without forces `p^-`, `p^+` are the
//! discrete Legendre transforms of LMO08 §3 without constraints; the forced ones are those of
//! Marsden & West 2001, part 3. With constraints: `vi_constraints::legendre`.

use crate::discrete_lagrangian::DiscreteLagrangian;
use crate::interval::Interval;
use serde::{Deserialize, Serialize};

/// An energy and its two parts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Energies {
    /// Kinetic energy, J.
    pub kinetic: f64,
    /// Potential energy, J.
    pub potential: f64,
}

impl Energies {
    /// Kinetic and potential energy, J.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.kinetic + self.potential
    }
}

/// `out ← p_n^- = −D_1 L_d(q_n, q_{n+1}) − f_d^-`, shape `n`, unit of momentum.
pub fn p_minus(system: &(impl DiscreteLagrangian + ?Sized), s: &Interval, out: &mut [f64]) {
    system.forced_d1(s, out);
    out.iter_mut().for_each(|p| *p = -*p);
}

/// `out ← p_{n+1}^+ = D_2 L_d(q_n, q_{n+1}) + f_d^+`, shape `n`, unit of momentum.
///
/// On a constrained system this is `p̄_{n+1}`, the momentum of [`crate::State`].
pub fn p_plus(system: &(impl DiscreteLagrangian + ?Sized), s: &Interval, out: &mut [f64]) {
    system.forced_d2(s, out);
}

/// `E_d(q_n, q_{n+1})`, J, LMO08 (52), in its parts.
#[must_use]
pub fn discrete_energy(system: &(impl DiscreteLagrangian + ?Sized), s: &Interval) -> Energies {
    let kinetic = system.kinetic_energy(&s.dq) / (s.h * s.h); // ½ (Δq/h)ᵀ M (Δq/h)
    let kinetic = kinetic + system.added_kinetic_energy(s);
    Energies { kinetic, potential: system.discrete_potential_energy(s) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SeparableSystem;
    use crate::force::{LinearDamping, MidpointForce};
    use crate::mechanical_system::MechanicalSystem;
    use crate::potential::{DualPotential, Quadrature, ScalarField};
    use num_dual::DualNum;
    use proptest::prelude::*;

    struct Well;
    impl ScalarField<2> for Well {
        fn value<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D; 2]) -> D {
            (q[0] * q[1]).sin() + q[0].powi(4) * 0.25 + q[1] * q[1]
        }
    }

    fn system(quadrature: Quadrature, damping: f64) -> SeparableSystem {
        let entries = vec![(0, 0, damping), (0, 1, 0.5 * damping), (1, 1, damping)];
        SeparableSystem::with_diagonal_mass(&[2.0, 0.5])
            .quadrature(quadrature)
            .potential(DualPotential(Well))
            .force(Box::new(MidpointForce(LinearDamping { entries })))
    }

    proptest! {
        #[test]
        fn the_energy_of_a_step_is_the_derivative_of_the_action_by_the_step(
            q0 in prop::array::uniform2(-1.0_f64..1.0),
            q1 in prop::array::uniform2(-1.0_f64..1.0),
            h in 0.1_f64..1.0,
        ) {
            for quadrature in [Quadrature::Midpoint, Quadrature::Trapezoidal] {
                let system = system(quadrature, 0.3);
                // the time is not read where nothing depends on it
                let s = Interval::between(f64::NAN, h, &q0, &q1);
                let energies = discrete_energy(&system, &s);
                let action =
                    |h: f64| system.discrete_lagrangian(&Interval::between(0.0, h, &q0, &q1));
                let e = 1e-5 * h;
                let expected = (action(h - e) - action(h + e)) / (2.0 * e); // E_d = −∂L_d/∂h
                let scale = 1.0 + energies.kinetic + energies.potential.abs();
                prop_assert!((energies.total() - expected).abs() < 1e-8 * scale);
                prop_assert!((system.kinetic_energy(&s.v_mid) - energies.kinetic).abs() < 1e-14 * scale);
            }
        }
    }
}
