//! One experiment: a run that is disturbed again and again, until it ends or has been disturbed
//! often enough, and is then continued to its end. Its results must be those of a run that nothing
//! disturbed, to the byte.

use super::defects::InterruptDefect;
use super::process::{Disturbance, Process, ProcessEnd};
use super::results::{Results, torn};
use super::trial_kind::TrialKind;
use crate::program;
use crate::scratch::ScratchFolder;
use crate::soak::draw::Draw;
use serde_json::Value;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Disturbances of one run.
const MOST: usize = 4;
/// The folder of the run.
const OUT: &str = "out";
/// Checkpoints, the newest first.
const CHECKPOINTS: [&str; 2] = ["checkpoint", "checkpoint.previous"];

/// Models, with what is asked of their runs: all schemes' kinds of states, tables and plots, in
/// some tenths of a second.
const MODELS: [(&str, &[&str]); 6] = [
    ("chain8", &["--end", "0.3", "--order", "4", "--every", "2", "--checkpoint-every", "25"]),
    ("gyroscope", &["--end", "0.4", "--every", "1", "--checkpoint-every", "20"]),
    ("flexible_four_bar", &["--end", "0.06", "--every", "3", "--checkpoint-every", "7"]),
    ("flyball_governor", &["--end", "0.3", "--scheme", "em-nodal", "--checkpoint-every", "30"]),
    ("six_hinge_cube", &["--end", "0.5", "--every", "1", "--checkpoint-every", "10"]),
    ("four_particles", &["--scheme", "constrained", "--every", "1", "--checkpoint-every", "15"]),
];

/// A model with the results of a run that nothing disturbed.
pub(super) struct UndisturbedRun {
    model: PathBuf,
    options: &'static [&'static str],
    results: Results,
    time: Duration,
    blocks: usize, // of 512 bytes, of the largest table
}

/// Every model, run once by the program beside this one.
pub(super) fn references(program: &Path) -> Result<&'static [UndisturbedRun], String> {
    static RUN: OnceLock<Result<Vec<UndisturbedRun>, String>> = OnceLock::new();
    RUN.get_or_init(|| run_all(program)).as_deref().map_err(Clone::clone)
}

fn run_all(program: &Path) -> Result<Vec<UndisturbedRun>, String> {
    let root = program::repository();
    let reference = |(name, options): (&str, &'static [&'static str])| {
        let model = root.join(format!("examples/models/{name}.toml"));
        let (scratch, begin) = (ScratchFolder::new("interrupt"), Instant::now());
        let words = run_words(&model, options);
        let run = Process::start(program, &words, scratch.path(), Disturbance::None)?;
        let ProcessEnd { code, words } = run.end()?;
        if code != Some(0) {
            return Err(format!("{name}: {words}"));
        }
        let time = begin.elapsed();
        let results = Results::read(&scratch.path().join(OUT))?;
        let blocks = results.tables().map(|(_, bytes)| bytes.len() / 512 + 1).max().unwrap_or(1);
        Ok(UndisturbedRun { model, options, results, time, blocks })
    };
    MODELS.into_iter().map(reference).collect()
}

fn run_words(model: &Path, options: &[&str]) -> Vec<String> {
    let model = model.display().to_string();
    let all = ["run", &model, "-o", OUT, "--force"].into_iter().chain(options.iter().copied());
    all.map(str::to_owned).collect()
}

/// What an experiment gave.
#[derive(Debug)]
pub(super) struct TrialOutcome {
    pub disturbances: u64,
    pub anew: u64,
    pub fault: Option<String>,
}

/// Carries out experiment `index` of a seed.
pub(super) fn experiment(
    program: &Path,
    references: &[UndisturbedRun],
    seed: u64,
    index: u64,
    kind: TrialKind,
    defect: Option<InterruptDefect>,
) -> TrialOutcome {
    let mut draw = Draw::new(seed, index);
    let of = match defect {
        None => draw.index(references.len()),
        Some(_) => 0, // the quickest
    };
    let scratch = ScratchFolder::new("interrupt");
    let mut experiment = Trial {
        program,
        folder: scratch.path(),
        reference: &references[of],
        kind,
        defect,
        draw,
        disturbances: 0,
        anew: 0,
    };
    let fault = match kind {
        TrialKind::TwoRuns => experiment.two(&references[(of + 1) % references.len()]),
        _ => experiment.one(),
    };
    let Trial { disturbances, anew, .. } = experiment;
    TrialOutcome { disturbances, anew, fault: fault.err() }
}

