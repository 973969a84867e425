//! What a shape that is a mesh may get wrong, before its file is read.

use crate::checks::Checker;
use crate::types::shape::{Scale, Shape};

impl Checker<'_> {
    /// A shape that is a mesh.
    pub(crate) fn mesh(&mut self, key: &str, shape: &Shape) {
        if shape.file.is_none() {
            let help = "add file = \"part.stl\", relative to the folder of the model file";
            self.report(key, "the mesh has no file".into(), help);
        }
        if !shape.dimensions.is_empty() {
            let help = "remove `dimensions`; `scale` changes the size of the mesh";
            self.report(format!("{key}.dimensions"), "a mesh has no dimensions".into(), help);
        }
        let scale = shape.scale.as_ref().map(Scale::vector);
        if scale.is_some_and(|scale| scale.iter().any(|s| *s == 0.0)) {
            let help = "write a factor such as 0.001 for millimetres, or three of them";
            self.report(format!("{key}.scale"), "a scale of 0 leaves no mesh".into(), help);
        }
    }

    /// A shape that is no mesh has none of its keys.
    pub(crate) fn no_mesh(&mut self, key: &str, shape: &Shape) {
        let help = "remove it, or write type = \"mesh\"";
        self.of_meshes(
            key,
            [("file", shape.file.is_some()), ("scale", shape.scale.is_some())],
            help,
        );
    }

    /// A shape with the centre of mass of its body has no place of its own.
    pub(crate) fn no_place(&mut self, key: &str, shape: &Shape) {
        let stated =
            [("position", shape.position.is_some()), ("quaternion", shape.quaternion.is_some())];
        let help = "remove it; a shape that is only seen, at any place, is one of `picture`, one that only touches others one of `collision`";
        self.of_meshes(key, stated, help);
    }

    fn of_meshes(&mut self, key: &str, stated: [(&str, bool); 2], help: &str) {
        for (name, _) in stated.into_iter().filter(|stated| stated.1) {
            let message = format!("`{name}` is of shapes with type = \"mesh\" alone");
            self.report(format!("{key}.{name}"), message, help);
        }
    }

    /// A shape of a picture, or of contacts, has no density.
    pub(crate) fn weighs_nothing(&mut self, key: &str, of: &str, shape: &Shape) {
        if shape.density.is_some() {
            let help = "remove it; the `shape` of the body gives mass and inertia";
            let message = format!("a shape of a {of} weighs nothing");
            self.report(format!("{key}.density"), message, help);
        }
    }
}
