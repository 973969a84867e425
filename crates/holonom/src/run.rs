//! A whole run: simulate, write, summarise, report; pause and continue it.

use std::path::{Path, PathBuf};
use std::time::Instant;

use holonom_model::{Model, ModelError, Scheme};
use holonom_sim::experiment::RunnableModel;
use holonom_sim::output::{
    CHECKPOINTS, Checkpoint, Ended, OutputError, Recorder, RunFolder, RunInterruption, Status,
    Summary, SummaryBuilder,
};
use holonom_sim::sample::Sample;
use holonom_sim::simulation::control::Reading;
use holonom_sim::simulation::{ResumeError, RunOutcome, Simulation};
use holonom_sim::statics::Statics;

/// What the scheme of a model asks for: a [`Simulation`], or [`Statics`].
///
/// # Errors
/// [`ModelError`].
pub fn prepare(model: &Model) -> Result<Box<dyn RunnableModel>, ModelError> {
    prepare_reading(model, Reading::default())
}

/// The same, where of the nodes of a motion no more than that is read.
///
/// # Errors
/// [`ModelError`].
pub fn prepare_reading(
    model: &Model,
    reading: Reading,
) -> Result<Box<dyn RunnableModel>, ModelError> {
    if model.settings.scheme == Scheme::Static {
        return Ok(Box::new(Statics::new(model)?));
    }
    let mut simulation = Simulation::new(model)?;
    if reading != Reading::default() {
        simulation.read_only(reading);
    }
    Ok(Box::new(simulation))
}

/// What a run left behind.
#[derive(Clone, Debug)]
pub struct Finished {
    /// The run in numbers; `status` says whether it reached its end.
    pub summary: Summary,
    /// The files it wrote.
    pub files: Vec<PathBuf>,
}

/// What a run asks while it lasts.
pub struct RunControl<'a> {
    /// Called before every step with the number of steps taken and of all steps.
    pub progress: &'a mut dyn FnMut(u64, u64),
    /// Called with a warning when a node gives rise to it ([`Sample::notice`]); the summary has it
    /// too.
    pub notice: &'a mut dyn FnMut(&str),
    /// Asked once before every step; `true` ends the run there, with a checkpoint.
    pub interrupted: &'a mut dyn FnMut() -> bool,
    /// Steps from one checkpoint to the next; none are written without. Not for statics.
    pub checkpoint_every: Option<u64>,
    /// Whether plots and a report are drawn at the end.
    pub report: bool,
    /// The command that was given, for the page; a run that is continued keeps its own.
    pub command: Option<String>,
}

impl std::fmt::Debug for RunControl<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { checkpoint_every, report, .. } = self;
        let mut shown = f.debug_struct("Control");
        shown.field("checkpoint_every", checkpoint_every).field("report", report);
        shown.finish_non_exhaustive()
    }
}

