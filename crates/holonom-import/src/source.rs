//! Files that are read, places in them, and what is wrong there.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use holonom_model::{LineColumn, Problem, read_text};

use crate::ImportError;

/// A place in one of the files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FilePlace {
    /// Which file, counted from 0.
    pub(crate) file: usize,
    /// Its bytes.
    pub(crate) span: Range<usize>,
}

/// What makes a translation impossible: where, what, what instead.
#[derive(Clone, Debug)]
pub(crate) struct Refusal {
    place: Option<FilePlace>,
    message: String,
    help: String,
}

/// Either a value or what is wrong.
pub(crate) type Result<T> = std::result::Result<T, Refusal>;

impl Refusal {
    /// A fault at a place.
    pub(crate) fn at(
        place: &FilePlace,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        Self { place: Some(place.clone()), message: message.into(), help: help.into() }
    }

    /// What is wrong.
    pub(crate) fn message(&self) -> &str {
        &self.message
    }

    /// A fault of the description as a whole.
    pub(crate) fn of_all(message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { place: None, message: message.into(), help: help.into() }
    }
}

/// A file that was read.
#[derive(Debug)]
pub(crate) struct SourceText {
    pub(crate) path: PathBuf,
    pub(crate) text: String,
}

/// All files of a description; the first is the one that was named.
#[derive(Debug, Default)]
pub(crate) struct ImportSources {
    pub(crate) files: Vec<SourceText>,
}

impl ImportSources {
    /// Reads another file; its number.
    pub(crate) fn read(&mut self, path: &Path) -> std::result::Result<usize, ImportError> {
        let text = read_text(path)
            .map_err(|source| ImportError::Read { path: path.to_owned(), source })?;
        Ok(self.add(path, text))
    }

    /// Adds the text of a file; its number.
    pub(crate) fn add(&mut self, path: &Path, text: String) -> usize {
        self.files.push(SourceText { path: path.to_owned(), text });
        self.files.len() - 1
    }

    /// The name of a file in messages.
    pub(crate) fn name(&self, file: usize) -> String {
        self.files[file].path.display().to_string()
    }

    /// Lines and columns (from 1) of the begins of places, by file and byte; the texts are passed
    /// once.
    pub(crate) fn positions<'a>(
        &self,
        places: impl Iterator<Item = &'a FilePlace>,
    ) -> BTreeMap<(usize, usize), LineColumn> {
        let start = LineColumn { line: 1, column: 1 };
        let mut positions: BTreeMap<_, _> =
            places.map(|place| ((place.file, place.span.start), start)).collect();
        let (mut file, mut passed, mut at) = (0, 0, start);
        for ((of, byte), position) in &mut positions {
            if *of != file {
                (file, passed, at) = (*of, 0, start);
            }
            for c in self.files[file].text.get(passed..*byte).unwrap_or_default().chars() {
                (at.line, at.column) =
                    if c == '\n' { (at.line + 1, 1) } else { (at.line, at.column + 1) };
            }
            (passed, *position) = (*byte, at);
        }
        positions
    }

    /// These faults as an error: those of one file, with its text.
    pub(crate) fn error(&self, faults: &[Refusal]) -> ImportError {
        let file = faults.iter().find_map(|f| f.place.as_ref()).map_or(0, |place| place.file);
        let source = self.files.get(file);
        let here = |fault: &&Refusal| fault.place.as_ref().is_none_or(|place| place.file == file);
        let problem = |fault: &Refusal| {
            let span = fault.place.as_ref().map(|place| place.span.clone());
            Problem::new("", fault.message.clone()).help(fault.help.clone()).at(span)
        };
        ImportError::Invalid {
            path: source.map(|s| s.path.clone()).unwrap_or_default(),
            text: source.map(|s| s.text.clone()).unwrap_or_default(),
            problems: faults.iter().filter(here).map(problem).collect(),
        }
    }
}
