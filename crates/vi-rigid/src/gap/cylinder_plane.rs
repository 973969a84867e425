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
//! On a face of a box or another cylinder, arcs of the rim take the place of the points that are
//! fixed: the contact of an arc is its lowest point.
//!
//! Letters: `c` centre of a rim, `a` axis, `R` radius, `b` a direction across the axis.

use super::contact_point::{ContactPoint, in_space, turned};
use super::points_plane::Plane;
use super::solids::perpendicular;
use nalgebra::Vector3;
use std::f64::consts::TAU;
use vi_core::{Embed, Number};

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

/// Into how many arcs a rim is divided on a face.
const ARCS: u32 = 96;
/// Of a rim on a face: the lowest point, that of each arc, the three on which it stands.
pub(super) const ON_FACE: u32 = 4 + ARCS;

/// The axes of a cylinder in space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rims<T = f64> {
    pub(super) axis: Vector3<T>,
    pub(super) fixed: Vector3<T>, // b
    pub(super) side: Vector3<T>,  // a × b
}

impl<T: Number> Rims<T> {
    pub(super) fn new<S: Embed<T>>(ends: &[Vector3<S>; 2], frame: &[T]) -> Self {
        let own = (ends[1] - ends[0]).normalize();
        let (axis, fixed) = (turned(frame, &own), turned(frame, &perpendicular(&own)));
        Self { axis, fixed, side: axis.cross(&fixed) }
    }

    /// `e` of the lowest point, and `|m|`.
    fn lowest(&self, normal: &Vector3<T>) -> (Vector3<T>, T) {
        let across = normal - self.axis * normal.dot(&self.axis);
        let (size, near) = (across.norm(), T::of(UPRIGHT));
        let blended = self.fixed * (near * (near / size).min(T::of(1.0))) - across;
        let e = blended.normalize(); // has a part along the axis by rounding where `m` is short
        ((e - self.axis * e.dot(&self.axis)).normalize(), size)
    }

    /// `e` at an angle from `b`.
    fn at(&self, angle: f64) -> Vector3<T> {
        let (sin, cos) = libm::sincos(angle);
        self.fixed * T::of(cos) + self.side * T::of(sin)
    }
}

impl Rims {
    /// The angle from `b` to a direction.
    fn turn(&self, e: &Vector3<f64>) -> f64 {
        libm::atan2(e.dot(&self.side), e.dot(&self.fixed))
    }

    /// `e` of a point of a rim on a face; `normal`: that of the face.
    pub(super) fn on_face(&self, point: u32, normal: &Vector3<f64>) -> Vector3<f64> {
        let lowest = self.lowest(normal).0;
        match point {
            0 => lowest,
            1..=ARCS => {
                let (middle, half) = (angle(point - 1, ARCS), 0.5 * angle(1, ARCS));
                let off = self.turn(&lowest) - middle;
                let off = off - TAU * (off / TAU).round();
                if off.abs() <= half { lowest } else { self.at(middle + half.copysign(off)) }
            }
            standing => self.at(angle(2 * (standing - ARCS) - 1, 6)),
        }
    }

    /// The points of a rim on a face that count, in ascending order.
    pub(super) fn points_on_face(
        &self,
        normal: &Vector3<f64>,
    ) -> impl Iterator<Item = u32> + use<> {
        let (lowest, size) = self.lowest(normal);
        let first = if size < FIXED { 1 + next_to(self.turn(&lowest), ARCS) } else { 0 };
        let standing = if size < STANDS { 3 } else { 0 };
        std::iter::once(first).chain((1..=standing).map(|k| ARCS + k))
    }
}

/// The angle of a part of a rim.
fn angle(part: u32, parts: u32) -> f64 {
    TAU * f64::from(part) / f64::from(parts)
}

/// The part of a rim next to an angle.
fn next_to(angle: f64, parts: u32) -> u32 {
    let parts = f64::from(parts);
    (angle / TAU * parts).round().rem_euclid(parts) as u32
}

/// The contact of a point of a rim.
pub(super) fn contact<S: Embed<T>, T: Number>(
    feature: u32,
    plane: &Plane<T>,
    ends: &[Vector3<S>; 2],
    radius: S,
    frame: &[T],
) -> ContactPoint<T> {
    let rims: Rims<T> = Rims::new(ends, frame);
    let direction = match feature % POINTS {
        0 => rims.lowest(&plane.normal).0,
        point => rims.at(angle(point - 1, PARTS)),
    };
    let center = in_space(frame, &ends[(feature / POINTS) as usize]);
    plane.contact_with(&(center + direction * radius.embed()))
}

/// The points of a rim that count, in ascending order.
pub(super) fn active(
    normal: &Vector3<f64>,
    ends: &[Vector3<f64>; 2],
    frame: &[f64],
) -> impl Iterator<Item = u32> + Clone {
    let rims: Rims = Rims::new(ends, frame);
    let (lowest, size) = rims.lowest(normal);
    let sixth = |k: u32| 1 + k * (PARTS / 6);
    let mut points = [0, sixth(1), sixth(3), sixth(5)];
    if size < FIXED {
        points[0] = 1 + next_to(rims.turn(&lowest), PARTS);
        points.sort_unstable();
    }
    let count = if size < STANDS { 4 } else { 1 };
    (0..count).filter(move |k| *k == 0 || points[*k] != points[*k - 1]).map(move |k| points[k])
}
