//! Orientations as quaternions.
//!
//! ```text
//! R = (d_1 d_2 d_3) Aᵀ = rotation of (w, x, y, z)        A: principal axes in the body's own frame
//! R_Bᵀ R                                                 as an observer sees it
//! ```
//! `±(w, x, y, z)` are one rotation: along a motion the sign is that of the shorter way from the
//! node before, at its first node that of `w ≥ 0`.

use super::observer::Observer;
use nalgebra::{Quaternion, Rotation3, UnitQuaternion};
use vi_core::Number;

/// The orientation of a body, in space or as an observer sees it.
#[derive(Clone, Debug)]
pub(crate) struct Attitude {
    pub(super) own: Observer,
    pub(super) seen_from: Option<Observer>,
}

impl Attitude {
    /// One of both quaternions at coordinates `q`.
    pub(crate) fn quaternion<T: Number>(&self, q: &impl Fn(usize) -> T) -> Quaternion<T> {
        let own = self.own.axes_at(q);
        let rotation = match &self.seen_from {
            Some(observer) => observer.axes_at(q).tr_mul(&own),
            None => own,
        };
        let rotation = Rotation3::from_matrix_unchecked(rotation);
        UnitQuaternion::from_rotation_matrix(&rotation).into_inner()
    }

    /// That whose sign does not jump from `last`.
    pub(super) fn next(&self, q: &[f64], last: &Quaternion<f64>) -> Quaternion<f64> {
        let next = self.quaternion(&|i| q[i]);
        next * sign(&next, last)
    }

    /// The first coordinates of the frames that it depends on.
    pub(crate) fn frames(&self) -> impl Iterator<Item = usize> {
        [Some(self.own.first), self.seen_from.as_ref().map(|own| own.first)].into_iter().flatten()
    }
}

/// `±1`, with which a quaternion does not jump from the last one.
pub(crate) fn sign(next: &Quaternion<f64>, last: &Quaternion<f64>) -> f64 {
    if next.dot(last) < 0.0 { -1.0 } else { 1.0 }
}
