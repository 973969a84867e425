//! A run from its start to its end, in memory or with files.

use crate::acting::{Acted, Acting};
use crate::errors::{continued, json, raise};
use crate::fault::PythonFault;
use crate::model::Model;
use crate::recording::{KeptNode, Recording};
use crate::stepper::freed;
use crate::watch::Watch;
use holonom::experiment::RunnableModel;
use holonom::output::{Ended, Summary, SummaryBuilder};
use holonom::run::{
    ContinueError, Finished, RunControl, Stopwatch, prepare_reading, resume as continue_run,
    run_with,
};
use holonom::{Reading, RunFolder, RunOutcome};
use holonom_cli::text;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::cell::Cell;
use std::path::PathBuf;
use std::sync::Arc;

/// Most bytes of the arrays of a run in memory.
const MOST: u64 = 2 << 30;

/// A run that is ready.
struct Ready {
    experiment: Box<dyn RunnableModel>,
    own_sensors: usize,
    fault: Arc<PythonFault>,
    calls_python: bool,
}

impl Ready {
    /// The run of a model with what acts on it, of which `reading` is wanted.
    fn new(
        py: Python<'_>,
        model: &Model,
        acting: Option<&Acting>,
        reading: Reading,
    ) -> PyResult<Self> {
        if let Some(acting) = acting {
            let Acted { mut simulation, own_columns, fault, calls_python, .. } =
                acting.simulation(py, model)?;
            if reading != Reading::default() {
                simulation.read_only(reading);
            }
            let (experiment, own_sensors) = (Box::new(simulation), own_columns);
            return Ok(Self { experiment, own_sensors, fault, calls_python });
        }
        let made = py.detach(|| prepare_reading(&model.model, reading));
        let experiment = made.map_err(|error| model.refused(py, &error))?;
        let (own_sensors, fault) = (usize::MAX, Arc::default());
        Ok(Self { experiment, own_sensors, fault, calls_python: false })
    }
}

/// Runs a model into arrays: `t`, `step`, `q` and the other tables, `summary`, `text`; `raised`:
/// what a function of `acting` raised.
#[pyfunction]
#[pyo3(signature = (model, record, progress, acting))]
pub(crate) fn simulate<'py>(
    py: Python<'py>,
    model: &Model,
    record: Option<Vec<String>>,
    progress: Option<Py<PyAny>>,
    acting: Option<&Acting>,
) -> PyResult<Bound<'py, PyDict>> {
    let kept = KeptNode::of(record)?;
    let mut watch = Watch::new(progress);
    let ready = Ready::new(py, model, acting, kept.reading())?;
    let (calls_python, fault) = (ready.calls_python, ready.fault.clone());
    let mut recording = Recording::new(&*ready.experiment, kept, ready.own_sensors);
    let nodes = refuse_large(py, model, recording.bytes_of_a_node())?;
    recording.reserve(nodes);
    let run = freed(py, calls_python, || in_memory(model, ready, recording, &mut watch));
    watch.stopped()?;
    let (recording, summary) = run;
    let found = recording.into_python(py)?;
    add_summary(&found, &summary)?;
    if let Err(raised) = fault.told() {
        found.set_item("raised", raised)?;
    }
    Ok(found)
}

/// Nodes of a run to its end; arrays of more than [`MOST`] bytes, `node` for each, are refused.
fn refuse_large(py: Python<'_>, model: &Model, node: u64) -> PyResult<usize> {
    let settings = &model.model.settings;
    let nodes = settings.steps().div_ceil(settings.every.max(1)).saturating_add(1);
    let bytes = nodes.saturating_mul(node);
    if bytes <= MOST {
        return Ok(nodes as usize);
    }
    let words = format!(
        "the arrays of {nodes} nodes take {:.1} GiB, more than {} GiB",
        bytes as f64 / (1_u64 << 30) as f64,
        MOST >> 30
    );
    let remedy = "record fewer nodes by `every`, fewer parts by `record`, or write files by `out`";
    Err(raise(py, "MemoryLack", (words, remedy)))
}

