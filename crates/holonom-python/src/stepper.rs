//! One step after another, with inputs that are held over a step.

use crate::acting::{Acted, Acting, check_finite, hold, numbers};
use crate::errors::{raise, taken};
use crate::fault::PythonFault;
use crate::model::Model;
use crate::watch::Watch;
use holonom::experiment::RunnableModel;
use holonom::{Input, JointStart, RunFailure, RunState, Simulation};
use numpy::ndarray::Array2;
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyBaseException, PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyEllipsis};
use std::sync::{Mutex, MutexGuard};

/// A simulation that is stepped by hand.
#[pyclass(frozen, module = "holonom._core")]
pub(crate) struct Stepper {
    model: Py<Model>,
    acting: Py<Acting>,
    run: Mutex<StartedRun>,
    width: usize, // of all inputs that are named
}

/// A run with its start.
pub(crate) struct StartedRun {
    acted: Acted,
    start: RunState,
    before: Vec<f64>, // by all inputs, before a step
    seen: Vec<f64>,   // what is observed
}

impl StartedRun {
    pub(crate) fn new(acted: Acted) -> Self {
        let start = acted.simulation.state();
        Self { acted, start, before: Vec::new(), seen: Vec::new() }
    }

    /// Columns of the inputs that are named.
    pub(crate) fn width(&self) -> usize {
        self.acted.width
    }

    /// Steps taken, and the time.
    pub(crate) fn place(&self) -> (u64, f64) {
        RunnableModel::place(&self.acted.simulation)
    }

    /// Coordinates of the present node.
    pub(crate) fn configuration(&self) -> &[f64] {
        self.acted.simulation.configuration()
    }

    /// The state between two steps, with what inputs hold.
    pub(crate) fn state(&self) -> RunState {
        self.acted.simulation.state()
    }

    /// Continues from the bytes of a state.
    pub(crate) fn restore(&mut self, py: Python<'_>, state: &[u8]) -> PyResult<()> {
        restore(py, &mut self.acted.simulation, state)
    }

    /// Back to the start of the model.
    pub(crate) fn begin_again(&mut self, py: Python<'_>) -> PyResult<()> {
        let begun = self.acted.simulation.resume(self.start.clone());
        begun.map_err(|error| raise(py, "StateMismatch", (error.to_string(),)))
    }

    /// Goes on with another run; the start stays.
    pub(crate) fn replace(&mut self, acted: Acted) {
        self.acted = acted;
    }

    /// The inputs that are named.
    pub(crate) fn named(&self) -> &[Input] {
        let Acted { inputs, width, .. } = &self.acted;
        let mut count = 0;
        let own = inputs.iter().take_while(|input| {
            count += input.len();
            count <= *width
        });
        &inputs[..own.count()]
    }

    /// Takes a step.
    pub(crate) fn step(&mut self) -> Result<(), RunFailure> {
        self.acted.simulation.step_on()
    }

    /// Keeps what inputs hold for [`StartedRun::take_back`].
    pub(crate) fn remember(&mut self) {
        self.before.clear();
        for input in &self.acted.inputs {
            self.before.extend_from_slice(&input.values()[..input.len()]);
        }
    }

    /// Holds that again.
    pub(crate) fn take_back(&self) {
        hold(&self.acted.inputs, &self.before);
    }

    /// What is observed at the present node.
    pub(crate) fn sense(&mut self) -> Result<&[f64], RunFailure> {
        let Self { acted: Acted { simulation, observed, .. }, seen, .. } = self;
        seen.clear();
        if !observed.is_empty() {
            let sensed = simulation.sense()?;
            seen.extend(observed.iter().map(|&column| sensed[column]));
        }
        Ok(seen)
    }
}

/// Nodes that were seen.
#[derive(Default)]
struct SeenNodes {
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

#[pymethods]
impl Stepper {
    #[new]
    fn new(py: Python<'_>, model: Py<Model>, acting: Py<Acting>) -> PyResult<Self> {
        let acted = acting.get().stepper(py, model.get(), JointStart::default())?;
        let width = acted.width;
        Ok(Self { model, acting, run: Mutex::new(StartedRun::new(acted)), width })
    }

