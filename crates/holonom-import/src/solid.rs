//! Homogeneous solids: mass properties and pictures of geometries.
#![allow(non_snake_case)] // J: inertia tensor

use std::f64::consts::PI;

use holonom_model::{Shape, ShapeKind};
use nalgebra::{Isometry3, Matrix3, Vector3};

use crate::mass::ImportedMass;

/// A solid about its centre; axes of revolution are the third axis. Lengths in m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ImportedSolid {
    /// Half edges.
    Box([f64; 3]),
    /// Radius.
    Sphere(f64),
    /// Radius, half length.
    Cylinder(f64, f64),
    /// Radius, half length without the caps.
    Capsule(f64, f64),
    /// Half axes.
    Ellipsoid([f64; 3]),
}

/// A solid at a place of a link.
#[derive(Clone, Debug)]
pub(crate) struct PlacedSolid {
    pub(crate) solid: ImportedSolid,
    pub(crate) pose: Isometry3<f64>,
    /// The mesh in the box that is the solid.
    pub(crate) mesh: Option<Triangles>,
}

/// The file of a mesh at a place of a link.
#[derive(Clone, Debug)]
pub(crate) struct Triangles {
    /// As the model file names it.
    pub(crate) file: String,
    pub(crate) scale: Vector3<f64>,
    /// Of the axes of the file.
    pub(crate) pose: Isometry3<f64>,
    /// How many there are.
    pub(crate) count: usize,
}

impl PlacedSolid {
    /// The same in another frame, in which this frame has the given pose.
    pub(crate) fn moved(&self, pose: &Isometry3<f64>) -> Self {
        let mesh = self.mesh.clone().map(|mesh| Triangles { pose: pose * mesh.pose, ..mesh });
        Self { solid: self.solid, pose: pose * self.pose, mesh }
    }

    /// The height of its lowest point; of a mesh that of the box around it, m.
    pub(crate) fn lowest(&self) -> f64 {
        let up = self.pose.rotation.inverse() * Vector3::z(); // in its own axes
        let [x, y, z]: [f64; 3] = up.abs().into();
        let across = x.hypot(y);
        let reach = match self.solid {
            ImportedSolid::Box([a, b, c]) => a * x + b * y + c * z,
            ImportedSolid::Sphere(r) => r,
            ImportedSolid::Cylinder(r, l) => r * across + l * z,
            ImportedSolid::Capsule(r, l) => r + l * z,
            ImportedSolid::Ellipsoid([a, b, c]) => Vector3::new(a * x, b * y, c * z).norm(),
        };
        self.pose.translation.z - reach
    }

    /// Whether there is something to be seen.
    pub(crate) fn is_shown(&self) -> bool {
        self.solid.is_solid() || self.mesh.is_some()
    }
}

impl ImportedSolid {
    /// Volume, m³.
    pub(crate) fn volume(&self) -> f64 {
        match *self {
            Self::Box([a, b, c]) => 8.0 * a * b * c,
            Self::Sphere(r) => 4.0 / 3.0 * PI * r * r * r,
            Self::Cylinder(r, l) => 2.0 * PI * r * r * l,
            Self::Capsule(r, l) => 2.0 * PI * r * r * l + 4.0 / 3.0 * PI * r * r * r,
            Self::Ellipsoid([a, b, c]) => 4.0 / 3.0 * PI * a * b * c,
        }
    }

    /// Euler moments over the mass, m²: mean squares of the three coordinates.
    fn euler(&self) -> [f64; 3] {
        match *self {
            Self::Box(half) => half.map(|a| a * a / 3.0),
            Self::Sphere(r) => [r * r / 5.0; 3],
            Self::Cylinder(r, l) => [r * r / 4.0, r * r / 4.0, l * l / 3.0],
            Self::Capsule(r, l) => capsule(r, l),
            Self::Ellipsoid(half) => half.map(|a| a * a / 5.0),
        }
    }

    /// Area of the surface, m²; of an ellipsoid by Thomsen's formula, as in MuJoCo (within 1.1 %).
    pub(crate) fn area(&self) -> f64 {
        match *self {
            Self::Box([a, b, c]) => 8.0 * (a * b + b * c + c * a),
            Self::Sphere(r) => 4.0 * PI * r * r,
            Self::Cylinder(r, l) => 4.0 * PI * r * l + 2.0 * PI * r * r,
            Self::Capsule(r, l) => 4.0 * PI * r * l + 4.0 * PI * r * r,
            Self::Ellipsoid([a, b, c]) => {
                let power = |x: f64| libm::pow(x, THOMSEN);
                let mean = (power(a * b) + power(b * c) + power(c * a)) / 3.0;
                4.0 * PI * libm::pow(mean, 1.0 / THOMSEN)
            }
        }
    }

