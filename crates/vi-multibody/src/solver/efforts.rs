//! Springs, dampers and motors on joint coordinates of the tree.
//!
//! ```text
//! r_j += σ (h/2) τ,   −h A_jj += −h ∂/∂u_j [σ (h/2) τ]
//! p̄_{n+1} += (h/2) τ ∇θ(q_{n+1})
//! ```
//! with `τ` of [`vi_core::coordinate_force`]: each acts on its own unknown, whatever bodies the
//! joint connects.

use crate::geometry::one_tree::One;
use crate::sweep::link::Link;
use vi_core::coordinate_force::SignedUnknown;
use vi_core::interval::Interval;
use vi_core::{Configuration, SeparableSystem};

/// A joint coordinate during a step, and all that acts along it.
#[derive(Clone, Copy, Debug)]
struct CoordinateInStep {
    unknown: SignedUnknown,
    link: usize,
    start: f64,   // θ(q_n)
    mean: f64,    // θ̄
    rate: f64,    // Δθ/h
    impulse: f64, // (h/2) τ
    slope: f64,   // −h ∂/∂u [σ (h/2) τ]
}

/// Times of a step, s.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::solver) struct StepTimes {
    pub(in crate::solver) middle: f64,
    pub(in crate::solver) h: f64,
}

impl StepTimes {
    pub(in crate::solver) fn of(s: &Interval) -> Self {
        Self { middle: s.t_mid(), h: s.h }
    }
}

/// What acts along unknowns.
#[derive(Clone, Debug)]
pub(in crate::solver) struct Efforts {
    all: Vec<CoordinateInStep>,
    of: Vec<usize>, // where the coordinate of each of [`SeparableSystem::along_unknowns`] stands
    is_affine: bool,
}

impl Efforts {
    pub(in crate::solver) fn new(links: &[Link<One>], system: &SeparableSystem) -> Self {
        let (mut all, mut of): (Vec<CoordinateInStep>, _) = (Vec::new(), Vec::new());
        let mut known = vec![None; links.last().map_or(0, |last| last.unknown + 6)];
        for own in system.along_unknowns() {
            let unknown = own.unknown;
            let at = *known[unknown.index].get_or_insert(all.len());
            if at == all.len() {
                let link = links.partition_point(|link| link.unknown <= unknown.index) - 1;
                let [start, mean, rate, impulse, slope] = [0.0; 5];
                all.push(CoordinateInStep { unknown, link, start, mean, rate, impulse, slope });
            }
            debug_assert_eq!(all[at].unknown, unknown, "one joint, one sign");
            of.push(at);
        }
        let is_affine = system.along_unknowns().all(|own| own.force.is_affine());
        Self { all, of, is_affine }
    }

    /// Whether they are affine functions of the increments.
    pub(in crate::solver) fn are_affine(&self) -> bool {
        self.is_affine
    }

    /// `θ(q_n)`.
    pub(in crate::solver) fn begin(&mut self, system: &SeparableSystem, at: Configuration<'_>) {
        for (k, own) in self.of.iter().zip(system.along_unknowns()) {
            self.all[*k].start = own.force.coordinate(at);
        }
    }

    /// `(h/2) τ` at the increments `u`.
    pub(in crate::solver) fn evaluate(
        &mut self,
        system: &SeparableSystem,
        StepTimes { middle, h }: StepTimes,
        u: &[f64],
    ) {
        let Self { all, of, .. } = self;
        for along in &mut *all {
            let change = along.unknown.sign * u[along.unknown.index];
            (along.mean, along.rate) = (along.start + 0.5 * change, change / h);
            along.impulse = 0.0;
        }
        for (at, own) in of.iter().zip(system.along_unknowns()) {
            let along = &mut all[*at];
            along.impulse += 0.5 * h * own.force.effort(middle, along.mean, along.rate);
        }
    }

    /// `r ← r + σ (h/2) τ`.
    pub(in crate::solver) fn add_balance(&self, r: &mut [f64]) {
        for along in &self.all {
            r[along.unknown.index] += along.unknown.sign * along.impulse;
        }
    }

    /// What they add to the matrix, for each link and unknown.
    pub(in crate::solver) fn slopes(
        &mut self,
        system: &SeparableSystem,
        StepTimes { middle, h }: StepTimes,
        mut add: impl FnMut(usize, usize, f64),
    ) {
        self.all.iter_mut().for_each(|along| along.slope = 0.0);
        for (at, own) in self.of.iter().zip(system.along_unknowns()) {
            let along = &mut self.all[*at];
            let slopes = own.force.slopes(middle, along.mean, along.rate);
            along.slope += -h * slopes.by_unknown(h);
        }
        self.all.iter().for_each(|along| add(along.link, along.unknown.index, along.slope));
    }

    /// `p ← p + (h/2) τ ∇θ(q)`.
    pub(in crate::solver) fn add_momentum(
        &mut self,
        system: &SeparableSystem,
        q: &[f64],
        p: &mut [f64],
    ) {
        for (at, own) in self.of.iter().zip(system.along_unknowns()) {
            let impulse = std::mem::take(&mut self.all[*at].impulse); // of all on this coordinate
            if impulse != 0.0 {
                own.force.add_gradient(q, impulse, p);
            }
        }
    }
}
