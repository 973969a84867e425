//! Triangles of the shapes that are no meshes, about the centre of mass.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;

use super::BodySurface;
use crate::types::shape::{Shape, ShapeKind};

/// Sides of a shape of revolution.
const SIDES: u32 = 24;
/// Rings of a sphere from pole to pole.
const RINGS: u32 = 12;

/// The triangles of a shape; `None` for a mesh. Premise: as many dimensions as the kind has.
pub(super) fn triangulated(shape: &Shape) -> Option<BodySurface> {
    let at = |k: usize| shape.dimensions.get(k).copied().unwrap_or_default();
    let cylinder = |radius: f64, height: f64| {
        let half = 0.5 * height;
        revolution(&[(0.0, -half), (radius, -half), (radius, half), (0.0, half)])
    };
    Some(match shape.kind {
        ShapeKind::Box => {
            let half = Vector3::new(at(0), at(1), at(2)) * 0.5;
            BodySurface::cuboid([-half, half])
        }
        ShapeKind::Cylinder => cylinder(at(0), at(1)),
        ShapeKind::Rod => cylinder(at(1), at(0)),
        ShapeKind::Cone => {
            let (tip, base) = (-0.75 * at(1), 0.25 * at(1));
            revolution(&[(0.0, tip), (at(0), base), (0.0, base)])
        }
        ShapeKind::Sphere => {
            let ring = |k: u32| {
                let (sin, cos) = libm::sincos(PI * (f64::from(k) / f64::from(RINGS) - 0.5));
                (if k.is_multiple_of(RINGS) { 0.0 } else { at(0) * cos }, at(0) * sin)
            };
            revolution(&(0..=RINGS).map(ring).collect::<Vec<_>>())
        }
        ShapeKind::Capsule => {
            let ring = |k: u32| {
                let (sin, cos) = libm::sincos(PI * (f64::from(k) / f64::from(RINGS) - 0.5));
                let radius = if k.is_multiple_of(RINGS) { 0.0 } else { at(0) * cos };
                move |end: f64| (radius, at(0) * sin + end * 0.5 * at(1))
            };
            let lower = (0..=RINGS / 2).map(|k| ring(k)(-1.0));
            let upper = (RINGS / 2..=RINGS).map(|k| ring(k)(1.0));
            revolution(&lower.chain(upper).collect::<Vec<_>>())
        }
        ShapeKind::Ellipsoid => {
            let mut ball = triangulated(&Shape::new(ShapeKind::Sphere, vec![1.0]))?;
            let half_axes = Vector3::new(at(0), at(1), at(2));
            ball.corners.iter_mut().for_each(|x| x.component_mul_assign(&half_axes));
            ball
        }
        ShapeKind::Mesh => return None,
    })
}

/// About the third axis; the profile of radii and heights goes upwards, from the axis to the axis.
fn revolution(profile: &[(f64, f64)]) -> BodySurface {
    let mut surface = BodySurface::default();
    let mut rings = Vec::new();
    for (radius, height) in profile {
        rings.push(surface.corners.len() as u32);
        let sides = if *radius > 0.0 { SIDES } else { 1 };
        for side in 0..sides {
            let (sin, cos) = libm::sincos(TAU * f64::from(side) / f64::from(SIDES));
            surface.corners.push(Vector3::new(radius * cos, radius * sin, *height));
        }
    }
    for (pair, ends) in rings.windows(2).zip(profile.windows(2)) {
        let corner = |end: usize, side: u32| {
            if ends[end].0 > 0.0 { pair[end] + side % SIDES } else { pair[end] }
        };
        for side in 0..SIDES {
            let [a, b] = [side, side + 1].map(|side| corner(0, side));
            let [c, d] = [side, side + 1].map(|side| corner(1, side));
            let both = [[a, b, d], [a, d, c]];
            surface.triangles.extend(both.into_iter().filter(|t| {
                let [a, b, c] = *t;
                a != b && b != c && c != a
            }));
        }
    }
    surface
}

#[cfg(test)]
mod tests {
    use super::*;
    use vi_rigid::Polyhedron;

    #[test]
    fn the_triangles_enclose_nearly_the_shape_about_its_centre_of_mass() {
        let shapes = [
            (ShapeKind::Box, vec![1.0, 2.0, 3.0], 1e-14),
            (ShapeKind::Cylinder, vec![0.5, 2.0], 0.02),
            (ShapeKind::Rod, vec![2.0, 0.5], 0.02),
            (ShapeKind::Cone, vec![0.5, 2.0], 0.02),
            (ShapeKind::Sphere, vec![0.7], 0.04),
            (ShapeKind::Capsule, vec![0.7, 1.1], 0.03),
            (ShapeKind::Ellipsoid, vec![0.7, 0.2, 1.1], 0.04),
        ];
        for (kind, dimensions, near) in shapes {
            let shape = Shape::new(kind, dimensions);
            let surface = triangulated(&shape).unwrap();
            let solid = Polyhedron::new(&surface.corners, &surface.triangles).unwrap();
            let error = 1.0 - solid.volume / shape.volume();
            println!(
                "{kind:?}: volume {error:.2e} too small, centre {:.1e} m",
                solid.center.norm()
            );
            assert!((-1e-14..near).contains(&error), "{kind:?}: {error:e}");
            assert!(solid.center.norm() < 1e-14, "{kind:?}: {}", solid.center);
        }
    }
}
