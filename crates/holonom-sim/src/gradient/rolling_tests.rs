//! Gradients of runs with constraints on velocities, against central differences of whole runs and
//! tangents beside them.

use super::comparison::{PATH, Worst, seen};
use super::{ModelGradient, Wanted, gradient};
use holonom_model::ModelText;
use std::path::Path;

/// Of differences, and of tangents.
const WITHIN: [f64; 2] = [1e-6, 1e-9];

/// A model of the repository, to another end, every node of it.
fn shipped(file: &str, end: f64) -> String {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let text = std::fs::read_to_string(format!("{root}/{file}")).unwrap();
    let line = |line: &str| match line.split_once("end = ") {
        Some((before, after)) => {
            let rest = after.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.');
            format!("{before}end = {end:?}{rest}")
        }
        None if line.starts_with("every =") => String::new(),
        None => line.to_owned(),
    };
    text.lines().map(line).collect::<Vec<_>>().join("\n") + "\n"
}

/// All derivatives of numbers at the end and along the path.
fn compare(text: &str, all: &[(&str, &str, &str, &[&str])]) {
    let mut worst = Worst::default();
    for at in ["", PATH] {
        worst.compare_all(text, &seen(all, at), WITHIN);
    }
}

#[test]
fn a_disc_and_a_bicycle_are_those_of_differences() {
    for (file, end, body, tyre, forces) in [
        ("examples/models/rolling_disc.toml", 0.4, "disc", "floor", &["fx", "fy", "fz"][..]),
        ("examples/models/bicycle.toml", 0.1, "frame", "front_tyre", &["fz"]),
    ] {
        let text = shipped(file, end);
        let point = "point = [0.1, 0.05, 0.02]\n";
        compare(
            &text,
            &[
                ("position", body, point, &["x", "y", "z"]),
                ("velocity", body, point, &["x", "z"]),
                ("angular_velocity", body, "", &["y"]),
                ("acceleration", body, point, &["x", "z"]),
                ("reaction", tyre, "", forces),
            ],
        );
    }
}

/// A wheel with a tyre on a tilted plane that turns; positions are closed, velocities projected.
const TURNTABLE: &str = r#"
model = { name = "turntable", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.01, end = 0.3, project_start = true }
[parameters]
tilt = 0.1
spin = 0.8
r = 0.3
tube = 0.05
lean = 0.2
up = 0.05
mass = 1.3
fast = 4.0
side = "= cos(tilt)*sin(lean)"
high = "= tube + (r - tube)*sqrt(1 - side^2)"
[[body]]
name = "wheel"
mass = "= mass"
inertia = [0.03, "= 0.045*mass", 0.035]
position = ["= high*sin(tilt)", 0.4, "= up + high*cos(tilt)"]
velocity = ["= r*fast", 0.1, 0.0]
angular_velocity = [0.2, "= fast", 0.3]
[[constraint]]
name = "table"
type = "rolling"
body = "wheel"
axis = [0.0, "= cos(lean)", "= sin(lean)"]
radius = "= r"
tube = "= tube"
plane = { normal = ["= sin(tilt)", 0.0, "= cos(tilt)"], position = [0.0, 0.0, "= up"], spin = "= spin" }
[[control]]
name = "push"
body = "wheel"
force = [1.0, 0.5, 0.0]
"#;

#[test]
fn a_wheel_on_a_tilted_turntable_is_that_of_differences() {
    compare(
        TURNTABLE,
        &[
            ("position", "wheel", "point = [0.1, 0.05, 0.02]\n", &["x", "y", "z"]),
            ("angular_velocity", "wheel", "", &["x", "y", "z"]),
            ("acceleration", "wheel", "", &["y", "z"]),
            ("reaction", "table", "", &["fy", "fz"]),
        ],
    );
}

/// Chaplygin's sleigh with drag and a control.
const SLEIGH: &str = r#"
model = { name = "sleigh" }
simulation = { step = 0.02, end = 0.6 }
parameters = { a = 0.3, u = -0.6, w = 2.0, drag = 0.4, place = 0.05, turned = 0.1, mass = 2.0 }
[[body]]
name = "plate"
mass = "= mass"
inertia = [0.1, 0.1, "= 0.09*mass"]
position = ["= a", 0.02, 0.0]
velocity = ["= u*cos(turned)", "= u*sin(turned)", 0.0]
[[joint]]
name = "ice"
type = "planar"
parent = "ground"
child = "plate"
position = [0.0, 0.0, 0.0]
axis = [0.0, 0.0, 1.0]
[[constraint]]
name = "runner"
type = "blade"
body = "plate"
position = ["= place", 0.0, 0.0]
axis = ["= -sin(turned)", "= cos(turned)", 0.0]
[[law]]
name = "drag"
joint = "ice"
freedom = 0
effort = "-drag*v"
[[law]]
name = "turn"
joint = "ice"
freedom = 2
effort = "w*cos(3*t) - drag*v^3"
[[control]]
name = "push"
body = "plate"
force = [1.0, 0.5, 0.0]
"#;