    /// Takes `count` steps with these inputs held; without them those of before. The time.
    fn step(&self, py: Python<'_>, inputs: Option<&Bound<'_, PyAny>>, count: i64) -> PyResult<f64> {
        let Ok(count) = u64::try_from(count) else {
            return Err(PyValueError::new_err(format!("n: {count} steps cannot be taken")));
        };
        let mut run = self.taken()?;
        run.remember();
        if let Some(inputs) = inputs {
            self.hold(&run, &vector(inputs)?)?;
        }
        let run = &mut *run;
        // a step is shorter than it takes to release the interpreter
        let taken = match count {
            0 | 1 => (0..count).try_for_each(|_| run.step()),
            _ => {
                let mut watch = Watch::new(None);
                let taken = freed(py, run.acted.calls_python, || {
                    for n in 0..count {
                        if !watch.proceed(n, count) {
                            break;
                        }
                        if n > 0 {
                            run.remember();
                        }
                        run.step()?;
                    }
                    Ok(())
                });
                watch.stopped()?;
                taken
            }
        };
        if let Err(failure) = taken {
            run.take_back();
            return Err(failed(py, &failure, &run.acted.fault));
        }
        Ok(RunnableModel::place(&run.acted.simulation).1)
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
        controls.map_or(Ok(()), |all| check_finite("controls", all))?;
        let mut watch = Watch::new(progress);
        let (mut seen, width) = (SeenNodes::default(), self.width);
        let run = &mut *run;
        let failure = freed(py, run.acted.calls_python, || {
            for n in 0..=steps {
                if n % every.max(1) == 0 || n == steps {
                    see(run, &mut seen)?;
                }
                if n == steps || !watch.proceed(n as u64, steps as u64) {
                    return Ok(());
                }
                run.remember();
                if let Some(controls) = controls {
                    hold(run.named(), &controls[n * width..(n + 1) * width]);
                }
                run.step().inspect_err(|_| run.take_back())?;
            }
            Ok(())
        });
        watch.stopped()?;
        let SeenNodes { times, q, values } = seen;
        let array = |values: Vec<f64>| {
            let rows = times.len();
            let columns = values.len() / rows.max(1);
            let array = Array2::from_shape_vec((rows, columns), values);
            array
                .map(|array| array.into_pyarray(py))
                .map_err(|error| PyRuntimeError::new_err(error.to_string()))
        };
        let (q, values) = (array(q)?, array(values)?);
        let failure = failure.err().map(|failure| {
            let error = failed(py, &failure, &run.acted.fault);
            error.into_value(py)
        });
        Ok((PyArray1::from_vec(py, times), q, values, failure))
    }

    /// What is observed at the present node, in an array of its own or in `out`.
    fn observe<'py>(
        &self,
        py: Python<'py>,
        out: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut run = self.taken()?;
        let run = &mut *run;
        if let Err(failure) = run.sense() {
            return Err(failed(py, &failure, &run.acted.fault));
        }
        let Some(out) = out else { return Ok(PyArray1::from_slice(py, &run.seen).into_any()) };
        let array = out.cast::<PyArray1<f64>>().ok().and_then(|own| own.try_readwrite().ok());
        match array {
            Some(mut array) if array.len() == run.seen.len() && array.is_contiguous() => {
                array.as_slice_mut()?.copy_from_slice(&run.seen);
            }
            _ => {
                let wanted = (run.seen.len(),);
                let shape = out.getattr("shape").map_err(|_| {
                    let kind = out.get_type();
                    PyTypeError::new_err(format!("out: an array of shape {wanted:?}, not {kind}"))
                })?;
                if !shape.eq(wanted)? {
                    let words = format!("out: shape {wanted:?}, not {shape}");
                    return Err(PyValueError::new_err(words));
                }
                out.set_item(PyEllipsis::get(py), PyArray1::from_slice(py, &run.seen))?;
            }
        }
        Ok(out)
    }

    /// Panics within a step, so that tests see what becomes of it.
    fn _panic(&self) -> PyResult<()> {
        let _run = self.taken()?;
        panic!("asked for by a test");
    }

    /// Steps taken, and the time.
    fn place(&self) -> PyResult<(u64, f64)> {
        Ok(self.taken()?.place())
    }

