//! Everything at `q_n`.

use super::columns::{Axis, Motion};
use super::link::{ColumnWork, Link, Work};
use super::place::{LinkPlace, balance};
use crate::geometry::matrix::Columns;
use crate::geometry::one_tree::three;
use crate::geometry::space::{Number, Space, Vector};

/// Axes, levers and inertia at `q_n`; `at`: `q_n`, `p̄_n`, the impulse of constant forces in half a
/// step.
#[inline(always)]
pub(crate) fn open<S: Space>(
    s: S,
    links: &[Link<S::Store>],
    works: &mut [Work<S::Store>],
    columns: &mut [ColumnWork<S::Store>],
    [q, p, impulse]: [&[Number<S>]; 3],
) {
    for (link, work) in links.iter().zip(works) {
        let (own, at) = (LinkPlace::of(s, q, link.frame), LinkPlace::of_parent(s, link, q));
        open_joint(s, link, work, &own, &at);
        open_inertia(s, link, work, &own.d);
        let anchor = own.d.mul(s.constant(&link.anchor));
        let (p, impulse) = (s.read_frame(p, link.frame), s.read_frame(impulse, link.frame));
        let known = [p[0] + impulse[0], p[1] + impulse[1], p[2] + impulse[2], p[3] + impulse[3]];
        work.start = balance(&own.d, anchor, known).held();
    }
    open_columns(s, links, columns, q);
}

/// Axes and levers at `q`.
#[inline(always)]
pub(crate) fn open_joints<S: Space>(
    s: S,
    links: &[Link<S::Store>],
    works: &mut [Work<S::Store>],
    columns: &mut [ColumnWork<S::Store>],
    q: &[Number<S>],
) {
    for (link, work) in links.iter().zip(works) {
        let (own, at) = (LinkPlace::of(s, q, link.frame), LinkPlace::of_parent(s, link, q));
        open_joint(s, link, work, &own, &at);
    }
    open_columns(s, links, columns, q);
}

/// Axes, levers and inertia at `q`, at both ends of a motion that stays there.
#[inline(always)]
pub(crate) fn open_at_rest<S: Space>(
    s: S,
    links: &[Link<S::Store>],
    works: &mut [Work<S::Store>],
    columns: &mut [ColumnWork<S::Store>],
    q: &[Number<S>],
) {
    for (link, work) in links.iter().zip(works) {
        let (own, at) = (LinkPlace::of(s, q, link.frame), LinkPlace::of_parent(s, link, q));
        open_joint(s, link, work, &own, &at);
        open_inertia(s, link, work, &own.d);
        (work.lever_next, work.column.axis_next) = (work.lever, work.column.axis);
    }
    open_columns(s, links, columns, q);
    columns.iter_mut().for_each(|column| column.axis_next = column.axis);
}

/// Axes, levers and inertia at the end `q_{n+1}` of a step, and the motion from there back to
/// `q_n`: what follows solves with the transposed matrix of the step.
#[inline(always)]
pub(crate) fn open_back<S: Space>(
    s: S,
    links: &[Link<S::Store>],
    works: &mut [Work<S::Store>],
    columns: &mut [ColumnWork<S::Store>],
    [q0, q1]: [&[Number<S>]; 2],
) {
    for (link, work) in links.iter().zip(works) {
        let (to, parent) = (LinkPlace::of(s, q0, link.frame), LinkPlace::of_parent(s, link, q0));
        open_joint(s, link, work, &to, &parent);
        (work.lever_next, work.column.axis_next) = (work.lever, work.column.axis);
        let (own, parent) = (LinkPlace::of(s, q1, link.frame), LinkPlace::of_parent(s, link, q1));
        open_joint(s, link, work, &own, &parent);
        open_inertia(s, link, work, &own.d);
        work.turn = to.d.times_transposed(&own.d).minus(&Columns::identity(s)).held();
    }
    open_columns(s, links, columns, q0);
    columns.iter_mut().for_each(|column| column.axis_next = column.axis);
    open_columns(s, links, columns, q1);
}

/// Axis and lever of a link that is at `own`, its parent `at`.
#[inline(always)]
fn open_joint<S: Space>(
    s: S,
    link: &Link<S::Store>,
    work: &mut Work<S::Store>,
    own: &LinkPlace<S::Vector>,
    at: &LinkPlace<S::Vector>,
) {
    let mut lever = at.d.mul(s.constant(&link.lever));
    if !link.closes_gap {
        lever = lever + own.gap(s, link, at); // the slide
    }
    work.column.axis = at.d.mul(s.constant(&link.axes[2])).held();
    work.lever = lever.held();
}

/// Inertia of a link with the directors `d` about its reference point.
#[inline(always)]
fn open_inertia<S: Space>(
    s: S,
    link: &Link<S::Store>,
    work: &mut Work<S::Store>,
    d: &Columns<S::Vector>,
) {
    let euler = Columns(three!(j => s.constant(&link.euler[j])));
    work.moment = d.mul(s.constant(&link.moment)).held();
    work.euler = d.times(&euler).times_transposed(d).held(); // E = D E_b Dᵀ
}

/// The axes of joints of several columns.
#[inline(always)]
fn open_columns<S: Space>(
    s: S,
    links: &[Link<S::Store>],
    columns: &mut [ColumnWork<S::Store>],
    q: &[Number<S>],
) {
    if columns.is_empty() {
        return;
    }
    for link in links {
        let Motion::Several(several) = link.motion else {
            continue;
        };
        let (own, parent) = (LinkPlace::of(s, q, link.frame), LinkPlace::of_parent(s, link, q));
        for (column, work) in several.iter().zip(&mut columns[link.unknown..]) {
            let axis = match column.axis {
                Axis::Parent(i) => parent.d.mul(s.constant(&link.axes[i])),
                Axis::Child(i) => own.d.mul(s.constant(&link.axes_child[i])),
            };
            work.axis = axis.held();
        }
    }
}
