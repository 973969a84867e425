//! What Python lets act on a run: inputs, laws, forces of bodies, paths, a controller.
//!
//! A function of Python is called with the interpreter kept. What it raises, and a number that is
//! not finite, is kept as the fault of the run: the step is refused, the state stays, and nothing
//! is called again until the fault has been told.

use crate::errors::raise;
use crate::fault::PythonFault;
use crate::law::{CompiledLaw, PythonLaw};
use crate::model::Model;
use holonom::experiment::RunnableModel;
use holonom::model::{Sensor, SensorKind};
use holonom::{
    Controller, ExternalActions, Input, InputPlace, JointStart, NextMidpoint, OutsideLaw,
    OutsideMotion, RunFailure, Simulation,
};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};
use std::ops::Range;
use std::sync::Arc;

/// A coordinate of a joint with a value: joint, which coordinate, value.
type GivenCoordinate = (String, usize, f64);
/// A law: joint or `joint.0`, function, address of machine code or 0, whether it conserves energy.
type LawOf = (String, Py<PyAny>, usize, bool);

/// Name and unit of a number that is observed.
pub(crate) type Label = (String, &'static str);

/// What acts, by its names; nothing is looked up before it meets a model.
#[pyclass(frozen, module = "holonom._core")]
pub(crate) struct Acting {
    inputs: Vec<String>,
    observe: Vec<String>,
    laws: Vec<LawOf>,
    forces: Vec<(String, Py<PyAny>)>,
    motions: Vec<(String, Py<PyAny>)>,
    start: JointStart,
    rows: Option<RunInputs>,
    control: Option<(Py<PyAny>, u64)>,
}

#[pymethods]
impl Acting {
    #[new]
    #[pyo3(signature = (*, inputs, observe, laws, forces, motions, joints, rates, rows, control))]
    #[allow(clippy::too_many_arguments)] // keywords of Python
    fn new(
        inputs: Vec<String>,
        observe: Vec<String>,
        laws: Vec<LawOf>,
        forces: Vec<(String, Py<PyAny>)>,
        motions: Vec<(String, Py<PyAny>)>,
        joints: Vec<GivenCoordinate>,
        rates: Vec<GivenCoordinate>,
        rows: Option<Vec<f64>>,
        control: Option<(Py<PyAny>, u64)>,
    ) -> Self {
        let start = JointStart { coordinates: joints, rates };
        let rows = rows.map(RunInputs);
        Self { inputs, observe, laws, forces, motions, start, rows, control }
    }

    /// Whether functions of Python are called.
    #[getter]
    fn calls_python(&self) -> bool {
        let python = |law: &LawOf| law.2 == 0;
        !self.forces.is_empty()
            || !self.motions.is_empty()
            || self.control.is_some()
            || self.laws.iter().any(python)
    }
}

/// Inputs of the steps of a run, row after row.
#[derive(Clone)]
struct RunInputs(Vec<f64>);

/// A simulation on which something acts.
pub(crate) struct Acted {
    pub(crate) simulation: Simulation,
    /// Those that are named, then those of forces.
    pub(crate) inputs: Vec<Input>,
    /// Columns of sensors that are observed.
    pub(crate) observed: Vec<usize>,
    /// Their names and units.
    pub(crate) labels: Vec<Label>,
    /// Columns of the sensors of the model itself.
    pub(crate) own_columns: usize,
    /// Values of the inputs that are named.
    pub(crate) width: usize,
    pub(crate) fault: Arc<PythonFault>,
    pub(crate) calls_python: bool,
}

impl Acting {
    /// The simulation of a model with all of it, and with all sensors of the model.
    pub(crate) fn simulation(&self, py: Python<'_>, model: &Model) -> PyResult<Acted> {
        self.made(py, model.model.clone(), model, self.start.clone())
    }

    /// The same with those sensors alone that are observed, from a start of joints.
    pub(crate) fn stepper(
        &self,
        py: Python<'_>,
        model: &Model,
        start: JointStart,
    ) -> PyResult<Acted> {
        let mut seen = model.model.clone();
        if seen.events.is_empty() {
            let below = |name: &String, sensor: &str| {
                name.strip_prefix(sensor)
                    .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
            };
            let read = |own: &holonom::model::Sensor| model.model.reads_sensor(&own.name);
            let observed = |own: &str| self.observe.iter().any(|name| below(name, own));
            seen.sensors.retain(|own| read(own) || observed(&own.name));
        }
        self.made(py, seen, model, start)
    }

    fn made(
        &self,
        py: Python<'_>,
        seen: holonom::Model,
        model: &Model,
        start: JointStart,
    ) -> PyResult<Acted> {
        let (sensed, observed, labels) = observed(py, seen, &self.observe)?;
        let own_columns = holonom::sensor::columns(&model.model).len();
        let fault = Arc::new(PythonFault::default());
        let mut inputs: Vec<Input> =
            self.inputs.iter().map(|name| Input::new(place(&sensed, name))).collect();
        let width = inputs.iter().map(Input::len).sum();
        let mut forces = Vec::new();
        for (name, function) in &self.forces {
            let force = Input::new(InputPlace::Force(name.clone()));
            let is_particle = sensed.particles.iter().any(|own| own.name == *name);
            let torque = (!is_particle).then(|| Input::new(InputPlace::Torque(name.clone())));
            inputs.push(force.clone());
            inputs.extend(torque.clone());
            let (function, name) = (function.clone_ref(py), name.clone());
            forces.push(BodyForce { name, function, force, torque, place: 0..0 });
        }
        let laws = self.laws.iter().map(|law| self.law(py, &sensed, law, &fault));
        let motions = self.motions.iter().map(|motion| self.motion(py, motion, &fault));
        let outside = ExternalActions {
            inputs: inputs.clone(),
            laws: laws.collect(),
            motions: motions.collect(),
            start: JointStart {
                coordinates: resolved(&sensed, start.coordinates),
                rates: resolved(&sensed, start.rates),
            },
            ..ExternalActions::default()
        };
        let calls_python = self.calls_python();
        let make = || Simulation::with_outside(&sensed, &outside);
        let made = if calls_python { make() } else { py.detach(make) };
        fault.told()?;
        let mut simulation = made.map_err(|error| model.refused(py, &error))?;
        place_forces(&mut forces, &simulation);
        let control = self.control.as_ref().map(|(function, every)| ControlFunction {
            function: function.clone_ref(py),
            every: (*every).max(1),
            observed: observed.clone(),
            values: vec![0.0; width],
        });
        if control.is_some() || self.rows.is_some() || !forces.is_empty() {
            let named = inputs[..self.inputs.len()].to_vec();
            simulation.control_by(Box::new(Decisions {
                forces,
                control,
                rows: self.rows.clone(),
                inputs: named,
                width,
                middle: NextMidpoint::default(),
                fault: fault.clone(),
            }));
        }
        let acted =
            Acted { simulation, inputs, observed, labels, own_columns, width, fault, calls_python };
        Ok(acted)
    }

    fn law(
        &self,
        py: Python<'_>,
        model: &holonom::Model,
        law: &LawOf,
        fault: &Arc<PythonFault>,
    ) -> OutsideLaw {
        let (of, function, address, conservative) = law;
        let (joint, freedom) = coordinate(model, of, 0);
        let (function, fault) = (function.clone_ref(py), fault.clone());
        let label = format!("the law of joint `{of}`");
        let law: Arc<dyn holonom::vi_multibody::joint_force::JointLaw> = match address {
            0 => Arc::new(PythonLaw::new(label, function, *conservative, fault)),
            _ => Arc::new(CompiledLaw::new(label, *address, function, *conservative, fault)),
        };
        OutsideLaw { joint, freedom, law }
    }

    fn motion(
        &self,
        py: Python<'_>,
        (constraint, function): &(String, Py<PyAny>),
        fault: &Arc<PythonFault>,
    ) -> OutsideMotion {
        let (function, fault) = (function.clone_ref(py), fault.clone());
        let label = format!("the motion of `{constraint}`");
        let path = Arc::new(move |t: f64| {
            fault.guard(
                &label,
                || format!("t = {t}"),
                |py| {
                    let found: [f64; 3] = function.call1(py, (t,))?.extract(py)?;
                    Ok(found)
                },
            )
        });
        OutsideMotion { constraint: constraint.clone(), path }
    }
}

/// The joint and the coordinate of it that `joint` or `joint.0` names.
fn coordinate(model: &holonom::Model, name: &str, freedom: usize) -> (String, usize) {
    let of = name.rsplit_once('.').filter(|(joint, _)| model.joint(joint).is_some());
    let number = of.and_then(|(joint, number)| Some((joint.to_owned(), number.parse().ok()?)));
    number.filter(|_| model.joint(name).is_none()).unwrap_or_else(|| (name.to_owned(), freedom))
}

fn resolved(model: &holonom::Model, given: Vec<GivenCoordinate>) -> Vec<GivenCoordinate> {
    let one = |(name, freedom, value): GivenCoordinate| {
        let (joint, freedom) = coordinate(model, &name, freedom);
        (joint, freedom, value)
    };
    given.into_iter().map(one).collect()
}

/// Where an input acts, by its name: `joint`, `joint.0`, `body.force`, `body.torque`,
/// `joint.motor.path`, that of a `[[control]]`.
fn place(model: &holonom::Model, name: &str) -> InputPlace {
    if let Some(of) = name.strip_suffix(".motor.path") {
        return InputPlace::Setpoint(of.into());
    }
    if model.joint(name).is_some() {
        return InputPlace::Joint { name: name.into(), freedom: 0 };
    }
    if let Some(control) = model.controls.iter().find(|own| own.name == name) {
        return InputPlace::of(control);
    }
    match name.rsplit_once('.') {
        Some((of, "force")) => InputPlace::Force(of.into()),
        Some((of, "torque")) => InputPlace::Torque(of.into()),
        _ => {
            let (name, freedom) = coordinate(model, name, 0);
            InputPlace::Joint { name, freedom }
        }
    }
}

/// The model with sensors of what is observed, and their columns: those of a sensor or one of them,
/// `joint`, `joint.rate`.
fn observed(
    py: Python<'_>,
    mut model: holonom::Model,
    names: &[String],
) -> PyResult<(holonom::Model, Vec<usize>, Vec<Label>)> {
    let known = holonom::sensor::columns(&model);
    let (mut columns, mut labels, mut next) = (Vec::new(), Vec::new(), known.len());
    for name in names {
        let own = known.iter().enumerate();
        let own = own.filter(|(_, own)| own.sensor == *name || own.name() == *name);
        let before = columns.len();
        for (k, own) in own {
            columns.push(k);
            labels.push((own.name(), own.unit));
        }
        if columns.len() > before {
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
        for own in holonom::sensor::columns(&model).split_off(next) {
            let part = if own.part.is_empty() { String::new() } else { format!(".{}", own.part) };
            labels.push((format!("{name}{part}"), own.unit));
            columns.push(next);
            next += 1;
        }
    }
    Ok((model, columns, labels))
}

/// A force of a body by a function.
struct BodyForce {
    name: String,
    function: Py<PyAny>,
    force: Input,
    torque: Option<Input>, // none of a point mass
    place: Range<usize>,   // of its coordinates
}

/// Finds the coordinates of bodies; a name that is none was refused by its input.
fn place_forces(forces: &mut [BodyForce], simulation: &Simulation) {
    let mut first = 0;
    for member in simulation.members() {
        let count = member.kind.columns().len();
        for force in
            forces.iter_mut().filter(|force| is_named(&member.name, &force.name, simulation))
        {
            force.place = first..first + count;
        }
        first += count;
    }
}

/// Whether a member has this name; ends of beams have two.
fn is_named(member: &str, name: &str, simulation: &Simulation) -> bool {
    if member == name {
        return true;
    }
    let nodes = |beam: &str| {
        let own = |own: &&str| own.rsplit_once('.').is_some_and(|(of, _)| of == beam);
        let members = simulation.members().iter().map(|member| member.name.as_str());
        members.filter(own).collect::<Vec<_>>()
    };
    match name.rsplit_once('.') {
        Some((beam, "start")) => nodes(beam).first() == Some(&member),
        Some((beam, "end")) => nodes(beam).last() == Some(&member),
        _ => false,
    }
}

/// A function that decides what inputs hold.
struct ControlFunction {
    function: Py<PyAny>,
    every: u64,
    observed: Vec<usize>,
    values: Vec<f64>,
}

/// What is decided before each step.
struct Decisions {
    forces: Vec<BodyForce>,
    control: Option<ControlFunction>,
    rows: Option<RunInputs>,
    inputs: Vec<Input>, // those that are named
    width: usize,
    middle: NextMidpoint,
    fault: Arc<PythonFault>,
}

/// Refuses numbers that are not finite, by the name of the argument.
pub(crate) fn check_finite(name: &str, values: &[f64]) -> PyResult<()> {
    match values.iter().find(|value| !value.is_finite()) {
        Some(value) => Err(PyValueError::new_err(format!("{name}: {value} is not finite"))),
        None => Ok(()),
    }
}

/// Holds values by inputs, one after the other.
pub(crate) fn hold(inputs: &[Input], values: &[f64]) {
    let mut rest = values;
    for input in inputs {
        if rest.len() < input.len() {
            return;
        }
        let (own, others) = rest.split_at(input.len());
        input.set(own);
        rest = others;
    }
}

impl Controller for Decisions {
    fn decide(&mut self, run: &mut Simulation) -> Result<(), RunFailure> {
        let (step, t) = RunnableModel::place(run);
        if let Some(RunInputs(rows)) = &self.rows {
            let first = (step as usize).saturating_mul(self.width);
            if let Some(row) = rows.get(first..first + self.width) {
                hold(&self.inputs, row);
            }
        }
        if let Some(control) = self.control.as_mut().filter(|own| step.is_multiple_of(own.every)) {
            let sensed = run.sense()?;
            let seen: Vec<f64> = match control.observed.is_empty() {
                true => sensed.to_vec(),
                false => control.observed.iter().map(|column| sensed[*column]).collect(),
            };
            control.decide(t, seen, &self.fault);
            hold(&self.inputs, &control.values);
        }
        if !self.forces.is_empty() && !self.fault.is_set() {
            run.predict(&mut self.middle)?;
            for force in &self.forces {
                force.decide(&self.middle, &self.fault);
            }
        }
        match self.fault.words() {
            None => Ok(()),
            Some(message) => {
                let remedy = "correct the function that acts from outside".to_owned();
                Err(RunFailure { step, t, message, remedy })
            }
        }
    }
}

impl ControlFunction {
    fn decide(&mut self, t: f64, seen: Vec<f64>, fault: &PythonFault) {
        let width = self.values.len();
        let mut found = Vec::new();
        fault.guard(
            "the control",
            || format!("t = {t}"),
            |py| {
                let seen = PyArray1::from_vec(py, seen);
                found = numbers(self.function.call1(py, (t, seen))?.bind(py))?;
                if found.len() != width {
                    let words = format!("inputs: shape ({width},), not ({},)", found.len());
                    return Err(PyValueError::new_err(words));
                }
                Ok([found.iter().sum()]) // whether all are finite
            },
        );
        if !fault.is_set() {
            self.values = found;
        }
    }
}

impl BodyForce {
    fn decide(&self, NextMidpoint { t, q, v }: &NextMidpoint, fault: &PythonFault) {
        let (q, v) = (q[self.place.clone()].to_vec(), v[self.place.clone()].to_vec());
        let label = format!("the force on `{}`", self.name);
        let is_particle = self.torque.is_none();
        let found = fault.guard(
            &label,
            || format!("t = {t}"),
            |py| {
                let found = self.function.call1(py, (*t, BodyState { q, v }))?;
                let found = numbers(found.bind(py))?;
                match *found.as_slice() {
                    [x, y, z] => Ok([x, y, z, 0.0, 0.0, 0.0]),
                    [x, y, z, a, b, c] if !is_particle => Ok([x, y, z, a, b, c]),
                    ref other => {
                        let wanted = if is_particle { "(3,)" } else { "(3,) or (6,)" };
                        let words =
                            format!("force and torque: shape {wanted}, not ({},)", other.len());
                        Err(PyValueError::new_err(words))
                    }
                }
            },
        );
        if !fault.is_set() {
            self.force.set(&found[..3]);
            self.torque.iter().for_each(|torque| torque.set(&found[3..]));
        }
    }
}

/// The numbers of an array, a list or a number.
pub(crate) fn numbers(given: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    if let Ok(array) = given.cast::<PyArray1<f64>>() {
        return array.to_vec().map_err(PyErr::from);
    }
    if given.is_instance_of::<PyList>() || given.is_instance_of::<PyTuple>() {
        return given.extract();
    }
    given.extract::<f64>().map(|number| vec![number]).or_else(|_| given.extract())
}

/// A body, a node of a beam or a point mass at the middle of a step, predicted.
#[pyclass(frozen, module = "holonom._core")]
pub(crate) struct BodyState {
    q: Vec<f64>,
    v: Vec<f64>,
}

impl BodyState {
    fn spatial(values: &[f64]) -> [f64; 3] {
        std::array::from_fn(|k| values.get(k).copied().filter(|_| k < 3).unwrap_or(0.0))
    }

    fn directors_of(&self) -> PyResult<[[f64; 3]; 3]> {
        if self.q.len() != 12 {
            let words = "a point mass has no directors";
            return Err(pyo3::exceptions::PyAttributeError::new_err(words));
        }
        Ok(std::array::from_fn(|i| std::array::from_fn(|k| self.q[3 + 3 * i + k])))
    }
}

#[pymethods]
impl BodyState {
    /// Position of the centre of mass, m, shape `(3,)`.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &Self::spatial(&self.q))
    }

    /// Its velocity, m/s, shape `(3,)`.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &Self::spatial(&self.v))
    }

    /// Directors, 1, shape `(3, 3)`: `directors[i]` is the `i`-th one in space; of a body whose
    /// inertia is a full tensor its principal axes.
    #[getter]
    fn directors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, numpy::PyArray2<f64>>> {
        let rows = self.directors_of()?.map(Vec::from);
        numpy::PyArray2::from_vec2(py, &rows)
            .map_err(|error| pyo3::exceptions::PyRuntimeError::new_err(error.to_string()))
    }

    /// The rotation matrix, 1, shape `(3, 3)`: directors are its columns.
    #[getter]
    fn rotation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.directors(py)?.getattr("T")
    }

    /// Angular velocity in space, rad/s, shape `(3,)`.
    #[getter]
    fn angular_velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.directors_of()?;
        let omega = holonom::vi_rigid::directors::angular_velocity(&self.q, &self.v);
        Ok(PyArray1::from_slice(py, omega.as_slice()))
    }
}
