//! The folder of a sweep: that of `holonom sweep`, which either continues.

use crate::errors::{output, raise};
use crate::model::Model;
use crate::verbs::{SweepOrder, plan_of};
use holonom::sweep::{EndedPoint, Manifest, PointStatus, Shard, Sweep, SweepError, begin, collect};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard};

/// A sweep in its folder, whose points one program writes at a time.
#[pyclass(frozen, module = "holonom._core")]
pub(crate) struct SweepFolder {
    folder: PathBuf,
    sweep: Sweep,
    manifest: Mutex<Option<Manifest>>, // none after its end
}

#[pymethods]
impl SweepFolder {
    /// Begins the sweep of a model, or continues it.
    #[new]
    fn new(py: Python<'_>, model: &Model, plan: SweepOrder, folder: PathBuf) -> PyResult<Self> {
        let (plan, source) = (plan_of(py, plan)?, (model.merged(), &model.model.meshes));
        let how = (Shard::WHOLE, false);
        let begun = begin(source, model.overrides.clone(), plan, &folder, how)
            .and_then(|sweep| Ok((sweep.manifest()?, sweep)));
        let (manifest, sweep) = begun.map_err(|error| refused(py, &error))?;
        Ok(Self { folder, sweep, manifest: Mutex::new(Some(manifest)) })
    }

    /// The points that have ended: number, and in a word how.
    fn ended(&self, py: Python<'_>) -> PyResult<Vec<(usize, &'static str, Option<String>)>> {
        let found = self.sweep.ended().map_err(|error| refused(py, &error))?;
        let one = |own: EndedPoint| (own.point, own.status.name(), own.message);
        Ok(found.into_iter().map(one).collect())
    }

    /// The folder of a point.
    fn of_point(&self, number: usize) -> PathBuf {
        self.folder.join(Sweep::name_of(number))
    }

    /// A point has ended.
    fn add(
        &self,
        py: Python<'_>,
        point: usize,
        values: Vec<String>,
        how: (String, Option<String>),
        wall_seconds: f64,
    ) -> PyResult<()> {
        let (status, message) = how;
        let status = match status.as_str() {
            "done" => PointStatus::Done,
            "failed" => PointStatus::Failed,
            _ => PointStatus::Invalid,
        };
        let folder = Sweep::name_of(point);
        let entry = EndedPoint { point, folder, values, status, message, wall_seconds };
        match &mut *self.taken()? {
            Some(manifest) => manifest.push(&entry).map_err(|error| output(py, &error)),
            None => Err(PyRuntimeError::new_err("this sweep has ended")),
        }
    }

    /// Writes `sweep.csv` and `sweep.html`, and leaves the folder to others.
    fn end(&self, py: Python<'_>) -> PyResult<()> {
        drop(self.taken()?.take());
        let written = py.detach(|| collect(&self.folder));
        written.map(drop).map_err(|error| refused(py, &error))
    }
}

impl SweepFolder {
    fn taken(&self) -> PyResult<MutexGuard<'_, Option<Manifest>>> {
        let words = "the manifest of this sweep was left while it was written";
        self.manifest.lock().map_err(|_| PyRuntimeError::new_err(words))
    }
}

fn refused(py: Python<'_>, error: &SweepError) -> PyErr {
    match error {
        SweepError::Output(error) => output(py, error),
        other => raise(py, "OutputExists", (other.to_string(), "choose another folder")),
    }
}