#[test]
fn a_sleigh_is_that_of_differences_with_its_start() {
    compare(
        SLEIGH,
        &[
            ("position", "plate", "point = [0.1, 0.05, 0.0]\n", &["x", "y"]),
            ("angular_velocity", "plate", "", &["z"]),
            ("acceleration", "plate", "", &["x"]),
            ("reaction", "runner", "", &["fx", "fy"]),
        ],
    );
}

/// `ż = y ẋ` with a factor and a value that read numbers and places.
const SUM: &str = r#"
model = { name = "sum", gravity = [0.0, 0.0, -1.0] }
simulation = { step = 0.01, end = 0.4, project_start = true }
parameters = { k = 1.2, b = 0.3, mass = 0.8, u = 1.1, half = 0.5 }
[[body]]
name = "ball"
mass = "= mass"
inertia = [0.02, 0.03, 0.04]
position = [0.1, 0.4, 0.2]
velocity = ["= u", 0.3, 0.2]
angular_velocity = [0.1, 0.2, 0.3]
[[constraint]]
name = "sum"
type = "velocity"
value = "b*ball.x"
terms = [
  { of = "ball", direction = [0.0, 0.0, 1.0], factor = "= half" },
  { of = "ball", direction = [1.0, 0.0, 0.0], factor = "-k*ball.y" },
]
"#;

#[test]
fn a_sum_of_rates_is_that_of_differences() {
    compare(
        SUM,
        &[("position", "ball", "", &["x", "y", "z"]), ("velocity", "ball", "", &["x", "z"])],
    );
}

/// A cart that is driven along by a value of time and place, its slide tied to it by a factor.
const FEED: &str = r#"
model = { name = "feed" }
simulation = { step = 0.02, end = 0.4, project_start = true }
parameters = { b = 0.4, c = 0.3, d = 0.5, mass = 1.5, pull = 0.7 }
[[body]]
name = "cart"
mass = 2.0
inertia = [0.1, 0.1, 0.1]
[[body]]
name = "slide"
mass = "= mass"
inertia = [0.1, 0.1, 0.1]
position = [0.0, 0.3, 0.0]
[[joint]]
name = "along"
type = "prismatic"
parent = "ground"
child = "cart"
position = [0.0, 0.0, 0.0]
axis = [1.0, 0.0, 0.0]
[[joint]]
name = "across"
type = "prismatic"
parent = "cart"
child = "slide"
position = [0.0, 0.3, 0.0]
axis = [0.0, 1.0, 0.0]
[[body]]
name = "rider"
mass = 0.4
inertia = [0.1, 0.1, 0.1]
position = [0.0, 0.3, 0.2]
[[joint]]
name = "up"
type = "prismatic"
parent = "slide"
child = "rider"
position = [0.0, 0.3, 0.2]
axis = [0.0, 0.6, 0.8]
[[law]]
name = "pull"
joint = "up"
effort = "pull*sin(3*t) - x"
[[constraint]]
name = "drive"
type = "velocity"
terms = [{ joint = "along" }]
value = "b*cos(2*t) + c*slide.y*rider.z"
[[constraint]]
name = "tie"
type = "velocity"
terms = [{ joint = "across" }, { of = "cart", direction = [1.0, 0.0, 0.0], factor = "-d - across" }]
"#;

#[test]
fn a_driven_feed_is_that_of_differences_with_its_start() {
    compare(
        FEED,
        &[("position", "rider", "", &["x", "y", "z"]), ("velocity", "rider", "", &["x", "y"])],
    );
}

/// A cart on two wheels that may be projected or not, with rates of its hubs.
fn cart(project: bool) -> String {
    let text = shipped("tests/reference/laws/p16_two_wheels.toml", 0.3);
    let text = text.replace("mass = 6.0", "mass = \"= mass\"\nvelocity = [\"= r*w\", 0.0, 0.0]");
    let text = text.replace("radius = 0.1", "radius = \"= r\"");
    let text = text.replace("0.2, 0.1]", "0.2, \"= r\"]");
    let text = text.replace("0.0, 0.07]", "0.0, \"= r - 0.03\"]");
    let text = text.replace("type = \"revolute\"", "type = \"revolute\"\nrate = \"= w\"");
    let project = format!("simulation = {{ project_start = {project}, ");
    let text = text.replace("simulation = { ", &project);
    format!("{text}\n[parameters]\nmass = 6.0\nr = 0.1\nw = 1.5\n")
}

#[test]
fn wheels_on_one_axle_leave_a_row_out() {
    for project in [false, true] {
        compare(
            &cart(project),
            &[
                ("position", "cart", "point = [0.1, 0.05, 0.0]\n", &["x", "y"]),
                ("joint_rate", "left_hub", "", &[""]),
            ],
        );
    }
}

