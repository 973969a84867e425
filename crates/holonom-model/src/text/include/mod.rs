//! `include`: a model in several files, merged into one text.
//!
//! ```text
//! files ── Tree (one branch for each entry of `include`) ── merged text, with the places its values come from ── Model
//! ```
//! Names and parameters of an included file get the prefix that the entry states; names that the
//! file does not define are those of the including file. A place of the entry becomes a `[[frame]]`
//! in which the parts of the file are stated.

mod merge;
mod scope;
mod tree;
pub(super) mod writer;

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::problem::{ModelError, Problem};
use crate::{Meshes, Model, Override, read_text};
use tree::IncludeTree;
use writer::TextPiece;

/// The key.
pub(crate) const KEY: &str = "include";

/// The key in the JSON schema.
pub(crate) fn schema() -> serde_json::Value {
    let three = |about: &str| {
        let number = serde_json::json!({ "type": ["number", "string"] });
        serde_json::json!({
            "description": about, "type": "array", "items": number, "minItems": 3, "maxItems": 3,
        })
    };
    serde_json::json!({
        "description": "Files whose parts are added to the model; their [model] and [simulation] are not used.",
        "type": "array",
        "items": { "anyOf": [{ "type": "string" }, {
            "type": "object",
            "additionalProperties": false,
            "required": ["file"],
            "properties": {
                "file": { "description": "The file, relative to the directory of this one.", "type": "string" },
                "prefix": {
                    "description": "Stands before all names and parameters of the file.",
                    "type": "string", "default": "",
                },
                "parameters": {
                    "description": "Values for parameters of the file, instead of its own.",
                    "type": "object",
                    "additionalProperties": { "type": ["number", "string"] },
                },
                "relative_to": {
                    "description": "The frame in which the file is placed: a body, a node of a beam, a joint or a `[[frame]]`.",
                    "type": "string",
                },
                "position": three("Where the origin of the file is placed, m."),
                "quaternion": {
                    "description": "Orientation as a unit quaternion `[w, x, y, z]`.", "type": "array",
                    "items": { "type": ["number", "string"] }, "minItems": 4, "maxItems": 4,
                },
                "rotation_vector": three("Orientation as a rotation vector, rad."),
                "matrix": {
                    "description": "Orientation as a rotation matrix, rows.", "type": "array",
                    "items": three("A row."), "minItems": 3, "maxItems": 3,
                },
                "euler": { "$ref": "#/$defs/Euler" },
            },
        }]},
    })
}

/// A file of a model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceFile {
    /// Its path, as it was found.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
}

/// Something that is wrong, and where.
#[derive(Clone, Debug)]
pub struct LocatedProblem<'a> {
    /// What is wrong; its span is a place in `file`.
    pub problem: Problem,
    /// The file.
    pub file: &'a SourceFile,
}

/// The text of a model file, with those of the files that it includes.
#[derive(Clone, Debug)]
pub struct ModelText {
    files: Vec<SourceFile>,
    merged: String,
    pieces: Vec<TextPiece>,
    fault: Option<ModelError>,
    /// Problems of the files, with the number of the file.
    problems: Vec<(usize, Problem)>,
}

impl ModelText {
    /// Reads a model file and all files that it includes; what is wrong with them is kept for
    /// [`Self::text`].
    #[must_use]
    pub fn read(path: &Path) -> Self {
        match read_text(path) {
            Ok(text) => Self::of(SourceFile { path: path.to_owned(), text }),
            Err(error) => {
                let files = vec![SourceFile { path: path.to_owned(), text: String::new() }];
                Self { fault: Some(error), ..Self::alone(files) }
            }
        }
    }

    /// The same of a text that is at hand; what it includes is looked for beside `path`.
    #[must_use]
    pub fn from_text(path: &Path, text: impl Into<String>) -> Self {
        Self::of(SourceFile { path: path.to_owned(), text: text.into() })
    }

