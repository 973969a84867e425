//! Parameters beside controls: the slope of the least cost, and its minimum.
#![cfg(feature = "pounce")]

use super::beside::least_cost;
use super::control_tests::{found_with as found, watch};
use super::{SearchProgress, SearchStatus, SearchWatch, optimize};
use holonom_model::{ModelText, Override};
use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;
use vi_control::Pounce;

/// The derivatives of the least cost by the free parameters of a model are the differences of the
/// least costs of models without free parameters, found apart. `fixed`: `[optimize]` of these.
fn compare(name: &str, text: &str, by: &[(&str, f64)], optimize: &str) {
    let free = |with: &str| format!("{text}\n[optimize]\n{optimize}\n{with}");
    let list = by.iter().map(|(key, value)| {
        let width = 0.5 * value.abs() + 0.5;
        format!("\"{key}\" = {{ min = {:?}, max = {:?} }}", value - width, value + width)
    });
    let with = format!("parameters = {{ {} }}", list.collect::<Vec<_>>().join(", "));
    let text = ModelText::from_text(Path::new("model.toml"), free(&with));
    let settings = text.model(&[]).unwrap().optimize.unwrap();
    let theta: Vec<f64> = settings
        .parameters
        .keys()
        .map(|own| by.iter().find(|(key, _)| key == own).map_or(f64::NAN, |own| own.1))
        .collect();
    let (cost, slopes) =
        least_cost(&text, &settings, &theta, &mut Pounce::default(), &watch()).unwrap();
    for ((key, value), slope) in settings.parameters.keys().zip(&theta).zip(&slopes) {
        let full = if key.contains('.') { key.clone() } else { format!("parameters.{key}") };
        let at = |value: f64| {
            let own = [Override::new(full.clone(), format!("{value:?}"))];
            let found = found(&free(""), &own).unwrap();
            assert!(found.report.status.is_found(), "{name} {key}: {:?}", found.report);
            found.report.cost
        };
        let step = 2e-4 * value.abs().max(0.1);
        let one = |h: f64| (at(value + h) - at(value - h)) / (2.0 * h);
        let wanted = (4.0 * one(step) - one(2.0 * step)) / 3.0;
        let size = wanted.abs().max(1e-3 * cost.abs());
        let error = (slope - wanted).abs() / size;
        println!("{name}: dV/d{key} = {slope:.12e}, differences {wanted:.12e}, {error:.1e}");
        assert!(error < 1e-6, "{name} {key}: {slope} for {wanted}");
    }
}

/// A rod on a hinge, at rest upright: its length moves its centre and its inertia.
const PENDULUM: &str = r#"
model = { name = "swing up", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.1, end = 2.0 }
parameters = { length = 1.0, mass = 1.0, angle = 2.6 }
body = [{ name = "rod", mass = "= mass", inertia = ["= mass*length^2/12", "= mass*length^2/12", 0.0004], position = [0.0, 0.0, "= -length/2"] }]
joint = [{ name = "hinge", type = "revolute", parent = "ground", child = "rod", position = [0.0, 0.0, 0.0], axis = [0.0, 1.0, 0.0], damper = { damping = 0.1 } }]
sensor = [{ name = "angle", type = "joint_coordinate", of = "hinge" }, { name = "place", type = "position", of = "rod" }, { name = "rate", type = "joint_rate", of = "hinge" }, { name = "far", type = "distance", of = "rod", to = "ground", point_to = [3.0, 0.0, 0.0] }]
control = [{ name = "torque", joint = "hinge" }]
objective = [{ name = "cheap", type = "effort" }, { name = "low", type = "sensor", sensor = "place.z", at = "path", weight = 0.3 }]
condition = [{ name = "up", sensor = "angle", equals = "= angle" }, { name = "stop", type = "rest" }]
"#;

/// By mass, geometry, gravity, dampers, and by what the end is asked to be; with methods of order 2
/// and 4.
#[test]
fn the_least_cost_of_a_tree_has_the_slope_of_its_lagrangian() {
    let by = [
        ("length", 1.0),
        ("mass", 1.0),
        ("angle", 2.6),
        ("model.gravity.2", -9.81),
        ("joint.hinge.damper.damping", 0.1),
    ];
    compare("rod", PENDULUM, &by, "refine = 0");
    let galerkin = PENDULUM.replace("step = 0.1", "step = 0.1, order = 4, method = \"galerkin\"");
    compare("rod, Galerkin", &galerkin, &by[..2], "refine = 0");
    let plain = PENDULUM.replace(", damper = { damping = 0.1 }", "");
    let composed = plain.replace("step = 0.1", "step = 0.1, order = 4, method = \"composition\"");
    compare("rod, composition", &composed, &by[..2], "refine = 0");
}

