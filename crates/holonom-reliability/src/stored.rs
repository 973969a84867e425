//! Numbers of a run in a file, from which the page is written; parts of one run are added.

use crate::text_file;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What a run gave.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stored<T> {
    /// Its seed.
    pub seed: u64,
    /// What it gave.
    pub found: T,
}

impl<T: Serialize + DeserializeOwned> Stored<T> {
    /// Writes it, whole or not at all.
    ///
    /// # Errors
    /// What cannot be written, in words.
    pub fn write(&self, path: &Path) -> Result<(), String> {
        let text = serde_json::to_string_pretty(self).map_err(|error| error.to_string())?;
        text_file::write(path, &text)
    }

    /// Reads files of one seed; `None` of no files.
    ///
    /// # Errors
    /// What cannot be read, in words.
    pub fn read_some(
        paths: &[&str],
        add: &mut dyn FnMut(&mut T, T),
    ) -> Result<Option<Self>, String> {
        let mut all: Option<Self> = None;
        for path in paths {
            let text = text_file::read(Path::new(path))?;
            let part: Self = serde_json::from_str(&text).map_err(|e| format!("{path}: {e}"))?;
            match &mut all {
                None => all = Some(part),
                Some(all) if all.seed == part.seed => add(&mut all.found, part.found),
                Some(_) => return Err(format!("{path} has another seed")),
            }
        }
        Ok(all)
    }
}
