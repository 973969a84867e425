//! Branch switching: the buckled column after the straight one.

#![allow(clippy::unwrap_used)] // a test

use crate::common;

use common::{center_of, dead, straight};
use nalgebra::Vector3;
use std::f64::consts::PI;
use vi_beam::element::ElementKind;
use vi_beam::{BeamModel, Section};
use vi_statics::{ArcLengthSettings, StaticProblem, StaticSettings};

/// A column of `EI_2 = 1`, `EI_1 = 4` under the force 1 towards its clamp.
fn column() -> StaticProblem {
    let section = Section::new([1e8, 1e8, 1e8, 4.0, 1.0, 1.0], [1.0, 1e-6, 1e-6, 0.0]).unwrap();
    let mut model = BeamModel::new(Vector3::zeros());
    let beam = model.add_beam("column", &straight(1.0, 16), section).unwrap();
    let q = model.configuration();
    model.elements.set_strains(beam.elements.clone(), ElementKind::Helicoidal, &q).unwrap();
    model.clamp(beam.nodes.start);
    common::problem(&model, &model.mechanism(), vec![dead(beam.nodes.end - 1, -Vector3::x())])
}

/// Euler's elastica at 1.015 and 1.293 times the critical load: the tip turns by 20° and 80°.
fn check(problem: &StaticProblem, ratio: f64) {
    // K(sin α/2) = (π/2) √ratio; tip at x = 2 E/K − 1, y = 2 sin(α/2)/K
    let target = 0.5 * PI * f64::sqrt(ratio);
    let integrals = |k: f64| {
        let n = 20_000;
        let point =
            |i: usize| (1.0 - (k * (0.5 * PI * (i as f64 + 0.5) / n as f64).sin()).powi(2)).sqrt();
        let h = 0.5 * PI / n as f64;
        let sums = (0..n).map(point).fold([0.0, 0.0], |[a, b], root| [a + h / root, b + h * root]);
        (sums[0], sums[1])
    };
    let (mut low, mut high) = (0.0, 0.9999);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if integrals(middle).0 < target { low = middle } else { high = middle }
    }
    let (first, second) = integrals(low);
    let exact = [2.0 * second / first - 1.0, 2.0 * low / first];
    let tip = center_of(problem.configuration(), 16);
    let off = (tip.x - exact[0]).abs().max((tip.y.hypot(tip.z) - exact[1]).abs());
    println!(
        "{ratio} of the critical load: tip {:.5} {:.5}, elastica {exact:.5?}",
        tip.x,
        tip.y.hypot(tip.z)
    );
    assert!(off < 1e-4, "{off:e}");
    assert!(tip.y.abs() < 1e-9 || tip.z.abs() < 1e-9, "{tip}");
}

#[test]
fn load_steps_leave_the_straight_column_for_the_buckled_one() {
    let critical = PI * PI / 4.0;
    let settings = StaticSettings { switches_branch: true, ..StaticSettings::default() };
    let mut problem = column();
    let path = problem.solve(&[0.9 * critical, 1.3 * critical], &settings).unwrap();
    let switched = path.switched.unwrap() / critical;
    println!("switched at {switched:.6} of the critical load, {} equilibria", path.points.len());
    assert!(switched > 1.0 && switched < 1.01, "{switched}");
    assert!(path.points.iter().all(|point| point.unstable == Some(0)), "an unstable equilibrium");
    check(&problem, 1.3);
    // without it the column stays straight
    let mut straight = column();
    let path = straight.solve(&[0.9 * critical, 1.3 * critical], &Default::default()).unwrap();
    assert!(path.switched.is_none() && path.points.last().unwrap().unstable == Some(1));
}

#[test]
fn arcs_leave_it_too() {
    let critical = PI * PI / 4.0;
    let settings = ArcLengthSettings {
        full_load: 1.2 * critical,
        switches_branch: true,
        ..ArcLengthSettings::default()
    };
    let mut problem = column();
    let path = problem.follow(&settings, |point| point.factor >= 1.2 * critical).unwrap();
    assert!(path.points.iter().all(|point| point.unstable == Some(0)), "an unstable equilibrium");
    let ratio = problem.factor() / critical;
    check(&problem, ratio);
}
