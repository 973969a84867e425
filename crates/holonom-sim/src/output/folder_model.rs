//! The model of a run in its folder, with its meshes.

use std::path::Path;

use holonom_model::{Meshes, Model, ModelError, read_regular_text};

use super::file::{LARGEST, OutputError};
use super::folder::{MODEL, RunFolder};
use super::meshes;

impl RunFolder {
    /// The text of `model.toml`; empty when there is none.
    #[must_use]
    pub fn model_text(&self) -> String {
        read_regular_text(&self.path().join(MODEL), LARGEST).unwrap_or_default()
    }

    /// The model in `model.toml`, with the meshes of the folder; one that cannot be read is left
    /// out.
    ///
    /// # Errors
    /// [`ModelError`].
    pub fn model(&self) -> Result<Model, ModelError> {
        Model::from_toml_in(&self.model_text(), &[], Meshes::pictures_in_folder(self.path()))
    }

    /// Whether copies of meshes can be written to a folder. Changes nothing.
    ///
    /// # Errors
    /// [`OutputError::Foreign`].
    pub fn takes_meshes(path: &Path, meshes: &Meshes) -> Result<(), OutputError> {
        meshes::check_before(path, meshes)
    }

    /// Writes `model.toml` and copies of its meshes; the text of the file.
    ///
    /// # Errors
    /// [`OutputError::Foreign`], [`OutputError::Io`].
    pub fn write_model(&self, model: &Model) -> Result<String, OutputError> {
        let text = model.to_stored_toml();
        self.write_meshes(&model.meshes)?;
        self.write(MODEL, &text)?;
        Ok(text)
    }

    /// Writes copies of meshes; runs in the folders below share them.
    ///
    /// # Errors
    /// [`OutputError::Foreign`], [`OutputError::Io`].
    pub fn write_meshes(&self, meshes: &Meshes) -> Result<(), OutputError> {
        meshes::write(self.path(), meshes)
    }
}
