//! What tests of gradients compare with: numbers of `sensors.csv`, differences of whole runs,
//! tangents beside the run.

use super::prepared::{Begin, Prepared};
use super::{ModelGradient, Wanted, gradient};
use crate::simulation::Simulation;
use crate::system::outside::ExternalActions;
use holonom_model::ModelText;
use std::path::Path;
use vi_control::sensitivities::{Beside, Direction, Sensitivities};
use vi_multibody::design::start;

/// What is compared with.
const TARGET: f64 = 0.3;

/// A number of a sensor, which an objective compares with [`TARGET`] at the end or along the path.
pub(super) struct SeenNumber<'a> {
    pub(super) sensor: String,
    pub(super) part: &'a str,
    pub(super) at: &'a str,
}

impl<'a> SeenNumber<'a> {
    pub(super) fn new(sensor: &str, part: &'a str, at: &'a str) -> Self {
        Self { sensor: sensor.to_owned(), part, at }
    }

    /// The sensor and its objective.
    fn text(&self, number: &str, weight: f64) -> String {
        let Self { sensor, part, at } = self;
        let dot = if part.is_empty() { "" } else { "." };
        format!(
            "[[sensor]]\nname = \"seen{number}\"\n{sensor}[[objective]]\nname = \"near{number}\"\n\
             type = \"sensor\"\nsensor = \"seen{number}{dot}{part}\"\ntarget = {TARGET}\n\
             weight = {weight:?}\n{at}"
        )
    }

    fn what(&self) -> String {
        format!("{} {} {}", self.sensor, self.part, self.at).replace('\n', " ")
    }
}

/// Numbers of sensors: kind, of what, further keys, the numbers.
pub(super) fn seen<'a>(
    all: &[(&str, &str, &str, &'a [&'a str])],
    at: &'a str,
) -> Vec<SeenNumber<'a>> {
    let mut found = Vec::new();
    for (kind, of, more, parts) in all {
        let of = if of.is_empty() { String::new() } else { format!("of = \"{of}\"\n") };
        let sensor = format!("type = \"{kind}\"\n{of}{more}");
        found.extend(parts.iter().map(|part| SeenNumber::new(&sensor, part, at)));
    }
    found
}

/// A model with a sensor, and an objective of one of its numbers.
pub(super) fn sensing(text: &str, sensor: &str, part: &str, at: &str) -> String {
    format!("{text}{}", SeenNumber::new(sensor, part, at).text("", 1.0))
}

pub(super) const PATH: &str = "at = \"path\"\n";

/// `½ e²` of the number at the end or along the path, from the sensors of a run.
pub(super) fn shown(text: &str) -> f64 {
    let source = ModelText::from_text(Path::new("model.toml"), text);
    let model = source.model(&[]).unwrap();
    let read = model.objectives[0].sensor.clone().unwrap();
    let mut run = Simulation::new(&model).unwrap();
    let columns = run.sensors().columns();
    let place = columns.iter().position(|own| own.name() == read).unwrap_or_else(|| {
        let (name, part) = read.split_once('.').unwrap();
        let first = columns.iter().position(|own| own.sensor == name).unwrap();
        first + part.parse::<usize>().unwrap()
    });
    let all: Vec<f64> = run.samples().map(|own| own.unwrap().sensors[place]).collect();
    let square = |y: f64| 0.5 * (y - TARGET) * (y - TARGET);
    let last = square(all[all.len() - 1]);
    match text.contains(PATH) {
        false => last,
        true => {
            let sum: f64 = all.iter().map(|y| square(*y)).sum();
            model.settings.step * (sum - 0.5 * (last + square(all[0])))
        }
    }
}

/// The worst of what is found apart of both: of values, and of derivatives by differences.
#[derive(Default)]
pub(super) struct Worst {
    pub(super) value: f64,
    pub(super) differences: f64,
    pub(super) forward: f64,
}

