//! Root → leaf: substitution after the elimination.
#![allow(non_snake_case)] // S

use super::columns::{Act, Motion};
use super::link::{ColumnWork, Gain, Link, Work};
use crate::geometry::matrix::Screw;
use crate::geometry::space::{Number, Space, Vector};
use std::ops::Range;
use vi_core::lanes::Lanes;

/// `x ← δτ` from `u_k`, at the increments `u`, of some links; returns the square of their largest
/// rotation, rad².
#[inline(always)]
pub(crate) fn substitute<S: Space>(
    s: S,
    (links, range): (&[Link<S::Store>], Range<usize>),
    works: &mut [Work<S::Store>],
    (columns, gains): (&[ColumnWork<S::Store>], &[Gain<S::Store>]),
    u: &[Number<S>],
    x: &mut [Number<S>],
) -> Number<S> {
    let mut largest = s.number(0.0);
    let before = range.start.checked_sub(1);
    let mut twist = before.map_or(Screw::zero(s), |k| works[k].twist.take(s)); // of the link before
    for (k, link) in links[..range.end].iter().enumerate().skip(range.start) {
        match link.parent {
            None => twist = Screw::zero(s),
            Some(_) if link.follows_parent => {}
            Some(parent) => twist = works[parent].twist.take(s),
        }
        let (work, first) = (&mut works[k], link.unknown);
        twist = twist.at_end_of(s.take(&work.lever_next)); // X' δt'
        match link.motion {
            Motion::Fixed => {}
            Motion::Along(act) => {
                follow(s, link, act, &work.column, &mut x[first], &mut twist);
            }
            Motion::Several(several) => {
                for (unknown, column) in (first..).zip(several) {
                    follow(s, link, column.act, &columns[unknown], &mut x[unknown], &mut twist);
                }
            }
            Motion::Spherical => {
                twist.angular = s.read(x, first) - gains[k].take(s).mul(twist.linear);
                s.write(rate_of(s, s.read(u, first), twist.angular), x, first);
            }
            Motion::Free => {
                let linear = s.read(x, first);
                let angular = s.read(x, first + 3) - gains[k].take(s).mul(linear);
                twist = Screw { linear, angular };
                s.write(rate_of(s, s.read(u, first + 3), angular), x, first + 3);
            }
        }
        work.twist = twist.held();
        largest = largest.larger(twist.angular.dot(twist.angular));
    }
    largest
}

/// `x ← δτ_j = D⁻¹ (u − Sᵀ Ã δt')` and `δt' ← δt' + S'_j δτ_j` of one column.
#[inline(always)]
fn follow<S: Space>(
    s: S,
    link: &Link<S::Store>,
    act: Act,
    work: &ColumnWork<S::Store>,
    x: &mut Number<S>,
    twist: &mut Screw<S::Vector>,
) {
    *x = (*x - work.SA.take(s).dot(*twist)) * work.inverse;
    let moved = s.take(&work.axis_next).scaled(*x);
    match act {
        Act::Turn => twist.angular = twist.angular + moved,
        Act::Slide => twist.linear = twist.linear + moved,
        Act::Screw => {
            twist.angular = twist.angular + moved;
            twist.linear = twist.linear + moved.scaled(s.factor(link.pitch));
        }
    }
}

/// `δθ = T(θ)⁻¹ δω` of the rotation vector `θ`.
#[inline(always)]
fn rate_of<S: Space>(s: S, theta: S::Vector, omega: S::Vector) -> S::Vector {
    let first = theta.cross(omega);
    let kappa = s.kappa(theta.dot(theta));
    omega + theta.cross(first.scaled(kappa) - omega * 0.5)
}
