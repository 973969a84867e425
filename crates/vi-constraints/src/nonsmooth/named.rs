//! What contacts remember, by the names of their elements.
//!
//! A mechanism that goes on with other parts has other elements, in other places: what a contact
//! remembers follows its element by the name that its work is listed under, of several ones of a
//! name in their order. The motion goes on from the momentum with which the last step arrives: the
//! half of the impulses that belongs to that step is in it, and the next node has the other one.

use super::unilateral::Elements;
use serde::{Deserialize, Serialize};
use vi_core::contact_state::{ContactId, ContactState, Remembered};

/// The memory of contacts beside the names of their elements.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NamedContacts {
    state: ContactState,
    names: Vec<String>, // of all elements
}

impl NamedContacts {
    pub(crate) fn new(state: &ContactState, elements: &Elements) -> Self {
        let names = elements.iter().map(|element| element.source()).collect();
        Self { state: state.clone(), names }
    }

    /// The memory of those of these elements that are known.
    pub(crate) fn among(&self, elements: &Elements) -> ContactState {
        let mut taken = vec![false; self.names.len()];
        let mut contacts = Vec::new();
        for (place, element) in elements.iter().enumerate() {
            let name = element.source();
            let known = (0..taken.len()).find(|&k| !taken[k] && self.names[k] == name);
            let Some(known) = known else { continue };
            taken[known] = true;
            let own = self.state.contacts.iter().filter(|own| own.id.element as usize == known);
            contacts.extend(own.map(|own| Remembered {
                id: ContactId { element: place as u32, ..own.id },
                ..*own
            }));
        }
        ContactState { contacts, step: 0.0, ..self.state.clone() }
    }
}
