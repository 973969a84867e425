//! Meshes: their extents for the picture, their mass properties as homogeneous solids.
//!
//! ```text
//! V = Σ det(a, b, c)/6,   V x = Σ det(a, b, c) (a + b + c)/24
//! E = Σ det(a, b, c) (a aᵀ + b bᵀ + c cᵀ + s sᵀ)/120,   s = a + b + c          tetrahedra with the tip at a common point
//! ```
//! Letters: `a, b, c` corners of a triangle, counterclockwise from outside; `E = ∫ x xᵀ dV`.
#![allow(non_snake_case)] // V, E: the letters above

mod file;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Matrix3, Vector3};

use crate::mass::Mass;
use crate::solid::{Placed, Solid};

/// Triangles with shared corners.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Mesh {
    /// m
    pub(crate) corners: Vec<Vector3<f64>>,
    pub(crate) triangles: Vec<[usize; 3]>,
}

/// A mesh in numbers, in the frame of its file.
#[derive(Clone, Debug)]
pub(crate) struct Summary {
    least: Vector3<f64>,
    largest: Vector3<f64>,
    /// At 1 kg/m³; or why it is no solid.
    mass: Result<Mass, String>,
    /// The same where the volumes of all tetrahedra count as positive.
    unsigned: Mass,
}

/// The meshes of a description; each file is read once.
#[derive(Debug)]
pub(crate) struct Meshes {
    folder: PathBuf,
    known: BTreeMap<PathBuf, Result<Summary, &'static str>>,
}

impl Meshes {
    /// Meshes of the description in this file.
    pub(crate) fn beside(path: &Path) -> Self {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or_else(|| Path::new(".")).to_owned();
        Self { folder, known: BTreeMap::new() }
    }

    /// The mesh in a file, or why there is none. `package://NAME/…` is looked for in the folders above the description.
    pub(crate) fn summary(&mut self, file: &str, scale: [f64; 3]) -> Result<Summary, &'static str> {
        let path = self.path(file).ok_or("not found")?;
        let read = || file::read(&path).map(|mesh| Summary::of(&mesh));
        let summary = self.known.entry(path.clone()).or_insert_with(read);
        summary.clone().map(|summary| summary.scaled(&Vector3::from(scale)))
    }

    fn path(&self, file: &str) -> Option<PathBuf> {
        let file = file.strip_prefix("file://").unwrap_or(file);
        let Some(inside) = file.strip_prefix("package://") else {
            return Some(self.folder.join(file)).filter(|path| path.is_file());
        };
        let (_, below) = inside.split_once('/')?;
        let folder = std::path::absolute(&self.folder).ok()?;
        let mut candidates =
            folder.ancestors().flat_map(|above| [above.join(inside), above.join(below)]);
        candidates.find(|path| path.is_file())
    }
}

impl Summary {
    fn of(mesh: &Mesh) -> Self {
        let first = mesh.corners.first().copied().unwrap_or_default();
        let extreme = |pick: fn(f64, f64) -> f64| {
            mesh.corners.iter().fold(first, |sum, corner| sum.zip_map(corner, pick))
        };
        Self {
            least: extreme(f64::min),
            largest: extreme(f64::max),
            mass: solid(mesh),
            unsigned: unsigned(mesh),
        }
    }

    fn scaled(&self, scale: &Vector3<f64>) -> Self {
        let ends = [self.least.component_mul(scale), self.largest.component_mul(scale)];
        let volume = scale.product().abs();
        let scaled = |mass: Mass| {
            let E = mass.euler().component_mul(&(scale * scale.transpose())) * volume;
            let center = mass.center.component_mul(scale);
            let J = Matrix3::identity() * E.trace() - E;
            Mass { mass: mass.mass * volume, center, J }
        };
        let (mass, unsigned) = (self.mass.clone().map(scaled), scaled(self.unsigned));
        Self { least: ends[0].inf(&ends[1]), largest: ends[0].sup(&ends[1]), mass, unsigned }
    }

    /// The box around it, in a link in which the mesh has a pose.
    pub(crate) fn placed(&self, pose: &Isometry3<f64>) -> Placed {
        let half = (self.largest - self.least) * 0.5;
        let center = (self.largest + self.least) * 0.5;
        Placed {
            solid: Solid::Box([half.x, half.y, half.z]),
            pose: pose * Isometry3::translation(center.x, center.y, center.z),
        }
    }

    /// Mass properties at 1 kg/m³ in the frame of the mesh; or why it is no solid.
    pub(crate) fn mass(&self) -> Result<Mass, &str> {
        self.mass.as_ref().copied().map_err(String::as_str)
    }

    /// The same with all volumes counted as positive, for meshes that are not closed.
    pub(crate) fn unsigned_mass(&self) -> Mass {
        self.unsigned
    }
}

