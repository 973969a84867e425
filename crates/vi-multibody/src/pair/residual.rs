//! The values and rates of the constraints of frames and joints from the vectors of each joint, in
//! the order of its rows.
//!
//! The rows themselves ([`PairKind::rows`](super::PairKind::rows)) are forms over the coordinates,
//! each evaluated on its own; here the rows of a joint share its gap and its axes.

use super::constraints::PairConstraint;
use crate::geometry::matrix::Columns;
use crate::geometry::one_tree::{OneTree, Width, Xyz, sweep, three};
use crate::geometry::space::{Space, Vector};
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
    w: OneTree<W>,
    joints: &[Joint],
    rows: &[Range<usize>],
    frames: &[f64],
    out: &mut [f64],
) {
    for (frame, g) in frames.chunks_exact(FRAME).zip(out.chunks_exact_mut(6)) {
        let [a, b, c] = three!(i => w.read(frame, 3 + 3 * i));
        let lengths = Xyz::dots([(a, a), (b, b), (c, c)]) - w.vector([1.0; 3]);
        w.write(lengths * 0.5, g, 0);
        w.write(Xyz::dots([(a, b), (a, c), (b, c)]), g, 3);
    }
    for (joint, rows) in joints.iter().zip(rows) {
        let at = Sides::new(w, joint, [frames, &GROUND]);
        at.write(&mut out[rows.clone()]);
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
    w: OneTree<W>,
    joints: &[Joint],
    rows: &[Range<usize>],
    frames: &[f64],
    v: &[f64],
    out: &mut [f64],
) {
    let both = frames.chunks_exact(FRAME).zip(v.chunks_exact(FRAME));
    for ((frame, v), g) in both.zip(out.chunks_exact_mut(6)) {
        let [a, b, c] = three!(i => w.read(frame, 3 + 3 * i));
        let [u, v, x] = three!(i => w.read(v, 3 + 3 * i));
        add(w, Xyz::dots([(a, u), (b, v), (c, x)]), g);
        let angles = Xyz::dots([(a, v), (a, x), (b, x)]) + Xyz::dots([(u, b), (u, c), (v, c)]);
        add(w, angles, &mut g[3..]);
    }
    for (joint, rows) in joints.iter().zip(rows) {
        let at = Sides::new(w, joint, [frames, &GROUND]);
        let along = Sides::new(w, joint, [v, &[0.0; FRAME]]);
        at.add_rates(&along, &mut out[rows.clone()]);
    }
}

/// Adds to the first three of a slice.
#[inline(always)]
fn add<W: Width>(w: OneTree<W>, v: Xyz<W>, out: &mut [f64]) {
    w.write(w.read(out, 0) + v, out, 0);
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
    parent: Columns<Xyz<W>>, // directors
    child: Columns<Xyz<W>>,
    distance: Xyz<W>, // c
    w: OneTree<W>,
}

impl<'a, W: Width> Sides<'a, W> {
    /// At the coordinates of all frames and those of the ground, or at velocities of them.
    #[inline(always)]
    fn new(w: OneTree<W>, joint: &'a Joint, [frames, ground]: [&[f64]; 2]) -> Self {
        let (near, far) = (&joint.parent, &joint.child);
        let (near, far) = (own(near, frames, ground), own(far, frames, ground));
        Self {
            joint,
            parent: Columns(three!(i => w.read(near, 3 + 3 * i))),
            child: Columns(three!(i => w.read(far, 3 + 3 * i))),
            distance: w.read(far, 0) - w.read(near, 0),
            w,
        }
    }

    /// `r = φ² + ϱ² − φ¹ − ϱ¹`.
    #[inline(always)]
    fn gap(&self) -> Xyz<W> {
        let near = self.parent.mul(self.w.vector(self.joint.parent.anchor.into()));
        let far = self.child.mul(self.w.vector(self.joint.child.anchor.into()));
        (self.distance + far) - near
    }

    /// `m_1`, `m_2` or `n`.
    #[inline(always)]
    fn axis(&self, i: usize) -> Xyz<W> {
        self.parent.mul(self.w.read(self.joint.parent.axes.as_slice(), 3 * i))
    }

    /// `m_1'`, `m_2'` or `n'`.
    #[inline(always)]
    fn axis_child(&self, i: usize) -> Xyz<W> {
        self.child.mul(self.w.read(self.joint.child.axes.as_slice(), 3 * i))
    }

    /// The products of the constraints.
    #[inline(always)]
    fn write(&self, out: &mut [f64]) {
        let mut first = 0;
        for constraint in self.joint.kind.properties().constraints {
            let out = &mut out[first..];
            match constraint {
                PairConstraint::NoGap => self.w.write(self.gap(), out, 0),
                PairConstraint::GapAlongAxis => self.gap_off_axis(out),
                PairConstraint::GapAcrossAxis => out[0] = self.axis(2).dot(self.gap()),
                PairConstraint::ParallelAxes => self.parallel_axes(out),
                PairConstraint::EqualAttitude => self.equal_attitude(out),
                PairConstraint::OrthogonalAxes => {
                    out[0] = self.axis(2).dot(self.axis_child(0));
                }
                PairConstraint::Thread => {}
            }
            first += constraint.count();
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
        self.w.write(Xyz::dots(pairs), out, 0);
    }

    /// The rates of the products of [`Sides::write`], `self` where they are and `along` a velocity.
    #[inline(always)]
    fn add_rates(&self, along: &Self, out: &mut [f64]) {
        let mut first = 0;
        for constraint in self.joint.kind.properties().constraints {
            let out = &mut out[first..];
            match constraint {
                PairConstraint::NoGap => add(self.w, along.gap(), out),
                PairConstraint::GapAlongAxis => self.add_rate_of_gap_off_axis(along, out),
                PairConstraint::GapAcrossAxis => {
                    out[0] += self.axis(2).dot(along.gap()) + along.axis(2).dot(self.gap());
                }
                PairConstraint::ParallelAxes => self.add_rate_of_axes(along, out),
                PairConstraint::EqualAttitude => self.add_rate_of_attitude(along, out),
                PairConstraint::OrthogonalAxes => {
                    let (here, there) = (self.axis_child(0), along.axis_child(0));
                    out[0] += self.axis(2).dot(there) + along.axis(2).dot(here);
                }
                PairConstraint::Thread => {}
            }
            first += constraint.count();
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
        add(self.w, Xyz::dots(there) + Xyz::dots(here), out);
    }
}