/// All derivatives by tangents beside the run: by parameters, by coordinates and rates at the
/// start, by each control as a whole.
pub(super) fn forward(source: &ModelText) -> [Vec<f64>; 3] {
    let model = source.model(&[]).unwrap();
    let (all, outside) = (Wanted::everything(), ExternalActions::default());
    let mut prepared = Prepared::new(&model, &[], &[], &outside).unwrap();
    let tangents = all.tangents((source, &[], &model), &prepared.system).unwrap();
    prepared.depend(&[], &super::Prices::default(), &tangents).unwrap();
    let begin = Begin::new(&mut prepared).unwrap();
    let design = crate::design::mechanism_design(&prepared.system, &begin.mass, &tangents).unwrap();
    let mechanism = &prepared.system.mechanism;
    let of = begin.of(&model, mechanism);
    let run = prepared.simulation.integrator();
    let changes = begin.changes(&of, run, &design, &tangents).unwrap();
    let coordinates = of.coordinates_with(&[]).unwrap();
    let plain: Vec<_> = coordinates.iter().map(|own| own.2.clone()).collect();
    let (mass, rows, at) = (&begin.mass, begin.rows(), begin.at());
    let starts = start::derivatives(mechanism, mass, rows, at, &plain, &[]).unwrap();
    let mut directions = Vec::new();
    for (k, (change, own)) in changes.iter().zip(&tangents).enumerate() {
        let start = begin.tangent(run, change, Some(own));
        directions.push(Direction { start, parameter: Some(k), ..Direction::default() });
    }
    for change in starts.coordinates.iter().chain(&starts.rates) {
        directions.push(Direction::from(begin.tangent(run, change, None)));
    }
    let zero = begin.tangent(run, &start::StartTangent::zero(begin.q.len()), None);
    for c in 0..model.controls.len() {
        let row = |k: usize| f64::from(u8::from(k == c));
        let row: Vec<f64> = (0..model.controls.len()).map(row).collect();
        let controls = vec![row; prepared.steps];
        directions.push(Direction { controls, ..Direction::from(zero.clone()) });
    }
    let objective = &prepared.costs.sum;
    let beside = Beside { controls: &prepared.controls, design: Some(&design), objective };
    let mut tangents = Sensitivities::new(run, model.settings.step, directions).unwrap();
    for _ in 0..prepared.steps {
        tangents.advance(run, beside).unwrap();
    }
    tangents.add_forces(run, beside, true).unwrap();
    let mut rates = tangents.rates(beside, run.state());
    let controls = rates.split_off(rates.len() - model.controls.len());
    let initial = rates.split_off(changes.len());
    [rates, initial, controls]
}

/// How far forward and backward are apart, relative to the largest derivative of a kind.
pub(super) fn apart([parameters, initial, controls]: &[Vec<f64>; 3], of: &ModelGradient) -> f64 {
    let by_start = of.initial.iter().map(|own| own.coordinate);
    let by_start: Vec<f64> =
        by_start.chain(of.initial.iter().map(|own| own.rate.unwrap_or(0.0))).collect();
    let by_controls = of.controls.iter().map(|own| own.derivatives.iter().sum()).collect();
    let by_parameters: Vec<f64> = of.parameters.iter().map(|own| own.derivative).collect();
    let kinds = [(parameters, by_parameters), (initial, by_start), (controls, by_controls)];
    let kind = |(forward, backward): (&Vec<f64>, Vec<f64>)| {
        assert_eq!(forward.len(), backward.len());
        let size = backward.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
        let off = forward.iter().zip(&backward).map(|(a, b)| (a - b).abs());
        if size == 0.0 { 0.0 } else { off.fold(0.0, f64::max) / size }
    };
    kinds.into_iter().map(kind).fold(0.0, f64::max)
}

