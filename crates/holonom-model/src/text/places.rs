//! Places in the text of a model: of key paths, and of what is wrong.

use std::ops::Range;

use super::problem::{ModelError, Problem};
use super::source::Document;

/// The place of a key path in a text; `None` when the text cannot be parsed or has no such key.
#[must_use]
pub fn locate(text: &str, path: &str) -> Option<Range<usize>> {
    Document::parse(text, &[], &[]).ok()?.span(path)
}

/// A place in a text, as an editor shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineColumn {
    /// The line, from 1.
    pub line: usize,
    /// The character of the line, from 1.
    pub column: usize,
}

/// Line and column of a byte of a text.
#[must_use]
pub fn line_column(text: &str, offset: usize) -> LineColumn {
    let mut offset = offset.min(text.len());
    while !text.is_char_boundary(offset) {
        offset -= 1;
    }
    let before = &text[..offset];
    let start = before.rfind('\n').map_or(0, |i| i + 1);
    let line = before.matches('\n').count() + 1;
    LineColumn { line, column: before[start..].chars().count() + 1 }
}

impl ModelError {
    /// Everything that is wrong, one by one; spans are found in `text`, the model as it was read.
    #[must_use]
    pub fn problems(&self, text: &str) -> Vec<Problem> {
        let located = |problem: Problem| {
            let span = locate(text, &problem.key);
            problem.at(span)
        };
        match self {
            Self::Invalid(problems) => problems.clone(),
            Self::Assembly(problems) => problems.iter().cloned().map(located).collect(),
            Self::InconsistentStart(all) => all.iter().map(|i| located(i.problem())).collect(),
            Self::Unreadable { .. } => vec![
                Problem::new("", self.to_string())
                    .help("name a model file; `holonom examples` lists the shipped models"),
            ],
            Self::TooLarge { .. } => vec![
                Problem::new("", self.to_string())
                    .help("a model file describes the system only; is this the right file?"),
            ],
            Self::NotUtf8 { .. } => {
                vec![Problem::new("", self.to_string()).help("save the file as UTF-8")]
            }
            Self::SingularMass { member, .. } => vec![located(
                Problem::new(member.clone(), self.to_string())
                    .help("give it inertia about that axis, or a joint that fixes this motion"),
            )],
            Self::Unsupported { key, what, help } => {
                let message = format!("not supported: {what}");
                vec![located(Problem::new(key.clone(), message).help(help.clone()))]
            }
        }
    }
}
