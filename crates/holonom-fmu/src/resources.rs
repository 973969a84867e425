//! What a unit holds of the model, and the token that says of which model it is.
//!
//! | file | holds |
//! |---|---|
//! | `model.toml` | the text of the model, all files merged |
//! | `interface.json` | overrides, inputs and parameters that were asked for, names of meshes, texts of tables |
//! | `meshes/` | the meshes |

use crate::VERSION;
use crate::interface::{Interface, UnitRequest};
use holonom::model::mesh::{MESH_FOLDER, Mesh};
use holonom::model::{Meshes, ModelText, read_regular, read_regular_text};
use holonom::{Model, ModelError, Override};
use serde::{Deserialize, Serialize};
use std::io;
use std::path::Path;

/// The text of the model.
pub const MODEL: &str = "model.toml";
/// What is asked for beside.
pub const INTERFACE: &str = "interface.json";
/// Most bytes of a file that is read.
const MOST: u64 = 256 * 1024 * 1024;

/// What a unit holds of the model.
#[derive(Clone, Debug)]
pub struct Resources {
    /// The text, all files merged.
    pub text: String,
    /// Values that replace those of the text.
    pub overrides: Vec<Override>,
    /// Inputs and parameters that were asked for.
    pub request: UnitRequest,
    /// The meshes.
    pub meshes: Meshes,
}

/// `interface.json`.
#[derive(Debug, Serialize, Deserialize)]
struct InterfaceFile {
    set: Vec<(String, String)>,
    #[serde(flatten)]
    request: UnitRequest,
    meshes: Vec<(String, String)>, // the file as the text names it, and its name in the unit
    #[serde(default)]
    texts: Vec<(String, String)>, // files of tables and stations, and what they hold
}

impl Resources {
    /// Those of a model that was read.
    ///
    /// # Errors
    /// [`ModelError`] of the text.
    pub fn new(
        text: &ModelText,
        overrides: Vec<Override>,
        model: &Model,
        request: UnitRequest,
    ) -> Result<Self, ModelError> {
        let (text, meshes) = (text.text()?.to_owned(), model.meshes.clone());
        Ok(Self { text, overrides, request, meshes })
    }

    /// The model with more values replaced.
    ///
    /// # Errors
    /// [`ModelError`].
    pub fn model(&self, more: &[Override]) -> Result<Model, ModelError> {
        let all: Vec<Override> = self.overrides.iter().chain(more).cloned().collect();
        Model::from_toml_in(&self.text, &all, self.meshes.clone())
    }

    /// The variables of the model as it was exported.
    ///
    /// # Errors
    /// [`ModelError`].
    pub fn interface(&self) -> Result<(Model, Interface), ModelError> {
        let model = self.model(&[])?;
        let interface = Interface::of(&self.text, &self.overrides, &model, &self.request)?;
        Ok((model, interface))
    }

    /// What a tool gives to the library, so that it is the library of this unit: the digest of
    /// text, overrides, variables and version.
    #[must_use]
    pub fn token(&self, interface: &Interface) -> String {
        let mut hash = hmac_sha256::Hash::new();
        let mut add = |words: &str| {
            hash.update((words.len() as u64).to_le_bytes());
            hash.update(words);
        };
        add(VERSION);
        add(&self.text);
        for Override { key, value, .. } in &self.overrides {
            add(key);
            add(value);
        }
        for (_, mesh) in self.meshes.named() {
            add(&mesh.stored_name());
        }
        for (file, text) in self.meshes.texts() {
            add(file);
            add(text);
        }
        for variable in &interface.variables {
            add(&variable.name);
            add(&format!("{:?} {:?}", variable.causality, variable.start));
        }
        let digits = hash.finalize().map(|byte| format!("{byte:02x}")).concat();
        let [a, b, c, d, e] = [0..8, 8..12, 12..16, 16..20, 20..32].map(|range| &digits[range]);
        format!("{{{a}-{b}-{c}-{d}-{e}}}")
    }

    /// Paths and contents of its files, below the folder of resources.
    ///
    /// # Errors
    /// None but those of JSON.
    pub fn files(&self) -> serde_json::Result<Vec<(String, Vec<u8>)>> {
        let named = || self.meshes.named();
        let stored = InterfaceFile {
            set: self.overrides.iter().map(|own| (own.key.clone(), own.value.clone())).collect(),
            request: self.request.clone(),
            meshes: named().map(|(file, mesh)| (file.to_owned(), mesh.stored_name())).collect(),
            texts: self.meshes.texts().map(|(file, text)| (file.into(), text.into())).collect(),
        };
        let json = serde_json::to_vec_pretty(&stored)?;
        let own =
            [(MODEL.to_owned(), self.text.clone().into_bytes()), (INTERFACE.to_owned(), json)];
        let meshes = named().map(|(_, mesh)| {
            (format!("{MESH_FOLDER}/{}", mesh.stored_name()), mesh.bytes().to_vec())
        });
        let mut files: Vec<_> = own.into_iter().chain(meshes).collect();
        files.dedup_by(|a, b| a.0 == b.0);
        Ok(files)
    }

