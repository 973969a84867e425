//! Work that is no longer wanted: solves of Newton's method are refused.
//!
//! An analysis solves again and again, deep within. Whoever waits for it runs it by [`during`], and
//! may raise the flag from another thread: it then comes to an end within the time of a solve. What
//! it returns is of no use. Work of other threads goes on.

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Calls of [`during`] in this process; without one nothing else is looked at.
static CALLS: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    static FLAG: RefCell<Option<Arc<AtomicBool>>> = const { RefCell::new(None) };
}

/// The flag of this thread before a call.
struct Before(Option<Arc<AtomicBool>>);

impl Drop for Before {
    fn drop(&mut self) {
        FLAG.set(self.0.take());
        CALLS.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Does `work` in this thread while it is wanted: until the flag is raised.
pub fn during<T>(flag: &Arc<AtomicBool>, work: impl FnOnce() -> T) -> T {
    CALLS.fetch_add(1, Ordering::Relaxed);
    let _before = Before(FLAG.replace(Some(flag.clone())));
    work()
}

/// Whether the work of this thread is no longer wanted.
#[must_use]
pub fn is_raised() -> bool {
    let raised = |flag: &Option<Arc<AtomicBool>>| {
        flag.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed))
    };
    CALLS.load(Ordering::Relaxed) > 0 && FLAG.with_borrow(raised)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flag_is_that_of_its_thread_and_of_its_call() {
        let (raised, other) = (Arc::new(AtomicBool::new(true)), Arc::new(AtomicBool::new(false)));
        assert!(!is_raised());
        during(&raised, || {
            assert!(is_raised());
            assert!(!during(&other, is_raised)); // the innermost call
            assert!(is_raised());
            assert!(!std::thread::scope(|scope| scope.spawn(is_raised).join().unwrap()));
        });
        assert!(!is_raised());
        let panics = std::panic::catch_unwind(|| during(&raised, || panic!("of the test")));
        assert!(panics.is_err() && !is_raised());
    }
}
