//! Time of this thread, and where it goes within a step.

use serde::{Deserialize, Serialize};
use std::cell::Cell;
use std::time::{Duration, Instant};
use vi_core::phase::{self, Phase};

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
pub(super) fn timed<T>(run: impl FnOnce() -> T) -> (f64, T) {
    let (begin, wall) = (thread_time(), Instant::now());
    let value = run();
    let seconds = match (begin, thread_time()) {
        (Some(begin), Some(end)) => (end.saturating_sub(begin)).as_secs_f64(),
        _ => wall.elapsed().as_secs_f64(),
    };
    (seconds, value)
}

/// Parts of the time of a step; they sum to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Shares {
    /// Evaluations of the equations.
    pub residual: f64,
    /// Newton matrices with null spaces and multipliers.
    pub assembly: f64,
    /// Factorizations and solutions of linear systems.
    pub solve: f64,
    /// The rest.
    pub other: f64,
}

thread_local! {
    static SPENT: Cell<([Duration; 4], usize)> = const { Cell::new(([Duration::ZERO; 4], 0)) };
    static SINCE: Cell<Option<Instant>> = const { Cell::new(None) };
}

fn mark(next: Phase) {
    let now = Instant::now();
    let (mut spent, current) = SPENT.get();
    if let Some(since) = SINCE.get() {
        spent[current] += now - since;
    }
    SPENT.set((spent, next as usize));
    SINCE.set(Some(now));
}

/// Seconds that `run` spends in each phase.
pub(super) fn phases<T>(run: impl FnOnce() -> T) -> ([f64; 4], T) {
    SPENT.set(([Duration::ZERO; 4], Phase::Other as usize));
    SINCE.set(Some(Instant::now()));
    phase::observe(Some(mark));
    let value = run();
    mark(Phase::Other);
    phase::observe(None);
    (SPENT.get().0.map(|spent| spent.as_secs_f64()), value)
}

impl Shares {
    /// Of the least that was spent in each phase: what interrupts a run only adds.
    pub(super) fn of_least(windows: &[[f64; 4]]) -> Option<Self> {
        let least = |phase: Phase| windows.iter().map(|w| w[phase as usize]).reduce(f64::min);
        let [residual, assembly, solve, other] = [
            least(Phase::Residual)?,
            least(Phase::Assembly)?,
            least(Phase::Solve)?,
            least(Phase::Other)?,
        ];
        let total = (residual + assembly + solve + other).max(f64::MIN_POSITIVE);
        let [residual, assembly, solve, other] =
            [residual, assembly, solve, other].map(|seconds| seconds / total);
        Some(Self { residual, assembly, solve, other })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_sum_to_one_and_follow_the_marks() {
        let spin = |turns: u64| (0..turns).map(std::hint::black_box).sum::<u64>();
        let window = || {
            let work = || {
                phase::within(Phase::Assembly, || {
                    spin(300_000);
                    phase::within(Phase::Solve, || spin(300_000))
                })
            };
            phases(work).0
        };
        let shares = Shares::of_least(&[window(), window(), window()]).unwrap();
        let sum = shares.residual + shares.assembly + shares.solve + shares.other;
        assert!((sum - 1.0).abs() < 1e-12, "{shares:?}");
        assert!(shares.assembly > shares.residual && shares.solve > shares.residual, "{shares:?}");
    }
}
