//! Exceptions: they are defined in Python, so that they can be pickled.

use holonom::model::{LocatedProblem, ModelText, line_column};
use holonom::output::OutputError;
use holonom::run::ContinueError;
use holonom::{ModelError, Override};
use pyo3::exceptions::{PyRuntimeError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, TryLockError};

/// The path of a text that has no file.
pub(crate) const NO_FILE: &str = "<text>";

/// An exception of `holonom._errors` with these arguments.
pub(crate) fn raise<'py>(
    py: Python<'py>,
    class: &str,
    arguments: impl pyo3::call::PyCallArgs<'py>,
) -> PyErr {
    let made = || py.import("holonom._errors")?.getattr(class)?.call1(arguments);
    made().map_or_else(|error| error, PyErr::from_value)
}

/// An invalid model: every problem with its place and what to write instead.
pub(crate) fn invalid(
    py: Python<'_>,
    text: &ModelText,
    overrides: &[Override],
    error: &ModelError,
) -> PyErr {
    let made = || -> PyResult<PyErr> {
        let mut problems = Vec::new();
        for LocatedProblem { problem, file } in text.problems(error) {
            let entry = PyDict::new(py);
            let at = |key: &str| {
                let rest = problem.key.strip_prefix(key);
                rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
            };
            let set = overrides.iter().rev().find(|set| at(&set.key));
            let place = problem.span.as_ref().filter(|_| set.is_none());
            let place = place.map(|span| line_column(&file.text, span.start));
            entry.set_item("message", &problem.message)?;
            entry.set_item("key", &problem.key)?;
            entry.set_item("help", &problem.help)?;
            entry.set_item("file", shown(&file.path))?;
            entry.set_item("line", place.map(|place| place.line))?;
            entry.set_item("column", place.map(|place| place.column))?;
            entry.set_item("set", set.map(ToString::to_string))?;
            problems.push(entry);
        }
        Ok(raise(py, "InvalidModel", (problems,)))
    };
    made().unwrap_or_else(|error| error)
}

/// The path of a file; `None` for a text that has none.
fn shown(path: &Path) -> Option<String> {
    (path != Path::new(NO_FILE)).then(|| path.display().to_string())
}

/// A file that cannot be read or written.
pub(crate) fn output(py: Python<'_>, error: &OutputError) -> PyErr {
    let (words, remedy) = (error.to_string(), error.remedy().to_owned());
    match error {
        OutputError::Occupied { .. } | OutputError::Foreign { .. } => {
            raise(py, "OutputExists", (words, remedy))
        }
        _ => raise(py, "OutputFailed", (words, remedy)),
    }
}

/// A run that cannot be continued.
pub(crate) fn continued(py: Python<'_>, error: &ContinueError) -> PyErr {
    match error {
        ContinueError::Output(error) => output(py, error),
        ContinueError::State(error) => raise(py, "StateMismatch", (error.to_string(),)),
        other => PyRuntimeError::new_err(other.to_string()),
    }
}

/// JSON of a value, as an object of Python.
pub(crate) fn json<'py>(py: Python<'py>, value: &serde_json::Value) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (value.to_string(),))
}

/// What one call at a time may have; after a panic no other has it. `what`: in a word.
pub(crate) fn taken<'a, T>(of: &'a Mutex<T>, what: &str) -> PyResult<MutexGuard<'a, T>> {
    of.try_lock().map_err(|error| match error {
        TryLockError::WouldBlock => {
            PyRuntimeError::new_err(format!("this {what} is at work in another call"))
        }
        TryLockError::Poisoned(_) => Python::attach(|py| {
            let words = format!("this {what} panicked in an earlier call");
            let remedy = "make another one, and please report the panic with the model";
            raise(py, "InternalError", (words, remedy))
        }),
    })
}

/// A word that is none of those expected.
pub(crate) fn no_word(what: &str, word: &str, words: &[&str]) -> PyErr {
    PyTypeError::new_err(format!("{what}: `{word}` is none of {}", words.join(", ")))
}
