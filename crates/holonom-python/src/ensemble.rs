//! Many steppers of one kind, a step of all in one call.
//!
//! A member takes the steps of a [`crate::stepper::Stepper`], whoever is beside it and however many
//! threads there are. One that fails stays where it failed until it is reset.

use crate::acting::{Acting, check_finite, hold};
use crate::errors::{raise, taken};
use crate::model::Model;
use crate::stepper::{StartedRun, freed};
use crate::watch::Watch;
use holonom::{JointStart, RunFailure};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::sync::{Mutex, MutexGuard};
use std::thread;

/// Steps of all members between two questions for signals, and the fewest that are worth a thread.
const PORTION: usize = 4096;

/// Steppers beside one another.
#[pyclass(frozen, module = "holonom._core")]
pub(crate) struct Ensemble {
    models: Vec<Py<Model>>,
    acting: Py<Acting>,
    members: Mutex<Vec<MemberRun>>,
    width: usize,
}

struct MemberRun {
    run: StartedRun,
    failure: Option<RunFailure>,
}

impl MemberRun {
    fn advance(&mut self, row: Option<&[f64]>, count: usize) {
        if self.failure.is_some() {
            return;
        }
        self.run.remember();
        if let Some(row) = row {
            hold(self.run.named(), row);
        }
        for _ in 0..count {
            if let Err(failure) = self.run.step() {
                self.run.take_back();
                self.failure = Some(failure);
                return;
            }
            self.run.remember();
        }
    }
}

#[pymethods]
impl Ensemble {
    #[new]
    fn new(py: Python<'_>, models: Vec<Py<Model>>, acting: Py<Acting>) -> PyResult<Self> {
        let start = JointStart::default;
        let one = |model: &Py<Model>| {
            let acted = acting.get().stepper(py, model.get(), start())?;
            Ok(MemberRun { run: StartedRun::new(acted), failure: None })
        };
        let members: Vec<MemberRun> = models.iter().map(one).collect::<PyResult<_>>()?;
        let width = members.first().map_or(0, |member| member.run.width());
        Ok(Self { models, acting, members: Mutex::new(members), width })
    }

    /// Takes `count` steps of all with these inputs held, a row for each; without them those of
    /// before. The times.
    fn step<'py>(
        &self,
        py: Python<'py>,
        inputs: Option<PyReadonlyArray2<'_, f64>>,
        count: usize,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut members = self.taken()?;
        let rows = inputs.as_ref().map(|rows| rows.as_slice()).transpose()?;
        rows.map_or(Ok(()), |all| check_finite("inputs", all))?;
        let (members, width) = (&mut members[..], self.width);
        let mut watch = Watch::new(None);
        freed(py, false, || {
            let portion = (PORTION / members.len().max(1)).max(1);
            let mut taken = 0;
            while taken < count && watch.proceed(taken as u64, count as u64) {
                let steps = portion.min(count - taken);
                let rows = rows.filter(|_| taken == 0);
                all(members, rows, width, steps, threads);
                taken += steps;
            }
        });
        watch.stopped()?;
        let times = members.iter().map(|member| member.run.place().1);
        Ok(PyArray1::from_iter(py, times))
    }

    /// What is observed at the present nodes.
    fn observe<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let mut members = self.taken()?;
        let mut seen = Vec::new();
        for member in members.iter_mut() {
            match member.run.sense() {
                Ok(own) => seen.extend_from_slice(own),
                Err(failure) => return Err(failed(py, &failure)),
            }
        }
        table(py, seen, members.len())
    }

    /// Coordinates of the present nodes.
    fn q<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let members = self.taken()?;
        let all = members.iter().flat_map(|member| member.run.configuration().to_vec());
        table(py, all.collect(), members.len())
    }

    /// Panics within a step, so that tests see what becomes of it.
    fn _panic(&self) -> PyResult<()> {
        let _members = self.taken()?;
        panic!("asked for by a test");
    }

    /// Steps taken and the time of each.
    fn places(&self) -> PyResult<Vec<(u64, f64)>> {
        Ok(self.taken()?.iter().map(|member| member.run.place()).collect())
    }

    /// Members that failed, and why.
    fn failures(&self, py: Python<'_>) -> PyResult<Vec<(usize, Py<PyAny>)>> {
        let members = self.taken()?;
        let failed_ones = members.iter().enumerate().filter_map(|(k, member)| {
            let failure = member.failure.as_ref()?;
            Some((k, failed(py, failure).into_value(py).into_any()))
        });
        Ok(failed_ones.collect())
    }

    /// Columns of all inputs.
    #[getter]
    fn width(&self) -> usize {
        self.width
    }

    /// A member goes back to its start, that of these coordinates and rates of joints where there
    /// are some.
    fn reset(
        &self,
        py: Python<'_>,
        member: usize,
        joints: Vec<(String, usize, f64)>,
        rates: Vec<(String, usize, f64)>,
    ) -> PyResult<()> {
        let mut members = self.taken()?;
        let (own, model) = (&mut members[member], self.models[member].get());
        if joints.is_empty() && rates.is_empty() {
            own.run.begin_again(py)?;
        } else {
            let start = JointStart { coordinates: joints, rates };
            own.run.replace(self.acting.get().stepper(py, model, start)?);
        }
        own.failure = None;
        Ok(())
    }

    /// The state of a member.
    fn state<'py>(&self, py: Python<'py>, member: usize) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.taken()?[member].run.state().to_bytes()))
    }

    /// A member continues from a state.
    fn restore(&self, py: Python<'_>, member: usize, state: &[u8]) -> PyResult<()> {
        let own = &mut self.taken()?[member];
        own.run.restore(py, state)?;
        own.failure = None;
        Ok(())
    }
}

impl Ensemble {
    fn taken(&self) -> PyResult<MutexGuard<'_, Vec<MemberRun>>> {
        taken(&self.members, "ensemble")
    }
}

/// Steps of all members on some threads.
fn all(
    members: &mut [MemberRun],
    rows: Option<&[f64]>,
    width: usize,
    steps: usize,
    threads: usize,
) {
    let row = |k: usize| rows.map(|rows| &rows[k * width..(k + 1) * width]);
    let worth = members.len() * steps / (PORTION / 4);
    let threads = threads.min(worth).min(members.len()).max(1);
    let share = members.len().div_ceil(threads).max(1);
    if threads == 1 {
        members.iter_mut().enumerate().for_each(|(k, own)| own.advance(row(k), steps));
        return;
    }
    thread::scope(|scope| {
        for (part, chunk) in members.chunks_mut(share).enumerate() {
            scope.spawn(move || {
                for (k, own) in chunk.iter_mut().enumerate() {
                    own.advance(row(part * share + k), steps);
                }
            });
        }
    });
}

fn table(py: Python<'_>, values: Vec<f64>, rows: usize) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let columns = values.len() / rows.max(1);
    let array = Array2::from_shape_vec((rows, columns), values);
    let array = array.map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
    Ok(array.into_pyarray(py))
}

fn failed(py: Python<'_>, RunFailure { step, t, message, remedy }: &RunFailure) -> PyErr {
    raise(py, "RunFailed", (*step, *t, message, remedy))
}
