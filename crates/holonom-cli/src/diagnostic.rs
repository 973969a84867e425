//! Invalid models, shown with the lines concerned.

use std::io::IsTerminal;
use std::ops::Range;
use std::path::{Path, PathBuf};

use holonom::model::{LineColumn, LocatedProblem, MAX_PROBLEMS, ModelText, Problem, line_column};
use holonom::{ModelError, Override};
use miette::{
    Diagnostic, GraphicalReportHandler, GraphicalTheme, LabeledSpan, NamedSource, SourceCode,
};
use serde_json::{Value, json};

use crate::stderr::{self, visible, visible_in_place};

/// Characters of a message, which may quote the file, and of a help, which may list names of it.
const WORDS: usize = 400;
const HELP: usize = 1000;

/// One problem, for miette.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
struct ShownProblem {
    message: String,
    label: String,
    span: Option<Range<usize>>,
    source_code: NamedSource<String>,
    help: Option<String>,
}

impl Diagnostic for ShownProblem {
    fn help<'a>(&'a self) -> Option<Box<dyn std::fmt::Display + 'a>> {
        self.help.as_ref().map(|h| Box::new(h) as Box<dyn std::fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.span.as_ref().map(|_| &self.source_code as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let span = self.span.clone()?;
        let label = LabeledSpan::new_with_span(Some(self.label.clone()), span);
        Some(Box::new(std::iter::once(label)))
    }
}

/// An invalid model with all that is needed to show why.
#[derive(Debug)]
pub(crate) struct InvalidModel {
    pub(crate) path: PathBuf,
    pub(crate) text: ModelText,
    pub(crate) overrides: Vec<Override>,
    pub(crate) error: ModelError,
}

impl InvalidModel {
    /// All problems with their files; those of replaced values do not point into a file.
    fn problems(&self) -> Vec<LocatedProblem<'_>> {
        let mut problems = self.text.problems(&self.error);
        for LocatedProblem { problem, .. } in &mut problems {
            let rest = |key: &str| problem.key.strip_prefix(key).map(str::to_owned);
            let at =
                |key: &str| rest(key).is_some_and(|r| r.is_empty() || r.starts_with(['.', '[']));
            if let Some(found) = self.overrides.iter().rev().find(|o| at(&o.key)) {
                problem.span = None;
                problem.message += &format!(" (set on the command line: {found})");
            }
        }
        problems
    }

    /// Prints the problems on standard error.
    pub(crate) fn print(&self) {
        let problems = self.problems();
        let each = problems.iter().map(|LocatedProblem { problem, file }| {
            (file.path.as_path(), file.text.as_str(), problem)
        });
        let verdict = match &self.error {
            ModelError::Unreadable { .. }
            | ModelError::TooLarge { .. }
            | ModelError::NotUtf8 { .. } => "cannot be read",
            _ => "is not a valid model",
        };
        print_each(&self.path, each, verdict);
    }

    /// The problems for machines; one of an included file names it.
    pub(crate) fn to_json(&self) -> Value {
        let problem = |LocatedProblem { problem, file }: &LocatedProblem<'_>| {
            let mut entry = entry(&file.text, problem);
            if file.path != self.path {
                entry["file"] = file.path.display().to_string().into();
            }
            entry
        };
        invalid(&self.path, self.problems().iter().map(problem).collect())
    }
}

/// Prints problems of a text on standard error, and a line that ends with a verdict.
pub(crate) fn print(path: &Path, text: &str, problems: &[Problem], verdict: &str) {
    print_each(path, problems.iter().map(|problem| (path, text, problem)), verdict);
}

/// Prints problems, each with the path and the text of its file.
fn print_each<'a>(
    path: &Path,
    problems: impl ExactSizeIterator<Item = (&'a Path, &'a str, &'a Problem)>,
    verdict: &str,
) {
    let handler = GraphicalReportHandler::new_themed(theme()).with_width(width());
    let (mut out, count) = (String::new(), problems.len());
    for (file, text, problem) in problems {
        let name = file.display().to_string();
        if handler.render_report(&mut out, &shown(&name, text, problem)).is_err() {
            out += &visible(&format!("{name}: {problem}\n"));
        }
        out.push('\n');
    }
    let plural = match count {
        1 => "",
        MAX_PROBLEMS => "s or more",
        _ => "s",
    };
    stderr::styled(&out);
    let name = path.display();
    stderr::line(&format!("error: {name} {verdict}: {count} problem{plural}, nothing written"));
}

/// Problems of a text for machines.
pub(crate) fn to_json(path: &Path, text: &str, problems: &[Problem]) -> Value {
    invalid(path, problems.iter().map(|problem| entry(text, problem)).collect())
}

fn entry(text: &str, problem: &Problem) -> Value {
    let place = problem.span.as_ref().map(|s| line_column(text, s.start));
    json!({
        "message": problem.message, "key": problem.key, "help": problem.help,
        "line": place.map(|p| p.line), "column": place.map(|p| p.column),
    })
}

fn invalid(path: &Path, problems: Vec<Value>) -> Value {
    json!({ "valid": false, "file": path.display().to_string(), "problems": problems })
}

fn shown(name: &str, text: &str, problem: &Problem) -> ShownProblem {
    let frame = problem.span.clone().map(|span| first_line(text, span)).filter(|s| fits(text, s));
    let place = match (&frame, &problem.span) {
        (Some(_), _) => String::new(),
        (None, Some(span)) => {
            let LineColumn { line, column } = line_column(text, span.start);
            format!("{name}:{line}:{column}: ")
        }
        (None, None) => format!("{name}: "),
    };
    let source = if frame.is_some() { visible_in_place(text) } else { String::new() };
    ShownProblem {
        message: visible(&place).into_owned() + &clipped(&problem.to_string(), WORDS),
        label: if problem.key.is_empty() { "here".into() } else { clipped(&problem.key, WORDS) },
        source_code: NamedSource::new(visible(name), source),
        span: frame,
        help: problem.help.as_deref().map(|help| clipped(help, HELP)),
    }
}

/// A long value (a section, a table) is marked by its first line only.
fn first_line(text: &str, span: Range<usize>) -> Range<usize> {
    let length = text.get(span.clone()).map_or(0, |t| t.lines().next().unwrap_or(t).len());
    span.start..span.start + length
}

/// Whether the lines around a span can be shown.
fn fits(text: &str, span: &Range<usize>) -> bool {
    let line = line_column(text, span.start).line;
    text.lines().skip(line.saturating_sub(2)).take(3).all(|l| l.len() < 400)
}

/// Words of bearable length, none of them a command to the terminal.
fn clipped(words: &str, most: usize) -> String {
    let words = &*visible(words);
    match words.char_indices().nth(most) {
        Some((end, _)) => format!("{}…", &words[..end]),
        None => words.to_owned(),
    }
}

/// Colours on a terminal that wants them, else plain characters.
fn theme() -> GraphicalTheme {
    let plain = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
    if std::io::stderr().is_terminal() && !plain {
        GraphicalTheme::unicode()
    } else {
        GraphicalTheme::unicode_nocolor()
    }
}

fn width() -> usize {
    let columns = std::env::var("COLUMNS").ok().and_then(|c| c.parse::<usize>().ok());
    columns.unwrap_or(100).clamp(60, 120)
}
