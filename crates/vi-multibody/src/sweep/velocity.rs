//! Velocities of frames from the twists of the links.

use super::link::{Link, Work};
use super::place::LinkPlace;
use crate::geometry::space::{Number, Space, Vector};

/// `v`: velocities of centres and directors from the twists of the links at `q`, `v = P ν`.
#[inline(always)]
pub(crate) fn push_forward<S: Space>(
    s: S,
    links: &[Link<S::Store>],
    works: &[Work<S::Store>],
    q: &[Number<S>],
    v: &mut [Number<S>],
) {
    for (link, work) in links.iter().zip(works) {
        let (d, twist) = (LinkPlace::of(s, q, link.frame).d, work.twist.take(s));
        let arm = d.mul(s.constant(&link.anchor)); // from the centre to the reference point
        let center = twist.linear - twist.angular.cross(arm);
        let [a, b, c] = d.0;
        let spin = twist.angular;
        s.write_frame([center, spin.cross(a), spin.cross(b), spin.cross(c)], v, link.frame);
    }
}
