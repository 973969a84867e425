//! Reactions do not depend on the scheme, on the orientation of the whole, on units, on what else
//! there is.

#![allow(clippy::unwrap_used)] // a test

use crate::harness::hostile::hostile;
use crate::harness::models;
use holonom::{Model, Sample};
use nalgebra::Vector3;

/// The nodes of a model with this scheme.
fn nodes(text: &str, scheme: &str) -> Vec<Sample> {
    let own =
        text.lines().filter(|line| !line.starts_with("scheme")).collect::<Vec<_>>().join("\n");
    let text = own.replace("[simulation]", &format!("[simulation]\nscheme = \"{scheme}\""));
    models::nodes(&Model::from_toml(&text).unwrap())
}

/// The first six numbers of the sensors: a reaction; relative to the largest force and moment of
/// the run.
fn apart(one: &[Sample], other: &[Sample], skip: usize) -> f64 {
    assert_eq!(one.len(), other.len());
    let part =
        |sample: &Sample, k: usize| Vector3::from_column_slice(&sample.sensors[3 * k..3 * k + 3]);
    let largest = |k: usize| one.iter().map(|s| part(s, k).norm()).fold(0.0, f64::max);
    let sizes = [largest(0), largest(1)];
    let mut worst = 0.0_f64;
    for (a, b) in one.iter().zip(other).skip(skip) {
        for (k, size) in sizes.into_iter().enumerate() {
            let off = (part(a, k) - part(b, k)).norm() / size;
            worst = if off <= worst { worst } else { off };
        }
    }
    worst
}

/// Lengths of about 1000 units beside a point mass that nothing touches.
#[test]
fn reactions_beside_a_point_mass_agree_between_schemes() {
    let text = hostile("reaction_beside_point_mass");
    let without: String = text[..text.find("[[particle]]").unwrap()].to_owned()
        + &text[text.find("[[joint]]").unwrap()..];
    let expected = nodes(&text, "nodal");
    for scheme in ["reduced", "constrained", "dalembert"] {
        let off = apart(&expected, &nodes(&text, scheme), 0);
        println!("{scheme}: {off:.1e}");
        assert!(off < 1e-9, "{scheme}: {off:e}");
    }
    let off = apart(&expected, &nodes(&without, "nodal"), 0);
    println!("without the point mass: {off:.1e}");
    assert!(off < 1e-9, "{off:e}");
}

/// What a bar pulls with beside bodies a thousand times as large, redundant bars told apart.
#[test]
fn bars_beside_large_bodies_have_the_tension_that_they_have_alone() {
    let truss = include_str!("../models/truss.toml");
    let beside = r#"
        body = [{ name = "k", mass = 1e3, inertia = [2e9, 1e9, 2e9], position = [0.0, 3000.0, 0.0] },
                { name = "l", mass = 1e3, inertia = [2e9, 1e9, 2e9], position = [0.0, 9000.0, 0.0] }]
        joint = [{ name = "k0", type = "revolute", parent = "ground", child = "k", position = [0.0, 0.0, 0.0], axis = [1.0, 0.0, 0.0] },
                 { name = "k1", type = "revolute", parent = "k", child = "l", position = [0.0, 6000.0, 0.0], axis = [1.0, 0.0, 0.0] }]"#;
    for scheme in ["nodal", "constrained"] {
        let own = |more: &str| {
            let text = format!("{truss}{more}")
                .replace("project", &format!("scheme = \"{scheme}\", project"));
            models::nodes(&Model::from_toml(&text).unwrap())
        };
        let mut worst = 0.0_f64;
        for (one, other) in own("").iter().zip(&own(beside)) {
            for (a, b) in one.sensors.iter().zip(&other.sensors) {
                let off = if a.is_nan() && b.is_nan() { 0.0 } else { (a - b).abs() };
                worst = if off <= worst { worst } else { off };
            }
        }
        // coordinates of the bodies are rounded to ε 9000 m, forces of 0.3 kg to that over h²
        let rounding = f64::EPSILON * 9000.0 * 0.3 / (0.01 * 0.01);
        println!("{scheme}: largest difference {worst:.1e} N, rounding {rounding:.1e} N");
        assert!(worst < 4.0 * rounding, "{scheme}: {worst:e}");
    }
}

