//! Boxes, cylinders and capsules as faces, rims, lines and points.
//!
//! | shape | faces | rims | lines, radius | points, radius |
//! |---|---|---|---|---|
//! | box | 6 | | 12 edges, 0 | 8 corners, 0 |
//! | cylinder | 2 | 2 | its axis, `R` | |
//! | capsule | | | its axis, `R` | 2 ends, `R` |
//!
//! Even faces, rims and ends of a cylinder or capsule are those towards the second end of its axis.
//! A part of a shape bears along the outward normals of its cone: the products of a normal with the
//! outward directions of the part are not negative there.
//! ```text
//! h(n) = Σ a_i |d_i·n|,   L |a·n| + R |n − (n·a) a|,   L |a·n| + R        box, cylinder, capsule
//! s(n) = n·(c_B − c_A) − h_A(n) − h_B(n)                       separation along n, from A to B
//! ```
//! All three shapes are symmetric about their centres `c`. The distance of two that are apart is
//! the largest `s(n)`; of two that overlap, the largest is the least way by which they part.

use super::ContactShape;
use super::box_box::{corner, edge, side};
use super::contact_point::{in_space, turned};
use super::cylinder_plane::Rims;
use super::points_plane::Plane;
use super::rim::{Line, Rim};
use super::solids::face;
use nalgebra::{Matrix3, Vector3};
use vi_core::Number;

/// Kinds of shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum OutlineShape {
    Cylinder,
    Capsule,
    Box,
}

/// How many parts a kind of shape has.
#[derive(Clone, Copy, Debug)]
pub(super) struct PartCounts {
    pub(super) faces: u32,
    pub(super) rims: u32,
    pub(super) lines: u32,
    pub(super) points: u32,
}

impl OutlineShape {
    /// Of a shape; `None` of those that have no such parts, as balls.
    pub(super) fn of<S: Number>(shape: &ContactShape<S>) -> Option<Self> {
        match shape {
            ContactShape::Box { .. } => Some(Self::Box),
            ContactShape::Cylinder { .. } => Some(Self::Cylinder),
            ContactShape::Capsule { ends, radius }
                if ends[0] != ends[1] && Number::real(*radius) > 0.0 =>
            {
                Some(Self::Capsule)
            }
            _ => None,
        }
    }

    pub(super) fn counts(self) -> PartCounts {
        match self {
            Self::Cylinder => PartCounts { faces: 2, rims: 2, lines: 1, points: 0 },
            Self::Capsule => PartCounts { faces: 0, rims: 0, lines: 1, points: 2 },
            Self::Box => PartCounts { faces: 6, rims: 0, lines: 12, points: 8 },
        }
    }
}

/// A shape in space.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShapeOutline {
    pub(super) kind: OutlineShape,
    pub(super) center: Vector3<f64>,
    /// The axis of a cylinder or capsule is the last one.
    axes: Matrix3<f64>,
    half: Vector3<f64>,
    pub(super) radius: f64,
}

/// A line of a shape.
#[derive(Clone, Copy, Debug)]
pub(super) struct OutlineLine {
    pub(super) middle: Vector3<f64>,
    pub(super) along: Vector3<f64>,
    pub(super) half: f64,
    pub(super) radius: f64,
}

impl OutlineLine {
    pub(super) fn line(&self) -> Line {
        Line { point: self.middle, along: self.along }
    }

    /// Where the foot of a point is, between −1 and 1 on the line.
    pub(super) fn place(&self, x: &Vector3<f64>) -> f64 {
        self.along.dot(&(x - self.middle)) / self.half
    }
}

impl ShapeOutline {
    /// Of a shape on a frame; `None` of shapes without such parts.
    pub(super) fn in_space(shape: &ContactShape, frame: &[f64]) -> Option<Self> {
        let kind = OutlineShape::of(shape)?;
        match shape {
            ContactShape::Box { center, axes, half_lengths } => {
                let columns = [0, 1, 2].map(|i| turned(frame, &axes.column(i).into_owned()));
                let (center, axes) = (in_space(frame, center), Matrix3::from_columns(&columns));
                Some(Self { kind, center, axes, half: *half_lengths, radius: 0.0 })
            }
            ContactShape::Cylinder { ends, radius } | ContactShape::Capsule { ends, radius } => {
                let Rims { axis, fixed, side } = Rims::new(ends, frame);
                let axes = Matrix3::from_columns(&[fixed, side, axis]);
                let half = Vector3::new(0.0, 0.0, 0.5 * (ends[1] - ends[0]).norm());
                let center = in_space(frame, &(0.5 * (ends[0] + ends[1])));
                Some(Self { kind, center, axes, half, radius: *radius })
            }
            _ => None,
        }
    }

    fn axis(&self, i: usize) -> Vector3<f64> {
        self.axes.column(i).into_owned()
    }

    /// `h(n)`.
    pub(super) fn reach(&self, n: &Vector3<f64>) -> f64 {
        let lengths: f64 = (0..3).map(|i| (self.axis(i).dot(n) * self.half[i]).abs()).sum();
        match self.kind {
            OutlineShape::Box => lengths,
            OutlineShape::Capsule => lengths + self.radius,
            OutlineShape::Cylinder => {
                let a = self.axis(2);
                lengths + self.radius * (n - a * a.dot(n)).norm()
            }
        }
    }

