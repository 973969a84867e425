//! The variables of a model: what can be set and what can be read.
//!
//! | causality | name | is |
//! |---|---|---|
//! | independent | `time` | s |
//! | parameter | `parameters.NAME`, `simulation.step`, any key that is asked for | numbers of the model file, fixed after the initialization |
//! | input | `JOINT.effort` | N or N·m, beside what acts in the file: of each joint with a motor |
//! | input | `JOINT.setpoint` | m or rad, in the place of the path that its motor follows: where that is constant or this is asked for |
//! | input | `SIGNAL` | a signal that is a number and that no event sets: set points |
//! | input | `BODY.force.x` …, `BODY.torque.x` … | N and N·m, in space, at the centre of mass; where asked for |
//! | input | `CONTROL.value` | a factor of the wrench of a `[[control]]` on a body; where asked for |
//! | output | `SENSOR`, `SENSOR.part` | the columns of `sensors.csv` |
//! | output | `energy.H`, `residual.position` | J, with contacts before the impulses of the node; the largest residual of the constraints |
//!
//! The reference of a variable is its place in the list.

use crate::names;
use holonom::model::{Curves, JointMotor, MotionPath, Problem, SensorKind, nearest};
use holonom::sensor::SensorColumn;
use holonom::{InputPlace, Model, ModelError, Override};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// What is asked for beside what every unit has.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnitRequest {
    /// Joints (`arm`, `arm.1`, `arm.setpoint`), bodies (`arm`, `arm.force`, `arm.torque`), signals.
    pub inputs: Vec<String>,
    /// Key paths of numbers of the model file: `body.arm.mass`.
    pub parameters: Vec<String>,
}

/// What a variable is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Causality {
    /// The time.
    Independent,
    /// Set before the initialization ends, then fixed.
    Parameter,
    /// Held from one communication point to the next.
    Input,
    /// Read at communication points.
    Output,
}

/// What a variable is of the model.
#[derive(Clone, Debug, PartialEq)]
pub enum VariableRole {
    /// The time, s.
    Time,
    /// The value of this key.
    Key(String),
    /// A component of an input in the list of inputs.
    Held {
        /// Which input.
        input: usize,
        /// Which of its values.
        component: usize,
    },
    /// A signal that is a number.
    Number(String),
    /// A column of `sensors.csv`.
    Column(usize),
    /// `H` of the projected momentum, J.
    Hamiltonian,
    /// `|g(q)|_∞`.
    Residual,
}

/// A variable of a unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Its name, unique, by the convention `structured`.
    pub name: String,
    /// What it is for.
    pub causality: Causality,
    /// Its unit; empty where it has none or none is known.
    pub unit: &'static str,
    /// Its value until it is set; `None` for what is computed.
    pub start: Option<f64>,
    /// A sentence for people.
    pub description: String,
    /// What it is of the model.
    pub quantity: VariableRole,
    /// Whether it depends on the present inputs at once.
    pub feeds_through: bool,
}

/// The variables of a model; the reference of each is its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Interface {
    /// All of them, the time first.
    pub variables: Vec<Variable>,
    /// Where efforts, forces and torques act.
    pub places: Vec<InputPlace>,
}

impl Interface {
    /// That of a model with the text and the overrides that it was made of.
    ///
    /// # Errors
    /// [`ModelError`] for what is asked for and is not there, and for names that are not unique.
    pub fn of(
        text: &str,
        overrides: &[Override],
        model: &Model,
        request: &UnitRequest,
    ) -> Result<Self, ModelError> {
        let mut own = Self { variables: Vec::new(), places: Vec::new() };
        let time = Variable::new("time", Causality::Independent, VariableRole::Time);
        own.variables.push(time.unit("s").described("time"));
        let refused = |problem| ModelError::Assembly(vec![problem]);
        own.add_parameters(text, overrides, model, request).map_err(refused)?;
        own.add_inputs(model, request).map_err(refused)?;
        own.add_outputs(model);
        own.check_names().map_err(refused)?;
        Ok(own)
    }

