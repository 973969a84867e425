//! Results of a run in the formats of other programs, made from the files of its folder.
//!
//! | format | file | read by |
//! |---|---|---|
//! | [`Format::Npz`] | `.npz` | `numpy.load` |
//!
//! Numbers are those of the folder, bit for bit.
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod npz;
mod table;

use holonom_sim::output::{RunFolder, atomically};
use std::path::{Path, PathBuf};
use table::Results;

/// A format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Arrays for NumPy, not compressed.
    Npz,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 1] = [Self::Npz];

    /// The name, which is the extension of its files too.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Npz => "npz",
        }
    }

    /// What it is, in a line.
    #[must_use]
    pub fn about(self) -> &'static str {
        match self {
            Self::Npz => "arrays for NumPy: data = numpy.load(\"FILE.npz\")",
        }
    }
}

/// Why nothing is exported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// A file of the run cannot be read.
    #[error("{}: {message}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        message: String,
    },
    /// The result cannot be written.
    #[error("{}: {message}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        message: String,
    },
}

/// Writes the results of a folder to a file, whole or not at all.
///
/// # Errors
/// [`ExportError`].
pub fn export(folder: &RunFolder, format: Format, to: &Path) -> Result<(), ExportError> {
    let results = Results::read(folder)?;
    let written = atomically(to, |file| match format {
        Format::Npz => npz::write(&results, file),
    });
    written.map_err(|e| ExportError::Write { path: to.to_owned(), message: e.to_string() })
}
