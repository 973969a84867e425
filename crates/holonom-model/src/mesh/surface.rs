//! A mesh in the frame of its body.

use nalgebra::Vector3;

use super::Mesh;
use crate::types::orientation::rotation_of;
use crate::types::shape::{Scale, Shape};

/// The surface of a body: corners by components along the axes of the body from its origin.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BodySurface {
    /// Corners, m.
    pub corners: Vec<Vector3<f64>>,
    /// Indices of corners, counterclockwise as seen from outside if the file keeps to the rule.
    pub triangles: Vec<[u32; 3]>,
}

impl BodySurface {
    /// A mesh where a shape places it.
    pub(crate) fn new(mesh: &Mesh, shape: &Shape) -> Self {
        Self::placed(mesh.corners(), mesh.triangles(), shape)
    }

    pub(super) fn placed(corners: &[Vector3<f64>], triangles: &[[u32; 3]], shape: &Shape) -> Self {
        let scale = shape.scale.as_ref().map_or(Vector3::repeat(1.0), Scale::vector);
        let rotation = shape.quaternion.map(rotation_of);
        let origin = Vector3::from(shape.position.unwrap_or_default());
        let place = |x: &Vector3<f64>| {
            let x = x.component_mul(&scale);
            rotation.map_or(x, |rotation| rotation * x) + origin
        };
        let flip = |t: &[u32; 3]| [t[0], t[2], t[1]];
        let reflects = scale.product() < 0.0;
        Self {
            corners: corners.iter().map(place).collect(),
            triangles: if reflects {
                triangles.iter().map(flip).collect()
            } else {
                triangles.into()
            },
        }
    }

    /// Both in one.
    pub(super) fn append(&mut self, other: &Self) {
        let first = self.corners.len() as u32;
        self.corners.extend(&other.corners);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|k| first + k)));
    }

    /// A box along the axes between two corners, the least and the largest.
    #[must_use]
    pub fn cuboid(ends: [Vector3<f64>; 2]) -> Self {
        let corner = |k: usize| Vector3::from_fn(|i, _| ends[k >> i & 1][i]);
        let faces =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        Self {
            corners: (0..8).map(corner).collect(),
            triangles: faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect(),
        }
    }

    /// Least and largest coordinates, m.
    #[must_use]
    pub fn ends(&self) -> [Vector3<f64>; 2] {
        let first = self.corners.first().copied().unwrap_or_default();
        self.corners.iter().fold([first; 2], |[low, high], x| [low.inf(x), high.sup(x)])
    }

    /// Largest distance of a corner from the origin of the body, m.
    #[must_use]
    pub fn reach(&self) -> f64 {
        self.corners.iter().map(Vector3::norm).fold(0.0, f64::max)
    }
}
