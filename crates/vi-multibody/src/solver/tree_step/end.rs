//! The sweeps at the end of a step of [`super::TreeStep`]: coordinates, momenta, round-off.

use super::link::{Constants, Work};
use super::place::{Place, balance, frame, frame_mut};
use crate::geometry::lane_matrices::Columns;
use crate::geometry::lanes::{Lanes, Width, sweep, three};
use crate::pair::PairKind;
use crate::tree::{SLACK, Tree};
use vi_core::interval::{Interval, IntervalParts};
use vi_core::state::State;
use vi_rigid::reparametrization::CLEAN_THRESHOLD;

/// `q_{n+1}` of a link after its parent's, and `Δq`, from `q_n` and its rounding error.
#[inline(always)]
fn place_next<W: Width>(
    (link, work): (&Constants, &Work),
    from: &Place<W>,
    error: [Lanes<W>; 4],
    parent: &Place<W>,
) -> (Place<W>, [Lanes<W>; 4]) {
    let w = from.center.width();
    let (d, turn, anchor) = (from.d, work.turn.take(w), Lanes::new(w, link.anchor));
    let moved = Lanes::take(w, &work.shift) - turn.mul(d.mul(anchor)); // Δx − (A − 1) ϱ²
    let turned = turn.times(&d); // (A − 1) d
    let next = Columns(three!(i => d.0[i] + (turned.0[i] + error[i + 1])));
    let center = match link.closes_gap {
        true => {
            let arm = parent.d.mul(Lanes::new(w, link.anchor_parent)); // ϱ¹
            parent.center + (arm - next.mul(anchor)) // no gap: φ² = φ¹ + ϱ¹ − ϱ²
        }
        false => from.center + (moved + error[0]),
    };
    let [a, b, c] = turned.0;
    (Place { center, d: next }, [moved, a, b, c])
}

