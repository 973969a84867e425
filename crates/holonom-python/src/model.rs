//! A valid model with the text that it was made of.

use crate::errors::{NO_FILE, invalid, json, raise};
use holonom::model::mesh::Mesh;
use holonom::model::{Meshes, ModelText};
use holonom::{ModelError, Override};
use holonom_cli::shortage;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyTuple};
use std::path::{Path, PathBuf};

/// Key and value as the text of a model file.
type Set = (String, String);
/// A mesh: the file as the model states it, and its content.
type NamedMesh<'py> = (String, Bound<'py, PyBytes>);

/// A valid model.
#[pyclass(frozen, module = "holonom._core")]
#[derive(Debug)]
pub(crate) struct Model {
    pub(crate) text: ModelText,
    pub(crate) overrides: Vec<Override>,
    pub(crate) model: holonom::Model,
}

pub(crate) fn overrides(set: Vec<Set>) -> Vec<Override> {
    set.into_iter().map(|(key, value)| Override::new(key, value)).collect()
}

impl Model {
    /// The model of a text with values replaced; `meshes`: those that are known, and the folder of
    /// others.
    fn of(
        py: Python<'_>,
        text: ModelText,
        overrides: Vec<Override>,
        meshes: Meshes,
    ) -> PyResult<Self> {
        let found = py.detach(|| holonom::Model::from_toml_in(text.text()?, &overrides, meshes));
        match found {
            Ok(model) => match shortage(&model) {
                None => Ok(Self { text, overrides, model }),
                Some(words) => Err(raise(py, "MemoryLack", (words,))),
            },
            Err(error) => Err(invalid(py, &text, &overrides, &error)),
        }
    }

    /// The error of an assembly with the places of this text.
    pub(crate) fn refused(&self, py: Python<'_>, error: &ModelError) -> PyErr {
        invalid(py, &self.text, &self.overrides, error)
    }

    /// Its text, all files merged.
    pub(crate) fn merged(&self) -> &str {
        self.text.text().unwrap_or_default()
    }
}

#[pymethods]
impl Model {
    /// Reads a file with all that it includes.
    #[staticmethod]
    pub(crate) fn read(py: Python<'_>, path: PathBuf, set: Vec<Set>) -> PyResult<Self> {
        let text = ModelText::read(&path);
        Self::of(py, text, overrides(set), Meshes::beside(&path))
    }

    /// Reads a text; what it includes and its meshes are looked for in `folder`, but for the
    /// `meshes` and the `texts` of tables that are known.
    #[staticmethod]
    fn parse(
        py: Python<'_>,
        text: String,
        folder: Option<PathBuf>,
        set: Vec<Set>,
        meshes: Vec<NamedMesh<'_>>,
        texts: Vec<Set>,
    ) -> PyResult<Self> {
        let path = folder.as_ref().map_or(NO_FILE.into(), |folder| folder.join(NO_FILE));
        let text = ModelText::from_text(&path, text);
        let mut found = folder.map_or_else(Meshes::default, Meshes::in_folder);
        for (file, content) in meshes {
            let mesh = Mesh::from_bytes(Path::new(&file), content.as_bytes().to_vec());
            found = mesh
                .and_then(|mesh| found.with(file, mesh))
                .map_err(|error| raise(py, "HolonomError", (error.to_string(),)))?;
        }
        let found =
            texts.into_iter().fold(found, |found, (file, text)| found.with_text(file, text));
        Self::of(py, text, overrides(set), found)
    }

    /// The same with more values replaced.
    fn replace(&self, py: Python<'_>, set: Vec<Set>) -> PyResult<Self> {
        let all = self.overrides.iter().cloned().chain(overrides(set)).collect();
        Self::of(py, self.text.clone(), all, self.model.meshes.clone())
    }

    /// What `parse` makes this model of again, with no path.
    fn parts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let set: Vec<Set> =
            self.overrides.iter().map(|set| (set.key.clone(), set.value.clone())).collect();
        let meshes = self.model.meshes.named();
        let meshes: Vec<NamedMesh<'py>> =
            meshes.map(|(file, mesh)| (file.to_owned(), PyBytes::new(py, mesh.bytes()))).collect();
        let texts = self.model.meshes.texts();
        let texts: Vec<Set> = texts.map(|(file, text)| (file.into(), text.into())).collect();
        (self.merged(), py.None(), set, meshes, texts).into_pyobject(py)
    }

    /// The text, everything resolved.
    fn to_toml(&self) -> String {
        self.model.to_toml()
    }

    /// The same as JSON.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json(py, &serde_json::to_value(&self.model).unwrap_or_default())
    }

    /// Whether both models are equal, everything resolved.
    fn equals(&self, other: &Self) -> bool {
        self.model == other.model
    }

    /// The units of columns of its signals and sensors; empty of numbers without one.
    fn sensor_units(&self, columns: Vec<String>) -> Vec<&'static str> {
        let own = holonom::sensor::columns(&self.model);
        let unit = |name: &String| own.iter().find(|column| &column.name() == name);
        columns.iter().map(|name| unit(name).map_or("", |column| column.unit)).collect()
    }

    #[getter]
    fn name(&self) -> &str {
        &self.model.header.name
    }

    /// Number of steps to the end.
    #[getter]
    fn steps(&self) -> u64 {
        self.model.settings.steps()
    }
}
