//! Motions of links at all control points, and the columns of their pairs there.
//!
//! ```text
//! ΔB_I   = Σ_J Δd¹_J (d¹_J·d_I)                               transport with the parent, from q_n
//! R      d_a' = cos u d_a + sin u d_b,  on  B = d_n + ΔB,     as increments: cos u − 1 = −u² gap(u)
//! Δφ²    = Δφ¹ + Σ_J Δd¹_J ϱ¹_J − Σ_I Δd²_I ϱ²_I + A¹ slide                                         [5.5]
//! ```
//! The increments are those of the pairs ([`crate::pair`]), never differences of configurations.
#![allow(non_snake_case)] // B

use super::link::{Link, Start, Turns};
use crate::geometry::lane_vectors::{Screw, Transfer, Vector, combine, combine_each, three};
use crate::geometry::space::Vector as _;
use crate::pair::columns::{Act, Axis, MotionSubspace};
use vi_core::lanes::{Lanes, Register};
use vi_rigid::rotation_lanes;

/// Increments of a frame from `q_n`, at all control points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose<L> {
    /// `Δφ`.
    pub x: Vector<L>,
    /// `Δd_I`.
    pub d: [Vector<L>; 3],
}

impl<L: Lanes> Pose<L> {
    #[inline(always)]
    pub(super) fn rest(lanes: impl Register<Lanes = L>) -> Self {
        let zero = Vector::splat(lanes, &[0.0; 3]);
        Self { x: zero, d: [zero; 3] }
    }

    /// `d_I`.
    #[inline(always)]
    pub(super) fn directors(
        &self,
        lanes: impl Register<Lanes = L>,
        start: &Start,
    ) -> [Vector<L>; 3] {
        three(
            #[inline(always)]
            |i| Vector::splat(lanes, &start.d[i]) + self.d[i],
        )
    }
}

/// The motion of a link from that of its parent; `u`: its unknowns.
#[inline(always)]
pub(super) fn move_link<R: Register>(
    lanes: R,
    link: &Link,
    (start, parent_start): (&Start, &Start),
    parent: &Pose<R::Lanes>,
    u: &[R::Lanes],
) -> Pose<R::Lanes> {
    let d = match link.turns {
        Turns::None => transported(parent, start),
        Turns::About(k) => turned(lanes, link, start, &transported(parent, start), u[k]),
        Turns::Twice([j, k]) => {
            let axes = [start.axis, link.axes_child[0]];
            twice(lanes, start, &transported(parent, start), &axes, [u[j], u[k]])
        }
        Turns::Vector(k) => absolute(lanes, start, [u[k], u[k + 1], u[k + 2]]),
    };
    if link.motion == MotionSubspace::Free {
        return Pose { x: Vector([u[0], u[1], u[2]]), d };
    }
    let mut x = parent.x + combine(&parent.d, &start.lever) - combine(&d, &link.anchor_child);
    for (column, &u) in link.motion.columns().iter().zip(u) {
        let by = match column.act {
            Act::Turn => continue,
            Act::Slide => u,
            Act::Screw => u * link.pitch,
        };
        x = x + slide(lanes, (link, parent_start, parent), column.axis, by);
    }
    Pose { x, d }
}

/// By `by` along an axis of the parent.
#[inline(always)]
fn slide<R: Register>(
    lanes: R,
    (link, start, parent): (&Link, &Start, &Pose<R::Lanes>),
    axis: Axis,
    by: R::Lanes,
) -> Vector<R::Lanes> {
    let (Axis::Parent(k) | Axis::Child(k)) = axis;
    combine(&parent.directors(lanes, start), &link.axes_parent[k]).scaled(by)
}

/// `ΔB_I`: with the parent.
#[inline(always)]
fn transported<L: Lanes>(parent: &Pose<L>, start: &Start) -> [Vector<L>; 3] {
    three(
        #[inline(always)]
        |i| combine(&parent.d, &start.relative[i]),
    )
}