/// Runs a simulation and writes all files of the run; `progress(step, of)` is called now and then.
///
/// A run that fails leaves valid files with everything up to the failure.
///
/// # Errors
/// [`OutputError`] when a file cannot be written.
pub fn run(
    model: &Model,
    simulation: &mut dyn RunnableModel,
    folder: &RunFolder,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Finished, OutputError> {
    let progress = &mut |step: u64, of| {
        if step.is_multiple_of(256) || step == of {
            progress(step, of);
        }
    };
    let (notice, interrupted) = (&mut |_: &str| {}, &mut || false);
    let (checkpoint_every, report, command) = (None, true, None);
    let control = RunControl { progress, notice, interrupted, checkpoint_every, report, command };
    run_with(model, simulation, folder, control)
}

/// The same with checkpoints; it may be interrupted. A run that was interrupted leaves a
/// checkpoint, and neither plots nor a report.
///
/// # Errors
/// [`OutputError`] when a file cannot be written.
pub fn run_with(
    model: &Model,
    simulation: &mut dyn RunnableModel,
    folder: &RunFolder,
    control: RunControl<'_>,
) -> Result<Finished, OutputError> {
    let text = folder.write_model(model)?;
    let summary = SummaryBuilder::of(control.command.clone());
    let recorder = Recorder::new(folder, simulation, summary)?;
    let clock = Stopwatch::new(simulation, 0.0);
    RecordedRun { model, text, folder, recorder, clock, last: None }.go(simulation, control)
}

/// Why a run cannot be continued.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ContinueError {
    /// A file cannot be read or written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The checkpoint is not one of this model.
    #[error("the checkpoint does not fit the model: {0}")]
    State(#[from] ResumeError),
    /// Equilibria have no checkpoints.
    #[error("a continuation of equilibria has no checkpoints")]
    Statics,
}

/// Continues a run from a checkpoint of its folder: its files become, byte for byte, those of a run
/// that was not interrupted, but for the elapsed time. Without [`RunControl::checkpoint_every`] the
/// interval of the checkpoint remains.
///
/// # Errors
/// [`ContinueError`].
pub fn resume(
    model: &Model,
    simulation: &mut dyn RunnableModel,
    folder: &RunFolder,
    checkpoint: Checkpoint,
    control: RunControl<'_>,
) -> Result<Finished, ContinueError> {
    simulation.resume(checkpoint.run.clone()).ok_or(ContinueError::Statics)??;
    let last = Some(checkpoint.run.step());
    let text = folder.model_text();
    // only the recorder continues at the lengths of the checkpoint: the report reads all rows
    let recorder = Recorder::new(&folder.clone().at(&checkpoint), simulation, checkpoint.summary)?;
    let clock = Stopwatch::new(simulation, checkpoint.wall_seconds);
    let every = control.checkpoint_every.or(checkpoint.every);
    let control = RunControl { checkpoint_every: every, ..control };
    Ok(RecordedRun { model, text, folder, recorder, clock, last }.go(simulation, control)?)
}

/// Elapsed time of a run.
#[derive(Debug)]
pub struct Stopwatch {
    begin: Instant,
    first: u64,             // step that this part of the run begins with
    before: f64,            // s  of the parts of the run before this one
    recording: Option<f64>, // s  that the simulation has recorded before this part
}

impl Stopwatch {
    /// Starts; `before`: what earlier parts of the run have taken, s.
    #[must_use]
    pub fn new(simulation: &dyn RunnableModel, before: f64) -> Self {
        let (first, recording) = (simulation.place().0, simulation.recording_seconds());
        Self { begin: Instant::now(), first, before, recording }
    }

    /// Of a step of this part of the run, without recording, s.
    fn step_seconds(&self, simulation: &dyn RunnableModel) -> Option<f64> {
        let steps = simulation.place().0.checked_sub(self.first).filter(|steps| *steps > 0)?;
        let recording = simulation.recording_seconds()? - self.recording?;
        Some((self.begin.elapsed().as_secs_f64() - recording).max(0.0) / steps as f64)
    }

    fn seconds(&self) -> f64 {
        self.before + self.begin.elapsed().as_secs_f64()
    }

    /// A run in numbers, of the nodes that `builder` has seen.
    #[must_use]
    pub fn summary(
        &self,
        builder: &SummaryBuilder,
        model: &Model,
        simulation: &dyn RunnableModel,
        ended: Ended<'_>,
    ) -> Summary {
        let mut summary = builder.so_far(model, simulation.assembly(), ended, self.seconds());
        summary.warnings = simulation.warnings();
        summary.statics = simulation.statics();
        summary.divided_steps = simulation.divided_steps();
        summary.loop_residual = simulation.loop_residuals();
        summary.tension_raised = simulation.tension_raised();
        summary.events = simulation.events().unwrap_or_default().into_iter().collect();
        summary.contacts = simulation.contact_counts();
        summary.fastest_rotation = simulation.fastest_rotation();
        summary.step_seconds = self.step_seconds(simulation);
        summary
    }
}

/// A run that writes.
struct RecordedRun<'a> {
    model: &'a Model,
    text: String, // of model.toml
    folder: &'a RunFolder,
    recorder: Recorder,
    clock: Stopwatch,
    last: Option<u64>, // step of the last checkpoint
}