    /// Those in a folder.
    ///
    /// # Errors
    /// Of files that cannot be read.
    pub fn read(folder: &Path) -> io::Result<Self> {
        let at = |name: &str, error: io::Error| {
            let path = folder.join(name);
            io::Error::new(error.kind(), format!("{}: {error}", path.display()))
        };
        let text = |name: &str| {
            read_regular_text(&folder.join(name), MOST).map_err(|error| at(name, error))
        };
        let stored: InterfaceFile = serde_json::from_str(&text(INTERFACE)?)
            .map_err(|error| at(INTERFACE, io::Error::other(error)))?;
        let mut meshes = Meshes::default();
        for (file, name) in stored.meshes {
            let path = format!("{MESH_FOLDER}/{name}");
            let bytes =
                read_regular(&folder.join(&path), MOST).map_err(|error| at(&path, error))?;
            let mesh = Mesh::from_bytes(Path::new(&name), bytes);
            let known = mesh.and_then(|mesh| meshes.with(file, mesh));
            meshes = known.map_err(|error| at(&path, io::Error::other(error.to_string())))?;
        }
        let known = |meshes: Meshes, (file, text): (String, String)| meshes.with_text(file, text);
        let meshes = stored.texts.into_iter().fold(meshes, known);
        let overrides = stored.set.into_iter().map(|(key, value)| Override::new(key, value));
        let (text, overrides) = (text(MODEL)?, overrides.collect());
        Ok(Self { text, overrides, request: stored.request, meshes })
    }
}

/// The words of an error of a model, problem by problem with what helps.
#[must_use]
pub fn words(error: &ModelError) -> String {
    let (ModelError::Invalid(problems) | ModelError::Assembly(problems)) = error else {
        return error.to_string();
    };
    let said = problems.iter().map(|problem| {
        let key = if problem.key.is_empty() { String::new() } else { format!("{}: ", problem.key) };
        let help = problem.help.as_ref().map_or(String::new(), |help| format!(" ({help})"));
        format!("{key}{}{help}", problem.message)
    });
    said.collect::<Vec<_>>().join("; ")
}

/// The folder of the resources by the address that FMI 2.0 gives: `file:///a%20folder/resources`.
#[must_use]
pub fn folder_of_address(address: &str) -> std::path::PathBuf {
    let Some(rest) = address.strip_prefix("file:") else { return address.into() };
    let path =
        rest.strip_prefix("//").map_or(rest, |rest| rest.find('/').map_or("", |k| &rest[k..]));
    let bytes = path.as_bytes();
    let (mut decoded, mut k) = (Vec::new(), 0);
    while k < bytes.len() {
        let digits = bytes.get(k + 1..k + 3).and_then(|own| std::str::from_utf8(own).ok());
        let byte = digits.and_then(|own| u8::from_str_radix(own, 16).ok());
        match (bytes[k], byte) {
            (b'%', Some(byte)) => {
                decoded.push(byte);
                k += 3;
            }
            (byte, _) => {
                decoded.push(byte);
                k += 1;
            }
        }
    }
    let path = String::from_utf8_lossy(&decoded).into_owned();
    let drive = path.len() > 2 && path.as_bytes()[2] == b':';
    if drive { path[1..].into() } else { path.into() }
}

/// Overrides of keys by numbers, which keep their bits.
#[must_use]
pub fn override_by(key: &str, value: f64) -> Override {
    Override::new(key.to_owned(), format!("{value:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_of_folders_are_decoded() {
        let of = |address: &str| folder_of_address(address).display().to_string();
        assert_eq!(of("file:///tmp/a%20b/%C3%BC/resources"), "/tmp/a b/ü/resources");
        assert_eq!(of("file:/tmp/r"), "/tmp/r");
        assert_eq!(of("file://localhost/tmp/r"), "/tmp/r");
        assert_eq!(of("file:///C:/fmu/resources"), "C:/fmu/resources");
        assert_eq!(of("/tmp/100%/r"), "/tmp/100%/r");
        assert_eq!(of("file:///tmp/100%/r"), "/tmp/100%/r");
    }
}
