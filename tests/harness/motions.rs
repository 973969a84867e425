//! Cases of small motions: eigenvalues of a bicycle over its speed, growth of a rotor over the
//! cross coupling of its bearings; of the linearized equations and of the linearized step.

use super::case::{Deviation, Runs, raise};
use holonom::model::ModelText;
use holonom::modes::{About, ModalAnalysis, Mode, ModeKind};
use holonom::run::prepare;
use holonom::{Model, RunOutcome, Sample};
use nalgebra::{Complex, DMatrix};
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Eigenvalues of the step agree to this, 1/s.
const OF_STEP: f64 = 1e-6;
/// The model of the bicycle stands beside the case.
const BICYCLE: &str = "p07_bicycle.toml";
/// Initial disturbance of the bicycle, rad/s.
const KICK: f64 = 1e-4;

type Values = Vec<[f64; 2]>;

/// Eigenvalues over the speed; fields that are not read say where it comes from.
#[derive(Debug, Deserialize)]
pub struct BicycleCase {
    #[serde(skip)]
    model: PathBuf,
    speeds: BTreeMap<String, SpeedCase>,
    tolerance: f64,
}

#[derive(Debug, Deserialize)]
struct SpeedCase {
    eigenvalues: Values,
    #[serde(default)]
    step: BTreeMap<String, Values>,
}

/// Growth over the cross coupling.
#[derive(Debug, Deserialize)]
pub struct RotorCase {
    model: PathBuf,
    threshold: f64,
    rows: Vec<GrowthCase>,
}

#[derive(Debug, Deserialize)]
struct GrowthCase {
    factor: f64,
    step: f64,
    growth: f64,
    continuous: f64,
}

/// A case of small motions.
pub enum MotionCase {
    Bicycle(BicycleCase),
    Rotor(RotorCase),
}

fn model(file: &Path, set: &[(&str, String)]) -> Result<Model, String> {
    let set: Vec<_> = set
        .iter()
        .map(|(key, value)| holonom::model::Override {
            key: (*key).to_owned(),
            value: value.clone(),
        })
        .collect();
    ModelText::read(file).model(&set).map_err(|error| error.to_string())
}

fn modes(model: &Model) -> Result<Vec<Mode>, String> {
    let error = |error: holonom::modes::ModesError| error.to_string();
    let report = ModalAnalysis::new(model, About::Motion).and_then(|mut own| own.modes(50));
    let report = report.map_err(error)?;
    match report.warnings.first() {
        Some(warning) => Err(warning.clone()),
        None => Ok(report.modes),
    }
}

fn value(mode: &Mode) -> Complex<f64> {
    Complex::new(mode.growth - mode.decay, mode.omega)
}

/// The largest distance of eigenvalues with `Im λ ≥ 0`, each from the nearest that is expected.
fn distance(found: &[Complex<f64>], expected: &Values) -> f64 {
    let expected = expected.iter().map(|[re, im]| Complex::new(*re, *im));
    let expected: Vec<_> = expected.filter(|value| value.im >= 0.0).collect();
    if found.len() != expected.len() {
        return f64::NAN;
    }
    let nearest = |value: &Complex<f64>, list: &[Complex<f64>]| {
        list.iter().map(|other| (value - other).norm()).fold(f64::INFINITY, f64::min)
    };
    let there = found.iter().map(|value| nearest(value, &expected));
    there.chain(expected.iter().map(|value| nearest(value, found))).fold(0.0, f64::max)
}

fn nodes(model: &Model) -> Result<Vec<Sample>, String> {
    let mut run = prepare(model).map_err(|error| error.to_string())?;
    let mut nodes = Vec::new();
    let mut keep = |sample: &Sample| {
        nodes.push(sample.clone());
        Ok(())
    };
    match run.run(&mut keep, &mut |_, _| {}).map_err(|error| error.to_string())? {
        RunOutcome::Done => Ok(nodes),
        RunOutcome::Failed(failure) => Err(failure.message),
    }
}

/// `ln z/τ` of the map that takes two nodes of `y`, `τ` apart, to those a time `τ` later, by least
/// squares over all of them.
pub fn of_map(y: &[Vec<f64>], stride: usize, tau: f64) -> Vec<Complex<f64>> {
    let size = 2 * y[0].len();
    let count = y.len() - 2 * stride;
    let state = |k: usize| y[k].iter().chain(&y[k + stride]).copied().collect::<Vec<_>>();
    let columns = |first: usize| {
        let all: Vec<f64> = (0..count).flat_map(|k| state(first + k)).collect();
        DMatrix::from_vec(size, count, all)
    };
    // X' = T X
    let (before, after) = (columns(0).transpose(), columns(stride).transpose());
    let map = before.svd(true, true).solve(&after, 0.0).unwrap().transpose();
    let values = map.complex_eigenvalues();
    values.iter().map(|z| z.ln() / tau).filter(|value| value.im >= 0.0).collect()
}

