//! One step after another, with inputs that are held over a step.

use crate::errors::raise;
use crate::model::Model;
use crate::watch::Watch;
use holonom::experiment::Experiment;
use holonom::model::{Sensor, SensorKind};
use holonom::{Input, InputPlace, RunFailure, RunState, Simulation};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::{PyBaseException, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::sync::{Mutex, MutexGuard, TryLockError};

/// The state between two steps with the inputs held, as it is stored.
type Stored = (RunState, Vec<f64>);

/// A simulation that is stepped by hand.
#[pyclass(frozen, module = "holonom._core")]
pub(crate) struct Stepper {
    run: Mutex<Run>,
    inputs: Vec<Input>,
    observed: Vec<usize>, // columns of sensors
    width: usize,         // of all inputs
    start: Stored,
}

struct Run {
    simulation: Simulation,
}

/// Nodes that were seen.
#[derive(Default)]
struct Seen {
    times: Vec<f64>,
    q: Vec<f64>,
    values: Vec<f64>,
}

/// Times, coordinates, what is observed; the exception that ended the steps.
type Advanced<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Option<Py<PyBaseException>>,
);

/// Where an input acts, by its name: `joint`, `joint.0`, `body.force`, `body.torque`.
fn place(model: &holonom::Model, name: &str) -> InputPlace {
    let joint = |name: &str| model.joints.iter().any(|joint| joint.name == name);
    if joint(name) {
        return InputPlace::Joint { name: name.into(), freedom: 0 };
    }
    match name.rsplit_once('.') {
        Some((of, "force")) => InputPlace::Force(of.into()),
        Some((of, "torque")) => InputPlace::Torque(of.into()),
        Some((of, number)) if joint(of) && number.parse::<usize>().is_ok() => {
            InputPlace::Joint { name: of.into(), freedom: number.parse().unwrap_or_default() }
        }
        _ => InputPlace::Joint { name: name.into(), freedom: 0 },
    }
}

/// The model with sensors of what is observed, and their columns: those of a sensor or one of them,
/// `joint`, `joint.rate`.
fn observed(
    py: Python<'_>,
    model: &holonom::Model,
    names: &[String],
) -> PyResult<(holonom::Model, Vec<usize>)> {
    let mut model = model.clone();
    let first = holonom::sensor::columns(&model).len();
    let known: Vec<(String, String)> = holonom::sensor::columns(&model)
        .iter()
        .map(|column| (column.sensor.clone(), column.name()))
        .collect();
    let (mut columns, mut next) = (Vec::new(), first);
    for name in names {
        let own: Vec<usize> =
            (0..first).filter(|&k| known[k].0 == *name || known[k].1 == *name).collect();
        if !own.is_empty() {
            columns.extend(own);
            continue;
        }
        let rate = name.strip_suffix(".rate");
        let (joint, kind) = match rate {
            Some(joint) => (joint, SensorKind::JointRate),
            None => (name.as_str(), SensorKind::JointCoordinate),
        };
        if model.joint(joint).is_none() {
            let words = format!(
                "observe: `{name}` is neither a sensor, one of its columns, a joint nor the `.rate` of one"
            );
            return Err(raise(py, "UnknownName", (words,)));
        }
        model.sensors.push(Sensor::new(format!("observe {name}"), kind, joint.to_owned()));
        let count = holonom::sensor::columns(&model).len() - next;
        columns.extend(next..next + count);
        next += count;
    }
    Ok((model, columns))
}

#[pymethods]
impl Stepper {
    #[new]
    fn new(
        py: Python<'_>,
        model: &Model,
        inputs: Vec<String>,
        observe: Vec<String>,
    ) -> PyResult<Self> {
        let (sensed, observed) = observed(py, &model.model, &observe)?;
        let inputs: Vec<Input> =
            inputs.iter().map(|name| Input::new(place(&sensed, name))).collect();
        let made = py.detach(|| Simulation::with_inputs(&sensed, &inputs));
        let simulation = made.map_err(|error| model.refused(py, &error))?;
        let width = inputs.iter().map(Input::len).sum();
        let start = (simulation.state(), vec![0.0; width]);
        let run = Mutex::new(Run { simulation });
        Ok(Self { run, inputs, observed, width, start })
    }

