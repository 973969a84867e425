//! Meshes: their extents for the picture, their mass properties as homogeneous solids.
//!
//! ```text
//! V = Σ det(a, b, c)/6,   V x = Σ det(a, b, c) (a + b + c)/24
//! E = Σ det(a, b, c) (a aᵀ + b bᵀ + c cᵀ + s sᵀ)/120,   s = a + b + c          tetrahedra with the tip at a common point
//! ```
//! Letters: `a, b, c` corners of a triangle, counterclockwise from outside; `E = ∫ x xᵀ dV`.
#![allow(non_snake_case)] // V, E: the letters above

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use holonom_model::mesh::MAX_MESHES_BYTES;
use holonom_model::{Mesh, MeshError};
use nalgebra::{Isometry3, Matrix3, Vector3};
use vi_rigid::Polyhedron;

use crate::mass::ImportedMass;
use crate::solid::{ImportedSolid, PlacedSolid, Triangles};

/// A mesh in numbers, in the frame of its file.
#[derive(Clone, Debug)]
pub(crate) struct MeshSummary {
    least: Vector3<f64>,
    largest: Vector3<f64>,
    /// At 1 kg/m³; or why it is no solid.
    mass: Result<ImportedMass, String>,
    /// The same where the volumes of all tetrahedra count as positive.
    unsigned: ImportedMass,
    /// Of the surface of the file, at 1 kg/m².
    shell: ImportedMass,
    /// Number of its triangles.
    triangles: usize,
    /// Where it was read.
    path: PathBuf,
    /// Its file as the model file names it; `None` where it cannot.
    file: Option<String>,
    scale: Vector3<f64>,
}

/// The meshes of a description; each file is read once.
#[derive(Debug)]
pub(crate) struct MeshCache {
    folder: PathBuf,
    output: PathBuf,
    known: BTreeMap<PathBuf, Result<MeshSummary, MeshError>>,
    bytes: usize,
}

impl MeshCache {
    /// Meshes of the description in this file; the model file is in the folder `output`.
    pub(crate) fn beside(path: &Path, output: &Path) -> Self {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or_else(|| Path::new(".")).to_owned();
        Self { folder, output: output.to_owned(), known: BTreeMap::new(), bytes: 0 }
    }

    /// The mesh in a file, or why there is none. `package://NAME/…` is looked for in the folders
    /// above the description.
    pub(crate) fn summary(
        &mut self,
        file: &str,
        scale: [f64; 3],
    ) -> Result<MeshSummary, MeshError> {
        let path = self.path(file).ok_or(MeshError::NotFound)?;
        if !self.known.contains_key(&path) {
            let summary = self.read(&path);
            self.known.insert(path.clone(), summary);
        }
        let summary = self.known.get(&path).cloned().unwrap_or(Err(MeshError::NotFound))?;
        Ok(summary.scaled(&Vector3::from(scale)))
    }

