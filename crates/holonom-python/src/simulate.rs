//! A run from its start to its end, in memory or with files.

use crate::errors::{continued, invalid, json};
use crate::model::Model;
use crate::recording::{Kept, Recording};
use crate::watch::Watch;
use holonom::model::ModelText;
use holonom::output::{Ended, Summary, SummaryBuilder};
use holonom::run::{
    ContinueError, Control, Finished, Stopwatch, prepare, resume as continue_run, run_with,
};
use holonom::{ModelError, RunFolder, RunOutcome};
use holonom_cli::text;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::cell::Cell;
use std::path::PathBuf;

/// Runs a model into arrays: `t`, `step`, `q` and the other tables, `summary`, `text`.
#[pyfunction]
#[pyo3(signature = (model, record, progress))]
pub(crate) fn simulate<'py>(
    py: Python<'py>,
    model: &Model,
    record: Option<Vec<String>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let kept = Kept::of(record)?;
    let mut watch = Watch::new(progress);
    let run = py.detach(|| in_memory(model, kept, &mut watch));
    watch.stopped()?;
    let (recording, summary) = run.map_err(|error| model.refused(py, &error))?;
    let found = recording.into_python(py)?;
    add_summary(&found, &summary)?;
    Ok(found)
}

fn in_memory(
    model: &Model,
    kept: Kept,
    watch: &mut Watch,
) -> Result<(Recording, Summary), ModelError> {
    let mut experiment = prepare(&model.model)?;
    let mut recording = Recording::new(&*experiment, kept);
    let mut builder = SummaryBuilder::of(None);
    let clock = Stopwatch::new(&*experiment, 0.0);
    let mut observe = |sample: &holonom::Sample| {
        recording.record(sample);
        builder.record(sample);
        Ok(())
    };
    let mut proceed = |step, of| watch.proceed(step, of);
    let outcome = experiment.run_while(&mut observe, &mut proceed);
    // nothing is written, so there are no errors; a run that was stopped raises its exception
    let outcome = outcome.ok().flatten().unwrap_or(RunOutcome::Done);
    let summary = clock.summary(&builder, &model.model, &*experiment, Ended::By(&outcome));
    Ok((recording, summary))
}

fn add_summary(found: &Bound<'_, PyDict>, summary: &Summary) -> PyResult<()> {
    let value = serde_json::to_value(summary).unwrap_or_default();
    found.set_item("summary", json(found.py(), &value)?)?;
    found.set_item("text", text::run(summary))
}

/// Runs a model with the files of `holonom run` in `folder`; the summary.
#[pyfunction]
#[pyo3(signature = (model, folder, force, checkpoint_every, progress))]
pub(crate) fn simulate_into<'py>(
    py: Python<'py>,
    model: &Model,
    folder: PathBuf,
    force: bool,
    checkpoint_every: Option<u64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let asked = Asked { progress, checkpoint_every };
    let run = py.detach(|| -> Result<_, ModelError> {
        let mut experiment = prepare(&model.model)?;
        Ok(asked.follow(|control| {
            RunFolder::takes_meshes(&folder, &model.model.meshes)?;
            let folder = RunFolder::create(&folder, force)?;
            Ok(run_with(&model.model, &mut *experiment, &folder, control)?)
        }))
    });
    run.map_err(|error| model.refused(py, &error))?.answer(py)
}

/// Continues an interrupted run of a folder; the summary.
#[pyfunction]
#[pyo3(signature = (folder, checkpoint_every, progress))]
pub(crate) fn resume<'py>(
    py: Python<'py>,
    folder: PathBuf,
    checkpoint_every: Option<u64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let asked = Asked { progress, checkpoint_every };
    let run = py.detach(|| -> Result<_, Box<(ModelText, ModelError)>> {
        let text = ModelText::read(&folder.join("model.toml"));
        let made = text.model(&[]).and_then(|model| {
            let experiment = prepare(&model)?;
            Ok((model, experiment))
        });
        let (model, mut experiment) = made.map_err(|error| Box::new((text, error)))?;
        Ok(asked.follow(|control| {
            let folder = RunFolder::reopen(&folder)?;
            let found = folder.read_checkpoint(&folder.model_text())?;
            continue_run(&model, &mut *experiment, &folder, found.checkpoint, control)
        }))
    });
    run.map_err(|refused| invalid(py, &refused.0, &[], &refused.1))?.answer(py)
}

/// What a run with files is asked for.
struct Asked {
    progress: Option<Py<PyAny>>,
    checkpoint_every: Option<u64>,
}

/// How it ended.
struct Followed {
    run: Result<Finished, ContinueError>,
    watch: Watch,
}

impl Asked {
    fn follow(self, go: impl FnOnce(Control<'_>) -> Result<Finished, ContinueError>) -> Followed {
        let mut watch = Watch::new(self.progress);
        let place = Cell::new((0, u64::MAX)); // where the run is, told before it asks
        let mut interrupted = || {
            let (step, of) = place.get();
            !watch.proceed(step, of)
        };
        let run = go(Control {
            progress: &mut |step, of| place.set((step, of)),
            notice: &mut |_| {}, // among the warnings of the summary
            interrupted: &mut interrupted,
            checkpoint_every: self.checkpoint_every,
            report: true,
            command: None,
        });
        Followed { run, watch }
    }
}

impl Followed {
    fn answer(self, py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
        let finished = self.run.map_err(|error| continued(py, &error))?;
        self.watch.stopped()?;
        json(py, &serde_json::to_value(&finished.summary).unwrap_or_default())
    }
}