/// Momenta along the joints at the end count with the parameters that change masses and places.
#[test]
fn momenta_at_the_end_have_their_slopes() {
    let free = "{ name = \"low\", type = \"sensor\", sensor = \"place.z\", at = \"path\", weight = 0.3 }, { name = \"still\", type = \"momentum\", weight = 4.0 }";
    let text = PENDULUM.replace(
        "{ name = \"low\", type = \"sensor\", sensor = \"place.z\", at = \"path\", weight = 0.3 }",
        free,
    );
    let text = text.replace(", { name = \"stop\", type = \"rest\" }", "");
    assert!(text.contains("still") && !text.contains("stop"));
    let by = [("length", 1.0), ("mass", 1.0), ("angle", 2.6), ("joint.hinge.position.0", 0.0)];
    compare("momentum", &text, &by, "refine = 0");
    let galerkin = text.replace("step = 0.1", "step = 0.1, order = 4, method = \"galerkin\"");
    compare("momentum, Galerkin", &galerkin, &by[..2], "refine = 0");
}

/// Bounds that are active: of efforts, of the coordinate along the path, of its rate at a node, of
/// a height along the path; a free time; a distance.
#[test]
fn bounds_and_conditions_at_nodes_have_their_prices() {
    let with = |conditions: &str| {
        let text = PENDULUM.replace(
            "joint = \"hinge\" }]",
            "joint = \"hinge\", min = -9.0, max = 9.0, hold = 2 }]",
        );
        text.replace("{ name = \"stop\", type = \"rest\" }", conditions)
    };
    let by = [("length", 1.0), ("mass", 1.0)];
    let path = with(
        "{ name = \"back\", sensor = \"angle\", at = \"path\", min = -0.6 }, { name = \"wide\", sensor = \"angle\", at = \"path\", min = -3.0 }, { name = \"stop\", type = \"rest\" }",
    );
    compare("path of a coordinate", &path, &by, "refine = 0");
    let rate = with(
        "{ name = \"slow\", sensor = \"rate\", at = 1.0, equals = 0.3 }, { name = \"aside\", sensor = \"place.x\", at = \"path\", min = \"= -0.46*length\" }",
    );
    compare("rate and height", &rate, &by, "refine = 0");
    let far = with("{ name = \"near\", sensor = \"far\", at = 1.4, equals = \"= 2.7*length\" }");
    compare("distance", &far, &by, "refine = 0");
    let soon = PENDULUM.replace(
        "type = \"effort\" }",
        "type = \"effort\" }, { name = \"soon\", type = \"time\", weight = 20.0 }",
    );
    let lines = PENDULUM.replace(
        "joint = \"hinge\" }]",
        "joint = \"hinge\", shape = \"linear\", hold = 4, max = 2.5 }]",
    );
    compare("lines", &lines, &by, "refine = 0");
    compare("time", &soon, &by, "refine = 0\ntime = { min = 0.4, max = 6.0 }");
}

/// Two links with one of them at rest; the base of a cart.
#[test]
fn rest_of_single_joints_has_its_price() {
    let text = r#"
model = { name = "cart", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.1, end = 1.6 }
parameters = { length = 0.6, mass = 0.4 }
body = [{ name = "cart", mass = 1.0, inertia = [0.1, 0.1, 0.1], position = [0.0, 0.0, 0.0] }, { name = "pole", mass = "= mass", inertia = [0.01, 0.01, 0.001], position = [0.0, 0.0, "= -length"] }]
joint = [{ name = "rail", type = "prismatic", parent = "ground", child = "cart", position = [0.0, 0.0, 0.0], axis = [1.0, 0.0, 0.0] }, { name = "pin", type = "revolute", parent = "cart", child = "pole", position = [0.0, 0.0, 0.0], axis = [0.0, 1.0, 0.0], rate = 0.7 }]
sensor = [{ name = "x", type = "joint_coordinate", of = "rail" }, { name = "angle", type = "joint_coordinate", of = "pin" }]
control = [{ name = "push", joint = "rail" }]
objective = [{ name = "cheap", type = "effort" }]
condition = [{ name = "there", sensor = "x", equals = 1.0 }, { name = "swing", sensor = "angle", equals = 0.4 }, { name = "stop", type = "rest", of = ["pin"] }]
"#;
    let by =
        [("length", 0.6), ("mass", 0.4), ("joint.pin.rate", 0.7), ("joint.pin.position.0", 0.0)];
    compare("one of two", text, &by, "refine = 0");
    let all = text.replace(", of = [\"pin\"]", "");
    compare("both", &all, &by, "refine = 0");
}

