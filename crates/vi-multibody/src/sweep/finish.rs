//! The end of a step: coordinates, momenta, round-off.

use super::link::{Link, Work};
use super::place::{LinkPlace, balance, change, momenta};
use crate::geometry::matrix::Columns;
use crate::geometry::one_tree::three;
use crate::geometry::space::{Number, Space, Vector};
use crate::pair::constraints::PairConstraint;
use crate::tree::SLACK;
use vi_core::interval::rounding_error;

/// Coordinates at both ends of a step, and between them.
#[derive(Debug)]
pub(crate) struct StepEnds<'a, N> {
    pub(crate) h: f64,
    pub(crate) q0: &'a [N],
    /// Rounding error of `q_n`.
    pub(crate) compensation: &'a [N],
    pub(crate) q1: &'a mut [N],
    pub(crate) dq: &'a mut [N],
    /// `q_{n+1/2}` and `Δq/h`.
    pub(crate) middle: Option<[&'a mut [N]; 2]>,
}

/// A state that moves to the end of a step.
#[derive(Debug)]
pub(crate) struct Next<'a, N> {
    /// `q_{n+1}` without what round-off has added up.
    pub(crate) q: &'a mut [N],
    /// Its rounding error.
    pub(crate) rounding: &'a mut [N],
    /// `p̄`.
    pub(crate) p: &'a mut [N],
}

/// `q_{n+1}` of a link after its parent's, and `Δq`, from `q_n` and its rounding error.
#[inline(always)]
fn place_next<S: Space>(
    s: S,
    link: &Link<S::Store>,
    work: &Work<S::Store>,
    from: &LinkPlace<S::Vector>,
    error: [S::Vector; 4],
    parent: &LinkPlace<S::Vector>,
) -> (LinkPlace<S::Vector>, [S::Vector; 4]) {
    let (d, anchor) = (from.d, s.constant(&link.anchor));
    let change = change(s, work, &d, d.mul(anchor));
    let next = Columns(three!(i => d.0[i] + (change[i + 1] + error[i + 1])));
    let center = match link.closes_gap {
        true => {
            let arm = parent.d.mul(s.constant(&link.anchor_parent)); // ϱ¹
            parent.center + (arm - next.mul(anchor)) // no gap: φ² = φ¹ + ϱ¹ − ϱ²
        }
        false => from.center + (change[0] + error[0]),
    };
    (LinkPlace { center, d: next }, change)
}

/// `q_{n+1}`, `Δq`, `q_{n+1/2}`, `Δq/h` of the last [`advance`](super::advance::advance).
#[inline(always)]
pub(crate) fn close<S: Space>(
    s: S,
    links: &[Link<S::Store>],
    works: &[Work<S::Store>],
    mut ends: StepEnds<'_, Number<S>>,
) {
    let mut next = LinkPlace::ground(s); // of the link before
    for (link, work) in links.iter().zip(works) {
        if !link.follows_parent {
            next = LinkPlace::of_parent(s, link, ends.q1);
        }
        let error = s.read_frame(ends.compensation, link.frame);
        let from = LinkPlace::of(s, ends.q0, link.frame);
        let change;
        (next, change) = place_next(s, link, work, &from, error, &next);
        write(s, [from.vectors(), next.vectors(), change], link.frame, &mut ends);
    }
}

/// The coordinates of a frame in the interval, from those at the start, at the end and their
/// change.
#[inline(always)]
fn write<S: Space>(
    s: S,
    [from, to, change]: [[S::Vector; 4]; 3],
    first: usize,
    ends: &mut StepEnds<'_, Number<S>>,
) {
    s.write_frame(to, ends.q1, first);
    s.write_frame(change, ends.dq, first);
    let Some([q_mid, v_mid]) = &mut ends.middle else { return };
    let (mut mid, mut rates) = (from, change);
    for i in 0..4 {
        (mid[i], rates[i]) = (from[i] + change[i] * 0.5, change[i] / ends.h);
    }
    s.write_frame(mid, q_mid, first);
    s.write_frame(rates, v_mid, first);
}

/// Moves to the end of the step: the interval as by [`close`], `q_{n+1}` without what round-off has
/// added up and its rounding error. Where momenta depend on `Δq` and the `impulse` of constant
/// forces in half a step alone, `p̄_{n+1} = M Δq/h` and that, and the balance of each link with
/// these very momenta.
///
/// `clean` removes round-off from a link where it is called, of the trees whose bits are set, and
/// says of which it has. Returns the trees in which a link was not as it should be, a bit each.
#[inline(always)]
pub(crate) fn finish<S: Space>(
    s: S,
    links: &[Link<S::Store>],
    works: &mut [Work<S::Store>],
    mut clean: impl FnMut(usize, u8, &mut [Number<S>]) -> u8,
    impulse: Option<&[Number<S>]>,
    mut ends: StepEnds<'_, Number<S>>,
    state: Next<'_, Number<S>>,
) -> u8 {
    let rate = 1.0 / ends.h;
    let Next { q, rounding, p } = state;
    let (mut off, mut far) = (0, s.zero());
    let mut next = LinkPlace::ground(s); // of the link before
    for (k, link) in links.iter().enumerate() {
        if !link.follows_parent {
            next = LinkPlace::of_parent(s, link, ends.q1);
        }
        let (parent, at, work) = (next, link.frame, &works[k]);
        let from = LinkPlace::of(s, ends.q0, at);
        let error = s.read_frame(ends.compensation, at);
        let change;
        (next, change) = place_next(s, link, work, &from, error, &parent);
        let (start, end) = (from.vectors(), next.vectors());
        write(s, [start, end, change], at, &mut ends);
        far = far + next.center * 0.0; // not zero where it is not finite
        s.write_frame(end, q, at);
        s.write_frame(rounding_errors(start, end, change, error), rounding, at);
        let moved = link.parent.map_or(0, |parent| works[parent].cleaned);
        let own = moved | s.failing(is_in_place(s, link, &next, &parent));
        works[k].cleaned = if own == 0 { 0 } else { clean(k, own, q) };
        off |= own;
        if works[k].cleaned != 0 {
            for i in at..at + 12 {
                let change = ends.dq[i] + ends.compensation[i];
                rounding[i] = rounding_error([ends.q0[i], ends.q1[i]], change, q[i]);
            }
        }
        let Some(impulse) = impulse else { continue };
        let rest = move_momenta(s, link, change, s.read_frame(impulse, at), rate, p);
        let anchor = from.d.mul(s.constant(&link.anchor));
        works[k].wrench = balance(&from.d, anchor, rest).held();
    }
    off | s.failing(s.within(far, 0.0))
}