fn in_memory(
    model: &Model,
    ready: Ready,
    mut recording: Recording,
    watch: &mut Watch,
) -> (Recording, Summary) {
    let Ready { mut experiment, fault, .. } = ready;
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
    let mut outcome = outcome.ok().flatten().unwrap_or(RunOutcome::Done);
    if let (RunOutcome::Failed(failure), Some(words)) = (&mut outcome, fault.words()) {
        failure.message = words;
        failure.remedy = "correct the function that acts from outside".into();
    }
    let summary = clock.summary(&builder, &model.model, &*experiment, Ended::By(&outcome));
    (recording, summary)
}

fn add_summary(found: &Bound<'_, PyDict>, summary: &Summary) -> PyResult<()> {
    let value = serde_json::to_value(summary).unwrap_or_default();
    found.set_item("summary", json(found.py(), &value)?)?;
    found.set_item("text", text::run(summary))
}

/// How files are written: whether others are replaced, steps between two checkpoints, whether plots
/// and a page are drawn.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Writing {
    force: bool,
    checkpoint_every: Option<u64>,
    report: bool,
}

/// Runs a model with the files of `holonom run` in `folder`; the summary.
#[pyfunction]
#[pyo3(signature = (model, folder, how, progress, acting))]
pub(crate) fn simulate_into<'py>(
    py: Python<'py>,
    model: &Model,
    folder: PathBuf,
    how: Writing,
    progress: Option<Py<PyAny>>,
    acting: Option<&Acting>,
) -> PyResult<Bound<'py, PyAny>> {
    let Writing { force, checkpoint_every, report } = how;
    let asked = AskedRun { progress, checkpoint_every, report };
    let Ready { mut experiment, fault, calls_python, .. } =
        Ready::new(py, model, acting, Reading::default())?;
    let run = freed(py, calls_python, || {
        asked.follow(|control| {
            RunFolder::takes_meshes(&folder, &model.model.meshes)?;
            let folder = RunFolder::create(&folder, force)?;
            Ok(run_with(&model.model, &mut *experiment, &folder, control)?)
        })
    });
    fault.told()?;
    run.answer(py)
}

/// Continues an interrupted run of a folder; the summary.
#[pyfunction]
#[pyo3(signature = (folder, checkpoint_every, progress, acting))]
pub(crate) fn resume<'py>(
    py: Python<'py>,
    folder: PathBuf,
    checkpoint_every: Option<u64>,
    progress: Option<Py<PyAny>>,
    acting: Option<&Acting>,
) -> PyResult<Bound<'py, PyAny>> {
    let asked = AskedRun { progress, checkpoint_every, report: true };
    let model = Model::read(py, folder.join("model.toml"), Vec::new())?;
    let Ready { mut experiment, fault, calls_python, .. } =
        Ready::new(py, &model, acting, Reading::default())?;
    let run = freed(py, calls_python, || {
        asked.follow(|control| {
            let folder = RunFolder::reopen(&folder)?;
            let found = folder.read_checkpoint(&folder.model_text())?;
            continue_run(&model.model, &mut *experiment, &folder, found.checkpoint, control)
        })
    });
    fault.told()?;
    run.answer(py)
}

/// What a run with files is asked for.
struct AskedRun {
    progress: Option<Py<PyAny>>,
    checkpoint_every: Option<u64>,
    report: bool,
}

/// How it ended.
struct FollowedRun {
    run: Result<Finished, ContinueError>,
    watch: Watch,
}

impl AskedRun {
    fn follow(
        self,
        go: impl FnOnce(RunControl<'_>) -> Result<Finished, ContinueError>,
    ) -> FollowedRun {
        let mut watch = Watch::new(self.progress);
        let place = Cell::new((0, u64::MAX)); // where the run is, told before it asks
        let mut interrupted = || {
            let (step, of) = place.get();
            !watch.proceed(step, of)
        };
        let run = go(RunControl {
            progress: &mut |step, of| place.set((step, of)),
            notice: &mut |_| {}, // among the warnings of the summary
            interrupted: &mut interrupted,
            checkpoint_every: self.checkpoint_every,
            report: self.report,
            command: None,
        });
        FollowedRun { run, watch }
    }
}

impl FollowedRun {
    fn answer(self, py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
        let finished = self.run.map_err(|error| continued(py, &error))?;
        self.watch.stopped()?;
        json(py, &serde_json::to_value(&finished.summary).unwrap_or_default())
    }
}
