//! Gradients of runs by Galerkin steps: forward against backward, step by step and over runs,
//! against differences, against the scheme of order 2, with all checkpoints.

use crate::gradients::{SUBJECTS, along, cost, direction, task};
use crate::runs::{Subject, run_with};
use vi_constraints::costate_sweep::{CostateSweep, Linearization};
use vi_constraints::linearization::{Costate, Sources, Tangent};
use vi_constraints::{Constraints, Options, SchemeKind};
use vi_control::sensitivities::Beside;
use vi_control::{Direction, Gradient, Sensitivities};
use vi_core::Interval;
use vi_core::galerkin::Stages;
use vi_core::linear::dot;
use vi_testkit::Sample;

const STEPS: usize = 20;

fn options(scheme: SchemeKind, s: usize, h: f64) -> Options {
    Options::new(scheme, h).galerkin(Stages::new(s).unwrap())
}

/// The forms that integrate a subject.
fn schemes(_: &Subject) -> &'static [SchemeKind] {
    &[SchemeKind::Constrained, SchemeKind::Nodal]
}

fn random(sample: &mut Sample, n: usize) -> Vec<f64> {
    (0..n).map(|_| sample.number()).collect()
}

#[test]
fn a_step_backward_is_the_transposed_of_one_forward() {
    let mut sample = Sample::new(191);
    for subject in SUBJECTS {
        for s in 1..=3 {
            let subject = subject();
            let name = subject.name;
            let (mut run, controls, _) = run_with(subject, options(SchemeKind::Nodal, s, 0.02), 5);
            let (n, m) = (run.state().q.len(), run.constraints().len());
            let internal = run.state().internal.len();
            let mut step = Linearization::new(run.method(), (n, m), run.rows());
            let mut worst: f64 = 0.0;
            for k in 0..5 {
                controls.set(k);
                let (p, mut points) = (run.state().p.clone(), Vec::<Interval>::new());
                run.step_with(&mut |_, _, taken| points.extend_from_slice(taken.points())).unwrap();
                let (system, constraints) = (run.system(), run.constraints());
                step.linearize(system, constraints, &points, &p).unwrap();
                let [start, at_end] = [0, 1].map(|_| Tangent {
                    q: random(&mut sample, n),
                    p: random(&mut sample, n),
                    z: random(&mut sample, internal),
                });
                let mut sources = Vec::new();
                step.clear_sources();
                for part in 0..step.parts() {
                    let mut own = Sources::zero(n, m);
                    let (place, _) = step.part(&points, part);
                    let (forces, rows) = (place.has_forces(), place.has_rows());
                    own.minus = random(&mut sample, n);
                    if forces {
                        own.plus = random(&mut sample, n);
                    }
                    if rows && run.rows().len() == m {
                        own.rows = random(&mut sample, m); // else they contradict each other
                    }
                    step.add_sources(part, &own);
                    sources.push(own);
                }
                let mut end = start.clone();
                step.push(system, constraints, &points, &mut end).unwrap();
                let mut costate = Costate { q: at_end.q, p: at_end.p, z: at_end.z };
                let after = costate.clone();
                step.pull(system, constraints, &points, &p, &mut costate).unwrap();
                let pairs =
                    |c: &Costate, t: &Tangent| [dot(&c.q, &t.q), dot(&c.p, &t.p), dot(&c.z, &t.z)];
                let (left, right) = (pairs(&after, &end), pairs(&costate, &start));
                let (mut along, mut part) = (0.0, 0);
                step.for_each_part(&points, &mut |_, _, costates| {
                    let Sources { minus, plus, rows } = &sources[part];
                    along += dot(plus, costates.momentum)
                        - dot(minus, costates.step)
                        - dot(rows, costates.rows);
                    part += 1;
                });
                let terms = left.iter().chain(&right).chain([&along]);
                let size: f64 = terms.map(|x| x.abs()).sum();
                let defect = left.iter().sum::<f64>() - right.iter().sum::<f64>() - along;
                worst = worst.max(defect.abs() / size);
            }
            println!("{name}, s = {s}: forward and backward differ by {worst:.1e} of their terms");
            assert!(worst < 1e-13, "{name}, s = {s}: {worst:e}");
        }
    }
}

#[test]
fn backward_agrees_with_forward_and_differences() {
    let mut sample = Sample::new(192);
    for subject in SUBJECTS {
        for s in 1..=3 {
            for &scheme in schemes(&subject()) {
                let subject = subject();
                let name = subject.name;
                let (mut run, controls, objective) =
                    run_with(subject, options(scheme, s, 0.02), STEPS);
                let start = run.state().clone();
                let along_this = direction(&run, &controls, &mut sample);
                let found = Gradient::of(&mut run, &task(&objective, &controls)).unwrap();
                run.place_at(&start);
                let mut forward = Sensitivities::new(&run, 0.02, vec![along_this.clone()]).unwrap();
                let beside = Beside { controls: &controls, design: None, objective: &objective };
                for _ in 0..STEPS {
                    forward.advance(&mut run, beside).unwrap();
                }
                let rate = forward.rates(&objective, run.state())[0];
                let mut at = |e: f64| {
                    let mut moved = start.clone();
                    let Direction { start: own, controls: rates, .. } = &along_this;
                    moved.p.iter_mut().zip(&own.p).for_each(|(p, dp)| *p += e * dp);
                    moved.internal.iter_mut().zip(&own.z).for_each(|(z, dz)| *z += e * dz);
                    run.place_at(&moved);
                    let w = |step: usize| {
                        let pairs = controls.at(step).iter().zip(&rates[step]);
                        pairs.map(|(w, dw)| w + e * dw).collect()
                    };
                    cost(&mut run, &objective, &controls, &w)
                };
                let value = at(0.0);
                assert_eq!(value.to_bits(), found.value.to_bits(), "{name}: that of the run");
                let e = 1e-4;
                let difference =
                    (8.0 * (at(e) - at(-e)) - (at(2.0 * e) - at(-2.0 * e))) / (12.0 * e);
                let (exact, size) = along(&found, &along_this);
                let errors = [rate, difference].map(|other| (other - exact).abs() / size);
                let [a, b] = errors;
                println!("{name}, {scheme:?}, s = {s}: forward {a:.1e}, differences {b:.1e}");
                assert!(a < 1e-12 && b < 1e-9, "{name}, {scheme:?}, s = {s}: {errors:?}");
            }
        }
    }
}
