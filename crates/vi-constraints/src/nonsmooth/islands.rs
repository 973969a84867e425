//! Islands: contacts that `W` couples.

use super::delassus::Delassus;
use super::node_law::Contact;

/// Entries of `W` that couple, in parts of the diagonal.
const COUPLED: f64 = 1e-13;

/// The contacts of each island, in the order of their first contacts.
#[derive(Debug, Default)]
pub(super) struct Islands {
    parent: Vec<u32>,  // of contacts
    owners: Vec<u32>,  // of rows: contacts
    numbers: Vec<u32>, // of contacts: islands
    locals: Vec<u32>,  // of rows: places among the rows of their islands
    sizes: Vec<u32>,   // rows of islands
    ends: Vec<usize>,
    members: Vec<usize>,
}

impl Islands {
    /// From the pattern of `W`.
    pub(super) fn find(&mut self, contacts: &[Contact], W: &Delassus) {
        self.clear();
        let Self { parent, owners, numbers, locals, sizes, ends, members } = self;
        for (place, contact) in contacts.iter().enumerate() {
            parent.push(place as u32);
            owners.resize(contact.row + contact.law.rows(), place as u32);
        }
        for i in 0..owners.len() {
            let own = W.at(i, i);
            for (j, entry) in W.row(i).take_while(|(j, _)| *j < i) {
                if entry * entry > COUPLED * COUPLED * own * W.at(j, j) {
                    let [a, b] = [owners[i], owners[j]].map(|contact| root(parent, contact));
                    parent[a.max(b) as usize] = a.min(b);
                }
            }
        }
        for place in 0..contacts.len() {
            // the root of an island is its first contact
            let first = root(parent, place as u32) as usize;
            let number = if first == place { ends.len() as u32 } else { numbers[first] };
            if first == place {
                ends.push(0);
            }
            numbers.push(number);
            ends[number as usize] += 1;
            sizes.resize(ends.len(), 0);
            for _ in 0..contacts[place].law.rows() {
                locals.push(sizes[number as usize]);
                sizes[number as usize] += 1;
            }
        }
        let mut sum = 0;
        for end in &mut *ends {
            (*end, sum) = (sum, sum + *end); // where it starts
        }
        members.resize(contacts.len(), 0);
        for (place, number) in numbers.iter().enumerate() {
            let next = &mut ends[*number as usize];
            members[*next] = place;
            *next += 1;
        }
    }

    /// Of no contacts.
    pub(super) fn clear(&mut self) {
        let Self { parent, owners, numbers, locals, sizes, ends, members } = self;
        [parent, owners, numbers, locals, sizes].into_iter().for_each(Vec::clear);
        [ends, members].into_iter().for_each(Vec::clear);
    }

    pub(super) fn count(&self) -> usize {
        self.ends.len()
    }

    /// The places of the contacts of an island, in ascending order.
    pub(super) fn contacts(&self, island: usize) -> &[usize] {
        &self.members
            [island.checked_sub(1).map_or(0, |before| self.ends[before])..self.ends[island]]
    }

    /// The island of a contact, by its place.
    pub(super) fn of(&self, place: usize) -> usize {
        self.numbers[place] as usize
    }

    /// The place of a row among those of an island; `None` of another one.
    pub(super) fn local(&self, row: usize, island: usize) -> Option<usize> {
        let own = self.of(self.owners[row] as usize) == island;
        own.then(|| self.locals[row] as usize)
    }
}

fn root(parent: &mut [u32], mut i: u32) -> u32 {
    while parent[i as usize] != i {
        parent[i as usize] = parent[parent[i as usize] as usize];
        i = parent[i as usize];
    }
    i
}
