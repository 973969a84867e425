//! Derivatives of Galerkin runs by the length of all steps: forward against backward, against
//! differences of runs with other steps, with time-dependent loads and with loops.

use crate::gradients::task;
use crate::runs::{Subject, four_bar, pendulum, run_with, spatial};
use nalgebra::{DMatrix, Vector3};
use std::sync::Arc;
use vi_constraints::linearization::Tangent;
use vi_constraints::{Options, SchemeKind};
use vi_control::sensitivities::Beside;
use vi_control::{Controls, Direction, Gradient, Objective, Sensitivities, Task};
use vi_core::galerkin::Stages;
use vi_multibody::FrameId::Ground;
use vi_multibody::PairKind;
use vi_multibody::builder::{ActOn, Inertia, MechanismBuilder, Read};
use vi_multibody::joint_force::{EffortSlopes, JointLaw};
use vi_multibody::law::Law;
use vi_multibody::run::MechanismIntegrator;
use vi_rigid::TimeHistory;

const STEPS: usize = 12;

/// A damper and a spring that change with the time.
#[derive(Clone, Copy, Debug)]
struct Varying;

impl JointLaw for Varying {
    fn effort(&self, t: f64, x: f64, rate: f64) -> f64 {
        -0.6 * rate * (1.0 + 0.5 * (5.0 * t).sin()) - 0.1 * rate * rate + 2.0 * x * (3.0 * t).cos()
    }
    fn slopes(&self, t: f64, _: f64, rate: f64) -> EffortSlopes {
        let by_rate = -0.6 * (1.0 + 0.5 * (5.0 * t).sin()) - 0.2 * rate;
        EffortSlopes { by_coordinate: 2.0 * (3.0 * t).cos(), by_rate }
    }
    fn by_time(&self, t: f64, x: f64, rate: f64) -> Option<f64> {
        Some(-1.5 * rate * (5.0 * t).cos() - 6.0 * x * (3.0 * t).sin())
    }
    fn is_dissipative(&self) -> bool {
        true
    }
}

/// An effort by the time and the rate of another joint.
struct Timed;

impl Law for Timed {
    fn efforts(&self) -> usize {
        1
    }
    fn evaluate(&self, y: &[f64], _: &[f64], values: &mut [f64]) {
        values[0] = (4.0 * y[0]).sin() * (1.0 + y[1] * y[1]);
    }
    fn gradient(&self, y: &[f64], z: &[f64], values: &mut [f64], slopes: &mut DMatrix<f64>) {
        self.evaluate(y, z, values);
        slopes[(0, 0)] = 4.0 * (4.0 * y[0]).cos() * (1.0 + y[1] * y[1]);
        slopes[(0, 1)] = 2.0 * (4.0 * y[0]).sin() * y[1];
    }
    fn is_dissipative(&self) -> bool {
        false
    }
}

/// Two arms with a follower, a varying damper and an effort that read the time.
fn driven() -> Subject {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let solid = |mass: f64| Inertia::principal(mass, [0.02, 0.05, 0.04]);
    let one = builder.body("one", solid(1.0)).at([0.5, 0.0, 0.0]).id();
    let two = builder.body("two", solid(0.7)).at([1.5, 0.0, 0.0]).id();
    let top = builder.joint("top", PairKind::Spherical, Ground, one).at([0.0; 3]);
    let _ = top.id();
    let elbow = builder.joint("elbow", PairKind::Revolute, one, two).at([1.0, 0.0, 0.0]);
    let elbow = elbow.axis([0.1, 1.0, 0.2]).rate(-0.5).id().coordinate(0);
    let history = TimeHistory::Harmonic { frequency: 1.3, phase: 0.4, amplitude: 2.0, offset: 0.5 };
    let load = builder.load(two).force([1.0, 2.0, 0.5]).torque([0.3, 0.1, -0.2]).follower();
    load.point(Vector3::new(0.2, 0.1, 0.0)).history(history);
    builder.joint_force(elbow, Varying);
    let reads = vec![Read::Time, Read::Rate(elbow)];
    builder.law(ActOn::Coordinate(elbow), reads, Vec::new(), Arc::new(Timed));
    Subject { name: "driven", built: builder.build().unwrap(), controlled: Vec::new() }
}

/// A run of a subject from 0.3 s on by steps of this length.
fn by(subject: Subject, stages: usize, h: f64) -> (MechanismIntegrator, Controls, Objective) {
    let options = Options::new(SchemeKind::Nodal, h).galerkin(Stages::new(stages).unwrap());
    let (mut run, controls, objective) = run_with(subject, options, STEPS);
    let mut start = run.state().clone();
    start.t = 0.3;
    run.resume(start).unwrap();
    (run, controls, objective)
}

/// The cost of the run.
fn cost(subject: Subject, stages: usize, h: f64) -> f64 {
    let (mut run, controls, objective) = by(subject, stages, h);
    let mut value = 0.0;
    for step in 0..STEPS {
        controls.set(step);
        let w = controls.at(step);
        run.step_with(&mut |_, _, taken| value += objective.of_step(taken.s, w)).unwrap();
    }
    value + objective.of_end(run.state())
}

#[test]
fn the_cost_changes_with_the_length_of_all_steps_as_differences_say() {
    for subject in [pendulum, spatial, four_bar, driven] {
        for s in 1..=3 {
            let name = subject().name;
            let h = 0.02;
            let (mut run, controls, objective) = by(subject(), s, h);
            let start = run.state().clone();
            let task = Task { by_step: true, steps: STEPS, ..task(&objective, &controls) };
            let found = Gradient::of(&mut run, &task).unwrap().step.unwrap();
            run.place_at(&start);
            let mut direction = Direction { step: true, ..Direction::default() };
            let (n, internal) = (start.q.len(), start.internal.len());
            direction.start = Tangent::zero(n, internal);
            let mut forward = Sensitivities::new(&run, h, vec![direction]).unwrap();
            let beside = Beside { controls: &controls, design: None, objective: &objective };
            for _ in 0..STEPS {
                forward.advance(&mut run, beside).unwrap();
            }
            let rate = forward.rates(beside, run.state())[0];
            let e = 1e-3 * h;
            let at = |k: f64| cost(subject(), s, h + k * e);
            let difference = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * e);
            let errors = [rate, difference].map(|other| (other / found - 1.0).abs());
            let [a, b] = errors;
            println!("{name}, s = {s}: dJ/dh = {found:.6}, forward {a:.1e}, differences {b:.1e}");
            assert!(a < 1e-11 && b < 1e-8, "{name}, s = {s}: {errors:?}");
        }
    }
}
