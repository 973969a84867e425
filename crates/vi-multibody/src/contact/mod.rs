//! Joint stops, dry friction of joints, contacts of shapes by impulses or forces, in a mechanism.

mod broad_phase;
pub mod compliant_change;
pub mod compliant_contact;
pub mod joint_friction;
pub mod joint_stop;
pub mod shape_contact;
pub mod shape_group;
mod transmitted;

pub(crate) use transmitted::TransmittedImpulses;

use std::sync::Arc;
use vi_constraints::nonsmooth::Unilateral;

/// The contacts of a mechanism: [`crate::run::with_contacts`].
#[derive(Clone, Debug, Default)]
pub struct Contacts {
    /// The elements, in the order of which ids count them.
    pub elements: Vec<Arc<dyn Unilateral>>,
    /// Dry friction by what a joint transmits: the element and the joint of the description.
    pub by_reaction: Vec<(u32, usize)>,
}

impl Contacts {
    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.elements.is_empty()
    }
}