    /// Whether all names can be written by the convention `structured`.
    #[must_use]
    pub fn is_structured(&self) -> bool {
        self.variables.iter().all(|own| names::is_structured(&own.name))
    }

    /// References and variables of a causality.
    pub fn of_causality(&self, causality: Causality) -> impl Iterator<Item = (usize, &Variable)> {
        self.variables.iter().enumerate().filter(move |(_, own)| own.causality == causality)
    }

    fn add_parameters(
        &mut self,
        text: &str,
        overrides: &[Override],
        model: &Model,
        request: &UnitRequest,
    ) -> Result<(), Problem> {
        for (name, value) in plain_parameters(text, overrides) {
            let key = format!("parameters.{name}");
            self.add_parameter(&key, value, "", "parameter of the model file");
        }
        self.add_parameter("simulation.step", model.settings.step, "s", "time step");
        let values = serde_json::to_value(model).unwrap_or_default();
        for key in &request.parameters {
            let path = format!("parameter `{key}`");
            let value = value_of(&values, key);
            let value = match value {
                Some(serde_json::Value::Number(number)) if number.is_f64() => number.as_f64(),
                Some(serde_json::Value::Number(_)) => {
                    let problem = Problem::new(path, "this is a whole number, a count");
                    return Err(
                        problem.help("parameters of a unit are real numbers: set it by --set")
                    );
                }
                _ => None,
            };
            let Some(value) = value else {
                let problem = Problem::new(path, "the model has no number at this key");
                return Err(problem.help(
                    "write a key path to a number, as --set does: body.arm.mass, body.arm.inertia.0",
                ));
            };
            if !self.variables.iter().any(|own| own.quantity == VariableRole::Key(key.clone())) {
                self.add_parameter(key, value, "", "value of the model file");
            }
        }
        Ok(())
    }

    fn add_parameter(&mut self, key: &str, value: f64, unit: &'static str, what: &str) {
        let quantity = VariableRole::Key(key.to_owned());
        let variable = Variable::new(names::of_key(key), Causality::Parameter, quantity);
        self.variables.push(variable.unit(unit).start(value).described(what));
    }

    fn add_inputs(&mut self, model: &Model, request: &UnitRequest) -> Result<(), Problem> {
        let mut places = Vec::new();
        for joint in &model.joints {
            if let Some(motor) = &joint.motor {
                places.push(InputPlace::Joint { name: joint.name.clone(), freedom: motor.freedom });
            }
        }
        let changed: BTreeSet<&str> =
            model.events.iter().flat_map(|event| event.set.keys()).map(String::as_str).collect();
        let numbers = model.signals.iter().filter(|signal| signal.kinds().is_empty());
        let mut signals: Vec<&str> =
            numbers.clone().map(|own| own.name.as_str()).filter(|n| !changed.contains(n)).collect();
        for name in &request.inputs {
            if let Some(signal) = numbers.clone().find(|own| own.name == *name) {
                if !signals.contains(&name.as_str()) {
                    signals.push(&signal.name);
                }
                continue;
            }
            for place in asked(model, name)? {
                if !places.contains(&place) {
                    places.push(place);
                }
            }
        }
        for joint in &model.joints {
            let fixed = |motor: &JointMotor| is_controlled(motor) && is_constant(&motor.path);
            let place = InputPlace::Setpoint(joint.name.clone());
            if joint.motor.as_ref().is_some_and(fixed) && !places.contains(&place) {
                places.push(place);
            }
        }
        for place in places {
            self.add_held(model, place)?;
        }
        for name in signals {
            let signal = model.signals.iter().find(|own| own.name == name);
            let start = signal.and_then(|own| own.start).unwrap_or(0.0);
            let quantity = VariableRole::Number(name.to_owned());
            let variable = Variable::new(names::part(name), Causality::Input, quantity);
            let described = format!("signal `{name}`, held over a step");
            self.variables.push(variable.start(start).described(&described));
        }
        Ok(())
    }

