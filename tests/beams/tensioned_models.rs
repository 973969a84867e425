//! Shipped models of a guitar string, a contact wire, a mooring line, a helicopter blade and a rope
//! of a crane against closed forms and published numbers.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark::{model, ode, samples};
use holonom::modes::{About, ModalAnalysis, ModeKind};
use holonom::{Sample, Simulation};
use std::f64::consts::{PI, TAU};

const STRING: &str = include_str!("../../examples/models/guitar_string.toml");
const WIRE: &str = include_str!("../../examples/models/contact_wire.toml");
const MOORING: &str = include_str!("../../examples/models/mooring_line.toml");
const BLADE: &str = include_str!("../../examples/models/helicopter_blade.toml");
const CRANE: &str = include_str!("../../examples/models/crane_rope.toml");

/// Angular frequencies of vibrations, rad/s; none is unstable.
fn vibrations(text: &str, own: &[(&str, &str)], about: About, count: usize) -> Vec<f64> {
    let report = ModalAnalysis::new(&model(text, own), about).unwrap().modes(count).unwrap();
    assert_eq!(report.unstable, 0);
    let all = report.modes.iter().filter(|mode| mode.kind == ModeKind::Vibration);
    all.map(|mode| mode.omega).collect()
}

/// The rows of a run.
fn run(text: &str, own: &[(&str, &str)]) -> Vec<Sample> {
    samples(&mut Simulation::new(&model(text, own)).unwrap())
}

/// 196 Hz, and overtones `n f_1 √((1 + B n²)/(1 + B))` that the bending stiffness makes sharp.
#[test]
fn a_guitar_string_sounds_its_tone() {
    let found = vibrations(STRING, &[("beam.string.elements", "60")], About::Static, 22);
    let inharmonic = {
        let (radius, length, tension) = (2.159e-4_f64, 0.6477, 73.70);
        PI.powi(3) * 2e11 * 0.25 * PI * radius.powi(4) / (PI * tension * length * length)
    };
    assert!((inharmonic - 1.09e-4).abs() < 1e-6, "B = {inharmonic:e}");
    let mut tones = Vec::new();
    for n in (1..=10).map(f64::from) {
        let right = n * 196.0 * ((1.0 + inharmonic * n * n) / (1.0 + inharmonic)).sqrt();
        let cents = |omega: f64| 1200.0 * (omega / TAU / right).log2();
        // in two directions; the string also twists
        let own: Vec<f64> = found.iter().copied().filter(|own| cents(*own).abs() < 0.3).collect();
        let (count, hertz) = (own.len(), own[0] / TAU);
        println!("{n}: {hertz:.3} Hz, right {right:.3} Hz, {:.2} cent", cents(own[0]));
        assert_eq!(count, 2, "{right} Hz among {found:?} rad/s");
        tones.push(hertz);
    }
    let sharp = 1200.0 * (tones[9] / (10.0 * tones[0])).log2();
    println!("the 10th is sharp by {sharp:.2} cent");
    assert!((sharp - 9.3).abs() < 0.5, "{sharp}");
}

/// What a plectrum bends comes back after one period of the tone.
#[test]
fn a_plucked_string_is_periodic() {
    let rows = run(STRING, &[("simulation.every", "1")]);
    let middle = |t: f64| {
        let near = rows.iter().min_by(|a, b| (a.t - t).abs().total_cmp(&(b.t - t).abs()));
        near.unwrap().sensors[5]
    };
    let times: Vec<f64> = (0..200).map(|k| 2e-3 + 2.5e-5 * f64::from(k)).collect();
    let largest = times.iter().map(|t| middle(*t).abs()).fold(0.0, f64::max);
    let apart = |by: f64| {
        times.iter().map(|t| (middle(t + by) - middle(*t)).abs()).fold(0.0, f64::max) / largest
    };
    let (period, off) = (apart(1.0 / 196.0), apart(0.9 / 196.0));
    println!("middle: {largest:.2e} m; after a period {period:.3}, after 0.9 {off:.3} of it");
    assert!(largest > 5e-4 && period < 0.15 && off > 0.3, "{largest}, {period}, {off}");
}

/// Sag `w L²/8T`, lift `F x (L − x)/TL`, and the wave that has not come yet.
#[test]
fn a_contact_wire_sags_and_is_lifted() {
    let (length, tension, line, gravity) = (55.0, 22000.0, 1.35, 9.81);
    let hanging = |x: f64| -line * gravity * x * (length - x) / (2.0 * tension);
    let rows = run(WIRE, &[("simulation.end", "0.36"), ("simulation.every", "1")]);
    let [quarter, middle, far] = [2, 5, 8].map(|k| rows[0].sensors[k]);
    println!("at rest: {quarter:.5}, {middle:.5}, {far:.5} m");
    for (found, x) in [(quarter, 13.75), (middle, 27.5), (far, 41.25)] {
        // the ends are bent: (EI/T) w/T
        assert!((found - hanging(x)).abs() < 3e-4, "{found} and {}", hanging(x));
    }
    let wave = (tension / line).sqrt();
    let arrival = 0.1 + 27.5 / wave;
    let moved = |t: f64| {
        let near = |row: &&Sample| (row.t - t).abs() < 1e-9;
        (rows.iter().find(near).unwrap().sensors[8] - far).abs()
    };
    // bending makes short waves faster, and the tension changes a little
    let (before, after) = (moved(0.29), moved(0.355));
    println!("wave at {arrival:.4} s: {before:.1e} m at 0.29 s, {after:.1e} m at 0.355 s");
    assert!((arrival - 0.3154).abs() < 1e-4 && before < 4e-4 && after > 1e-2, "{before}, {after}");
    let still = [("simulation.scheme", "\"static\""), ("simulation.step", "1.0")];
    let mut last = Vec::new();
    let mut keep = |sample: &Sample| {
        last.clone_from(&sample.sensors);
        Ok(())
    };
    let model = model(WIRE, &still);
    holonom::run::prepare(&model).unwrap().run(&mut keep, &mut |_, _| {}).unwrap();
    let lifted = last[2] - quarter;
    let right = 200.0 * 13.75 * (length - 13.75) / (tension * length);
    println!("lifted by {lifted:.5} m, string {right:.5} m");
    // it is bent over √(EI/T), 0.09 m, on both sides, and elements are longer than that
    assert!((lifted - right).abs() < 8e-4, "{lifted} and {right}");
}

