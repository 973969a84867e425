//! Cases of laws, signals, events and rolling: a model file, nodes of the same scheme, the exact
//! solution.
//!
//! A model that asks for what the program does not have is not taken: [`LawCase::missing`] names
//! it.

use super::case::{Deviation, Runs, raise};
use holonom::model::ModelText;
use holonom::model::{Constraint, Joint, JointKind, Override};
use holonom::run::prepare;
use holonom::sensor::Column;
use holonom::{Model, RunOutcome, Sample};
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
    events: Vec<Value>,
    tolerance: f64,
    constraint_residual: f64,
    #[serde(rename = "newton")]
    _newton: Option<Value>,
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

/// A quantity that is one number.
fn number(name: &str, value: &Value) -> Result<f64, String> {
    value.as_f64().ok_or_else(|| format!("the list `{name}` is not compared"))
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
        let mut model = self.model(step)?;
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
        model = Model::from_toml(&text).map_err(|error| error.to_string())?;
        let mut run = prepare(&model).map_err(|error| error.to_string())?;
        let mut nodes = Vec::new();
        let mut observe = |sample: &Sample| {
            nodes.push(sample.clone());
            Ok(())
        };
        match run.run(&mut observe, &mut |_, _| {}).map_err(|error| error.to_string())? {
            RunOutcome::Done => {}
            RunOutcome::Failed(failure) => return Err(failure.message),
        }
        if nodes.len() != steps + 1 {
            return Err(format!("{} nodes, expected {}", nodes.len(), steps + 1));
        }
        let names = run.sensors().columns().iter().map(Column::name).collect();
        let turns = |joint: &&Joint| joint.kind == JointKind::Revolute;
        let angles = model.joints.iter().filter(turns).map(|joint| joint.name.clone()).collect();
        Ok(Run { names, angles, nodes })
    }

    pub fn run(&self) -> Result<Runs, String> {
        if !self.discrete.events.is_empty() {
            return Err("events are not compared".to_owned());
        }
        let run = self.run_by(self.step, self.steps)?;
        let mut nodal = Deviation::default();
        for node in &self.discrete.nodes {
            self.compare(node, &run, &mut nodal)?;
        }
        for (name, value) in &self.discrete.values {
            let value = number(name, value)?;
            let found = run.value(name, self.steps).ok_or_else(|| format!("no value `{name}`"))?;
            let signal = run.sensor(name, self.steps).is_some();
            let rate =
                signal || name.ends_with(".rate") || name.contains(".v") || name.contains(".w");
            let tolerance = self.discrete.tolerance * if rate { RATES } else { 1.0 };
            let apart =
                if name == HEADING { angle_apart(found, value) } else { (found - value).abs() };
            raise(&mut nodal.q, apart / tolerance);
        }
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
            let steps = self.steps * parts;
            let finer = match parts {
                1 => None,
                _ => Some(self.run_by(self.step / parts as f64, steps)?),
            };
            let run = finer.as_ref().unwrap_or(first);
            let mut error: f64 = 0.0;
            // those that the discrete solution has, too
            let values = exact.values.iter();
            for (name, value) in values.filter(|(name, _)| self.discrete.values.contains_key(*name))
            {
                let value = number(name, value)?;
                let found = run.value(name, steps).ok_or_else(|| format!("no value `{name}`"))?;
                error = error.max(if name == HEADING {
                    angle_apart(found, value)
                } else {
                    (found - value).abs()
                });
            }
            println!("{} {division}: error {error:.4e}, reference {expected:.4e}", self.id);
            raise(&mut worst.q, (error / expected - 1.0).abs() / SAME_ERROR);
        }
        Ok(worst)
    }
}
