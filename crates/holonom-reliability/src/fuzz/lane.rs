//! A sequence of executions. It has its own random numbers and its own inputs, so that lanes can
//! run in any order.

use super::defects::FuzzDefect;
use super::tally::{FaultyInput, FuzzTally};
use super::targets::{Answer, FuzzTarget};
use crate::guard::guarded;
use crate::shape::shape;
use crate::soak::draw::Draw;
use crate::soak::tally::Reason;
use std::path::Path;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};
use vi_testkit::allocator;

/// Executions of a lane.
const LENGTH: u64 = 20_000;
/// Inputs with new answers that a lane keeps.
const KEPT: usize = 512;
/// Most memory an input may take, bytes.
const MEMORY: u64 = 256 << 20;
/// Longest time an input may take: longer is a hang.
pub const HANG: Duration = Duration::from_secs(30);

/// A part of the executions of a target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lane {
    /// Seed of the run.
    pub seed: u64,
    /// Its number.
    pub number: u64,
    /// Its executions.
    pub length: u64,
}

/// Ends the program when one execution does not end, and says which.
#[derive(Debug)]
pub struct LaneWatch(Sender<Option<Vec<u8>>>);

impl LaneWatch {
    /// For one thread; `folder`: where an input that hangs is written.
    #[must_use]
    pub fn new(target: &'static str, folder: &Path) -> Self {
        let (sender, receiver) = channel::<Option<Vec<u8>>>();
        let path = folder.join(format!("{target}-hang"));
        std::thread::spawn(move || {
            let mut current: Option<Vec<u8>> = None;
            loop {
                match receiver.recv_timeout(HANG) {
                    Ok(input) => current = input,
                    Err(RecvTimeoutError::Disconnected) => return,
                    Err(RecvTimeoutError::Timeout) => {
                        if let Some(input) = &current {
                            let _ = std::fs::write(&path, input); // the message below has the rest
                            eprintln!("{target}: an execution does not end: {}", path.display());
                            std::process::exit(1);
                        }
                    }
                }
            }
        });
        Self(sender)
    }

    fn begin(&self, input: &[u8]) {
        let _ = self.0.send(Some(input.to_vec())); // the thread ends with the program
    }

    fn end(&self) {
        let _ = self.0.send(None);
    }
}

impl Lane {
    /// The lanes of a number of executions.
    #[must_use]
    pub fn all(seed: u64, executions: u64) -> Vec<Self> {
        let length = |number: u64| LENGTH.min(executions - number * LENGTH);
        let count = executions.div_ceil(LENGTH);
        (0..count).map(|number| Self { seed, number, length: length(number) }).collect()
    }

    /// Executes.
    #[must_use]
    pub fn run(
        self,
        target: &dyn FuzzTarget,
        watch: &LaneWatch,
        defect: Option<FuzzDefect>,
    ) -> FuzzTally {
        let mut draw = Draw::new(self.seed, self.number.wrapping_mul(0x5851_f42d_4c95_7f2d));
        let mut inputs = target.seeds();
        let (seeds, mut kept) = (inputs.len(), 0_usize);
        let mut worker = target.worker();
        let mut tally = FuzzTally::default();
        for execution in 0..self.length {
            let input = match inputs.get(execution as usize) {
                Some(seed) if (execution as usize) < seeds => seed.clone(), // as they are
                _ => {
                    let [a, b] = [draw.index(inputs.len()), draw.index(inputs.len())];
                    target.mutate(&inputs[a], &inputs[b], &mut draw)
                }
            };
            watch.begin(&input);
            allocator::begin_peak();
            let begin = Instant::now();
            let answer = guarded(|| FuzzDefect::execute(defect, &mut *worker, &input));
            let seconds = FuzzDefect::time(defect, begin.elapsed().as_secs_f64());
            let memory = u64::try_from(allocator::peak()).unwrap_or_default();
            watch.end();
            tally.executions += 1;
            tally.memory = tally.memory.max(memory);
            if seconds > tally.slowest {
                (tally.slowest, tally.slowest_input) = (seconds, input.clone());
            }
            let mut novel = false;
            let wrong = match answer {
                Ok(Answer::Accepted) => {
                    tally.accepted += 1;
                    None
                }
                Ok(Answer::Refused(message)) => {
                    novel = tally.shapes.insert(shape(&message));
                    message.trim().is_empty().then(|| "an error without words".to_owned())
                }
                Ok(Answer::Wrong(words)) => Some(words),
                Err(panic) => Some(format!("panic: {panic}")),
            };
            let limits = || {
                let slow = seconds > HANG.as_secs_f64();
                let large = memory > MEMORY;
                slow.then(|| "an execution took too long".to_owned())
                    .or_else(|| large.then(|| "an execution took too much memory".to_owned()))
            };
            if let Some(words) = wrong.or_else(limits) {
                self.fault(&mut tally, execution, words, &input);
            }
            if novel && kept < KEPT {
                kept += 1;
                inputs.push(input);
            }
        }
        tally
    }

    fn fault(self, tally: &mut FuzzTally, execution: u64, words: String, input: &[u8]) {
        let case = FaultyInput { lane: self.number, execution, words, input: input.to_vec() };
        let reason = Reason { count: 1, first: self.number * LENGTH + execution };
        let mut one = FuzzTally::default();
        one.faults.insert(shape(&case.words), (reason, case));
        tally.add(one);
    }
}
