//! The sweeps at the end of a step of [`super::TreeStep`]: coordinates, momenta, round-off.

use super::link::{Constants, Work};
use super::sweeps::{carrier, carrier_center, frame, gap};
use crate::geometry::lane_matrices::{Columns, Pair};
use crate::geometry::lanes::{Lanes, Width, sweep, three};
use crate::pair::PairKind;
use crate::tree::{SLACK, Tree};
use vi_rigid::reparametrization::CLEAN_THRESHOLD;

sweep! {
    /// `q_{n+1}`, `Δq`, `q_{n+1/2}`, `Δq/h` of the last [`advance`](super::sweeps::advance); `start`: `q_n` and its rounding error.
    close = sweep_close(
        links: &'a [Constants], works: &'a [Work], start: [&'a [f64]; 2], end: [&'a mut [f64]; 4],
        h: f64
    ) -> ()
}

#[inline(always)]
fn sweep_close<W: Width>(
    w: W,
    links: &[Constants],
    works: &[Work],
    [q0, compensation]: [&[f64]; 2],
    [q1, dq, q_mid, v_mid]: [&mut [f64]; 4],
    h: f64,
) {
    let (mut center, mut d_next) = (Lanes::zero(w), Columns::zero(w)); // q_{n+1} of the link before
    for (link, work) in links.iter().zip(works) {
        match link.parent {
            Some(_) if link.follows_parent => {}
            _ => (center, d_next) = (carrier_center(w, link, q1), carrier(w, link, q1)),
        }
        let arm = d_next.mul(Lanes::new(w, link.anchor_parent)); // ϱ¹
        let (from, error) = (frame(q0, link.frame), frame(compensation, link.frame));
        let (d, turn) = (Columns::directors(w, from), work.turn.take(w));
        let anchor = Lanes::new(w, link.anchor);
        let moved = Lanes::take(w, &work.shift) - turn.mul(d.mul(anchor)); // Δx − (A − 1) ϱ²
        let turned = turn.times(&d); // (A − 1) d
        d_next = Columns(three!(i => {
            d.0[i] + (turned.0[i] + Lanes::of(w, &error[3 + 3 * i..]))
        }));
        let start = Lanes::of(w, from);
        center = match link.closes_gap {
            true => center + (arm - d_next.mul(anchor)), // no gap: φ² = φ¹ + ϱ¹ − ϱ²
            false => start + (moved + Lanes::of(w, error)),
        };
        let [a, b, c] = three!(i => (d.0[i], turned.0[i], d_next.0[i]));
        let mut at = link.frame;
        for (from, change, end) in [(start, moved, center), a, b, c] {
            end.write(&mut q1[at..]);
            change.write(&mut dq[at..]);
            (from + change * 0.5).write(&mut q_mid[at..]);
            (change / h).write(&mut v_mid[at..]);
            at += 3;
        }
    }
}

