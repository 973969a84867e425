//! Energies, works and velocities of nodes with contacts.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark::{model, samples};
use holonom::RunOutcome;
use holonom::output::SummaryBuilder;
use holonom::{Model, Sample, Simulation};
use vi_testkit::model::{AXES, along, body, heavy, hinge, part};

/// Gravity, m/s².
const DOWN: [f64; 3] = [0.0, 0.0, -9.81];

fn run(model: &Model) -> (Simulation, Vec<Sample>) {
    let mut simulation = Simulation::new(model).unwrap();
    let samples = samples(&mut simulation);
    (simulation, samples)
}

/// The least kinetic energy of a node in parts of the smaller one of its neighbours, of those that
/// have more than `least`, J: beside the turning points of the mechanism.
fn deepest_dip(samples: &[Sample], least: f64) -> f64 {
    let kinetic: Vec<f64> = samples.iter().map(|s| s.energies[0]).collect();
    let beside = |three: &&[f64]| three[0].min(three[2]) > least;
    let dips = kinetic.windows(3).filter(beside).map(|three| three[1] / three[0].min(three[2]));
    dips.fold(1.0, f64::min)
}

/// What turns back at a node, or is slowed by a force that is known at the end alone, moves: its
/// velocity is no zero, and that of the mechanism does not stop with it.
#[test]
fn joints_that_turn_back_do_not_stop_the_mechanism() {
    let four_bar = include_str!("../../examples/models/four_bar_friction.toml");
    let (_, samples) = run(&model(four_bar, &[]));
    let dip = deepest_dip(&samples, 0.01);
    println!("four-bar: kinetic energy of a node at least {dip:.2} of its neighbours");
    assert!(dip > 0.5, "{dip}");
}

/// A pendulum whose friction follows from its reaction has a rate at each node from the first step
/// on.
#[test]
fn friction_of_a_reaction_leaves_rates() {
    let text = heavy("pendulum", DOWN, "step = 0.002, end = 1.0")
        + &part("body", "rod")
        + "mass = 1.0\nposition = [0.25, 0.0, 0.0]\n"
        + "shape = { type = \"box\", dimensions = [0.5, 0.04, 0.04] }\n"
        + &hinge("pin", ["ground", "rod"], [0.0; 3], AXES[1])
        + "friction = { coefficient = 0.2, radius = 0.02 }\n"
        + &part("sensor", "rate")
        + "type = \"joint_rate\"\nof = \"pin\"\n";
    let (_, samples) = run(&model(&text, &[]));
    let dip = deepest_dip(&samples, 1e-3);
    let still = samples[1..].iter().filter(|s| s.sensors[0] == 0.0).count();
    println!("pendulum: {still} nodes without a rate, least part of neighbours {dip:.2}");
    assert!(still == 0 && dip > 0.5, "{still} {dip}");
}

/// A ball on a table that moves as stated: touches divide steps into parts of any length, and the
/// work of the motion is that of the table alone.
#[test]
fn the_work_of_motions_beside_touches_closes_the_balance() {
    for rate in ["0.0", "0.3", "-1.0"] {
        for step in ["0.01", "0.005", "0.0025"] {
            let text = heavy("anvil", DOWN, "step = 0.005, end = 1.0")
                + &body("table", 10.0, [1.0; 3])
                + &along(AXES[2], "prismatic", "slide", ["ground", "table"], [0.0; 3])
                + &format!("rate = {rate}\n")
                + &part("constraint", "drive")
                + &format!("type = \"motion\"\njoint = \"slide\"\npath = {{ rate = {rate} }}\n")
                + &part("body", "ball")
                + "shape = { type = \"sphere\", dimensions = [0.1], density = 900.0 }\n"
                + "position = [0.0, 0.0, 0.5]\n"
                + &part("contact", "on")
                + "a = { plane = { on = \"table\" } }\nb = \"ball\"\nrestitution = 0.4\n";
            let (_, samples) = run(&model(&text, &[("simulation.step", step)]));
            let last = samples.last().unwrap();
            let (balance, scale) = (last.energies.last().unwrap().abs(), last.work.abs());
            println!("rate {rate}, h = {step}: balance {balance:.1e} J of {scale:.3} J");
            assert!(balance < 1e-11 * scale.max(1.0), "{rate} {step}: {balance}");
        }
    }
}

/// An impact at the first node belongs to the work of the run, not to its initial energy.
#[test]
fn the_initial_energy_is_that_before_an_impact() {
    let text = heavy("door", [0.0; 3], "step = 0.005, end = 0.5")
        + &part("body", "door")
        + "mass = 30.0\nposition = [0.45, 0.0, 0.0]\n"
        + "shape = { type = \"box\", dimensions = [0.9, 0.04, 2.0] }\n"
        + &hinge("hinge", ["ground", "door"], [0.0; 3], AXES[2])
        + "rate = 1.5\nlimits = { upper = 0.0, restitution = 0.5 }\n";
    let stated = model(&text, &[]);
    let (simulation, samples) = run(&stated);
    let mut summary = SummaryBuilder::default();
    samples.iter().for_each(|sample| summary.record(sample));
    let energy = summary.finish(&stated, simulation.assembly(), &RunOutcome::Done, 0.0).energy;
    let inertia = 30.0 * ((0.9 * 0.9 + 0.04 * 0.04) / 12.0 + 0.45 * 0.45);
    let before = 0.5 * inertia * 1.5 * 1.5;
    println!("initially {} J, expected {before}, off {:.1e}", energy.initial, energy.balance_error);
    assert!((energy.initial - before).abs() < 1e-12 * before);
    assert!((energy.last - 0.25 * before).abs() < 1e-12 * before);
    assert!(energy.balance_error.abs() < 1e-12 * before);
}
