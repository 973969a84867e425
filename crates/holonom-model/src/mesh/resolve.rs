//! What follows from the mesh of a body: mass, inertia, and where it is.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use vi_rigid::{Polyhedron, SurfaceError};

use super::{BodySurface, MAX_MODEL_TRIANGLES, Mesh, MeshError, Meshes};
use crate::text::problem::{MAX_PROBLEMS, Problem, fault};
use crate::types::shape::{Inertia, Shape};
use crate::{Body, Model};

/// A stated position may miss the centre of mass by this part of the size of the mesh.
const MISSED: f64 = 1e-6;
/// Products of inertia below this part of the largest moment are rounding errors.
const DIAGONAL: f64 = 1e-14;

/// Reads the meshes of the bodies and fills in what follows from them. The problems have the number
/// of the body, and a key below that of the body.
pub(crate) fn resolve(model: &mut Model) -> Vec<(usize, Problem)> {
    let Model { bodies, meshes, .. } = model;
    let (mut problems, mut left) = (Vec::new(), MAX_MODEL_TRIANGLES);
    for (i, body) in bodies.iter_mut().enumerate() {
        let resolved = resolve_body(body, meshes, &mut left);
        let resolved = resolved.and_then(|()| load_others(body, meshes, &mut left));
        if let Err(problem) = resolved {
            problems.push((i, problem));
            if problems.len() >= MAX_PROBLEMS {
                break;
            }
        }
    }
    meshes.retain(&bodies.iter().flat_map(Body::mesh_files).collect());
    problems
}

impl Body {
    /// The files of its meshes: of its shape and of its picture.
    pub fn mesh_files(&self) -> impl Iterator<Item = &str> {
        self.shapes().filter_map(|shape| shape.file.as_deref())
    }

    /// Whether mass or inertia follow from the shape.
    fn is_weighed(&self) -> bool {
        let density = self.shape.as_ref().is_some_and(|shape| shape.density.is_some());
        match self.mass {
            None => density,
            Some(_) => self.inertia.is_none(),
        }
    }
}

/// `left`: how many triangles there may be.
fn resolve_body(body: &mut Body, meshes: &mut Meshes, left: &mut usize) -> Result<(), Problem> {
    let weighed = body.is_weighed();
    let file = body.shape.as_ref().and_then(|shape| shape.file.as_deref());
    let Some(mesh) = load(file, weighed, meshes, left).map_err(|p| p.below("shape"))? else {
        return Ok(());
    };
    let Some(shape) = body.shape.as_mut().filter(|_| weighed) else { return Ok(()) };
    let solid = solid(&mesh, shape)?;
    center(shape, &solid, &mesh)?;
    let density = shape.density.unwrap_or_default();
    let mass = *body.mass.get_or_insert(density * solid.volume);
    let tensor = solid.inertia(mass / solid.volume);
    body.inertia.get_or_insert_with(|| inertia(&tensor));
    Ok(())
}

/// Reads the meshes of the picture of a body, and those with which it touches others; the picture
/// may lack some.
fn load_others(body: &Body, meshes: &mut Meshes, left: &mut usize) -> Result<(), Problem> {
    for (of, shapes, needed) in
        [("picture", &body.picture, false), ("collision", &body.collision, true)]
    {
        for (k, shape) in shapes.iter().enumerate() {
            load(shape.file.as_deref(), needed, meshes, left)
                .map_err(|problem| problem.below(&format!("{of}[{k}]")))?;
        }
    }
    Ok(())
}

/// Reads the mesh of a shape; `None` where it has none, or where it may lack it: one that is not
/// `needed`.
fn load(
    file: Option<&str>,
    needed: bool,
    meshes: &mut Meshes,
    left: &mut usize,
) -> Result<Option<Arc<Mesh>>, Problem> {
    let Some(file) = file else { return Ok(None) };
    let mesh = match meshes.load(file) {
        Err(_) if meshes.lenient && !needed => return Ok(None),
        read => read.map_err(|error| unreadable(file, &error))?,
    };
    let Some(rest) = left.checked_sub(mesh.triangles().len()) else {
        return Err(unreadable(file, &MeshError::TooManyTogether));
    };
    *left = rest;
    Ok(Some(mesh))
}

/// The mesh as a solid, turned and scaled, with its own origin at that of the body.
fn solid(mesh: &Mesh, shape: &Shape) -> Result<Polyhedron, Problem> {
    let surface = BodySurface::new(mesh, &Shape { position: None, ..shape.clone() });
    Polyhedron::new(&surface.corners, &surface.triangles).map_err(|error| {
        let file = shape.file.as_deref().unwrap_or_default().escape_debug();
        let message = format!("the mesh `{file}` gives no mass: {error}");
        let help = match error {
            SurfaceError::InsideOut { .. } => {
                "reverse its triangles, or state `mass` and `inertia`: the mesh is then the picture alone"
            }
            SurfaceError::Flat { .. } => {
                "give it a thickness, or state `mass` and `inertia`: the mesh is then the picture alone"
            }
            _ => "close it, or state `mass` and `inertia`: the mesh is then the picture alone",
        };
        fault("shape.file", message, help)
    })
}

/// Places the centre of mass of the mesh at the origin of the body; a stated position must do so.
fn center(shape: &mut Shape, solid: &Polyhedron, mesh: &Mesh) -> Result<(), Problem> {
    let wanted = -solid.center;
    let Some(stated) = shape.position else {
        shape.position = Some(wanted.map(|x| x + 0.0).into()); // one zero
        return Ok(());
    };
    let [low, high] = BodySurface::new(mesh, shape).ends();
    let missed = (Vector3::from(stated) - wanted).norm();
    if missed <= MISSED * (high - low).norm() {
        return Ok(());
    }
    let [x, y, z]: [f64; 3] = wanted.into();
    let message = format!(
        "the centre of mass of the mesh is {missed:.3e} m from the centre of mass of the body, the origin of its frame"
    );
    let help = format!(
        "remove `position`: the mesh is then placed by its centre of mass, at [{x:?}, {y:?}, {z:?}]; or state `mass` and `inertia`"
    );
    Err(fault("shape.position", message, help))
}

/// Principal moments where the tensor is diagonal up to round-off.
fn inertia(tensor: &Matrix3<f64>) -> Inertia {
    let size = tensor.amax();
    let products = [tensor.m12, tensor.m13, tensor.m23];
    if products.iter().all(|product| product.abs() <= DIAGONAL * size) {
        return Inertia::Principal([tensor.m11, tensor.m22, tensor.m33]);
    }
    let symmetric = (tensor + tensor.transpose()) * 0.5;
    Inertia::Tensor([0, 1, 2].map(|i| [0, 1, 2].map(|j| symmetric[(i, j)] + 0.0)))
}

fn unreadable(file: &str, error: &MeshError) -> Problem {
    let help = match error {
        MeshError::NotFound => "paths are relative to the folder of the model file",
        MeshError::NoFolder => "write an absolute path, or read the model from its file",
        MeshError::NotAFile | MeshError::Unreadable { .. } => "name a file with triangles",
        MeshError::Format => "write the mesh as STL or OBJ",
        MeshError::TooLarge
        | MeshError::TooLargeTogether
        | MeshError::TooManyTogether
        | MeshError::TooManyTriangles { .. } => "simplify the mesh, or write it as binary STL",
        MeshError::Changed => "run the model again, or put the file back",
        MeshError::Damaged | MeshError::DamagedLine { .. } | MeshError::Empty => {
            "export the mesh again, as triangles"
        }
    };
    fault("file", format!("the mesh `{}` is {error}", file.escape_debug()), help)
}
