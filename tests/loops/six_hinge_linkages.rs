//! Free six-hinge linkages: one internal degree of freedom although counting gives none, momentum
//! maps to round-off.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::{Run, assert_order, study};
use holonom::certificate::subject::ModelSubject;
use holonom::verification::measure;
use holonom::verification::subject::{SchemeSetting, SteppingMethod};
use holonom::vi_constraints::SchemeKind;
use holonom::vi_emscheme::EmForm;
use nalgebra::Vector3;

const CUBE: &str = include_str!("../../examples/models/six_hinge_cube.toml");
const LINE: &str = include_str!("../../examples/models/six_hinge_line.toml");
const BOTH: [(&str, &str); 2] = [("cube", CUBE), ("line", LINE)];

/// Relative attitude of the links at hinge 1: `(tr R − 1)/2`, the cosine of its angle.
fn inside(run: &mut Run) -> f64 {
    let (a, b) = (run.coordinates("link6"), run.coordinates("link1"));
    0.5 * (a[3..12].iter().zip(&b[3..12]).map(|(a, b)| a * b).sum::<f64>() - 1.0)
}

/// Centre of mass.
fn center(run: &mut Run) -> Vector3<f64> {
    let q = run.simulation.integrator().state().q.clone();
    let bodies = run.simulation.integrator().constraints().description().bodies.clone();
    let masses: Vec<f64> = bodies.iter().map(|b| b.body.as_ref().unwrap().mass()).collect();
    let moment = |k: usize| masses[k] * Vector3::from_column_slice(&q[12 * k..12 * k + 3]);
    let sum: Vector3<f64> = (0..masses.len()).map(moment).sum();
    sum / masses.iter().sum::<f64>()
}

/// Linear momentum, and angular momentum about the centre of mass: about the origin a linkage that
/// has travelled to `φ` has a round-off of `|φ| |p|`.
fn momentum(run: &mut Run) -> [Vector3<f64>; 2] {
    let [linear, angular] = run.momentum();
    [linear, angular - center(run).cross(&linear)]
}

fn long_run(steps: usize) {
    for (name, text) in BOTH {
        let begin = std::time::Instant::now();
        let mut run = Run::new(text, 0.01, 2);
        let report = run.simulation.assembly();
        assert_eq!((report.counts.dof, report.counts.redundant_constraints), (7, 1), "{name}");
        let ([linear, angular], energy) = (momentum(&mut run), run.energy());
        let (mut drift, mut spread, mut gap) = (0.0_f64, [0.0_f64; 2], 0.0_f64);
        let mut range = (f64::INFINITY, f64::NEG_INFINITY);
        for k in 0..steps / 10 {
            run.steps(10);
            let [l, j] = momentum(&mut run);
            drift = drift.max((l - linear).amax()).max((j - angular).amax());
            let half = usize::from(2 * k >= steps / 10);
            spread[half] = spread[half].max((run.energy() / energy - 1.0).abs());
            gap = gap.max(run.residual());
            let cosine = inside(&mut run);
            range = (range.0.min(cosine), range.1.max(cosine));
        }
        println!(
            "{name}, {steps} steps: momentum maps drift by {drift:.1e} (of {:.2}, {:.2}), energy \
             within {:.1e} then {:.1e}, |g| {gap:.1e}, cosine at hinge 1 from {:.2} to {:.2}, {:.1} s",
            linear.norm(),
            angular.norm(),
            spread[0],
            spread[1],
            range.0,
            range.1,
            begin.elapsed().as_secs_f64()
        );
        // round-off of a random walk: a few ε√N of the momenta inside
        let allowed = 1e-14 * (steps as f64).sqrt();
        assert!(drift < allowed, "{name}: {drift:e}");
        assert!(spread[1] < 1.5 * spread[0] && spread[0] < 1e-2, "{name}: {spread:?}");
        assert!(gap < 1e-12, "{name}: {gap:e}");
        assert!(range.1 - range.0 > 0.5, "{name}: the linkage hardly moves, {range:?}");
    }
}

#[test]
fn momentum_maps_hold_to_round_off() {
    long_run(1000);
}

#[test]
#[ignore = "long: cargo test --release -- --ignored"]
fn momentum_maps_hold_for_100_000_steps() {
    long_run(100_000);
}

fn corner(text: &str, h: f64, order: u32) -> Vector3<f64> {
    let mut run = Run::new(text, h, order);
    let x = run.coordinates("link4");
    let corner = run.point("link4", [x[0], x[1], x[2] + 0.5]);
    run.until(2.0);
    run.at(corner)
}

#[test]
fn positions_converge_with_the_nominal_order() {
    for (name, text) in BOTH {
        let fine = corner(text, 0.01, 8);
        for (nominal, steps) in [(2, [0.04, 0.02, 0.01]), (4, [0.08, 0.04, 0.02])] {
            let what = format!("{name}, order {nominal}");
            let (_, orders) = study(&what, &steps, |h| (corner(text, h, nominal) - fine).norm());
            assert_order(&orders, f64::from(nominal), 0.4);
        }
    }
}

/// Rows that are independent initially become dependent during the motion.
#[test]
fn redundant_constraints_hold_where_other_rows_are_independent() {
    let variational =
        [SchemeKind::Constrained, SchemeKind::Dalembert].map(SteppingMethod::Variational);
    let comparator = [EmForm::Constrained, EmForm::Dalembert].map(SteppingMethod::EnergyMomentum);
    for (name, text) in BOTH {
        let subject = ModelSubject::new(benchmark::model(text, &[]));
        for (method, order) in
            variational.map(|m| (m, 4)).into_iter().chain(comparator.map(|m| (m, 2)))
        {
            let run = measure::long_run(&subject, SchemeSetting::new(method, order, 0.02), 300);
            let run = run.unwrap_or_else(|e| panic!("{name}, {}: {e}", method.name()));
            let gap = run.residuals().position;
            println!("{name}, {}: |g| {gap:.1e}", method.name());
            assert!(gap < 1e-14, "{name}, {}: {gap:e}", method.name());
        }
    }
}
