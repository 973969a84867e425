//! Shipped mechanisms of which a part of the motion is known: precession of a gyroscope, geometry
//! of a scissor mast and of Jansen's linkage, energy of a hanging chain, whirl of a shaft.
#![allow(clippy::unwrap_used)] // a test

use crate::harness::models::{model, simulation};
use holonom::{RunOutcome, Sample};

/// Columns of sensors at every recorded node.
fn readings(name: &str, end: f64, columns: &[&str]) -> Vec<Vec<f64>> {
    readings_with(name, &[("simulation.end", end.to_string())], columns)
}

/// The same of a model with other values.
fn readings_with(name: &str, overrides: &[(&str, String)], columns: &[&str]) -> Vec<Vec<f64>> {
    let all = holonom::sensor::columns(&model(name, overrides));
    let place = |column: &&str| all.iter().position(|c| c.name() == **column).unwrap();
    let places: Vec<usize> = columns.iter().map(place).collect();
    let mut rows = Vec::new();
    let mut observe = |sample: &Sample| -> Result<(), String> {
        rows.push(places.iter().map(|k| sample.sensors[*k]).chain([sample.hamiltonian]).collect());
        Ok(())
    };
    let outcome = simulation(name, overrides).run(&mut observe, &mut |_, _| {}).unwrap();
    assert!(matches!(outcome, RunOutcome::Done), "{name}: {outcome:?}");
    rows
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |size, v| size.max(v.abs()))
}

/// `Ω = m g l / (I ω)` with the axis level.
#[test]
fn a_weight_makes_the_gyroscope_precess() {
    let rows = readings("gyroscope", 3.0, &["precession", "tilt"]);
    let expected = 0.1 * 9.81 * 0.16 / (0.5 * 0.8 * 0.08 * 0.08 * 100.0);
    let rate = rows.last().unwrap()[0] / 3.0;
    let tilt = largest(rows.iter().map(|row| row[1]));
    println!("{rate} rad/s, expected {expected} rad/s; tilt {tilt:.1e} rad");
    assert!((rate / expected - 1.0).abs() < 1e-4 && tilt < 1e-4, "{rate} rad/s, {tilt} rad");
}

#[test]
fn the_height_of_the_scissor_mast_follows_from_its_angle() {
    let rows = readings("scissor_mast", 1.5, &["top.z", "top.x", "angle"]);
    let angle = |row: &Vec<f64>| 15f64.to_radians() + row[2];
    let off = |row: &Vec<f64>| {
        (row[0] - 4.0 * angle(row).sin()).abs().max((row[1] - angle(row).cos()).abs())
    };
    let (worst, reached) = (largest(rows.iter().map(off)), rows.last().unwrap()[0]);
    assert!(worst < 1e-12 && reached > 3.0, "{worst:.1e} m off, {reached} m high");
}

/// Over the middle half of its stride the foot stays at one height to a hundredth of the stride.
#[test]
fn the_foot_of_the_strandbeest_walks_on_a_nearly_straight_line() {
    let rows = readings("strandbeest", 3.0, &["path.x", "path.z"]);
    let of = |k: usize| rows.iter().map(move |row| row[k]);
    let [low, lowest] = [0, 1].map(|k| of(k).fold(f64::INFINITY, f64::min));
    let [high, highest] = [0, 1].map(|k| of(k).fold(f64::NEG_INFINITY, f64::max));
    let stride = high - low;
    // the lower of the two branches of the path, in twenty parts of the middle
    let mut lower = [f64::INFINITY; 20];
    for row in &rows {
        let part = 20.0 * (2.0 * (row[0] - low) / stride - 0.5);
        if (0.0..20.0).contains(&part) {
            let own = &mut lower[part as usize];
            *own = own.min((row[1] - lowest) / stride);
        }
    }
    let rise = largest(lower.into_iter());
    println!("stride {stride:.3} m, step {:.3} m, rise {rise:.4}", highest - lowest);
    assert!(rise < 0.01 && highest - lowest > 0.2 * stride, "{rise}");
}

#[test]
fn the_hanging_chain_keeps_its_energy() {
    let rows = readings("hanging_chain", 2.0, &["pull_left.tension"]);
    let energy = largest(rows.iter().map(|row| row[1] - rows[0][1]));
    assert!(energy < 2e-3, "{energy:.1e} J of {} J", rows[0][1]);
}

