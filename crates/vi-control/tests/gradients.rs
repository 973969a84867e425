//! Gradients of runs: against sensitivities forward, against differences, with all checkpoints.

use crate::runs::{
    Subject, add_rates, conservative, four_bar, pendulum, remembering, run, spatial,
};
use vi_constraints::linearization::Tangent;
use vi_constraints::{Constraints, SchemeKind};
use vi_control::sensitivities::Beside;
use vi_control::{Checkpoints, Controls, Direction, Gradient, Objective, Sensitivities, Task};
use vi_core::linear::{dot, norm_inf};
use vi_core::{Composition, MechanicalSystem};
use vi_multibody::run::MechanismIntegrator;
use vi_testkit::Sample;

pub(crate) const SUBJECTS: [fn() -> Subject; 5] =
    [pendulum, conservative, spatial, four_bar, remembering];
const STEPS: usize = 20;

pub(crate) fn task<'a>(objective: &'a Objective, controls: &'a Controls) -> Task<'a> {
    let checkpoints = Checkpoints::All;
    Task { steps: STEPS, objective, controls, design: None, by_step: false, checkpoints }
}

/// A start that moves with a change of all momenta, and of internal variables.
pub(crate) fn direction(
    run: &MechanismIntegrator,
    controls: &Controls,
    sample: &mut Sample,
) -> Direction {
    let state = run.state();
    let mut start = Tangent::zero(state.q.len(), state.internal.len());
    let v: Vec<f64> = state.q.iter().map(|_| sample.number()).collect();
    run.system().mass().mul_add(1.0, &v, &mut start.p);
    start.z.iter_mut().for_each(|z| *z = sample.number());
    let rates = controls.values().iter().map(|row| row.iter().map(|_| sample.number()).collect());
    Direction { start, controls: rates.collect(), ..Direction::default() }
}

/// `dJ` along a direction by the gradient, with the sum of the sizes of its terms.
pub(crate) fn along(gradient: &Gradient, direction: &Direction) -> (f64, f64) {
    let Direction { start, controls, .. } = direction;
    let mut terms = vec![
        dot(&gradient.initial.q, &start.q),
        dot(&gradient.initial.p, &start.p),
        dot(&gradient.initial.z, &start.z),
    ];
    terms.extend(gradient.controls.iter().zip(controls).map(|(a, b)| dot(a, b)));
    (terms.iter().sum(), terms.iter().map(|x| x.abs()).sum())
}

#[test]
fn backward_agrees_with_forward_in_all_schemes() {
    let mut sample = Sample::new(92);
    for subject in SUBJECTS {
        for scheme in SchemeKind::ALL {
            let compositions = [Composition::Identity, Composition::Suzuki5];
            for (composition, rates) in
                compositions.into_iter().zip([false, true]).chain([(Composition::Identity, true)])
            {
                let subject = subject();
                let name = subject.name;
                if subject.built.system(vi_core::Quadrature::Midpoint).is_dissipative()
                    && composition != Composition::Identity
                {
                    continue; // no negative sub-steps
                }
                let (mut run, controls, mut objective) = run(subject, scheme, composition, STEPS);
                if rates {
                    add_rates(&run, &mut objective);
                }
                let start = run.state().clone();
                let mut directions =
                    vec![direction(&run, &controls, &mut sample), Direction::default()];
                directions[1].start = Tangent::zero(start.q.len(), start.internal.len());
                directions[1].step = name != "memory";
                let by_step = directions[1].step;
                let task = Task { by_step, ..task(&objective, &controls) };
                let found = Gradient::of(&mut run, &task).unwrap();
                run.place_at(&start);
                let mut forward = Sensitivities::new(&run, 0.02, directions.clone()).unwrap();
                let beside = Beside { controls: &controls, design: None, objective: &objective };
                for _ in 0..STEPS {
                    forward.advance(&mut run, beside).unwrap();
                }
                let found_forward = forward.rates(beside, run.state());
                let (backward, size) = along(&found, &directions[0]);
                let error = (found_forward[0] - backward).abs() / size;
                let of_step = |step: f64| (step - found_forward[1]).abs() / step.abs();
                let step = found.step.map_or(0.0, of_step);
                println!(
                    "{name}, {scheme:?}, {composition:?}, rates {rates}: {error:.1e}, by the step {step:.1e}"
                );
                assert!(error < 1e-12 && step < 1e-11, "{name} {scheme:?}: {error:e} {step:e}");
            }
        }
    }
}

