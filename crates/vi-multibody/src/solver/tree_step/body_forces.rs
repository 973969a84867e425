//! What acts on the bodies of a tree beside constant forces and along no unknown: springs and
//! dampers between points, loads, any function of the coordinates.
//!
//! Each body feels it for itself: potentials that couple two bodies are not for the sweeps of a
//! step.

use super::emitted::{Emitted, wrench};
use crate::geometry::matrix::{Screw, Spatial};
use crate::geometry::one_tree::{HeldVector, Narrow, One, Xyz};
use crate::mechanism::Mechanism;
use crate::solver::body_blocks::couples_bodies;
use crate::sweep::link::Link;
use crate::tree::Tree;
use vi_core::interval::Interval;
use vi_core::sparse::Entries;
use vi_core::{DiscreteLagrangian, MechanicalSystem, SeparableSystem};

/// The step in which nothing has moved yet.
pub(in crate::solver) fn initial_interval(mechanism: &Mechanism) -> Interval {
    let q = mechanism.initial_configuration();
    let mut s = Interval::new(q.len());
    s.open(0.0, 1.0, &q);
    s
}

/// Variable forces on bodies; links are those of the system's tree.
#[derive(Debug)]
pub(in crate::solver) struct BodyForces {
    apart: Vec<usize>, // forces that are added elsewhere
    balance: Vec<f64>, // n  their part of D_1 L_d + f_d^-
    emitted: Emitted,  // −h times their part of A_α
}

impl BodyForces {
    /// Whether each body feels them for itself, but for the forces `apart`.
    pub(in crate::solver) fn apply(
        mechanism: &Mechanism,
        system: &SeparableSystem,
        apart: &[usize],
    ) -> bool {
        if !system.has_other_forces(apart) {
            return true;
        }
        let s = initial_interval(mechanism);
        !couples_bodies(&|out: &mut dyn Entries| system.other_d2_d1(&s, apart, out))
    }

    /// Whether bodies feel one force together.
    pub(in crate::solver) fn couples(system: &SeparableSystem, s: &Interval, force: usize) -> bool {
        couples_bodies(&|out: &mut dyn Entries| system.force_d2(force, s, out))
    }

    /// `None` where there are none.
    pub(in crate::solver) fn new(
        mechanism: &Mechanism,
        system: &SeparableSystem,
        apart: &[usize],
    ) -> Option<Self> {
        system.has_other_forces(apart).then(|| Self {
            apart: apart.to_vec(),
            balance: vec![0.0; system.dim()],
            emitted: Emitted::new(mechanism.tree().links().len(), 0),
        })
    }

    /// Their part of the balance of each link, about its reference point.
    pub(in crate::solver) fn wrenches(
        &mut self,
        system: &SeparableSystem,
        s: &Interval,
        links: &[Link<One>],
        mut add: impl FnMut(usize, Screw<Xyz<Narrow>>),
    ) {
        system.other_d1(s, &self.apart, &mut self.balance);
        for (k, link) in links.iter().enumerate() {
            add(k, wrench(link, &s.q0, &self.balance));
        }
    }

    /// `p̄_n + D_1 L_d + f_d^-` of all that acts, as momenta have it; `p`: `p̄_n`.
    pub(in crate::solver) fn rest(
        &mut self,
        system: &SeparableSystem,
        s: &Interval,
        p: &[f64],
    ) -> &[f64] {
        system.forced_d1(s, &mut self.balance);
        self.balance.iter_mut().zip(p).for_each(|(balance, p)| *balance += p);
        &self.balance
    }

    /// Finds the blocks of their part of `D_2(D_1 L_d + f_d^-)`.
    pub(in crate::solver) fn assemble(
        &mut self,
        system: &SeparableSystem,
        s: &Interval,
        tree: &Tree,
        links: &[Link<One>],
    ) {
        let Self { apart, emitted, .. } = self;
        let other = |out: &mut dyn Entries| system.other_d2_d1(s, apart, out);
        emitted.assemble(&other, tree, links, [&s.q0, &s.q1], -s.h);
    }

    /// `−h A_α` of them, of each link about its reference point.
    pub(in crate::solver) fn blocks(&self) -> &[Spatial<HeldVector>] {
        &self.emitted.blocks
    }
}