    fn of(file: SourceFile) -> Self {
        let mut problems = Vec::new();
        let Some(tree) = IncludeTree::read(&file, &mut problems) else {
            return Self::alone(vec![file]);
        };
        let merged = problems.is_empty().then(|| merge::merge(&tree, &mut problems)).flatten();
        let fault = (!problems.is_empty())
            .then(|| ModelError::Invalid(problems.iter().map(|(_, p)| p.clone()).collect()));
        let (merged, pieces) = merged.map_or_else(Default::default, |out| (out.text, out.pieces));
        Self { files: tree.files, merged, pieces, fault, problems }
    }

    /// A single file.
    fn alone(files: Vec<SourceFile>) -> Self {
        Self { files, merged: String::new(), pieces: Vec::new(), fault: None, problems: Vec::new() }
    }

    /// The text of the model: that of the file, or of all files merged.
    ///
    /// # Errors
    /// [`ModelError`]: a file cannot be read, or does not fit the others.
    pub fn text(&self) -> Result<&str, ModelError> {
        match &self.fault {
            Some(fault) => Err(fault.clone()),
            None => Ok(self.plain()),
        }
    }

    fn plain(&self) -> &str {
        if self.pieces.is_empty() { &self.files[0].text } else { &self.merged }
    }

    /// The model, with values replaced as by [`Model::from_toml_with`]; meshes are looked for
    /// beside the file that names them.
    ///
    /// # Errors
    /// [`ModelError`].
    pub fn model(&self, overrides: &[Override]) -> Result<Model, ModelError> {
        Model::from_toml_in(self.text()?, overrides, Meshes::beside(&self.files[0].path))
    }

    /// The model as it is stated: parts are relative to their frames, and what the text leaves open
    /// is open.
    ///
    /// # Errors
    /// [`ModelError`].
    pub fn stated(&self, overrides: &[Override]) -> Result<Model, ModelError> {
        Model::stated_in(self.text()?, overrides)
    }

    /// Everything that is wrong, one by one, each with its file.
    #[must_use]
    pub fn problems(&self, error: &ModelError) -> Vec<LocatedProblem<'_>> {
        if !self.problems.is_empty() {
            return self.once(self.problems.clone());
        }
        let located = |mut problem: Problem| {
            let place = problem.span.take().and_then(|span| self.place(span));
            let file = place.as_ref().map_or(0, |(file, _)| *file);
            problem.span = place.map(|(_, span)| span);
            (file, problem)
        };
        self.once(error.problems(self.plain()).into_iter().map(located).collect())
    }

    /// One problem for each place: a file that is included several times has the same one each
    /// time.
    fn once(&self, problems: Vec<(usize, Problem)>) -> Vec<LocatedProblem<'_>> {
        let mut places = BTreeSet::new();
        let mut first = |file: usize, problem: &Problem| {
            let place = problem.span.as_ref().filter(|_| file > 0);
            place.is_none_or(|span| places.insert((file, span.start, span.end)))
        };
        let once = problems.into_iter().filter(|(file, problem)| first(*file, problem));
        once.map(|(file, problem)| LocatedProblem { problem, file: &self.files[file] }).collect()
    }

    /// The file, and the place in it, of a place in the text of the model.
    fn place(&self, span: Range<usize>) -> Option<(usize, Range<usize>)> {
        if self.pieces.is_empty() {
            return Some((0, span));
        }
        let around = |piece: &&TextPiece| {
            piece.merged.start <= span.start && span.start < piece.merged.end.max(span.start + 1)
        };
        let fits = |piece: &&TextPiece| piece.merged.end >= span.end;
        let around: Vec<&TextPiece> = self.pieces.iter().filter(around).collect();
        let size = |piece: &&&TextPiece| piece.merged.len();
        let best = around.iter().filter(|piece| fits(piece)).min_by_key(size);
        let best = best.or_else(|| around.iter().min_by_key(size))?;
        Some((best.file, best.place.clone()))
    }
}
