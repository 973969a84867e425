//! Cases of laws, signals, events and rolling: a model file, nodes of the same scheme, the exact
//! solution.
//!
//! A model that asks for what the program does not have is not taken: [`LawCase::missing`] names
//! it.

use super::case::{Deviation, Runs, raise};
use holonom::model::Body;
use holonom::model::ModelText;
use holonom::model::{Constraint, Joint, JointKind, Override};
use holonom::run::prepare;
use holonom::sensor::SensorColumn;
use holonom::{EventRecord, Model, RunOutcome, Sample};
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

/// Velocities and efforts may be off by this many tolerances of positions.
const RATES: f64 = 100.0;
/// Errors against the exact solution agree with those of the reference to this part.
const SAME_ERROR: f64 = 0.05;

/// The part of a planar joint that is compared, and its rate.
const ANGLE: &str = "theta";
const ANGLE_RATE: &str = "theta_rate";

/// The angle of the one planar joint, in `values`.
const HEADING: &str = "heading";

/// A sensor with the name of what it measures.
fn sensor(kind: &str, of: &str) -> String {
    format!("\n[[sensor]]\nname = \"{kind} {of}\"\ntype = \"{kind}\"\nof = \"{of}\"\n")
}

/// How far two angles are apart; the references count no revolutions.
fn angle_apart(found: f64, expected: f64) -> f64 {
    let apart = found - expected;
    (apart - TAU * (apart / TAU).round()).abs()
}

fn is_planar(joint: &Joint) -> bool {
    joint.kind == JointKind::Planar
}

type Numbers = BTreeMap<String, f64>;
type Quantities = BTreeMap<String, Value>;
type Vectors = BTreeMap<String, [f64; 3]>;

/// A case; fields that are not read say where it comes from.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LawCase {
    id: String,
    model: PathBuf,
    #[serde(rename = "title")]
    _title: String,
    step: f64,
    steps: usize,
    discrete: Discrete,
    exact: Option<Exact>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Discrete {
    nodes: Vec<NodeCase>,
    #[serde(default)]
    values: Quantities,
    #[serde(default)]
    events: Vec<EventCase>,
    tolerance: f64,
    constraint_residual: f64,
    #[serde(rename = "newton")]
    _newton: Option<Value>,
}

