//! IFToMM A05: the stiff flyball governor, with spring-dampers that couple bodies.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::{Run, assert_order, study};

const MODEL: &str = include_str!("../../examples/models/flyball_governor.toml");

fn height(run: &mut Run) -> f64 {
    run.coordinates("slider")[2]
}

/// Angular velocity of the shaft about z.
fn spin(run: &mut Run) -> f64 {
    let shaft = run.point("shaft", [0.005, 0.0, 0.5]);
    let velocity = run.rate(shaft);
    velocity.norm() / 0.005
}

/// Errors of height and spin at 0.1, 0.5 and 1 s.
fn error(h: f64) -> f64 {
    let mut run = Run::new(MODEL, h, 2);
    let mut worst = 0.0_f64;
    for (t, s, omega) in [
        (0.1, 0.523_836_475_570, 6.103_717_809),
        (0.5, 0.743_249_424_786, 5.103_415_422),
        (1.0, 0.501_420_922_380, 6.271_125_742),
    ] {
        run.until(t);
        worst = worst.max((height(&mut run) - s).abs()).max((spin(&mut run) - omega).abs());
    }
    worst
}

#[test]
fn height_and_spin_converge_with_order_2() {
    let (errors, orders) = study("height and spin to 1 s", &[4e-3, 2e-3, 1e-3, 5e-4], error);
    assert_order(&orders, 2.0, 0.1);
    assert!(errors[3] < 1e-4, "{:e}", errors[3]);
}

#[test]
fn the_first_maximum_momentum_and_energy() {
    let mut run = Run::new(MODEL, 1e-3, 2);
    let momentum = run.momentum()[1].z;
    let (mut top, mut energy, mut gained) = ((0.0, 0.0_f64), run.energy(), 0.0_f64);
    let start = energy;
    for _ in 0..1000 {
        run.steps(1);
        let (t, s) = (run.t(), height(&mut run));
        if s > top.1 {
            top = (t, s);
        }
        let now = run.energy();
        gained = gained.max(now - energy);
        energy = now;
    }
    let drift = (run.momentum()[1].z - momentum).abs();
    println!(
        "maximum {:.5} m at {:.4} s; angular momentum {momentum:.6} drifts by {drift:.1e}; energy \
         {start:.6} J loses {:.3e} J, gains at most {gained:.1e} J in a step",
        top.1,
        top.0,
        start - energy
    );
    assert!((top.1 - 0.743_57).abs() < 1e-4 && (top.0 - 0.5125).abs() < 2e-3, "{top:?}");
    assert!(drift < 1e-12 * momentum.abs(), "{drift:e}");
    assert!(energy < start, "the dampers take energy out");
}

#[test]
fn dampers_ask_for_order_2() {
    let model = benchmark::model(MODEL, &[("simulation.order", "4")]);
    let error = holonom::Simulation::new(&model).unwrap_err().to_string();
    assert!(error.contains("backward"), "{error}");
}
