//! Centre and directors of a link, and where they stand among the coordinates.

use super::link::Constants;
use crate::geometry::lane_matrices::{Columns, Pair};
use crate::geometry::lanes::{Lanes, Width};

/// The coordinates of a frame.
#[inline(always)]
pub(super) fn frame(q: &[f64], first: usize) -> &[f64; 12] {
    q[first..first + 12].try_into().expect("twelve coordinates")
}

/// The same, to be written.
#[inline(always)]
pub(super) fn frame_mut(q: &mut [f64], first: usize) -> &mut [f64; 12] {
    (&mut q[first..first + 12]).try_into().expect("twelve coordinates")
}

/// Where a link is: its centre and its directors.
#[derive(Clone, Copy)]
pub(super) struct Place<W: Width> {
    pub(super) center: Lanes<W>,
    pub(super) d: Columns<Lanes<W>>,
}

impl<W: Width> Place<W> {
    #[inline(always)]
    pub(super) fn of(w: W, q: &[f64], first: usize) -> Self {
        let [center, a, b, c] = Lanes::vectors(w, frame(q, first));
        Self { center, d: Columns([a, b, c]) }
    }

    /// Of the parent of a link; of the ground: the inertial base.
    #[inline(always)]
    pub(super) fn of_parent(w: W, link: &Constants, q: &[f64]) -> Self {
        match link.parent {
            Some(_) => Self::of(w, q, link.parent_frame),
            None => Self::ground(w),
        }
    }

    /// Of the ground.
    #[inline(always)]
    pub(super) fn ground(w: W) -> Self {
        Self { center: Lanes::zero(w), d: Columns::multiple(w, 1.0) }
    }

    /// `φ, d_1, d_2, d_3`.
    #[inline(always)]
    pub(super) fn vectors(self) -> [Lanes<W>; 4] {
        let [a, b, c] = self.d.0;
        [self.center, a, b, c]
    }

    /// The gap of the joint of a link that is here; `parent`: where its parent is.
    #[inline(always)]
    pub(super) fn gap(&self, link: &Constants, parent: &Self) -> Lanes<W> {
        let w = self.center.width();
        let start = parent.center + parent.d.mul(Lanes::new(w, link.anchor_parent));
        (self.center + self.d.mul(Lanes::new(w, link.anchor))) - start
    }
}

/// The wrench about the reference point of a link, from the vectors that belong to its centre and
/// its directors `d`; `anchor`: from the centre to that point.
#[inline(always)]
pub(super) fn balance<W: Width>(
    d: &Columns<Lanes<W>>,
    anchor: Lanes<W>,
    [linear, first, second, third]: [Lanes<W>; 4],
) -> Pair<Lanes<W>> {
    let spin = (d.0[0].cross(first) + d.0[1].cross(second)) + d.0[2].cross(third);
    Pair { linear, angular: spin - anchor.cross(linear) }
}