impl RecordedRun<'_> {
    fn go(
        mut self,
        simulation: &mut dyn RunnableModel,
        control: RunControl<'_>,
    ) -> Result<Finished, OutputError> {
        let RunControl { progress, notice, interrupted, checkpoint_every, report, .. } = control;
        let every = checkpoint_every.filter(|_| simulation.statics().is_none());
        self.write_summary(simulation, Ended::Not(simulation.place()))?;
        loop {
            let (last, mut stopped) = (self.last, false);
            let mut proceed = |step: u64, of| {
                progress(step, of);
                let due = every.is_some_and(|every| step.is_multiple_of(every));
                if due && last != Some(step) {
                    return false;
                }
                stopped = interrupted();
                !stopped
            };
            let mut observe = |sample: &Sample| {
                sample.notice.iter().for_each(|words| notice(words));
                self.recorder.record(sample)
            };
            let path = self.folder.path();
            let io = |source| OutputError::Io { path: path.to_owned(), source };
            let outcome = simulation.run_while(&mut observe, &mut proceed).map_err(io)?;
            match outcome {
                Some(outcome) => return self.end(simulation, &outcome, report),
                None if stopped => return self.interrupt(simulation, checkpoint_every),
                None => self.checkpoint(simulation, checkpoint_every)?,
            }
        }
    }

    /// Writes a checkpoint, and the summary so far.
    fn checkpoint(
        &mut self,
        simulation: &mut dyn RunnableModel,
        every: Option<u64>,
    ) -> Result<(), OutputError> {
        let Some(state) = simulation.state() else { return self.recorder.flush() };
        self.last = Some(state.step());
        let checkpoint = self.recorder.checkpoint(state, every, self.clock.seconds())?;
        self.folder.write_checkpoint(&checkpoint, &self.text)?;
        self.write_summary(simulation, Ended::Not(simulation.place())).map(drop)
    }

    fn interrupt(
        mut self,
        simulation: &mut dyn RunnableModel,
        every: Option<u64>,
    ) -> Result<Finished, OutputError> {
        let (step, t) = simulation.place();
        if self.last != Some(step) {
            self.checkpoint(simulation, every)?;
        }
        let resume = self.last.map(|_| resume_command(self.folder.path()));
        let ended = Ended::Interrupted(RunInterruption { step, t, resume });
        let summary = self.write_summary(simulation, ended)?;
        let mut files = self.files();
        files.extend(
            CHECKPOINTS.map(|name| self.folder.path().join(name)).into_iter().find(|f| f.is_file()),
        );
        Ok(Finished { summary, files })
    }

    fn end(
        mut self,
        simulation: &dyn RunnableModel,
        outcome: &RunOutcome,
        report: bool,
    ) -> Result<Finished, OutputError> {
        self.recorder.flush()?;
        let summary = self.write_summary(simulation, Ended::By(outcome))?;
        let mut files = self.files();
        if report {
            files.extend(holonom_report::write(self.folder)?);
        }
        if summary.status == Status::Done {
            self.folder.remove_outdated_checkpoints()?;
        }
        Ok(Finished { summary, files })
    }

    fn write_summary(
        &self,
        simulation: &dyn RunnableModel,
        ended: Ended<'_>,
    ) -> Result<Summary, OutputError> {
        let summary = self.clock.summary(self.recorder.summary(), self.model, simulation, ended);
        self.folder.write_summary(&summary)?;
        Ok(summary)
    }

    fn files(&self) -> Vec<PathBuf> {
        let rows = self.recorder.files().iter().copied();
        let names = ["model.toml"].into_iter().chain(rows).chain(["summary.json"]);
        names.map(|name| self.folder.path().join(name)).collect()
    }
}

/// The command that continues the run of a folder.
#[must_use]
pub fn resume_command(folder: &Path) -> String {
    let text = folder.display().to_string();
    let plain = |c: char| c.is_alphanumeric() || "/-._~+=@%".contains(c);
    let word =
        if text.chars().all(plain) { text } else { format!("'{}'", text.replace('\'', "'\\''")) };
    format!("holonom resume {word}")
}
