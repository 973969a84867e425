//! `cargo xtask interrupt`: runs that are killed, interrupted, without space, damaged, two at once,
//! and continued.
//!
//! | file | concept |
//! |---|---|
//! | [`TrialKind`] | what is done to a run |
//! | `experiment` | a run to which it is done, and what must remain |
//! | `process` | the program as a process that is disturbed |
//! | `results` | the files that must be those of an undisturbed run, to the byte |
//! | [`tally`] | many experiments in numbers |
//! | [`defects`] | the harness itself: defects that it must find |
//!
//! What is done belongs to the seed, the moments belong to the clock.

pub mod defects;
mod experiment;
mod process;
mod results;
pub mod tally;
mod trial_kind;

pub use trial_kind::TrialKind;

use crate::part::{PartOfSeed, number};
use crate::program;
use defects::InterruptDefect;
use experiment::{TrialOutcome, experiment, references};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use tally::{FaultyExperiment, InterruptTallies, InterruptTally};

/// What is run.
#[derive(Clone, Debug)]
pub struct InterruptRequest {
    /// Experiments.
    pub count: u64,
    /// Which part of them.
    pub part: PartOfSeed,
}

impl InterruptRequest {
    /// Of the words of the command line.
    ///
    /// # Errors
    /// What cannot be understood, in words.
    pub fn parse(options: &[&str]) -> Result<Self, String> {
        let mut request = Self { count: 3500, part: PartOfSeed::default() };
        let mut rest = options.iter();
        while let Some(option) = rest.next() {
            let value = rest.next().ok_or_else(|| format!("`{option}` needs a value"))?;
            match *option {
                "--count" => request.count = number(option, value)?,
                _ => request.part.take(option, value)?,
            }
        }
        Ok(request)
    }
}

/// Whether there is a program to interrupt.
///
/// # Errors
/// What is missing, in words.
pub fn ready() -> Result<(), String> {
    program::beside().map(drop).ok_or_else(|| program::HELP.to_owned())
}

/// Carries out experiments in several threads.
///
/// # Errors
/// Why there is nothing to compare with, in words.
pub fn interrupt(request: &InterruptRequest) -> Result<InterruptTallies, String> {
    let program = program::beside().ok_or(program::HELP)?;
    let references = references(&program)?;
    let (next, total) = (AtomicU64::new(0), Mutex::new(InterruptTallies::new()));
    let work = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= request.count {
                break;
            }
            if !request.part.shard.has(index as usize) {
                continue;
            }
            let kind = TrialKind::ALL[index as usize % TrialKind::ALL.len()];
            let outcome = experiment(&program, references, request.part.seed, index, kind, None);
            let TrialOutcome { disturbances, anew, fault } = outcome;
            let faults = fault.map(|words| FaultyExperiment { index, words }).into_iter().collect();
            let row = InterruptTally { experiments: 1, disturbances, anew, faults };
            if let Ok(mut total) = total.lock() {
                tally::add(&mut total, InterruptTallies::from([(kind.name().to_owned(), row)]));
            }
        }
    };
    std::thread::scope(|scope| (0..request.part.jobs).for_each(|_| drop(scope.spawn(work))));
    Ok(total.into_inner().unwrap_or_default())
}

/// How many experiments it takes to find a defect, at most `most`; `None` also where there is no
/// program.
#[must_use]
pub fn found_after(defect: InterruptDefect, seed: u64, most: u64) -> Option<u64> {
    let program = program::beside()?;
    let references = references(&program).ok()?;
    (0..most).find(|index| {
        let kind = defect.kind();
        let outcome = experiment(&program, references, seed, *index, kind, Some(defect));
        outcome.fault.is_some_and(|words| words.contains(defect.words()))
    })
}

/// Runs, prints, and writes what was asked for; whether nothing is wrong.
///
/// # Errors
/// What cannot be understood or written, in words.
pub fn run(options: &[&str]) -> Result<bool, String> {
    let request = InterruptRequest::parse(options)?;
    let begin = std::time::Instant::now();
    let tally = interrupt(&request)?;
    print!("{}", words(&tally));
    println!("{:.0} s", begin.elapsed().as_secs_f64());
    let sound = tally.values().all(|row| row.faults.is_empty());
    request.part.store(tally)?;
    Ok(sound)
}

/// The result on a terminal.
#[must_use]
pub fn words(tally: &InterruptTallies) -> String {
    let mut out = String::new();
    for (kind, InterruptTally { experiments, disturbances, anew, faults }) in tally {
        out += &format!(
            "{kind}: {experiments} runs, {disturbances} disturbances, {anew} begun anew, {} with faults\n",
            faults.len()
        );
        for FaultyExperiment { index, words } in faults.iter().take(5) {
            out += &format!("  {index}: {words}\n");
        }
    }
    out
}
