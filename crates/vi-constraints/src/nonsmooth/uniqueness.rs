//! Which impulses of a node follow from its motion, and which are one choice of many.
//!
//! ```text
//! W T z = 0,   Λ' = Λ + T z          T: ways in which the laws leave impulses free
//! ```
//! What sticks has three such ways, what slides one, `(1, Λ_T/Λ_N)`, and so has what has no
//! friction; a contact that stays closed without an impulse may have one along its normal. `W` is
//! positive semidefinite, so the null space of `W T` is that of `G = TᵀWT`, found by elimination
//! with the largest pivots. An impulse is unique where that space has no part along it. Whether
//! `Λ'` is within its cone is not asked: four legs of a table are not unique, three are.
#![allow(non_snake_case)] // G, T, W

use super::active_rows::DENSE;
use super::delassus::Delassus;
use super::node_law::Contact;
use super::record::{ContactRecord, ContactStatus, Unique};
use super::unilateral::ContactLaw;

/// A pivot that rounding leaves of a diagonal of one.
const SMALL: f64 = 1e-10;
/// A part of a null vector that is none, where its own unknown has one.
const NONE: f64 = 1e-6;

/// A way in which impulses are free: of a contact, along its rows.
#[derive(Clone, Copy, Debug)]
struct Way {
    place: usize,
    row: usize, // the first of the contact
    along: [f64; 3],
    is_normal: bool,
}

/// Scratch.
#[derive(Debug, Default)]
pub(super) struct Uniqueness {
    ways: Vec<Way>,
    G: Vec<f64>,        // m × m
    scales: Vec<f64>,   // m
    order: Vec<usize>,  // m  of the pivots
    is_free: Vec<bool>, // m
}

impl Uniqueness {
    /// Notes for the contacts of an island, at these places, which impulses are unique; of more
    /// ways than a dense matrix has nothing is known. `records`: of all contacts.
    pub(super) fn find(
        &mut self,
        (contacts, W): (&[Contact], &Delassus),
        places: &[usize],
        h: f64,
        records: &mut [ContactRecord],
    ) {
        self.ways.clear();
        for place in places {
            self.list(*place, &contacts[*place], h, &records[*place]);
        }
        if self.ways.len() > DENSE {
            return;
        }
        self.state(W);
        self.eliminate();
        for place in places {
            records[*place].unique = Some(Unique::All);
        }
        for (way, _) in self.ways.iter().zip(&self.is_free).filter(|(_, is_free)| **is_free) {
            let unique = &mut records[way.place].unique;
            let keeps_normal = !way.is_normal && *unique != Some(Unique::No);
            *unique = Some(if keeps_normal { Unique::Normal } else { Unique::No });
        }
    }

    /// The ways of a contact.
    fn list(&mut self, place: usize, contact: &Contact, h: f64, record: &ContactRecord) {
        let (row, count) = (contact.row, contact.law.rows());
        let mut add = |along: [f64; 3], is_normal| {
            self.ways.push(Way { place, row, along, is_normal });
        };
        let impulse = record.impulse;
        let grips = contact.coefficient() > 0.0;
        match (record.status, contact.law) {
            (ContactStatus::Slip, ContactLaw::Dry { .. }) => {} // it follows from the rate
            (ContactStatus::Open, _) => {
                let stays = contact.gamma * h <= contact.error(0.0, h) * h;
                if contact.law.restitution().is_some() && contact.is_closed() && stays {
                    add([1.0, 0.0, 0.0], true);
                }
            }
            (ContactStatus::Slip, _) if impulse[0] > 0.0 => {
                add(impulse.map(|own| own / impulse[0]), true);
            }
            (_, _) if count == 3 && grips => {
                add([1.0, 0.0, 0.0], true);
                add([0.0, 1.0, 0.0], false);
                add([0.0, 0.0, 1.0], false);
            }
            _ => add([1.0, 0.0, 0.0], true),
        }
    }

    /// `G`, scaled to a diagonal of one.
    fn state(&mut self, W: &Delassus) {
        let Self { ways, G, scales, .. } = self;
        let product = |a: &Way, b: &Way| -> f64 {
            let of = |way: Way| (0..3).filter(move |i| way.along[*i] != 0.0);
            let pairs = of(*a).flat_map(|i| of(*b).map(move |j| (i, j)));
            pairs.map(|(i, j)| a.along[i] * b.along[j] * W.at(a.row + i, b.row + j)).sum()
        };
        let m = ways.len();
        G.clear();
        for a in &*ways {
            G.extend(ways.iter().map(|b| product(a, b)));
        }
        scales.clear();
        scales.extend((0..m).map(|i| 1.0 / G[i * m + i].max(f64::MIN_POSITIVE).sqrt()));
        for i in 0..m {
            for j in 0..m {
                G[i * m + j] *= scales[i] * scales[j];
            }
        }
    }

    /// `is_free`: whether a null vector of `G` has a part along an unknown.
    fn eliminate(&mut self) {
        let Self { G, order, is_free, .. } = self;
        let m = self.ways.len();
        order.clear();
        order.extend(0..m);
        let mut rank = 0;
        while rank < m {
            let best = (rank..m).max_by(|a, b| {
                let [a, b] = [a, b].map(|i| G[order[*i] * m + order[*i]]);
                a.total_cmp(&b)
            });
            let Some(best) = best.filter(|i| G[order[*i] * m + order[*i]] > SMALL) else { break };
            order.swap(rank, best);
            let pivot = order[rank];
            // Gauss and Jordan: the rows of all other unknowns lose that of the pivot
            let diagonal = G[pivot * m + pivot];
            (0..m).for_each(|j| G[pivot * m + j] /= diagonal);
            for i in (0..m).filter(|i| *i != pivot) {
                let factor = G[i * m + pivot];
                for j in 0..m {
                    G[i * m + j] -= factor * G[pivot * m + j];
                }
            }
            rank += 1;
        }
        is_free.clear();
        is_free.resize(m, false);
        for &free in &order[rank..] {
            is_free[free] = true;
            for &pivot in &order[..rank] {
                is_free[pivot] |= G[pivot * m + free].abs() > NONE;
            }
        }
    }
}
