//! Balls about points against boxes and cylinders.
//!
//! ```text
//! box        s_i = |y_i| − a_i                       y: the point in the axes of the box
//! cylinder   s = (|z| − L, r − R)                    z along the axis, r from it
//! g = |max(s, 0)| − ϱ    outside,    max s − ϱ    inside (nearest face)
//! ```
//! The distance is smooth outside of the solid, also where the nearest point moves from a face to
//! an edge. A point without a radius touches a face of a box: a feature for each of them.

use super::ContactShape;
use super::contact_point::{ContactPoint, in_space, turned};
use super::points_plane::Plane;
use nalgebra::{Matrix3, Vector3};
use vi_core::Number;

/// Faces of a box: those of the axis `k/2`, the positive one first.
pub(super) const FACES: u32 = 6;

/// A box or a cylinder in space.
#[derive(Clone, Copy, Debug)]
pub(super) enum Solid<T = f64> {
    /// Centre, axes, half lengths.
    Box(Vector3<T>, Matrix3<T>, Vector3<f64>),
    /// Centre, unit axis, half length, radius.
    Cylinder(Vector3<T>, Vector3<T>, T, f64),
}

impl<T: Number> Solid<T> {
    /// Of a shape on a frame; `None` of others.
    pub(super) fn in_space(shape: &ContactShape, frame: &[T]) -> Option<Self> {
        match shape {
            ContactShape::Box { center, axes, half_lengths } => {
                let columns = [0, 1, 2].map(|i| turned(frame, &axes.column(i).into_owned()));
                let axes = Matrix3::from_columns(&columns);
                Some(Self::Box(in_space(frame, center), axes, *half_lengths))
            }
            ContactShape::Cylinder { ends, radius } => {
                let [first, last] = ends.map(|end| in_space(frame, &end));
                let along = last - first;
                let length = along.norm();
                let half = T::of(0.5);
                Some(Self::Cylinder((first + last) * half, along / length, length * half, *radius))
            }
            _ => None,
        }
    }

    /// The outward excess of a point over each pair of faces, with the outward directions.
    fn excess(&self, x: &Vector3<T>) -> ([T; 3], [Vector3<T>; 3], usize) {
        let one = T::of(1.0);
        match self {
            Self::Box(center, axes, half) => {
                let arm = x - center;
                let y = [0, 1, 2].map(|i| arm.dot(&axes.column(i)));
                let outward = [0, 1, 2].map(|i| axes.column(i) * one.copysign(y[i]));
                ([0, 1, 2].map(|i| y[i].abs() - T::of(half[i])), outward, 3)
            }
            Self::Cylinder(center, axis, half, radius) => {
                let arm = x - center;
                let z = arm.dot(axis);
                let across = arm - axis * z;
                let r = across.norm();
                // on the axis any direction is outward
                let outward = if Number::real(r) > 0.0 { across / r } else { perpendicular(axis) };
                let along = axis * one.copysign(z);
                let excess = [z.abs() - *half, r - T::of(*radius), T::of(f64::MIN)];
                (excess, [along, outward, along], 2)
            }
        }
    }

    /// The contact of a ball, as B.
    pub(super) fn contact(&self, x: &Vector3<T>, radius: f64) -> ContactPoint<T> {
        let (excess, outward, count) = self.excess(x);
        let outside = excess.map(|s| s.max(T::of(0.0)));
        let square = outside.iter().fold(T::of(0.0), |sum, s| sum + *s * *s);
        let (gap, normal) = if Number::real(square) > 0.0 {
            let distance = square.sqrt();
            let sum: Vector3<T> = (0..count).map(|i| outward[i] * (outside[i] / distance)).sum();
            (distance, sum)
        } else {
            let face =
                (1..count).fold(0, |best, i| if excess[i] > excess[best] { i } else { best });
            (excess[face], outward[face])
        };
        let radius = T::of(radius);
        let (on_solid, on_ball) = (x - normal * gap, x - normal * radius);
        ContactPoint { gap: gap - radius, normal, point: (on_solid + on_ball) * T::of(0.5) }
    }
}

/// A unit vector across another one.
pub(super) fn perpendicular<T: Number>(axis: &Vector3<T>) -> Vector3<T> {
    let least = axis.map(Number::real).iamin();
    let along = Vector3::from_fn(|i, _| T::of(f64::from(u8::from(i == least))));
    (along - axis * axis[least]).normalize()
}

/// The plane of a face of a box.
pub(super) fn face<T: Number>(
    (center, axes, half): (&Vector3<T>, &Matrix3<T>, &Vector3<f64>),
    face: u32,
) -> Plane<T> {
    let (axis, sign) = ((face / 2) as usize, if face.is_multiple_of(2) { 1.0 } else { -1.0 });
    let normal = axes.column(axis) * T::of(sign);
    Plane { point: center + normal * T::of(half[axis]), normal }
}

/// The face that a point is outside of, or next to: that of the largest excess.
pub(super) fn nearest_face(
    (center, axes, half): (&Vector3<f64>, &Matrix3<f64>, &Vector3<f64>),
    x: &Vector3<f64>,
) -> (u32, f64) {
    let arm = x - center;
    let mut best = (0, f64::MIN);
    for axis in 0..3 {
        let y = arm.dot(&axes.column(axis));
        let excess = y.abs() - half[axis];
        if excess > best.1 {
            best = (2 * axis as u32 + u32::from(y < 0.0), excess);
        }
    }
    best
}
