//! Coordinates that move together: those that constraints or the mass matrix couple.
//!
//! An impulse on coordinates of a group changes velocities in it alone: `P (PᵀMP)⁻¹ Pᵀ` has no
//! entry between two groups. A free body is a group, up to the independence of its centre and its
//! directors; what joints connect is one.

use crate::constraints::Constraints;
use vi_core::mechanical_system::MechanicalSystem;
use vi_core::sparse::Entries;
use vi_core::state::State;

/// The groups of the coordinates.
#[derive(Debug)]
pub(super) struct Groups {
    of: Vec<u32>,    // n  group of a coordinate
    place: Vec<u32>, // n  its place in the group
    ends: Vec<usize>,
    members: Vec<usize>, // n  by groups
}

/// Sets that grow together.
struct Sets {
    parent: Vec<usize>,
    firsts: Vec<usize>, // of each row, the first coordinate it has
    of_rows: bool,
}

impl Sets {
    fn root(&mut self, mut i: usize) -> usize {
        while self.parent[i] != i {
            self.parent[i] = self.parent[self.parent[i]];
            i = self.parent[i];
        }
        i
    }

    fn join(&mut self, i: usize, j: usize) {
        let [a, b] = [self.root(i), self.root(j)];
        self.parent[a.max(b)] = a.min(b);
    }
}

impl Entries for Sets {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        if !self.of_rows {
            if value != 0.0 {
                self.join(row, column);
            }
        } else if self.firsts[row] == usize::MAX {
            self.firsts[row] = column;
        } else {
            self.join(self.firsts[row], column);
        }
    }
}

impl Groups {
    /// Of a mechanism; velocity constraints couple all.
    pub(super) fn find(
        system: &impl MechanicalSystem,
        constraints: &impl Constraints,
        state: &State,
        h: f64,
    ) -> Self {
        let n = state.q.len();
        let firsts = vec![usize::MAX; constraints.len()];
        let mut sets = Sets { parent: (0..n).collect(), firsts, of_rows: true };
        if constraints.constrains_velocities() {
            (1..n).for_each(|i| sets.join(0, i));
        } else {
            constraints.jacobian(state.t, &state.q, &mut sets);
            sets.of_rows = false;
            system.emit_mass_of_step(state.configuration(), h, &mut sets);
        }
        let roots: Vec<usize> = (0..n).map(|i| sets.root(i)).collect();
        let mut numbers = vec![u32::MAX; n];
        let mut sizes: Vec<u32> = Vec::new();
        let (mut of, mut place) = (Vec::with_capacity(n), Vec::with_capacity(n));
        for root in roots {
            if numbers[root] == u32::MAX {
                numbers[root] = sizes.len() as u32;
                sizes.push(0);
            }
            let group = numbers[root] as usize;
            of.push(group as u32);
            place.push(sizes[group]);
            sizes[group] += 1;
        }
        let ends = sizes.iter().scan(0, |end, size| {
            *end += *size as usize;
            Some(*end)
        });
        let mut groups = Self { of, place, ends: ends.collect(), members: vec![0; n] };
        for i in 0..n {
            let group = groups.of[i] as usize;
            let start = groups.start(group);
            groups.members[start + groups.place[i] as usize] = i;
        }
        groups
    }

    fn start(&self, group: usize) -> usize {
        group.checked_sub(1).map_or(0, |before| self.ends[before])
    }

    pub(super) fn count(&self) -> usize {
        self.ends.len()
    }

    /// The group of a coordinate, and its place in it.
    pub(super) fn of(&self, coordinate: usize) -> (u32, u32) {
        (self.of[coordinate], self.place[coordinate])
    }

    /// The coordinates of a group.
    pub(super) fn members(&self, group: usize) -> &[usize] {
        &self.members[self.start(group)..self.ends[group]]
    }
}
