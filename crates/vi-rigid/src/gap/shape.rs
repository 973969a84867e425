//! Shapes that touch.

use nalgebra::{Matrix3, Vector3};
use vi_core::Number;

/// A shape in the components of its frame, lengths in m; with dual numbers it has its derivative by
/// a parameter beside it.
#[derive(Clone, Debug, PartialEq)]
pub enum ContactShape<S = f64> {
    /// A half-space: its boundary holds the point, the unit normal points out of it.
    Plane {
        /// A point of the boundary.
        point: Vector3<S>,
        /// The outer unit normal.
        normal: Vector3<S>,
    },
    /// Balls of one radius about points; of a radius of zero the points themselves, the corners of
    /// a body.
    Points {
        /// Their centres.
        points: Vec<Vector3<S>>,
        /// Their radius.
        radius: S,
    },
    /// A cylinder with half balls at both ends; a ball if the ends are one point.
    Capsule {
        /// The ends of its axis.
        ends: [Vector3<S>; 2],
        /// Its radius.
        radius: S,
    },
    /// An ellipsoid.
    Ellipsoid {
        /// Its centre.
        center: Vector3<S>,
        /// The unit vectors of its axes, in columns.
        axes: Matrix3<S>,
        /// Half of its diameters along them.
        half_axes: Vector3<S>,
    },
    /// A box.
    Box {
        /// Its centre.
        center: Vector3<S>,
        /// The unit vectors of its axes, in columns.
        axes: Matrix3<S>,
        /// Half of its lengths along them.
        half_lengths: Vector3<S>,
    },
    /// A cylinder with flat ends.
    Cylinder {
        /// The ends of its axis.
        ends: [Vector3<S>; 2],
        /// Its radius.
        radius: S,
    },
}

impl<S: Copy> ContactShape<S> {
    /// A ball.
    #[must_use]
    pub fn sphere(center: Vector3<S>, radius: S) -> Self {
        Self::Capsule { ends: [center, center], radius }
    }
}

impl ContactShape {
    /// The same in numbers of another kind.
    #[must_use]
    pub fn lifted<T: Number>(&self) -> ContactShape<T> {
        let vector = |x: &Vector3<f64>| x.map(T::of);
        match self {
            Self::Plane { point, normal } => {
                ContactShape::Plane { point: vector(point), normal: vector(normal) }
            }
            Self::Points { points, radius } => ContactShape::Points {
                points: points.iter().map(vector).collect(),
                radius: T::of(*radius),
            },
            Self::Capsule { ends, radius } => {
                ContactShape::Capsule { ends: ends.each_ref().map(vector), radius: T::of(*radius) }
            }
            Self::Ellipsoid { center, axes, half_axes } => ContactShape::Ellipsoid {
                center: vector(center),
                axes: axes.map(T::of),
                half_axes: vector(half_axes),
            },
            Self::Box { center, axes, half_lengths } => ContactShape::Box {
                center: vector(center),
                axes: axes.map(T::of),
                half_lengths: vector(half_lengths),
            },
            Self::Cylinder { ends, radius } => {
                ContactShape::Cylinder { ends: ends.each_ref().map(vector), radius: T::of(*radius) }
            }
        }
    }

    /// Its name in messages.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Plane { .. } => "plane",
            Self::Points { .. } => "points",
            Self::Capsule { ends, .. } if ends[0] == ends[1] => "sphere",
            Self::Capsule { .. } => "capsule",
            Self::Ellipsoid { .. } => "ellipsoid",
            Self::Box { .. } => "box",
            Self::Cylinder { .. } => "cylinder",
        }
    }

    /// A length of the size of the shape and its place, m: rounding changes a gap by `ε` of that.
    #[must_use]
    pub fn extent(&self) -> f64 {
        match self {
            Self::Plane { point, .. } => point.norm(),
            Self::Points { points, radius } => {
                points.iter().fold(0.0, |most: f64, point| most.max(point.norm())) + radius
            }
            Self::Capsule { ends, radius } => ends[0].norm().max(ends[1].norm()) + radius,
            Self::Ellipsoid { center, half_axes, .. } => center.norm() + half_axes.amax(),
            Self::Box { center, half_lengths, .. } => center.norm() + half_lengths.norm(),
            Self::Cylinder { ends, radius } => ends[0].norm().max(ends[1].norm()) + radius,
        }
    }

    /// A ball that holds the shape; `None` of a plane.
    #[must_use]
    pub fn ball(&self) -> Option<(Vector3<f64>, f64)> {
        match self {
            Self::Plane { .. } => None,
            Self::Points { points, radius } => {
                let sum: Vector3<f64> = points.iter().sum();
                let center = sum / points.len().max(1) as f64;
                let apart = points.iter().map(|point| (point - center).norm());
                Some((center, apart.fold(0.0, f64::max) + radius))
            }
            Self::Capsule { ends, radius } => {
                Some((0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0]).norm() + radius))
            }
            Self::Ellipsoid { center, half_axes, .. } => Some((*center, half_axes.amax())),
            Self::Box { center, half_lengths, .. } => Some((*center, half_lengths.norm())),
            Self::Cylinder { ends, radius } => {
                let half = 0.5 * (ends[1] - ends[0]).norm();
                Some((0.5 * (ends[0] + ends[1]), libm::hypot(half, *radius)))
            }
        }
    }
}
