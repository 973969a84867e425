//! IFToMM A01: the simple pendulum, against its exact motion in elliptic functions.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::{Run, assert_order, study};

const MODEL: &str = include_str!("../../examples/models/simple_pendulum.toml");
const EXACT: [(f64, f64, f64); 4] = [
    (1.0, 0.986_291_751_132, -0.165_010_853_126),
    (2.0, -0.793_566_195_343, -0.608_483_930_444),
    (9.99, -0.316_436_469_913, -0.948_613_704_576),
    (10.0, -0.275_087_462_576, -0.961_419_205_099),
];

/// At those of the times that are on a step.
fn error(h: f64, order: u32) -> f64 {
    let mut run = Run::new(MODEL, h, order);
    let mut worst = 0.0_f64;
    let is_on_step = |t: f64| (t / h - (t / h).round()).abs() < 1e-6;
    for (t, x, y) in EXACT.into_iter().filter(|(t, ..)| is_on_step(*t)) {
        run.until(t);
        worst = worst.max((run.q()[0] - x).hypot(run.q()[1] - y));
    }
    worst
}

#[test]
fn positions_converge_with_the_nominal_order() {
    let (_, orders) = study("positions, order 2", &[1e-2, 5e-3, 2.5e-3, 1.25e-3], |h| error(h, 2));
    assert_order(&orders, 2.0, 0.05);
    let (errors, orders) = study("positions, order 4", &[1e-2, 5e-3, 2.5e-3], |h| error(h, 4));
    assert_order(&orders, 4.0, 0.2);
    assert!(errors[2] < 1e-6);
    let (errors, orders) = study("positions, order 6", &[1e-1, 5e-2, 2.5e-2], |h| error(h, 6));
    assert_order(&orders, 6.0, 0.5);
    assert!(errors[2] < 1e-8, "{:e}", errors[2]);
    let (errors, _) = study("positions, order 6", &[1e-2, 5e-3], |h| error(h, 6));
    assert!(errors[1] < 1e-11, "the printed digits: {:e}", errors[1]);
    let (errors, _) = study("positions, order 8", &[1e-2, 5e-3], |h| error(h, 8));
    assert!(errors[1] < 1e-11, "the printed digits: {:e}", errors[1]);
}

#[test]
fn the_energy_has_no_trend() {
    for h in [1e-2, 8e-4] {
        let mut run = Run::new(MODEL, h, 2);
        let worst = |run: &mut Run| {
            let mut worst = 0.0_f64;
            for _ in 0..(5.0 / h) as usize {
                run.steps(1);
                worst = worst.max(run.energy().abs());
            }
            worst
        };
        let (first, second) = (worst(&mut run), worst(&mut run));
        println!("h = {h}: |H_d| up to {first:.3e} J in 0-5 s, {second:.3e} J in 5-10 s");
        assert!(second < 1.05 * first && first < 50.0 * h * h, "{first:e} {second:e}");
    }
}