struct Trial<'a> {
    program: &'a Path,
    folder: &'a Path, // with the folder of the run
    reference: &'a UndisturbedRun,
    kind: TrialKind,
    defect: Option<InterruptDefect>,
    draw: Draw,
    disturbances: u64,
    anew: u64,
}

impl Trial<'_> {
    /// A run that is disturbed; the fault, in words.
    fn one(&mut self) -> Result<(), String> {
        for _ in 0..MOST {
            let disturbance = self.disturbance();
            let ended = self.go_on(disturbance)?;
            let done = ended.code == Some(0);
            self.disturbances += u64::from(!done || disturbance == Disturbance::NoReader);
            if done {
                return self.compare(&[self.reference]);
            }
            self.judge_left(&ended)?;
            self.damage()?;
            if self.draw.chance(0.25) {
                self.call(&["plot", OUT], Disturbance::None)?;
            }
        }
        let last = self.go_on(Disturbance::None)?;
        if last.code != Some(0) {
            if !matches!(self.kind, TrialKind::DamagedCheckpoint | TrialKind::CutTable) {
                return Err(format!("it cannot be continued: {}", last.words));
            }
            self.anew += 1; // it said why
            if self.out().is_dir() {
                fs::remove_dir_all(self.out()).map_err(|error| error.to_string())?;
            }
            let ended = self.go_on(Disturbance::None)?;
            if ended.code != Some(0) {
                return Err(format!("a new run ends with {:?}: {}", ended.code, ended.words));
            }
        }
        self.compare(&[self.reference])
    }

    /// Two runs of different models into one folder: one of them succeeds, the other says why it
    /// does not.
    fn two(&mut self, other: &UndisturbedRun) -> Result<(), String> {
        let words = |of: &UndisturbedRun| run_words(&of.model, of.options);
        let (first, second) = (words(self.reference), words(other));
        let start =
            |words: &[String]| Process::start(self.program, words, self.folder, Disturbance::None);
        let one = start(&first)?;
        std::thread::sleep(self.reference.time.mul_f64(self.draw.between(0.0, 1.1)));
        let two = start(&second)?;
        let ended = [one.end()?, two.end()?];
        self.disturbances += 1;
        for ended in &ended {
            self.judge_words(ended)?;
        }
        if ended.iter().all(|ended| ended.code != Some(0)) {
            return Err(format!("neither run succeeds: {}, {}", ended[0].words, ended[1].words));
        }
        if self.defect == Some(InterruptDefect::Mixed) {
            let name = "trajectory.csv";
            let is_own = Results::read(&self.out())?.difference(&self.reference.results).is_none();
            let from = if is_own { other } else { self.reference };
            let bytes = from.results.tables().find(|(table, _)| *table == name);
            let bytes = bytes.map(|(_, bytes)| bytes).unwrap_or_default();
            fs::write(self.out().join(name), bytes).map_err(|error| error.to_string())?;
        }
        self.compare(&[self.reference, other])
    }

    fn out(&self) -> PathBuf {
        self.folder.join(OUT)
    }

    fn disturbance(&mut self) -> Disturbance {
        let after = self.reference.time.mul_f64(self.draw.between(0.0, 0.7));
        match self.kind {
            TrialKind::Signal => Disturbance::Signal(self.draw.pick(&["TERM", "INT"]), after),
            TrialKind::FullDisk => Disturbance::FullDisk(self.draw.index(self.reference.blocks)),
            TrialKind::NoReader => Disturbance::NoReader,
            _ => Disturbance::Signal("KILL", after),
        }
    }

    /// Continues the run, or begins it where there is no checkpoint.
    fn go_on(&mut self, disturbance: Disturbance) -> Result<ProcessEnd, String> {
        if CHECKPOINTS.iter().any(|name| self.out().join(name).exists()) {
            return self.call(&["resume", OUT], disturbance);
        }
        self.call(&run_words(&self.reference.model, self.reference.options), disturbance)
    }

    fn call(
        &self,
        words: &[impl AsRef<OsStr>],
        disturbance: Disturbance,
    ) -> Result<ProcessEnd, String> {
        let process = Process::start(self.program, words, self.folder, disturbance)?;
        let mut ended = process.end()?;
        let disturbed = disturbance != Disturbance::None && ended.code != Some(0);
        match self.defect {
            Some(InterruptDefect::NoWords) if disturbed => ended.words.clear(),
            Some(InterruptDefect::Panic) if disturbed => ended.words += "thread 'main' panicked",
            Some(defect @ (InterruptDefect::TornRow | InterruptDefect::Unnoticed)) => {
                defect.spoil(&self.out())
            }
            _ => {}
        }
        self.judge_words(&ended)?;
        Ok(ended)
    }

    /// A program does not panic, and says why it does not succeed.
    fn judge_words(&self, ended: &ProcessEnd) -> Result<(), String> {
        if ended.words.contains("panicked") {
            return Err(format!("a panic: {}", ended.words));
        }
        match ended.code {
            Some(code) if code != 0 && ended.words.trim().is_empty() => {
                Err(format!("it ends with {code} without words"))
            }
            Some(0..=3 | 130 | 143) | None => Ok(()),
            Some(code) => Err(format!("it ends with {code}: {}", ended.words)),
        }
    }

    /// What a disturbed run leaves: whole rows, unless it was killed, and a summary that knows of
    /// the signal.
    fn judge_left(&self, ended: &ProcessEnd) -> Result<(), String> {
        if matches!(self.kind, TrialKind::Signal | TrialKind::FullDisk)
            && ended.code.is_some()
            && let Some(fault) = torn(&self.out())
        {
            return Err(fault);
        }
        if !matches!(ended.code, Some(130 | 143)) {
            return Ok(());
        }
        match self.status().as_deref() {
            Some("interrupted" | "done") => Ok(()),
            other => {
                Err(format!("interrupted with {:?}, but the summary says {other:?}", ended.code))
            }
        }
    }

    /// What the summary says of the run.
    fn status(&self) -> Option<String> {
        let text = fs::read_to_string(self.out().join("summary.json")).ok()?;
        let summary: Value = serde_json::from_str(&text).ok()?;
        summary["status"].as_str().map(str::to_owned)
    }

    /// Damages a file of a run that is not complete, where the kind says so.
    fn damage(&mut self) -> Result<(), String> {
        if self.status() == Some("done".into()) {
            return Ok(());
        }
        let path = match self.kind {
            TrialKind::DamagedCheckpoint => self.out().join(self.draw.pick(&CHECKPOINTS)),
            TrialKind::CutTable => {
                let tables: Vec<&str> =
                    self.reference.results.tables().map(|(name, _)| name).collect();
                self.out().join(self.draw.pick(&tables))
            }
            _ => return Ok(()),
        };
        let Ok(mut bytes) = fs::read(&path) else { return Ok(()) }; // not written yet
        let at = self.draw.index(bytes.len());
        match self.draw.index(3) {
            _ if bytes.is_empty() => {}
            0 if self.kind == TrialKind::DamagedCheckpoint => bytes[at] ^= 1 << self.draw.index(8),
            1 if self.kind == TrialKind::DamagedCheckpoint => bytes.extend_from_within(at..),
            _ => bytes.truncate(at),
        }
        fs::write(&path, bytes).map_err(|error| error.to_string())
    }

    /// The results are those of one of these.
    fn compare(&self, references: &[&UndisturbedRun]) -> Result<(), String> {
        if let (TrialKind::Kill, Some(defect)) = (self.kind, self.defect) {
            defect.spoil(&self.out());
        }
        let found = Results::read(&self.out())?;
        let differences: Option<Vec<String>> =
            references.iter().map(|reference| found.difference(&reference.results)).collect();
        match differences {
            Some(differences) => Err(differences.join("; ")),
            None => Ok(()),
        }
    }
}
