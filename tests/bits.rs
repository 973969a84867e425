//! Trajectories have the same bits at every level of optimization and on every processor.
//!
//! The snapshot holds a hash of all coordinates, energies and sensors of the first steps. Whoever
//! changes an operation of a step changes it; the same source never does, whatever the compiler and
//! the processor make of it.
#![allow(clippy::unwrap_used)] // a test

use crate::{benchmark, harness};

use benchmark::model;
use fnv::FnvHasher;
use harness::models::{all_shipped, read, shipped};
use holonom::model::Scheme;
use holonom::simulation::RunOutcome;
use holonom::{Model, Override, Sample, run};
use std::fmt::Write;
use std::hash::Hasher;

/// Steps of a motion; equilibria as they are.
const STEPS: u64 = 50;

fn hash_of(model: &Model) -> u64 {
    let settings = &model.settings;
    let end = (STEPS.min(settings.steps()) as f64 * settings.step).to_string();
    let short = [Override::new("simulation.end", end), Override::new("simulation.every", "1")];
    let is_static = settings.scheme == Scheme::Static;
    let model = if is_static { model.clone() } else { model.with_overrides(&short).unwrap() };
    let mut hasher = FnvHasher::default();
    let mut observe = |sample: &Sample| {
        let energies = [sample.energy, sample.hamiltonian];
        for x in sample.q.iter().chain(&energies).chain(&sample.energies).chain(&sample.sensors) {
            hasher.write_u64(x.to_bits());
        }
        Ok(())
    };
    let outcome = run::prepare(&model).unwrap().run(&mut observe, &mut |_, _| {}).unwrap();
    assert_eq!(outcome, RunOutcome::Done, "{}", model.header.name);
    hasher.finish()
}

fn hashes() -> String {
    let mut text = String::new();
    for (name, path) in all_shipped() {
        let model = read(&path, &[]);
        writeln!(text, "{name:<24} {:016x}", hash_of(&model)).unwrap();
    }
    for name in ["chain8", "four_bar_loop", "flyball_governor", "four_particles"] {
        for scheme in
            ["constrained", "dalembert", "reduced", "em-nodal", "em-constrained", "em-dalembert"]
        {
            let text_of_model = shipped(name);
            let value = format!("\"{scheme}\"");
            let model = model(&text_of_model, &[("simulation.scheme", &value)]);
            writeln!(text, "{name:<24} {:016x} {scheme}", hash_of(&model)).unwrap();
        }
    }
    text
}

#[test]
fn trajectories_have_the_same_bits() {
    insta::assert_snapshot!("bits_of_trajectories", hashes());
}

/// The same snapshot, compiled for speed.
#[test]
#[ignore = "the same bits in a release build: cargo xtask verify"]
fn trajectories_have_the_same_bits_in_release() {
    insta::assert_snapshot!("bits_of_trajectories", hashes());
}