const ENERGY_MOMENTUM: [&str; 3] = ["em-constrained", "em-nodal", "em-dalembert"];

#[test]
fn reactions_of_energy_momentum_schemes_turn_with_the_whole() {
    for scheme in ENERGY_MOMENTUM {
        let [one, turned] = ["em_reaction_planar", "em_reaction_planar_turned"]
            .map(|name| nodes(&hostile(name), scheme));
        let size =
            |s: &Sample, k: usize| Vector3::from_column_slice(&s.sensors[3 * k..3 * k + 3]).norm();
        for k in 0..2 {
            let largest = one.iter().map(|s| size(s, k)).fold(0.0, f64::max);
            let off =
                one.iter().zip(&turned).map(|(a, b)| (size(a, k) - size(b, k)).abs() / largest);
            let off = off.fold(0.0, f64::max);
            println!("{scheme}, {}: {off:.1e}", ["force", "moment"][k]);
            assert!(off < 1e-9, "{scheme}: {off:e}");
        }
    }
}

/// Angles are counted from an axis that may be chosen; nothing depends on the choice.
#[test]
fn reactions_do_not_depend_on_the_first_axis_of_a_pair() {
    let text = hostile("em_reaction_planar");
    let with = |first: &str| {
        text.replace("type = \"planar\"", &format!("type = \"planar\"\nfirst_axis = {first}"))
    };
    let rates = text.contains("rate = [0.0, 0.0,");
    assert!(rates, "none along the displacements");
    for scheme in ENERGY_MOMENTUM.into_iter().chain(["nodal", "constrained"]) {
        let one = nodes(&with("[1.0, 0.0, 0.0]"), scheme);
        let off = apart(&one, &nodes(&with("[0.2, 1.0, -0.3]"), scheme), 0);
        println!("{scheme}: {off:.1e}");
        assert!(off < 1e-9, "{scheme}: {off:e}");
    }
}

#[test]
fn reactions_of_energy_momentum_schemes_do_not_depend_on_units() {
    let force = 1024.0 * 64.0 * 64.0;
    for scheme in ENERGY_MOMENTUM.into_iter().chain(["nodal"]) {
        let one = nodes(&hostile("em_reaction_gear"), scheme);
        let mut other = nodes(&hostile("em_reaction_gear_units"), scheme);
        for sample in &mut other {
            for (k, x) in sample.sensors.iter_mut().enumerate().take(6) {
                *x /= if k < 3 { force } else { 1024.0 * force };
            }
        }
        let off = apart(&one, &other, 0);
        println!("{scheme}: {off:.1e}");
        assert!(off < 1e-9, "{scheme}: {off:e}");
    }
}

/// Two schemes of second order: their reactions come together with the square of the step, gears
/// and stiff springs included.
#[test]
fn reactions_of_both_families_agree_to_second_order() {
    for name in ["em_reaction_planar", "em_reaction_gear"] {
        let text = hostile(name);
        let difference = |parts: f64| {
            let step = |line: &str| -> Option<f64> { line.strip_prefix("step = ")?.parse().ok() };
            let h = text.lines().find_map(step).unwrap();
            let fine = text.lines().map(|line| match step(line) {
                Some(h) => format!("step = {:?}\nevery = {parts}", h / parts),
                None if line.starts_with("end") => format!("end = {:?}", 8.0 * h),
                None => line.to_owned(),
            });
            let fine = fine.collect::<Vec<_>>().join("\n");
            apart(&nodes(&fine, "nodal"), &nodes(&fine, "em-constrained"), 1)
        };
        let errors = [16.0, 32.0, 64.0].map(difference);
        println!("{name}: {errors:?}");
        let order = (errors[0] / errors[2]).log2() / 2.0;
        assert!(order > 1.8 && errors[2] < 0.02, "{name}: order {order:.2}, {errors:?}");
    }
}
