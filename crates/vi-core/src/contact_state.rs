//! What the contacts of a motion remember from node to node.
//!
//! Impulses start the iteration of the next node, and choose among several solutions. The length of
//! the step before and the rates in it enter the laws of dry friction.

use serde::{Deserialize, Serialize};

/// A contact: which of the elements of a mechanism, and which of its features.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct ContactId {
    /// The element.
    pub element: u32,
    /// Its feature: a side of a joint stop, a vertex.
    pub feature: u32,
}

/// A contact at the last node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Remembered {
    /// The contact.
    pub id: ContactId,
    /// `Λ`, N·s or N·m·s: along the normal and two tangents; of an impact zero.
    pub impulse: [f64; 3],
    /// Rate of the slip in the step from there.
    pub rate: f64,
    /// Slip over the step from there in space, m/s, of what transmitted an impulse.
    #[serde(default)]
    pub slip: Option<[f64; 3]>,
    /// Whether it kept its place in the step from there.
    #[serde(default)]
    pub sticks: bool,
    /// Whether it was closed there and its gap was held, not by an impact.
    #[serde(default)]
    pub kept: bool,
    /// What the loads of the step from there add to the velocity of its gap after the impulse, and
    /// of the step before that, m/s or rad/s; of what is kept.
    #[serde(default)]
    pub loads: Option<[f64; 2]>,
}

impl Remembered {
    /// The slip along the tangents of these axes, the normal first, m/s.
    #[must_use]
    pub fn along(&self, axes: &[[f64; 3]; 3]) -> Option<[f64; 2]> {
        let slip = self.slip?;
        let dot = |axis: &[f64; 3]| axis.iter().zip(&slip).map(|(a, b)| a * b).sum();
        Some([dot(&axes[1]), dot(&axes[2])])
    }
}

/// How contacts have acted in a motion so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactCounts {
    /// Impacts: nodes of contacts with a law of restitution.
    pub impacts: u64,
    /// Nodes that were put between two steps, at a first touch.
    pub events: u64,
    /// Steps in which these were as many as allowed.
    pub exhausted: u64,
    /// Nodes that were put between two steps because no impulses were found for a longer one.
    #[serde(default)]
    pub divided: u64,
    /// Nodes at which friction had the speed of slip of an earlier solution of the step, because no
    /// impulses were found that obey Coulomb's law.
    #[serde(default)]
    pub relaxed: u64,
    /// By how much a contact moved beside that law at most, m/s.
    #[serde(default)]
    pub largest_deviation: f64,
    /// Nodes at which coefficients of restitution were reduced so that no energy is gained, or
    /// because no impulses obey Newton's law with them.
    pub guarded: u64,
    /// By how much at most, in parts of the coefficient.
    pub largest_reduction: f64,
    /// Most solutions of a step for one node.
    pub most_iterations: u64,
    /// Most contacts of a node that transmit an impulse.
    pub most_contacts: u64,
    /// Largest work of the contacts of a node, J.
    pub largest_work: f64,
    /// Smallest gap at the end of a step, m or rad.
    pub smallest_gap: Option<f64>,
    /// Energy that contacts took out at nodes, `−Σ ½ Λ·(U⁺ + U⁻)`, J.
    pub dissipated: f64,
}

/// What the next nodes depend on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactState {
    /// Length of the step that ended at the node, s; 0 where the momentum of the state has the
    /// impulses up to the node: at the start, and after an event.
    pub step: f64,
    /// The contacts of the last node, in ascending order.
    pub contacts: Vec<Remembered>,
    /// What happened so far.
    pub counts: ContactCounts,
}

impl ContactState {
    /// Whether no step with contacts has been taken.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// What is remembered of a contact.
    #[must_use]
    pub fn find(&self, id: ContactId) -> Option<&Remembered> {
        let place = self.contacts.binary_search_by(|own| own.id.cmp(&id)).ok()?;
        Some(&self.contacts[place])
    }

    /// Becomes a copy; allocates only when it grows.
    pub fn copy_from(&mut self, other: &Self) {
        (self.step, self.counts) = (other.step, other.counts);
        self.contacts.clear();
        self.contacts.extend_from_slice(&other.contacts);
    }
}
