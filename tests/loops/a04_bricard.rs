//! IFToMM A04: Bricard's mechanism, one degree of freedom and one redundant constraint.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::{Run, assert_order, study};
use nalgebra::Vector3;

const MODEL: &str = include_str!("../../examples/models/bricard.toml");
const JOINT_3: [(f64, [f64; 3]); 3] = [
    (0.5, [0.968_283_68, -1.224_625_16, 0.750_146_61]),
    (1.0, [0.510_501_46, -1.649_167_60, 0.140_123_11]),
    (2.0, [-0.969_340_34, -1.221_246_89, 0.754_278_01]),
];
const JOINT_1: [(f64, [f64; 3]); 3] = [
    (0.5, [0.968_283_679, 0.0, -0.249_853_391]),
    (1.0, [0.510_501_461, 0.0, -0.859_876_885]),
    (2.0, [-0.969_340_345, 0.0, -0.245_721_989]),
];
const AT_10_S: [f64; 3] = [0.999_999_963_767, -1.000_269_012_656, 0.999_730_951_167];

/// Joints 1 and 3 at 0.5, 1 and 2 s.
fn joints(h: f64, order: u32) -> Vec<Vector3<f64>> {
    let mut run = Run::new(MODEL, h, order);
    let (first, third) = (run.point("rod1", [1.0, 0.0, 0.0]), run.point("rod3", [1.0, -1.0, 1.0]));
    let mut found = Vec::new();
    for (t, _) in JOINT_1 {
        run.until(t);
        found.extend([run.at(first), run.at(third)]);
    }
    assert!(run.residual() < 1e-13);
    found
}

fn distance(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

#[test]
fn the_redundant_constraint_is_found() {
    let run = Run::new(MODEL, 1e-2, 2);
    let report = run.simulation.assembly();
    assert_eq!(
        (report.counts.dof, report.counts.constraints, report.counts.redundant_constraints),
        (1, 60, 1)
    );
    assert_eq!(report.redundant.len(), 1, "{:?}", report.redundant);
    assert!(report.redundant[0].starts_with("joint"), "{:?}", report.redundant);
}

#[test]
fn positions_converge_with_the_nominal_order() {
    let table: Vec<_> =
        JOINT_1.iter().zip(&JOINT_3).flat_map(|(a, b)| [a.1.into(), b.1.into()]).collect();
    let fine = joints(1e-2, 8);
    let error = distance(&fine, &table);
    println!("joints to 2 s, order 8, h = 0.01: {error:.1e} m off the table");
    assert!(error < 1.5e-8, "the printed digits: {error:e}");
    let (_, orders) = study("joints to 2 s, order 2", &[2e-2, 1e-2, 5e-3, 2.5e-3], |h| {
        distance(&joints(h, 2), &table)
    });
    assert_order(&orders, 2.0, 0.1);
    for order in [4, 6] {
        let what = format!("joints to 2 s, order {order}, against order 8");
        let (_, orders) =
            study(&what, &[5e-2, 2.5e-2, 1.25e-2], |h| distance(&joints(h, order), &fine));
        assert_order(&orders, f64::from(order), 0.5);
    }
}

#[test]
fn ten_seconds_and_the_energy() {
    let mut run = Run::new(MODEL, 1e-2, 6);
    let third = run.point("rod3", [1.0, -1.0, 1.0]);
    let start = run.energy();
    assert!((start + 29.43).abs() < 1e-12, "{start}");
    let mut worst = 0.0_f64;
    for k in 1..=1000 {
        run.steps(1);
        worst = worst.max((run.energy() - start).abs());
        if k == 900 {
            let published = Vector3::new(0.539_064_288, -1.638_453_308, 0.157_735_378);
            let error = (run.at(third) - published).norm();
            println!("joint 3 at 9 s: error {error:.2e} m");
            assert!(error < 1e-7, "{error:e}");
        }
    }
    let error = (run.at(third) - Vector3::from(AT_10_S)).norm();
    println!("joint 3 at 10 s: error {error:.2e} m, energy error up to {worst:.2e} J");
    assert!(error < 1e-7 && worst < 1e-6, "{error:e} {worst:e}");
}
