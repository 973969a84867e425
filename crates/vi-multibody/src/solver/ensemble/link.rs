//! Links of all members of an ensemble: topology in common, numbers of each member in a lane.

use crate::geometry::members::Each;
use crate::geometry::one_tree::One;
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
    all.iter_mut().zip(own).for_each(|(all, own)| *all = all.with(lane, *own));
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
) -> Option<Vec<Link<Each<T::Lanes>>>> {
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
