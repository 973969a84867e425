//! Ctrl-C and progress, while a run has released the interpreter.

use holonom::vi_core::interruption;
use pyo3::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How often Python is asked.
const PERIOD: Duration = Duration::from_millis(50);

/// Asks Python now and then whether to go on.
pub(crate) struct Watch {
    progress: Option<Py<PyAny>>,
    next: Instant,
    stopped: Option<PyErr>,
}

impl Watch {
    pub(crate) fn new(progress: Option<Py<PyAny>>) -> Self {
        Self { progress, next: Instant::now() + PERIOD, stopped: None }
    }

    /// Whether to go on, after `step` of `of` steps.
    pub(crate) fn proceed(&mut self, step: u64, of: u64) -> bool {
        if self.stopped.is_some() {
            return false;
        }
        let now = Instant::now();
        if now < self.next && (step < of || self.progress.is_none()) {
            return true;
        }
        self.next = now + PERIOD;
        let asked = Python::attach(|py| {
            py.check_signals()?;
            self.progress.as_ref().map_or(Ok(()), |told| told.call1(py, (step, of)).map(drop))
        });
        self.stopped = asked.err();
        self.stopped.is_none()
    }

    /// What stopped the run.
    pub(crate) fn stopped(self) -> PyResult<()> {
        self.stopped.map_or(Ok(()), Err)
    }
}

/// What ends an analysis in another thread.
#[pyclass(frozen, module = "holonom._core")]
pub(crate) struct Interruption(Arc<AtomicBool>);

#[pymethods]
impl Interruption {
    #[new]
    fn new() -> Self {
        Self(Arc::default())
    }

    /// Calls a function in this thread; its solves are refused from [`Interruption::ask`] on.
    fn during(&self, py: Python<'_>, function: Py<PyAny>) -> PyResult<Py<PyAny>> {
        interruption::during(&self.0, || function.call0(py))
    }

    /// The work is no longer wanted.
    fn ask(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}
