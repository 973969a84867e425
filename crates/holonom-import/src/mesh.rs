//! Files of meshes: their extents.

use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Vector3};

use crate::solid::{Placed, Solid};

/// The meshes of a description.
#[derive(Debug)]
pub(crate) struct Meshes {
    folder: PathBuf,
}

/// A box around a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Extents {
    pub(crate) least: Vector3<f64>,
    pub(crate) largest: Vector3<f64>,
}

impl Extents {
    /// As a solid of a link, in which the mesh has a pose.
    pub(crate) fn placed(&self, pose: &Isometry3<f64>) -> Placed {
        let half = (self.largest - self.least) * 0.5;
        let center = (self.largest + self.least) * 0.5;
        Placed {
            solid: Solid::Box([half.x, half.y, half.z]),
            pose: pose * Isometry3::translation(center.x, center.y, center.z),
        }
    }
}

impl Meshes {
    /// Meshes of the description in this file.
    pub(crate) fn beside(path: &Path) -> Self {
        Self { folder: path.parent().unwrap_or_else(|| Path::new("")).to_owned() }
    }

    /// The extents of a mesh in a file, each axis scaled; or why there are none.
    pub(crate) fn extents(
        &mut self,
        _file: &str,
        _scale: [f64; 3],
    ) -> Result<Extents, &'static str> {
        let _ = &self.folder;
        Err("not read")
    }
}
