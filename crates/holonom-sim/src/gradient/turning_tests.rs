//! Gradients of runs that begin in the relative equilibrium of a steady rotation, against central
//! differences of whole runs.

use super::tests::{changed, check, found};

/// A driven rotor with a blade and a body on an arm with a spring.
const ROTOR: &str = r#"
model = { name = "rotor", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.002, end = 0.1, start = "relaxed" }
[parameters]
speed = 9.0
radius = 0.8
line = 0.6
young = 4.0e8
mass = 0.4
stiffness = 6.0
damping = 0.05
arm = 0.3
shift = 0.1
gust = 5.0
[[body]]
name = "hub"
position = ["= shift", 0.0, 0.0]
mass = 1.5
inertia = [0.02, 0.02, 0.03]
[[joint]]
name = "mast"
type = "revolute"
parent = "ground"
child = "hub"
position = ["= shift", 0.0, 0.0]
axis = [0.0, 0.0, 1.0]
rate = "= speed"
[[constraint]]
name = "drive"
type = "motion"
joint = "mast"
path = { rate = "= speed", moves = [{ start = 0.08, end = 0.12, by = 0.2 }] }
[[beam]]
name = "blade"
points = [["= shift", 0.0, 0.0], ["= shift + radius", 0.0, 0.02]]
normal = [0.0, 0.0, 1.0]
elements = 3
section = { shape = { type = "rectangle", dimensions = [0.02, 0.04] }, material = { E = "= young", nu = 0.3, density = 1500.0 }, rhoA = "= line", damping = 0.003 }
[[joint]]
name = "root"
type = "fixed"
parent = "hub"
child = "blade.start"
position = ["= shift", 0.0, 0.0]
[[body]]
name = "ball"
position = ["= shift", "= arm", -0.1]
mass = "= mass"
inertia = [0.002, 0.001, 0.002]
[[joint]]
name = "hinge"
type = "revolute"
parent = "hub"
child = "ball"
position = ["= shift", 0.05, 0.0]
axis = [1.0, 0.0, 0.0]
spring = { stiffness = "= stiffness", rest = 0.1 }
damper = { damping = "= damping" }
[[load]]
name = "gust"
beam = "blade"
force = [0.0, 0.0, "= gust"]
history = { type = "triangle", start = 0.01, peak = 0.03, end = 0.05 }
[[sensor]]
name = "tip"
type = "position"
of = "blade.end"
[[sensor]]
name = "place"
type = "position"
of = "ball"
[[objective]]
name = "high"
type = "sensor"
sensor = "tip.z"
at = "path"
target = 0.1
weight = 30.0
[[objective]]
name = "aside"
type = "sensor"
sensor = "tip.y"
target = 0.4
[[objective]]
name = "swung"
type = "sensor"
sensor = "place.z"
at = "path"
weight = 20.0
[[objective]]
name = "ahead"
type = "sensor"
sensor = "place.x"
target = 0.2
"#;

#[test]
fn relative_equilibria_change_with_parameters() {
    check("rotor", ROTOR, 1e-7);
    let mean = [("elements = 3", "elements = 3\nelement = \"mean_directors\"")];
    check("mean directors", &changed(ROTOR, &mean), 1e-7);
}

/// A parameter that changes the velocity of one part alone leaves no neighbour that turns steadily.
#[test]
fn what_does_not_turn_as_a_whole_is_refused() {
    let driven = changed(ROTOR, &[("rate = \"= speed\", moves", "rate = 9.0, moves")]);
    let message = found(&driven, false).unwrap_err().to_string();
    println!("{message}");
    assert!(message.contains("joint.mast.rate") && message.contains("`speed`"), "{message}");
}
