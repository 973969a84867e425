//! The solution of the linear systems: elimination leaf → root, substitution root → leaf; formulas
//! are those of [`crate::solver::tree_step`].
#![allow(non_snake_case)] // A, D, G, K

use super::kernel::Kernel;
use super::link::{ColumnWork, Link, Work};
use super::sweeps::{at, component};
use crate::geometry::lane_spatial::{Columns, Spatial};
use crate::geometry::lane_vectors::{Screw, Vector, three};
use crate::solver::tree_step::columns::{Act, Motion};
use vi_core::lanes::{Lanes, Register};
use vi_rigid::rotation_lanes;

/// `−h A_α` of a link alone, about its reference point.
#[inline(always)]
fn block<T: Register>(lanes: T, link: &Link<T::Lanes>, work: &Work<T::Lanes>) -> Spatial<T::Lanes> {
    let moment_next = work.moment + work.turn.mul(work.moment); // s'
    let K = work.euler.plus(&work.turn.times(&work.euler)); // Σ x' xᵀ
    Spatial {
        ll: Columns::multiple(lanes, link.mass[0][0]),
        la: Columns::skew(lanes, moment_next * -1.0),
        al: Columns::skew(lanes, work.moment),
        aa: K.trace_less(lanes),
    }
}

impl<T: Register> Kernel<T> {
    /// Leaf → root: factorizes, and `x ← u_k`; on entry `x` is `−h` times the right-hand side.
    #[inline(always)]
    pub(super) fn eliminate(&mut self) {
        let Self { lanes, links, works, columns, gains, sums, x, .. } = self;
        for (k, link) in links.iter().enumerate().rev() {
            let work = &works[k];
            let (mut A, mut p) = (block(*lanes, link, work), Screw::zero(*lanes));
            if link.is_parent {
                (A, p) = (A.plus(&sums[k].0), sums[k].1);
            }
            match link.motion {
                Motion::Fixed => {}
                Motion::Along(act) => {
                    let own = (&mut columns[link.unknown], &mut x[link.unknown]);
                    eliminate_along(*lanes, (link, act), own, &mut A, &mut p);
                }
                Motion::Several(several) => {
                    for (j, column) in several.iter().enumerate().rev() {
                        let unknown = link.unknown + j;
                        let own = (&mut columns[unknown], &mut x[unknown]);
                        eliminate_along(*lanes, (link, column.act), own, &mut A, &mut p);
                    }
                }
                Motion::Spherical => {
                    let own = &mut x[link.unknown..link.unknown + 3];
                    (A, p) = eliminate_rotation(*lanes, (A, p), &mut gains[k], own);
                }
                Motion::Free => {
                    let (velocity, spin) = x[link.unknown..link.unknown + 6].split_at_mut(3);
                    (A, p) = eliminate_rotation(*lanes, (A, p), &mut gains[k], spin);
                    let side = Vector([velocity[0], velocity[1], velocity[2]]) - p.linear;
                    velocity.copy_from_slice(&inverse(*lanes, &A.ll).mul(side).0);
                }
            }
            let Some(parent) = link.parent else { continue };
            let own = (A.between(work.lever, work.lever_next), p.at_start_of(work.lever));
            sums[parent] = match link.writes_first {
                true => own,
                false => (sums[parent].0.plus(&own.0), sums[parent].1.plus(own.1)),
            };
        }
    }

    /// Root → leaf: `x ← δτ` from `u_k`, at the increments `u`; returns the square of the largest
    /// rotation of a link.
    #[inline(always)]
    pub(super) fn substitute(&mut self) -> T::Lanes {
        let Self { lanes, links, works, columns, gains, u, x, .. } = self;
        let mut largest = lanes.splat(0.0);
        for (k, link) in links.iter().enumerate() {
            let mut twist = match link.parent {
                Some(parent) => works[parent].twist.at_end_of(works[k].lever_next), // X' δt'
                None => Screw::zero(*lanes),
            };
            let first = link.unknown;
            match link.motion {
                Motion::Fixed => {}
                Motion::Along(act) => {
                    follow((link, act), &columns[first], &mut x[first], &mut twist)
                }
                Motion::Several(several) => {
                    for (unknown, column) in (first..).zip(several) {
                        follow((link, column.act), &columns[unknown], &mut x[unknown], &mut twist);
                    }
                }
                Motion::Spherical => {
                    twist.angular = at(x, first) - gains[k].mul(twist.linear);
                    let own = rate_of(*lanes, at(u, first), twist.angular);
                    x[first..first + 3].copy_from_slice(&own.0);
                }
                Motion::Free => {
                    let linear = at(x, first);
                    let angular = at(x, first + 3) - gains[k].mul(linear);
                    twist = Screw { linear, angular };
                    let own = rate_of(*lanes, at(u, first + 3), angular);
                    x[first + 3..first + 6].copy_from_slice(&own.0);
                }
            }
            works[k].twist = twist;
            largest = largest.larger(twist.angular.dot(twist.angular));
        }
        largest
    }
}

