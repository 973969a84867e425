//! Optima of controls by all sensors that have derivatives: what `gradient` finds at them.
#![cfg(feature = "pounce")]

use super::{FoundOptimum, OptimizeFailure, SearchProgress, SearchStatus, SearchWatch, optimize};
use crate::gradient::{Wanted, gradient};
use holonom_model::ModelText;
use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;
use vi_control::Pounce;

const ARM: &str = r#"
model = { name = "arm", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.025, end = 0.6 }
body = [{ name = "upper", mass = 1.2, inertia = [0.02, 0.02, 0.004], position = [0.2, 0.0, 0.0] }, { name = "lower", mass = 0.8, inertia = [0.015, 0.015, 0.003], position = [0.6, 0.0, 0.0] }]
joint = [{ name = "shoulder", type = "revolute", parent = "ground", child = "upper", position = [0.0, 0.0, 0.0], axis = [0.0, 1.0, 0.0], rate = 0.4, spring = { stiffness = 9.0, rest = 0.3 }, damper = { damping = 0.2 } }, { name = "elbow", type = "revolute", parent = "upper", child = "lower", position = [0.4, 0.0, 0.0], axis = [0.0, 1.0, 0.0] }]
spring = [{ name = "cord", from = "ground", to = "lower", point_from = [0.0, 0.0, 1.0], stiffness = 4.0, natural_length = 0.7, damping = 0.1 }]
control = [{ name = "a", joint = "shoulder" }, { name = "b", joint = "elbow", hold = 2 }, { name = "c", body = "lower", force = [0.3, 0.0, 1.0] }]
"#;

/// How the order of the steps is reached.
const METHODS: [&str; 3] = ["2", "4, method = \"composition\"", "4, method = \"galerkin\""];

/// A model by a method; without its dampers where sub-steps go backward.
fn by(method: &str, text: &str) -> String {
    let text = text.replace(", end = 0.6 }", &format!(", end = 0.6, order = {method} }}"));
    assert!(text.contains("order"));
    if !method.contains("composition") {
        return text;
    }
    text.replace(", damper = { damping = 0.2 }", "").replace(", damping = 0.1", "")
}

/// A sensor; the number of it; what it shall be.
const SENSORS: &[(&str, &str, f64)] = &[
    ("type = \"joint_rate\", of = \"elbow\"", "s", 1.5),
    ("type = \"velocity\", of = \"lower\", point = [0.2, 0.0, 0.1]", "s.z", 0.8),
    ("type = \"velocity\", of = \"lower\", seen_from = \"upper\"", "s.x", 0.1),
    ("type = \"angular_velocity\", of = \"lower\"", "s.y", -0.5),
    ("type = \"orientation\", of = \"lower\"", "s.y", 0.4),
    ("type = \"orientation\", of = \"lower\", seen_from = \"upper\"", "s.w", 0.8),
    ("type = \"distance\", of = \"lower\", to = \"ground\", point_to = [0.4, 0.0, 0.9]", "s", 0.5),
    ("type = \"distance_rate\", of = \"lower\", to = \"ground\"", "s", 0.2),
    ("type = \"effort\", of = \"shoulder\"", "s.spring", 2.0),
    ("type = \"effort\", of = \"shoulder\"", "s.damper", 0.1),
    ("type = \"power\", of = \"shoulder\"", "s.spring", 0.5),
    ("type = \"effort\", of = \"cord\"", "s", 1.1),
    ("type = \"power\", of = \"cord\"", "s", 0.3),
    ("type = \"expression\", value = \"place.z * turn + 0.3 * t\"", "s", 0.6),
];

fn model(sensor: &str, number: &str, target: f64, at: &str, more: &str) -> String {
    let others = "{ name = \"place\", type = \"position\", of = \"lower\" }, { name = \"turn\", type = \"joint_rate\", of = \"shoulder\" }";
    format!(
        "{ARM}sensor = [{others}, {{ name = \"s\", {sensor} }}]\n\
         objective = [{{ name = \"cheap\", type = \"effort\", weight = 0.01 }}, \
         {{ name = \"near\", type = \"sensor\", sensor = \"{number}\", target = {target:?}, at = \"{at}\", weight = 3.0 }}]\n{more}"
    )
}

fn found(text: &ModelText) -> Result<FoundOptimum, OptimizeFailure> {
    let model = text.model(&[])?;
    let watch: SearchWatch = Rc::new(RefCell::new(|_: &SearchProgress| true));
    optimize((text, &[], &model), Some(&mut Pounce::default()), None, &watch)
}

