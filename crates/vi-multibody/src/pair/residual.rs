//! The values and rates of the constraints of frames and joints from the vectors of each joint, in
//! the order of its rows.
//!
//! The rows themselves ([`PairKind::rows`](super::PairKind::rows)) are forms over the coordinates,
//! each evaluated on its own; here the rows of a joint share its gap and its axes.

use super::PairKind;
use crate::geometry::lane_matrices::Columns;
use crate::geometry::lanes::{Lanes, Width, sweep, three};
use crate::pair::joint::{FrameId, GROUND, Joint, Side};
use std::ops::Range;
use vi_rigid::directors::FRAME;

sweep! {
    /// `out ←` six internal constraints (56) for each of `frames` frames, then the products of the
    /// joints at their `rows`; the thread of a screw is none.
    residuals = sweep_residuals(
        joints: &'a [Joint], rows: &'a [Range<usize>], frames: &'a [f64], out: &'a mut [f64]
    ) -> ()
}

#[inline(always)]
fn sweep_residuals<W: Width>(
    w: W,
    joints: &[Joint],
    rows: &[Range<usize>],
    frames: &[f64],
    out: &mut [f64],
) {
    for (frame, g) in frames.chunks_exact(FRAME).zip(out.chunks_exact_mut(6)) {
        let [a, b, c] = three!(i => Lanes::of(w, &frame[3 + 3 * i..]));
        let lengths = Lanes::dots([(a, a), (b, b), (c, c)]) - Lanes::new(w, [1.0; 3]);
        (lengths * 0.5).write(g);
        Lanes::dots([(a, b), (a, c), (b, c)]).write(&mut g[3..]);
    }
    for (joint, rows) in joints.iter().zip(rows) {
        let at = Sides::new(w, joint, [frames, &GROUND]);
        at.write(joint.kind, &mut out[rows.clone()]);
    }
}

sweep! {
    /// Adds the rates `G v` of the same constraints at the velocities `v` of the frames.
    add_rates = sweep_rates(
        joints: &'a [Joint], rows: &'a [Range<usize>], frames: &'a [f64], v: &'a [f64],
        out: &'a mut [f64]
    ) -> ()
}

#[inline(always)]
fn sweep_rates<W: Width>(
    w: W,
    joints: &[Joint],
    rows: &[Range<usize>],
    frames: &[f64],
    v: &[f64],
    out: &mut [f64],
) {
    let both = frames.chunks_exact(FRAME).zip(v.chunks_exact(FRAME));
    for ((frame, v), g) in both.zip(out.chunks_exact_mut(6)) {
        let [a, b, c] = three!(i => Lanes::of(w, &frame[3 + 3 * i..]));
        let [u, v, x] = three!(i => Lanes::of(w, &v[3 + 3 * i..]));
        Lanes::dots([(a, u), (b, v), (c, x)]).add_to(g);
        let angles = Lanes::dots([(a, v), (a, x), (b, x)]) + Lanes::dots([(u, b), (u, c), (v, c)]);
        angles.add_to(&mut g[3..]);
    }
    for (joint, rows) in joints.iter().zip(rows) {
        let at = Sides::new(w, joint, [frames, &GROUND]);
        let along = Sides::new(w, joint, [v, &[0.0; FRAME]]);
        at.add_rates(&along, joint.kind, &mut out[rows.clone()]);
    }
}

/// What belongs to a side of a joint, of all `frames` or of the `ground`.
#[inline(always)]
fn own<'a>(side: &Side, frames: &'a [f64], ground: &'a [f64]) -> &'a [f64] {
    match side.frame {
        FrameId::Ground => ground,
        FrameId::Frame(k) => &frames[FRAME * k..FRAME * (k + 1)],
    }
}

/// Both sides of a joint in one configuration.
struct Sides<'a, W: Width> {
    joint: &'a Joint,
    parent: Columns<Lanes<W>>, // directors
    child: Columns<Lanes<W>>,
    distance: Lanes<W>, // c
    w: W,
}

impl<'a, W: Width> Sides<'a, W> {
    /// At the coordinates of all frames and those of the ground, or at velocities of them.
    #[inline(always)]
    fn new(w: W, joint: &'a Joint, [frames, ground]: [&[f64]; 2]) -> Self {
        let (near, far) = (&joint.parent, &joint.child);
        let (near, far) = (own(near, frames, ground), own(far, frames, ground));
        Self {
            joint,
            parent: Columns(three!(i => Lanes::of(w, &near[3 + 3 * i..]))),
            child: Columns(three!(i => Lanes::of(w, &far[3 + 3 * i..]))),
            distance: Lanes::of(w, far) - Lanes::of(w, near),
            w,
        }
    }

    /// `r = φ² + ϱ² − φ¹ − ϱ¹`.
    #[inline(always)]
    fn gap(&self) -> Lanes<W> {
        let near = self.parent.mul(Lanes::of(self.w, self.joint.parent.anchor.as_slice()));
        let far = self.child.mul(Lanes::of(self.w, self.joint.child.anchor.as_slice()));
        (self.distance + far) - near
    }