/// The largest derivative.
fn largest(of: &ModelGradient) -> f64 {
    let parameters = of.parameters.iter().map(|own| own.derivative);
    let initial = of.initial.iter().flat_map(|own| [own.coordinate, own.rate.unwrap_or(0.0)]);
    let controls = of.controls.iter().flat_map(|own| own.derivatives.iter().copied());
    parameters.chain(initial).chain(controls).fold(0.0, |most: f64, x| most.max(x.abs()))
}

/// Asks for the gradient of the objectives, and for differences where these are wanted.
fn asked(what: &str, text: &str, with_differences: bool) -> ModelGradient {
    let source = ModelText::from_text(Path::new("model.toml"), text);
    let model = source.model(&[]).unwrap_or_else(|error| panic!("{what}: {error}"));
    let wanted = Wanted::everything();
    let found = gradient(&source, &[], &model, &wanted);
    let mut found = found.unwrap_or_else(|error| panic!("{what}: {error}"));
    if with_differences {
        found.check(&source, &[], &model, &wanted).unwrap();
        assert!(!found.checks.is_empty(), "{what}");
    }
    found
}

impl Worst {
    /// The value is that of the sensor.
    fn shows(&mut self, what: &str, text: &str, found: &ModelGradient) {
        let shown = shown(text);
        let off = (found.value - shown).abs() / shown;
        println!("{what}: J {shown:.6e}, off by {off:.1e}");
        assert!(found.value > 0.0 && off <= 1e-12, "{what}: {} for {shown}", found.value);
        self.value = self.value.max(off);
    }

    /// Derivatives are within these of differences and of those forward.
    fn agrees(&mut self, what: &str, text: &str, found: &ModelGradient, within: [f64; 2]) {
        let source = ModelText::from_text(Path::new("model.toml"), text);
        let apart = apart(&forward(&source), found);
        let raw = |own: &super::Check| {
            let size = own.derivative.abs().max(own.difference.abs());
            (own.derivative - own.difference).abs() / size
        };
        let raw = found.checks.iter().map(raw).fold(0.0, f64::max);
        let worst = found.worst();
        println!(
            "{what}: differences apart by {worst:.1e} ({raw:.1e} with their rounding), forward by {apart:.1e}"
        );
        assert!(apart <= within[1], "{what}: {apart:e}");
        assert!(worst <= within[0], "{what}: {:#?}", found.checks);
        self.differences = self.differences.max(worst);
        self.forward = self.forward.max(apart);
    }

    /// One objective of a model: its value, its derivatives within these of differences and of
    /// those forward.
    pub(super) fn compare(&mut self, what: &str, text: &str, within: [f64; 2]) {
        let found = asked(what, text, true);
        self.shows(what, text, &found);
        self.agrees(what, text, &found, within);
    }

    /// Many objectives of a model, each with its value; derivatives are those of their sum, in
    /// which the largest one of each is 1. Where these disagree each one is compared alone, so that
    /// it is named.
    pub(super) fn compare_all(&mut self, text: &str, all: &[SeenNumber], within: [f64; 2]) {
        let alone = |own: &SeenNumber| format!("{text}{}", own.text("", 1.0));
        let mut together = text.to_owned();
        for (k, own) in all.iter().enumerate() {
            let found = asked(&own.what(), &alone(own), false);
            self.shows(&own.what(), &alone(own), &found);
            let largest = largest(&found);
            assert!(largest > 0.0, "{}: nothing changes it", own.what());
            together += &own.text(&k.to_string(), 1.0 / largest);
        }
        let what = format!("{} objectives", all.len());
        let found = asked(&what, &together, true);
        if found.worst() > within[0] {
            all.iter().for_each(|own| self.compare(&own.what(), &alone(own), within));
        }
        self.agrees(&what, &together, &found, within);
    }
}

impl Drop for Worst {
    fn drop(&mut self) {
        let Self { value, differences, forward } = self;
        println!("worst: values {value:.1e}, differences {differences:.1e}, forward {forward:.1e}");
    }
}
