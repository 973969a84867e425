//! Shipped models that react: a suspension, a motor by its measured characteristic, a rotor in
//! oil-film bearings, against what their files say of them.

use crate::harness::models::{model, nodes};
use holonom::Sample;
use nalgebra::Complex;

/// A shipped model to another end, by another step.
fn run(name: &str, step: f64, end: f64) -> Vec<Sample> {
    let set = [("simulation.step", step), ("simulation.end", end), ("simulation.every", 1.0)];
    nodes(&model(name, &set.map(|(key, value)| (key, value.to_string()))))
}

/// Heights of wheel and chassis at t = 0.8 s, by an integration of the two equations with Runge's
/// and Kutta's method of order 4 and steps of 20 µs.
#[test]
fn a_suspension_meets_its_own_equations_of_motion() {
    let errors = [0.001, 0.0005].map(|step| {
        let end = run("suspension", step, 0.8).pop().unwrap().q;
        (end[2] - 0.295_821_054_5).abs().max((end[14] - 0.756_578_825_4).abs())
    });
    println!("error at t = 0.8 s: {:.1e}, {:.1e} m", errors[0], errors[1]);
    assert!(errors[1] < 2.5e-6 && errors[0] / errors[1] > 3.5, "order 2: {errors:?}");
}

/// The fan takes what the motor gives: the speed where the monotone cubic through the points of the
/// table (Fritsch and Carlson 1980) meets the torque of the air.
#[test]
fn a_motor_runs_up_to_where_its_characteristic_meets_the_fan() {
    let speeds = [145.0, 150.0, 153.0, 155.0];
    let torques = [14.739, 9.436, 5.619, 2.9];
    let width = |k: usize| speeds[k + 1] - speeds[k];
    let chord = |k: usize| (torques[k + 1] - torques[k]) / width(k);
    let slope = |k: usize| {
        let (a, b) = (2.0 * width(k) + width(k - 1), width(k) + 2.0 * width(k - 1));
        (a + b) / (a / chord(k - 1) + b / chord(k))
    };
    let torque = |speed: f64| {
        let (s, h) = ((speed - speeds[1]) / width(1), width(1));
        let (one, two) = (1.0 - s, s * s);
        torques[1] * (1.0 + 2.0 * s) * one * one
            + torques[2] * two * (3.0 - 2.0 * s)
            + h * (slope(1) * s * one * one - slope(2) * two * one)
    };
    let (mut low, mut high) = (speeds[1], speeds[2]);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        let drives = torque(middle) > 4e-4 * middle * middle;
        if drives { low = middle } else { high = middle }
    }
    let found = run("motor", 0.0005, 2.5);
    let [.., before, last] = &found[..] else { panic!("a run has nodes") };
    let turned = |body: usize| {
        let d1 = |at: &Sample| Complex::new(at.q[12 * body + 3], at.q[12 * body + 4]);
        (d1(last) / d1(before)).arg() / 0.0005
    };
    println!("{low:.6} rad/s by the table, motor {:.6}, fan {:.6}", turned(0), turned(1));
    assert!((turned(0) - low).abs() < 1e-5 && (turned(1) - low).abs() < 1e-5);
}

/// Below 316 rad/s the shaft turns with its unbalance; beyond it whirls, at half its speed.
#[test]
fn a_rotor_in_oil_film_bearings_whirls_at_half_its_speed() {
    let step = 0.0005;
    let found = run("bearing_rotor", step, 1.0);
    let size = |at: &Sample| at.q[0].hypot(at.q[1]);
    let largest = |from: f64, to: f64| {
        let inside = found.iter().filter(|at| at.t >= from && at.t <= to);
        inside.map(size).fold(0.0, f64::max)
    };
    let (before, after) = (largest(0.15, 0.33), largest(0.9, 1.0));
    let late: Vec<_> = found.iter().filter(|at| at.t > 0.8).collect();
    let turned: f64 = late
        .windows(2)
        .map(|pair| {
            let at = |k: usize| Complex::new(pair[k].q[0], pair[k].q[1]);
            (at(1) / at(0)).arg()
        })
        .sum();
    let whirl = turned / (late.len() - 1) as f64 / step;
    let half = 0.5 * (250.0 + 200.0 * 0.9);
    println!("{before:.1e} m, then {after:.1e} m at {whirl:.1} rad/s, half the speed is {half:.1}");
    assert!(before < 2e-5 && after > 1.5e-4, "{before:e} {after:e}");
    assert!((whirl / half - 1.0).abs() < 0.08, "{whirl}");
}
