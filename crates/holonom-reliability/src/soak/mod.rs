//! `cargo xtask soak`: random valid mechanisms, assembled, stepped and judged.
//!
//! | file | concept |
//! |---|---|
//! | [`generate`], [`draw`] | mechanisms that are valid by construction, the same for a seed on every machine |
//! | [`judge`](mod@judge), `invariants`, `repeat` | what holds for each of them |
//! | [`statement`], [`restate`], [`restated`] | the same mechanism turned, moved, reordered, in other units |
//! | [`growth`] | the time of a step: no member costs more than its share |
//! | [`fault`] | what is wrong |
//! | [`minimise`](mod@minimise) | the smallest mechanism with the same fault |
//! | [`tally`] | many mechanisms in numbers |
//! | [`defects`] | the harness itself: defects that it must find |

pub mod defects;
pub mod draw;
pub mod fault;
pub mod generate;
pub mod growth;
mod invariants;
pub mod judge;
pub mod minimise;
mod repeat;
pub mod restate;
pub mod restated;
pub mod statement;
pub mod tally;
pub mod trace;

pub use invariants::{InvariantErrors, bounds};

use crate::part::{PartOfSeed, number};
use crate::text_file;
use defects::SoakDefect;
use generate::{mechanism, touching};
use holonom::Model;
use judge::{Checks, judge};
use minimise::{minimise, minimise_failure};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use tally::{FaultyMechanism, SoakTally};

/// What is run.
#[derive(Clone, Debug)]
pub struct SoakRequest {
    /// Mechanisms.
    pub count: u64,
    /// Which part of them.
    pub part: PartOfSeed,
    /// Where models with faults are written.
    pub output: PathBuf,
    /// Whether all are also turned, moved, reordered and stated in other units, not one of 32.
    pub restated: bool,
    /// Whether they are bodies of all shapes that touch.
    pub touching: bool,
    /// Whether the first mechanism of each reason for which steps are refused is reduced, too.
    pub failures: bool,
}

impl SoakRequest {
    /// Of the words of the command line.
    ///
    /// # Errors
    /// What cannot be understood, in words.
    pub fn parse(options: &[&str]) -> Result<Self, String> {
        let mut request = Self {
            count: 1_000_000,
            part: PartOfSeed::default(),
            output: PathBuf::from("target/soak"),
            restated: false,
            touching: false,
            failures: false,
        };
        let mut rest = options.iter();
        while let Some(option) = rest.next() {
            if *option == "--quick" {
                request.count = 2000;
                continue;
            }
            if *option == "--restated" {
                request.restated = true;
                continue;
            }
            if *option == "--failures" {
                request.failures = true;
                continue;
            }
            if *option == "--touching" {
                request.touching = true;
                continue;
            }
            let value = rest.next().ok_or_else(|| format!("`{option}` needs a value"))?;
            match *option {
                "--count" => request.count = number(option, value)?,
                "-o" => request.output = PathBuf::from(value),
                _ => request.part.take(option, value)?,
            }
        }
        Ok(request)
    }

    fn mechanism(&self, index: u64) -> Model {
        match self.touching {
            true => touching(self.part.seed, index),
            false => mechanism(self.part.seed, index),
        }
    }

    fn checks(&self, index: u64) -> Checks {
        if self.touching { Checks::of_touching(index) } else { Checks::of(index, self.restated) }
    }
}

/// Judges mechanisms in several threads; `progress` gets the number of those that are done.
pub fn soak(request: &SoakRequest, progress: &(dyn Fn(u64) + Sync)) -> SoakTally {
    const CHUNK: u64 = 64;
    let (next, total) = (AtomicU64::new(0), Mutex::new(SoakTally::default()));
    let work = || {
        let mut own = SoakTally::default();
        loop {
            let begin = next.fetch_add(CHUNK, Ordering::Relaxed);
            if begin >= request.count {
                break;
            }
            let chunk = begin..(begin + CHUNK).min(request.count);
            for index in chunk.filter(|index| request.part.shard.has(*index as usize)) {
                own.take(index, judge(&request.mechanism(index), request.checks(index), None));
            }
            progress(begin + CHUNK);
        }
        if let Ok(mut total) = total.lock() {
            total.add(own);
        }
    };
    std::thread::scope(|scope| (0..request.part.jobs).for_each(|_| drop(scope.spawn(work))));
    total.into_inner().unwrap_or_default()
}

/// How many mechanisms it takes to find a defect, at most `most`.
#[must_use]
pub fn found_after(defect: SoakDefect, seed: u64, most: u64) -> Option<u64> {
    (0..most).find(|index| {
        let restart = matches!(defect, SoakDefect::Restart | SoakDefect::Text);
        let (agreement, restated) = (defect == SoakDefect::Agreement, defect.restates());
        let certified = defect == SoakDefect::Certificate;
        let checks = Checks { restart, agreement, restated, certified };
        let draw = if defect == SoakDefect::Gain { touching } else { mechanism };
        let judged = judge(&draw(seed, *index), checks, Some(defect));
        judged.fault.is_some_and(|fault| fault.kind == defect.kind())
    })
}

