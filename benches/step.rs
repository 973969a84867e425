//! Cost of a step by scheme and by order, on the heavy top, a chain of eight links and a closed
//! loop, as ratios in one run.
//!
//! Beams of both elements are compared likewise.
//!
//! All four schemes give the same motion; what differs is the size of the Newton systems. Orders
//! above 2 are compositions of steps.
#![allow(clippy::unwrap_used, missing_docs)] // a bench; criterion's macro makes public items

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use holonom::{Model, Override, Simulation};
use std::time::{Duration, Instant};

const MODELS: [(&str, &str); 3] = [
    ("heavy_top", include_str!("../examples/models/heavy_top.toml")),
    ("chain8", include_str!("../examples/models/chain8.toml")),
    ("bricard", include_str!("../examples/models/bricard.toml")),
];
const SCHEMES: [&str; 4] = ["nodal", "reduced", "dalembert", "constrained"];
const ORDERS: [u32; 4] = [2, 4, 6, 8];
const REVERSAL: u64 = 256;

fn steps(simulation: &mut Simulation, taken: &mut u64, count: u64) -> Duration {
    let begin = Instant::now();
    for _ in 0..count {
        if *taken > 0 && taken.is_multiple_of(REVERSAL) {
            simulation.integrator().reverse();
        }
        simulation.integrator().step().unwrap();
        *taken += 1;
    }
    begin.elapsed()
}

fn step(criterion: &mut Criterion) {
    let quick = std::env::args().any(|a| a == "--test");
    for (name, text) in MODELS {
        let mut group = criterion.benchmark_group(format!("step/{name}"));
        group.sample_size(20).measurement_time(Duration::from_secs(1));
        let mut runs: Vec<(Simulation, u64)> = Vec::new();
        for scheme in SCHEMES {
            let set = [Override::new("simulation.scheme", scheme)];
            let model = Model::from_toml_with(text, &set).unwrap();
            let mut run = (Simulation::new(&model).unwrap(), 0);
            group.bench_function(BenchmarkId::from_parameter(scheme), |bencher| {
                bencher.iter_custom(|iterations| steps(&mut run.0, &mut run.1, iterations));
            });
            runs.push(run);
        }
        group.finish();
        if quick {
            continue;
        }
        // the schemes alternate, so that load on the machine slows all of them
        let mut best = [f64::INFINITY; SCHEMES.len()];
        for _ in 0..10 {
            for (best, (simulation, taken)) in best.iter_mut().zip(&mut runs) {
                *best = best.min(steps(simulation, taken, 2 * REVERSAL).as_secs_f64());
            }
        }
        for (scheme, time) in SCHEMES.iter().zip(best) {
            let one = 1e6 * time / (2 * REVERSAL) as f64;
            println!("{name}, {scheme}: {one:.2} µs a step, {:.2} of nodal", time / best[0]);
        }
    }
}

/// The orders of the nodal scheme in turn: the least time of a step, and its ratio to order 2.
fn order(_: &mut Criterion) {
    let quick = std::env::args().any(|a| a == "--test");
    for (name, text) in MODELS {
        let mut runs: Vec<(Simulation, u64)> = Vec::new();
        for order in ORDERS {
            let set = [Override::new("simulation.order", order.to_string())];
            let model = Model::from_toml_with(text, &set).unwrap();
            runs.push((Simulation::new(&model).unwrap(), 0));
        }
        let mut best = [f64::INFINITY; ORDERS.len()];
        let count = if quick { 1 } else { REVERSAL };
        for _ in 0..if quick { 1 } else { 10 } {
            for (best, (simulation, taken)) in best.iter_mut().zip(&mut runs) {
                *best = best.min(steps(simulation, taken, count).as_secs_f64());
            }
        }
        for (order, time) in ORDERS.iter().zip(best) {
            let one = 1e6 * time / count as f64;
            println!("{name}, order {order}: {one:.2} µs a step, {:.2} of order 2", time / best[0]);
        }
    }
}

/// A model with the names of its beams.
type BeamModel = (&'static str, &'static str, &'static [&'static str]);

/// Trees and loops, in a plane and in space.
const BEAMS: [BeamModel; 6] = [
    ("flying_beam", include_str!("../examples/models/flying_beam.toml"), &["beam"]),
    ("elbow_cantilever", include_str!("../examples/models/elbow_cantilever.toml"), &["frame"]),
    ("soft_arm", include_str!("../examples/models/soft_arm.toml"), &["arm"]),
    (
        "flexible_slider_crank",
        include_str!("../examples/models/flexible_slider_crank.toml"),
        &["rod"],
    ),
    (
        "flexible_four_bar",
        include_str!("../examples/models/flexible_four_bar.toml"),
        &["coupler", "rocker"],
    ),
    ("whirling_shaft", include_str!("../examples/models/whirling_shaft.toml"), &["shaft"]),
];

/// Both elements of beams in turn, forwards, as damping allows: the least time of a step, its
/// Newton iterations, and its ratio to that of mean directors.
fn elements(_: &mut Criterion) {
    let quick = std::env::args().any(|a| a == "--test");
    let (rounds, count) = if quick { (1, 1) } else { (10, REVERSAL) };
    for (name, text, beams) in BEAMS {
        let mut best = [f64::INFINITY; 2];
        let mut iterations = [0; 2];
        for _ in 0..rounds {
            for (k, element) in ["mean_directors", "helicoidal"].into_iter().enumerate() {
                let own = |beam: &&str| Override::new(format!("beam.{beam}.element"), element);
                let set: Vec<Override> = beams.iter().map(own).collect();
                let model = Model::from_toml_with(text, &set).unwrap();
                let mut run = Simulation::new(&model).unwrap();
                let begin = Instant::now();
                iterations[k] =
                    (0..count).map(|_| run.integrator().step().unwrap().iterations).sum();
                best[k] = best[k].min(begin.elapsed().as_secs_f64());
            }
        }
        for (k, element) in ["mean_directors", "helicoidal"].into_iter().enumerate() {
            let (one, ratio) = (1e6 * best[k] / count as f64, best[k] / best[0]);
            let each = iterations[k] as f64 / count as f64;
            println!("{name}, {element}: {one:.2} µs a step, {each:.2} iterations, {ratio:.2}");
        }
    }
}

criterion_group!(benches, step, order, elements);
criterion_main!(benches);
