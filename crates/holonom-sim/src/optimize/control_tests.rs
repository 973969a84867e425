//! Optima of controls by POUNCE from model files: stored costs, the run of the result.
#![cfg(feature = "pounce")]

use super::{Found, OptimizeFailure, Progress, Status, Watch, optimize};
use crate::simulation::Simulation;
use holonom_model::{Model, ModelText};
use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;
use vi_control::Pounce;

fn found(text: &str) -> Result<Found, OptimizeFailure> {
    let text = ModelText::from_text(Path::new("model.toml"), text);
    let model = text.model(&[])?;
    let watch: Watch = Rc::new(RefCell::new(|_: &Progress| true));
    optimize(&text, &[], &model, Some(&mut Pounce::default()), &watch)
}

const PENDULUM: &str = r#"
model = { name = "swing up", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.05, end = 2.0 }
body = [{ name = "rod", mass = 1.0, inertia = [0.08354166666666665, 0.08354166666666665, 0.00041666666666666675], position = [0.0, 0.0, -0.5] }]
joint = [{ name = "hinge", type = "revolute", parent = "ground", child = "rod", position = [0.0, 0.0, 0.0], axis = [0.0, 1.0, 0.0] }]
sensor = [{ name = "angle", type = "joint_coordinate", of = "hinge" }, { name = "place", type = "position", of = "rod" }]
control = [{ name = "torque", joint = "hinge" }]
objective = [{ name = "cheap", type = "effort" }]
condition = [{ name = "up", sensor = "angle", equals = 3.141592653589793 }, { name = "stop", type = "rest" }]
"#;

/// The run of the model that is found, read again from its text: its last node.
fn run(found: &Found) -> Vec<f64> {
    let model = Model::from_toml(&found.model.to_toml()).unwrap();
    assert_eq!(model, found.model);
    let mut simulation = Simulation::new(&model).unwrap();
    let run = simulation.integrator();
    for _ in 0..model.settings.steps() {
        run.step().unwrap();
    }
    run.state().q.clone()
}

/// The case `oc01` of `tests/reference/control`.
#[test]
fn a_pendulum_swings_up_at_the_stored_cost() {
    let found_of = found;
    let found = found(PENDULUM).unwrap();
    let report = &found.report;
    assert_eq!(report.status, Status::Optimal, "{report:?}");
    assert!((report.cost - 4.434825997490211).abs() < 1e-8, "{}", report.cost);
    assert_eq!(report.sufficient, Some(true));
    assert!(report.replay.as_ref().unwrap().deviation < 1e-8);
    assert!(report.conditions[0].violation < 1e-10 && report.conditions.len() == 1);
    let q = run(&found);
    assert!((q[2] - 0.5).abs() < 1e-8, "{q:?}");
    // the price: the cost of a little more
    let cost = |angle: f64| {
        found_of(&PENDULUM.replace("3.141592653589793", &format!("{angle:?}"))).unwrap().report.cost
    };
    let pi = std::f64::consts::PI;
    let slope = (cost(pi + 1e-3) - cost(pi - 1e-3)) / 2e-3;
    let price = report.conditions[0].price;
    assert!((slope - price).abs() < 1e-4 * price.abs(), "{slope} for {price}");
    assert_eq!(found.controls().lines().count(), 41);
    assert_eq!(found.costates().lines().count(), 41);
    assert!(
        found.iterations().starts_with("start,steps,iteration,cost,infeasibility,stationarity")
    );
}

/// Bounds, a free time, `hold`, a condition on a point, the start from another motion.
#[test]
fn bounds_and_a_free_time_hold() {
    let text = PENDULUM
        .replace("joint = \"hinge\" }]", "joint = \"hinge\", min = -3.5, max = 3.5, hold = 2 }]");
    let text = text.replace(
        "type = \"effort\" }]",
        "type = \"effort\" }, { name = \"soon\", type = \"time\", weight = 3.0 }]",
    ) + "optimize = { time = { min = 1.0, max = 6.0 }, refine = 0 }";
    let free = found(&text).unwrap();
    let report = &free.report;
    assert_eq!(report.status, Status::Optimal, "{report:?}");
    assert!(report.time > 1.0 && report.time < 6.0 && (report.time - 2.0).abs() > 1e-3);
    assert!(report.controls[0].largest <= 3.5 && report.controls[0].at_bounds > 0, "{report:?}");
    let pairs = free.controls.chunks(2);
    assert!(pairs.into_iter().all(|pair| pair[0] == pair[1]), "two steps for each value");
    assert!((report.terms[1].value - 3.0 * report.time).abs() < 1e-12);
    assert!((run(&free)[2] - 0.5).abs() < 1e-7);
    let by_point = PENDULUM.replace(
        "sensor = \"angle\", equals = 3.141592653589793",
        "sensor = \"place.z\", min = 0.499999",
    ) + "optimize = { guess = \"run\", starts = 3 }";
    let by_point = found(&by_point).unwrap();
    assert_eq!(by_point.report.starts.len(), 3, "{:?}", by_point.report);
    if by_point.report.status == Status::Optimal {
        assert!((by_point.report.cost - 4.4348).abs() < 0.01, "{}", by_point.report.cost);
    }
}

/// Efforts that cannot lift it.
#[test]
fn what_no_effort_meets_is_infeasible() {
    let text =
        PENDULUM.replace("joint = \"hinge\" }]", "joint = \"hinge\", min = -0.3, max = 0.3 }]");
    let report = found(&text).unwrap().report;
    assert_eq!(report.status, Status::Infeasible, "{report:?}");
    assert!(!report.missed.is_empty());
}

#[test]
fn what_cannot_be_optimised_is_said() {
    for (changed, with, words) in [
        (
            "type = \"effort\" }]",
            "type = \"effort\" }]\noptimize = { guess = \"nowhere\" }",
            "no folder of an optimum",
        ),
        ("step = 0.05", "step = 0.05, order = 4", "higher order"),
        ("joint = \"hinge\" }]", "joint = \"hinge\", shape = \"linear\" }]", "linear in time"),
        (
            "axis = [0.0, 1.0, 0.0] }]",
            "axis = [0.0, 1.0, 0.0], motor = { effort = 1.0 } }]",
            "beside another effort",
        ),
        (
            "sensor = \"angle\", equals",
            "sensor = \"angle\", at = \"path\", min = 0.5, max",
            "start outside of the bounds",
        ),
        ("objective = [{ name = \"cheap\", type = \"effort\" }]", "", "an optimum of nothing"),
    ] {
        assert!(PENDULUM.contains(changed), "{changed}");
        let error = found(&PENDULUM.replace(changed, with)).err();
        let error = error.map(|error| error.to_string()).unwrap_or_default();
        assert!(error.contains(words), "{words}: {error}");
    }
}
