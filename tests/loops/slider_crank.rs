//! Spatial slider-crank (Haug 1989): revolute, spherical, universal and prismatic joints in a loop.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::{Rotation, Run, assert_order, study};

const MODEL: &str = include_str!("../../examples/models/slider_crank.toml");
const REFERENCE: [(f64, f64, f64); 3] = [
    (0.5, 0.184_952_629_778, 5.583_762_553_307),
    (1.0, 0.211_721_661_393, 10.913_590_729_864),
    (2.0, 0.289_085_197_067, 21.072_744_522_766),
];

fn follow(run: &mut Run, crank: &mut Rotation, t: f64) {
    while run.t() < t - 0.5 * run.h {
        run.steps(1);
        crank.follow(run);
    }
}

/// Largest error of slider and crank up to 2 s.
fn error(h: f64, order: u32) -> f64 {
    let mut run = Run::new(MODEL, h, order);
    let mut crank = Rotation::new(&mut run, "crank", [1.0, 0.0, 0.0], 0.0);
    let mut worst = 0.0_f64;
    for (t, x, angle) in REFERENCE {
        follow(&mut run, &mut crank, t);
        worst = worst.max((run.coordinates("slider")[0] - x).abs());
        worst = worst.max((crank.angle - angle).abs());
    }
    assert!(run.residual() < 1e-13);
    worst
}

#[test]
fn the_start_is_that_of_the_literature() {
    let mut run = Run::new(MODEL, 1e-2, 2);
    let report = run.simulation.assembly();
    assert_eq!((report.counts.dof, report.counts.redundant_constraints), (1, 0));
    assert!(report.closure.position < 1e-15 && report.closure.velocity < 1e-14, "{report:?}");
    let energy = run.energy();
    assert!((energy - 0.766_435_680).abs() < 1e-9, "{energy}");
}

#[test]
fn slider_and_crank_converge_with_the_nominal_order() {
    let (_, orders) =
        study("slider and crank, order 2", &[1e-2, 5e-3, 2.5e-3, 1.25e-3], |h| error(h, 2));
    assert_order(&orders, 2.0, 0.1);
    let (_, orders) = study("order 4", &[1e-2, 5e-3, 2.5e-3], |h| error(h, 4));
    assert_order(&orders, 4.0, 0.3);
    let (errors, _) = study("order 8", &[1e-2, 5e-3], |h| error(h, 8));
    assert!(errors[1] < 2e-10, "{:e}", errors[1]);
}

#[test]
fn five_seconds() {
    let mut run = Run::new(MODEL, 5e-3, 8);
    let mut crank = Rotation::new(&mut run, "crank", [1.0, 0.0, 0.0], 0.0);
    follow(&mut run, &mut crank, 5.0);
    let (x, energy) = (run.coordinates("slider")[0], run.energy());
    let errors = [x - 0.240_719_573_732, crank.angle - 54.333_332_168_268, energy - 0.766_435_680];
    println!(
        "5 s: slider {:.1e} m, crank {:.1e} rad, energy {:.1e} J",
        errors[0], errors[1], errors[2]
    );
    assert!(errors.iter().all(|e| e.abs() < 1e-8), "{errors:?}");
}