#[test]
fn the_legs_of_the_stewart_platform_follow_their_paths() {
    let rows = readings("stewart_platform", 2.0, &["stroke1", "center.z"]);
    let path = |k: usize| 0.04 * (std::f64::consts::PI * 0.008 * k as f64).sin();
    let off = largest(rows.iter().enumerate().map(|(k, row)| row[0] - path(k)));
    assert!(rows.len() > 200 && off < 2e-3, "{off:.1e} m of 0.04 m");
}

/// `r = e Ω²/|ω² − Ω²|`, `ω² = 192 EI/(L³ M)`, `M = m + 13/35 ρAL`, `e = m/M` times that of the
/// disk; a chain of `n` elements is stiffer by `1/(1 − 4/n²)`.
#[test]
fn the_shaft_whirls_as_a_jeffcott_rotor() {
    let (radius, length, modulus, density) = (0.006_f64, 1.0, 2.1e11, 7850.0);
    let area = std::f64::consts::PI * radius * radius;
    let (disk, own) =
        (std::f64::consts::PI * 0.12 * 0.12 * 0.01 * density, area * length * density);
    let stiffness = 192.0 * modulus * area * radius * radius / 4.0 / (1.0 - 4.0 / 256.0);
    let mass = disk + 13.0 / 35.0 * own;
    let (square, offset) = (stiffness / mass, 5e-4 * disk / mass);
    for speed in [60.0_f64, 150.0] {
        let overrides = [
            ("constraint.run_up.path", format!("{{ rate = {speed:?} }}")),
            ("joint.motor.rate", format!("{speed:?}")),
            ("simulation.start", "\"relaxed\"".to_owned()),
            ("simulation.end", "0.1".to_owned()),
        ];
        let rows = readings_with("whirling_shaft", &overrides, &["middle.x", "middle.y"]);
        let found = rows.iter().map(|row| row[0].hypot(row[1]));
        let [least, most] = [f64::min, f64::max]
            .map(|bound: fn(f64, f64) -> f64| found.clone().reduce(bound).unwrap());
        let expected = offset * speed * speed / (square - speed * speed).abs();
        println!("{speed} rad/s: {least:.3e} … {most:.3e} m, expected {expected:.3e} m");
        assert!((least / expected - 1.0).abs() < 0.01 && (most / expected - 1.0).abs() < 0.015);
    }
}

/// With strains that are averaged alone, differences of the path at halved steps fall by four; the
/// damping of unresolved elements is of first order with selective mass scaling.
#[test]
fn the_end_of_the_soft_arm_moves_on_its_path_to_second_order() {
    let ends = [0.01, 0.005, 0.0025].map(|step: f64| {
        let overrides = [
            ("simulation.strain", "\"averaged\"".to_owned()),
            ("simulation.step", step.to_string()),
            ("simulation.end", "0.5".to_owned()),
        ];
        let rows = readings_with("soft_arm", &overrides, &["tip.x", "tip.y", "tip.z"]);
        rows.last().unwrap()[..3].to_vec()
    });
    let apart = |a: &[f64], b: &[f64]| largest(a.iter().zip(b).map(|(a, b)| a - b));
    let [coarse, fine] = [apart(&ends[0], &ends[1]), apart(&ends[1], &ends[2])];
    let order = (coarse / fine).log2();
    println!("{coarse:.2e} m, {fine:.2e} m: order {order:.2}");
    assert!((order - 2.0).abs() < 0.2, "order {order}");
}

/// Constants of a body are rounded differently in sweeps and in momenta; a balance that forgets it
/// feeds the chain 1e-10 J here.
#[test]
fn rounding_does_not_feed_the_chain() {
    let overrides = [
        ("simulation.order", "8".to_owned()),
        ("simulation.step", "0.0025".to_owned()),
        ("simulation.end", "10.0".to_owned()),
        ("simulation.every", "4".to_owned()),
    ];
    let energies: Vec<f64> =
        readings_with("chain8", &overrides, &[]).iter().map(|row| row[0]).collect();
    let median = |part: &[f64]| {
        let mut sorted = part.to_vec();
        sorted.sort_by(f64::total_cmp);
        sorted[sorted.len() / 2]
    };
    let (first, second) = energies.split_at(energies.len() / 2);
    let change = median(second) - median(first);
    println!("median of H: {change:.1e} J from the first to the second half");
    assert!(change.abs() < 3e-11, "{change:.1e} J");
}
