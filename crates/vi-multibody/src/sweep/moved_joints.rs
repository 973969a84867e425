//! What costates give along changes of the geometry of joints, by what the joints transmit.
//!
//! A side of a joint is its anchor `ϱ` and its axes, in the directors of a frame. Where it shifts
//! by `δ` or turns by `ψ` about its anchor, in space, at fixed joint coordinates, the joint
//! carries the rest of the tree along as a rigid body. With the wrench `F` that `w` exerts on a
//! link `k` and all that it carries, at `q_n`, and `R` that of `c − Aᵀ μ` at `q_{n+1}`, both about
//! the reference point of the link; `r` the gap of the joint, `p` the parent:
//! ```text
//! dJ = −w·P_θ m                          + (c − Aᵀ μ)·δq'                              [2.40]
//! near side   shift   −(F_f × ω_p)·δ                    R_f·δ
//! far side    shift    (F_f × ω_k)·δ                   −R_f·δ
//! near side   turn    −Σ m_j (n_j × F_j)·ψ             (R_τ + r × R_f)·ψ               n_j of the parent
//! far side    turn    −Σ m_j (n_j × F_j)·ψ             −R_τ·ψ                          n_j of the child
//! ```
//! `F_j`: `F_τ` of a turn, `F_f` of a slide. Where a pair leaves a gap, the lever from one
//! reference point to the next contains it and does not read the near anchor: 0 and
//! `F_f × (ω_k − ω_p)` at `q_n`. Near and far: of the parent and of the child in the tree.
#![allow(non_snake_case)] // F, R

use super::columns::Axis;
use super::costate::by_axis;
use super::link::{Link, Work};
use super::place::{LinkPlace, balance, momenta};
use super::pull_back::hand_on;
use crate::geometry::matrix::Screw;
use crate::geometry::space::{Number, Space, Vector};

/// How many numbers a link has at either end: vectors for shift and turn of the near side, then of
/// the far one.
pub(crate) const NUMBERS: usize = 12;

/// Writes the vectors of `−w·P_θ m`, by the wrenches `F` and the twists of `m` that
/// [`costate::pull`](super::costate::pull) left; `at`: `q_n` and `m`.
#[inline(always)]
pub(crate) fn at_start<S: Space>(
    s: S,
    links: &[Link<S::Store>],
    works: &[Work<S::Store>],
    [q, m]: [&[Number<S>]; 2],
    out: &mut [Number<S>],
) {
    for (k, (link, work)) in links.iter().zip(works).enumerate() {
        let (F, zero) = (work.wrench.take(s), s.zero());
        let parent = link.parent.map_or(zero, |parent| s.take(&works[parent].twist.angular));
        let [near, far] = [parent, s.take(&work.twist.angular)].map(|spin| F.linear.cross(spin));
        let mut vectors = match link.closes_gap {
            true => [near * -1.0, zero, far, zero],
            false => [zero, zero, far - near, zero],
        };
        turn_axes(s, link, q, m, F, &mut vectors);
        s.write_frame(vectors, out, NUMBERS * k);
    }
}

/// The turns of the sides in which the columns of a joint are fixed.
#[inline(always)]
fn turn_axes<S: Space>(
    s: S,
    link: &Link<S::Store>,
    q: &[Number<S>],
    m: &[Number<S>],
    F: Screw<S::Vector>,
    [_, near, _, far]: &mut [S::Vector; 4],
) {
    for (unknown, column) in (link.unknown..).zip(link.motion.columns()) {
        let by = by_axis(s, link, column.act, F).scaled(m[unknown]);
        match column.axis {
            Axis::Parent(i) => {
                let axis = LinkPlace::of_parent(s, link, q).d.mul(s.constant(&link.axes[i]));
                *near = *near - axis.cross(by);
            }
            Axis::Child(i) => {
                let axis = LinkPlace::of(s, q, link.frame).d.mul(s.constant(&link.axes_child[i]));
                *far = *far - axis.cross(by);
            }
        }
    }
}

/// Writes the vectors of `(c − Aᵀ μ)·δq'`, where `c − Aᵀ μ = c_0 + (M/h)(b' + μ)`; `at`: `q_{n+1}`,
/// `c_0`, `b'` and `μ`, of links that are open there.
#[inline(always)]
pub(crate) fn at_end<S: Space>(
    s: S,
    links: &[Link<S::Store>],
    works: &mut [Work<S::Store>],
    rate: f64,
    [q, c, b, mu]: [&[Number<S>]; 4],
    out: &mut [Number<S>],
) {
    for (link, work) in links.iter().zip(&mut *works) {
        let d = LinkPlace::of(s, q, link.frame).d;
        let [mut sum, mu, c] = [b, mu, c].map(|x| s.read_frame(x, link.frame));
        for i in 0..4 {
            sum[i] = sum[i] + mu[i];
        }
        let mut inertia = momenta(s, link, sum, rate);
        for i in 0..4 {
            inertia[i] = inertia[i] + c[i];
        }
        work.wrench = balance(&d, d.mul(s.constant(&link.anchor)), inertia).held();
    }
    let mut carried = Screw::zero(s); // by the link before
    for (k, link) in links.iter().enumerate().rev() {
        let R = works[k].wrench.take(s).plus(carried);
        carried = Screw::zero(s);
        let mut turn = R.angular;
        if !link.closes_gap {
            let own = LinkPlace::of(s, q, link.frame);
            turn = turn + own.gap(s, link, &LinkPlace::of_parent(s, link, q)).cross(R.linear);
        }
        let vectors = [R.linear, turn, R.linear * -1.0, R.angular * -1.0];
        s.write_frame(vectors, out, NUMBERS * k);
        let transmitted = R.at_start_of(s.take(&works[k].lever));
        hand_on(s, link, works, transmitted, &mut carried);
    }
}