impl BicycleCase {
    fn model(&self, speed: &str, kick: f64, step: f64) -> Result<Model, String> {
        let set = [
            ("parameters.v", speed.to_owned()),
            ("parameters.kick", format!("{kick:?}")),
            ("simulation.step", format!("{step:?}")),
        ];
        model(&self.model, &set)
    }

    /// Eigenvalues of the linearized step, in lean and steer and their rates.
    fn of_step(&self, speed: &str, step: f64) -> Result<Vec<Complex<f64>>, String> {
        const WINDOW: f64 = 0.1; // s
        let mut model = self.model(speed, KICK, step)?;
        model.settings.end = 6.0 * WINDOW;
        let frame = model.bodies.iter().position(|body| body.name == "frame");
        let frame = frame.ok_or("no body `frame`")?;
        let text = model.to_toml()
            + "\n[[sensor]]\nname = \"steer\"\ntype = \"joint_coordinate\"\nof = \"steering\"\n";
        let nodes = nodes(&Model::from_toml(&text).map_err(|error| error.to_string())?)?;
        let director = |sample: &Sample, i: usize| {
            let first = 12 * frame + 3 + 3 * i;
            [0, 1, 2].map(|k| sample.q[first + k])
        };
        let lateral = (0..3)
            .find(|&i| director(&nodes[0], i)[1].abs() > 0.999)
            .ok_or("the frame has no lateral axis")?;
        let state = |sample: &Sample| vec![director(sample, lateral)[2], sample.sensors[0]];
        let y: Vec<_> = nodes.iter().map(state).collect();
        let stride = (WINDOW / step).round() as usize;
        Ok(of_map(&y, stride, stride as f64 * step))
    }

    fn run(&self) -> Result<Runs, String> {
        let (mut continuous, mut discrete) = (Deviation::default(), Deviation::default());
        for (speed, case) in &self.speeds {
            let modes = modes(&self.model(speed, 0.0, 0.01)?)?;
            let moving = modes.iter().filter(|mode| mode.kind != ModeKind::Zero);
            let found: Vec<_> = moving.map(value).collect();
            raise(&mut continuous.q, distance(&found, &case.eigenvalues) / self.tolerance);
            for (step, expected) in &case.step {
                let h: f64 = step.parse().map_err(|_| "a step is no number".to_owned())?;
                let found = self.of_step(speed, h)?;
                raise(&mut discrete.q, distance(&found, expected) / OF_STEP);
            }
        }
        Ok(vec![("modes", continuous), ("nodal", discrete)])
    }
}

impl RotorCase {
    fn model(&self, case: &GrowthCase) -> Result<Model, String> {
        let set = [
            ("parameters.cross", format!("{:?}", case.factor * self.threshold)),
            ("simulation.step", format!("{:?}", case.step)),
        ];
        model(&self.model, &set)
    }

    fn run(&self) -> Result<Runs, String> {
        let (mut continuous, mut discrete) = (Deviation::default(), Deviation::default());
        for case in &self.rows {
            let mut at_rest = self.model(case)?;
            at_rest.bodies[0].velocity = [0.0; 3];
            // the rotor moves to and fro in its bearings, without tilting
            let shifts = |mode: &&Mode| {
                let [moved, before] = [mode.shape[0].translation, mode.shape[0].translation_before];
                let across = |x: [f64; 3]| x[0].hypot(x[1]);
                across(moved).hypot(across(before)) > 0.5 && mode.kind != ModeKind::Zero
            };
            let found = modes(&at_rest)?;
            let growth = found.iter().filter(shifts).map(|mode| value(mode).re);
            let growth = growth.fold(f64::NEG_INFINITY, f64::max);
            raise(&mut continuous.q, (growth - case.continuous).abs() / OF_STEP);
            let nodes = nodes(&self.model(case)?)?;
            let y: Vec<_> = nodes.iter().map(|node| vec![node.q[0], node.q[1]]).collect();
            let stride = (2e-3 / case.step).round() as usize;
            let growth = of_map(&y, stride, stride as f64 * case.step);
            let growth = growth.iter().map(|value| value.re).fold(f64::NEG_INFINITY, f64::max);
            raise(&mut discrete.q, (growth - case.growth).abs() / OF_STEP);
        }
        Ok(vec![("modes", continuous), ("nodal", discrete)])
    }
}

impl MotionCase {
    pub fn read(file: &Path, value: Value) -> Result<Self, String> {
        let unreadable = |error: serde_json::Error| format!("does not fit small motions: {error}");
        if value.get("speeds").is_some() {
            let mut case: BicycleCase = serde_json::from_value(value).map_err(unreadable)?;
            case.model = file.with_file_name(BICYCLE);
            return Ok(Self::Bicycle(case));
        }
        let mut case: RotorCase = serde_json::from_value(value).map_err(unreadable)?;
        case.model = file.with_file_name(&case.model);
        Ok(Self::Rotor(case))
    }

    pub fn run(&self) -> Result<Runs, String> {
        match self {
            Self::Bicycle(case) => case.run(),
            Self::Rotor(case) => case.run(),
        }
    }
}