/// Beside the wheels a keel under the axle says once more that the cart does not move across.
/// Where it turns by itself, no neighbouring cart moves: at once, or once the cart has pitched.
#[test]
fn a_keel_that_turns_opens_a_redundant_row() {
    for (axis, says) in [
        (r#"["= one - 1", 1.0, 0.0]"#, "no neighbouring mechanism closes"),
        (r#"[0.0, 1.0, "= one - 1"]"#, "of a redundant loop does not hold"),
    ] {
        let keel = "[[constraint]]\nname = \"keel\"\ntype = \"blade\"\nbody = \"cart\"";
        let keel = format!("{keel}\nposition = [0.0, 0.0, \"= r\"]\naxis = {axis}\n");
        let text = format!("{}one = 1.0\n{keel}{}", cart(true), tip("cart"));
        let source = ModelText::from_text(Path::new("model.toml"), &text);
        let model = source.model(&[]).unwrap();
        let of = |only: &str| Wanted {
            of: vec!["tip.0".to_owned()],
            only: vec![only.to_owned()],
            ..Wanted::everything()
        };
        let refused = gradient(&source, &[], &model, &of("one")).unwrap_err().to_string();
        println!("{refused}");
        assert!(refused.contains(says), "{refused}");
        gradient(&source, &[], &model, &of("mass")).unwrap();
    }
}

/// The gradient of the last place along one axis by keys, or by the step, with its comparison.
fn by(text: &str, sensor: &str, only: &[&str], step: bool) -> ModelGradient {
    let text = text.split("[[control]]").next().unwrap_or(text); // without a step slope
    let text = format!("{text}{sensor}");
    let source = ModelText::from_text(Path::new("model.toml"), &text);
    let model = source.model(&[]).unwrap();
    let only: Vec<String> = only.iter().map(|own| (*own).to_owned()).collect();
    let wanted = Wanted { only, step, of: vec!["tip.0".to_owned()], ..Wanted::everything() };
    let mut found = gradient(&source, &[], &model, &wanted).unwrap();
    found.check(&source, &[], &model, &wanted).unwrap();
    let worst = found.worst();
    println!(
        "{only:?} {:?}: {worst:.1e}, {:#?}",
        found.by_step,
        found.parameters,
        only = wanted.only
    );
    assert!(worst <= 1e-6, "{:#?}", found.checks);
    found
}

fn tip(of: &str) -> String {
    format!(
        "[[sensor]]\nname = \"tip\"\ntype = \"position\"\nof = \"{of}\"\npoint = [0.1, 0.05, 0.02]\n"
    )
}

#[test]
fn keys_of_constraints_on_velocities_are_those_of_differences() {
    let numbers = [
        ("axis = [0.0, \"= cos(lean)\", \"= sin(lean)\"]", "axis = [0.0, 0.98, 0.2]"),
        ("radius = \"= r\"", "radius = 0.3"),
        ("tube = \"= tube\"", "tube = 0.05"),
        ("normal = [\"= sin(tilt)\", 0.0, \"= cos(tilt)\"]", "normal = [0.1, 0.0, 0.99]"),
        ("position = [0.0, 0.0, \"= up\"]", "position = [0.0, 0.0, 0.05]"),
        ("spin = \"= spin\"", "spin = 0.8"),
        ("tilt = 0.1", "tilt = \"= atan(10/99)\""),
        ("lean = 0.2", "lean = \"= atan(20/98)\""),
    ];
    let replaced = |text: String, (from, to): &(&str, &str)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    };
    let numbers = numbers.iter().fold(TURNTABLE.to_owned(), replaced);
    let table =
        ["radius", "tube", "axis.0", "axis.1", "plane.normal.1", "plane.position.2", "plane.spin"];
    let table = table.map(|key| format!("constraint.table.{key}"));
    let table: Vec<&str> = table.iter().map(String::as_str).collect();
    let found = by(&numbers, &tip("wheel"), &table, true);
    assert!(found.parameters.iter().all(|own| own.derivative != 0.0), "{found:#?}");
    assert!(found.by_step.is_some_and(|by| by != 0.0));
    let found = by(SUM, &tip("ball"), &["half"], true);
    assert!(found.parameters.iter().all(|own| own.derivative != 0.0), "{found:#?}");
    let numbers =
        SLEIGH.replace("position = [\"= place\", 0.0, 0.0]", "position = [0.05, 0.01, 0.0]");
    let keys = ["constraint.runner.position.0", "constraint.runner.position.1", "mass", "drag"];
    let found = by(&numbers, &tip("plate"), &keys, false);
    assert!(found.parameters.iter().all(|own| own.derivative != 0.0), "{found:#?}");
    // three coordinates, two free rates, all compared
    let rates: Vec<bool> = found.initial.iter().map(|own| own.rate.is_some()).collect();
    assert_eq!(rates, [true, true, false]);
    let kinds = |by: &str| found.checks.iter().filter(|own| own.by == by).count();
    assert_eq!([kinds("coordinates"), kinds("rates")], [3, 3]);
}