    fn add_held(&mut self, model: &Model, place: InputPlace) -> Result<(), Problem> {
        let (input, mut start) = (self.places.len(), 0.0);
        let (base, unit, what) = match &place {
            InputPlace::Joint { name, freedom } => {
                let pair = model.joint(name).map(holonom::model::Joint::pair);
                let unit =
                    if pair.is_some_and(|pair| pair.is_angle(*freedom)) { "N·m" } else { "N" };
                let part = match freedom {
                    0 => "effort".to_owned(),
                    k => format!("effort_{k}"),
                };
                (names::structured(&[name, &part]), unit, format!("effort on joint `{name}`"))
            }
            InputPlace::Setpoint(name) => {
                let motor = model.joint(name).and_then(|joint| joint.motor.as_ref());
                let Some(motor) = motor.filter(|motor| is_controlled(motor)) else {
                    let what = format!("the joint `{name}` has no motor that follows a path");
                    let help = "write `motor = { proportional = …, derivative = … }` there";
                    return Err(Problem::new(format!("input `{name}.setpoint`"), what).help(help));
                };
                let pair = model.joint(name).map(holonom::model::Joint::pair);
                let is_angle = pair.is_some_and(|pair| pair.is_angle(motor.freedom));
                let what = format!("what the motor of joint `{name}` follows");
                start = start_of(&motor.path, model);
                let unit = if is_angle { "rad" } else { "m" };
                (names::structured(&[name, "setpoint"]), unit, what)
            }
            InputPlace::Control(name) => {
                let what = format!("value of the control `{name}`, a factor of its wrench");
                (names::structured(&[name, "value"]), "1", what)
            }
            InputPlace::Force(name) => {
                let what = format!("force on `{name}` at its centre of mass, in space");
                (names::structured(&[name, "force"]), "N", what)
            }
            InputPlace::Torque(name) => {
                let what = format!("torque on `{name}`, in space");
                (names::structured(&[name, "torque"]), "N·m", what)
            }
        };
        let planar = matches!(&place, InputPlace::Force(name) if model.header.dimension == 2
            && model.particles.iter().any(|own| own.name == *name));
        let components: &[&str] = match &place {
            InputPlace::Joint { .. } | InputPlace::Control(_) | InputPlace::Setpoint(_) => &[""],
            _ if planar => &["x", "y"],
            _ => &["x", "y", "z"],
        };
        for (component, axis) in components.iter().enumerate() {
            let name = if axis.is_empty() { base.clone() } else { format!("{base}.{axis}") };
            let variable =
                Variable::new(name, Causality::Input, VariableRole::Held { input, component });
            let described = match place {
                InputPlace::Setpoint(_) => format!("{what}; held over a step"),
                _ => format!("{what}, beside what acts in the file; held over a step"),
            };
            self.variables.push(variable.unit(unit).start(start).described(&described));
        }
        self.places.push(place);
        Ok(())
    }

    fn add_outputs(&mut self, model: &Model) {
        let inputs: BTreeSet<String> = self
            .of_causality(Causality::Input)
            .filter_map(|(_, own)| match &own.quantity {
                VariableRole::Number(name) => Some(name.clone()),
                _ => None,
            })
            .collect();
        for (k, column) in holonom::sensor::columns(model).iter().enumerate() {
            let is_input = column.part.is_empty()
                && inputs.contains(&column.sensor)
                && model.signals.iter().any(|own| own.name == column.sensor);
            if is_input {
                continue; // what is set is known
            }
            let SensorColumn { sensor: name, part, unit, .. } = column;
            let name = names::structured(&[name, part]);
            let mut variable = Variable::new(name, Causality::Output, VariableRole::Column(k));
            variable.feeds_through = feeds_through(model, column);
            self.variables.push(variable.unit(unit).described(&described(model, column)));
        }
        let energy = Variable::new("energy.H", Causality::Output, VariableRole::Hamiltonian);
        self.variables.push(energy.unit("J").described("energy of the projected momentum"));
        let residual =
            Variable::new("residual.position", Causality::Output, VariableRole::Residual);
        self.variables.push(residual.described("largest residual of the constraints"));
    }