/// By `u` about the axis `n'` of the child.
#[inline(always)]
fn turned<R: Register>(
    lanes: R,
    link: &Link,
    start: &Start,
    with: &[Vector<R::Lanes>; 3],
    u: R::Lanes,
) -> [Vector<R::Lanes>; 3] {
    let square = u * u;
    let [sinc, gap] = rotation_lanes::coefficients(lanes, square);
    let (sine, less) = (u * sinc, square * gap); // sin u, 1 − cos u
    match link.director {
        Some((0, sign)) => about::<R, 0>(lanes, start, with, (sine * sign, less)),
        Some((1, sign)) => about::<R, 1>(lanes, start, with, (sine * sign, less)),
        Some((_, sign)) => about::<R, 2>(lanes, start, with, (sine * sign, less)),
        None => {
            let turn = turn(lanes, &link.axes_child[2], sine, less);
            apply(lanes, start, with, &turn)
        }
    }
}

/// About director `K`.
#[inline(always)]
fn about<R: Register, const K: usize>(
    lanes: R,
    start: &Start,
    with: &[Vector<R::Lanes>; 3],
    (sine, less): (R::Lanes, R::Lanes),
) -> [Vector<R::Lanes>; 3] {
    let (a, b) = ((K + 1) % 3, (K + 2) % 3);
    let (B_a, B_b) =
        (Vector::splat(lanes, &start.d[a]) + with[a], Vector::splat(lanes, &start.d[b]) + with[b]);
    let mut d = *with;
    d[a] = with[a] + B_b.scaled(sine) - B_a.scaled(less);
    d[b] = with[b] - B_a.scaled(sine) - B_b.scaled(less);
    d
}

/// `exp(u n̂) − I` in components of the directors, by columns, for the axis `n`.
#[inline(always)]
fn turn<R: Register>(
    lanes: R,
    n: &[f64; 3],
    sine: R::Lanes,
    less: R::Lanes,
) -> [Vector<R::Lanes>; 3] {
    let [x, y, z] = [sine * n[0], sine * n[1], sine * n[2]];
    let [xy, xz, yz] = [less * (n[0] * n[1]), less * (n[0] * n[2]), less * (n[1] * n[2])];
    let (square, zero) = ([n[0] * n[0], n[1] * n[1], n[2] * n[2]], lanes.splat(0.0));
    [
        Vector([zero - less * (square[1] + square[2]), xy + z, xz - y]),
        Vector([xy - z, zero - less * (square[0] + square[2]), yz + x]),
        Vector([xz + y, yz - x, zero - less * (square[0] + square[1])]),
    ]
}

/// `ΔB + B (turn)`.
#[inline(always)]
fn apply<R: Register>(
    lanes: R,
    start: &Start,
    with: &[Vector<R::Lanes>; 3],
    turn: &[Vector<R::Lanes>; 3],
) -> [Vector<R::Lanes>; 3] {
    let B = three(
        #[inline(always)]
        |i| Vector::splat(lanes, &start.d[i]) + with[i],
    );
    three(
        #[inline(always)]
        |i| with[i] + combine_each(&B, &turn[i]),
    )
}

/// [`turn`] by an angle.
#[inline(always)]
fn axis_turn<R: Register>(lanes: R, n: &[f64; 3], u: R::Lanes) -> [Vector<R::Lanes>; 3] {
    let square = u * u;
    let [sinc, gap] = rotation_lanes::coefficients(lanes, square);
    turn(lanes, n, u * sinc, square * gap)
}

/// By `u_1` about the first of two axes, then by `u_2` about the second; both in components of the
/// directors at `q_n`.
#[inline(always)]
fn twice<R: Register>(
    lanes: R,
    start: &Start,
    with: &[Vector<R::Lanes>; 3],
    axes: &[[f64; 3]; 2],
    u: [R::Lanes; 2],
) -> [Vector<R::Lanes>; 3] {
    let (first, second) = (axis_turn(lanes, &axes[0], u[0]), axis_turn(lanes, &axes[1], u[1]));
    let both = three(
        #[inline(always)]
        |i| first[i] + second[i] + combine_each(&first, &second[i]),
    );
    apply(lanes, start, with, &both)
}