/// Mass properties at 1 kg/m³ with the volumes of all tetrahedra counted as positive: first with the tip at the centroid of the
/// surface, which gives the centre of mass, then with the tip there. Closed meshes need not be; a star-shaped one has its own
/// mass properties. So does MuJoCo by default (`inertia="legacy"`).
fn unsigned(mesh: &Mesh) -> Mass {
    let corners = |triangle: &[usize; 3]| triangle.map(|k| mesh.corners[k]);
    let (mut area, mut moment) = (0.0, Vector3::zeros());
    for [a, b, c] in mesh.triangles.iter().map(corners) {
        let size = (b - a).cross(&(c - a)).norm();
        area += size;
        moment += (a + b + c) * (size / 3.0);
    }
    let tip = moment / area;
    let (mut volume, mut first) = (0.0, Vector3::zeros());
    for triangle in mesh.triangles.iter().map(corners) {
        let [a, b, c] = triangle.map(|corner| corner - tip);
        let det = a.cross(&b).dot(&c).abs();
        volume += det / 6.0;
        first += (a + b + c) * (det / 24.0);
    }
    let center = if volume > 0.0 { tip + first / volume } else { tip };
    let (mut mass, mut E) = (0.0, Matrix3::zeros());
    for triangle in mesh.triangles.iter().map(corners) {
        let [a, b, c] = triangle.map(|corner| corner - center);
        let (det, s) = (a.cross(&b).dot(&c).abs(), a + b + c);
        mass += det / 6.0;
        E += (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose())
            * (det / 120.0);
    }
    Mass { mass, center, J: Matrix3::identity() * E.trace() - E }
}

/// Mass properties at 1 kg/m³ of a closed mesh.
fn solid(mesh: &Mesh) -> Result<Mass, String> {
    let open = open_edges(mesh);
    if open > 0 {
        return Err(format!("it is not closed: {open} edges have no partner"));
    }
    let count = mesh.corners.len().max(1) as f64;
    let tip = mesh.corners.iter().sum::<Vector3<f64>>() / count;
    let (mut volume, mut first, mut E) = (0.0, Vector3::zeros(), Matrix3::zeros());
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|k| mesh.corners[k] - tip);
        let det = a.cross(&b).dot(&c);
        let s = a + b + c;
        volume += det / 6.0;
        first += s * (det / 24.0);
        E += (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose())
            * (det / 120.0);
    }
    if volume <= 0.0 {
        let volume = volume.abs();
        return Err(format!("it is inside out, or flat: its volume is {:e} m³", -volume));
    }
    let center = first / volume;
    let E = E - center * center.transpose() * volume;
    let J = Matrix3::identity() * E.trace() - E;
    Ok(Mass { mass: volume, center: tip + center, J })
}

/// Edges that are not passed once in each direction.
fn open_edges(mesh: &Mesh) -> usize {
    let mut edges: BTreeMap<[usize; 2], i64> = BTreeMap::new();
    for [a, b, c] in &mesh.triangles {
        for (from, to) in [(a, b), (b, c), (c, a)].map(|(from, to)| (*from, *to)) {
            let (key, sign) = if from < to { ([from, to], 1) } else { ([to, from], -1) };
            *edges.entry(key).or_default() += sign;
        }
    }
    edges.values().filter(|sum| **sum != 0).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box with edges 1, 2, 3 from the corner (1, 1, 1).
    fn block() -> Mesh {
        let corner = |k: usize| {
            Vector3::new(1.0 + (k & 1) as f64, 1.0 + (k & 2) as f64, 1.0 + 0.75 * (k & 4) as f64)
        };
        let faces =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
        Mesh { corners: (0..8).map(corner).collect(), triangles: triangles.collect() }
    }

    #[test]
    fn a_box_of_triangles_has_the_mass_properties_of_a_box() {
        let found = Summary::of(&block()).scaled(&Vector3::new(2.0, -1.0, 1.0));
        let exact = Solid::Box([1.0, 1.0, 1.5]).with_mass(12.0);
        let mass = found.mass().unwrap();
        let error = (mass.J - exact.J).amax().max((mass.mass - 12.0).abs());
        assert!(error < 1e-13, "{error:e}");
        let legacy = (found.unsigned_mass().J - exact.J).amax();
        assert!(legacy < 1e-13, "a convex mesh: {legacy:e}");
        let center = (mass.center - Vector3::new(3.0, -2.0, 2.5)).amax();
        assert!(center < 1e-14, "{center:e}");
        let placed = found.placed(&Isometry3::identity());
        assert_eq!(placed.solid, Solid::Box([1.0, 1.0, 1.5]));
    }

    #[test]
    fn meshes_that_are_no_solids_are_refused() {
        let mut open = block();
        open.triangles.pop();
        assert_eq!(solid(&open).unwrap_err(), "it is not closed: 3 edges have no partner");
        let mut inside_out = block();
        inside_out.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        let message = solid(&inside_out).unwrap_err();
        assert!(message.contains("inside out") && message.contains("-6e0"), "{message}");
    }
}