    /// Takes `count` steps with these inputs held; without them those of before. The time.
    fn step(
        &self,
        py: Python<'_>,
        inputs: Option<PyReadonlyArray1<'_, f64>>,
        count: u64,
    ) -> PyResult<f64> {
        let mut run = self.taken()?;
        if let Some(inputs) = inputs {
            self.hold(inputs.as_slice()?)?;
        }
        // a step is shorter than it takes to release the interpreter
        let taken = match count {
            0 | 1 => (0..count).try_for_each(|_| run.simulation.step_on()),
            _ => {
                let run = &mut *run;
                steps(py, run, count)?
            }
        };
        taken.map_err(|failure| failed(py, &failure))?;
        Ok(Experiment::place(&run.simulation).1)
    }

    /// Takes steps, with a row of `controls` for each where there are some: times, coordinates and
    /// what is observed at every `every`-th node and the last one; why the steps end early.
    fn advance<'py>(
        &self,
        py: Python<'py>,
        controls: Option<PyReadonlyArray2<'_, f64>>,
        steps: usize,
        every: usize,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Advanced<'py>> {
        let mut run = self.taken()?;
        let controls = controls.as_ref().map(|rows| rows.as_slice()).transpose()?;
        if let Some(value) = controls.and_then(|all| all.iter().find(|value| !value.is_finite())) {
            return Err(PyValueError::new_err(format!("controls: {value} is not finite")));
        }
        let mut watch = Watch::new(progress);
        let (mut seen, width) = (Seen::default(), self.width);
        let run = &mut *run;
        let failure = py.detach(|| {
            for n in 0..=steps {
                if n % every.max(1) == 0 || n == steps {
                    self.see(run, &mut seen)?;
                }
                if n == steps || !watch.proceed(n as u64, steps as u64) {
                    return Ok(());
                }
                if let Some(controls) = controls {
                    self.set(&controls[n * width..(n + 1) * width]);
                }
                run.simulation.step_on()?;
            }
            Ok(())
        });
        watch.stopped()?;
        let Seen { times, q, values } = seen;
        let array = |values: Vec<f64>| {
            let rows = times.len();
            let columns = values.len() / rows.max(1);
            let array = Array2::from_shape_vec((rows, columns), values);
            array
                .map(|array| array.into_pyarray(py))
                .map_err(|error| PyRuntimeError::new_err(error.to_string()))
        };
        let (q, values) = (array(q)?, array(values)?);
        let failure = failure.err().map(|failure| failed(py, &failure).into_value(py));
        Ok((PyArray1::from_vec(py, times), q, values, failure))
    }

    /// What is observed at the present node.
    fn observe<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut run = self.taken()?;
        Ok(PyArray1::from_vec(py, self.read(py, &mut run)?))
    }

    /// Time, s; steps taken.
    fn place(&self) -> PyResult<(u64, f64)> {
        Ok(Experiment::place(&self.taken()?.simulation))
    }

    /// The configuration.
    fn q<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(PyArray1::from_slice(py, self.taken()?.simulation.configuration()))
    }

    /// Names of the coordinates.
    fn columns(&self) -> PyResult<Vec<String>> {
        let run = self.taken()?;
        let members = run.simulation.members().iter();
        let of = |member: &holonom::Member| {
            let columns = member.kind.columns().iter();
            columns.map(|column| format!("{}.{column}", member.name)).collect::<Vec<_>>()
        };
        Ok(members.flat_map(of).collect())
    }

    /// The parts of the energy of the present node with their names.
    fn energy(&self, py: Python<'_>) -> PyResult<(Vec<String>, Vec<f64>)> {
        let mut run = self.taken()?;
        let found = run.simulation.observe().map(|sample| sample.energies.clone());
        let values = found.map_err(|failure| failed(py, &failure))?;
        Ok((run.simulation.energy_columns().to_vec(), values))
    }

    /// Columns of all inputs.
    #[getter]
    fn width(&self) -> usize {
        self.width
    }

    /// The state between two steps, with the inputs held.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let held = self.inputs.iter().flat_map(|input| input.values()[..input.len()].to_vec());
        let stored: Stored = (self.taken()?.simulation.state(), held.collect());
        let bytes = postcard::to_allocvec(&stored)
            .map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Continues from a state.
    fn restore(&self, py: Python<'_>, state: &[u8]) -> PyResult<()> {
        let stored: Stored = postcard::from_bytes(state).map_err(|error| {
            raise(py, "StateMismatch", (format!("these bytes are no state: {error}"),))
        })?;
        self.resume(py, stored)
    }

    /// Back to the start.
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        self.resume(py, self.start.clone())
    }
}

