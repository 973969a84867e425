//! What a gradient costs, in runs. Not part of the ordinary tests: times depend on the machine.
//!
//! `cargo test -p vi-control --test all -- cost --ignored --nocapture`

use std::time::Instant;
use vi_constraints::{Options, SchemeKind};
use vi_control::objective::{Effort, Last, PointComponent};
use vi_control::{Checkpoints, ControlForce, Controls, Gradient, JointControl, Objective, Task};
use vi_multibody::PairKind;
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::form::Form;
use vi_multibody::held_effort::HeldEffort;
use vi_multibody::joint::FrameId;
use vi_multibody::run::MechanismIntegrator;

/// A chain of bodies on hinges with a motor on each, held over all steps.
fn chain(bodies: usize, steps: usize, hold: usize) -> (MechanismIntegrator, Controls) {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let (mut last, mut motors) = (FrameId::Ground, Vec::new());
    for k in 0..bodies {
        let x = 0.1 * k as f64;
        let inertia = Inertia::principal(0.1, [1e-4, 1e-3, 1e-3]);
        let link = builder.body(&format!("link {k}"), inertia).at([x + 0.05, 0.0, 0.0]).id();
        let axis = [0.0, 1.0, if k % 2 == 0 { 0.3 } else { -0.3 }];
        let hinge = builder.joint(&format!("hinge {k}"), PairKind::Revolute, last, link);
        let hinge = hinge.at([x, 0.0, 0.0]).axis(axis).id().coordinate(0);
        let effort = HeldEffort::default();
        builder.joint_force(hinge, effort.clone());
        motors.push((hinge, effort));
        last = link.into();
    }
    let mut built = builder.build().unwrap();
    let forces = motors.into_iter().map(|(hinge, effort)| {
        let coordinate = built.coordinate(hinge).unwrap();
        Box::new(JointControl { effort, coordinate }) as Box<dyn ControlForce>
    });
    let forces: Vec<_> = forces.collect();
    let values = vec![vec![0.01; bodies]; steps.div_ceil(hold)];
    let controls = Controls::new(forces, values, hold);
    (built.integrator(Options::new(SchemeKind::Nodal, 1e-3)).unwrap(), controls)
}

#[test]
#[ignore = "measures times"]
fn a_gradient_costs_a_few_runs() {
    for (bodies, steps, hold) in [(8, 400, 400), (8, 400, 4), (64, 100, 100), (512, 30, 30)] {
        let (mut run, controls) = chain(bodies, steps, hold);
        let height = PointComponent { point: Form::particle(12 * (bodies - 1), 3), axis: 2 };
        let objective = Objective::new().with(1.0, Last(height)).with(1.0, Effort { of: vec![] });
        let start = run.state().clone();
        let [mut alone, mut whole] = [f64::INFINITY; 2];
        for _ in 0..3 {
            run.place_at(&start);
            let clock = Instant::now();
            for step in 0..steps {
                controls.set(step);
                run.step().unwrap();
            }
            alone = alone.min(clock.elapsed().as_secs_f64());
            run.place_at(&start);
            let clock = Instant::now();
            let task = Task {
                steps,
                objective: &objective,
                controls: &controls,
                design: None,
                by_step: false,
                checkpoints: Checkpoints::default(),
            };
            let found = Gradient::of(&mut run, &task).unwrap();
            whole = whole.min(clock.elapsed().as_secs_f64());
            assert!(found.value.is_finite());
        }
        let per = |time: f64| 1e6 * time / (bodies * steps) as f64;
        println!(
            "{bodies} bodies, {} controls: a run {:.2} µs per body and step, a gradient {:.2}: {:.2} runs",
            controls.values().len() * bodies,
            per(alone),
            per(whole),
            whole / alone
        );
    }
}
