//! What a shape that is a mesh may get wrong, before its file is read.

use crate::checks::Checker;
use crate::orientation::quaternion_fault;
use crate::shape::{Scale, Shape};

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
        if let Some(problem) = shape.quaternion.and_then(quaternion_fault) {
            self.add(problem.below(key));
        }
    }

    /// A shape that is no mesh has none of its keys.
    pub(crate) fn no_mesh(&mut self, key: &str, shape: &Shape) {
        let stated = [
            ("file", shape.file.is_some()),
            ("scale", shape.scale.is_some()),
            ("position", shape.position.is_some()),
            ("quaternion", shape.quaternion.is_some()),
        ];
        for (name, _) in stated.into_iter().filter(|stated| stated.1) {
            let message = format!("`{name}` is of shapes with type = \"mesh\" alone");
            let help = "remove it, or write type = \"mesh\"";
            self.report(format!("{key}.{name}"), message, help);
        }
    }
}
