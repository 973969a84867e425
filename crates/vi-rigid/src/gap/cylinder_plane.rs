//! A cylinder on a plane: points of its rims.
//!
//! ```text
//! x = c + R e,   e ∝ −m + δ min(1, δ/|m|) b,   m = n − (n·a) a,   g = n·(x − o)
//! ```
//! the lowest point of each rim; also three points of the rim that are fixed in the body, at 60°,
//! 180° and 300° from `b`: they count where the cylinder nearly stands, `|n × a| < 0.1`. Of a
//! cylinder that stands the direction is `b`, which is fixed in the body, too: `δ` is 1e-9.
//!
//! Letters: `c` centre of a rim, `a` axis, `R` radius.

use super::contact_point::{ContactPoint, in_space, turned};
use super::points_plane::Plane;
use super::solids::perpendicular;
use nalgebra::Vector3;
use vi_core::Number;

/// Of a cylinder on a plane: four points of each rim.
pub(super) const FEATURES: u32 = 2 * POINTS;
const POINTS: u32 = 4;
/// `|n × a|` below which it stands on a rim.
const STANDS: f64 = 0.1;
/// `δ`.
const FIXED: f64 = 1e-9;

/// The contact of a point of a rim.
pub(super) fn contact<T: Number>(
    feature: u32,
    plane: &Plane<T>,
    (ends, radius): (&[Vector3<f64>; 2], f64),
    frame: &[T],
) -> ContactPoint<T> {
    let own = (ends[1] - ends[0]).normalize();
    let axis = turned(frame, &own);
    let across = plane.normal - axis * plane.normal.dot(&axis);
    let fixed = turned(frame, &perpendicular(&own));
    let side = axis.cross(&fixed);
    let (near, half, leg) = (T::of(FIXED), T::of(0.5), T::of(0.5 * 3.0_f64.sqrt()));
    let direction = match feature % POINTS {
        0 => (fixed * (near * (near / across.norm()).min(T::of(1.0))) - across).normalize(),
        1 => fixed * half + side * leg,
        2 => -fixed,
        _ => fixed * half - side * leg,
    };
    let rim = in_space(frame, &ends[(feature / POINTS) as usize]);
    plane.contact_with(&(rim + direction * T::of(radius)))
}

/// Whether a feature is the lowest point of a rim.
pub(super) fn is_lowest(feature: u32) -> bool {
    feature.is_multiple_of(POINTS)
}

/// Whether the cylinder nearly stands.
pub(super) fn stands(normal: &Vector3<f64>, ends: &[Vector3<f64>; 2], frame: &[f64]) -> bool {
    turned(frame, &(ends[1] - ends[0]).normalize()).cross(normal).norm() < STANDS
}