/// A closed loop with redundant rows comes to rest: its links change together.
#[test]
fn a_closed_loop_comes_to_rest_at_its_price() {
    let text = r#"
model = { name = "four-bar", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.025, end = 0.5, project_start = true }
parameters = { c = 0.3, heavy = 1.6, y = -2.0 }
sensor = [{ name = "angle", type = "joint_coordinate", of = "shaft" }]
control = [{ name = "drive", joint = "shaft" }]
objective = [{ name = "cheap", type = "effort" }]
condition = [{ name = "there", sensor = "angle", equals = "= y" }, { name = "stop", type = "rest" }]
body = [
  { name = "crank", mass = 0.8, inertia = [0.0061, 0.0061, 0.0006], position = ["= 0.25*c", 0.0, "= 0.4330127018922193*c"] },
  { name = "coupler", mass = "= heavy", inertia = [0.108, 0.108, 0.01], position = [0.546556821879383, 0.0, 0.47251090512719507] },
  { name = "rocker", mass = 1.2, inertia = [0.049, 0.049, 0.005], position = [0.871556821879383, 0.0, 0.3426070945595293] }]
joint = [
  { name = "shaft", type = "revolute", parent = "ground", child = "crank", position = [0.0, 0.0, 0.0], axis = [0.0, 1.0, 0.0], rate = -6.0 },
  { name = "pin", type = "revolute", parent = "crank", child = "coupler", position = ["= 0.5*c", 0.0, "= 0.8660254037844386*c"], axis = [0.0, 1.0, 0.0] },
  { name = "pivot", type = "revolute", parent = "ground", child = "rocker", position = [0.8, 0.0, 0.0], axis = [0.0, 1.0, 0.0] },
  { name = "cut", type = "revolute", parent = "coupler", child = "rocker", position = [0.943113643758766, 0.0, 0.6852141891190586], axis = [0.0, 1.0, 0.0], cut = true }]
"#;
    compare("four-bar", text, &[("c", 0.3), ("heavy", 1.6), ("y", -2.0)], "refine = 0");
}

/// A free body that turns by torques of its own: rotation vectors, rest of all.
#[test]
fn a_free_body_has_the_slope_of_its_inertia() {
    let text = r#"
model = { name = "satellite", gravity = [0.0, 0.0, 0.0] }
simulation = { step = 0.15, end = 3.0 }
parameters = { a = 0.3 }
body = [{ name = "hub", mass = 2.0, inertia = ["= a", 0.4, 0.5], position = [0.0, 0.0, 0.0] }]
sensor = [{ name = "a", type = "position", of = "hub", point = [1.0, 0.0, 0.0] }, { name = "b", type = "position", of = "hub", point = [0.0, 1.0, 0.0] }]
control = [{ name = "x", body = "hub", torque = [1.0, 0.0, 0.0], frame = "body" }, { name = "y", body = "hub", torque = [0.0, 1.0, 0.0], frame = "body" }, { name = "z", body = "hub", torque = [0.0, 0.0, 1.0], frame = "body" }]
objective = [{ name = "cheap", type = "effort" }]
condition = [{ name = "a2", sensor = "a.y", equals = 0.87149950180988 }, { name = "a3", sensor = "a.z", equals = -0.45849381366219244 }, { name = "b3", sensor = "b.z", equals = 0.7455040170157057 }, { name = "stop", type = "rest" }]
"#;
    compare("satellite", text, &[("a", 0.3)], "refine = 0");
}