/// `p̄_{n+1}` of a link; returns its part of the balance, a difference of nearly equal numbers: it
/// is exact.
#[inline(always)]
fn move_momenta<S: Space>(
    s: S,
    link: &Link<S::Store>,
    change: [S::Vector; 4],
    impulse: [S::Vector; 4],
    rate: f64,
    p: &mut [Number<S>],
) -> [S::Vector; 4] {
    let (before, mut after, mut rest) = (s.read_frame(p, link.frame), impulse, impulse);
    let momenta = momenta(s, link, change, rate); // M Δq/h
    for i in 0..4 {
        rest[i] = (before[i] + impulse[i]) - momenta[i];
        after[i] = momenta[i] + impulse[i];
    }
    s.write_frame(after, p, link.frame);
    rest
}

/// [`rounding_error`] of a frame that is at the end of the step.
#[inline(always)]
fn rounding_errors<V: Vector>(start: [V; 4], end: [V; 4], change: [V; 4], error: [V; 4]) -> [V; 4] {
    let mut rounding = error;
    for i in 0..4 {
        let rest = (start[i] - end[i]) + (change[i] + error[i]);
        rounding[i] = rest.if_small(2.0 * f64::EPSILON, [start[i], end[i]]);
    }
    rounding
}

/// Whether the directors of a link, its axes and its gap show no more round-off than is left
/// anyway; the gap of a pair that closes it was removed with the parent where that is. The thread
/// of a screw is not checked here: it is never found in place.
#[inline(always)]
fn is_in_place<S: Space>(
    s: S,
    link: &Link<S::Store>,
    own: &LinkPlace<S::Vector>,
    parent: &LinkPlace<S::Vector>,
) -> S::Check {
    let [d1, d2, d3] = own.d.0;
    let one = s.vector([1.0; 3]);
    let lengths = S::Vector::dots([(d1, d1), (d2, d2), (d3, d3)]) - one;
    let angles = S::Vector::dots([(d1, d2), (d1, d3), (d2, d3)]);
    let mut in_place = s.both(s.within(lengths, SLACK), s.within(angles, SLACK));
    let (d, at) = (&own.d, &parent.d);
    for constraint in link.constraints {
        let off = match constraint {
            PairConstraint::NoGap => continue,
            PairConstraint::GapAlongAxis => across_axis(s, link, own, parent),
            PairConstraint::GapAcrossAxis => along_axis(s, link, at, own.gap(s, link, parent)),
            PairConstraint::ParallelAxes => off_axis(s, link, d, at, 2),
            PairConstraint::EqualAttitude => attitude(s, link, d, at),
            PairConstraint::OrthogonalAxes => cosine(s, link, d, at),
            PairConstraint::Thread => one,
        };
        in_place = s.both(in_place, s.within(off, SLACK));
    }
    in_place
}

/// Small rotation that brings axis `i` of a link onto that of its parent.
#[inline(always)]
fn off_axis<S: Space>(
    s: S,
    link: &Link<S::Store>,
    d: &Columns<S::Vector>,
    parent: &Columns<S::Vector>,
    i: usize,
) -> S::Vector {
    let axis = parent.mul(s.constant(&link.axes[i]));
    d.mul(s.constant(&link.axes_child[i])).cross(axis)
}

/// Small rotation that brings all axes of a link onto those of its parent.
#[inline(always)]
fn attitude<S: Space>(
    s: S,
    link: &Link<S::Store>,
    d: &Columns<S::Vector>,
    parent: &Columns<S::Vector>,
) -> S::Vector {
    let [first, second, third] = three!(i => off_axis(s, link, d, parent, i));
    ((first + second) + third) * 0.5
}

/// `n·m_1'`, three times.
#[inline(always)]
fn cosine<S: Space>(
    s: S,
    link: &Link<S::Store>,
    d: &Columns<S::Vector>,
    parent: &Columns<S::Vector>,
) -> S::Vector {
    let n = parent.mul(s.constant(&link.axes[2]));
    let cosine = n.dot(d.mul(s.constant(&link.axes_child[0])));
    n.of([cosine; 3])
}

/// The part of the gap across the axis.
#[inline(always)]
fn across_axis<S: Space>(
    s: S,
    link: &Link<S::Store>,
    own: &LinkPlace<S::Vector>,
    parent: &LinkPlace<S::Vector>,
) -> S::Vector {
    let gap = own.gap(s, link, parent);
    gap - along_axis(s, link, &parent.d, gap)
}

/// The part of a vector along the axis.
#[inline(always)]
fn along_axis<S: Space>(
    s: S,
    link: &Link<S::Store>,
    parent: &Columns<S::Vector>,
    v: S::Vector,
) -> S::Vector {
    let n = parent.mul(s.constant(&link.axes[2]));
    n.scaled(n.dot(v))
}
