//! Balls about points on a plane: spheres, the ends of capsules, corners of boxes.
//!
//! ```text
//! g = n·(x − o) − R
//! ```
//! On a plane of a body `g` is bilinear in the coordinates of both, and its normal turns with A.

use super::contact_point::{ContactPoint, in_space, turned};
use nalgebra::Vector3;

/// A plane in space.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    /// A point of it.
    pub point: Vector3<f64>,
    /// Its unit normal, out of the body.
    pub normal: Vector3<f64>,
}

impl Plane {
    /// A plane in the components of its frame.
    #[must_use]
    pub fn in_space(point: &Vector3<f64>, normal: &Vector3<f64>, frame: &[f64]) -> Self {
        Self { point: in_space(frame, point), normal: turned(frame, normal) }
    }

    /// The contact with the lowest point of a body.
    pub(super) fn contact_with(&self, lowest: &Vector3<f64>) -> ContactPoint {
        let gap = self.normal.dot(&(lowest - self.point));
        ContactPoint { gap, normal: self.normal, point: lowest - self.normal * (0.5 * gap) }
    }
}

/// The contact of a ball about a point.
#[must_use]
pub fn contact(plane: &Plane, point: &Vector3<f64>, radius: f64, frame: &[f64]) -> ContactPoint {
    plane.contact_with(&(in_space(frame, point) - plane.normal * radius))
}
