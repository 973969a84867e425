//! Meshes as shapes of bodies: their files, what they weigh, where they are.
//!
//! ```text
//! shape.file ─► Meshes (folder of the model file; each file once) ─► Mesh ─► mass, inertia, position
//!                                                                     └────► BodySurface: pictures
//! ```

mod checks;
mod file;
mod placed;
mod primitive;
mod resolve;
mod surface;

use std::collections::{BTreeMap, BTreeSet};
use std::hash::Hasher;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use fnv::FnvHasher;
use nalgebra::Vector3;

use crate::text::read::{folder_of, read_regular_text};
use crate::{Body, Model};

pub use file::{MAX_MESH_BYTES, MAX_TRIANGLES, MeshError};
pub(crate) use resolve::resolve;
pub use surface::BodySurface;

/// The greatest size of all meshes of a model, bytes.
pub const MAX_MESHES_BYTES: usize = 256 * 1024 * 1024;
/// The greatest number of triangles of all bodies of a model; a mesh of two bodies counts twice.
pub const MAX_MODEL_TRIANGLES: usize = 2_000_000;
/// The folder of the meshes of a run, in the folder of the run.
pub const MESH_FOLDER: &str = "meshes";

/// The triangles of a file, in its own coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    surface: file::Triangulation,
    bytes: Vec<u8>,
    extension: String,
    hash: u64,
}

impl Mesh {
    /// Reads a file, STL or OBJ.
    ///
    /// # Errors
    /// [`MeshError`].
    pub fn read(path: &Path) -> Result<Self, MeshError> {
        let (surface, bytes) = file::read(path)?;
        Ok(Self::new(surface, bytes, path))
    }

    /// The mesh in the bytes of a file of this name.
    ///
    /// # Errors
    /// [`MeshError`].
    pub fn from_bytes(name: &Path, bytes: Vec<u8>) -> Result<Self, MeshError> {
        if bytes.len() as u64 > MAX_MESH_BYTES {
            return Err(MeshError::TooLarge);
        }
        let surface = file::parser(name)?(&bytes)?;
        Ok(Self::new(surface, bytes, name))
    }

    fn new(surface: file::Triangulation, bytes: Vec<u8>, path: &Path) -> Self {
        let hash = content_hash(&bytes);
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        Self { surface, bytes, extension: extension.to_string_lossy().into_owned(), hash }
    }

    /// Its corners.
    #[must_use]
    pub fn corners(&self) -> &[Vector3<f64>] {
        &self.surface.corners
    }

    /// Its triangles, counterclockwise as seen from outside if the file keeps to the rule.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.surface.triangles
    }

    /// The bytes of its file.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Its name in the folder [`MESH_FOLDER`] of a run: the hash of its content.
    #[must_use]
    pub fn stored_name(&self) -> String {
        stored_name(self.hash, &self.extension)
    }
}

/// FNV-1a, 64 bits.
fn content_hash(bytes: &[u8]) -> u64 {
    let mut hasher = FnvHasher::default();
    hasher.write(bytes);
    hasher.finish()
}

fn stored_name(hash: u64, extension: &str) -> String {
    format!("{hash:016x}.{extension}")
}

/// Whether a file name is that under which this content is stored in the folder of a run; `None`
/// where it is no such name.
#[must_use]
pub fn is_stored_name(name: &str, content: &[u8]) -> Option<bool> {
    let (stem, extension) = name.split_once('.')?;
    let digits = stem.len() == 16 && stem.bytes().all(|b| b.is_ascii_hexdigit());
    let stored = digits && ["stl", "obj"].contains(&extension);
    stored.then(|| name == stored_name(content_hash(content), extension))
}

/// The meshes that a model names, and the texts of its tables and stations; each file is read once.
/// Meshes are equal where files and contents are, wherever they were found.
#[derive(Clone, Debug, Default)]
pub struct Meshes {
    /// Where relative paths start; `None` for a model that comes from a text.
    folder: Option<PathBuf>,
    known: BTreeMap<String, Arc<Mesh>>,
    /// Texts of tables and stations, by their paths in the folder.
    texts: BTreeMap<String, Arc<str>>,
    /// Of all that are known.
    bytes: usize,
    /// Whether a picture that cannot be read is left out.
    lenient: bool,
}

impl PartialEq for Meshes {
    fn eq(&self, other: &Self) -> bool {
        self.known == other.known
    }
}

impl Meshes {
    /// Relative paths start in this folder.
    #[must_use]
    pub fn in_folder(folder: impl Into<PathBuf>) -> Self {
        Self { folder: Some(folder.into()), ..Self::default() }
    }

