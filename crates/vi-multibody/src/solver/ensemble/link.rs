//! Links of all members of an ensemble: topology in common, numbers of each member in a lane.

use crate::geometry::lane_vectors::three;
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
        let (own, of) = (&first[i], |k: usize| &members[k][i]);
        let vector = |of: &dyn Fn(usize) -> [f64; 3]| three(|i| lanes.gather(|k| of(k)[i]));
        Link {
            constraints: own.constraints,
            motion: own.motion,
            closes_gap: own.closes_gap,
            parent: own.parent,
            follows_parent: own.follows_parent,
            slot: own.slot,
            writes_first: own.writes_first,
            frame: own.frame,
            parent_frame: own.parent_frame,
            unknown: own.unknown,
            is_diagonal: own.is_diagonal,
            pitch: lanes.gather(|k| of(k).pitch),
            lever: vector(&|k| of(k).lever),
            axes: three(|j| vector(&|k| of(k).axes[j])),
            axes_child: three(|j| vector(&|k| of(k).axes_child[j])),
            anchor_parent: vector(&|k| of(k).anchor_parent),
            anchor: vector(&|k| of(k).anchor),
            mass: [0, 1, 2, 3].map(|r| [0, 1, 2, 3].map(|c| lanes.gather(|k| of(k).mass[r][c]))),
            moment: vector(&|k| of(k).moment),
            euler: three(|j| vector(&|k| of(k).euler[j])),
        }
    };
    Some((0..first.len()).map(link).collect())
}
