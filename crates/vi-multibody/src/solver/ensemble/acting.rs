//! What acts along the unknowns of members: springs, dampers and motors, each member's its own.

use super::link::{MOST, put_lane, take_lane};
use crate::geometry::one_tree::One;
use crate::solver::efforts::{Efforts, Times};
use crate::sweep::link::Link;
use vi_core::lanes::Lanes;
use vi_core::{Configuration, SeparableSystem};

/// Of all members of a group, lane by lane.
#[derive(Debug)]
pub(super) struct Acting {
    efforts: Vec<Efforts>, // of the lanes in use
    times: [Times; MOST],
    numbers: Vec<f64>,  // d  of one lane
    momentum: Vec<f64>, // n
    q: Vec<f64>,        // n
}

impl Acting {
    /// `None` where nothing acts along any unknown.
    pub(super) fn new(
        members: &[(&[Link<One>], &SeparableSystem)],
        unknowns: usize,
    ) -> Option<Self> {
        let acts = members.iter().any(|(_, system)| system.along_unknowns().next().is_some());
        let n = members[0].1.constant_force().len();
        acts.then(|| Self {
            efforts: members.iter().map(|(links, system)| Efforts::new(links, system)).collect(),
            times: [Times::default(); MOST],
            numbers: vec![0.0; unknowns],
            momentum: vec![0.0; n],
            q: vec![0.0; n],
        })
    }

    /// Whether Newton's method of a lane sees affine functions alone.
    pub(super) fn is_affine(&self, lane: usize) -> bool {
        self.efforts.get(lane).is_none_or(Efforts::are_affine)
    }

    /// Opens a sub-step of a lane.
    pub(super) fn open(
        &mut self,
        (lane, system): (usize, &SeparableSystem),
        at: Configuration<'_>,
        h: f64,
    ) {
        self.times[lane] = Times { middle: at.t + 0.5 * h, h };
        self.efforts[lane].begin(system, at);
    }

    /// `r ← r + σ (h/2) τ` at the increments `u`.
    pub(super) fn add_balance<'a, L: Lanes>(
        &mut self,
        systems: impl Iterator<Item = &'a SeparableSystem>,
        u: &[L],
        r: &mut [L],
    ) {
        let Self { efforts, times, numbers, .. } = self;
        for (lane, (efforts, system)) in efforts.iter_mut().zip(systems).enumerate() {
            take_lane(u, lane, numbers);
            efforts.evaluate(system, times[lane], numbers);
        }
        self.add_last_balance(r);
    }

    /// The same of the last evaluation.
    pub(super) fn add_last_balance<L: Lanes>(&mut self, r: &mut [L]) {
        let Self { efforts, numbers, .. } = self;
        for (lane, efforts) in efforts.iter().enumerate() {
            take_lane(r, lane, numbers);
            efforts.add_balance(numbers);
            put_lane(numbers, lane, r);
        }
    }

    /// What lane, link, unknown and slope are given to `add`.
    pub(super) fn slopes<'a>(
        &mut self,
        systems: impl Iterator<Item = &'a SeparableSystem>,
        mut add: impl FnMut(usize, usize, usize, f64),
    ) {
        for (lane, (efforts, system)) in self.efforts.iter_mut().zip(systems).enumerate() {
            let own = |link, unknown, slope| add(lane, link, unknown, slope);
            efforts.slopes(system, self.times[lane], own);
        }
    }

    /// `p ← p + (h/2) τ ∇θ(q)` of a lane.
    pub(super) fn add_momentum<L: Lanes>(
        &mut self,
        (lane, system): (usize, &SeparableSystem),
        q: &[L],
        p: &mut [L],
    ) {
        take_lane(q, lane, &mut self.q);
        take_lane(p, lane, &mut self.momentum);
        self.efforts[lane].add_momentum(system, &self.q, &mut self.momentum);
        put_lane(&self.momentum, lane, p);
    }
}
