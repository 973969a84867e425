//! Ctrl-C and progress, while a run has released the interpreter.

use holonom::vi_core::interruption;
use pyo3::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How often Python is asked.
const PERIOD: Duration = Duration::from_millis(50);

/// Calls between two looks at the clock that are shorter than this are doubled.
const SHORT: Duration = Duration::from_micros(500);
/// The most of them.
const MOST_UNSEEN: u32 = 63;

/// Asks Python now and then whether to go on.
///
/// To read the clock takes a twentieth of a short step: several of these are taken for each look.
pub(crate) struct Watch {
    progress: Option<Py<PyAny>>,
    next: Instant,
    looked: Instant,
    unseen: u32, // calls between two looks
    left: u32,   // of them
    stopped: Option<PyErr>,
}

impl Watch {
    /// Asks for the first time at once where there is a `progress`.
    pub(crate) fn new(progress: Option<Py<PyAny>>) -> Self {
        let now = Instant::now();
        let next = if progress.is_some() { now } else { now + PERIOD };
        Self { progress, next, looked: now, unseen: 0, left: 0, stopped: None }
    }

    /// Whether to go on, after `step` of `of` steps.
    pub(crate) fn proceed(&mut self, step: u64, of: u64) -> bool {
        if self.stopped.is_some() {
            return false;
        }
        let is_last = step >= of && self.progress.is_some();
        if self.left > 0 && !is_last {
            self.left -= 1;
            return true;
        }
        let now = Instant::now();
        let is_short = now.duration_since(self.looked) < SHORT;
        self.unseen = if is_short { (2 * self.unseen + 1).min(MOST_UNSEEN) } else { 0 };
        (self.looked, self.left) = (now, self.unseen);
        if now < self.next && !is_last {
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
