//! What is collected of a call within another process, and how long it may last.

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// What a call gave.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Called {
    /// The exit code.
    pub code: u8,
    /// What it printed on standard output.
    pub output: Vec<u8>,
    /// What it printed on standard error.
    pub error: Vec<u8>,
}

/// What is collected of the call of this thread.
struct Captured {
    called: Called,
    patience: u64,
}

thread_local! {
    static CAPTURED: RefCell<Option<Captured>> = const { RefCell::new(None) };
}

/// Collects what `work` prints in this thread; it gives the exit code.
pub(crate) fn capture(patience: u64, work: impl FnOnce() -> u8) -> Called {
    CAPTURED.set(Some(Captured { called: Called::default(), patience }));
    let code = work();
    let captured = CAPTURED.take();
    Called { code, ..captured.map(|captured| captured.called).unwrap_or_default() }
}

/// One of the two streams.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stream {
    Output,
    Error,
}

/// Whether the call of this thread is captured.
pub(crate) fn is_captured() -> bool {
    CAPTURED.with_borrow(Option::is_some)
}

/// Collects what a captured call prints; whether it is one.
pub(crate) fn take(stream: Stream, bytes: &[u8]) -> bool {
    CAPTURED.with_borrow_mut(|captured| {
        let Some(Captured { called, .. }) = captured else { return false };
        match stream {
            Stream::Output => called.output.extend_from_slice(bytes),
            Stream::Error => called.error.extend_from_slice(bytes),
        }
        true
    })
}

/// How often a captured call may still ask whether it is interrupted, in all its threads.
#[derive(Clone, Debug)]
pub(crate) struct Patience(Arc<AtomicU64>);

impl Patience {
    /// Counts a question; whether it was one too many.
    pub(crate) fn ends(&self) -> bool {
        let less = |left: u64| left.checked_sub(1);
        self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, less).is_err()
    }
}

/// The patience of the call of this thread, if it is captured.
pub(crate) fn patience() -> Option<Patience> {
    CAPTURED.with_borrow(|captured| {
        captured.as_ref().map(|captured| Patience(Arc::new(AtomicU64::new(captured.patience))))
    })
}
