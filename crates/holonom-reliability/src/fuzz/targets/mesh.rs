//! Meshes in STL and OBJ.

use super::{Answer, FuzzTarget, Worker, files};
use holonom::model::Mesh;
use holonom::vi_rigid::Polyhedron;
use std::path::Path;

/// Files of meshes.
#[derive(Clone, Copy, Debug)]
pub struct MeshFiles;

impl FuzzTarget for MeshFiles {
    fn name(&self) -> &'static str {
        "mesh"
    }

    fn executions(&self) -> u64 {
        3_000_000
    }

    fn seeds(&self) -> Vec<Vec<u8>> {
        files("tests/corpus/mesh", 1 << 16)
    }

    fn worker(&self) -> Box<dyn Worker> {
        Box::new(MeshReader)
    }
}

struct MeshReader;

impl Worker for MeshReader {
    fn execute(&mut self, input: &[u8]) -> Answer {
        read(input, b"")
    }

    fn execute_unchecked(&mut self, input: &[u8]) -> Answer {
        read(input, b"\n")
    }
}

/// As STL, or else as OBJ. `surplus`: what a copy of the file has more.
fn read(input: &[u8], surplus: &[u8]) -> Answer {
    let stl = Mesh::from_bytes(Path::new("a.stl"), input.to_vec());
    let mesh = match stl.or_else(|_| Mesh::from_bytes(Path::new("a.obj"), input.to_vec())) {
        Ok(mesh) => mesh,
        Err(error) => return Answer::Refused(error.to_string()),
    };
    let copy = [mesh.bytes(), surplus].concat();
    if Mesh::from_bytes(Path::new(&mesh.stored_name()), copy).as_ref() != Ok(&mesh) {
        return Answer::Wrong("accepted: a copy gives another mesh".into());
    }
    if !mesh.corners().iter().flatten().all(|x| x.is_finite()) {
        return Answer::Wrong("accepted: a corner is not finite".into());
    }
    match Polyhedron::new(mesh.corners(), mesh.triangles()) {
        Ok(solid) if solid.volume.is_finite() && solid.volume > 0.0 => Answer::Accepted,
        Ok(solid) => Answer::Wrong(format!("accepted: the volume is {}", solid.volume)),
        Err(error) => Answer::Refused(error.to_string()),
    }
}
