//! Gradients by the numbers of compliant contacts, elastic stops and smooth friction against
//! central differences of whole runs, and what is refused.

use super::comparison::{PATH, Seen, Worst, sensing};
use super::force_models::without_objectives;
use super::tests::{changed, check, found};

/// A pendulum with smooth friction that swings against an elastic stop.
const STOPPED: &str = r#"
model = { name = "stopped", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.002, end = 0.5 }
[parameters]
mass = 1.3
friction = 0.4
transition = 0.3
ratio = 1.4
velocity = 1.1
stop = 0.35
stiffness = 90.0
damping = 0.2
[[body]]
name = "arm"
position = [0.5, 0.0, 0.0]
mass = "= mass"
inertia = [0.01, 0.1, 0.1]
[[joint]]
name = "hinge"
type = "revolute"
parent = "ground"
child = "arm"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
limits = [-0.5, "= stop"]
bumper = { stiffness = "= stiffness", damping = "= damping" }
[joint.friction]
torque = "= friction"
[joint.friction.model]
type = "stribeck"
transition_velocity = "= transition"
static_ratio = "= ratio"
stribeck_velocity = "= velocity"
[[sensor]]
name = "angle"
type = "joint_coordinate"
of = "hinge"
[[objective]]
name = "swing"
type = "sensor"
sensor = "angle"
at = "path"
target = 0.1
weight = 3.0
[[objective]]
name = "last"
type = "sensor"
sensor = "angle"
target = 0.7
"#;

/// A ball that falls, bounces and slips on a plane, and another one that it touches.
const BALLS: &str = r#"
model = { name = "balls", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.0005, end = 0.2 }
[parameters]
mass = 0.7
stiffness = 4.0e4
exponent = 1.5
dissipation = 0.4
friction = 0.3
transition = 0.05
ratio = 1.2
velocity = 0.4
between = 9.0e3
gravity = -9.81
speed = 0.5
[[body]]
name = "ball"
position = [0.0, 0.0, 0.11]
velocity = ["= speed", 0.1, -0.5]
angular_velocity = [1.0, 3.0, 0.5]
mass = "= mass"
inertia = [0.003, 0.003, 0.003]
collision = [{ type = "sphere", dimensions = [0.1] }]
[[body]]
name = "other"
position = [0.21, 0.03, 0.1]
mass = 0.5
inertia = [0.002, 0.002, 0.002]
collision = [{ type = "sphere", dimensions = [0.1] }]
[[contact]]
name = "floor"
a = { plane = { position = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] } }
b = "*"
friction = "= friction"
[contact.model]
type = "hunt_crossley"
stiffness = "= stiffness"
exponent = "= exponent"
dissipation = "= dissipation"
transition_velocity = "= transition"
static_ratio = "= ratio"
stribeck_velocity = "= velocity"
[[contact]]
name = "each other"
a = "ball"
b = "other"
model = { type = "hunt_crossley", stiffness = "= between" }
[[sensor]]
name = "place"
type = "position"
of = "ball"
[[sensor]]
name = "pushed"
type = "position"
of = "other"
[[objective]]
name = "height"
type = "sensor"
sensor = "place.z"
at = "path"
target = 0.3
weight = 20.0
[[objective]]
name = "course"
type = "sensor"
sensor = "place.x"
target = -0.1
[[objective]]
name = "push"
type = "sensor"
sensor = "pushed.x"
target = 0.0
"#;

#[test]
fn friction_and_stops_change_a_pendulum() {
    check("stopped", STOPPED, 1e-7);
    let galerkin = "end = 0.5, method = \"galerkin\", order = 4";
    check("galerkin", &changed(STOPPED, &[("end = 0.5", galerkin)]), 1e-7);
    // a stated number that equals another one does not follow it
    let stated = ("velocity = \"= velocity\"\n", "velocity = 0.3\n");
    check("stated", &changed(STOPPED, &[stated, ("velocity = 1.1\n", "")]), 1e-7);
    let left_out = [
        "stribeck_velocity = \"= velocity\"\n",
        "static_ratio = \"= ratio\"\n",
        "velocity = 1.1\n",
        "ratio = 1.4\n",
    ];
    check("alone", &changed(STOPPED, &left_out.map(|line| (line, ""))), 1e-7);
}

#[test]
fn laws_of_contacts_change_balls() {
    let text = changed(BALLS, &[("-9.81] }", "\"= gravity\"] }")]);
    check("midpoint", &text, 1e-6);
    let trapezoidal = [("end = 0.2", "end = 0.2, quadrature = \"trapezoidal\"")];
    check("trapezoidal", &changed(&text, &trapezoidal), 1e-6);
}

/// The number is that of the sensor, its derivatives are those of whole runs, forward as backward.
#[test]
fn forces_and_gaps_of_contacts_agree_with_differences() {
    let text = without_objectives(&changed(BALLS, &[("end = 0.2", "end = 0.05")]));
    let all = [
        ("type = \"contact_force\"\nof = \"floor\"\n", "2", PATH),
        ("type = \"contact_force\"\nof = \"ball\"\n", "0", PATH),
        ("type = \"contact_force\"\nof = \"each other\"\n", "0", PATH),
        ("type = \"gap\"\nof = \"floor\"\n", "", PATH),
        ("type = \"gap\"\nof = \"each other\"\n", "", ""),
    ];
    let all = all.map(|(sensor, part, at)| Seen::new(sensor, part, at));
    Worst::default().compare_all(&text, &all, [1e-6, 1e-11]);
}

#[test]
fn impulses_of_contacts_are_refused_with_a_remedy() {
    let (model, end) =
        (BALLS.find("[contact.model]").unwrap(), BALLS.find("[[contact]]\nname = \"each").unwrap());
    let text = format!("{}{}", &BALLS[..model], &BALLS[end..]);
    let text = changed(&without_objectives(&text), &[("friction = \"= friction\"\n", "")]);
    let sensor = "type = \"contact_force\"\nof = \"floor\"\n";
    let error = found(&sensing(&text, sensor, "2", ""), false).unwrap_err().to_string();
    println!("{error}");
    assert!(error.contains("jump") && error.contains("seen"), "{error}");
}

#[test]
fn shapes_that_touch_and_change_are_named() {
    let text = changed(
        BALLS,
        &[("dimensions = [0.1] }]\n[[body]]", "dimensions = [\"= 0.2*speed\"] }]\n[[body]]")],
    );
    let error = found(&text, false).unwrap_err().to_string();
    println!("{error}");
    assert!(error.contains("body.ball.collision") && error.contains("a shape that touches"));
    let plane = changed(
        BALLS,
        &[(
            "position = [0.0, 0.0, 0.0], normal",
            "position = [0.0, 0.0, \"= speed - 0.5\"], normal",
        )],
    );
    let error = found(&plane, false).unwrap_err().to_string();
    println!("{error}");
    assert!(error.contains("contact.floor.a.plane"), "{error}");
}