    fn check_names(&self) -> Result<(), Problem> {
        let mut known = BTreeSet::new();
        for own in &self.variables {
            if !known.insert(own.name.as_str()) {
                let what = format!("two variables of the unit are named `{}`", own.name);
                return Err(Problem::new("sensor", what).help("rename the sensor"));
            }
        }
        Ok(())
    }
}

impl Variable {
    fn new(name: impl Into<String>, causality: Causality, quantity: VariableRole) -> Self {
        let (unit, start, description, feeds_through) = ("", None, String::new(), false);
        Self { name: name.into(), causality, unit, start, description, quantity, feeds_through }
    }
    fn unit(mut self, unit: &'static str) -> Self {
        self.unit = unit;
        self
    }
    fn start(mut self, value: f64) -> Self {
        self.start = Some(value);
        self
    }
    fn described(mut self, words: &str) -> Self {
        words.clone_into(&mut self.description);
        self
    }
}

/// Whether a motor follows a path.
fn is_controlled(motor: &JointMotor) -> bool {
    motor.proportional != 0.0 || motor.derivative != 0.0
}

/// Whether a path stays where it begins.
fn is_constant(path: &MotionPath) -> bool {
    let moves = [path.rate, path.acceleration, path.amplitude].iter().any(|own| *own != 0.0);
    !moves && path.expression.is_none() && path.moves.is_empty() && path.table.is_none()
}

/// Where a path begins.
fn start_of(path: &MotionPath, model: &Model) -> f64 {
    match path.program(&Curves::new(model)) {
        Some(program) => program.taylor(0.0).map_or(0.0, |own| own[0]),
        None => path.function()(0.0)[0],
    }
}

/// What a name asks for: a coordinate of a joint, force or torque on a body, or both.
fn asked(model: &Model, name: &str) -> Result<Vec<InputPlace>, Problem> {
    let owned = |name: &str| name.to_owned();
    if let Some(joint) = model.joint(name) {
        let freedom = joint.motor.as_ref().map_or(0, |motor| motor.freedom);
        return Ok(vec![InputPlace::Joint { name: owned(name), freedom }]);
    }
    if let Some((joint, number)) = name.rsplit_once('.')
        && let (Some(_), Ok(freedom)) = (model.joint(joint), number.parse())
    {
        return Ok(vec![InputPlace::Joint { name: owned(joint), freedom }]);
    }
    if let Some(joint) = name.strip_suffix(".setpoint").filter(|joint| model.joint(joint).is_some())
    {
        return Ok(vec![InputPlace::Setpoint(owned(joint))]);
    }
    if let Some(control) = model.controls.iter().find(|own| own.name == name) {
        return Ok(vec![InputPlace::of(control)]);
    }
    let particle = |name: &str| model.particles.iter().any(|own| own.name == name);
    // a node of a beam is known when the system is assembled
    match name.rsplit_once('.') {
        Some((of, "force")) => return Ok(vec![InputPlace::Force(owned(of))]),
        Some((of, "torque")) => return Ok(vec![InputPlace::Torque(owned(of))]),
        _ if particle(name) => return Ok(vec![InputPlace::Force(owned(name))]),
        _ => {}
    }
    if model.bodies.iter().any(|own| own.name == name) {
        return Ok(vec![InputPlace::Force(owned(name)), InputPlace::Torque(owned(name))]);
    }
    let joints = model.joints.iter().map(|own| own.name.as_str());
    let bodies = model.bodies.iter().map(|own| own.name.as_str());
    let particles = model.particles.iter().map(|own| own.name.as_str());
    let signals = model.signals.iter().filter(|own| own.kinds().is_empty());
    let known = joints.chain(bodies).chain(particles);
    let known: Vec<&str> = known.chain(signals.map(|own| own.name.as_str())).collect();
    let what = "this is neither a joint nor a body nor a signal that is a number";
    let problem = Problem::new(format!("input `{name}`"), what);
    Err(match nearest(name, known.iter().copied()) {
        Some(best) => problem.help(format!("did you mean `{best}`?")),
        None => problem.help(format!("there are: {}", known.join(", "))),
    })
}

