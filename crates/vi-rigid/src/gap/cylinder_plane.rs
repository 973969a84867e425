//! A cylinder on a plane: points of its rims.
//!
//! ```text
//! x = c + R e,   e ∝ −m + δ min(1, δ/|m|) b,   m = n − (n·a) a,   g = n·(x − o)
//! ```
//! the lowest point of each rim, which moves along it. Where the cylinder passes through the
//! upright within a step, that point jumps to the other side of the rim: points that are fixed in
//! the body do not. Of the `S` equal parts of a rim these are the points, counted from `b`. Where
//! the cylinder nearly stands, `|m| < 0.03`, the one next to the lowest point takes its place;
//! where `|m| < 0.1`, those at 60°, 180° and 300° count, too. Of a cylinder that stands the lowest
//! point is that of `b`: `δ` is 1e-9.
//!
//! Letters: `c` centre of a rim, `a` axis, `R` radius, `b` a direction across the axis.

use super::contact_point::{ContactPoint, in_space, turned};
use super::points_plane::Plane;
use super::solids::perpendicular;
use nalgebra::Vector3;
use vi_core::Number;

/// Of a cylinder on a plane.
pub(super) const FEATURES: u32 = 2 * POINTS;
/// Of each rim: the lowest point, then those that are fixed in the body.
pub(super) const POINTS: u32 = 1 + PARTS;
/// `S`: the lowest of them is `R |m| π²/2S²` above the lowest point at most.
const PARTS: u32 = 12288;
/// `|m|` below which it stands on three points, too.
const STANDS: f64 = 0.1;
/// `|m|` below which its lowest point is one that is fixed in the body.
const FIXED: f64 = 0.03;
/// `δ`.
const UPRIGHT: f64 = 1e-9;

/// A cylinder in space.
struct Rims<T> {
    axis: Vector3<T>,
    fixed: Vector3<T>, // b
    side: Vector3<T>,  // a × b
}

impl<T: Number> Rims<T> {
    fn new(ends: &[Vector3<f64>; 2], frame: &[T]) -> Self {
        let own = (ends[1] - ends[0]).normalize();
        let (axis, fixed) = (turned(frame, &own), turned(frame, &perpendicular(&own)));
        Self { axis, fixed, side: axis.cross(&fixed) }
    }

    /// `e` of the lowest point, and `|m|`.
    fn lowest(&self, normal: &Vector3<T>) -> (Vector3<T>, T) {
        let across = normal - self.axis * normal.dot(&self.axis);
        let (size, near) = (across.norm(), T::of(UPRIGHT));
        let blended = self.fixed * (near * (near / size).min(T::of(1.0))) - across;
        (blended.normalize(), size)
    }

    /// `e` of a point that is fixed in the body.
    fn part(&self, part: u32) -> Vector3<T> {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * f64::from(part) / f64::from(PARTS));
        self.fixed * T::of(cos) + self.side * T::of(sin)
    }
}

/// The contact of a point of a rim.
pub(super) fn contact<T: Number>(
    feature: u32,
    plane: &Plane<T>,
    (ends, radius): (&[Vector3<f64>; 2], f64),
    frame: &[T],
) -> ContactPoint<T> {
    let rims = Rims::new(ends, frame);
    let direction = match feature % POINTS {
        0 => rims.lowest(&plane.normal).0,
        point => rims.part(point - 1),
    };
    let center = in_space(frame, &ends[(feature / POINTS) as usize]);
    plane.contact_with(&(center + direction * T::of(radius)))
}

/// The points of a rim that count, in ascending order.
pub(super) fn active(
    normal: &Vector3<f64>,
    ends: &[Vector3<f64>; 2],
    frame: &[f64],
) -> impl Iterator<Item = u32> + Clone {
    let rims = Rims::new(ends, frame);
    let (lowest, size) = rims.lowest(normal);
    let sixth = |k: u32| 1 + k * (PARTS / 6);
    let mut points = [0, sixth(1), sixth(3), sixth(5)];
    if size < FIXED {
        let turn = libm::atan2(lowest.dot(&rims.side), lowest.dot(&rims.fixed));
        let part = (turn / std::f64::consts::TAU * f64::from(PARTS)).round();
        points[0] = 1 + part.rem_euclid(f64::from(PARTS)) as u32;
        points.sort_unstable();
    }
    let count = if size < STANDS { 4 } else { 1 };
    (0..count).filter(move |k| *k == 0 || points[*k] != points[*k - 1]).map(move |k| points[k])
}
