//! Costates of the end of a step to those of its start.
//!
//! ```text
//! c = a' + (M/h) b' + …            P(q_{n+1})ᵀ Aᵀ P(q_n) m = P(q_{n+1})ᵀ c                [2.47]
//! μ = P(q_n) m,   b = −μ           a = −(M/h)(b' + μ) + … − ∂/∂q [w·P(q) m]   at fixed w and m
//! w = p̄ + D_1 L_d + f_d^-,   F_k = (f, τ) of w, of the link k and all that it carries
//! ```
//! The matrix is that of the step with its ends exchanged, each block transposed:
//! [`open_back`](super::open::open_back), [`eliminate`](super::eliminate::eliminate),
//! [`substitute`](super::substitute::substitute). On a tree, the derivative of `P` stands in the
//! place of `h Σ λ_i D²g_i`: with the twist `(v_k, ω_k)` of `m`,
//! ```text
//! w·P m = Σ_k [f·(v_k − ω_k × ϱ) + Σ_I w_I·(ω_k × d_I)]      of the vectors w_φ = f, w_I of a frame
//! ∂d_I       (w_I − ϱ_I f) × ω_k
//! ∂ℓ         F_k,f × ω_parent          of the lever, v_k = v_parent + ω_parent × ℓ + …
//! ∂n         m_j F_k,τ of a turn, m_j F_k,f of a slide
//! ```
//! Only what it is on tangents counts.
#![allow(non_snake_case)] // F

use super::columns::{Act, Axis, Motion};
use super::link::{ColumnWork, Link, Work};
use super::place::{LinkPlace, balance, momenta};
use super::pull_back::hand_on;
use crate::geometry::matrix::Screw;
use crate::geometry::space::{Constant, Number, Space, Vector};

/// `P(q_{n+1})ᵀ c` begins: the wrenches of `c = a' + (M/h) b'` on all links; `at`: `q_{n+1}`, `a'`,
/// `b'`.
#[inline(always)]
pub(crate) fn weigh<S: Space>(
    s: S,
    links: &[Link<S::Store>],
    works: &mut [Work<S::Store>],
    rate: f64,
    [q, a, b]: [&[Number<S>]; 3],
) {
    for (link, work) in links.iter().zip(works) {
        let d = LinkPlace::of(s, q, link.frame).d;
        let mut c = momenta(s, link, s.read_frame(b, link.frame), rate);
        let a = s.read_frame(a, link.frame);
        for i in 0..4 {
            c[i] = c[i] + a[i];
        }
        work.wrench = balance(&d, d.mul(s.constant(&link.anchor)), c).held();
    }
}

/// Costates of a step, shape `n` each.
#[derive(Debug)]
pub(crate) struct Pulled<'a, N> {
    /// `a`, overwritten.
    pub(crate) a: &'a mut [N],
    /// `b'`, then `b`.
    pub(crate) b: &'a mut [N],
    /// `μ`.
    pub(crate) mu: &'a mut [N],
}

/// `μ`, `b` and `a` from the twists and the rates `m` at the start of the step; `at`: `q_n` and
/// `w`. The wrenches of the links are `F` then.
#[inline(always)]
pub(crate) fn pull<S: Space>(
    s: S,
    links: &[Link<S::Store>],
    works: &mut [Work<S::Store>],
    rate: f64,
    ([q, w], m): ([&[Number<S>]; 2], &[Number<S>]),
    mut out: Pulled<'_, Number<S>>,
) {
    for (link, work) in links.iter().zip(&mut *works) {
        pull_body(s, link, work, rate, [q, w], &mut out);
    }
    let mut carried = Screw::zero(s); // by the link before
    for (k, link) in links.iter().enumerate().rev() {
        let F = works[k].wrench.take(s).plus(carried);
        (works[k].wrench, carried) = (F.held(), Screw::zero(s));
        bend_axes(s, link, F, m, out.a);
        let Some(parent) = link.parent else { continue };
        bend_lever(s, link, F.linear.cross(s.take(&works[parent].twist.angular)), out.a);
        let transmitted = match link.motion {
            Motion::Spherical => Screw { angular: s.zero(), ..F }, // no torque passes
            _ => F,
        };
        let transmitted = transmitted.at_start_of(s.take(&works[k].lever_next));
        hand_on(s, link, works, transmitted, &mut carried);
    }
}

