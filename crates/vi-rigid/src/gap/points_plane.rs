//! Balls about points on a plane: spheres, the ends of capsules, corners of boxes.
//!
//! ```text
//! g = n·(x − o) − R
//! ```
//! On a plane of a body `g` is bilinear in the coordinates of both, and its normal turns with A.

use super::contact_point::{ContactPoint, in_space, turned};
use nalgebra::Vector3;
use vi_core::{Embed, Number};

/// A plane in space.
#[derive(Clone, Copy, Debug)]
pub struct Plane<T = f64> {
    /// A point of it.
    pub point: Vector3<T>,
    /// Its unit normal, out of the body.
    pub normal: Vector3<T>,
}

impl<T: Number> Plane<T> {
    /// A plane in the components of its frame.
    #[must_use]
    pub fn in_space<S: Embed<T>>(point: &Vector3<S>, normal: &Vector3<S>, frame: &[T]) -> Self {
        Self { point: in_space(frame, point), normal: turned(frame, normal) }
    }

    /// The contact with the lowest point of a body.
    pub(super) fn contact_with(&self, lowest: &Vector3<T>) -> ContactPoint<T> {
        let gap = self.normal.dot(&(lowest - self.point));
        ContactPoint { gap, normal: self.normal, point: lowest - self.normal * (T::of(0.5) * gap) }
    }
}

/// The contact of a ball about a point.
#[must_use]
pub fn contact<S: Embed<T>, T: Number>(
    plane: &Plane<T>,
    point: &Vector3<S>,
    radius: S,
    frame: &[T],
) -> ContactPoint<T> {
    plane.contact_with(&(in_space(frame, point) - plane.normal * radius.embed()))
}
