//! The chart of a tree: joints hold, and its derivatives are those of central differences, for
//! every kinematic pair in one chain.

use nalgebra::{DMatrix, Vector3};
use vi_constraints::Constraints;
use vi_control::transcription::chart::Chart;
use vi_core::Configuration;
use vi_core::linear::norm_inf;
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::{FrameId, Mechanism, PairKind};
use vi_testkit::Sample;

/// A free body, and a branch of each pair on it in a row.
fn chain(kinds: &[PairKind], seed: u64) -> Mechanism {
    let mut sample = Sample::new(seed);
    let mut builder = MechanismBuilder::new();
    let mut draw = move || Vector3::from_fn(|_, _| sample.number());
    let root = builder.body("root", Inertia::principal(1.0, [0.1, 0.2, 0.15])).id();
    let mut last = root;
    for (k, kind) in kinds.iter().enumerate() {
        let place = draw();
        let body = builder.body(&format!("body {k}"), Inertia::principal(1.0, [0.1, 0.2, 0.15]));
        let body = body.at(place).rotation_vector(draw()).id();
        let parent = if k % 3 == 2 { root } else { last };
        let axis = draw().normalize();
        let other = axis.cross(&draw()).normalize();
        let joint = builder.joint(&format!("joint {k}"), *kind, FrameId::from(parent), body);
        let joint = joint.at(place + 0.3 * draw()).axis(axis);
        if kind.properties().motion.swaps_axes() {
            joint.second_axis(other);
        }
        last = body;
    }
    builder.build().unwrap().mechanism
}

fn difference(f: &dyn Fn(f64) -> Vec<f64>) -> Vec<f64> {
    let e = 1e-5;
    f(e).iter().zip(f(-e)).map(|(a, b)| (a - b) / (2.0 * e)).collect()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    norm_inf(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>())
}

#[test]
fn joints_hold_and_derivatives_are_exact() {
    let all: Vec<PairKind> =
        PairKind::ALL.iter().copied().filter(|kind| *kind != PairKind::Fixed).collect();
    let chains = all.iter().map(|kind| vec![*kind, *kind]).chain([all.clone()]);
    for (seed, kinds) in chains.enumerate() {
        let mechanism = chain(&kinds, 7 + seed as u64);
        let q = mechanism.initial_configuration();
        let chart = Chart::new(&mechanism, q.len());
        let (d, reference) = (chart.dof(), chart.reference(&q));
        let mut sample = Sample::new(99 + seed as u64);
        let mut draw = |n: usize| -> Vec<f64> { (0..n).map(|_| 0.7 * sample.number()).collect() };
        let (xi, v, y) = (draw(d), draw(q.len()), draw(d));
        let at = chart.place(&reference, &xi);
        let mut g = vec![0.0; mechanism.len()];
        mechanism.value(Configuration::new(0.0, &at.q), &mut g);
        let screws = kinds.iter().any(|kind| kind.pitch().is_some());
        // the row of a thread counts revolutions
        assert!(screws || norm_inf(&g) < 1e-13, "{kinds:?}: |g| = {:e}", norm_inf(&g));
        let moved = |j: usize, e: f64| {
            let mut xi = xi.clone();
            xi[j] += e;
            chart.place(&reference, &xi)
        };
        let columns = chart.columns(&at);
        let bent = chart.bent_columns(&at, &y);
        let (curvature, third) = (chart.curvature(&at, &v), chart.third_derivative(&at, &v, &y));
        let along = |matrix: &DMatrix<f64>| {
            (matrix * DMatrix::from_column_slice(d, 1, &y)).as_slice().to_vec()
        };
        for j in 0..d {
            let wanted = difference(&|e| moved(j, e).q);
            let error = distance(columns.column(j).as_slice(), &wanted);
            assert!(error < 1e-8, "{kinds:?}: K_{j} misses by {error:e}");
            let wanted = difference(&|e| along(&chart.columns(&moved(j, e))));
            let error = distance(bent.column(j).as_slice(), &wanted);
            assert!(error < 1e-8, "{kinds:?}: Σ y K_k{j} misses by {error:e}");
            let wanted = difference(&|e| {
                chart
                    .columns(&moved(j, e))
                    .tr_mul(&DMatrix::from_column_slice(v.len(), 1, &v))
                    .as_slice()
                    .to_vec()
            });
            let error = distance(curvature.column(j).as_slice(), &wanted);
            assert!(error < 1e-8, "{kinds:?}: v·K_k{j} misses by {error:e}");
            let wanted = difference(&|e| along(&chart.curvature(&moved(j, e), &v)));
            let error = distance(third.column(j).as_slice(), &wanted);
            assert!(error < 1e-7, "{kinds:?}: Σ y v·K_jk{j} misses by {error:e}");
        }
    }
}