/// An event: velocities of all bodies one after the other, linear and angular.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct EventCase {
    name: String,
    t: f64,
    #[serde(default)]
    velocity_before: Vec<f64>,
    #[serde(default)]
    velocity_after: Vec<f64>,
    energy_lost: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct NodeCase {
    step: usize,
    t: f64,
    position: Vectors,
    directors: BTreeMap<String, [[f64; 3]; 3]>,
    velocity: Vectors,
    angular_velocity: Vectors,
    #[serde(default)]
    joint: Numbers,
    #[serde(default)]
    joint_rate: Numbers,
    #[serde(default)]
    signal: Numbers,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Exact {
    values: Quantities,
    #[serde(rename = "source")]
    _source: Value,
    errors: Numbers,
    #[serde(rename = "order")]
    _order: Value,
    #[serde(rename = "orders")]
    _orders: Value,
    #[serde(rename = "lean_error")]
    _lean_error: Option<Value>,
}

/// What a run gives at its nodes.
struct Run {
    names: Vec<String>,
    angles: Vec<String>, // joints that turn
    nodes: Vec<Sample>,
    events: Vec<EventRecord>,
}

impl Run {
    fn sensor(&self, name: &str, node: usize) -> Option<f64> {
        let k = self.names.iter().position(|own| own == name)?;
        self.nodes.get(node).map(|sample| sample.sensors[k])
    }

    /// Whether a joint coordinate is an angle.
    fn is_angle(&self, name: &str) -> bool {
        name.ends_with(ANGLE) || self.angles.iter().any(|own| own == name)
    }

    fn vector(&self, name: &str, node: usize) -> Vec<f64> {
        let part = |axis: &str| self.sensor(&format!("{name}.{axis}"), node).unwrap_or(f64::NAN);
        ["x", "y", "z"].map(part).to_vec()
    }

    /// Velocities of all bodies at a node, linear and angular.
    fn velocities(&self, bodies: &[Body], node: usize) -> Vec<f64> {
        let kinds = ["velocity", "angular_velocity"];
        let of =
            |body: &Body| kinds.map(|kind| self.vector(&format!("{kind} {}", body.name), node));
        bodies.iter().flat_map(of).flatten().collect()
    }

    /// Energy that events took out.
    fn lost(&self) -> f64 {
        self.events.iter().map(|event| event.energy_lost).sum()
    }

    /// A quantity as expressions name it: `pin`, `pin.rate`, `ball.x`, `ball.vx`.
    fn value(&self, name: &str, node: usize) -> Option<f64> {
        if let Some(signal) = self.sensor(name, node) {
            return Some(signal);
        }
        if name == HEADING {
            let angle = format!(".{ANGLE}");
            let own = self.names.iter().find(|own| own.ends_with(&angle))?;
            return self.sensor(own, node);
        }
        let (part, of) = name.split_once('.').unwrap_or((name, ""));
        let (sensor, axis) = match of {
            "" => ("joint_coordinate", ""),
            "rate" => ("joint_rate", ""),
            ANGLE => ("joint_coordinate", ANGLE),
            ANGLE_RATE => ("joint_rate", ANGLE),
            "x" | "y" | "z" => ("position", of),
            _ => (if of.starts_with('v') { "velocity" } else { "angular_velocity" }, &of[1..]),
        };
        let dot = if axis.is_empty() { "" } else { "." };
        self.sensor(&format!("{sensor} {part}{dot}{axis}"), node)
    }
}

/// How far two values of a quantity are apart.
fn apart(name: &str, found: f64, expected: f64) -> f64 {
    if name == HEADING { angle_apart(found, expected) } else { (found - expected).abs() }
}

/// The numbers of a quantity.
fn numbers(name: &str, value: &Value) -> Result<Vec<f64>, String> {
    let list = value.as_array().map_or_else(|| vec![value], |list| list.iter().collect());
    let number = |value: &&Value| value.as_f64();
    let all: Option<Vec<f64>> = list.iter().map(number).collect();
    all.ok_or_else(|| format!("`{name}` is no list of numbers"))
}

impl LawCase {
    pub fn read(file: &Path, value: Value) -> Result<Self, String> {
        let mut case: Self = serde_json::from_value(value)
            .map_err(|error| format!("does not fit its kind `laws`: {error}"))?;
        case.model = file.with_file_name(&case.model);
        Ok(case)
    }

    /// The model with this step.
    fn model(&self, step: f64) -> Result<Model, String> {
        let set = Override { key: "simulation.step".into(), value: format!("{step:?}") };
        ModelText::read(&self.model).model(&[set]).map_err(|error| error.to_string())
    }

    /// The first thing of its model that the program does not have.
    pub fn missing(&self) -> Option<String> {
        let error = self.model(self.step).err()?;
        let words = ["unknown section", "unknown key", "unknown value", "is not known"];
        let line = error.lines().find(|line| words.iter().any(|word| line.contains(word)))?;
        Some(line.trim().to_owned())
    }

    fn run_by(&self, step: f64, steps: usize) -> Result<Run, String> {
        let run = Self::run_model(&self.model(step)?)?;
        let found = run.nodes.len();
        if found != steps + 1 {
            return Err(format!("{found} nodes, expected {}", steps + 1));
        }
        Ok(run)
    }

    /// A run that ends at the first event, before or after its action.
    fn run_to_event(&self, step: f64, after: bool) -> Result<Run, String> {
        let mut model = self.model(step)?;
        let event = model.events.first_mut().ok_or("the model has no event")?;
        if !after {
            (event.release, event.lock) = (Vec::new(), Vec::new());
        }
        event.end = true;
        Self::run_model(&model)
    }

    fn run_model(model: &Model) -> Result<Run, String> {
        let mut text = model.to_toml();
        let mut add = |kind: &str, of: &str| text += &sensor(kind, of);
        for body in &model.bodies {
            for kind in ["position", "velocity", "angular_velocity"] {
                add(kind, &body.name);
            }
        }
        let counted = |joint: &&Joint| joint.pair().coordinate_count() == 1 || is_planar(joint);
        for constraint in &model.constraints {
            let Constraint::Blade { body, position, .. } = constraint else { continue };
            let center = model.body(body).map_or([0.0; 3], |body| body.position);
            let point = [0, 1, 2].map(|k| position[k] - center[k]); // of a body that is not turned
            text += &format!(
                "\n[[sensor]]\nname = \"position blade\"\ntype = \"position\"\nof = \"{body}\"\n\
                 point = {point:?}\n"
            );
        }
        let mut add = |kind: &str, of: &str| text += &sensor(kind, of);
        for joint in model.joints.iter().filter(counted) {
            for kind in ["joint_coordinate", "joint_rate"] {
                add(kind, &joint.name);
            }
        }
        let model = Model::from_toml(&text).map_err(|error| error.to_string())?;
        let mut run = prepare(&model).map_err(|error| error.to_string())?;
        let (mut nodes, mut events) = (Vec::new(), Vec::new());
        let mut observe = |sample: &Sample| {
            events.extend(sample.events.iter().cloned());
            nodes.push(sample.clone());
            Ok(())
        };
        match run.run(&mut observe, &mut |_, _| {}).map_err(|error| error.to_string())? {
            RunOutcome::Done => {}
            RunOutcome::Failed(failure) => return Err(failure.message),
        }
        let names = run.sensors().columns().iter().map(SensorColumn::name).collect();
        let turns = |joint: &&Joint| joint.kind == JointKind::Revolute;
        let angles = model.joints.iter().filter(turns).map(|joint| joint.name.clone()).collect();
        Ok(Run { names, angles, nodes, events })
    }

    /// A quantity at the end, or at events: `release`, `latched`, `switches` are their times,
    /// `release.ball.vx` is of the node there, `rate.after` the rate of a joint after a lock.
    fn quantity(&self, name: &str, run: &Run, step: f64) -> Result<Vec<f64>, String> {
        let none = || format!("no value `{name}`");
        let time = |event: &EventRecord| event.t;
        if let Some(value) = run.value(name, run.nodes.len() - 1) {
            return Ok(vec![value]);
        }
        if let Some(of) = name.strip_prefix("release.") {
            let at = self.run_to_event(step, false)?;
            return at.value(of, at.nodes.len() - 1).map(|value| vec![value]).ok_or_else(none);
        }
        Ok(match name {
            "release" | "latched" => vec![run.events.first().map(time).ok_or_else(none)?],
            "switches" => run.events.iter().map(time).collect(),
            "energy.lost" => vec![run.lost()],
            "rate.after" => {
                let at = self.run_to_event(step, true)?;
                let joint = self.model(step)?.joints[0].name.clone();
                let rate = at.value(&format!("{joint}.rate"), at.nodes.len() - 1);
                vec![rate.ok_or_else(none)?]
            }
            _ => return Err(none()),
        })
    }

    /// Times, velocities and losses of events.
    fn compare_events(&self, run: &Run, worst: &mut Deviation) -> Result<(), String> {
        let tolerance = self.discrete.tolerance;
        let (found, expected) = (run.events.len(), self.discrete.events.len());
        if found != expected {
            return Err(format!("{found} events, expected {expected}"));
        }
        for (found, expected) in run.events.iter().zip(&self.discrete.events) {
            if found.event != expected.name {
                return Err(format!("event `{}` where `{}` acts", found.event, expected.name));
            }
            raise(&mut worst.q, (found.t - expected.t).abs() / tolerance);
            if let Some(lost) = expected.energy_lost {
                raise(&mut worst.p, (found.energy_lost - lost).abs() / (RATES * tolerance));
            }
        }
        let Some(first) = self.discrete.events.first() else { return Ok(()) };
        let velocities = [(false, &first.velocity_before), (true, &first.velocity_after)];
        for (after, expected) in velocities.into_iter().filter(|(_, all)| !all.is_empty()) {
            let at = self.run_to_event(self.step, after)?;
            let found = at.velocities(&self.model(self.step)?.bodies, at.nodes.len() - 1);
            for (found, expected) in found.iter().zip(expected) {
                raise(&mut worst.p, (found - expected).abs() / (RATES * tolerance));
            }
        }
        Ok(())
    }

    pub fn run(&self) -> Result<Runs, String> {
        let run = self.run_by(self.step, self.steps)?;
        let mut nodal = Deviation::default();
        for node in &self.discrete.nodes {
            self.compare(node, &run, &mut nodal)?;
        }
        for (name, value) in &self.discrete.values {
            let signal = run.sensor(name, self.steps).is_some();
            let rate = name.contains("rate") || name.contains(".v") || name.contains(".w");
            let rate = signal || rate || name.starts_with("energy");
            let tolerance = self.discrete.tolerance * if rate { RATES } else { 1.0 };
            let (found, expected) = (self.quantity(name, &run, self.step)?, numbers(name, value)?);
            if found.len() != expected.len() {
                return Err(format!("`{name}` has {} numbers", found.len()));
            }
            for (found, expected) in found.iter().zip(&expected) {
                raise(&mut nodal.q, apart(name, *found, *expected) / tolerance);
            }
        }
        self.compare_events(&run, &mut nodal)?;
        let largest = |sample: &Sample| sample.residuals.position;
        let residual = run.nodes.iter().map(largest).fold(0.0, f64::max);
        raise(&mut nodal.force, residual / (self.discrete.constraint_residual + 1e-13));
        let mut runs = vec![("nodal", nodal)];
        if let Some(exact) = &self.exact {
            runs.push(("exact", self.errors(exact, &run)?));
        }
        Ok(runs)
    }

    fn compare(&self, node: &NodeCase, run: &Run, worst: &mut Deviation) -> Result<(), String> {
        let (tolerance, k) = (self.discrete.tolerance, node.step);
        let sample = run.nodes.get(k).ok_or_else(|| format!("no node {k}"))?;
        raise(&mut worst.q, (sample.t - node.t).abs() / 1e-12);
        for (name, expected) in &node.signal {
            let found = run.sensor(name, k).ok_or_else(|| format!("no signal `{name}`"))?;
            raise(&mut worst.p, (found - expected).abs() / (RATES * tolerance));
        }
        let each = |expected: &Vectors, kind: &str, tolerance: f64, worst: &mut f64| {
            for (body, expected) in expected {
                for (found, expected) in
                    run.vector(&format!("{kind} {body}"), k).iter().zip(expected)
                {
                    raise(worst, (found - expected).abs() / tolerance);
                }
            }
        };
        each(&node.position, "position", tolerance, &mut worst.q);
        each(&node.velocity, "velocity", RATES * tolerance, &mut worst.p);
        each(&node.angular_velocity, "angular_velocity", RATES * tolerance, &mut worst.p);
        for (place, (_, directors)) in
            node.directors.iter().enumerate().filter(|_| node.directors.len() == 1)
        {
            for (i, found) in sample.q[12 * place + 3..12 * place + 12].iter().enumerate() {
                raise(&mut worst.q, (found - directors[i / 3][i % 3]).abs() / tolerance);
            }
        }
        for (values, of, tolerance) in
            [(&node.joint, "", tolerance), (&node.joint_rate, ".rate", RATES * tolerance)]
        {
            for (name, expected) in values {
                // of a planar joint its angle
                let planar = run.value(&format!("{name}.{ANGLE}"), k).is_some();
                let of = match (planar, of) {
                    (true, "") => format!(".{ANGLE}"),
                    (true, _) => format!(".{ANGLE_RATE}"),
                    (false, of) => of.to_owned(),
                };
                let name = format!("{name}{of}");
                let found = run.value(&name, k).ok_or_else(|| format!("no value `{name}`"))?;
                let is_angle = of.is_empty() || of == format!(".{ANGLE}");
                let turns = is_angle && run.is_angle(&name);
                let apart =
                    if turns { angle_apart(found, *expected) } else { (found - expected).abs() };
                raise(&mut worst.q, apart / tolerance);
            }
        }
        Ok(())
    }

    /// Errors against the exact solution at h, h/2 and h/4: within a few percent of those of the
    /// reference.
    fn errors(&self, exact: &Exact, first: &Run) -> Result<Deviation, String> {
        let mut worst = Deviation::default();
        for (division, expected) in &exact.errors {
            let parts: usize = division
                .strip_prefix("h/")
                .and_then(|parts| parts.parse().ok())
                .ok_or_else(|| format!("unknown step `{division}`"))?;
            let (steps, step) = (self.steps * parts, self.step / parts as f64);
            let finer = match parts {
                1 => None,
                _ => Some(self.run_by(step, steps)?),
            };
            let run = finer.as_ref().unwrap_or(first);
            let mut error: f64 = 0.0;
            // those that the discrete solution has, too
            let values = exact.values.iter();
            for (name, value) in values.filter(|(name, _)| self.discrete.values.contains_key(*name))
            {
                let found = self.quantity(name, run, step)?;
                for (found, value) in found.iter().zip(numbers(name, value)?) {
                    error = error.max(apart(name, *found, value));
                }
            }
            println!("{} {division}: error {error:.4e}, reference {expected:.4e}", self.id);
            raise(&mut worst.q, (error / expected - 1.0).abs() / SAME_ERROR);
        }
        Ok(worst)
    }
}
