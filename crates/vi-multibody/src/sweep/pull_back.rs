//! Leaf → root: the balances of all links along their joints, `Pᵀ w`.

use super::columns::{Act, Motion};
use super::link::{ColumnWork, Link, Work};
use crate::geometry::matrix::Screw;
use crate::geometry::space::{Number, Space, Vector};

/// `r ← P(q_n)ᵀ` of the balances of all links; `P(q_{n+1})ᵀ` where matrices are symmetric.
#[inline(always)]
pub(crate) fn pull_back<S: Space>(
    s: S,
    links: &[Link<S::Store>],
    works: &mut [Work<S::Store>],
    columns: &[ColumnWork<S::Store>],
    r: &mut [Number<S>],
) {
    let mut carried = Screw::zero(s); // by the link before
    for (k, link) in links.iter().enumerate().rev() {
        let work = &works[k];
        let mut wrench = work.wrench.take(s).plus(carried);
        carried = Screw::zero(s);
        match link.motion {
            Motion::Fixed => {}
            Motion::Along(act) => {
                r[link.unknown] = component(s, link, act, &work.column, wrench);
            }
            Motion::Several(several) => {
                for (unknown, column) in (link.unknown..).zip(several) {
                    r[unknown] = component(s, link, column.act, &columns[unknown], wrench);
                }
            }
            Motion::Spherical => {
                s.write(wrench.angular, r, link.unknown);
                wrench.angular = s.zero(); // no torque passes
            }
            Motion::Free => {
                s.write(wrench.linear, r, link.unknown);
                s.write(wrench.angular, r, link.unknown + 3);
            }
        }
        if link.parent.is_some() {
            let transmitted = wrench.at_start_of(lever(s, work)); // (75)
            hand_on(s, link, works, transmitted, &mut carried);
        }
    }
}

/// Gives the wrench that a joint transmits to the parent of its link: in `carried` where that is
/// next, otherwise in its sum.
#[inline(always)]
pub(super) fn hand_on<S: Space>(
    s: S,
    link: &Link<S::Store>,
    works: &mut [Work<S::Store>],
    transmitted: Screw<S::Vector>,
    carried: &mut Screw<S::Vector>,
) {
    let Some(parent) = link.parent else { return };
    if link.follows_parent {
        *carried = transmitted;
    } else {
        works[parent].wrench = works[parent].wrench.take(s).plus(transmitted).held();
    }
}

/// `S_jᵀ b`.
#[inline(always)]
pub(super) fn component<S: Space>(
    s: S,
    link: &Link<S::Store>,
    act: Act,
    work: &ColumnWork<S::Store>,
    b: Screw<S::Vector>,
) -> Number<S> {
    let axis = s.take(if S::SYMMETRIC { &work.axis_next } else { &work.axis });
    match act {
        Act::Turn => axis.dot(b.angular),
        Act::Slide => axis.dot(b.linear),
        Act::Screw => axis.dot(b.angular) + s.factor(link.pitch) * axis.dot(b.linear),
    }
}

/// The lever of `X`.
#[inline(always)]
pub(super) fn lever<S: Space>(s: S, work: &Work<S::Store>) -> S::Vector {
    s.take(if S::SYMMETRIC { &work.lever_next } else { &work.lever })
}