sweep! {
    /// `p̄_{n+1} = M Δq/h` and the impulse of constant forces in half a step, and the balance of each link with these very
    /// momenta; `of`: `q_n`, `Δq` and that impulse.
    momenta = sweep_momenta(
        links: &'a [Constants], works: &'a mut [Work], of: [&'a [f64]; 3], h: f64, p: &'a mut [f64]
    ) -> ()
}

#[inline(always)]
fn sweep_momenta<W: Width>(
    w: W,
    links: &[Constants],
    works: &mut [Work],
    [q0, dq, impulse]: [&[f64]; 3],
    h: f64,
    p: &mut [f64],
) {
    let rate = 1.0 / h;
    for (link, work) in links.iter().zip(works) {
        let (dq, impulse) = (frame(dq, link.frame), frame(impulse, link.frame));
        let p = &mut p[link.frame..link.frame + 12];
        let linear = move_momentum((w, link, 0), dq, impulse, rate, p);
        let [first, second, third] =
            three!(i => move_momentum((w, link, i + 1), dq, impulse, rate, p));
        let d = Columns::directors(w, frame(q0, link.frame));
        let spin = (d.0[0].cross(first) + d.0[1].cross(second)) + d.0[2].cross(third);
        let anchor = d.mul(Lanes::new(w, link.anchor));
        work.wrench = Pair { linear, angular: spin - anchor.cross(linear) }.held();
    }
}

/// `p̄_{n+1}` of a vector of a link; returns its part of the balance, a difference of nearly equal numbers: it is exact.
#[inline(always)]
fn move_momentum<W: Width>(
    (w, link, i): (W, &Constants, usize),
    dq: &[f64; 12],
    impulse: &[f64; 12],
    rate: f64,
    p: &mut [f64],
) -> Lanes<W> {
    let row = &link.mass[i];
    let mut momentum = Lanes::zero(w); // M Δq/h
    if link.is_diagonal {
        momentum = Lanes::of(w, &dq[3 * i..]) * (rate * row[i]);
    } else {
        for (j, m) in row.iter().enumerate() {
            momentum += Lanes::of(w, &dq[3 * j..]) * (rate * m);
        }
    }
    let (impulse, own) = (Lanes::of(w, &impulse[3 * i..]), &mut p[3 * i..3 * i + 3]);
    let rest = (Lanes::of(w, own) + impulse) - momentum;
    (momentum + impulse).write(own);
    rest
}

sweep! {
    /// [`Tree::clean`], where a glance at a link does not show that it is as it should be.
    clean = sweep_clean(
        links: &'a [Constants], works: &'a mut [Work], tree: &'a Tree, q: &'a mut [f64]
    ) -> ()
}

#[inline(always)]
fn sweep_clean<W: Width>(
    w: W,
    links: &[Constants],
    works: &mut [Work],
    tree: &Tree,
    q: &mut [f64],
) {
    for (k, link) in links.iter().enumerate() {
        let moved = link.parent.is_some_and(|parent| works[parent].cleaned);
        let clean = !moved && is_clean(w, link, q);
        works[k].cleaned = !clean && tree.clean_link(&tree.links()[k], q);
    }
}

/// Whether the directors of a link, its axes and its gap show no more round-off than is left anyway; the gap of a
/// pair that closes it was removed with the parent where that is. The thread of a screw is not seen at a glance.
#[inline(always)]
fn is_clean<W: Width>(w: W, link: &Constants, q: &[f64]) -> bool {
    let own = frame(q, link.frame);
    let (d, parent) = (Columns::directors(w, own), carrier(w, link, q));
    let [d1, d2, d3] = d.0;
    let lengths = Lanes::dots([(d1, d1), (d2, d2), (d3, d3)]) - Lanes::new(w, [1.0; 3]);
    let angles = Lanes::dots([(d1, d2), (d1, d3), (d2, d3)]);
    let rigid = lengths.within(CLEAN_THRESHOLD) & angles.within(CLEAN_THRESHOLD);
    match link.kind {
        PairKind::Spherical | PairKind::Free => rigid,
        PairKind::Revolute => rigid & off_axis(link, &d, &parent, 2).within(SLACK),
        PairKind::Universal => rigid & (across(link, &d, &parent).abs() <= SLACK),
        PairKind::Fixed => rigid & attitude(link, &d, &parent).within(SLACK),
        PairKind::Prismatic => {
            let gap = gap(link, &d, &parent, q);
            let across = gap - along_axis(link, &parent, gap);
            rigid & attitude(link, &d, &parent).within(SLACK) & across.within(SLACK)
        }
        PairKind::Cylindrical => {
            let gap = gap(link, &d, &parent, q);
            let across = gap - along_axis(link, &parent, gap);
            rigid & off_axis(link, &d, &parent, 2).within(SLACK) & across.within(SLACK)
        }
        PairKind::Planar => {
            let gap = gap(link, &d, &parent, q);
            rigid
                & off_axis(link, &d, &parent, 2).within(SLACK)
                & along_axis(link, &parent, gap).within(SLACK)
        }
        PairKind::Screw(_) => false,
    }
}

/// Small rotation that brings axis `i` of a link onto that of its parent.
#[inline(always)]
fn off_axis<W: Width>(
    link: &Constants,
    d: &Columns<Lanes<W>>,
    parent: &Columns<Lanes<W>>,
    i: usize,
) -> Lanes<W> {
    let w = d.0[0].width();
    let axis = parent.mul(Lanes::new(w, link.axes[i]));
    d.mul(Lanes::new(w, link.axes_child[i])).cross(axis)
}

/// Small rotation that brings all axes of a link onto those of its parent.
#[inline(always)]
fn attitude<W: Width>(
    link: &Constants,
    d: &Columns<Lanes<W>>,
    parent: &Columns<Lanes<W>>,
) -> Lanes<W> {
    let [first, second, third] = three!(i => off_axis(link, d, parent, i));
    ((first + second) + third) * 0.5
}

/// `n·m_1'`.
#[inline(always)]
fn across<W: Width>(link: &Constants, d: &Columns<Lanes<W>>, parent: &Columns<Lanes<W>>) -> f64 {
    let w = d.0[0].width();
    parent.mul(Lanes::new(w, link.axes[2])).dot(d.mul(Lanes::new(w, link.axes_child[0])))
}

/// The part of a vector along the axis.
#[inline(always)]
fn along_axis<W: Width>(link: &Constants, parent: &Columns<Lanes<W>>, v: Lanes<W>) -> Lanes<W> {
    let n = parent.mul(Lanes::new(parent.0[0].width(), link.axes[2]));
    n * n.dot(v)
}