    /// Mean squares of the three coordinates over the surface, m²; of an ellipsoid over a layer
    /// that is as thick along all its axes, as in MuJoCo.
    fn shell_euler(&self) -> [f64; 3] {
        match *self {
            Self::Box([a, b, c]) => {
                // pairs of faces across each axis; a coordinate is constant on its own pair
                let faces = [b * c, c * a, a * b];
                let sum: f64 = faces.iter().sum();
                let mean =
                    |k: usize, half: f64| half * half * (faces[k] + (sum - faces[k]) / 3.0) / sum;
                [mean(0, a), mean(1, b), mean(2, c)]
            }
            Self::Sphere(r) => [r * r / 3.0; 3],
            Self::Cylinder(r, l) => {
                let (side, ends) = (2.0 * l, r); // areas over 2π r
                let across = (side * r * r / 2.0 + ends * r * r / 4.0) / (side + ends);
                [across, across, (side * l * l / 3.0 + ends * l * l) / (side + ends)]
            }
            Self::Capsule(r, l) => {
                let (side, caps) = (2.0 * l, 2.0 * r); // areas over 2π r
                let across = (side * r * r / 2.0 + caps * r * r / 3.0) / (side + caps);
                let along = side * l * l / 3.0 + caps * (l * l + l * r + r * r / 3.0);
                [across, across, along / (side + caps)]
            }
            Self::Ellipsoid(half) => {
                let thin: f64 = half.iter().map(|a| 1.0 / a).sum();
                half.map(|a| a * a / 5.0 + 2.0 * a / (5.0 * thin))
            }
        }
    }

    /// Mass properties about the centre for a mass, kg.
    pub(crate) fn with_mass(&self, mass: f64) -> ImportedMass {
        of_euler(self.euler(), mass)
    }

    /// The same for a mass on the surface.
    pub(crate) fn shell_with_mass(&self, mass: f64) -> ImportedMass {
        of_euler(self.shell_euler(), mass)
    }

    /// The shape of the picture.
    pub(crate) fn shape(&self) -> Shape {
        let (kind, dimensions) = match *self {
            Self::Box(half) => (ShapeKind::Box, half.map(|a| 2.0 * a).to_vec()),
            Self::Sphere(r) => (ShapeKind::Sphere, vec![r]),
            Self::Cylinder(r, l) => (ShapeKind::Cylinder, vec![r, 2.0 * l]),
            Self::Capsule(r, l) => (ShapeKind::Capsule, vec![r, 2.0 * l]),
            Self::Ellipsoid(half) => (ShapeKind::Ellipsoid, half.to_vec()),
        };
        Shape::new(kind, dimensions)
    }

    /// Whether all dimensions are positive.
    pub(crate) fn is_solid(&self) -> bool {
        self.shape().dimensions.iter().all(|d| *d > 0.0) && self.volume() > 0.0
    }
}

/// Exponent of Thomsen's formula for the area of an ellipsoid.
const THOMSEN: f64 = 1.6075;

/// Mass properties about the centre for mean squares of the coordinates.
fn of_euler([a, b, c]: [f64; 3], mass: f64) -> ImportedMass {
    let J = Matrix3::from_diagonal(&Vector3::new(b + c, c + a, a + b)) * mass;
    ImportedMass { mass, center: Vector3::zeros(), J }
}

/// A cylinder of half length `l` with half balls of radius `r` at its ends.
fn capsule(r: f64, l: f64) -> [f64; 3] {
    let (cylinder, caps) = (2.0 * l, 4.0 / 3.0 * r); // volumes over π r²
    let (a, b) = (cylinder / (cylinder + caps), caps / (cylinder + caps));
    let across = a * r * r / 4.0 + b * r * r / 5.0;
    // a half ball has its centre 3r/8 beyond the end, and the mean square r²/5 about the plane of
    // the end
    let along = a * l * l / 3.0 + b * (l * l + 2.0 * l * (3.0 * r / 8.0) + r * r / 5.0);
    [across, across, along]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_capsule_without_length_is_a_sphere_and_a_long_one_a_cylinder() {
        let difference = |a: ImportedSolid, b: ImportedSolid, scale: f64| {
            (a.with_mass(1.0).J - b.with_mass(1.0).J).amax() / scale
        };
        let short = difference(ImportedSolid::Capsule(0.3, 0.0), ImportedSolid::Sphere(0.3), 1.0);
        assert!(short < 1e-16, "{short:e}");
        let long =
            difference(ImportedSolid::Capsule(1e-9, 1.0), ImportedSolid::Cylinder(1e-9, 1.0), 1.0);
        assert!(long < 1e-8, "{long:e}");
        let shells = [
            ImportedSolid::Capsule(0.3, 0.0),
            ImportedSolid::Sphere(0.3),
            ImportedSolid::Ellipsoid([0.3; 3]),
        ];
        let spread = shells.map(|s| s.shell_with_mass(1.0).J - shells[1].shell_with_mass(1.0).J);
        let spread = spread.iter().fold(0.0_f64, |most, J| most.max(J.amax()));
        assert!(spread < 1e-16, "shells of a sphere: {spread:e}");
        let volume =
            ImportedSolid::Capsule(0.3, 0.0).volume() - ImportedSolid::Sphere(0.3).volume();
        assert!(volume.abs() < 1e-16, "{volume:e}");
    }
}