/// The plain numbers of `[parameters]`, as they are with the overrides.
fn plain_parameters(text: &str, overrides: &[Override]) -> Vec<(String, f64)> {
    let Ok(table) = text.parse::<toml::Table>() else { return Vec::new() };
    let Some(stated) = table.get("parameters").and_then(toml::Value::as_table) else {
        return Vec::new();
    };
    let number = |value: &toml::Value| match value {
        toml::Value::Float(value) => Some(*value),
        toml::Value::Integer(value) => Some(*value as f64),
        _ => None,
    };
    let value = |(name, value): (&String, &toml::Value)| {
        let key = format!("parameters.{name}");
        let own = match overrides.iter().rev().find(|set| set.key == key) {
            Some(set) => format!("x = {}", set.value).parse::<toml::Table>().ok()?.remove("x"),
            None => Some(value.clone()),
        };
        Some((name.clone(), number(&own?)?))
    };
    stated.iter().filter_map(value).collect()
}

/// The value at a key path: lists by the names of their members or by numbers.
fn value_of<'a>(values: &'a serde_json::Value, key: &str) -> Option<&'a serde_json::Value> {
    let mut at = values;
    let mut rest = key;
    while !rest.is_empty() {
        let (part, others) = rest.split_once('.').unwrap_or((rest, ""));
        if let Some(list) = at.as_array() {
            let named = |own: &&serde_json::Value| {
                let name = own.get("name").and_then(serde_json::Value::as_str);
                name.is_some_and(|name| {
                    rest.strip_prefix(name).is_some_and(|r| r.is_empty() || r.starts_with('.'))
                })
            };
            if let Some(own) = list.iter().find(named) {
                let name = own.get("name").and_then(serde_json::Value::as_str)?;
                rest = rest[name.len()..].trim_start_matches('.');
                at = own;
                continue;
            }
            at = list.get(part.parse::<usize>().ok()?)?;
        } else {
            at = at.get(part)?;
        }
        rest = others;
    }
    Some(at)
}

/// What a column is, for people.
fn described(model: &Model, column: &SensorColumn) -> String {
    let what = if column.is_flag() { "1 where the value is unique" } else { column.quantity };
    match model.sensors.iter().find(|own| own.name == column.sensor) {
        Some(sensor) if sensor.of.is_empty() => format!("{what} `{}`", sensor.name),
        Some(sensor) => format!("{what} of `{}`", sensor.of),
        None => format!("signal `{}`", column.sensor),
    }
}

/// Whether a column depends on the present inputs: what acts does, what moves does not.
fn feeds_through(model: &Model, column: &SensorColumn) -> bool {
    let Some(sensor) = model.sensors.iter().find(|own| own.name == column.sensor) else {
        return true; // a signal
    };
    match sensor.kind {
        SensorKind::Acceleration
        | SensorKind::AngularAcceleration
        | SensorKind::JointAcceleration
        | SensorKind::Imu
        | SensorKind::Expression
        | SensorKind::Reaction
        | SensorKind::Effort
        | SensorKind::Power
        | SensorKind::Work
        | SensorKind::ContactForce
        | SensorKind::StopForce
        | SensorKind::FrictionTorque => true,
        SensorKind::Position
        | SensorKind::Velocity
        | SensorKind::Orientation
        | SensorKind::AngularVelocity
        | SensorKind::Distance
        | SensorKind::DistanceRate
        | SensorKind::Gap
        | SensorKind::Clearance
        | SensorKind::JointCoordinate
        | SensorKind::JointRate
        | SensorKind::SectionForce
        | SensorKind::Strain
        | SensorKind::Slip => false,
    }
}
