//! What a function of Python raised within a step.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::errors::raise;
use pyo3::prelude::*;

/// What a function of Python raised, until it is told.
#[derive(Debug, Default)]
pub(crate) struct PythonFault {
    is_set: AtomicBool,
    error: Mutex<Option<PyErr>>,
}

impl PythonFault {
    /// Whether there is one.
    pub(crate) fn is_set(&self) -> bool {
        self.is_set.load(Ordering::Relaxed)
    }

    /// Keeps the first.
    pub(crate) fn set(&self, error: PyErr) {
        let mut own = self.error.lock().unwrap_or_else(PoisonError::into_inner);
        own.get_or_insert(error);
        self.is_set.store(true, Ordering::Relaxed);
    }

    /// Raises it, once.
    pub(crate) fn told(&self) -> PyResult<()> {
        if !self.is_set() {
            return Ok(());
        }
        self.is_set.store(false, Ordering::Relaxed);
        let error = self.error.lock().unwrap_or_else(PoisonError::into_inner).take();
        error.map_or(Ok(()), Err)
    }

    /// Its words.
    pub(crate) fn words(&self) -> Option<String> {
        let own = self.error.lock().unwrap_or_else(PoisonError::into_inner);
        own.as_ref().map(ToString::to_string)
    }

    /// Calls a function for numbers, which have to be finite; not a number after a fault.
    /// `arguments` says with which.
    pub(crate) fn guard<const N: usize>(
        &self,
        label: &str,
        arguments: impl Fn() -> String,
        call: impl FnOnce(Python<'_>) -> PyResult<[f64; N]>,
    ) -> [f64; N] {
        if self.is_set() {
            return [f64::NAN; N];
        }
        Python::attach(|py| match call(py) {
            Ok(found) if found.iter().all(|value| value.is_finite()) => found,
            Ok(found) => {
                let words = format!("{label} gave {found:?} at {}", arguments());
                let remedy =
                    "let it be finite for all arguments, those of Newton's iterates included";
                self.set(raise(py, "FunctionFailed", (words, remedy)));
                [f64::NAN; N]
            }
            Err(error) => {
                let note = format!("in {label} at {}", arguments());
                let _ = error.value(py).call_method1("add_note", (note,)); // an exception has it
                self.set(error);
                [f64::NAN; N]
            }
        })
    }
}
