//! IFToMM A02: windows of four-bar linkages through their flat positions, 2 and 40 of them.
//!
//! As long as the links remain parallelograms the motion is `θ̈ = c g sin θ`, `θ(0) = 0`,
//! `θ̇(0) = 1`, `c = ((N+1)/2 + N) / ((N+1)/3 + N)`.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::{Run, assert_order, ode, study};

const TWO: &str = include_str!("../../examples/models/four_bar_windows.toml");
const FORTY: &str = include_str!("../../examples/models/four_bar_windows_40.toml");

/// `(θ, θ̇)` at `t`.
fn exact(windows: f64, t: f64) -> [f64; 2] {
    let c = ((windows + 1.0) / 2.0 + windows) / ((windows + 1.0) / 3.0 + windows);
    ode(|y: &[f64; 2]| [y[1], c * 9.81 * y[0].sin()], [0.0, 1.0], t)
}

/// Every crank is parallel to the first and every coupler level: the parallelogram branch.
fn branch(run: &mut Run, windows: usize) -> f64 {
    let first = run.coordinates("crank0");
    let mut worst = 0.0_f64;
    for k in 1..=windows {
        let (crank, coupler) =
            (run.coordinates(&format!("crank{k}")), run.coordinates(&format!("coupler{k}")));
        for i in 3..12 {
            worst = worst.max((crank[i] - first[i]).abs());
        }
        worst = worst.max((coupler[1] - 2.0 * first[1]).abs());
    }
    worst
}

#[test]
fn the_exact_motion_is_that_of_the_table() {
    for (t, x, y, vx, vy) in [
        (1.0, -0.195_020_301_949, -0.980_799_205_662, -6.676_678_036_881, 1.327_578_325_161),
        (4.0, 0.117_616_102_377, 0.993_059_138_451, 1.069_039_265_029, -0.126_615_049_166),
        (10.0, 0.328_458_111_539, 0.944_518_538_179, 1.423_051_470_204, -0.494_868_845_484),
    ] {
        let [theta, rate] = exact(2.0, t);
        let motion = [theta.sin(), theta.cos(), rate * theta.cos(), -rate * theta.sin()];
        for (found, expected) in motion.iter().zip([x, y, vx, vy]) {
            assert!((found - expected).abs() < 1e-10, "t = {t}: {found} {expected}");
        }
    }
}

fn two_windows(h: f64, order: u32, times: &[f64]) -> f64 {
    let mut run = Run::new(TWO, h, order);
    let top = run.point("crank0", [0.0, 1.0, 0.0]);
    let mut worst = 0.0_f64;
    for &t in times {
        run.until(t);
        let [theta, rate] = exact(2.0, t);
        let (x, v) = (run.at(top), run.rate(top));
        worst = worst.max((x.x - theta.sin()).hypot(x.y - theta.cos()));
        worst = worst.max((v.x - rate * theta.cos()).hypot(v.y + rate * theta.sin()) / 7.0);
    }
    assert!(branch(&mut run, 2) < 1e-10, "off the parallelogram by {:e}", branch(&mut run, 2));
    worst
}

#[test]
fn two_windows_converge_with_the_nominal_order() {
    let (_, orders) = study("N = 2, order 2, t = 1, 4, 10", &[8e-3, 4e-3, 2e-3], |h| {
        two_windows(h, 2, &[1.0, 4.0, 10.0])
    });
    assert_order(&orders, 2.0, 0.1);
    let (_, orders) =
        study("N = 2, order 4, t = 1, 4", &[2e-2, 1e-2], |h| two_windows(h, 4, &[1.0, 4.0]));
    assert_order(&orders, 4.0, 0.6);
}

#[test]
fn two_windows_keep_their_energy() {
    let mut run = Run::new(TWO, 4e-3, 2);
    let start = run.energy();
    assert!((start - 35.835).abs() < 1e-12, "{start}");
    let mut worst = [0.0_f64; 2];
    for k in 0..1250 {
        run.steps(2);
        worst[k / 625] = worst[k / 625].max((run.energy() - start).abs());
    }
    println!(
        "N = 2, h = 4e-3: energy error {:.2e} J in 0-5 s, {:.2e} J in 5-10 s",
        worst[0], worst[1]
    );
    assert!(worst[1] < 1.2 * worst[0] && worst[0] < 0.05, "{worst:?}");
    assert!(run.residual() < 1e-13);
}

fn forty_windows(h: f64, order: u32, end: f64) -> f64 {
    let begin = std::time::Instant::now();
    let mut run = Run::new(FORTY, h, order);
    let start = run.energy();
    assert!((start - 620.338_333_333_333).abs() < 1e-9, "{start}");
    let top = run.point("crank0", [0.0, 1.0, 0.0]);
    let set_up = begin.elapsed().as_secs_f64();
    run.until(end);
    let elapsed = begin.elapsed().as_secs_f64();
    let [theta, _] = exact(40.0, end);
    let (x, off) = (run.at(top), branch(&mut run, 40));
    let error = (x.x - theta.sin()).hypot(x.y - theta.cos());
    println!(
        "N = 40, order {order}, h = {h}: t = {end}, error {error:.2e} m, energy error {:.2e} J, \
         off the parallelogram {off:.1e}, |g| {:.1e}, {:.1} s ({set_up:.2} s set-up, {} \
         iterations)",
        run.energy() - start,
        run.residual(),
        elapsed,
        run.iterations,
    );
    assert!(off < 1e-9 && run.residual() < 1e-12);
    error
}

#[test]
fn forty_windows_pass_their_flat_positions() {
    // θ passes π/2 at 0.72 s and 3π/2 at 1.24 s
    assert!(forty_windows(1e-2, 2, 1.3) < 0.2);
}

#[test]
#[ignore = "long: cargo test --release -- --ignored"]
fn forty_windows_for_20_s() {
    assert!(forty_windows(2e-3, 2, 20.0) < 0.1);
    assert!(forty_windows(1e-2, 4, 20.0) < 0.05);
}
