//! Numbers of a member in and out of its lane, and the links of all members: topology in common,
//! numbers of each member in a lane.

use crate::geometry::matrix::{Screw, Spatial};
use crate::geometry::members::{EachMember, LanesVector};
use crate::geometry::one_tree::{Narrow, One, Xyz};
use crate::geometry::space::Vector as _;
use crate::sweep::link::Link;
use vi_core::lanes::{Lanes, Register};

/// The most lanes that there are.
pub(super) const MOST: usize = 8;

/// Reads the numbers of a lane.
pub(super) fn take_lane<L: Lanes>(all: &[L], lane: usize, own: &mut [f64]) {
    own.iter_mut().zip(all).for_each(|(own, all)| *own = all.at(lane));
}

/// Writes the numbers of a lane.
pub(super) fn put_lane<L: Lanes>(own: &[f64], lane: usize, all: &mut [L]) {
    all.iter_mut().zip(own).for_each(|(all, own)| all.set(lane, *own));
}

/// Writes a vector to a lane.
fn put_vector<L: Lanes>(own: Xyz<Narrow>, lane: usize, all: &mut LanesVector<L>) {
    put_lane(&own.components(), lane, &mut all.0);
}

/// Writes a wrench to a lane.
pub(super) fn put_screw<L: Lanes>(
    own: Screw<Xyz<Narrow>>,
    lane: usize,
    all: &mut Screw<LanesVector<L>>,
) {
    put_vector(own.linear, lane, &mut all.linear);
    put_vector(own.angular, lane, &mut all.angular);
}

/// Adds a wrench to a lane.
pub(super) fn add_screw<L: Lanes>(
    own: Screw<Xyz<Narrow>>,
    lane: usize,
    all: &mut Screw<LanesVector<L>>,
) {
    for (all, own) in [(&mut all.linear, own.linear), (&mut all.angular, own.angular)] {
        for (all, own) in all.0.iter_mut().zip(own.components()) {
            all.set(lane, all.at(lane) + own);
        }
    }
}

/// Writes a 6×6 matrix to a lane.
pub(super) fn put_spatial<L: Lanes>(
    own: Spatial<Xyz<Narrow>>,
    lane: usize,
    all: &mut Spatial<LanesVector<L>>,
) {
    let Spatial { ll, la, al, aa } = own;
    let all = [(ll, &mut all.ll), (la, &mut all.la), (al, &mut all.al), (aa, &mut all.aa)];
    for (own, all) in all {
        own.0.into_iter().zip(&mut all.0).for_each(|(own, all)| put_vector(own, lane, all));
    }
}

/// Whether two links differ in numbers only.
fn are_alike(a: &Link<One>, b: &Link<One>) -> bool {
    (a.motion, a.constraints) == (b.motion, b.constraints)
        && (a.parent, a.frame, a.unknown) == (b.parent, b.frame, b.unknown)
        && a.is_diagonal == b.is_diagonal
}

/// The links of the members, as many as there are lanes; `None` where they do not have one
/// topology.
pub(super) fn links<T: Register>(
    lanes: T,
    members: &[&[Link<One>]],
) -> Option<Vec<Link<EachMember<T::Lanes>>>> {
    let first = members[0];
    let alike = |other: &&[Link<One>]| {
        other.len() == first.len() && first.iter().zip(*other).all(|(a, b)| are_alike(a, b))
    };
    if !members.iter().all(alike) {
        return None;
    }
    let link = |i: usize| {
        first[i].with_constants(|of| {
            lanes.gather(
                #[inline(always)]
                |k| of(&members[k][i]),
            )
        })
    };
    Some((0..first.len()).map(link).collect())
}
