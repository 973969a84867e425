//! Islands: contacts that `W` couples.

use super::node_law::Contact;

/// Entries of `W` that couple, in parts of the diagonal.
const COUPLED: f64 = 1e-13;

/// Which island each contact belongs to.
#[derive(Debug, Default)]
pub(super) struct Islands {
    of: Vec<usize>,
}

impl Islands {
    /// From the pattern of `W`.
    pub(super) fn find(&mut self, contacts: &[Contact], W: &[f64]) {
        let Self { of } = self;
        let k = W.len().isqrt();
        of.clear();
        of.extend(0..contacts.len());
        let rows = |contact: &Contact| contact.row..contact.row + contact.law.rows();
        for a in 0..contacts.len() {
            for b in 0..a {
                let coupled = rows(&contacts[a]).any(|i| {
                    rows(&contacts[b]).any(|j| {
                        let size = W[i * k + i] * W[j * k + j];
                        W[i * k + j] * W[i * k + j] > COUPLED * COUPLED * size
                    })
                });
                let (old, new) = (of[a].max(of[b]), of[a].min(of[b]));
                if coupled && old != new {
                    of.iter_mut().filter(|own| **own == old).for_each(|own| *own = new);
                }
            }
        }
    }

    /// How many numbers of islands there are; some may have no contact.
    pub(super) fn count(&self) -> usize {
        self.of.len()
    }

    /// Whether a contact, by its place, is of an island.
    pub(super) fn is_of(&self, place: usize, island: usize) -> bool {
        self.of[place] == island
    }
}
