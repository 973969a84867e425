//! Balls about points against boxes and cylinders.
//!
//! ```text
//! box        s_i = |y_i| − a_i                       y: the point in the axes of the box
//! cylinder   s = (|z| − L, r − R)                    z along the axis, r from it
//! g = |max(s, 0)| − ϱ    outside,    max s − ϱ    inside (nearest face)
//! ```
//! The distance is smooth outside of the solid, also where the nearest point moves from a face to
//! an edge. A point without a radius touches one face (`points_solid`).

use super::ContactShape;
use super::contact_point::{ContactPoint, in_space, turned};
use super::points_plane::Plane;
use nalgebra::{Matrix3, Vector3};
use vi_core::{Embed, Number};

/// Faces of a box: those of the axis `k/2`, the positive one first.
pub(super) const FACES: u32 = 6;
/// Faces of a cylinder: the end towards its second end, the other one, [`SIDE`].
pub(super) const FACES_OF_CYLINDER: u32 = 3;
/// Its side.
pub(super) const SIDE: usize = 2;

/// A box or a cylinder in space.
#[derive(Clone, Copy, Debug)]
pub(super) enum Solid<T = f64> {
    /// Centre, axes, half lengths.
    Box(Vector3<T>, Matrix3<T>, Vector3<T>),
    /// Centre, unit axis, half length, radius.
    Cylinder(Vector3<T>, Vector3<T>, T, T),
}

impl<T: Number> Solid<T> {
    /// Of a shape on a frame; `None` of others.
    pub(super) fn in_space<S: Embed<T>>(shape: &ContactShape<S>, frame: &[T]) -> Option<Self> {
        match shape {
            ContactShape::Box { center, axes, half_lengths } => {
                let columns = [0, 1, 2].map(|i| turned(frame, &axes.column(i).into_owned()));
                let axes = Matrix3::from_columns(&columns);
                Some(Self::Box(in_space(frame, center), axes, half_lengths.map(Embed::embed)))
            }
            ContactShape::Cylinder { ends, radius } => {
                let [first, last] = ends.map(|end| in_space(frame, &end));
                let along = last - first;
                let length = along.norm();
                let (half, radius) = (T::of(0.5), radius.embed());
                Some(Self::Cylinder((first + last) * half, along / length, length * half, radius))
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
                ([0, 1, 2].map(|i| y[i].abs() - half[i]), outward, 3)
            }
            Self::Cylinder(center, axis, half, radius) => {
                let (z, r, outward) = from_axis(&(x - center), axis);
                let along = axis * one.copysign(z);
                let excess = [z.abs() - *half, r - *radius, T::of(f64::MIN)];
                (excess, [along, outward, along], 2)
            }
        }
    }

    /// The contact of a point with the plane of a face or the side of a cylinder, as B.
    pub(super) fn at_face(&self, face: u32, x: &Vector3<T>) -> ContactPoint<T> {
        match self {
            Self::Box(center, axes, half) => self::face(center, axes, half, face).contact_with(x),
            Self::Cylinder(center, axis, _, radius) if face as usize == SIDE => {
                let (_, r, normal) = from_axis(&(x - center), axis);
                let gap = r - *radius;
                ContactPoint { gap, normal, point: x - normal * (T::of(0.5) * gap) }
            }
            Self::Cylinder(center, axis, half, _) => {
                let normal = axis * T::of(side_of(face));
                Plane { point: center + normal * *half, normal }.contact_with(x)
            }
        }
    }

    /// The contact of a ball, as B.
    pub(super) fn contact(&self, x: &Vector3<T>, radius: T) -> ContactPoint<T> {
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
        let (on_solid, on_ball) = (x - normal * gap, x - normal * radius);
        ContactPoint { gap: gap - radius, normal, point: (on_solid + on_ball) * T::of(0.5) }
    }
}

impl Solid {
    /// How many faces it has.
    pub(super) fn faces(&self) -> u32 {
        match self {
            Self::Box(..) => FACES,
            Self::Cylinder(..) => FACES_OF_CYLINDER,
        }
    }

    /// A length of its size, m.
    pub(super) fn size(&self) -> f64 {
        match self {
            Self::Box(_, _, half) => half.amax(),
            Self::Cylinder(_, _, half, radius) => half.max(*radius),
        }
    }

    /// How far a point is outside of each face; `−∞` of those that it does not have.
    pub(super) fn beyond(&self, x: &Vector3<f64>) -> [f64; FACES as usize] {
        match self {
            Self::Box(center, axes, half) => {
                let y = axes.tr_mul(&(x - center));
                std::array::from_fn(|f| side_of(f as u32) * y[f / 2] - half[f / 2])
            }
            Self::Cylinder(center, axis, half, radius) => {
                let (z, r, _) = from_axis(&(x - center), axis);
                let none = f64::NEG_INFINITY;
                [z - half, -z - half, r - radius, none, none, none]
            }
        }
    }

    /// From the axis of a cylinder to a point; zero of a box.
    pub(super) fn across(&self, x: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Box(..) => Vector3::zeros(),
            Self::Cylinder(center, axis, ..) => {
                let arm = x - center;
                arm - axis * arm.dot(axis)
            }
        }
    }

    /// How far a point is outside of each face, with the tangent plane towards another point in the
    /// place of the side of a cylinder.
    pub(super) fn beyond_tangent(
        &self,
        x: &Vector3<f64>,
        towards: &Vector3<f64>,
    ) -> [f64; FACES as usize] {
        let mut own = self.beyond(x);
        if let Self::Cylinder(center, axis, _, radius) = self {
            let (.., outward) = from_axis(&(towards - center), axis);
            own[SIDE] = outward.dot(&(x - center)) - radius;
        }
        own
    }
}

/// Place along an axis, distance from it, unit vector from it; on the axis any across it.
fn from_axis<T: Number>(arm: &Vector3<T>, axis: &Vector3<T>) -> (T, T, Vector3<T>) {
    let z = arm.dot(axis);
    let across = arm - axis * z;
    let r = across.norm();
    (z, r, if Number::real(r) > 0.0 { across / r } else { perpendicular(axis) })
}

/// The side of an even face and of an odd one.
fn side_of(face: u32) -> f64 {
    if face.is_multiple_of(2) { 1.0 } else { -1.0 }
}

/// A unit vector across another one.
pub(super) fn perpendicular<T: Number>(axis: &Vector3<T>) -> Vector3<T> {
    let least = axis.map(Number::real).iamin();
    let along = Vector3::from_fn(|i, _| T::of(f64::from(u8::from(i == least))));
    (along - axis * axis[least]).normalize()
}

/// The plane of a face of a box.
pub(super) fn face<T: Number>(
    center: &Vector3<T>,
    axes: &Matrix3<T>,
    half: &Vector3<T>,
    face: u32,
) -> Plane<T> {
    let (axis, sign) = ((face / 2) as usize, side_of(face));
    let normal = axes.column(axis) * T::of(sign);
    Plane { point: center + normal * half[axis], normal }
}