/// By the rotation vector `θ` of space, whatever the parent does.
#[inline(always)]
fn absolute<R: Register>(lanes: R, start: &Start, theta: [R::Lanes; 3]) -> [Vector<R::Lanes>; 3] {
    let theta = Vector(theta);
    let [sinc, gap] = rotation_lanes::coefficients(lanes, theta.dot(theta));
    three(
        #[inline(always)]
        |i| {
            let c = theta.cross(Vector::splat(lanes, &start.d[i]));
            c.scaled(sinc) + theta.cross(c).scaled(gap)
        },
    )
}

/// The columns of `S` from the directors of child and parent.
#[inline(always)]
pub(super) fn write_columns<R: Register>(
    lanes: R,
    link: &Link,
    d: &[Vector<R::Lanes>; 3],
    parent: &[Vector<R::Lanes>; 3],
    out: &mut [Screw<R::Lanes>],
) {
    let rho = combine(d, &link.anchor_child);
    let along = &link.axes_parent;
    match link.motion {
        MotionSubspace::Spherical => {
            for k in 0..3 {
                out[k] = turning(&rho, unit(lanes, k));
            }
        }
        MotionSubspace::Free => {
            let centre = Vector::splat(lanes, &[0.0; 3]);
            for k in 0..3 {
                out[k] = sliding(lanes, unit(lanes, k));
                out[3 + k] = Screw { linear: centre, angular: unit(lanes, k) };
            }
        }
        motion => {
            for (column, out) in motion.columns().iter().zip(out) {
                let axis = match (column.act, column.axis, link.turns) {
                    (Act::Turn | Act::Screw, _, Turns::About(_)) => main_axis(link, d),
                    (_, Axis::Parent(k), _) => combine(parent, &along[k]),
                    (_, Axis::Child(k), _) => combine(d, &link.axes_child[k]),
                };
                *out = match column.act {
                    Act::Slide => sliding(lanes, axis),
                    Act::Turn => turning(&rho, axis),
                    Act::Screw => turning(&rho, axis).plus(sliding(lanes, axis * link.pitch)),
                };
            }
        }
    }
}

/// `n'`.
#[inline(always)]
fn main_axis<L: Lanes>(link: &Link, d: &[Vector<L>; 3]) -> Vector<L> {
    match link.director {
        Some((0, sign)) => d[0] * sign,
        Some((1, sign)) => d[1] * sign,
        Some((_, sign)) => d[2] * sign,
        None => combine(d, &link.axes_child[2]),
    }
}

/// `(ϱ²×n, n)`.
#[inline(always)]
fn turning<L: Lanes>(rho: &Vector<L>, n: Vector<L>) -> Screw<L> {
    Screw { linear: rho.cross(n), angular: n }
}

/// `(n, 0)`.
#[inline(always)]
fn sliding<L: Lanes>(lanes: impl Register<Lanes = L>, n: Vector<L>) -> Screw<L> {
    Screw { linear: n, angular: Vector::splat(lanes, &[0.0; 3]) }
}

/// `e_k`.
#[inline(always)]
fn unit<L: Lanes>(lanes: impl Register<Lanes = L>, k: usize) -> Vector<L> {
    Vector::splat(lanes, &[f64::from(k == 0), f64::from(k == 1), f64::from(k == 2)])
}

/// The arm of the twist of the parent.
#[inline(always)]
pub(super) fn arm<R: Register>(
    lanes: R,
    link: &Link,
    start: &Start,
    (own, parent): (&Pose<R::Lanes>, &Pose<R::Lanes>),
    parent_directors: &[Vector<R::Lanes>; 3],
) -> Vector<R::Lanes> {
    match link.transfer {
        Transfer::Point => combine(parent_directors, &link.anchor_parent),
        _ => Vector::splat(lanes, &start.arm) + (own.x - parent.x),
    }
}
