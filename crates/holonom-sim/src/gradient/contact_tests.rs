//! Gradients by the numbers of compliant contacts, elastic stops and smooth friction against
//! central differences of whole runs, and what is refused.

use super::comparison::{PATH, SeenNumber, Worst, sensing};
use super::force_models::without_objectives;
use super::tests::{LINKAGE, changed, check, found};

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
    let all = all.map(|(sensor, part, at)| SeenNumber::new(sensor, part, at));
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

/// Radii and places of spheres on a plane and on each other.
fn grown() -> String {
    let of_ball = "dimensions = [\"= radius\"], position = [0.0, \"= 0.05*speed\", \"= radius - 0.1\"] }]\n[[body]]";
    let of_other = "dimensions = [\"= 0.09 + 0.1*radius\"] }]\n[[contact]]";
    changed(
        BALLS,
        &[
            ("dimensions = [0.1] }]\n[[body]]", of_ball),
            ("dimensions = [0.1] }]\n[[contact]]", of_other),
            ("speed = 0.5\n", "speed = 0.5\nradius = 0.1\n"),
            ("gravity = -9.81\n", ""),
        ],
    )
}

/// Sizes and places of shapes that touch, with the force and the gap that sensors show.
#[test]
fn shapes_that_touch_have_derivatives() {
    check("balls", &grown(), 1e-6);
    let text = without_objectives(&changed(&grown(), &[("end = 0.2", "end = 0.05")]));
    let all = [
        ("type = \"contact_force\"\nof = \"floor\"\n", "2", PATH),
        ("type = \"contact_force\"\nof = \"each other\"\n", "0", PATH),
        ("type = \"gap\"\nof = \"floor\"\n", "", PATH),
        ("type = \"gap\"\nof = \"each other\"\n", "", ""),
    ];
    let all = all.map(|(sensor, part, at)| SeenNumber::new(sensor, part, at));
    Worst::default().compare_all(&text, &all, [1e-6, 1e-11]);
}

/// A box, a capsule and an ellipsoid that fall on a plane, and a ball on a box: their dimensions
/// change mass and inertia as well.
#[test]
fn boxes_capsules_and_ellipsoids_that_touch_have_derivatives() {
    let text = r#"
model = { name = "heap", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.0005, end = 0.06 }
parameters = { a = 0.3, b = 0.1, r = 0.05 }
body = [
  { name = "block", position = [0.0, 0.0, 0.09], rotation_vector = [0.3, 0.2, 0.1], velocity = [0.3, 0.0, -0.4], shape = { type = "box", dimensions = ["= a", "= a/2", "= b"], density = 600.0 } },
  { name = "pill", position = [1.0, 0.0, 0.06], rotation_vector = [1.2, 0.2, 0.0], velocity = [0.0, 0.3, -0.3], shape = { type = "capsule", dimensions = ["= r", "= a"], density = 900.0 } },
  { name = "egg", position = [2.0, 0.0, 0.07], rotation_vector = [0.4, 0.1, 0.0], velocity = [0.1, 0.0, -0.3], shape = { type = "ellipsoid", dimensions = ["= b", "= r", "= b - 0.02"], density = 700.0 } },
  { name = "ball", position = [0.02, 0.01, 0.195], velocity = [0.0, 0.1, -0.2], mass = 0.4, inertia = [0.0004, 0.0004, 0.0004], collision = [{ type = "sphere", dimensions = ["= r"] }] }]
contact = [
  { name = "floor", a = { plane = { position = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] } }, b = ["block", "pill", "egg"], friction = 0.2, model = { type = "hunt_crossley", stiffness = 2.0e4, dissipation = 0.3, transition_velocity = 0.05 } },
  { name = "lid", a = "block", b = "ball", model = { type = "hunt_crossley", stiffness = 9.0e3 } }]
sensor = [{ name = "px", type = "position", of = "block" }, { name = "py", type = "position", of = "pill" }, { name = "pz", type = "position", of = "egg" }, { name = "pw", type = "position", of = "ball" }]
objective = [{ name = "ox", type = "sensor", sensor = "px.z", at = "path", weight = 30.0 }, { name = "oy", type = "sensor", sensor = "py.z", at = "path", weight = 30.0 }, { name = "oz", type = "sensor", sensor = "pz.z", at = "path", weight = 30.0 }, { name = "ow", type = "sensor", sensor = "pw.z", at = "path", weight = 30.0 }]
"#;
    check("heap", text, 1e-6);
    let galerkin = changed(text, &[("end = 0.06", "end = 0.02, method = \"galerkin\", order = 4")]);
    check("heap, Galerkin", &galerkin, 1e-6);
}

/// A capsule on the coupler of a closed loop on a plane.
#[test]
fn shapes_of_a_closed_loop_that_touch_have_derivatives() {
    let capsule = "mass = \"= mass\"\ncollision = [{ type = \"capsule\", dimensions = [\"= 0.05*mass\", \"= 0.3*coupler\"], position = [\"= 0.1*stiffness - 0.5\", 0.0, 0.0] }]\n";
    let floor = "[[contact]]\nname = \"floor\"\na = { plane = { position = [0.0, 0.0, 0.33], normal = [0.0, 0.0, 1.0] } }\nb = \"coupler\"\nfriction = 0.2\n\
                 model = { type = \"hunt_crossley\", stiffness = 3000.0, dissipation = 0.2, transition_velocity = 0.1 }\n";
    let text = changed(
        LINKAGE,
        &[
            ("mass = \"= mass\"\n", capsule),
            ("step = 0.01", "step = 0.001"),
            ("end = 0.4", "end = 0.1"),
        ],
    );
    check("linkage", &format!("{text}{floor}"), 1e-6);
}

#[test]
fn shapes_that_touch_and_turn_are_named() {
    let turned = "dimensions = [0.1], quaternion = [1.0, 0.0, 0.0, \"= speed - 0.5\"] }]\n[[body]]";
    let text = changed(BALLS, &[("dimensions = [0.1] }]\n[[body]]", turned)]);
    let error = found(&text, false).unwrap_err().to_string();
    println!("{error}");
    assert!(error.contains("body.ball.collision.0.quaternion") && error.contains("turns a shape"));
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
