//! Where the directions of the efforts of a law are taken.

use vi_core::interval::{Interval, Slot};

/// Where the directions of efforts are taken.
#[derive(Clone, Copy, Debug)]
pub(super) struct EffortAxes<'a> {
    /// Of levers and gradients.
    pub(super) own: &'a [f64],
    /// Of directions that turn with a member or a line.
    pub(super) mid: &'a [f64],
}

impl<'a> EffortAxes<'a> {
    pub(super) fn end_of(s: &'a Interval, end: Slot) -> Self {
        Self { own: s.node(end), mid: &s.q_mid }
    }
    pub(super) fn node(q: &'a [f64]) -> Self {
        Self { own: q, mid: q }
    }
}