/// What is left of the gradient of the run with the controls of an optimum, and how far its value
/// and the cost of the optimum are apart.
fn left_of_gradient(what: &str, text: &str) -> [f64; 2] {
    let text = ModelText::from_text(Path::new("model.toml"), text);
    let found = found(&text).unwrap_or_else(|error| panic!("{what}: {error}"));
    assert_eq!(found.report.status, SearchStatus::Optimal, "{what}: {:?}", found.report);
    let own = text.model(&[]).unwrap();
    let values = |k: usize| {
        let steps = found.controls.iter().step_by(own.controls[k].hold);
        steps.map(|row| row[k]).collect()
    };
    let values = (0..own.controls.len()).map(values).collect();
    let wanted = Wanted { values, parameters: false, ..Wanted::everything() };
    let slope = gradient(&text, &[], &own, &wanted).unwrap();
    let all = slope.controls.iter().flat_map(|own| &own.derivatives);
    let left = all.fold(0.0_f64, |most, slope| most.max(slope.abs()));
    let miss = (slope.value - found.report.cost).abs() / found.report.cost;
    println!("{what}: slope {left:.1e}, cost {} apart {miss:.1e}", found.report.cost);
    [left, miss]
}

/// An optimum without conditions has no slope: the gradient of the run with its controls vanishes,
/// and its value is the cost of the optimum.
#[test]
fn the_gradient_vanishes_at_an_optimum() {
    let (mut worst, mut apart) = (0.0_f64, 0.0_f64);
    for (sensor, number, target) in SENSORS {
        for (at, method) in ["path", "end"].into_iter().flat_map(|at| METHODS.map(|own| (at, own)))
        {
            if method.contains("composition") && number.contains("damper") {
                continue;
            }
            let what = format!("{number} of {sensor} at {at}, order {method}");
            let text = by(method, &model(sensor, number, *target, at, ""));
            let [left, miss] = left_of_gradient(&what, &text);
            (worst, apart) = (worst.max(left), apart.max(miss));
        }
    }
    println!("slope {worst:.1e}, cost apart {apart:.1e}");
    assert!(worst < 1e-7, "{worst}");
    assert!(apart < 1e-11, "{apart}");
}

/// The same of momenta along the joints at the end; of a closed loop they are refused.
#[test]
fn the_gradient_vanishes_beside_momenta() {
    let text = model(SENSORS[0].0, SENSORS[0].1, SENSORS[0].2, "path", "");
    let text = text.replace(
        "objective = [",
        "objective = [{ name = \"still\", type = \"momentum\", weight = 30.0 }, ",
    );
    let (mut worst, mut apart) = (0.0_f64, 0.0_f64);
    for method in METHODS {
        let [left, miss] =
            left_of_gradient(&format!("momenta, order {method}"), &by(method, &text));
        (worst, apart) = (worst.max(left), apart.max(miss));
    }
    println!("slope {worst:.1e}, cost apart {apart:.1e}");
    assert!(worst < 1e-9, "{worst}");
    assert!(apart < 1e-11, "{apart}");
    let loops = "body = [{ name = \"rocker\", mass = 0.4, inertia = [0.01, 0.01, 0.01], position = [0.7, 0.0, 0.3] }, ";
    let closing = "joint = [{ name = \"pivot\", type = \"revolute\", parent = \"ground\", child = \"rocker\", position = [0.6, 0.0, 0.5], axis = [0.0, 1.0, 0.0] }, \
                   { name = \"close\", type = \"revolute\", parent = \"lower\", child = \"rocker\", position = [0.8, 0.0, 0.0], axis = [0.0, 1.0, 0.0], cut = true }, ";
    let closed = text.replace("body = [", loops).replace("joint = [{", &format!("{closing}{{"));
    let closed = closed.replace("rate = 0.4, ", "");
    let closed = ModelText::from_text(Path::new("model.toml"), &closed);
    let error = found(&closed).err().map(|error| error.to_string()).unwrap_or_default();
    assert!(error.contains("objective.still.type") && error.contains("momenta along"), "{error}");
}

