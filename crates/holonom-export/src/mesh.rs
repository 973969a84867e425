//! Surfaces of triangles.

use std::collections::HashMap;

use holonom_model::BodySurface;
use nalgebra::{Matrix3, Vector3};

/// Sides of a surface of revolution.
const SIDES: usize = 24;
/// Parts of the meridian of a sphere.
const PARTS: usize = 12;

/// Cosine of the largest angle between neighbours across which a surface of triangles is smooth:
/// 40°.
const SMOOTH: f64 = 0.77;
/// A corner of more triangles has the normal of each of them.
const CROWDED: usize = 64;

/// A surface; closed but for those of meshes.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct SurfaceMesh {
    /// Corners, m.
    pub(crate) points: Vec<[f64; 3]>,
    /// Unit vectors outwards at the corners.
    pub(crate) normals: Vec<[f64; 3]>,
    /// Indices of corners, counterclockwise as seen from outside.
    pub(crate) triangles: Vec<[u32; 3]>,
}

/// A corner of the profile of a surface of revolution.
#[derive(Clone, Copy)]
struct Corner {
    radius: f64,
    height: f64,
    normal: [f64; 2], // outwards, along the axis
}

fn corner(radius: f64, height: f64, normal: [f64; 2]) -> Corner {
    Corner { radius, height, normal }
}

