//! Leaf → root: elimination of another right-hand side, by the factors of symmetric matrices.
#![allow(non_snake_case)] // G, S

use super::columns::{Act, Motion};
use super::eliminate::EliminatedRotation;
use super::link::{ColumnWork, Gain, Link, Work};
use super::pull_back::{component, lever};
use crate::geometry::matrix::Screw;
use crate::geometry::space::{Number, Space};

/// `x ← u_k` as by [`eliminate`](super::eliminate::eliminate) before, where `S = S'`: `Ã S' =
/// (Sᵀ Ã)ᵀ`.
#[inline(always)]
pub(crate) fn eliminate_side<S: Space>(
    s: S,
    links: &[Link<S::Store>],
    works: &mut [Work<S::Store>],
    (columns, gains, rotations): (
        &[ColumnWork<S::Store>],
        &[Gain<S::Store>],
        &[EliminatedRotation<S::Store>],
    ),
    x: &mut [Number<S>],
) {
    let mut p = Screw::zero(s); // of the child just after
    for (k, link) in links.iter().enumerate().rev() {
        let work = &mut works[k];
        if link.slot.is_some() {
            p = p.plus(work.wrench.take(s)); // of the other children
            work.wrench = Screw::zero(s).held();
        }
        match link.motion {
            Motion::Fixed => {}
            Motion::Along(act) => pass(s, link, act, &work.column, &mut x[link.unknown], &mut p),
            Motion::Several(several) => {
                for (j, column) in several.iter().enumerate().rev() {
                    let unknown = link.unknown + j;
                    let (own, u) = (&columns[unknown], &mut x[unknown]);
                    pass(s, link, column.act, own, u, &mut p);
                }
            }
            Motion::Spherical => {
                let of = (&gains[k], &rotations[k]);
                p = rotate(s, of, &mut x[link.unknown..], p);
            }
            Motion::Free => {
                let (velocity, spin) = x[link.unknown..].split_at_mut(3);
                let force =
                    s.read(velocity, 0) - rotate(s, (&gains[k], &rotations[k]), spin, p).linear;
                s.write(rotations[k].translation.take(s).mul(force), velocity, 0);
            }
        }
        let transmitted = p.at_start_of(lever(s, work));
        p = Screw::zero(s);
        match link.parent {
            Some(_) if link.follows_parent => p = transmitted,
            Some(parent) => {
                works[parent].wrench = works[parent].wrench.take(s).plus(transmitted).held();
            }
            None => {}
        }
    }
}

/// `u ← u − Sᵀ p` and `p ← p + Ã S' D⁻¹ u` of one column.
#[inline(always)]
fn pass<S: Space>(
    s: S,
    link: &Link<S::Store>,
    act: Act,
    work: &ColumnWork<S::Store>,
    u: &mut Number<S>,
    p: &mut Screw<S::Vector>,
) {
    *u = *u - component(s, link, act, work, *p);
    *p = p.plus(work.SA.take(s).times(work.inverse * *u));
}

/// `x ← Ã_aa⁻¹ (x − p)` of a rotation vector; what is left of `p` is `p + Ã_la x`, with
/// `Ã_la Ã_aa⁻¹ = Gᵀ`.
#[inline(always)]
fn rotate<S: Space>(
    s: S,
    (gain, kept): (&Gain<S::Store>, &EliminatedRotation<S::Store>),
    x: &mut [Number<S>],
    p: Screw<S::Vector>,
) -> Screw<S::Vector> {
    let torque = s.read(x, 0) - p.angular;
    s.write(kept.inverse.take(s).mul(torque), x, 0);
    Screw { linear: p.linear + gain.take(s).tr_mul(torque), angular: s.zero() }
}
