//! The values of the constraints of frames and joints from the vectors of each joint, in the order of its rows.
//!
//! The rows themselves ([`PairKind::rows`](super::PairKind::rows)) are forms over the coordinates, each evaluated on its
//! own; here the rows of a joint share its gap and its axes.

use super::PairKind;
use crate::geometry::lane_matrices::Columns;
use crate::geometry::lanes::{Lanes, Width, sweep, three};
use crate::pair::joint::Joint;
use std::ops::Range;
use vi_rigid::directors::FRAME;

sweep! {
    /// `out ←` six internal constraints (56) for each of `frames` frames, then the products of the joints at their `rows`;
    /// the thread of a screw is none.
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
        let at = Sides::new(w, joint, frames);
        at.write(joint.kind, &mut out[rows.clone()]);
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
    #[inline(always)]
    fn new(w: W, joint: &'a Joint, frames: &[f64]) -> Self {
        let (near, far) = (joint.parent.coordinates(frames), joint.child.coordinates(frames));
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
}