/// The catenary of the source, whose forces are those of its equations.
#[test]
fn a_mooring_line_pulls_its_fairlead() {
    let rows = run(MOORING, &[("simulation.end", "22.0"), ("simulation.every", "1")]);
    let force = |row: &Sample| [row.sensors[0], row.sensors[1], row.sensors[2]];
    let [x, y, z] = force(&rows[0]);
    let pull = x.hypot(z);
    println!("fairlead: {x:.0} N, {z:.0} N, together {pull:.0} N");
    assert!((x.abs() / 736.94e3 - 1.0).abs() < 1e-4, "{x}");
    assert!((z.abs() / 535.73e3 - 1.0).abs() < 1e-3, "{z}");
    assert!((pull / 911.09e3 - 1.0).abs() < 5e-4 && y.abs() < 1.0, "{pull}, {y}");
    let farthest = rows.last().unwrap();
    let [x, _, z] = force(farthest);
    println!("5 m away: {:.0} N", x.hypot(z));
    assert!(x.hypot(z) > 1.2 * pull);
}

/// Uniform blades of Wright et al., at rest and at eight times `√(EI/ρAR⁴)`; in the plane of the
/// rotor a frequency is less by the square of the speed.
#[test]
fn a_helicopter_blade_has_published_frequencies() {
    let (radius, line, speed) = (4.91_f64, 5.5, 44.4);
    let scale = speed / 8.0;
    let flap = line * speed * speed * radius.powi(4) / 64.0;
    assert!((scale - (flap / (line * radius.powi(4))).sqrt()).abs() < 1e-9);
    let rest = vibrations(BLADE, &[("parameters.speed", "0.0")], About::Static, 6);
    let turning = vibrations(BLADE, &[], About::Rotation, 6);
    println!("at rest {rest:.3?}\nturning {turning:.3?} rad/s");
    let near = |all: &[f64], right: f64| {
        let off = all.iter().map(|omega| (omega / right - 1.0).abs());
        let least = off.fold(f64::INFINITY, f64::min);
        println!("{right:.3} rad/s: {least:.1e}");
        least
    };
    for mu in [3.5160, 22.0345, 61.6972] {
        assert!(near(&rest, mu * scale) < 1e-3, "{mu}");
    }
    for mu in [9.2568, 29.9954, 70.2930] {
        assert!(near(&turning, mu * scale) < 1.5e-3, "{mu}");
    }
}

/// Weight at the drum; the swing of a pendulum whose support makes the same move.
#[test]
fn the_load_of_a_crane_swings_as_a_pendulum() {
    let rows = run(CRANE, &[("simulation.every", "1")]);
    let weight = (1000.0 + 9.0 * 0.59) * 9.81;
    let tension = rows[0].sensors[5];
    println!("tension at the drum {tension:.1} N, weight {weight:.1} N");
    assert!((tension / weight - 1.0).abs() < 1e-3, "{tension}");
    let length = 9.5 + 9.81 * 9.0 * (1000.0 + 0.5 * 9.0 * 0.59) / 6.6e6;
    let gyration = (0.8_f64 * 0.8 + 1.0) / 12.0; // of the box, m²
    let acceleration = |t: f64| {
        let (s, whole) = ((t - 0.5) / 7.0, 7.0_f64);
        if (0.0..1.0).contains(&s) {
            4.0 * (60.0 * s - 180.0 * s * s + 120.0 * s * s * s) / (whole * whole)
        } else {
            0.0
        }
    };
    let pendulum = |y: &[f64; 3]| {
        let [angle, rate, t] = *y;
        let force = 9.81 * angle.sin() + acceleration(t) * angle.cos();
        [rate, -force * length / (length * length + gyration), 1.0]
    };
    let mut worst = 0.0_f64;
    for t in [4.0, 7.5, 12.0, 18.0, 24.0] {
        // pieces between the kinks of the acceleration
        let mut y = [0.0, 0.0, 0.5];
        for end in [7.5_f64.min(t), t] {
            y = ode(pendulum, y, end - y[2]);
        }
        let right = length * y[0].sin();
        let row = rows.iter().find(|row| (row.t - t).abs() < 1e-9).unwrap();
        println!("t = {t} s: sway {:.4} m, pendulum {right:.4} m", row.sensors[0]);
        worst = worst.max((row.sensors[0] - right).abs());
    }
    let swings = rows.iter().filter(|row| row.t > 7.5).map(|row| row.sensors[0].abs());
    let amplitude = swings.fold(0.0, f64::max);
    println!("swings by {amplitude:.3} m, off the pendulum by {worst:.4} m");
    assert!((amplitude - 1.44).abs() < 0.02 && worst < 0.03, "{amplitude}, {worst}");
}
