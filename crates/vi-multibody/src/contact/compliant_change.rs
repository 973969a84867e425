//! How a compliant contact changes with the numbers of its law.
//!
//! ```text
//! V_θ,   F_D,θ = (k δ^p)_θ max(−1, c δ̇) + k δ^p c_θ δ̇,          the last term where c δ̇ > −1
//! F_N,θ = (k δ^p)_θ + F_D,θ,   F_T,θ = −[(μ F_N)_θ χ + μ F_N χ_θ] v_T/|v_T|
//! ```
//! Letters: those of [`super::compliant_contact`]. The shapes do not change.

use super::compliant_contact::{CompliantContact, CompliantLaw};
use crate::design::ForceChange;
use vi_core::potential::Potential;
use vi_core::sparse::Entries;
use vi_core::{Interval, Motion, Slot};

/// The derivative of a contact: what comes to its energy and to its force.
#[derive(Clone, Debug)]
pub struct CompliantChange {
    /// The contact.
    pub contact: CompliantContact,
    /// The derivatives of the numbers of its law; friction where the law has it.
    pub by: CompliantLaw,
}

impl Potential for CompliantChange {
    fn value(&self, q: &[f64]) -> f64 {
        let law = self.contact.law();
        self.contact.depths(q).map(|depth| law.energy_change(&self.by, depth)).sum()
    }
    fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]) {
        let law = self.contact.law();
        let force = |depth| law.elastic_change(&self.by, depth)[0];
        self.contact.add_gradient_by(q, force, scale, out);
    }
    fn add_hessian(&self, q: &[f64], scale: f64, out: &mut dyn Entries) {
        let law = self.contact.law();
        let elastic = |depth| law.elastic_change(&self.by, depth);
        self.contact.add_hessian_by(q, elastic, scale, out);
    }
}

/// By the midpoint rule.
impl ForceChange for CompliantChange {
    fn add(&self, s: &Interval, _of: Slot, out: &mut [f64]) {
        self.contact.add_force_change(&self.by, [&s.q_mid, &s.v_mid], 0.5 * s.h, out);
    }
    fn add_at_node(&self, at: Motion<'_>, out: &mut [f64]) {
        self.contact.add_force_change(&self.by, [at.q, at.v], 1.0, out);
    }
}
