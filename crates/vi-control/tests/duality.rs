//! Forward and backward are transposed of each other, step by step.

use crate::runs::{Subject, four_bar, pendulum, remembering, run, spatial};
use vi_constraints::linearization::{Costate, Sources, StepLinearization, Tangent};
use vi_constraints::{Constraints, SchemeKind};
use vi_core::linear::dot;
use vi_core::{Composition, DiscreteLagrangian, Interval};
use vi_testkit::Sample;

fn random(sample: &mut Sample, n: usize) -> Vec<f64> {
    (0..n).map(|_| sample.number()).collect()
}

#[test]
fn a_step_backward_is_the_transposed_of_one_forward() {
    let mut sample = Sample::new(91);
    let subjects: [fn() -> Subject; 4] = [pendulum, spatial, four_bar, remembering];
    for subject in subjects {
        let subject = subject();
        let name = subject.name;
        let (mut run, controls, _) = run(subject, SchemeKind::Nodal, Composition::Identity, 5);
        let (n, m) = (run.state().q.len(), run.constraints().len());
        let internal = run.state().internal.len();
        let mut step = StepLinearization::new(n, m, run.rows());
        let mut worst: f64 = 0.0;
        for k in 0..5 {
            controls.set(k);
            let (mut p, mut steps) = (run.state().p.clone(), Vec::<Interval>::new());
            run.step_with(&mut |_, _, taken| steps.push(taken.s.clone())).unwrap();
            let (system, constraints) = (run.system(), run.constraints());
            for s in &steps {
                step.linearize(system, constraints, s, &p).unwrap();
                let [start, at_end] = [0, 1].map(|_| Tangent {
                    q: random(&mut sample, n),
                    p: random(&mut sample, n),
                    z: random(&mut sample, internal),
                });
                let mut sources = Sources::zero(n, m);
                sources.minus = random(&mut sample, n);
                sources.plus = random(&mut sample, n);
                if step.rows().len() == m {
                    sources.rows = random(&mut sample, m); // else they contradict each other
                }
                let mut end = start.clone();
                step.push(system, constraints, s, &sources, &mut end).unwrap();
                let mut costate = Costate { q: at_end.q, p: at_end.p, z: at_end.z };
                let after = costate.clone();
                step.pull(system, constraints, s, &mut costate).unwrap();
                let pairs =
                    |c: &Costate, t: &Tangent| [dot(&c.q, &t.q), dot(&c.p, &t.p), dot(&c.z, &t.z)];
                let (left, right) = (pairs(&after, &end), pairs(&costate, &start));
                let along = step.along(&sources);
                let terms = left.iter().chain(&right).chain([&along]);
                let size: f64 = terms.map(|x| x.abs()).sum();
                let defect = left.iter().sum::<f64>() - right.iter().sum::<f64>() - along;
                worst = worst.max(defect.abs() / size);
                system.forced_d2(s, &mut p);
            }
        }
        println!("{name}: forward and backward differ by {worst:.1e} of their terms");
        assert!(worst < 1e-13, "{name}: {worst:e}");
    }
}