/// Runs, prints, and writes what was asked for; whether nothing is wrong.
///
/// # Errors
/// What cannot be understood or written, in words.
pub fn run(options: &[&str]) -> Result<bool, String> {
    if let ["--model", path] = options {
        return single(Path::new(path));
    }
    if let ["--growth"] = options {
        return growth::run(1);
    }
    let request = SoakRequest::parse(options)?;
    let begin = std::time::Instant::now();
    let progress = |done: u64| {
        if done % 32_768 < 64 {
            eprintln!("{done} of {} ({:.0} s)", request.count, begin.elapsed().as_secs_f64());
        }
    };
    let tally = soak(&request, &progress);
    print!("{}", words(&tally));
    println!("{:.0} s", begin.elapsed().as_secs_f64());
    let (faults, failed) = (tally.faults.clone(), tally.failed.clone());
    request.part.store(tally)?; // what is found is kept while it is reduced
    for FaultyMechanism { index, fault } in faults.iter().take(20) {
        println!("{}-{index}: {}", request.part.seed, fault.words);
    }
    let print = |index: u64, path: &Path| {
        println!("{}-{index}: {}", request.part.seed, path.display());
    };
    for case in faults.iter().take(20) {
        print(case.index, &reduced(&request, case)?);
    }
    for (words, reason) in failed.iter().filter(|_| request.failures) {
        let smallest = minimise_failure(&request.mechanism(reason.first), words);
        print(reason.first, &store(&request, "failed", reason.first, words, &smallest)?);
    }
    Ok(faults.is_empty())
}

/// Judges the model of a file with all checks, and prints its energies.
fn single(path: &Path) -> Result<bool, String> {
    let text = holonom::model::read_text(path).map_err(|error| error.to_string())?;
    let checks = Checks { restart: true, agreement: true, restated: true, certified: true };
    let (model, mut simulation) =
        trace::assembled(&text, generate::meshes()).map_err(|error| error.to_string())?;
    println!("{}", simulation.energy_columns().join(" "));
    for sample in trace::trace(&mut simulation).samples {
        let energies: Vec<String> = sample.energies.iter().map(|x| format!("{x:.3e}")).collect();
        let residuals = sample.residuals;
        println!("{}: {}, g {:.1e}", sample.step, energies.join(" "), residuals.position);
    }
    let judged = judge(&model, checks, None);
    println!("{judged:?}");
    Ok(judged.fault.is_none())
}

/// Writes the smallest model with the fault of a case.
fn reduced(request: &SoakRequest, case: &FaultyMechanism) -> Result<PathBuf, String> {
    let FaultyMechanism { index, fault } = case;
    let model = request.mechanism(*index);
    let smallest = minimise(&model, request.checks(*index), None, fault);
    store(request, &format!("{:?}", fault.kind), *index, &fault.words, &smallest)
}

/// Writes a model with the words about it.
fn store(
    request: &SoakRequest,
    kind: &str,
    index: u64,
    words: &str,
    model: &Model,
) -> Result<PathBuf, String> {
    let name = format!("{kind}-{}-{index}.toml", request.part.seed).to_lowercase();
    let path = request.output.join(name);
    let text = format!("# {}\n{}", words.replace('\n', " "), model.to_toml());
    std::fs::create_dir_all(&request.output)
        .map_err(|error| format!("{}: {error}", path.display()))?;
    text_file::write(&path, &text)?;
    for (name, mesh) in model.meshes.named() {
        let bytes = String::from_utf8_lossy(mesh.bytes());
        text_file::write(&request.output.join(name), &bytes)?;
    }
    Ok(path)
}

/// The result on a terminal.
#[must_use]
pub fn words(tally: &SoakTally) -> String {
    let (refused, failed) = (SoakTally::count(&tally.refused), SoakTally::count(&tally.failed));
    let mut out = format!(
        "{} mechanisms: {} done, {refused} refused, {failed} failed, {} with faults\n",
        tally.mechanisms,
        tally.done,
        tally.faults.len()
    );
    for (what, reasons) in [("refused", &tally.refused), ("failed", &tally.failed)] {
        for (words, reason) in reasons {
            out += &format!("  {what} {}, first {}: {words}\n", reason.count, reason.first);
        }
    }
    let numbers = [
        ("constraints", tally.residual),
        ("momentum maps", tally.momentum),
        ("energy", tally.energy),
        ("agreement", tally.agreement),
        ("stated otherwise", tally.restated),
        ("gained by contact", tally.gain),
    ];
    for (what, largest) in numbers {
        let tally::WorstMechanism { count, value, index } = largest;
        out += &format!("  {what}: {count} measured, largest {value:.1e} at {index}\n");
    }
    out + &format!("  restarted: {}, certified: {}\n", tally.restarted, tally.certified)
}
