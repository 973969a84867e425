//! A free closed loop of four bars with spherical joints, thrown by a triangular load.
//!
//! The impulse of a step is exactly `h (f, τ)`; the load is linear on each step when its kinks fall
//! on step boundaries, so the midpoint sums are exact: 400 N s.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::{Run, assert_order, study};
use nalgebra::Vector3;

const MODEL: &str = include_str!("../../examples/models/four_bar_loop.toml");

#[test]
fn impulse_momentum_and_energy() {
    let mut run = Run::new(MODEL, 0.05, 2);
    assert_eq!(run.simulation.assembly().counts.dof, 12);
    run.until(1.0);
    let [linear, angular] = run.momentum();
    assert!((linear - Vector3::new(400.0, 0.0, 0.0)).amax() < 1e-11, "{linear}");
    let bars = ["bar1", "bar2", "bar3", "bar4"];
    let center = |run: &mut Run| {
        let sum: Vector3<f64> =
            bars.iter().map(|b| Vector3::from_column_slice(&run.coordinates(b)[..3])).sum();
        sum / 4.0
    };
    let (before, energy) = (center(&mut run), run.energy());
    let (mut drift, mut spread) = (0.0_f64, 0.0_f64);
    for _ in 0..180 {
        run.steps(1);
        let [l, j] = run.momentum();
        drift = drift.max((l - linear).amax() / 400.0).max((j - angular).amax() / angular.amax());
        spread = spread.max((run.energy() - energy).abs() / energy);
    }
    let travelled = (center(&mut run) - before - Vector3::new(90.0, 0.0, 0.0)).amax();
    println!(
        "momentum maps drift by {drift:.1e}, energy stays within {spread:.1e} (relative), the \
         centre of mass is {travelled:.1e} m off 10 m/s"
    );
    assert!(drift < 1e-12 && travelled < 1e-10, "{drift:e} {travelled:e}");
    assert!(spread < 0.05, "{spread:e}");
    assert!(run.residual() < 1e-12);
}

fn bar(h: f64, order: u32) -> Vector3<f64> {
    let mut run = Run::new(MODEL, h, order);
    let corner = run.point("bar3", [-5.0, 5.0, 0.0]);
    run.until(3.0);
    run.at(corner)
}

#[test]
fn positions_converge_with_the_nominal_order() {
    // the kinks of the load at 0.5 and 1 s are on step boundaries, sub-steps of compositions
    // straddle none
    let fine = bar(0.05 / 16.0, 4);
    let (_, orders) =
        study("corner at 3 s, order 2", &[0.05, 0.025, 0.0125], |h| (bar(h, 2) - fine).norm());
    assert_order(&orders, 2.0, 0.2);
}