impl SurfaceMesh {
    /// Edges of length 1 about the origin.
    pub(crate) fn cuboid() -> Self {
        let mut mesh = Self::default();
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let first = mesh.points.len() as u32;
                for (a, b) in [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)] {
                    let (mut point, mut normal) = ([0.0; 3], [0.0; 3]);
                    (point[axis], normal[axis]) = (0.5 * side, side);
                    (point[(axis + 1) % 3], point[(axis + 2) % 3]) = (side * a, b);
                    mesh.points.push(point);
                    mesh.normals.push(normal);
                }
                mesh.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|k| first + k)));
            }
        }
        mesh
    }

    /// Radius 1 and height 1 about the origin, along the third axis.
    pub(crate) fn cylinder() -> Self {
        let (down, out, up) = ([0.0, -1.0], [1.0, 0.0], [0.0, 1.0]);
        Self::revolution(&[
            &[corner(0.0, -0.5, down), corner(1.0, -0.5, down)],
            &[corner(1.0, -0.5, out), corner(1.0, 0.5, out)],
            &[corner(1.0, 0.5, up), corner(0.0, 0.5, up)],
        ])
    }

    /// Base of radius 1 in the plane of the first two axes, tip at −1 on the third.
    pub(crate) fn cone() -> Self {
        let (out, up) = ([1.0, -1.0], [0.0, 1.0]);
        Self::revolution(&[
            &[corner(0.0, -1.0, out), corner(1.0, 0.0, out)],
            &[corner(1.0, 0.0, up), corner(0.0, 0.0, up)],
        ])
    }

    /// Radius 1 about the origin.
    pub(crate) fn sphere() -> Self {
        let at = |k: usize| {
            let (sin, cos) = (std::f64::consts::PI * (k as f64 / PARTS as f64 - 0.5)).sin_cos();
            let radius = if k.is_multiple_of(PARTS) { 0.0 } else { cos };
            corner(radius, sin, [cos, sin])
        };
        Self::revolution(&[&(0..=PARTS).map(at).collect::<Vec<_>>()])
    }

    /// About the third axis; the smooth parts of the profile go upwards on the outside.
    fn revolution(profile: &[&[Corner]]) -> Self {
        let mut mesh = Self::default();
        for part in profile {
            let first = mesh.points.len() as u32;
            for Corner { radius, height, normal: [across, up] } in *part {
                for side in 0..SIDES {
                    let (sin, cos) = (std::f64::consts::TAU * side as f64 / SIDES as f64).sin_cos();
                    let normal = Vector3::new(across * cos, across * sin, *up).normalize();
                    mesh.points.push([radius * cos, radius * sin, *height]);
                    mesh.normals.push(normal.into());
                }
            }
            let sides = SIDES as u32;
            for (ring, pair) in (0..).zip(part.windows(2)) {
                let (low, high) = (first + ring * sides, first + (ring + 1) * sides);
                for (side, next) in (0..sides).map(|side| (side, (side + 1) % sides)) {
                    if pair[0].radius > 0.0 {
                        mesh.triangles.push([low + side, low + next, high + side]);
                    }
                    if pair[1].radius > 0.0 {
                        mesh.triangles.push([high + side, low + next, high + next]);
                    }
                }
            }
        }
        mesh
    }

    /// The surface of a mesh; a corner with an edge has a point for each of its sides.
    pub(crate) fn of_surface(surface: &BodySurface) -> Self {
        let corner = |k: u32| surface.corners[k as usize];
        let normal = |t: &[u32; 3]| {
            let [a, b, c] = t.map(corner);
            (b - a).cross(&(c - a))
        };
        let normals: Vec<Vector3<f64>> = surface.triangles.iter().map(normal).collect();
        let unit = |n: &Vector3<f64>| n.try_normalize(0.0).filter(|n| n.norm() > 0.5);
        let units: Vec<Option<Vector3<f64>>> = normals.iter().map(unit).collect();
        let mut around = vec![Vec::new(); surface.corners.len()];
        for (face, triangle) in surface.triangles.iter().enumerate() {
            triangle.iter().for_each(|k| around[*k as usize].push(face));
        }
        let mut mesh = Self::default();
        let mut known: HashMap<(u32, [u64; 3]), u32> = HashMap::new();
        for (triangle, own) in surface.triangles.iter().zip(&units) {
            let Some(own) = own else { continue };
            mesh.triangles.push(triangle.map(|k| {
                let smooth = |face: &&usize| units[**face].is_some_and(|n| n.dot(own) > SMOOTH);
                let near =
                    around[k as usize].iter().filter(|_| around[k as usize].len() <= CROWDED);
                let sum: Vector3<f64> = near.filter(smooth).map(|face| normals[*face]).sum();
                let normal: [f64; 3] = unit(&sum).unwrap_or(*own).into();
                let next = mesh.points.len() as u32;
                let at = *known.entry((k, normal.map(f64::to_bits))).or_insert(next);
                if at == next {
                    mesh.points.push(corner(k).into());
                    mesh.normals.push(normal);
                }
                at
            }));
        }
        mesh
    }

    /// Turned by a rotation.
    pub(crate) fn turned(mut self, rotation: &Matrix3<f64>) -> Self {
        for vector in self.points.iter_mut().chain(&mut self.normals) {
            *vector = (rotation * Vector3::from(*vector)).into();
        }
        self
    }

    /// The image under `x ↦ A x + origin`; `None` where `A` is singular or reflects.
    pub(crate) fn placed(mut self, axes: &Matrix3<f64>, origin: &Vector3<f64>) -> Option<Self> {
        let inverse = axes.try_inverse().filter(|_| axes.determinant() > 0.0)?;
        for point in &mut self.points {
            *point = (axes * Vector3::from(*point) + origin).into();
        }
        for normal in &mut self.normals {
            *normal = inverse.tr_mul(&Vector3::from(*normal)).normalize().into();
        }
        let finite = self.points.iter().chain(&self.normals).flatten().all(|x| x.is_finite());
        finite.then_some(self)
    }

    /// Adds another surface.
    pub(crate) fn append(&mut self, other: Self) {
        let first = self.points.len() as u32;
        self.points.extend(other.points);
        self.normals.extend(other.normals);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|k| first + k)));
    }
}

/// An orthonormal frame whose third axis is along a direction; `None` for one of no length.
pub(crate) fn along(direction: &Vector3<f64>) -> Option<Matrix3<f64>> {
    let z = direction.try_normalize(0.0)?;
    let across = if z.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let x = across.cross(&z).normalize();
    Some(Matrix3::from_columns(&[x, z.cross(&x), z]))
}

