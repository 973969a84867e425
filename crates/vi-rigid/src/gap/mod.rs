//! Gaps between shapes on two frames, and the rows of a contact.
//!
//! A shape stands in the components of its frame; that of the ground is [`GROUND`]. A pair of
//! shapes has features, each with one pair of closest points `x_A`, `x_B` and a gap that is smooth
//! as long as the feature is named:
//! ```text
//! g = n·(x_B − x_A),   n from A to B,   x_c = ½ (x_A + x_B)
//! B_d = s (d, ϱ_1 d, ϱ_2 d, ϱ_3 d),   d ∈ {n, t_1, t_2},  ϱ_I = (x_c − φ)·d_I,  s = −1 (A), +1 (B)      [N1]
//! ```
//! `B_n` is the gradient of `g`. Both bodies take the opposite wrenches of a force at one point
//! `x_c`: momentum and angular momentum are conserved also where the gap is open.
//!
//! | pair | file | features |
//! |---|---|---|
//! | points with a radius (sphere, capsule, corners of a box) – plane | [`points_plane`] | a point |
//! | ellipsoid – plane | [`ellipsoid_plane`] | one |
//! | sphere – sphere, sphere – capsule, capsule – capsule | [`segments`] | one, or two of parallel capsules |
//!
//! Closed forms without iteration. The gap of a pair does not depend on which shape is named first.

pub mod ellipsoid_plane;
pub mod points_plane;
pub mod segments;

mod contact_point;

pub use contact_point::{ContactPoint, GROUND, displacement, row, tangents};

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
}

impl ContactShape {
    /// A ball.
    #[must_use]
    pub fn sphere(center: Vector3<f64>, radius: f64) -> Self {
        Self::Capsule { ends: [center, center], radius }
    }

    /// The corners of a box.
    #[must_use]
    pub fn corners(center: Vector3<f64>, axes: &Matrix3<f64>, lengths: [f64; 3]) -> Self {
        let corner = |k: usize| {
            let side = |i: usize| if k >> i & 1 == 1 { 0.5 } else { -0.5 };
            center + axes * Vector3::from_fn(|i, _| side(i) * lengths[i])
        };
        Self::Points { points: (0..8).map(corner).collect(), radius: 0.0 }
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
        }
    }
}

/// There is no gap between two such shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the gap between {a} and {b} is not available: spheres, capsules, ellipsoids and points stand on planes, spheres and capsules touch one another"
)]
pub struct NoGap {
    /// One of them.
    pub a: &'static str,
    /// The other one.
    pub b: &'static str,
}

/// Two shapes with the gaps between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair {
    a: ContactShape,
    b: ContactShape,
}

impl Pair {
    /// Of a shape on frame A and one on frame B.
    ///
    /// # Errors
    /// [`NoGap`] where no formula is there for the two.
    pub fn new(a: ContactShape, b: ContactShape) -> Result<Self, NoGap> {
        use ContactShape::{Capsule, Ellipsoid, Plane, Points};
        match (&a, &b) {
            (Plane { .. }, Points { .. } | Capsule { .. } | Ellipsoid { .. })
            | (Points { .. } | Capsule { .. } | Ellipsoid { .. }, Plane { .. })
            | (Capsule { .. }, Capsule { .. }) => Ok(Self { a, b }),
            _ => Err(NoGap { a: a.name(), b: b.name() }),
        }
    }

    /// How many features it has; they are numbered from 0.
    #[must_use]
    pub fn features(&self) -> u32 {
        use ContactShape::{Capsule, Ellipsoid, Plane, Points};
        match (&self.a, &self.b) {
            (Plane { .. }, Points { points, .. }) | (Points { points, .. }, Plane { .. }) => {
                points.len() as u32
            }
            (Plane { .. }, Capsule { ends, .. }) | (Capsule { ends, .. }, Plane { .. }) => {
                if ends[0] == ends[1] { 1 } else { 2 }
            }
            (Capsule { ends: a, .. }, Capsule { ends: b, .. }) => {
                if a[0] == a[1] || b[0] == b[1] {
                    1
                } else {
                    segments::FEATURES
                }
            }
            (Ellipsoid { .. }, _) | (_, Ellipsoid { .. }) => 1,
            _ => 0,
        }
    }

    /// A length of the size of both, m.
    #[must_use]
    pub fn extent(&self) -> f64 {
        self.a.extent().max(self.b.extent())
    }

    /// The contact of a feature; `frame_a` and `frame_b`: the frames of the shapes, shape 12.
    #[must_use]
    pub fn contact(&self, feature: u32, frame_a: &[f64], frame_b: &[f64]) -> ContactPoint {
        self.between(feature, &self.a, frame_a, &self.b, frame_b)
            .or_else(|| {
                let turned = self.between(feature, &self.b, frame_b, &self.a, frame_a)?;
                Some(turned.exchanged())
            })
            .expect("a pair of shapes with a gap")
    }

    fn between(
        &self,
        feature: u32,
        a: &ContactShape,
        frame_a: &[f64],
        b: &ContactShape,
        frame_b: &[f64],
    ) -> Option<ContactPoint> {
        let ContactShape::Plane { point, normal } = a else {
            let (ContactShape::Capsule { .. }, ContactShape::Capsule { .. }) = (a, b) else {
                return None;
            };
            return Some(segments::contact(feature, (a, frame_a), (b, frame_b)));
        };
        let plane = points_plane::Plane::in_space(point, normal, frame_a);
        let index = feature as usize;
        match b {
            ContactShape::Points { points, radius } => {
                Some(points_plane::contact(&plane, &points[index], *radius, frame_b))
            }
            ContactShape::Capsule { ends, radius } => {
                Some(points_plane::contact(&plane, &ends[index], *radius, frame_b))
            }
            ContactShape::Ellipsoid { center, axes, half_axes } => {
                Some(ellipsoid_plane::contact(&plane, (center, axes, half_axes), frame_b))
            }
            ContactShape::Plane { .. } => None,
        }
    }
}

#[cfg(test)]
mod tests;
