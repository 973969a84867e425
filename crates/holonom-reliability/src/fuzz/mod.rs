//! `cargo xtask fuzz`: mutated inputs for everything that reads.
//!
//! | file | concept |
//! |---|---|
//! | [`mutate`] | bytes, numbers and words of a text |
//! | [`structure`] | keys and values of a document |
//! | [`targets`] | what is executed, and what its answers must be |
//! | [`lane`] | a sequence of executions with the inputs that gave new kinds of answers |
//! | [`tally`] | many executions in numbers |
//! | [`limits`] | inputs that are large, deep or no files, once each |
//! | [`defects`] | the harness itself: defects that it must find |
//!
//! There is no feedback of coverage. An input whose error message has a new shape
//! ([`crate::shape`]) is mutated further in its place.

pub mod defects;
pub mod lane;
pub mod limits;
pub mod mutate;
pub mod structure;
pub mod tally;
pub mod targets;

use crate::part::{PartOfSeed, number};
use lane::{Lane, LaneWatch};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use tally::FuzzTally;
use targets::FuzzTarget;

/// What is run.
#[derive(Clone, Debug)]
pub struct FuzzRequest {
    /// Executions of each target; by default as many as it deserves.
    pub executions: Option<u64>,
    /// Which part of the executions: of every target some lanes.
    pub part: PartOfSeed,
    /// Names of the targets; all by default.
    pub targets: Vec<String>,
    /// Where inputs with faults are written.
    pub output: PathBuf,
}

impl FuzzRequest {
    /// Of the words of the command line.
    ///
    /// # Errors
    /// What cannot be understood, in words.
    pub fn parse(options: &[&str]) -> Result<Self, String> {
        let mut request = Self {
            executions: None,
            part: PartOfSeed::default(),
            targets: Vec::new(),
            output: PathBuf::from("target/fuzz"),
        };
        let mut rest = options.iter();
        while let Some(option) = rest.next() {
            if !option.starts_with('-') {
                request.targets.push((*option).to_owned());
                continue;
            }
            let value = rest.next().ok_or_else(|| format!("`{option}` needs a value"))?;
            match *option {
                "--executions" => request.executions = Some(number(option, value)?),
                "-o" => request.output = PathBuf::from(value),
                _ => request.part.take(option, value)?,
            }
        }
        Ok(request)
    }
}

/// Executes a target in lanes, several at a time. The result depends on the seed and the number of
/// executions alone, but for times.
pub fn fuzz(target: &dyn FuzzTarget, executions: u64, request: &FuzzRequest) -> FuzzTally {
    let mut lanes = Lane::all(request.part.seed, executions);
    lanes.retain(|lane| request.part.shard.has(lane.number as usize));
    let (next, total) = (AtomicUsize::new(0), Mutex::new(FuzzTally::default()));
    let work = || {
        let mut own = FuzzTally::default();
        while let Some(lane) = lanes.get(next.fetch_add(1, Ordering::Relaxed)) {
            own.add(lane.run(target, &LaneWatch::new(target.name(), &request.output), None));
        }
        if let Ok(mut total) = total.lock() {
            total.add(own);
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..request.part.jobs {
            // nested inputs need no more than the main thread of the program has
            let thread = std::thread::Builder::new().stack_size(8 << 20);
            drop(thread.spawn_scoped(scope, work));
        }
    });
    total.into_inner().unwrap_or_default()
}

/// A path that does not depend on the current folder.
fn absolute(path: &Path) -> Result<PathBuf, String> {
    std::path::absolute(path).map_err(|error| format!("{}: {error}", path.display()))
}

/// Runs, prints, and writes what was asked for; whether nothing is wrong.
///
/// # Errors
/// What cannot be understood or written, in words.
pub fn run(options: &[&str]) -> Result<bool, String> {
    let mut request = FuzzRequest::parse(options)?;
    request.output = absolute(&request.output)?; // a target may change the current folder
    request.part.json = request.part.json.as_deref().map(absolute).transpose()?;
    let mut found: BTreeMap<String, FuzzTally> = BTreeMap::new();
    let all = targets::all();
    for name in &request.targets {
        if !all.iter().any(|target| target.name() == name) {
            let names: Vec<&str> = all.iter().map(|target| target.name()).collect();
            return Err(format!("there is no target `{name}`: {}", names.join(", ")));
        }
    }
    let chosen = |name: &str| {
        request.targets.is_empty() || request.targets.iter().any(|target| target == name)
    };
    for target in all.iter().filter(|target| chosen(target.name())) {
        target.ready()?;
        let begin = std::time::Instant::now();
        let executions = request.executions.unwrap_or_else(|| target.executions());
        let tally = fuzz(&**target, executions, &request);
        let seconds = begin.elapsed().as_secs_f64();
        println!("{}: {}", target.name(), tally.words());
        let rate = tally.executions as f64 / seconds;
        println!("  {seconds:.0} s, {rate:.0} executions per second");
        tally.write(target.name(), &request.output)?;
        found.insert(target.name().to_owned(), tally);
    }
    let sound = found.values().all(|tally| tally.faults.is_empty());
    request.part.store(found)?;
    Ok(sound)
}