/// `A ← Ã − Ã S' D⁻¹ Sᵀ Ã` and `p ← p + Ã S' D⁻¹ u`, `u ← u − Sᵀ p`, of one column.
#[inline(always)]
fn eliminate_along<T: Register>(
    lanes: T,
    (link, act): (&Link<T::Lanes>, Act),
    (work, u): (&mut ColumnWork<T::Lanes>, &mut T::Lanes),
    A: &mut Spatial<T::Lanes>,
    p: &mut Screw<T::Lanes>,
) {
    let (n, next) = (work.axis, work.axis_next);
    let (AS, SA) = match act {
        Act::Turn => turning(A, n, next),
        Act::Slide => sliding(A, n, next),
        Act::Screw => {
            let (turn, slide) = (turning(A, n, next), sliding(A, n, next));
            (turn.0.plus(slide.0.times(link.pitch)), turn.1.plus(slide.1.times(link.pitch)))
        }
    };
    let inverse = lanes.splat(1.0).over(component(link, act, n, AS)); // D = Sᵀ Ã S'
    *u = *u - component(link, act, n, *p);
    (work.of_left, work.inverse) = (SA, inverse);
    *p = p.plus(AS.times(inverse * *u));
    *A = A.minus_outer(AS, SA.times(inverse));
}

/// `Ã (0, n')` and `(0, n)ᵀ Ã`.
#[inline(always)]
fn turning<L: Lanes>(A: &Spatial<L>, n: Vector<L>, next: Vector<L>) -> (Screw<L>, Screw<L>) {
    let AS = Screw { linear: A.la.mul(next), angular: A.aa.mul(next) };
    (AS, Screw { linear: A.al.tr_mul(n), angular: A.aa.tr_mul(n) })
}

/// `Ã (n', 0)` and `(n, 0)ᵀ Ã`.
#[inline(always)]
fn sliding<L: Lanes>(A: &Spatial<L>, n: Vector<L>, next: Vector<L>) -> (Screw<L>, Screw<L>) {
    let AS = Screw { linear: A.ll.mul(next), angular: A.al.mul(next) };
    (AS, Screw { linear: A.ll.tr_mul(n), angular: A.la.tr_mul(n) })
}

/// Of `S = (0, I)`, `S' = (0, T)`: `Ã_ll − Ã_la G` with the gain `G = Ã_aa⁻¹ Ã_al`, and
/// `p + Ã_la x` with `x ← Ã_aa⁻¹ (x − p)`; `T` has no part in them.
#[inline(always)]
fn eliminate_rotation<T: Register>(
    lanes: T,
    (A, p): (Spatial<T::Lanes>, Screw<T::Lanes>),
    gain: &mut Columns<T::Lanes>,
    x: &mut [T::Lanes],
) -> (Spatial<T::Lanes>, Screw<T::Lanes>) {
    let inverse = inverse(lanes, &A.aa);
    let omega = inverse.mul(Vector([x[0], x[1], x[2]]) - p.angular);
    x.copy_from_slice(&omega.0);
    *gain = inverse.times(&A.al);
    let ll = A.ll.minus(&A.la.times(gain));
    let (zero, none) = (Columns::zero(lanes), Vector::splat(lanes, &[0.0; 3]));
    let wrench = Screw { linear: p.linear + A.la.mul(omega), angular: none };
    (Spatial { ll, la: zero, al: zero, aa: zero }, wrench)
}

/// The inverse of a 3×3 matrix that is nearly symmetric and positive definite, by Gauss–Jordan
/// elimination on its diagonal.
#[inline(always)]
fn inverse<T: Register>(lanes: T, m: &Columns<T::Lanes>) -> Columns<T::Lanes> {
    let mut m = m.0.map(|column| column.0); // m[j][i]
    for k in 0..3 {
        let pivot = lanes.splat(1.0).over(m[k][k]);
        m[k][k] = lanes.splat(1.0);
        for j in 0..3 {
            m[j][k] = m[j][k] * pivot;
        }
        for i in 0..3 {
            if i != k {
                let factor = m[k][i];
                m[k][i] = lanes.splat(0.0);
                for j in 0..3 {
                    m[j][i] = m[j][i] - factor * m[j][k];
                }
            }
        }
    }
    Columns(three(
        #[inline(always)]
        |j| Vector(m[j]),
    ))
}

/// `x ← δτ_j = D⁻¹ (u − Sᵀ Ã δt')` and `δt' ← δt' + S'_j δτ_j` of one column.
#[inline(always)]
fn follow<L: Lanes>(
    (link, act): (&Link<L>, Act),
    work: &ColumnWork<L>,
    x: &mut L,
    twist: &mut Screw<L>,
) {
    *x = (*x - work.of_left.dot(*twist)) * work.inverse;
    let moved = work.axis_next.scaled(*x);
    match act {
        Act::Turn => twist.angular = twist.angular + moved,
        Act::Slide => twist.linear = twist.linear + moved,
        Act::Screw => {
            twist.angular = twist.angular + moved;
            twist.linear = twist.linear + moved.scaled(link.pitch);
        }
    }
}

/// `δθ = T(θ)⁻¹ δω` of the rotation vector `θ`.
#[inline(always)]
fn rate_of<T: Register>(
    lanes: T,
    theta: Vector<T::Lanes>,
    omega: Vector<T::Lanes>,
) -> Vector<T::Lanes> {
    let across = theta.cross(omega);
    let kappa = rotation_lanes::kappa(lanes, theta.dot(theta));
    omega + theta.cross(across.scaled(kappa) - omega * 0.5)
}