    /// The same; a mesh that is the picture alone and cannot be read is left out.
    #[must_use]
    pub fn pictures_in_folder(folder: impl Into<PathBuf>) -> Self {
        Self { lenient: true, ..Self::in_folder(folder) }
    }

    /// Relative paths start in the folder of this model file.
    #[must_use]
    pub fn beside(model: &Path) -> Self {
        Self::in_folder(folder_of(model))
    }

    /// The mesh of this file, as the model states it.
    #[must_use]
    pub fn get(&self, file: &str) -> Option<&Mesh> {
        self.known.get(file).map(AsRef::as_ref)
    }

    /// All meshes, each once.
    pub fn iter(&self) -> impl Iterator<Item = &Mesh> {
        self.known.values().map(AsRef::as_ref)
    }

    /// All meshes, each with its file as the model states it.
    pub fn named(&self) -> impl Iterator<Item = (&str, &Mesh)> {
        self.known.iter().map(|(file, mesh)| (file.as_str(), mesh.as_ref()))
    }

    /// With a mesh that is known beside those of files.
    ///
    /// # Errors
    /// [`MeshError::TooLargeTogether`].
    pub fn with(mut self, file: impl Into<String>, mesh: Mesh) -> Result<Self, MeshError> {
        self.bytes += mesh.bytes.len();
        if self.bytes > MAX_MESHES_BYTES {
            return Err(MeshError::TooLargeTogether);
        }
        self.known.insert(file.into(), Arc::new(mesh));
        Ok(self)
    }

    /// Texts of tables and stations that were read, each with its path in the folder.
    pub fn texts(&self) -> impl Iterator<Item = (&str, &str)> {
        self.texts.iter().map(|(file, text)| (file.as_str(), text.as_ref()))
    }

    /// With the text of a table or of stations that is known beside those of files.
    #[must_use]
    pub fn with_text(mut self, file: impl Into<String>, text: impl Into<Arc<str>>) -> Self {
        self.texts.insert(file.into(), text.into());
        self
    }

    /// The text of a file at a path of [`Self::path`], or beside one, unless it is known.
    pub(crate) fn text(&mut self, path: &Path, most: u64) -> io::Result<Arc<str>> {
        let in_folder = self.folder.as_ref().and_then(|folder| path.strip_prefix(folder).ok());
        let file = in_folder.unwrap_or(path).to_string_lossy().into_owned();
        if let Some(text) = self.texts.get(&file) {
            return Ok(text.clone());
        }
        let text: Arc<str> = read_regular_text(path, most)?.into();
        self.texts.insert(file, text.clone());
        Ok(text)
    }

    /// The path of a file, as the model states it.
    pub(crate) fn path(&self, file: &str) -> Result<PathBuf, MeshError> {
        match &self.folder {
            None if self.texts.contains_key(file) => Ok(file.into()),
            Some(folder) => Ok(folder.join(file)),
            None if Path::new(file).is_absolute() => Ok(file.into()),
            None => Err(MeshError::NoFolder),
        }
    }

    /// Reads a file, unless it is known.
    fn load(&mut self, file: &str) -> Result<Arc<Mesh>, MeshError> {
        if let Some(mesh) = self.known.get(file) {
            return Ok(mesh.clone());
        }
        let path = self.path(file)?;
        let mesh = Arc::new(Mesh::read(&path)?);
        let in_run = path.parent().and_then(Path::file_name).is_some_and(|f| f == MESH_FOLDER);
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if in_run && is_stored_name(&name, &mesh.bytes) == Some(false) {
            return Err(MeshError::Changed);
        }
        let bytes = self.bytes + mesh.bytes.len();
        if bytes > MAX_MESHES_BYTES {
            return Err(MeshError::TooLargeTogether);
        }
        self.bytes = bytes;
        self.known.insert(file.to_owned(), mesh.clone());
        Ok(mesh)
    }

    /// Forgets all but these files.
    fn retain(&mut self, files: &BTreeSet<&str>) {
        self.known.retain(|file, _| files.contains(file.as_str()));
        self.bytes = self.iter().map(|mesh| mesh.bytes.len()).sum();
    }
}

impl Model {
    /// The text of this model for a folder that holds its meshes in [`MESH_FOLDER`] under
    /// [`Mesh::stored_name`].
    #[must_use]
    pub fn to_stored_toml(&self) -> String {
        let mut model = self.clone();
        for shape in model.bodies.iter_mut().flat_map(Body::shapes_mut) {
            let stored = shape.file.as_deref().and_then(|file| self.meshes.get(file));
            if let Some(mesh) = stored {
                shape.file = Some(format!("{MESH_FOLDER}/{}", mesh.stored_name()));
            }
        }
        model.to_toml()
    }
}

#[cfg(test)]
mod tests;