impl Stepper {
    /// The run, which is asked for by one call at a time.
    fn taken(&self) -> PyResult<MutexGuard<'_, Run>> {
        match self.run.try_lock() {
            Ok(run) => Ok(run),
            Err(TryLockError::WouldBlock) => {
                Err(PyRuntimeError::new_err("this stepper is at work in another call"))
            }
            Err(TryLockError::Poisoned(_)) => {
                Err(PyRuntimeError::new_err("this stepper panicked: make another one"))
            }
        }
    }

    fn hold(&self, values: &[f64]) -> PyResult<()> {
        if values.len() != self.width {
            let words = format!("inputs: shape ({},), not ({},)", self.width, values.len());
            return Err(PyValueError::new_err(words));
        }
        if let Some(value) = values.iter().find(|value| !value.is_finite()) {
            return Err(PyValueError::new_err(format!("inputs: {value} is not finite")));
        }
        self.set(values);
        Ok(())
    }

    /// Holds these values, of the right number.
    fn set(&self, values: &[f64]) {
        let mut rest = values;
        for input in &self.inputs {
            let (own, others) = rest.split_at(input.len());
            input.set(own);
            rest = others;
        }
    }

    /// Adds the present node.
    fn see(&self, run: &mut Run, seen: &mut Seen) -> Result<(), RunFailure> {
        seen.times.push(Experiment::place(&run.simulation).1);
        seen.q.extend_from_slice(run.simulation.configuration());
        seen.values.extend(self.sensed(run)?);
        Ok(())
    }

    fn sensed(&self, run: &mut Run) -> Result<Vec<f64>, RunFailure> {
        if self.observed.is_empty() {
            return Ok(Vec::new());
        }
        let sample = run.simulation.observe()?;
        Ok(self.observed.iter().map(|&column| sample.sensors[column]).collect())
    }

    fn read(&self, py: Python<'_>, run: &mut Run) -> PyResult<Vec<f64>> {
        self.sensed(run).map_err(|failure| failed(py, &failure))
    }

    fn resume(&self, py: Python<'_>, (state, held): Stored) -> PyResult<()> {
        let mut run = self.taken()?;
        if held.len() != self.width {
            let words = format!("the state has {} inputs, this stepper {}", held.len(), self.width);
            return Err(raise(py, "StateMismatch", (words,)));
        }
        let resumed = run.simulation.resume(state);
        resumed.map_err(|error| raise(py, "StateMismatch", (error.to_string(),)))?;
        self.hold(&held)
    }
}

/// Takes steps with the interpreter released.
fn steps(py: Python<'_>, run: &mut Run, count: u64) -> PyResult<Result<(), RunFailure>> {
    let mut watch = Watch::new(None);
    let taken = py.detach(|| {
        for n in 0..count {
            if !watch.proceed(n, count) {
                break;
            }
            run.simulation.step_on()?;
        }
        Ok(())
    });
    watch.stopped()?;
    Ok(taken)
}

fn failed(py: Python<'_>, failure: &RunFailure) -> PyErr {
    let RunFailure { step, t, message, remedy } = failure;
    raise(py, "RunFailed", (*step, *t, message, remedy))
}