    /// The radius about its points.
    pub(super) fn radius_of_points(&self) -> f64 {
        self.radius // of a cylinder, which has none, too
    }

    /// A length of the size of the shape, m.
    pub(super) fn size(&self) -> f64 {
        self.half.amax() + self.radius
    }

    pub(super) fn face(&self, k: u32) -> Plane {
        match self.kind {
            OutlineShape::Box => face(&self.center, &self.axes, &self.half, k),
            _ => {
                let normal = self.axis(2) * side(k + 1);
                Plane { point: self.center + normal * self.half.z, normal }
            }
        }
    }

    pub(super) fn rim(&self, k: u32) -> Rim {
        let Plane { point, normal } = self.face(k);
        Rim { center: point, axis: normal, radius: self.radius }
    }

    /// The axes from which points of rims are counted.
    pub(super) fn rims(&self) -> Rims {
        Rims { axis: self.axis(2), fixed: self.axis(0), side: self.axis(1) }
    }

    /// The circle across the axis of a cylinder at a place between −1 and 1.
    pub(super) fn section(&self, place: f64) -> Rim {
        let center = self.center + self.axis(2) * (place * self.half.z);
        Rim { center, axis: self.axis(2), radius: self.radius }
    }

    pub(super) fn bar(&self, k: u32) -> OutlineLine {
        match self.kind {
            OutlineShape::Box => {
                let axis = (k / 4) as usize;
                let middle = edge(&(self.center, self.axes, self.half), k).0;
                OutlineLine { middle, along: self.axis(axis), half: self.half[axis], radius: 0.0 }
            }
            _ => {
                let (middle, along) = (self.center, self.axis(2));
                OutlineLine { middle, along, half: self.half.z, radius: self.radius }
            }
        }
    }

    pub(super) fn point(&self, k: u32) -> Vector3<f64> {
        match self.kind {
            OutlineShape::Box => corner(&(self.center, self.axes, self.half), k),
            _ => self.face(k).point,
        }
    }

    /// A direction out of the shape at a line; zero of an axis.
    pub(super) fn out_of_line(&self, k: u32) -> Vector3<f64> {
        match self.kind {
            OutlineShape::Box => {
                let [first, second] = self.beside_edge(k);
                first + second
            }
            _ => Vector3::zeros(),
        }
    }

    /// The same; `None` of an axis.
    pub(super) fn beside(&self, k: u32) -> Option<[Vector3<f64>; 2]> {
        (self.kind == OutlineShape::Box).then(|| self.beside_edge(k))
    }

    /// The outward normals of the faces beside an edge of a box.
    fn beside_edge(&self, k: u32) -> [Vector3<f64>; 2] {
        let axis = (k / 4) as usize;
        [self.axis((axis + 1) % 3) * side(k), self.axis((axis + 2) % 3) * side(k >> 1)]
    }

    /// How far a direction is inside the cone of a line: not negative where the line bears.
    pub(super) fn cone_of_line(&self, k: u32, n: &Vector3<f64>) -> f64 {
        match self.kind {
            OutlineShape::Box => {
                let [first, second] = self.beside_edge(k);
                n.dot(&first).min(n.dot(&second))
            }
            _ => -n.dot(&self.axis(2)).abs(),
        }
    }

    /// The same of a point.
    pub(super) fn cone_of_point(&self, k: u32, n: &Vector3<f64>) -> f64 {
        match self.kind {
            OutlineShape::Box => {
                let along = [0, 1, 2].map(|i| side(k >> i) * n.dot(&self.axis(i)));
                along.into_iter().fold(f64::INFINITY, f64::min)
            }
            _ => n.dot(&self.face(k).normal),
        }
    }

    /// Whether the foot of a point is on a face, whose lengths are multiplied by `1 + margin`.
    pub(super) fn is_above(&self, face: u32, x: &Vector3<f64>, margin: f64) -> bool {
        let arm = x - self.center;
        let y = [0, 1, 2].map(|i| arm.dot(&self.axis(i)));
        match self.kind {
            OutlineShape::Box => {
                let inside = |i: &usize| y[*i].abs() <= self.half[*i] * (1.0 + margin);
                (0..3).filter(|i| *i != (face / 2) as usize).all(|i| inside(&i))
            }
            _ => libm::hypot(y[0], y[1]) <= self.radius * (1.0 + margin),
        }
    }
}

/// `s(n)`, `n` from A to B.
pub(super) fn apart(a: &ShapeOutline, b: &ShapeOutline, n: &Vector3<f64>) -> f64 {
    (b.center - a.center).dot(n) - a.reach(n) - b.reach(n)
}

/// How far a direction is inside the cone of a rim at a point of it.
pub(super) fn cone_of_rim(rim: &Rim, x: &Vector3<f64>, n: &Vector3<f64>) -> f64 {
    n.dot(&rim.axis).min(n.dot(&rim.outward(x)))
}
