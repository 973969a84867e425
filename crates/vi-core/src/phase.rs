//! Which part of a step is under way: marks for whoever measures where the time goes.
//!
//! ```text
//! Other      what is outside Newton's method
//! Residual   evaluations of the equations
//! Assembly   Newton matrices, null spaces, multipliers: everything in a correction but the next
//! Solve      factorizations and solutions of linear systems
//! ```
//! The libraries know no clock: an observer is told of every change. Without one a mark costs two loads.

use std::cell::Cell;

/// A part of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Phase {
    /// Outside Newton's method.
    #[default]
    Other,
    /// Evaluations of the equations.
    Residual,
    /// Newton matrices with all that goes into them.
    Assembly,
    /// Linear systems.
    Solve,
}

/// Told of the part that begins; the one before it has ended.
pub type Observer = fn(Phase);

thread_local! {
    static OBSERVER: Cell<Option<Observer>> = const { Cell::new(None) };
    static CURRENT: Cell<Phase> = const { Cell::new(Phase::Other) };
}

/// Sets the observer of this thread, or removes it.
pub fn observe(observer: Option<Observer>) {
    OBSERVER.set(observer);
    CURRENT.set(Phase::Other);
}

/// Runs a part of a step.
pub fn within<T>(phase: Phase, run: impl FnOnce() -> T) -> T {
    let Some(observer) = OBSERVER.get() else { return run() };
    let before = CURRENT.replace(phase);
    observer(phase);
    let value = run();
    CURRENT.set(before);
    observer(before);
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    thread_local! {
        static SEEN: Cell<[usize; 4]> = const { Cell::new([0; 4]) };
    }

    fn count(phase: Phase) {
        let mut seen = SEEN.get();
        seen[phase as usize] += 1;
        SEEN.set(seen);
    }

    #[test]
    fn parts_nest_and_end() {
        let work = || within(Phase::Assembly, || within(Phase::Solve, || 7));
        assert_eq!(work(), 7);
        assert_eq!(SEEN.get(), [0; 4], "nobody listens");
        observe(Some(count));
        assert_eq!(work(), 7);
        observe(None);
        assert_eq!(work(), 7);
        assert_eq!(SEEN.get(), [1, 0, 2, 1], "assembly, solve, assembly, other");
    }
}
