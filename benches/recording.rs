//! Time to record every node against the time of the step: shipped models, and a chain of 64.
//!
//! ```text
//! read      all quantities of a node                     (run − steps) / steps
//! files     the same with trajectory.csv and residuals.csv
//! reaction  read with sensors of all joint reactions
//! ```
//! Each number is the least of fifteen runs over the same motion, less one, relative to the step.
#![allow(clippy::unwrap_used)] // a bench

use holonom::model::{Body, Columns, GROUND, Joint, Sensor, SensorKind};
use holonom::output::TrajectoryWriter;
use holonom::{Model, Sample, Simulation};
use std::time::Instant;

fn shipped(name: &str) -> Model {
    let path = format!("{}/../examples/models/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    Model::from_toml(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Chain of the boxes and hinges of the shipped `chain8`, released at rest.
fn chain(n: usize) -> Model {
    let mut model = shipped("chain8");
    model.settings.step = 0.002;
    let link = |i: usize| Body {
        name: format!("b{i}"),
        position: [i as f64 + 0.5, 0.0, 0.0],
        velocity: [0.0; 3],
        angular_velocity: None,
        ..model.bodies[0].clone()
    };
    let hinge = |i: usize| Joint {
        name: format!("j{i}"),
        parent: i.checked_sub(1).map_or(GROUND.to_owned(), |p| format!("b{p}")),
        child: format!("b{i}"),
        position: Some([i as f64, 0.0, 0.0]),
        ..model.joints[i % 2].clone()
    };
    (model.bodies, model.joints) = ((0..n).map(link).collect(), (0..n).map(hinge).collect());
    model
}

/// The model as it records each of `steps` nodes, with a sensor for each joint if there are
/// `reactions`.
fn recorded(model: &Model, steps: u64, reactions: bool) -> Model {
    let mut model = model.clone();
    model.settings.every = 1;
    model.settings.end = model.settings.step * steps as f64;
    let sensor = |joint: &Joint| {
        Sensor::new(format!("R{}", joint.name), SensorKind::Reaction, joint.name.clone())
    };
    let sensed = if reactions { &model.joints[..] } else { &[] };
    model.sensors = sensed.iter().map(sensor).collect();
    model
}

/// The least times of each of some measurements, taken in turn, s per step.
fn least<const K: usize>(steps: u64, runs: [&dyn Fn() -> f64; K]) -> [f64; K] {
    let mut least = [f64::INFINITY; K];
    for _ in 0..15 {
        least.iter_mut().zip(&runs).for_each(|(least, run)| *least = least.min(run()));
    }
    least.map(|time| time / steps as f64)
}

fn time_steps(model: &Model, steps: u64) -> f64 {
    let mut simulation = Simulation::new(model).unwrap();
    let begin = Instant::now();
    (0..=steps).for_each(|_| _ = simulation.step().unwrap()); // the last node takes a step, too
    begin.elapsed().as_secs_f64()
}

fn time_run(model: &Model, files: bool) -> f64 {
    let mut simulation = Simulation::new(model).unwrap();
    let sink = || std::io::BufWriter::new(std::fs::File::create("/dev/null").unwrap());
    let mut writer =
        TrajectoryWriter::new([sink(), sink()], simulation.members(), &Columns::usual(), false)
            .unwrap();
    let begin = Instant::now();
    let mut observe = |sample: &Sample| if files { writer.record(sample) } else { Ok(()) };
    simulation.run(&mut observe, &mut |_, _| {}).unwrap();
    begin.elapsed().as_secs_f64()
}

fn main() {
    let only = std::env::args().nth(1).filter(|name| !name.starts_with('-'));
    println!("{:<20} {:>10} {:>6} {:>6} {:>8}", "model", "step, s", "read", "files", "reaction");
    let case = |name: &str| (name.to_owned(), shipped(name));
    let mut cases = vec![case("chain8")];
    cases.extend([64, 512].map(|n| (format!("chain{n}"), chain(n))));
    for name in ["bricard", "andrews_squeezer", "six_hinge_cube", "four_bar_windows_40"] {
        cases.push(case(name));
    }
    cases.extend(["heavy_top", "four_particles", "flying_beam", "flexible_four_bar"].map(case));
    for (name, model) in cases.iter().filter(|case| only.as_ref().is_none_or(|o| *o == case.0)) {
        let steps = if model.bodies.len() > 64 { 10 } else { 100 };
        let plain = recorded(model, steps, false);
        let [step, read, files] = least(
            steps,
            [&|| time_steps(&plain, steps), &|| time_run(&plain, false), &|| {
                time_run(&plain, true)
            }],
        );
        let sensed = recorded(model, steps, true);
        let [reaction] = least(steps, [&|| time_run(&sensed, false)]);
        let [read, files, reaction] = [read, files, reaction].map(|time| time / step - 1.0);
        println!("{name:<20} {step:>10.2e} {read:>6.2} {files:>6.2} {reaction:>8.2}");
    }
}
