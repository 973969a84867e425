//! Time to record every node against the time of the step: shipped models, and a chain of 64.
//!
//! ```text
//! read      all quantities of a node                     (run − steps) / steps
//! files     the same with trajectory.csv and residuals.csv
//! reaction  read with sensors of all joint reactions
//! ```
//! Each number is the least of fifteen runs over the same motion, less one, relative to the step.
#![allow(clippy::unwrap_used)] // a bench

use holonom::model::Columns;
use holonom::output::TrajectoryWriter;
use holonom::{Model, Sample, Simulation};
use std::fmt::Write as _;
use std::time::Instant;

/// Chain of boxes on hinges with alternating axes, as the shipped `chain8`.
fn chain(n: usize) -> String {
    let mut text = String::from("model = { name = \"chain\", gravity = [0.0, 0.0, -9.81] }\n");
    let mut parent = String::from("ground");
    for i in 0..n {
        let x = i as f64;
        write!(
            text,
            "[[body]]\nname = \"b{i}\"\nmass = 1.0\nshape = {{ type = \"box\", dimensions = [1.0, 0.1, 0.1] }}\n\
             position = [{:?}, 0.0, 0.0]\n\
             [[joint]]\nname = \"j{i}\"\ntype = \"revolute\"\nparent = \"{parent}\"\nchild = \"b{i}\"\n\
             position = [{x:?}, 0.0, 0.0]\naxis = [0.0, {}]\n",
            x + 0.5,
            if i % 2 == 0 { "1.0, 0.0" } else { "0.0, 1.0" },
        )
        .unwrap();
        parent = format!("b{i}");
    }
    text + "[simulation]\nstep = 0.002\nend = 1.0\n"
}

/// A model that records each of `steps` nodes, with a sensor for each joint if there are `reactions`.
fn model(text: &str, steps: u64, reactions: bool) -> Model {
    let mut model = Model::from_toml(text).unwrap();
    model.settings.every = 1;
    model.settings.end = model.settings.step * steps as f64;
    model.sensors.clear();
    if !reactions {
        return model;
    }
    let mut text = model.to_toml();
    for joint in &model.joints {
        let name = &joint.name;
        write!(text, "\n[[sensor]]\nname = \"R{name}\"\nof = \"{name}\"\ntype = \"reaction\"\n")
            .unwrap();
    }
    Model::from_toml(&text).unwrap()
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
        TrajectoryWriter::new((sink(), sink()), simulation.members(), &Columns::usual()).unwrap();
    let begin = Instant::now();
    let mut observe = |sample: &Sample| if files { writer.record(sample) } else { Ok(()) };
    simulation.run(&mut observe, &mut |_, _| {}).unwrap();
    begin.elapsed().as_secs_f64()
}

fn main() {
    let only = std::env::args().nth(1).filter(|name| !name.starts_with('-'));
    println!("{:<20} {:>10} {:>6} {:>6} {:>8}", "model", "step, s", "read", "files", "reaction");
    let shipped = |name: &str| {
        let path = format!("{}/../examples/models/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        (name.to_owned(), std::fs::read_to_string(path).unwrap())
    };
    let mut cases = vec![shipped("chain8"), ("chain64".to_owned(), chain(64))];
    cases.push(("chain512".to_owned(), chain(512)));
    for name in ["bricard", "andrews_squeezer", "six_hinge_cube", "four_bar_windows_40"] {
        cases.push(shipped(name));
    }
    cases.extend(["heavy_top", "four_particles", "flying_beam", "flexible_four_bar"].map(shipped));
    for (name, text) in cases.iter().filter(|case| only.as_ref().is_none_or(|o| *o == case.0)) {
        let steps = if text.len() > 20_000 { 10 } else { 100 };
        let plain = model(text, steps, false);
        let [step, read, files] = least(
            steps,
            [&|| time_steps(&plain, steps), &|| time_run(&plain, false), &|| {
                time_run(&plain, true)
            }],
        );
        let sensed = model(text, steps, true);
        let [reaction] = least(steps, [&|| time_run(&sensed, false)]);
        let [read, files, reaction] = [read, files, reaction].map(|time| time / step - 1.0);
        println!("{name:<20} {step:>10.2e} {read:>6.2} {files:>6.2} {reaction:>8.2}");
    }
}
