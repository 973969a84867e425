//! Gradients of runs by Galerkin steps: forward against backward, step by step and over runs,
//! against differences, against the scheme of order 2, with all checkpoints.

use crate::gradients::{SUBJECTS, along, cost, direction, task};
use crate::runs::{Subject, four_bar, pendulum, run_with, spatial};
use nalgebra::Vector3;
use vi_constraints::costate_sweep::{CostateSweep, Linearization};
use vi_constraints::linearization::{Costate, Sources, Tangent};
use vi_constraints::{Constraints, Options, SchemeKind};
use vi_control::objective::{NumberCost, PointComponent, Terminal};
use vi_control::sensitivities::Beside;
use vi_control::{
    Checkpoints, ControlForce, Controls, Direction, Gradient, JointControl, Objective,
    Sensitivities, Task,
};
use vi_core::Interval;
use vi_core::galerkin::Stages;
use vi_core::linear::{dot, norm_inf};
use vi_multibody::FrameId::Ground;
use vi_multibody::PairKind;
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::form::Form;
use vi_multibody::held_effort::HeldEffort;
use vi_testkit::Sample;

const STEPS: usize = 20;

fn options(scheme: SchemeKind, s: usize, h: f64) -> Options {
    Options::new(scheme, h).galerkin(Stages::new(s).unwrap())
}

/// The forms with control points.
const SCHEMES: [SchemeKind; 2] = [SchemeKind::Constrained, SchemeKind::Nodal];

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
            let mut step = Linearization::new(run.method(), n, m, run.rows());
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
            for scheme in SCHEMES {
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
                let rate = forward.rates(beside, run.state())[0];
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

/// Two arms with what one Gauss node and the step of order 2 take alike: a spring and a damper
/// between points.
fn tied() -> Subject {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.2, -9.81]);
    let solid = |mass: f64| Inertia::principal(mass, [0.02, 0.05, 0.04]);
    let one = builder.body("one", solid(1.0)).at([0.5, 0.0, 0.0]).id();
    let two = builder.body("two", solid(0.7)).at([1.5, 0.0, 0.0]).id();
    let top = builder.joint("top", PairKind::Revolute, Ground, one).at([0.0; 3]);
    let _ = top.axis([0.0, 1.0, 0.3]).rate(1.0).id();
    let elbow = builder.joint("elbow", PairKind::Revolute, one, two).at([1.0, 0.0, 0.0]);
    let _ = elbow.axis([0.0, 1.0, 0.0]).rate(-0.5).id();
    let (anchor, tip) = ([0.3, 0.2, 1.0], two.point([0.3, 0.0, 0.1]));
    builder.spring(anchor, tip, 8.0).natural_length(0.4).damping(0.6);
    Subject { name: "tied", built: builder.build().unwrap(), controlled: Vec::new() }
}

#[test]
fn one_gauss_node_is_the_step_of_order_two() {
    let of = |options: Options| {
        let (mut run, controls, objective) = run_with(tied(), options, STEPS);
        Gradient::of(&mut run, &task(&objective, &controls)).unwrap()
    };
    let expected = of(Options::new(SchemeKind::Nodal, 0.02));
    for scheme in SCHEMES {
        let found = of(options(scheme, 1, 0.02));
        let off = |x: &[f64], y: &[f64]| {
            let apart: Vec<f64> = x.iter().zip(y).map(|(x, y)| x - y).collect();
            norm_inf(&apart) / norm_inf(y)
        };
        let errors = [
            off(&found.initial.p, &expected.initial.p),
            (found.value / expected.value - 1.0).abs(),
        ];
        println!("{scheme:?}: {:.1e} in costates, {:.1e} in the cost", errors[0], errors[1]);
        assert!(errors.iter().all(|error| *error < 1e-12), "{scheme:?}: {errors:?}");
    }
}

#[test]
fn no_bit_depends_on_the_checkpoints() {
    for (subject, s) in [(pendulum(), 2), (four_bar(), 3), (spatial(), 2)] {
        let name = subject.name;
        let (mut run, controls, objective) =
            run_with(subject, options(SchemeKind::Nodal, s, 0.02), STEPS);
        let start = run.state().clone();
        let mut of = |checkpoints| {
            run.place_at(&start);
            let task = Task { checkpoints, ..task(&objective, &controls) };
            let Gradient { value, initial, controls, .. } = Gradient::of(&mut run, &task).unwrap();
            let parts = [&initial.q, &initial.p, &initial.z].into_iter().chain(&controls);
            let all = parts.flatten().chain([&value]);
            all.map(|x| x.to_bits()).collect::<Vec<u64>>()
        };
        let expected = of(Checkpoints::All);
        let size = 12 * 8 * start.q.len();
        for checkpoints in [
            Checkpoints::Every(1),
            Checkpoints::Every(3),
            Checkpoints::Every(7),
            Checkpoints::Memory(0),
            Checkpoints::Memory(8 * size),
            Checkpoints::default(),
        ] {
            assert_eq!(of(checkpoints), expected, "{name}, {checkpoints:?}");
        }
    }
}

/// `dJ/dp̄_0` and `dJ/dw` of a number at the end of 0.8 s, with efforts that stay.
fn smooth(mut subject: Subject, s: usize, steps: usize) -> Vec<f64> {
    let last = subject.built.mechanism.dim() - 12;
    let of = |(of, effort): &(_, HeldEffort)| {
        let coordinate = subject.built.coordinate(*of).unwrap();
        Box::new(JointControl { effort: effort.clone(), coordinate }) as Box<dyn ControlForce>
    };
    let forces: Vec<_> = subject.controlled.iter().map(of).collect();
    let values = vec![(0..forces.len()).map(|k| 1.3 - k as f64).collect()];
    let controls = Controls::new(forces, values, steps);
    let point = Form::point(last, &Vector3::new(0.3, 0.1, -0.2));
    let quantity = PointComponent { point, axis: 2 };
    let objective =
        Objective::new().with(1.0, Terminal { quantity, judged: NumberCost::Deviation(0.4) });
    let h = 0.8 / steps as f64;
    let mut run = subject.built.integrator(options(SchemeKind::Nodal, s, h)).unwrap();
    let task = Task { steps, ..task(&objective, &controls) };
    let found = Gradient::of(&mut run, &task).unwrap();
    [found.initial.p, found.controls.concat()].concat()
}

#[test]
fn gradients_converge_with_the_order_of_the_motion() {
    let subjects: [(fn() -> Subject, [usize; 3]); 2] =
        [(pendulum, [20, 10, 5]), (four_bar, [40, 80, 40])];
    for (subject, steps) in subjects {
        let name = subject().name;
        let exact = smooth(subject(), 6, 160);
        for (s, coarse) in [1, 2, 3].into_iter().zip(steps) {
            let error = |steps: usize| {
                let found = smooth(subject(), s, steps);
                let apart: Vec<f64> = found.iter().zip(&exact).map(|(x, y)| x - y).collect();
                norm_inf(&apart) / norm_inf(&exact)
            };
            let errors = [1, 2, 4, 8].map(|k| error(k * coarse));
            let orders: Vec<f64> =
                errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect();
            println!("{name}, s = {s}: errors {errors:?}, orders {orders:.2?}");
            let order = orders[2];
            assert!((order - 2.0 * s as f64).abs() < 0.2, "{name}, s = {s}: {orders:?}");
        }
    }
}