/// What a frame has of them by itself, and its own wrench of `w`.
#[inline(always)]
fn pull_body<S: Space>(
    s: S,
    link: &Link<S::Store>,
    work: &mut Work<S::Store>,
    rate: f64,
    [q, w]: [&[Number<S>]; 2],
    out: &mut Pulled<'_, Number<S>>,
) {
    let (d, twist, at) = (LinkPlace::of(s, q, link.frame).d, work.twist.take(s), link.frame);
    let (arm, spin) = (d.mul(s.constant(&link.anchor)), twist.angular);
    let [x, y, z] = d.0;
    let mu = [twist.linear - spin.cross(arm), spin.cross(x), spin.cross(y), spin.cross(z)];
    let (mut sum, mut b) = (s.read_frame(out.b, at), mu);
    for i in 0..4 {
        sum[i] = sum[i] + mu[i];
        b[i] = mu[i] * -1.0;
    }
    let mut a = momenta(s, link, sum, -rate); // −(M/h)(b' + μ)  [2.47]
    let w = s.read_frame(w, at);
    for i in 0..3 {
        let own = w[i + 1] - w[0].scaled(s.factor(link.anchor[i]));
        a[i + 1] = a[i + 1] - own.cross(spin); // ∂d_I
    }
    work.wrench = balance(&d, arm, w).held();
    s.write_frame(a, out.a, at);
    s.write_frame(b, out.b, at);
    s.write_frame(mu, out.mu, at);
}

/// `a ← a − Σ_j ∂n_j` of the axes of a joint that transmits the wrench `F`.
#[inline(always)]
fn bend_axes<S: Space>(
    s: S,
    link: &Link<S::Store>,
    F: Screw<S::Vector>,
    m: &[Number<S>],
    a: &mut [Number<S>],
) {
    match link.motion {
        Motion::Along(act) => {
            let by = by_axis(s, link, act, F).scaled(m[link.unknown]);
            turn_axis(s, link, Axis::Parent(2), by, a);
        }
        Motion::Several(several) => {
            for (unknown, column) in (link.unknown..).zip(several) {
                let by = by_axis(s, link, column.act, F).scaled(m[unknown]);
                turn_axis(s, link, column.axis, by, a);
            }
        }
        Motion::Fixed | Motion::Spherical | Motion::Free => {}
    }
}

/// The derivative of `F·S_j` by the axis.
#[inline(always)]
pub(super) fn by_axis<S: Space>(
    s: S,
    link: &Link<S::Store>,
    act: Act,
    F: Screw<S::Vector>,
) -> S::Vector {
    match act {
        Act::Turn => F.angular,
        Act::Slide => F.linear,
        Act::Screw => F.angular + F.linear.scaled(s.factor(link.pitch)),
    }
}

/// `a ← a −` a derivative `by` an axis, carried to the directors in which it is fixed.
#[inline(always)]
fn turn_axis<S: Space>(
    s: S,
    link: &Link<S::Store>,
    axis: Axis,
    by: S::Vector,
    a: &mut [Number<S>],
) {
    match axis {
        Axis::Parent(_) if link.parent.is_none() => {} // fixed in the ground
        Axis::Parent(i) => take_point(s, &link.axes[i], link.parent_frame, by, a),
        Axis::Child(i) => take_point(s, &link.axes_child[i], link.frame, by, a),
    }
}

/// `a ← a −` a derivative `by` the lever of a joint, carried to the frames it connects.
#[inline(always)]
fn bend_lever<S: Space>(s: S, link: &Link<S::Store>, by: S::Vector, a: &mut [Number<S>]) {
    take_point(s, &link.lever, link.parent_frame, by, a);
    if !link.closes_gap {
        let back = by * -1.0;
        s.write(s.read(a, link.frame) - by, a, link.frame);
        take_point(s, &link.anchor, link.frame, by, a);
        s.write(s.read(a, link.parent_frame) - back, a, link.parent_frame);
        take_point(s, &link.anchor_parent, link.parent_frame, back, a);
    }
}

/// `a_{d_I} ← a_{d_I} − x_I by` of a vector with the components `x` in the directors of a frame.
#[inline(always)]
fn take_point<S: Space>(
    s: S,
    x: &[Constant<S>; 3],
    frame: usize,
    by: S::Vector,
    a: &mut [Number<S>],
) {
    for i in 0..3 {
        let first = frame + 3 * (i + 1);
        s.write(s.read(a, first) - by.scaled(s.factor(x[i])), a, first);
    }
}

/// Sets what acts along the unknowns of all joints to nothing.
pub(crate) fn release<S: Space>(
    s: S,
    works: &mut [Work<S::Store>],
    columns: &mut [ColumnWork<S::Store>],
) {
    works.iter_mut().for_each(|work| work.column.slope = s.number(0.0));
    columns.iter_mut().for_each(|column| column.slope = s.number(0.0));
}
