//! What could not be translated, or was translated in another form.

use std::collections::BTreeMap;

use holonom_model::LineColumn;
use serde::Serialize;

use crate::source::{FilePlace, ImportSources};

/// One thing that the model file does not have, or has in another form.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Remark {
    /// What it is, in words.
    pub message: String,
    /// The elements concerned; empty where it concerns the description as a whole.
    pub elements: Vec<Mention>,
}

/// An element of the description and its place.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Mention {
    /// Kind and name: `geom "floor"`.
    pub element: String,
    /// The file.
    pub file: String,
    /// Its line, from 1.
    pub line: usize,
    /// Its column, from 1.
    pub column: usize,
}

/// Limits of this size are none, m, rad or degrees.
pub(crate) const FAR: f64 = 1e6;

/// On limits of joints with several coordinates.
pub(crate) const LIMITS_OF_SEVERAL: &str =
    "limits of joints with several coordinates: not translated";

/// On limits that leave nothing.
pub(crate) const EMPTY_LIMITS: &str =
    "limits of joints: the lower one is not below the upper one; not translated";

/// On limits that do not hold at the start.
pub(crate) const LIMITS_AT_START: &str = "limits of joints: the initial configuration is outside of them; not translated, `--joint NAME=VALUE` states another initial value";

/// On dry friction in joints with several coordinates.
pub(crate) const FRICTION_OF_SEVERAL: &str =
    "dry friction of joints with several coordinates: not translated";

/// Elements that a line of text names.
pub(crate) const NAMED: usize = 6;

impl std::fmt::Display for Remark {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.message)?;
        let named = |m: &Mention| format!("{} (line {})", m.element, m.line);
        let list: Vec<String> = self.elements.iter().take(NAMED).map(named).collect();
        if !list.is_empty() {
            write!(f, ": {}", list.join(", "))?;
        }
        if self.elements.len() > NAMED {
            write!(f, ", … ({} in all)", self.elements.len())?;
        }
        Ok(())
    }
}

/// Remarks while a description is read, one for each message.
#[derive(Debug, Default)]
pub(crate) struct Remarks {
    list: Vec<(String, Vec<(String, FilePlace)>)>,
    /// Where each message stands in the list.
    known: BTreeMap<String, usize>,
}

impl Remarks {
    /// A remark on what has this label and this place.
    pub(crate) fn mention(&mut self, message: impl Into<String>, label: String, place: &FilePlace) {
        let elements = self.elements(message.into());
        elements.push((label, place.clone()));
    }

    /// A remark on the description as a whole.
    pub(crate) fn of_all(&mut self, message: impl Into<String>) {
        self.elements(message.into());
    }

    fn elements(&mut self, message: String) -> &mut Vec<(String, FilePlace)> {
        let next = self.list.len();
        let at = *self.known.entry(message.clone()).or_insert(next);
        if at == next {
            self.list.push((message, Vec::new()));
        }
        &mut self.list[at].1
    }

    /// The remarks with files, lines and columns.
    pub(crate) fn located(self, sources: &ImportSources) -> Vec<Remark> {
        let places = self.list.iter().flat_map(|(_, elements)| elements).map(|(_, place)| place);
        let positions = sources.positions(places);
        let mention = |(element, place): (String, FilePlace)| {
            let LineColumn { line, column } = positions[&(place.file, place.span.start)];
            Mention { element, file: sources.name(place.file), line, column }
        };
        let remark = |(message, elements): (String, Vec<_>)| Remark {
            message,
            elements: elements.into_iter().map(mention).collect(),
        };
        self.list.into_iter().map(remark).collect()
    }
}