    fn read(&mut self, path: &Path) -> Result<MeshSummary, MeshError> {
        let mesh = Mesh::read(path)?;
        let mut summary = MeshSummary { path: path.to_owned(), ..MeshSummary::of(&mesh) };
        self.bytes += mesh.bytes().len();
        if self.bytes <= MAX_MESHES_BYTES {
            summary.file = named_from(&self.output, path);
        }
        Ok(summary)
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

/// A path as a file in `folder` names it: from there, with `/`; absolute where there is no way.
/// `None` for one that is no text.
fn named_from(folder: &Path, path: &Path) -> Option<String> {
    let (folder, path) = (folder.canonicalize().ok()?, path.canonicalize().ok()?);
    let common = folder.components().zip(path.components()).take_while(|(a, b)| a == b).count();
    if common == 0 {
        return path.to_str().map(str::to_owned);
    }
    let up = folder.components().skip(common).map(|_| Some(".."));
    let down = path.components().skip(common).map(|part| match part {
        Component::Normal(name) => name.to_str(),
        _ => None,
    });
    Some(up.chain(down).collect::<Option<Vec<&str>>>()?.join("/"))
}

impl MeshSummary {
    fn of(mesh: &Mesh) -> Self {
        let first = mesh.corners().first().copied().unwrap_or_default();
        let extreme = |pick: fn(f64, f64) -> f64| {
            mesh.corners().iter().fold(first, |sum, corner| sum.zip_map(corner, pick))
        };
        Self {
            least: extreme(f64::min),
            largest: extreme(f64::max),
            mass: solid(mesh),
            unsigned: unsigned(mesh),
            shell: shell(mesh, &Vector3::repeat(1.0)),
            triangles: mesh.triangles().len(),
            path: PathBuf::new(),
            file: None,
            scale: Vector3::repeat(1.0),
        }
    }

    fn scaled(&self, scale: &Vector3<f64>) -> Self {
        let ends = [self.least.component_mul(scale), self.largest.component_mul(scale)];
        let volume = scale.product().abs();
        let scaled = |mass: ImportedMass| {
            let E = mass.euler().component_mul(&(scale * scale.transpose())) * volume;
            let center = mass.center.component_mul(scale);
            let J = Matrix3::identity() * E.trace() - E;
            ImportedMass { mass: mass.mass * volume, center, J }
        };
        let (mass, unsigned) = (self.mass.clone().map(scaled), scaled(self.unsigned));
        let scale = self.scale.component_mul(scale);
        let (least, largest) = (ends[0].inf(&ends[1]), ends[0].sup(&ends[1]));
        Self { least, largest, mass, unsigned, scale, ..self.clone() }
    }

    /// The mesh and the box around it, in a link in which the mesh has a pose.
    pub(crate) fn placed(&self, pose: &Isometry3<f64>) -> PlacedSolid {
        let half = (self.largest - self.least) * 0.5;
        let center = (self.largest + self.least) * 0.5;
        PlacedSolid {
            solid: ImportedSolid::Box([half.x, half.y, half.z]),
            pose: pose * Isometry3::translation(center.x, center.y, center.z),
            mesh: self.file.clone().map(|file| Triangles {
                file,
                scale: self.scale,
                pose: *pose,
                count: self.triangles,
            }),
        }
    }

    /// Mass properties at 1 kg/m³ in the frame of the mesh; or why it is no solid.
    pub(crate) fn mass(&self) -> Result<ImportedMass, &str> {
        self.mass.as_ref().copied().map_err(String::as_str)
    }

    /// The same with all volumes counted as positive, for meshes that are not closed.
    pub(crate) fn unsigned_mass(&self) -> ImportedMass {
        self.unsigned
    }
}

impl MeshSummary {
    /// Mass properties of the surface at 1 kg/m², in the frame of the mesh. Areas that are scaled
    /// unequally are summed anew.
    pub(crate) fn shell_mass(&self) -> ImportedMass {
        let [x, y, z] = <[f64; 3]>::from(self.scale.abs());
        if x.to_bits() == y.to_bits() && y.to_bits() == z.to_bits() {
            let ImportedMass { mass, center, J } = self.shell;
            let center = center.component_mul(&self.scale);
            let turn = Matrix3::from_diagonal(&self.scale.map(f64::signum));
            return ImportedMass { mass: mass * x * x, center, J: turn * J * turn * x.powi(4) };
        }
        Mesh::read(&self.path)
            .map_or_else(|_| ImportedMass::default(), |mesh| shell(&mesh, &self.scale))
    }
}

/// Mass properties of the surface at 1 kg/m²: `E = Σ A (a aᵀ + b bᵀ + c cᵀ + s sᵀ)/12`,
/// `s = a + b + c`, `A` areas of triangles.
fn shell(mesh: &Mesh, scale: &Vector3<f64>) -> ImportedMass {
    let triangles = mesh
        .triangles()
        .iter()
        .map(|triangle| triangle.map(|k| mesh.corners()[k as usize].component_mul(scale)));
    let area = |[a, b, c]: &[Vector3<f64>; 3]| 0.5 * (b - a).cross(&(c - a)).norm();
    let (mut mass, mut first) = (0.0, Vector3::zeros());
    for triangle in triangles.clone() {
        mass += area(&triangle);
        first += triangle.iter().sum::<Vector3<f64>>() * (area(&triangle) / 3.0);
    }
    let center = if mass > 0.0 { first / mass } else { first };
    let mut E = Matrix3::zeros();
    for triangle in triangles {
        let [a, b, c] = triangle.map(|corner| corner - center);
        let s = a + b + c;
        E += (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose())
            * (area(&triangle) / 12.0);
    }
    ImportedMass { mass, center, J: Matrix3::identity() * E.trace() - E }
}

/// Mass properties at 1 kg/m³ with the volumes of all tetrahedra counted as positive: first with
/// the tip at the centroid of the surface, which gives the centre of mass, then with the tip there.
/// Closed meshes need not be; a star-shaped one has its own mass properties. So does MuJoCo by
/// default (`inertia="legacy"`).
fn unsigned(mesh: &Mesh) -> ImportedMass {
    let corners = |triangle: &[u32; 3]| triangle.map(|k| mesh.corners()[k as usize]);
    let (mut area, mut moment) = (0.0, Vector3::zeros());
    for [a, b, c] in mesh.triangles().iter().map(corners) {
        let size = (b - a).cross(&(c - a)).norm();
        area += size;
        moment += (a + b + c) * (size / 3.0);
    }
    let tip = moment / area;
    let (mut volume, mut first) = (0.0, Vector3::zeros());
    for triangle in mesh.triangles().iter().map(corners) {
        let [a, b, c] = triangle.map(|corner| corner - tip);
        let det = a.cross(&b).dot(&c).abs();
        volume += det / 6.0;
        first += (a + b + c) * (det / 24.0);
    }
    let center = if volume > 0.0 { tip + first / volume } else { tip };
    let (mut mass, mut E) = (0.0, Matrix3::zeros());
    for triangle in mesh.triangles().iter().map(corners) {
        let [a, b, c] = triangle.map(|corner| corner - center);
        let (det, s) = (a.cross(&b).dot(&c).abs(), a + b + c);
        mass += det / 6.0;
        E += (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose())
            * (det / 120.0);
    }
    ImportedMass { mass, center, J: Matrix3::identity() * E.trace() - E }
}

/// Mass properties at 1 kg/m³ of a closed mesh.
fn solid(mesh: &Mesh) -> Result<ImportedMass, String> {
    let solid = Polyhedron::new(mesh.corners(), mesh.triangles()).map_err(|e| e.to_string())?;
    Ok(ImportedMass { mass: solid.volume, center: solid.center, J: solid.inertia(1.0) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box with edges 1, 2, 3 from the corner (1, 1, 1).
    const BLOCK: &str = "v 1 1 1\nv 2 1 1\nv 1 3 1\nv 2 3 1\nv 1 1 4\nv 2 1 4\nv 1 3 4\nv 2 3 4\n\
                         f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";

    fn mesh(text: &str) -> Mesh {
        Mesh::from_bytes(Path::new("a.obj"), text.into()).unwrap()
    }

    #[test]
    fn a_box_of_triangles_has_the_mass_properties_of_a_box() {
        let found = MeshSummary::of(&mesh(BLOCK)).scaled(&Vector3::new(2.0, -1.0, 1.0));
        let exact = ImportedSolid::Box([1.0, 1.0, 1.5]).with_mass(12.0);
        let mass = found.mass().unwrap();
        let error = (mass.J - exact.J).amax().max((mass.mass - 12.0).abs());
        assert!(error < 1e-13, "{error:e}");
        let legacy = (found.unsigned_mass().J - exact.J).amax();
        assert!(legacy < 1e-13, "a convex mesh: {legacy:e}");
        let center = (mass.center - Vector3::new(3.0, -2.0, 2.5)).amax();
        assert!(center < 1e-14, "{center:e}");
        let placed = found.placed(&Isometry3::identity());
        assert_eq!(placed.solid, ImportedSolid::Box([1.0, 1.0, 1.5]));
    }

    #[test]
    fn meshes_that_are_no_solids_are_refused() {
        let open = mesh(&BLOCK.replace("f 1 3 4 2\n", ""));
        assert_eq!(solid(&open).unwrap_err(), "it is not closed: 4 edges have no partner");
        let inside_out = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n";
        let message = solid(&mesh(inside_out)).unwrap_err();
        assert!(message.contains("inside out") && message.contains("-1.6"), "{message}");
    }

    #[test]
    fn a_file_is_named_from_the_folder_of_the_model() {
        let folder = std::env::temp_dir().join(format!("holonom-named-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("models/deep")).unwrap();
        std::fs::create_dir_all(folder.join("meshes")).unwrap();
        let file = folder.join("meshes/a.obj");
        std::fs::write(&file, BLOCK).unwrap();
        let named = |from: &str| named_from(&folder.join(from), &file);
        assert_eq!(named("models/deep").as_deref(), Some("../../meshes/a.obj"));
        assert_eq!(named("meshes").as_deref(), Some("a.obj"));
        assert_eq!(named("models/../.").as_deref(), Some("meshes/a.obj"));
        assert_eq!(named("nowhere"), None);
        std::fs::remove_dir_all(folder).unwrap();
    }
}