sweep! {
    /// `q_{n+1}`, `Δq`, `q_{n+1/2}`, `Δq/h` of the last [`advance`](super::sweeps::advance), into
    /// the interval.
    close = sweep_close(links: &'a [Constants], works: &'a [Work], s: &'a mut Interval) -> ()
}

#[inline(always)]
fn sweep_close<W: Width>(w: W, links: &[Constants], works: &[Work], s: &mut Interval) {
    let h = s.h;
    let IntervalParts { q0, compensation, q1, dq, q_mid, v_mid } = s.parts_mut();
    let mut next = Place::ground(w); // of the link before
    for (link, work) in links.iter().zip(works) {
        if !link.follows_parent {
            next = Place::of_parent(w, link, q1);
        }
        let (at, error) = (link.frame, frame(compensation, link.frame));
        let (from, error) = (Place::of(w, q0, at), Lanes::vectors(w, error));
        let change;
        (next, change) = place_next((link, work), &from, error, &next);
        write([from.vectors(), next.vectors(), change], at, h, [q1, dq, q_mid, v_mid]);
    }
}

/// The coordinates of a frame in the interval, from those at the start, at the end and their
/// change.
#[inline(always)]
fn write<W: Width>(
    [from, to, change]: [[Lanes<W>; 4]; 3],
    first: usize,
    h: f64,
    [q1, dq, q_mid, v_mid]: [&mut [f64]; 4],
) {
    let (mut mid, mut rates) = (from, change);
    for i in 0..4 {
        (mid[i], rates[i]) = (from[i] + change[i] * 0.5, change[i] / h);
    }
    for (vectors, out) in [(to, q1), (change, dq), (mid, q_mid), (rates, v_mid)] {
        Lanes::write_vectors(vectors, frame_mut(out, first));
    }
}

sweep! {
    /// Moves a state to the end of the step: the interval as by [`close`], `q_{n+1}` without what
    /// round-off has added up ([`Tree::clean`]) and its rounding error. Where momenta depend on
    /// `Δq` and the `impulse` of constant forces in half a step alone, `p̄_{n+1} = M Δq/h` and
    /// that, and the balance of each link with these very momenta. Returns whether a glance at each
    /// link has shown that it is as it should be.
    finish = sweep_finish(
        links: &'a [Constants], works: &'a mut [Work], tree: &'a Tree, impulse: Option<&'a [f64]>,
        s: &'a mut Interval, state: &'a mut State
    ) -> bool
}

#[inline(always)]
fn sweep_finish<W: Width>(
    w: W,
    links: &[Constants],
    works: &mut [Work],
    tree: &Tree,
    impulse: Option<&[f64]>,
    s: &mut Interval,
    state: &mut State,
) -> bool {
    let (h, rate) = (s.h, 1.0 / s.h);
    let IntervalParts { q0, compensation, q1, dq, q_mid, v_mid } = s.parts_mut();
    let (q, rounding, p) = (&mut state.q, &mut state.compensation.q, &mut state.p);
    let (mut is_clean, mut far) = (true, Lanes::zero(w));
    let mut next = Place::ground(w); // of the link before
    for (k, link) in links.iter().enumerate() {
        if !link.follows_parent {
            next = Place::of_parent(w, link, q1);
        }
        let (parent, at, work) = (next, link.frame, &works[k]);
        let (from, error) = (Place::of(w, q0, at), Lanes::vectors(w, frame(compensation, at)));
        let change;
        (next, change) = place_next((link, work), &from, error, &parent);
        let (start, end) = (from.vectors(), next.vectors());
        write([start, end, change], at, h, [q1, dq, q_mid, v_mid]);
        far += next.center * 0.0; // not zero where it is not finite
        Lanes::write_vectors(end, frame_mut(q, at));
        Lanes::write_vectors(rounding_error([start, end, change, error]), frame_mut(rounding, at));
        let moved = link.parent.is_some_and(|parent| works[parent].cleaned);
        let clean = !moved && looks_clean(link, &next, &parent);
        works[k].cleaned = !clean && tree.clean_link(&tree.links()[k], q);
        is_clean &= clean;
        if works[k].cleaned {
            for i in at..at + 12 {
                let change = dq[i] + compensation[i];
                rounding[i] = vi_core::interval::rounding_error([q0[i], q1[i]], change, q[i]);
            }
        }
        let Some(impulse) = impulse else { continue };
        let impulse = Lanes::vectors(w, frame(impulse, at));
        let rest = move_momenta(link, change, impulse, rate, frame_mut(p, at));
        let anchor = from.d.mul(Lanes::new(w, link.anchor));
        works[k].wrench = balance(&from.d, anchor, rest).held();
    }
    is_clean & far.within(0.0)
}

/// `p̄_{n+1}` of a link; returns its part of the balance, a difference of nearly equal numbers: it
/// is exact.
#[inline(always)]
fn move_momenta<W: Width>(
    link: &Constants,
    change: [Lanes<W>; 4],
    impulse: [Lanes<W>; 4],
    rate: f64,
    p: &mut [f64; 12],
) -> [Lanes<W>; 4] {
    let w = change[0].width();
    let (before, mut after, mut rest) = (Lanes::vectors(w, p), impulse, impulse);
    for i in 0..4 {
        let row = &link.mass[i];
        let mut momentum = Lanes::zero(w); // M Δq/h
        if link.is_diagonal {
            momentum = change[i] * (rate * row[i]);
        } else {
            for j in 0..4 {
                momentum += change[j] * (rate * row[j]);
            }
        }
        rest[i] = (before[i] + impulse[i]) - momentum;
        after[i] = momentum + impulse[i];
    }
    Lanes::write_vectors(after, p);
    rest
}

/// [`vi_core::interval::rounding_error`] of a frame that is at the end of the step.
#[inline(always)]
fn rounding_error<W: Width>([start, end, change, error]: [[Lanes<W>; 4]; 4]) -> [Lanes<W>; 4] {
    let mut rounding = error;
    for i in 0..4 {
        let rest = (start[i] - end[i]) + (change[i] + error[i]);
        rounding[i] = rest.if_small(2.0 * f64::EPSILON, [start[i], end[i]]);
    }
    rounding
}

/// Whether the directors of a link, its axes and its gap show no more round-off than is left
/// anyway; the gap of a pair that closes it was removed with the parent where that is. The thread
/// of a screw is not seen at a glance.
#[inline(always)]
fn looks_clean<W: Width>(link: &Constants, own: &Place<W>, parent: &Place<W>) -> bool {
    let [d1, d2, d3] = own.d.0;
    let one = Lanes::new(d1.width(), [1.0; 3]);
    let lengths = Lanes::dots([(d1, d1), (d2, d2), (d3, d3)]) - one;
    let angles = Lanes::dots([(d1, d2), (d1, d3), (d2, d3)]);
    let rigid = lengths.within(CLEAN_THRESHOLD) & angles.within(CLEAN_THRESHOLD);
    let (d, at) = (&own.d, &parent.d);
    match link.kind {
        PairKind::Spherical | PairKind::Free => rigid,
        PairKind::Revolute => rigid & off_axis(link, d, at, 2).within(SLACK),
        PairKind::Universal => rigid & (cosine(link, d, at).abs() <= SLACK),
        PairKind::Fixed => rigid & attitude(link, d, at).within(SLACK),
        PairKind::Prismatic => {
            rigid
                & attitude(link, d, at).within(SLACK)
                & across_axis(link, own, parent).within(SLACK)
        }
        PairKind::Cylindrical => {
            rigid
                & off_axis(link, d, at, 2).within(SLACK)
                & across_axis(link, own, parent).within(SLACK)
        }
        PairKind::Planar => {
            let along = along_axis(link, at, own.gap(link, parent));
            rigid & off_axis(link, d, at, 2).within(SLACK) & along.within(SLACK)
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
fn cosine<W: Width>(link: &Constants, d: &Columns<Lanes<W>>, parent: &Columns<Lanes<W>>) -> f64 {
    let w = d.0[0].width();
    parent.mul(Lanes::new(w, link.axes[2])).dot(d.mul(Lanes::new(w, link.axes_child[0])))
}

/// The part of the gap across the axis.
#[inline(always)]
fn across_axis<W: Width>(link: &Constants, own: &Place<W>, parent: &Place<W>) -> Lanes<W> {
    let gap = own.gap(link, parent);
    gap - along_axis(link, &parent.d, gap)
}

/// The part of a vector along the axis.
#[inline(always)]
fn along_axis<W: Width>(link: &Constants, parent: &Columns<Lanes<W>>, v: Lanes<W>) -> Lanes<W> {
    let n = parent.mul(Lanes::new(parent.0[0].width(), link.axes[2]));
    n * n.dot(v)
}
