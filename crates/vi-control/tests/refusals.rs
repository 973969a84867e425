//! Runs without derivatives are refused by what they lack.

use vi_constraints::{Options, SchemeKind};
use vi_control::objective::Time;
use vi_control::{Checkpoints, Controls, Gradient, Objective, Sensitivities, Task};
use vi_core::galerkin::Stages;
use vi_multibody::FrameId::Ground;
use vi_multibody::PairKind;
use vi_multibody::builder::{CoordinateId, Inertia, JointLimits, MechanismBuilder};
use vi_multibody::run::MechanismIntegrator;

fn pendulum(
    of: impl Fn(&mut MechanismBuilder, CoordinateId),
    options: Options,
) -> MechanismIntegrator {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let arm = builder.body("arm", Inertia::principal(1.0, [0.1; 3])).at([0.5, 0.0, 0.0]).id();
    let hinge = builder.joint("hinge", PairKind::Revolute, Ground, arm).at([0.0; 3]);
    let angle = hinge.axis([0.0, 1.0, 0.0]).id().coordinate(0);
    of(&mut builder, angle);
    builder.build().unwrap().integrator(options).unwrap()
}

fn refusal(mut run: MechanismIntegrator, by_step: bool) -> String {
    let (objective, controls) = (Objective::new().with(1.0, Time), Controls::default());
    let task = Task {
        steps: 3,
        objective: &objective,
        controls: &controls,
        design: None,
        by_step,
        checkpoints: Checkpoints::All,
    };
    let forward = Sensitivities::new(&run, 0.01, Vec::new()).err().map(|e| e.to_string());
    let backward = Gradient::of(&mut run, &task).unwrap_err().to_string();
    assert!(by_step || forward.as_ref() == Some(&backward), "{forward:?} against {backward}");
    backward
}

#[test]
fn what_has_no_derivative_is_named() {
    let nodal = || Options::new(SchemeKind::Nodal, 0.01);
    let stop = |builder: &mut MechanismBuilder, angle| {
        let limits = JointLimits { lower: Some(-1.0), upper: Some(1.0), restitution: 0.5 };
        builder.joint_limits(angle, limits);
    };
    let motor = |builder: &mut MechanismBuilder, angle| {
        builder.motor(angle, |t| t * t).named("drive");
    };
    let found = [
        refusal(pendulum(stop, nodal()), false),
        refusal(pendulum(motor, nodal()), true),
        refusal(pendulum(motor, nodal().galerkin(Stages::new(2).unwrap())), true),
    ];
    let expected = [
        "a run with contacts, joint stops or dry friction has no derivatives",
        "`drive` has no derivative by the time step",
        "`drive` has no derivative by the time step",
    ];
    assert_eq!(found, expected);
}