/// A cylinder from one point to another; `None` where they are one.
pub(crate) fn stick(from: &Vector3<f64>, to: &Vector3<f64>, radius: f64) -> Option<SurfaceMesh> {
    let size = Vector3::new(radius, radius, (to - from).norm());
    let axes = along(&(to - from))? * Matrix3::from_diagonal(&size);
    SurfaceMesh::cylinder().placed(&axes, &(0.5 * (from + to)))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// `⅙ Σ a · (b × c)` over the triangles: the volume inside a closed surface that faces
    /// outwards, m³.
    pub(crate) fn volume(mesh: &SurfaceMesh) -> f64 {
        let corner = |k: u32| Vector3::from(mesh.points[k as usize]);
        let part = |t: &[u32; 3]| corner(t[0]).dot(&corner(t[1]).cross(&corner(t[2])));
        mesh.triangles.iter().map(part).sum::<f64>() / 6.0
    }

    /// Every triangle has an area, and its normal is that of its corners but for a curved surface.
    pub(crate) fn faces_outwards(mesh: &SurfaceMesh) {
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|k| Vector3::from(mesh.points[k as usize]));
            let normal = (b - a).cross(&(c - a));
            assert!(normal.norm() > 0.0, "{t:?} has no area");
            for k in t {
                let stated = Vector3::from(mesh.normals[*k as usize]);
                let cos = stated.dot(&normal.normalize());
                assert!(cos > 0.5 && (stated.norm() - 1.0).abs() < 1e-12, "{t:?}: {cos}");
            }
        }
    }

    #[test]
    fn surfaces_are_closed_and_face_outwards() {
        use std::f64::consts::{PI, TAU};
        let polygon = 0.5 * SIDES as f64 * (TAU / SIDES as f64).sin(); // area for radius 1
        for (mesh, expected, tolerance) in [
            (SurfaceMesh::cuboid(), 1.0, 1e-14),
            (SurfaceMesh::cylinder(), polygon, 1e-13),
            (SurfaceMesh::cone(), polygon / 3.0, 1e-13),
            (SurfaceMesh::sphere(), 4.0 / 3.0 * PI, 0.15),
        ] {
            let found = volume(&mesh);
            assert!((found - expected).abs() < tolerance, "volume {found}, expected {expected}");
            faces_outwards(&mesh);
        }
    }

    /// The corners of a block have three sides each; those of a fine ball have one, and normals
    /// along the radius.
    #[test]
    fn the_surface_of_a_mesh_has_its_edges_and_its_smooth_parts() {
        let corner = |k: u32| Vector3::new((k & 1).into(), (k & 2).into(), (k & 4).into());
        let faces =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
        let block =
            BodySurface { corners: (0..8).map(corner).collect(), triangles: triangles.collect() };
        let block = SurfaceMesh::of_surface(&block);
        assert_eq!((block.points.len(), block.triangles.len()), (24, 12));
        assert!((volume(&block) - 8.0).abs() < 1e-14, "volume {}", volume(&block));
        faces_outwards(&block);

        let ball = SurfaceMesh::sphere();
        let inner = |p: &&[f64; 3]| p[2].abs() < 0.9; // all points of a pole are one place
        let surface = BodySurface {
            corners: ball.points.iter().copied().map(Vector3::from).collect(),
            triangles: ball.triangles.clone(),
        };
        let found = SurfaceMesh::of_surface(&surface);
        for (point, normal) in found.points.iter().zip(&found.normals).filter(|(p, _)| inner(p)) {
            let cos = Vector3::from(*point).dot(&Vector3::from(*normal));
            assert!(cos > 0.99, "{point:?}: {cos}");
        }
        let count = |mesh: &SurfaceMesh| mesh.points.iter().filter(inner).count();
        assert_eq!(count(&found), count(&ball), "one point for each corner");
    }

    #[test]
    fn an_image_has_the_volume_of_the_map() {
        let axes = Matrix3::new(2.0, 0.0, 0.3, 0.1, 0.5, 0.0, 0.0, 0.0, 3.0);
        let mesh = SurfaceMesh::cuboid().placed(&axes, &Vector3::new(1.0, 2.0, 3.0)).unwrap();
        let (found, expected) = (volume(&mesh), axes.determinant());
        assert!((found - expected).abs() < 1e-12, "volume {found}, expected {expected}");
        faces_outwards(&mesh);
        assert_eq!(SurfaceMesh::sphere().placed(&Matrix3::zeros(), &Vector3::zeros()), None);
        assert_eq!(stick(&Vector3::x(), &Vector3::x(), 1.0), None);
        let rod = stick(&Vector3::x(), &Vector3::z(), 0.1).unwrap();
        let polygon = 0.5 * SIDES as f64 * (std::f64::consts::TAU / SIDES as f64).sin();
        let expected = polygon * 0.01 * 2f64.sqrt();
        assert!((volume(&rod) - expected).abs() < 1e-14, "{}", volume(&rod));
    }
}
