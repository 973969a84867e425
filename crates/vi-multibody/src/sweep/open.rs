//! Everything at `q_n`.

use super::columns::{Axis, Motion};
use super::link::{ColumnWork, Link, Work};
use super::place::{Place, balance};
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
        let (own, at) = (Place::of(s, q, link.frame), Place::of_parent(s, link, q));
        let (d, parent) = (own.d, at.d);
        let anchor = d.mul(s.constant(&link.anchor));
        let mut lever = parent.mul(s.constant(&link.lever));
        if !link.closes_gap {
            lever = lever + own.gap(s, link, &at); // the slide
        }
        let euler = Columns(three!(j => s.constant(&link.euler[j])));
        work.column.axis = parent.mul(s.constant(&link.axes[2])).held();
        work.lever = lever.held();
        work.moment = d.mul(s.constant(&link.moment)).held();
        work.euler = d.times(&euler).times_transposed(&d).held(); // E = D E_b Dᵀ
        let (p, impulse) = (s.read_frame(p, link.frame), s.read_frame(impulse, link.frame));
        let known = [p[0] + impulse[0], p[1] + impulse[1], p[2] + impulse[2], p[3] + impulse[3]];
        work.start = balance(&d, anchor, known).held();
    }
    if !columns.is_empty() {
        open_columns(s, links, columns, q);
    }
}

/// The axes of joints of several columns.
#[inline(always)]
fn open_columns<S: Space>(
    s: S,
    links: &[Link<S::Store>],
    columns: &mut [ColumnWork<S::Store>],
    q: &[Number<S>],
) {
    for link in links {
        let Motion::Several(several) = link.motion else {
            continue;
        };
        let (own, parent) = (Place::of(s, q, link.frame), Place::of_parent(s, link, q));
        for (column, work) in several.iter().zip(&mut columns[link.unknown..]) {
            let axis = match column.axis {
                Axis::Parent(i) => parent.d.mul(s.constant(&link.axes[i])),
                Axis::Child(i) => own.d.mul(s.constant(&link.axes_child[i])),
            };
            work.axis = axis.held();
        }
    }
}
