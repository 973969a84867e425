//! Time of a step of the chain `chain-rev-N` for each body: `N` boxes on revolute joints whose axes
//! alternate between `y` and `z`, straight along `x` at the start, falling.
//!
//! The first second of the motion, five times, alternating between the cases; the fastest counts.
//! Also printed: Newton's iterations a step, and the tip, which shows that the motion is the same.
//! Then ensembles of such chains, members with rates that are a little different: time for a body,
//! step and member; also with a spring to the ground and a load that varies in time on each body,
//! beside members that move one after the other, and recorded.
#![allow(clippy::unwrap_used)] // a bench

use holonom::vi_constraints::{Options, SchemeKind};
use holonom::vi_multibody::builder::{Inertia, MechanismBuilder};
use holonom::vi_multibody::ensemble::Ensemble;
use holonom::vi_multibody::run::MechanismIntegrator;
use holonom::vi_multibody::{BuiltMechanism, FrameId, PairKind};
use holonom::vi_rigid::{Shape, TimeHistory};
use std::time::Instant;

fn chain(n: usize, h: f64) -> MechanismIntegrator {
    model(n, 0.1, false).integrator(Options::new(SchemeKind::Nodal, h)).unwrap()
}

fn model(n: usize, rate: f64, loaded: bool) -> BuiltMechanism {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let bar = Inertia::shape_of_mass(Shape::Box { lengths: [1.0, 0.1, 0.1] }, 1.0);
    let mut parent = FrameId::Ground;
    for i in 0..n {
        let link = builder.body(&format!("b{i}"), bar).at([i as f64 + 0.5, 0.0, 0.0]).id();
        let axis = if i.is_multiple_of(2) { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] };
        let turn = if n <= 8 { i } else { i / 2 };
        let rate = if turn.is_multiple_of(2) { rate } else { -rate };
        let hinge = builder.joint(&format!("j{i}"), PairKind::Revolute, parent, link);
        hinge.at([i as f64, 0.0, 0.0]).axis(axis).rate(rate);
        if loaded {
            let x = i as f64 + 0.5;
            builder.spring([x, 0.0, 2.0], link.point([0.0, 0.0, 0.05]), 3.0).natural_length(1.0);
            let history =
                TimeHistory::Harmonic { frequency: 1.0, phase: x, amplitude: 1.0, offset: 0.0 };
            builder.load(link).force([0.3, 0.2, 0.1]).history(history);
        }
        parent = link.into();
    }
    builder.build().unwrap()
}

/// How members of an ensemble move.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Members {
    Free,
    Loaded,
    LoadedAlone,
    Recorded,
}

/// Seconds for the steps of an ensemble, and how many of them members have taken alone.
fn together(n: usize, h: f64, (members, kind): (usize, Members)) -> (f64, u64) {
    let loaded = matches!(kind, Members::Loaded | Members::LoadedAlone);
    let models = (0..members).map(|k| model(n, 0.1 + 1e-3 * k as f64, loaded));
    let options = Options::new(SchemeKind::Nodal, h);
    let steps = (1.0 / h).round() as u64;
    if kind == Members::LoadedAlone {
        let mut runs: Vec<_> = models.map(|model| model.integrator(options).unwrap()).collect();
        let begin = Instant::now();
        for run in &mut runs {
            (0..steps).for_each(|_| _ = run.step().unwrap());
        }
        return (begin.elapsed().as_secs_f64(), steps * members as u64);
    }
    let mut ensemble = Ensemble::new(models, options).unwrap();
    assert_eq!(ensemble.in_lanes(), members);
    let mut ends: Vec<Option<f64>> =
        (0..members).map(|_| (kind == Members::Recorded).then_some(0.0)).collect();
    let begin = Instant::now();
    ensemble.record(steps, &mut ends, |end, member| *end = member.transition().after.q[0]);
    let time = begin.elapsed().as_secs_f64();
    assert!(ensemble.failures().all(|failure| failure.is_none()));
    (time, ensemble.steps_alone())
}

/// Seconds for the steps, iterations, and the free end of the last link.
fn first_second(n: usize, h: f64) -> (f64, usize, [f64; 3]) {
    let mut run = chain(n, h);
    let (steps, mut iterations) = ((1.0 / h).round() as usize, 0);
    let begin = Instant::now();
    for _ in 0..steps {
        iterations += run.step().unwrap().iterations;
    }
    let time = begin.elapsed().as_secs_f64();
    let last = &run.state().q[12 * (n - 1)..];
    (time, iterations, std::array::from_fn(|i| last[i] + 0.5 * last[3 + i]))
}

fn main() {
    let quick = std::env::args().any(|a| a == "--test");
    let named: Vec<usize> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let sizes = match (&named[..], quick) {
        ([], true) => &[8][..],
        ([], false) => &[8, 64, 512],
        (named, _) => named,
    };
    let cases: Vec<(usize, f64)> =
        sizes.iter().flat_map(|&n| [1e-3, 1e-2].map(|h| (n, h))).collect();
    let cases: Vec<(usize, f64)> =
        cases.into_iter().filter(|c| named.is_empty() || c.1 < 5e-3).collect();
    let mut best = vec![f64::INFINITY; cases.len()];
    for round in (0..if quick { 1 } else { 5 }).rev() {
        for (&(n, h), best) in cases.iter().zip(&mut best) {
            let (time, iterations, tip) = first_second(n, h);
            let steps = (1.0 / h).round();
            *best = best.min(time / steps / n as f64);
            if round == 0 {
                let iterations = iterations as f64 / steps;
                let one = 1e9 * *best;
                println!(
                    "{n} bodies, h = {h} s: {one:.0} ns a body and step, {iterations:.2} iterations, tip {tip:?}"
                );
            }
        }
    }
    let cases: Vec<(usize, f64)> =
        cases.into_iter().filter(|(n, _)| *n <= if quick { 8 } else { 64 }).collect();
    for (n, h) in cases {
        let kinds = [Members::Free, Members::Recorded, Members::LoadedAlone, Members::Loaded];
        for case in [4, 8].into_iter().flat_map(|members| kinds.map(|kind| (members, kind))) {
            let rounds = (0..if quick { 1 } else { 5 }).map(|_| together(n, h, case));
            let (time, alone) = rounds.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
            let (members, kind) = case;
            let one = 1e9 * time * h / (n * members) as f64;
            println!(
                "{members} chains of {n} bodies, {kind:?}, h = {h} s: {one:.0} ns a body, step and member, {alone} steps alone"
            );
        }
    }
}
