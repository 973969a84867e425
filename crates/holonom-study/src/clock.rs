//! Time of this thread.

use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};

/// What the clock counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Clock {
    /// CPU time of the thread.
    Cpu,
    /// Time that passes, where the system has no other.
    Wall,
}

#[cfg(unix)]
fn thread_time() -> Option<Duration> {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    Some(Duration::new(time.tv_sec.try_into().ok()?, time.tv_nsec.try_into().ok()?))
}

#[cfg(not(unix))]
fn thread_time() -> Option<Duration> {
    None
}

impl Clock {
    /// The clock of this system.
    #[must_use]
    pub fn available() -> Self {
        if thread_time().is_some() { Self::Cpu } else { Self::Wall }
    }
}

/// Seconds that `run` takes, with what it returns.
pub(crate) fn timed<T>(run: impl FnOnce() -> T) -> (f64, T) {
    let (begin, wall) = (thread_time(), Instant::now());
    let value = run();
    let seconds = match (begin, thread_time()) {
        (Some(begin), Some(end)) => (end.saturating_sub(begin)).as_secs_f64(),
        _ => wall.elapsed().as_secs_f64(),
    };
    (seconds, value)
}