/// The cost of a run from the present state, with its controls at each step.
pub(crate) fn cost(
    run: &mut MechanismIntegrator,
    objective: &Objective,
    controls: &Controls,
    w: &dyn Fn(usize) -> Vec<f64>,
) -> f64 {
    let mut value = 0.0;
    for step in 0..STEPS {
        let (before, t) = (objective.of_node(run.state()), run.state().t);
        let w = w(step);
        controls.forces().iter().zip(&w).for_each(|(force, w)| force.set(*w));
        run.step_with(&mut |_, _, taken| value += objective.of_step(taken.s, &w)).unwrap();
        let after = run.state();
        value += 0.5 * (after.t - t) * (before + objective.of_node(after));
    }
    value + objective.of_end(run.state())
}

#[test]
fn gradients_are_those_of_differences() {
    let mut sample = Sample::new(93);
    for (subject, rates) in SUBJECTS.into_iter().flat_map(|own| [(own, false), (own, true)]) {
        let subject = subject();
        let name = subject.name;
        let (mut run, controls, mut objective) =
            run(subject, SchemeKind::Nodal, Composition::Identity, STEPS);
        if rates {
            add_rates(&run, &mut objective);
        }
        let start = run.state().clone();
        let along_this = direction(&run, &controls, &mut sample);
        let found = Gradient::of(&mut run, &task(&objective, &controls)).unwrap();
        let mut at = |e: f64| {
            let mut moved = start.clone();
            let Direction { start: own, controls: changes, .. } = &along_this;
            moved.p.iter_mut().zip(&own.p).for_each(|(p, dp)| *p += e * dp);
            moved.internal.iter_mut().zip(&own.z).for_each(|(z, dz)| *z += e * dz);
            run.place_at(&moved);
            let w = |step: usize| {
                controls.at(step).iter().zip(&changes[step]).map(|(w, dw)| w + e * dw).collect()
            };
            cost(&mut run, &objective, &controls, &w)
        };
        let value = at(0.0);
        assert_eq!(value.to_bits(), found.value.to_bits(), "{name}: the value is that of the run");
        let e = 1e-4;
        let difference = (8.0 * (at(e) - at(-e)) - (at(2.0 * e) - at(-2.0 * e))) / (12.0 * e);
        let (exact, size) = along(&found, &along_this);
        let error = (difference - exact).abs() / size;
        println!("{name}: dJ = {exact:.6}, differences off by {error:.1e} of the terms");
        assert!(error < 1e-9, "{name}: {error:e}");
    }
}

#[test]
fn no_bit_depends_on_the_checkpoints() {
    for (subject, rates) in SUBJECTS.into_iter().flat_map(|own| [(own, false), (own, true)]) {
        let subject = subject();
        let name = subject.name;
        let (mut run, controls, mut objective) =
            run(subject, SchemeKind::Nodal, Composition::Identity, STEPS);
        if rates {
            add_rates(&run, &mut objective);
        }
        let start = run.state().clone();
        let mut of = |checkpoints| {
            run.place_at(&start);
            let task = Task { checkpoints, ..task(&objective, &controls) };
            let found = Gradient::of(&mut run, &task).unwrap();
            (found, run.state().clone())
        };
        let (expected, end) = of(Checkpoints::All);
        let size = 12 * 8 * end.q.len();
        let settings = [
            Checkpoints::Every(1),
            Checkpoints::Every(3),
            Checkpoints::Every(7),
            Checkpoints::Every(50),
            Checkpoints::Memory(0),
            Checkpoints::Memory(8 * size),
            Checkpoints::Memory(13 * size),
            Checkpoints::default(),
        ];
        for checkpoints in settings {
            let (found, last) = of(checkpoints);
            let bits = |gradient: &Gradient| {
                let Gradient { value, initial, controls, .. } = gradient;
                let parts = [&initial.q, &initial.p, &initial.z].into_iter().chain(controls);
                let all = parts.flatten().chain([value]);
                all.map(|x| x.to_bits()).collect::<Vec<u64>>()
            };
            assert_eq!(bits(&found), bits(&expected), "{name}, {checkpoints:?}");
            assert_eq!(last.q, end.q, "{name}, {checkpoints:?}: the run is at its end");
        }
        let largest = norm_inf(&expected.initial.q);
        println!("{name}: largest entry {largest:.2e}, equal bits with 8 settings");
    }
}

#[test]
fn costates_of_momenta_are_tangent() {
    let (mut run, controls, objective) =
        run(four_bar(), SchemeKind::Nodal, Composition::Identity, STEPS);
    let q = run.state().q.clone();
    let found = Gradient::of(&mut run, &task(&objective, &controls)).unwrap();
    let mut rates = vec![0.0; run.constraints().len()];
    run.constraints().add_rates(0.0, &q, &found.initial.p, &mut rates);
    let off = norm_inf(&rates) / norm_inf(&found.initial.p);
    println!("G b = {off:.1e} of b");
    assert!(off < 1e-13, "{off:e}");
}