/// The same of a rotor that turns by more than half a turn: the sign of a quaternion is continued
/// along the motion, and a spring counts on.
#[test]
fn numbers_are_continued_beyond_half_a_turn() {
    let rotor = r#"
model = { name = "rotor", gravity = [0.0, 0.0, 0.0] }
simulation = { step = 0.02, end = 0.6 }
body = [{ name = "disc", mass = 1.0, inertia = [0.1, 0.2, 0.1], position = [0.0, 0.0, 0.0] }]
joint = [{ name = "axle", type = "revolute", parent = "ground", child = "disc", position = [0.0, 0.0, 0.0], axis = [0.0, 1.0, 0.0], rate = 8.0, spring = { stiffness = 0.02, rest = 0.0 } }]
control = [{ name = "drive", joint = "axle" }]
optimize = { guess = "run" }
"#;
    for (kind, of, number, target) in
        [("orientation", "disc", "s.w", -0.5), ("effort", "axle", "s.spring", -0.08)]
    {
        for (at, method) in ["path", "end"].into_iter().flat_map(|at| METHODS.map(|own| (at, own)))
        {
            let text = format!(
                "{rotor}sensor = [{{ name = \"s\", type = \"{kind}\", of = \"{of}\" }}]\n\
                 objective = [{{ name = \"cheap\", type = \"effort\", weight = 0.01 }}, \
                 {{ name = \"near\", type = \"sensor\", sensor = \"{number}\", target = {target:?}, at = \"{at}\" }}]\n"
            );
            let what = format!("{number} at {at}, order {method}");
            let [left, miss] = left_of_gradient(&what, &by(method, &text));
            assert!(left < 1e-9 && miss < 1e-11, "{what}: {left}, {miss}");
        }
    }
}

/// Conditions on numbers of nodes with their velocities are met by the run of the result.
#[test]
fn conditions_hold_in_the_run() {
    let more = "condition = [{ name = \"fast\", sensor = \"turn\", equals = 1.25 }, { name = \"strong\", sensor = \"s.spring\", at = \"path\", min = 2.0 }]";
    let text = model("type = \"effort\", of = \"shoulder\"", "place.x", 0.5, "end", more);
    let text = ModelText::from_text(Path::new("model.toml"), &text);
    let found = found(&text).unwrap();
    assert_eq!(found.report.status, SearchStatus::Optimal, "{:?}", found.report);
    let mut run = crate::simulation::Simulation::new(&found.model).unwrap();
    let columns: Vec<String> = run.sensors().columns().iter().map(|own| own.name()).collect();
    let place = |name: &str| columns.iter().position(|own| own == name).unwrap();
    let places = [place("turn"), place("s.spring")];
    let all: Vec<_> = run.samples().map(|own| own.unwrap().sensors).collect();
    let turn = all[all.len() - 1][places[0]];
    let least = all[1..].iter().map(|own| own[places[1]]).fold(f64::INFINITY, f64::min);
    println!("turns with {turn}, effort {least} at least: {:?}", found.report.conditions);
    assert!((turn - 1.25).abs() < 1e-9, "{turn}");
    assert!((least - 2.0).abs() < 1e-7, "the bound is active: {least}");
}

/// Controls beside what rolls are refused by the key of it.
#[test]
fn controls_beside_rolling_are_refused() {
    let text = super::tests::BALL.to_owned()
        + "control = [{ name = \"push\", body = \"ball\", force = [1.0, 0.0, 0.0] }]\n\
           objective = [{ name = \"cheap\", type = \"effort\" }]\n";
    let error = found(&ModelText::from_text(Path::new("model.toml"), &text)).err();
    let error = error.map(|error| error.to_string()).unwrap_or_default();
    println!("{error}");
    assert!(error.contains("constraint.table") && error.contains("second derivatives"), "{error}");
}

/// What no node and the step to it give is refused by its name.
#[test]
fn what_is_of_the_next_step_is_refused() {
    let time = "optimize = { time = { min = 0.3, max = 1.0 } }";
    for (sensor, number, more, words) in [
        ("type = \"reaction\", of = \"elbow\"", "s.fx", "", "the step from a node"),
        ("type = \"acceleration\", of = \"lower\"", "s.z", "", "accelerations, which controls"),
        ("type = \"joint_acceleration\", of = \"elbow\"", "s", "", "accelerations, which controls"),
        (SENSORS[13].0, "s", time, "beside a free final time"),
    ] {
        let text = model(sensor, number, 0.1, "end", more);
        let error = found(&ModelText::from_text(Path::new("model.toml"), &text)).err();
        let error = error.map(|error| error.to_string()).unwrap_or_default();
        assert!(error.contains(words), "{sensor}: {error}");
        assert!(error.contains("objective.near.sensor"), "{sensor}: {error}");
    }
}
