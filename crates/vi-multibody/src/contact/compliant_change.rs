//! How a compliant contact changes with the numbers of its law and of its shapes.
//!
//! ```text
//! V_θ,   F_D,θ = (k δ^p)_θ max(−1, c δ̇) + k δ^p c_θ δ̇,          the last term where c δ̇ > −1
//! F_N,θ = (k δ^p)_θ + F_D,θ,   F_T,θ = −[(μ F_N)_θ χ + μ F_N χ_θ] v_T/|v_T|
//! ```
//! ```text
//! (V_θ, F_θ) of shapes: of the formulas of the gap and of the force in dual numbers
//! ```
//! Letters: those of [`super::compliant_contact`].

use super::compliant_contact::{CompliantContact, CompliantLaw};
use crate::design::ForceChange;
use nalgebra::Vector3;
use std::sync::Arc;
use vi_core::num_dual::Dual64;
use vi_core::potential::Potential;
use vi_core::sparse::Entries;
use vi_core::{Interval, Motion, Slot};

/// The derivative of a contact: what comes to its energy and to its force.
#[derive(Clone, Debug)]
pub struct CompliantChange {
    /// The contact.
    pub contact: Arc<CompliantContact>,
    /// The derivatives of the numbers of its law; friction where the law has it.
    pub by: Option<CompliantLaw>,
    /// The contact with the derivatives of its shapes, where these change.
    pub shapes: Option<Arc<CompliantContact<Dual64>>>,
}

impl CompliantChange {
    /// Of the force on B in space, N.
    #[must_use]
    pub fn total_force(&self, q: &[f64], v: &[f64]) -> Vector3<f64> {
        let Self { contact, by, shapes } = self;
        let mut sum = by.map_or_else(Vector3::zeros, |by| contact.total_force_change(&by, q, v));
        for (own, (feature, _)) in
            shapes.iter().flat_map(|own| contact.depths(q).map(move |at| (own, at)))
        {
            sum += own.total_force_by_shape(feature, q, v);
        }
        sum
    }

    /// Of the smallest gap, m.
    #[must_use]
    pub fn smallest_gap(&self, q: &[f64]) -> f64 {
        let own = self.shapes.as_ref();
        own.map_or(0.0, |own| self.contact.smallest_gap_change(own, q))
    }

    /// `f ← f + scale f_θ` of the force without the potential.
    fn add_force(&self, [q, v]: [&[f64]; 2], scale: f64, out: &mut [f64]) {
        if let Some(by) = &self.by {
            self.contact.add_force_change(by, [q, v], scale, out);
        }
        if let Some(own) = &self.shapes {
            let touching = self.contact.depths(q);
            touching.for_each(|(feature, _)| own.add_force_by_shape(feature, [q, v], scale, out));
        }
    }
}

impl Potential for CompliantChange {
    fn value(&self, q: &[f64]) -> f64 {
        let law = self.contact.law();
        let one = |(feature, depth): (u32, f64)| {
            let by_law = self.by.map_or(0.0, |by| law.energy_change(&by, depth));
            by_law + self.shapes.as_ref().map_or(0.0, |own| own.energy_by_shape(feature, q))
        };
        self.contact.depths(q).map(one).sum()
    }
    fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]) {
        if let Some(by) = &self.by {
            let law = self.contact.law();
            let force = |depth| law.elastic_change(by, depth)[0];
            self.contact.add_gradient_by(q, force, scale, out);
        }
        if let Some(own) = &self.shapes {
            let touching = self.contact.depths(q);
            touching.for_each(|(feature, _)| own.add_gradient_by_shape(feature, q, scale, out));
        }
    }
    fn add_hessian(&self, q: &[f64], scale: f64, out: &mut dyn Entries) {
        if let Some(by) = &self.by {
            let law = self.contact.law();
            let elastic = |depth| law.elastic_change(by, depth);
            self.contact.add_hessian_by(q, elastic, scale, out);
        }
        if let Some(own) = &self.shapes {
            let touching = self.contact.depths(q);
            touching.for_each(|(feature, _)| own.add_hessian_by_shape(feature, q, scale, out));
        }
    }
}

/// By the midpoint rule.
impl ForceChange for CompliantChange {
    fn add(&self, s: &Interval, _of: Slot, out: &mut [f64]) {
        self.add_force([&s.q_mid, &s.v_mid], 0.5 * s.h, out);
    }
    fn add_at_node(&self, at: Motion<'_>, out: &mut [f64]) {
        self.add_force([at.q, at.v], 1.0, out);
    }
}
