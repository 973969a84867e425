//! Springs, dampers and motors on joint coordinates of the tree.
//!
//! ```text
//! r_j += σ (h/2) τ,   −h A_jj += −h ∂/∂u_j [σ (h/2) τ]
//! p̄_{n+1} += (h/2) τ ∇θ(q_{n+1})
//! ```
//! with `τ` of [`vi_core::coordinate_force`]: each acts on its own unknown, whatever bodies the
//! joint connects.

use crate::geometry::one_tree::One;
use crate::sweep::columns::Motion;
use crate::sweep::link::{ColumnWork, Link, Work};
use vi_core::SeparableSystem;
use vi_core::coordinate_force::SignedUnknown;
use vi_core::interval::Interval;
use vi_core::state::State;

/// A joint coordinate during a step, and all that acts along it.
#[derive(Clone, Copy, Debug)]
struct Along {
    unknown: SignedUnknown,
    link: usize,
    start: f64,   // θ(q_n)
    mean: f64,    // θ̄
    rate: f64,    // Δθ/h
    impulse: f64, // (h/2) τ
}

/// What acts along unknowns.
#[derive(Debug)]
pub(super) struct Efforts {
    all: Vec<Along>,
    of: Vec<usize>, // where the coordinate of each of [`SeparableSystem::along_unknowns`] stands
    is_affine: bool,
}

impl Efforts {
    pub(super) fn new(links: &[Link<One>], system: &SeparableSystem) -> Self {
        let (mut all, mut of): (Vec<Along>, _) = (Vec::new(), Vec::new());
        let mut known = vec![None; links.last().map_or(0, |last| last.unknown + 6)];
        for own in system.along_unknowns() {
            let unknown = own.unknown;
            let at = *known[unknown.index].get_or_insert(all.len());
            if at == all.len() {
                let link = links.partition_point(|link| link.unknown <= unknown.index) - 1;
                let [start, mean, rate, impulse] = [0.0; 4];
                all.push(Along { unknown, link, start, mean, rate, impulse });
            }
            debug_assert_eq!(all[at].unknown, unknown, "one joint, one sign");
            of.push(at);
        }
        let is_affine = system.along_unknowns().all(|own| own.force.is_affine());
        Self { all, of, is_affine }
    }

    /// Whether they are affine functions of the increments.
    pub(super) fn are_affine(&self) -> bool {
        self.is_affine
    }

    /// `θ(q_n)`.
    pub(super) fn begin(&mut self, system: &SeparableSystem, state: &State) {
        for (at, own) in self.of.iter().zip(system.along_unknowns()) {
            self.all[*at].start = own.force.coordinate(state.configuration());
        }
    }

    /// `(h/2) τ` at the increments `u`.
    pub(super) fn evaluate(&mut self, system: &SeparableSystem, s: &Interval, u: &[f64]) {
        let Self { all, of, .. } = self;
        for along in &mut *all {
            let change = along.unknown.sign * u[along.unknown.index];
            (along.mean, along.rate) = (along.start + 0.5 * change, change / s.h);
            along.impulse = 0.0;
        }
        for (at, own) in of.iter().zip(system.along_unknowns()) {
            let along = &mut all[*at];
            along.impulse += 0.5 * s.h * own.force.effort(s.t_mid(), along.mean, along.rate);
        }
    }

    /// `r ← r + σ (h/2) τ`.
    pub(super) fn add_balance(&self, r: &mut [f64]) {
        for along in &self.all {
            r[along.unknown.index] += along.unknown.sign * along.impulse;
        }
    }

    /// Writes what they add to the matrix to their columns.
    pub(super) fn assemble(
        &self,
        system: &SeparableSystem,
        s: &Interval,
        (links, works, columns): (&[Link<One>], &mut [Work<One>], &mut [ColumnWork<One>]),
    ) {
        let mut add = |along: &Along, slope: Option<f64>| {
            let column = match links[along.link].motion {
                Motion::Several(_) => &mut columns[along.unknown.index],
                _ => &mut works[along.link].column,
            };
            column.slope = slope.map_or(0.0, |slope| column.slope + slope);
        };
        self.all.iter().for_each(|along| add(along, None));
        for (at, own) in self.of.iter().zip(system.along_unknowns()) {
            let along = &self.all[*at];
            let slopes = own.force.slopes(s.t_mid(), along.mean, along.rate);
            add(along, Some(-s.h * slopes.by_unknown(s.h)));
        }
    }

    /// `p ← p + (h/2) τ ∇θ(q)`.
    pub(super) fn add_momentum(&mut self, system: &SeparableSystem, q: &[f64], p: &mut [f64]) {
        for (at, own) in self.of.iter().zip(system.along_unknowns()) {
            let impulse = std::mem::take(&mut self.all[*at].impulse); // of all on this coordinate
            if impulse != 0.0 {
                own.force.add_gradient(q, impulse, p);
            }
        }
    }
}