    /// Coordinates of the present node.
    fn q<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(PyArray1::from_slice(py, self.taken()?.acted.simulation.configuration()))
    }

    /// Their velocities.
    fn v<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut run = self.taken()?;
        let Acted { simulation, fault, .. } = &mut run.acted;
        let found = simulation.velocity().map_err(|failure| failed(py, &failure, fault))?;
        Ok(PyArray1::from_slice(py, found))
    }

    /// Names of the coordinates.
    fn columns(&self) -> PyResult<Vec<String>> {
        let run = self.taken()?;
        let members = run.acted.simulation.members().iter();
        let of = |member: &holonom::Member| {
            let columns = member.kind.columns().iter();
            columns.map(|column| format!("{}.{column}", member.name)).collect::<Vec<_>>()
        };
        Ok(members.flat_map(of).collect())
    }

    /// Names and units of what is observed.
    fn observed(&self) -> PyResult<(Vec<String>, Vec<&'static str>)> {
        Ok(self.taken()?.acted.labels.iter().cloned().unzip())
    }

    /// The parts of the energy of the present node with their names.
    fn energy(&self, py: Python<'_>) -> PyResult<(Vec<String>, Vec<f64>)> {
        let mut run = self.taken()?;
        let Acted { simulation, fault, .. } = &mut run.acted;
        let found = simulation.observe().map(|sample| sample.energies.clone());
        let values = found.map_err(|failure| failed(py, &failure, fault))?;
        Ok((simulation.energy_columns().to_vec(), values))
    }

    /// Columns of all inputs.
    #[getter]
    fn width(&self) -> usize {
        self.width
    }

    /// What the inputs hold.
    fn held(&self) -> PyResult<Vec<f64>> {
        let run = self.taken()?;
        Ok(run.named().iter().flat_map(|input| input.values()[..input.len()].to_vec()).collect())
    }

    /// The state between two steps, with what inputs hold.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.taken()?.state().to_bytes()))
    }

    /// Continues from a state.
    fn restore(&self, py: Python<'_>, state: &[u8]) -> PyResult<()> {
        self.taken()?.restore(py, state)
    }

    /// Back to the start, that of these coordinates and rates of joints where there are some.
    fn reset(
        &self,
        py: Python<'_>,
        joints: Vec<(String, usize, f64)>,
        rates: Vec<(String, usize, f64)>,
    ) -> PyResult<()> {
        let mut run = self.taken()?;
        if joints.is_empty() && rates.is_empty() {
            return run.begin_again(py);
        }
        let start = JointStart { coordinates: joints, rates };
        run.replace(self.acting.get().stepper(py, self.model.get(), start)?);
        Ok(())
    }
}

impl Stepper {
    /// The run, which is asked for by one call at a time.
    fn taken(&self) -> PyResult<MutexGuard<'_, StartedRun>> {
        taken(&self.run, "stepper")
    }

    fn hold(&self, run: &StartedRun, values: &[f64]) -> PyResult<()> {
        if values.len() != self.width {
            let words = format!("inputs: shape ({},), not ({},)", self.width, values.len());
            return Err(PyValueError::new_err(words));
        }
        check_finite("inputs", values)?;
        hold(run.named(), values);
        Ok(())
    }
}

/// A simulation continues from the bytes of a state.
pub(crate) fn restore(py: Python<'_>, simulation: &mut Simulation, state: &[u8]) -> PyResult<()> {
    let state = RunState::from_bytes(state).map_err(|error| error.to_string());
    let resumed =
        state.and_then(|state| simulation.resume(state).map_err(|error| error.to_string()));
    resumed.map_err(|words| raise(py, "StateMismatch", (words,)))
}

/// Calls with the interpreter released, where no function of Python is called within.
pub(crate) fn freed<T: Send>(
    py: Python<'_>,
    calls_python: bool,
    call: impl FnOnce() -> T + Send,
) -> T {
    if calls_python { call() } else { py.detach(call) }
}

/// Adds the present node.
fn see(run: &mut StartedRun, seen: &mut SeenNodes) -> Result<(), RunFailure> {
    seen.times.push(RunnableModel::place(&run.acted.simulation).1);
    seen.q.extend_from_slice(run.acted.simulation.configuration());
    seen.values.extend_from_slice(run.sense()?);
    Ok(())
}

/// Inputs as an array, a list or a number.
fn vector(given: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    numbers(given).or_else(|error| {
        let numpy = given.py().import("numpy")?;
        let Ok(array) = numpy.call_method1("asarray", (given,)) else { return Err(error) };
        if array.getattr("ndim")?.extract::<usize>()? == 1 {
            return Err(error);
        }
        let shape = array.getattr("shape")?;
        Err(PyValueError::new_err(format!("inputs: shape (m,), not {shape}")))
    })
}

/// What a function raised, or a run that failed.
fn failed(py: Python<'_>, failure: &RunFailure, fault: &PythonFault) -> PyErr {
    if let Err(error) = fault.told() {
        return error;
    }
    let RunFailure { step, t, message, remedy } = failure;
    raise(py, "RunFailed", (*step, *t, message, remedy))
}