    /// `m_1`, `m_2` or `n`.
    #[inline(always)]
    fn axis(&self, i: usize) -> Lanes<W> {
        self.parent.mul(Lanes::of(self.w, &self.joint.parent.axes.as_slice()[3 * i..]))
    }

    /// `m_1'`, `m_2'` or `n'`.
    #[inline(always)]
    fn axis_child(&self, i: usize) -> Lanes<W> {
        self.child.mul(Lanes::of(self.w, &self.joint.child.axes.as_slice()[3 * i..]))
    }

    #[inline(always)]
    fn write(&self, kind: PairKind, out: &mut [f64]) {
        match kind {
            PairKind::Spherical => self.gap().write(out),
            PairKind::Revolute => {
                self.gap().write(out);
                self.parallel_axes(&mut out[3..]);
            }
            PairKind::Cylindrical | PairKind::Screw(_) => {
                self.gap_off_axis(out);
                self.parallel_axes(&mut out[2..]);
            }
            PairKind::Prismatic => {
                self.gap_off_axis(out);
                self.equal_attitude(&mut out[2..]);
            }
            PairKind::Planar => {
                out[0] = self.axis(2).dot(self.gap());
                self.parallel_axes(&mut out[1..]);
            }
            PairKind::Fixed => {
                self.gap().write(out);
                self.equal_attitude(&mut out[3..]);
            }
            PairKind::Universal => {
                self.gap().write(out);
                out[3] = self.axis(2).dot(self.axis_child(0));
            }
            PairKind::Free => {}
        }
    }

    /// `m_1·r`, `m_2·r`.
    #[inline(always)]
    fn gap_off_axis(&self, out: &mut [f64]) {
        let gap = self.gap();
        (out[0], out[1]) = (self.axis(0).dot(gap), self.axis(1).dot(gap));
    }

    /// `n·m_1'`, `n·m_2'`.
    #[inline(always)]
    fn parallel_axes(&self, out: &mut [f64]) {
        let n = self.axis(2);
        (out[0], out[1]) = (n.dot(self.axis_child(0)), n.dot(self.axis_child(1)));
    }

    /// `m_1·m_2'`, `m_2·n'`, `n·m_1'`.
    #[inline(always)]
    fn equal_attitude(&self, out: &mut [f64]) {
        let pairs = three!(i => (self.axis(i), self.axis_child([1, 2, 0][i])));
        Lanes::dots(pairs).write(out);
    }

    /// The rates of the products of [`Sides::write`], `self` where they are and `along` a velocity.
    #[inline(always)]
    fn add_rates(&self, along: &Self, kind: PairKind, out: &mut [f64]) {
        match kind {
            PairKind::Spherical => along.gap().add_to(out),
            PairKind::Revolute => {
                along.gap().add_to(out);
                self.add_rate_of_axes(along, &mut out[3..]);
            }
            PairKind::Cylindrical | PairKind::Screw(_) => {
                self.add_rate_of_gap_off_axis(along, out);
                self.add_rate_of_axes(along, &mut out[2..]);
            }
            PairKind::Prismatic => {
                self.add_rate_of_gap_off_axis(along, out);
                self.add_rate_of_attitude(along, &mut out[2..]);
            }
            PairKind::Planar => {
                out[0] += self.axis(2).dot(along.gap()) + along.axis(2).dot(self.gap());
                self.add_rate_of_axes(along, &mut out[1..]);
            }
            PairKind::Fixed => {
                along.gap().add_to(out);
                self.add_rate_of_attitude(along, &mut out[3..]);
            }
            PairKind::Universal => {
                along.gap().add_to(out);
                let (here, there) = (self.axis_child(0), along.axis_child(0));
                out[3] += self.axis(2).dot(there) + along.axis(2).dot(here);
            }
            PairKind::Free => {}
        }
    }

    #[inline(always)]
    fn add_rate_of_gap_off_axis(&self, along: &Self, out: &mut [f64]) {
        let (gap, rate) = (self.gap(), along.gap());
        out[0] += self.axis(0).dot(rate) + along.axis(0).dot(gap);
        out[1] += self.axis(1).dot(rate) + along.axis(1).dot(gap);
    }

    #[inline(always)]
    fn add_rate_of_axes(&self, along: &Self, out: &mut [f64]) {
        let (n, rate) = (self.axis(2), along.axis(2));
        out[0] += n.dot(along.axis_child(0)) + rate.dot(self.axis_child(0));
        out[1] += n.dot(along.axis_child(1)) + rate.dot(self.axis_child(1));
    }

    #[inline(always)]
    fn add_rate_of_attitude(&self, along: &Self, out: &mut [f64]) {
        let there = three!(i => (self.axis(i), along.axis_child([1, 2, 0][i])));
        let here = three!(i => (along.axis(i), self.axis_child([1, 2, 0][i])));
        (Lanes::dots(there) + Lanes::dots(here)).add_to(out);
    }
}
