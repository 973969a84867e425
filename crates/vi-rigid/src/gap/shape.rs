//! Shapes that touch.

use nalgebra::{Matrix3, Vector3};

/// A shape in the components of its frame, lengths in m.
#[derive(Clone, Debug, PartialEq)]
pub enum ContactShape {
    /// A half-space: its boundary holds the point, the unit normal points out of it.
    Plane {
        /// A point of the boundary.
        point: Vector3<f64>,
        /// The outer unit normal.
        normal: Vector3<f64>,
    },
    /// Balls of one radius about points; of a radius of zero the points themselves, the corners of
    /// a body.
    Points {
        /// Their centres.
        points: Vec<Vector3<f64>>,
        /// Their radius.
        radius: f64,
    },
    /// A cylinder with half balls at both ends; a ball if the ends are one point.
    Capsule {
        /// The ends of its axis.
        ends: [Vector3<f64>; 2],
        /// Its radius.
        radius: f64,
    },
    /// An ellipsoid.
    Ellipsoid {
        /// Its centre.
        center: Vector3<f64>,
        /// The unit vectors of its axes, in columns.
        axes: Matrix3<f64>,
        /// Half of its diameters along them.
        half_axes: Vector3<f64>,
    },
    /// A box.
    Box {
        /// Its centre.
        center: Vector3<f64>,
        /// The unit vectors of its axes, in columns.
        axes: Matrix3<f64>,
        /// Half of its lengths along them.
        half_lengths: Vector3<f64>,
    },
    /// A cylinder with flat ends.
    Cylinder {
        /// The ends of its axis.
        ends: [Vector3<f64>; 2],
        /// Its radius.
        radius: f64,
    },
}

impl ContactShape {
    /// A ball.
    #[must_use]
    pub fn sphere(center: Vector3<f64>, radius: f64) -> Self {
        Self::Capsule { ends: [center, center], radius }
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
