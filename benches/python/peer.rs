//! What `package.py` compares the Python package with: the same run and the same members in Rust.
//!
//! ```text
//! steps    steps alone                                    µs a step
//! run      all quantities of each node and the summary, as the program without files
//! members  256 members side by side on one thread, no node of which is read
//! ```
//! Processor time of the least of some rounds. The argument is a model file.
#![allow(clippy::unwrap_used)] // a bench

use holonom::output::SummaryBuilder;
use holonom::{Members, Model, Sample, Simulation};
use std::time::Instant;

const MEMBERS: usize = 256;
const STEPS: u64 = 500;

/// Processor time of this thread, s; where the system does not tell, the time.
fn now(since: Instant) -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = text.and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| since.elapsed().as_secs_f64(), |own| 1e-9 * own)
}

/// The least time of one of `count`, µs, without what is made before.
fn least<T>(count: f64, rounds: usize, make: impl Fn() -> T, take: impl Fn(&mut T)) -> f64 {
    let since = Instant::now();
    let mut least = f64::INFINITY;
    for _ in 0..rounds {
        let mut made = make();
        let begin = now(since);
        take(&mut made);
        least = least.min(now(since) - begin);
    }
    1e6 * least / count
}

fn main() {
    let Some(path) = std::env::args().skip(1).find(|word| !word.starts_with('-')) else {
        println!("name a model file");
        return;
    };
    let text = std::fs::read_to_string(&path).unwrap();
    let model = Model::from_toml(&text).unwrap();
    let simulation = || Simulation::new(&model).unwrap();
    let count = (model.settings.end / model.settings.step).round();
    let steps = least(count, 10, simulation, |run| {
        (0..count as u64).for_each(|_| run.step_on().unwrap());
    });
    let run = least(count, 10, simulation, |run| {
        let mut summary = SummaryBuilder::of(None);
        let mut observe = |sample: &Sample| {
            summary.record(sample);
            Ok::<(), std::io::Error>(())
        };
        run.run_while(&mut observe, &mut |_, _| true).unwrap();
    });
    let members = || {
        let all = (0..MEMBERS).map(|k| {
            let mut own = model.clone();
            own.bodies[1].mass = own.bodies[1].mass.map(|_| 0.4 + 0.001 * k as f64);
            Simulation::new(&own).unwrap()
        });
        Members::new(all.collect()).unwrap()
    };
    let lanes = least((MEMBERS as u64 * STEPS) as f64, 6, members, |all| all.step(STEPS));
    println!("{steps:.4} {run:.4} {lanes:.5}");
}