/// The length of a rod that turns up with least effort, between a heavy long and a quick short one:
/// the cost of lengths beside it is larger, and its motion is a run of its own.
#[test]
fn a_length_is_found_with_the_efforts() {
    let text = PENDULUM.replace("angle = 2.6", "angle = 1.2");
    let dear = text.replace("weight = 0.3 }", "weight = 0.3 }, { name = \"reach\", type = \"sensor\", sensor = \"place.x\", target = -0.6, weight = 300.0 }");
    let with = |free: &str| format!("{dear}\n[optimize]\n{free}");
    let own = found(
        &with(
            "parameters = { length = { min = 0.3, max = 3.0 }, mass = { min = 0.8, max = 2.0 } }",
        ),
        &[],
    );
    let own = own.unwrap();
    let [length, mass] = &own.report.parameters[..] else { panic!("two") };
    println!("{} of {length:?}, {mass:?}, {} iterations", own.report.cost, own.report.iterations);
    assert_eq!(own.report.status, SearchStatus::Optimal, "{:?}", own.report);
    assert!(mass.at_bound && (mass.value - 0.8).abs() < 1e-12);
    assert!(!length.at_bound && own.report.replay.as_ref().unwrap().deviation < 1e-8);
    let at = |value: f64| {
        let set = |name: &str, value: f64| {
            Override::new(format!("parameters.{name}"), format!("{value:?}"))
        };
        found(&with(""), &[set("length", value), set("mass", 0.8)]).unwrap().report.cost
    };
    let by = 1e-3 * length.value;
    let [before, here, after] = [-by, 0.0, by].map(|by| at(length.value + by));
    let (slope, bend) = ((after - before) / (2.0 * by), (after + before - 2.0 * here) / (by * by));
    println!("slope {slope:.1e}, bend {bend:.1e}");
    assert!((here - own.report.cost).abs() < 1e-9 * here && bend > 0.0);
    assert!(slope.abs() < 1e-5 * bend * length.value, "{slope} of {bend}");
    assert_eq!(own.steps.last().unwrap().parameters.len(), 2);
    assert!(own.iterations().lines().next().unwrap().ends_with(",length,mass"));
}

/// Where no other parameters have an optimum, nothing shows that these are the best.
#[test]
fn parameters_whose_neighbours_have_no_optimum_are_none() {
    let text = format!(
        "{PENDULUM}optimize = {{ refine = 0, parameters = {{ length = {{ min = 0.4, max = 2.0 }} }} }}"
    );
    let text = ModelText::from_text(Path::new("model.toml"), text);
    let model = text.model(&[]).unwrap();
    let mut method = super::control_tests::Slower { of: Pounce::default(), solves: 0 };
    let found = optimize((&text, &[], &model), Some(&mut method), None, &watch()).unwrap();
    let report = &found.report;
    assert_eq!((report.status, method.solves > 1), (SearchStatus::Unfinished, true), "{report:?}");
    assert!(report.missed[0].contains("the last other parameters: not finished"), "{report:?}");
    // where the parameters and the controls were is kept, and leads on
    let own = &found.kept.parameters["length"];
    let by = [Override::new("parameters.length", format!("{own:?}"))];
    let model = text.model(&by).unwrap();
    let point = found.kept.point.as_ref();
    let method = &mut Pounce::default();
    let more = optimize((&text, &by, &model), Some(method), point, &watch()).unwrap().report;
    assert_eq!(more.status, SearchStatus::Optimal);
    assert!((more.parameters[0].value - own).abs() > 0.05 && more.cost < report.cost - 1e-3);
}

/// What is infeasible with the first parameters is so; parameters that change nothing, or what a
/// search holds, are refused by name.
#[test]
fn what_has_no_least_cost_is_said() {
    let free = "\n[optimize]\nrefine = 0\nparameters = { length = { min = 0.3, max = 3.0 } }\n";
    let weak =
        PENDULUM.replace("joint = \"hinge\" }]", "joint = \"hinge\", min = -0.3, max = 0.3 }]");
    let report = found(&(weak + free), &[]).unwrap().report;
    assert_eq!(
        (report.status, report.parameters.len()),
        (SearchStatus::Infeasible, 1),
        "{report:?}"
    );
    let idle = PENDULUM.replace("mass = 1.0, angle", "mass = 1.0, idle = 2.0, angle");
    let idle = idle + &free.replace("length =", "idle =").replace("0.3", "1.0");
    let error = found(&idle, &[]).err().map(|error| error.to_string()).unwrap_or_default();
    assert!(error.contains("idle"), "{error}");
    let held =
        PENDULUM.replace("joint = \"hinge\" }]", "joint = \"hinge\", max = \"= 30*length\" }]");
    let error = found(&(held + free), &[]).err().map(|error| error.to_string()).unwrap_or_default();
    assert!(error.contains("control.torque.max") && error.contains("length"), "{error}");
    let mut seen = 0;
    let progress: SearchWatch = Rc::new(RefCell::new(move |_: &SearchProgress| {
        seen += 1;
        seen < 9
    }));
    let text = ModelText::from_text(Path::new("model.toml"), &(PENDULUM.to_owned() + free));
    let model = text.model(&[]).unwrap();
    let own =
        optimize((&text, &[], &model), Some(&mut Pounce::default()), None, &progress).unwrap();
    assert_eq!(own.report.status, SearchStatus::Stopped, "{:?}", own.report);
}
