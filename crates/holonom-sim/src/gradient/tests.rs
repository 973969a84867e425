//! Gradients of unlike models against central differences of whole runs, and what is refused.

#![allow(clippy::float_cmp)] // what is exactly zero

use super::{ByStart, GradientFailure, ModelGradient, Wanted, gradient};
use holonom_model::ModelText;
use std::path::Path;

pub(super) const ARM: &str = r#"
[model]
name = "arm"
gravity = [0.0, 0.0, "= -g"]
[simulation]
step = 0.01
end = 0.3
[parameters]
length = 0.8
density = 780.0
stiffness = 4.0
damping = 0.2
g = 9.81
speed = -3.0
[[body]]
name = "upper"
position = ["= length/2", 0.0, 0.0]
shape = { type = "box", dimensions = ["= length", 0.04, 0.04], density = "= density" }
[[body]]
name = "lower"
position = ["= 1.5*length", 0.0, 0.0]
shape = { type = "box", dimensions = ["= length", 0.03, 0.03], density = "= density" }
[[joint]]
name = "shoulder"
type = "revolute"
parent = "ground"
child = "upper"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
rate = "= speed"
spring = { stiffness = "= stiffness", rest = 0.2 }
damper = { damping = "= damping" }
[[joint]]
name = "elbow"
type = "cylindrical"
parent = "upper"
child = "lower"
position = ["= length", 0.0, 0.0]
axis = [0.1, 1.0, 0.2]
spring = { freedom = 0, stiffness = 90.0 }
[[control]]
name = "drive"
joint = "elbow"
freedom = 1
hold = 4
shape = "linear"
[[control]]
name = "push"
joint = "elbow"
hold = 3
[[sensor]]
name = "tip"
type = "position"
of = "lower"
point = [0.4, 0.0, 0.1]
[[sensor]]
name = "angle"
type = "joint_coordinate"
of = "shoulder"
[[objective]]
name = "height"
type = "sensor"
sensor = "tip.z"
target = 1.5
[[objective]]
name = "course"
type = "sensor"
sensor = "angle"
at = "path"
target = -0.4
weight = 3.0
[[objective]]
name = "worked"
type = "work"
controls = ["drive"]
weight = 0.3
"#;

/// A four-bar linkage: three redundant rows, a length that opens it, a projected start.
pub(super) const LINKAGE: &str = r#"
[model]
name = "linkage"
gravity = [0.0, 0.0, -9.81]
[simulation]
step = 0.01
end = 0.4
project_start = true
[parameters]
coupler = 0.9
ground = 0.8
mass = 1.6
stiffness = 5.0
[[body]]
name = "crank"
position = [0.075, 0.0, 0.12990381056766578]
rotation_vector = [0.0, -1.0471975511965976, 0.0]
mass = 0.8
inertia = [0.0002, 0.0061, 0.00615]
[[body]]
name = "coupler"
position = [0.546556821879383, 0.0, 0.47251090512719507]
rotation_vector = [0.0, -0.4923447, 0.0]
mass = "= mass"
inertia = [0.0004, 0.108, 0.1083]
[[body]]
name = "rocker"
position = [0.871556821879383, 0.0, 0.3426070945595293]
rotation_vector = [0.0, -1.3648990, 0.0]
mass = 1.2
inertia = [0.0003, 0.049, 0.0492]
[[joint]]
name = "shaft"
type = "revolute"
parent = "ground"
child = "crank"
anchor_parent = [0.0, 0.0, 0.0]
anchor_child = [-0.15, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
rate = 3.0
[[joint]]
name = "pin"
type = "revolute"
parent = "crank"
child = "coupler"
anchor_parent = [0.15, 0.0, 0.0]
anchor_child = ["= -coupler/2", 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
damper = { damping = 0.05 }
[[joint]]
name = "pivot"
type = "revolute"
parent = "ground"
child = "rocker"
anchor_parent = ["= ground", 0.0, 0.0]
anchor_child = [-0.35, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
spring = { stiffness = "= stiffness", rest = 0.1 }
[[joint]]
name = "cut"
type = "revolute"
parent = "coupler"
child = "rocker"
anchor_parent = ["= coupler/2", 0.0, 0.0]
anchor_child = [0.35, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
cut = true
[[control]]
name = "motor"
joint = "shaft"
[[sensor]]
name = "point"
type = "position"
of = "coupler"
point = [0.1, 0.0, 0.2]
[[objective]]
name = "course"
type = "sensor"
sensor = "point.z"
at = "path"
target = 0.5
weight = 3.0
"#;

/// A free body and a particle on a bar, tied by a spring; frames that move with a parameter.
pub(super) const FLYING: &str = r#"
[model]
name = "flying"
gravity = [0.0, 0.0, -9.81]
[simulation]
step = 0.01
end = 0.4
order = 4
[parameters]
place = 0.4
turn = 0.5
spin = 2.0
length = 0.7
stiffness = 12.0
force = 2.0
[[frame]]
name = "tower"
position = [0.0, "= place", 1.0]
rotation_vector = [0.0, "= turn", 0.2]
[[body]]
name = "box"
relative_to = "tower"
position = [0.1, 0.2, "= 0.5*place"]
velocity = [0.3, 0.0, "= spin"]
body_angular_velocity = ["= spin", 0.5, -1.0]
mass = 1.3
inertia = [[0.3, "= 0.02*turn", 0.0], ["= 0.02*turn", 0.2, 0.01], [0.0, 0.01, 0.4]]
[[particle]]
name = "bob"
mass = 0.4
position = [0.0, 0.0, "= -length"]
velocity = ["= 0.2*spin", 0.0, 0.0]
[[bar]]
name = "string"
from = "ground"
to = "bob"
point = [0.0, 0.0, 0.0]
length = "= length"
[[spring]]
name = "tie"
from = "box"
to = "bob"
point_from = [0.1, "= 0.2*place", 0.0]
stiffness = "= stiffness"
damping = 0.0
[[load]]
name = "thrust"
body = "box"
force = ["= force", 0.0, 0.1]
point = [0.0, 0.1, 0.0]
frame = "body"
[[sensor]]
name = "apart"
type = "distance"
of = "box"
to = "bob"
[[objective]]
name = "near"
type = "sensor"
sensor = "apart"
target = 0.3
"#;

pub(super) fn found(text: &str, check: bool) -> Result<ModelGradient, GradientFailure> {
    let text = ModelText::from_text(Path::new("model.toml"), text);
    let model = text.model(&[])?;
    let wanted = Wanted::everything();
    let mut found = gradient(&text, &[], &model, &wanted)?;
    if check {
        found.check(&text, &[], &model, &wanted)?;
    }
    Ok(found)
}

/// A model with other words in the place of some.
pub(super) fn changed(text: &str, pairs: &[(&str, &str)]) -> String {
    pairs.iter().fold(text.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    })
}

/// How far a gradient is from differences.
pub(super) fn check(what: &str, text: &str, allowed: f64) {
    let found = found(text, true).unwrap_or_else(|error| panic!("{what}: {error}"));
    for own in &found.checks {
        println!("{what}: {} {}: {} {:.1e}", own.by, own.direction, own.derivative, own.relative);
    }
    for own in &found.parameters {
        println!("{what}: {} {}", own.name, own.derivative);
    }
    let worst = found.worst();
    assert!(worst < allowed, "{what}: {worst:.1e}");
    assert!(found.checks.len() >= 3);
    assert!(found.parameters.iter().all(|own| own.derivative != 0.0), "{:?}", found.parameters);
}

/// Wrenches on what flies: fixed in space and turning with the body, at a point, in the axes of a
/// frame that moves with a parameter, on a particle.
pub(super) const WRENCHES: &str = r#"
[[control]]
name = "jet"
body = "box"
force = [1.0, "= 0.3*force", 0.2]
torque = [0.1, 0.0, "= 0.1*force"]
point = [0.1, "= 0.2*place", 0.0]
frame = "body"
hold = 5
[[control]]
name = "push"
body = "box"
force = [0.0, 1.0, 0.3]
torque = [0.2, 0.1, 0.0]
relative_to = "tower"
hold = 10
shape = "linear"
[[control]]
name = "pull"
body = "bob"
force = [0.4, 1.0, 0.0]
hold = 20
"#;

#[test]
fn wrenches_agree_with_differences_of_runs() {
    let text = FLYING.to_owned() + WRENCHES;
    let source = ModelText::from_text(Path::new("model.toml"), &text);
    let model = source.model(&[]).unwrap();
    let lists = [8, 5, 2].map(|count| (0..count).map(|k| 0.5 - 0.3 * f64::from(k)).collect());
    for values in [Vec::new(), lists.to_vec()] {
        let wanted = Wanted { values, ..Wanted::everything() };
        let mut found = gradient(&source, &[], &model, &wanted).unwrap();
        found.check(&source, &[], &model, &wanted).unwrap();
        println!("wrenches: apart by {:.1e}", found.worst());
        assert!(found.worst() < 1e-8, "{:?}", found.checks);
        let counts: Vec<usize> = found.controls.iter().map(|own| own.derivatives.len()).collect();
        assert_eq!(counts, [8, 5, 2]);
        let all = found.controls.iter().flat_map(|own| &own.derivatives);
        assert!(all.clone().all(|x| x.abs() > 1e-6), "{:?}", found.controls);
    }
    let moved = text.replace("force = [0.4, 1.0, 0.0]", "force = [0.4, \"= place\", 0.0]");
    let worked = text.clone() + "[[objective]]\nname = \"work\"\ntype = \"work\"\n";
    for (text, wanted) in [(moved, "enters `control.pull.force"), (worked, "a wrench on a body")] {
        let message = found(&text, false).unwrap_err().to_string();
        assert!(message.contains(wanted), "{message}");
    }
}

#[test]
fn gradients_agree_with_differences_of_runs() {
    for text in [ARM, LINKAGE, FLYING] {
        let found = found(text, true).unwrap();
        for own in &found.checks {
            println!(
                "{} {} {}: {} {} {:.1e}",
                found.model, own.by, own.direction, own.derivative, own.difference, own.relative
            );
        }
        assert!(found.worst() < 1e-8, "{}: {:?}", found.model, found.checks);
        assert!(found.checks.len() >= 3 && found.warning().is_none());
        assert!(found.parameters.iter().all(|own| own.derivative != 0.0), "{:?}", found.parameters);
    }
}

/// What objectives read depends on parameters: a point, the axis of a joint whose angle counts, the
/// anchors of a length, both points of a distance; with efforts that do work.
#[test]
fn quantities_that_depend_on_parameters_agree_with_differences() {
    let point =
        ARM.replace("point = [0.4, 0.0, 0.1]", "point = [\"= length/2\", 0.0, \"= 0.1*g\"]");
    let axis = ARM.replace("axis = [0.0, 1.0, 0.0]", "axis = [0.0, 1.0, \"= 0.1*length\"]");
    let slide = ARM.replace("of = \"shoulder\"\n", "of = \"elbow\"\n");
    let slide = slide.replace("axis = [0.1, 1.0, 0.2]", "axis = [\"= 0.1*length\", 1.0, 0.2]");
    let apart = FLYING.replace(
        "type = \"distance\"\nof = \"box\"\nto = \"bob\"",
        "type = \"distance\"\nof = \"box\"\nto = \"ground\"\npoint = [0.1, \"= 0.2*place\", 0.0]\npoint_to = [\"= -length\", 0.3, 0.2]",
    );
    for (text, from) in [(&point, ARM), (&axis, ARM), (&slide, ARM), (&apart, FLYING)] {
        assert_ne!(text, from);
        let text = ModelText::from_text(Path::new("model.toml"), text);
        let model = text.model(&[]).unwrap();
        let values =
            vec![vec![0.7, -1.3, 2.1, 0.4, 0.2, 1.0, -0.3, 0.8, 0.5]; model.controls.len()];
        let wanted = Wanted { values, ..Wanted::everything() };
        let mut found = gradient(&text, &[], &model, &wanted).unwrap();
        found.check(&text, &[], &model, &wanted).unwrap();
        assert!(found.worst() < 1e-8, "{}: {:?}", found.model, found.checks);
    }
}

/// Rates at the end and along the path: of a point and of a joint that parameters move, the angular
/// velocity of the coupler of a redundant loop, the rate of a distance with sub-steps.
#[test]
fn rates_agree_with_differences() {
    let point = ARM.replace("type = \"position\"", "type = \"velocity\"");
    let point = point.replace("point = [0.4, 0.0, 0.1]", "point = [\"= length/2\", 0.0, 0.1]");
    let turned = ARM.replace("at = \"path\"\n", "").replace("of = \"shoulder\"", "of = \"elbow\"");
    let turned = turned.replace("sensor = \"angle\"", "sensor = \"angle.1\"");
    let turned = turned.replace("type = \"joint_coordinate\"", "type = \"joint_rate\"");
    let turned = turned.replace("axis = [0.1, 1.0, 0.2]", "axis = [\"= 0.1*length\", 1.0, 0.2]");
    let spin = LINKAGE.replace(
        "type = \"position\"\nof = \"coupler\"\npoint = [0.1, 0.0, 0.2]",
        "type = \"angular_velocity\"\nof = \"coupler\"",
    );
    let spin = spin.replace("sensor = \"point.z\"\nat = \"path\"", "sensor = \"point.y\"");
    let apart = FLYING.replace(
        "type = \"distance\"\nof = \"box\"",
        "type = \"distance_rate\"\nof = \"box\"\npoint = [0.1, \"= 0.2*place\", 0.0]",
    );
    // as another body sees it: a velocity of a point that a parameter moves, an angular velocity
    let seen = point.replace("of = \"lower\"\n", "of = \"lower\"\nseen_from = \"upper\"\n");
    let relative =
        spin.replace("of = \"coupler\"\n[[obj", "of = \"coupler\"\nseen_from = \"crank\"\n[[obj");
    let place = ARM.replace(
        "point = [0.4, 0.0, 0.1]",
        "point = [\"= length/2\", 0.0, 0.1]\nseen_from = \"upper\"",
    );
    let texts = [(&point, ARM), (&turned, ARM), (&spin, LINKAGE), (&apart, FLYING)];
    let by_others = [(&seen, ARM), (&relative, &spin), (&place, ARM)];
    for (text, from) in texts.into_iter().chain(by_others) {
        assert_ne!(text, from);
        let along = text.replace("at = \"path\"\n", "");
        let along = along.replace("type = \"sensor\"\n", "type = \"sensor\"\nat = \"path\"\n");
        let one = ["order", "memory", "signal"].iter().all(|word| !text.contains(word));
        let steps = "[simulation]\nmethod = \"galerkin\"\norder = 4\n";
        let galerkin = one.then(|| along.replace("[simulation]\n", steps));
        for text in [text, &along].into_iter().chain(&galerkin) {
            let found = found(text, true).unwrap();
            assert!(!found.checks.is_empty());
            println!("{}: off by {:.1e}", found.model, found.worst());
            assert!(found.worst() < 1e-8, "{}: {:?}", found.model, found.checks);
            assert!(found.parameters.iter().all(|own| own.derivative != 0.0));
        }
    }
}

/// A controller whose filter begins with what it reads.
pub(super) const CONTROLLED: &str = r#"
model = { name = "controlled", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.005, end = 0.2 }
body = [{ name = "arm", mass = 2.0, inertia = [0.02, 0.15, 0.15], position = [0.4, 0.0, 0.0] }]
sensor = [{ name = "angle", type = "joint_coordinate", of = "shoulder" }]
objective = [{ name = "near", type = "sensor", sensor = "angle", target = 0.3, at = "path" }]
[parameters]
speed = 0.4
[[joint]]
name = "shoulder"
type = "revolute"
parent = "ground"
child = "arm"
position = [0.0, 0.0, 0.0]
axis = [0.0, -1.0, 0.0]
rate = "= speed"
[[signal]]
name = "demand"
pid = { of = "0.8*t - shoulder - 0.2*shoulder.rate", proportional = 60.0, integral = 80.0, derivative = 9.0, filter = 0.01 }
[[signal]]
name = "torque"
filter = { of = "demand", time_constant = 0.02 }
[[law]]
name = "motor"
joint = "shoulder"
effort = "torque - 0.05*v"
"#;

/// A frame that is turned by a parameter about an axis with two components of the same size.
pub(super) const TURNED: &str = r#"
model = { name = "turned", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.01, end = 0.2 }
parameters = { start = 0.4, length = 0.7 }
objective = [{ name = "low", type = "sensor", sensor = "tip.z", target = 0.3 }]
condition = [{ name = "end", sensor = "tip.z", equals = "= 0.2 - start" }]
[[frame]]
name = "place"
position = [0.0, 0.0, 0.2]
euler = { sequence = "y", angles = ["= start"] }
[[body]]
name = "rod"
relative_to = "place"
mass = 1.0
inertia = [0.01, 0.02, 0.02]
position = ["= length/2", 0.1, 0.0]
picture = [{ type = "box", dimensions = ["= length", 0.1, 0.1] }]
[[joint]]
name = "hinge"
type = "revolute"
parent = "ground"
child = "rod"
relative_to = "place"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
[[sensor]]
name = "tip"
type = "position"
of = "rod"
point = ["= length/2", 0.0, 0.0]
[[sensor]]
name = "idle"
type = "acceleration"
of = "rod"
point = ["= length", 0.0, 0.0]
"#;

/// Velocities of bodies, none of joints; a joint that has no coordinates.
const THROWN: &str = r#"
model = { name = "thrown", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.01, end = 0.2 }
objective = [{ name = "deep", type = "sensor", sensor = "tip.z", target = 0.3 }]
sensor = [{ name = "tip", type = "position", of = "low", point = [0.3, 0.1, 0.0] }]
[[body]]
name = "high"
mass = 1.0
inertia = [0.02, 0.03, 0.02]
position = [0.0, 0.0, 0.5]
velocity = [-0.4, 0.0, 0.0]
angular_velocity = [0.0, -0.8, 0.0]
[[body]]
name = "low"
mass = 1.0
inertia = [0.02, 0.03, 0.02]
position = [0.0, 0.0, 1.5]
velocity = [-1.2, 0.0, 0.0]
angular_velocity = [0.0, -0.8, 0.0]
[[joint]]
name = "hinge"
type = "revolute"
parent = "ground"
child = "high"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
[[joint]]
name = "ball"
type = "spherical"
parent = "high"
child = "low"
position = [0.0, 0.0, 1.0]
"#;

#[test]
fn starts_of_unlike_models_agree_with_differences() {
    let ball = "\ntype = \"spherical\"";
    let hinge = "\ntype = \"revolute\"\naxis = [0.1, 1.0, 0.3]";
    let thrown = THROWN.replace(ball, hinge);
    assert_ne!(thrown, THROWN);
    for (text, initial) in [(CONTROLLED, 1), (TURNED, 1), (&thrown, 2)] {
        let found = found(text, true).unwrap();
        assert!(found.worst() < 1e-8, "{}: {:?}", found.model, found.checks);
        assert_eq!(found.initial.len(), initial);
        assert!(found.checks.iter().any(|own| own.by == "rates"), "{}", found.model);
    }
    // the start of a ball joint is none that a run could be given
    let found = found(THROWN, true).unwrap();
    assert_eq!((found.initial.len(), found.checks.len()), (4, 0));
}

/// A defect of a hundred thousandth is seen, rounding is not: of a number that nothing reads, of
/// one beside a large cost.
#[test]
fn a_check_sees_a_defect_and_no_rounding() {
    let text = ModelText::from_text(Path::new("model.toml"), TURNED);
    let model = text.model(&[]).unwrap();
    let wanted = Wanted { only: vec!["length".into()], ..Wanted::everything() };
    let mut found = gradient(&text, &[], &model, &wanted).unwrap();
    assert_eq!(found.parameters.len(), 1);
    let defects: [fn(&mut ModelGradient); 2] = [
        |own| own.parameters[0].derivative *= 1.0 + 1e-5,
        |own| own.initial[0].coordinate *= 1.0 - 1e-5,
    ];
    for defect in defects {
        let mut wrong = found.clone();
        defect(&mut wrong);
        wrong.check(&text, &[], &model, &wanted).unwrap();
        assert!(wrong.worst() > 3e-6, "{:?}", wrong.checks);
    }
    found.check(&text, &[], &model, &wanted).unwrap();
    assert!(found.worst() < 1e-8);
    let unknown = Wanted { only: vec!["lenght".into()], ..Wanted::everything() };
    let error = gradient(&text, &[], &model, &unknown).unwrap_err().to_string();
    assert!(error.contains("no number under"), "{error}");
    // across the plane of the motion, beside a large cost
    let flat = TURNED.replace("tip.z", "tip.y").replace("target = 0.3", "target = 900.0");
    let flat = self::found(&flat, true).unwrap();
    assert_eq!(flat.worst(), 0.0, "{:?}", flat.checks);
}

#[test]
fn the_independent_coordinate_of_a_linkage_is_the_one_with_a_rate() {
    let found = found(LINKAGE, false).unwrap();
    let names: Vec<&str> = found.initial.iter().map(|own: &ByStart| own.name.as_str()).collect();
    assert_eq!(names, ["shaft"]);
    assert_eq!(found.controls[0].derivatives.len(), 40);
}

#[test]
fn what_has_no_derivative_is_refused_by_its_key() {
    let refused = |text: &str, from: &str, to: &str| {
        let changed = text.replace(from, to);
        assert_ne!(changed, text, "{from}");
        let error = found(&changed, false).expect_err(to);
        error.to_string()
    };
    let at_rest = LINKAGE.replace("rate = 3.0\n", "");
    let cases = [
        (ARM, "step = 0.01", "step = 0.01\nscheme = \"em-nodal\"", "simulation.scheme"),
        (ARM, "sensor = \"tip.z\"", "sensor = \"tip\"", "several numbers"),
        (ARM, "sensor = \"angle\"", "sensor = \"angle.1\"", "no coordinate"),
        (
            ARM,
            "[[control]]\nname = \"push\"",
            "[[law]]\nname = \"soft\"\njoint = \"shoulder\"\neffort = \"-floor(length*x)\"\n\
             [[control]]\nname = \"push\"",
            "there is no slope",
        ),
        (
            LINKAGE,
            "axis = [0.0, 1.0, 0.0]\ndamper",
            "axis = [\"= coupler - 0.9\", 1.0, 0.0]\ndamper",
            "no neighbouring mechanism closes",
        ),
        (
            // drawn with seven digits, at rest
            LINKAGE,
            "axis = [0.0, 1.0, 0.0]\nrate = 3.0",
            "axis = [0.0, 1.0, \"= ground - 0.8\"]",
            "the derivative of a projected start",
        ),
        (
            &at_rest,
            "project_start = true",
            "start_tolerance = 1e-4",
            "the initial positions do not",
        ),
    ];
    for (text, from, to, what) in cases {
        let message = refused(text, from, to);
        assert!(message.contains(what), "{what}: {message}");
    }
}

/// A double pendulum released from the horizontal.
#[test]
fn meaningless_derivatives_are_named_with_their_time() {
    let chaotic = ARM
        .replace("end = 0.3", "end = 27.0")
        .replace("damper = { damping = \"= damping\" }\n", "")
        .replace("damping = 0.2\n", "")
        .replace("spring = { stiffness = \"= stiffness\", rest = 0.2 }\n", "")
        .replace("stiffness = 4.0\n", "")
        .replace(
            "axis = [0.1, 1.0, 0.2]\nspring = { freedom = 0, stiffness = 90.0 }",
            "axis = [0.0, 1.0, 0.0]",
        )
        .replace("type = \"cylindrical\"", "type = \"revolute\"")
        .replace("freedom = 1\n", "")
        .replace("speed = -3.0", "speed = 1.0");
    let chaotic =
        chaotic.replace("[[control]]\nname = \"push\"\njoint = \"elbow\"\nhold = 3\n", "");
    let found = found(&chaotic, false).unwrap();
    let warning = found.warning().unwrap_or_default();
    assert!(warning.contains("from t = "), "{:?}: {warning}", found.growth);
}

/// A rotor that turns over, seen by a sensor that nothing else reads: revolutions count.
#[test]
fn angles_of_sensors_count_their_revolutions() {
    let text = r#"
        [model]
        name = "rotor"
        gravity = [0.0, 0.0, -9.81]
        [simulation]
        step = 0.01
        end = 1.0
        [parameters]
        speed = 21.0
        offset = 0.1
        [[body]]
        name = "rotor"
        position = ["= offset", 0.0, 0.0]
        mass = 1.0
        inertia = [0.01, 0.02, 0.02]
        [[joint]]
        name = "shaft"
        type = "revolute"
        parent = "ground"
        child = "rotor"
        position = [0.0, 0.0, 0.0]
        axis = [0.0, 1.0, 0.0]
        rate = "= speed"
        [[sensor]]
        name = "angle"
        type = "joint_coordinate"
        of = "shaft"
        [[objective]]
        name = "turns"
        type = "sensor"
        sensor = "angle"
        target = 0.0
        "#;
    // the same by an expression of the joint, whose angle no sensor shows
    let expressed = text
        .replace("type = \"joint_coordinate\"", "type = \"expression\"")
        .replace("of = \"shaft\"\n", "value = \"shaft\"\n");
    let along = expressed.replace("target = 0.0", "target = 0.0\nat = \"path\"");
    for (text, at_end) in [(text, true), (&expressed, true), (&along, false)] {
        let source = ModelText::from_text(Path::new("model.toml"), text);
        let model = source.model(&[]).unwrap();
        let mut run = crate::simulation::Simulation::new(&model).unwrap();
        let mut squares = Vec::new();
        for _ in 0..model.settings.steps() {
            run.step_on().unwrap();
            squares.push(0.5 * run.observe().unwrap().sensors[0].powi(2));
        }
        let last = squares[squares.len() - 1];
        let wanted = if at_end { last } else { 0.01 * (squares.iter().sum::<f64>() - 0.5 * last) };
        let mut found = gradient(&source, &[], &model, &Wanted::everything()).unwrap();
        found.check(&source, &[], &model, &Wanted::everything()).unwrap();
        assert!(!found.checks.is_empty() && found.worst() < 1e-8, "{:?}", found.checks);
        println!("angle {} rad, J {} for {wanted}", (2.0 * last).sqrt(), found.value);
        assert!((2.0 * last).sqrt() > 3.0 * std::f64::consts::PI);
        assert!((found.value - wanted).abs() < 1e-10 * found.value);
    }
}

/// Sensors that are expressions, at the end and along the path: of parameters, time, a joint, its
/// rate, a body, a point that a parameter moves, what other sensors show.
#[test]
fn expressions_of_sensors_agree_with_differences() {
    let sensor =
        "[[sensor]]\nname = \"felt\"\ntype = \"expression\"\nvalue = \"VALUE\"\n[[objective]]";
    let values = [
        "stiffness*(angle - 0.2)^2 + damping*shoulder.rate*tip.z",
        "speed*t*upper.wy + exp(-length*lower.x) + g*density/7800*lower.vz",
        "sqrt(1 + tip.x^2)/length",
    ];
    for value in values {
        for at in ["", "at = \"path\"\n"] {
            let text = ARM
                .replace("point = [0.4, 0.0, 0.1]", "point = [\"= length/2\", 0.0, 0.1]")
                .replacen("[[objective]]", &sensor.replace("VALUE", value), 1)
                .replace("sensor = \"tip.z\"\n", &format!("sensor = \"felt\"\n{at}"));
            let found = found(&text, true).unwrap();
            println!("{value} {at}: off by {:.1e}", found.worst());
            assert!(!found.checks.is_empty() && found.worst() < 1e-8, "{:?}", found.checks);
            assert!(found.parameters.iter().all(|own| own.derivative != 0.0), "{found:?}");
        }
    }
    let refused = |value: &str| {
        let text = ARM
            .replacen("[[objective]]", &sensor.replace("VALUE", value), 1)
            .replace("sensor = \"tip.z\"\n", "sensor = \"felt\"\n");
        found(&text, false).expect_err(value).to_string()
    };
    let jumps = refused("floor(length*angle)");
    assert!(jumps.contains("floor(") && jumps.contains("sensor.felt.value"), "{jumps}");
}

/// Pendulums with a rate, with a velocity of its own, and one on the other with a velocity of its
/// own.
#[test]
fn velocities_of_bodies_count_beside_rates_of_joints() {
    let text = ARM.replace("parent = \"upper\"", "parent = \"ground\"").replace(
        "name = \"lower\"\nposition",
        "name = \"lower\"\nvelocity = [\"= 0.2*speed\", \"= 2*speed\", \"= 0.4*speed\"]\nposition",
    );
    let text = changed(&text, &[("[0.1, 1.0, 0.2]", "[0.2, 2.0, 0.4]")]);
    check("beside", &text, 1e-8);
    let tip = "name = \"lower\"\nvelocity = [0.0, 0.0, \"= -1.6*speed\"]\nangular_velocity = [0.0, \"= 1.5*speed\", 0.0]\nposition";
    let text = changed(
        ARM,
        &[
            ("name = \"lower\"\nposition", tip),
            ("[0.1, 1.0, 0.2]", "[0.0, 1.0, 0.0]"),
            (
                "velocity = [0.0, 0.0, \"= -1.6*speed\"]",
                "velocity = [0.0, 0.0, \"= -speed*length*1.75\"]",
            ),
        ],
    );
    check("upon each other", &text, 1e-8);
}

/// Lengths of springs, laws and distance constraints between points that parameters move.
#[test]
fn lengths_of_elements_agree_with_differences() {
    let elements = "[[spring]]\nname = \"cord\"\nfrom = \"ground\"\nto = \"lower\"\npoint_from = [0.2, \"= 0.3*length\", 1.0]\npoint_to = [\"= 0.4*length\", 0.0, 0.1]\nstiffness = \"= stiffness\"\n[[law]]\nname = \"tie\"\nfrom = \"upper\"\nto = \"ground\"\npoint_from = [0.1, 0.0, 0.2]\npoint_to = [0.5, 0.2, 1.0]\ntension = \"3*(x - 0.4) + 0.1*v\"\n";
    for (kind, of) in
        [("length", "cord"), ("length_rate", "cord"), ("distance", "tie"), ("distance_rate", "tie")]
    {
        let sensor =
            format!("{elements}[[sensor]]\nname = \"long\"\ntype = \"{kind}\"\nof = \"{of}\"\n");
        for at in ["end", "path"] {
            let counted = format!(
                "[[objective]]\nname = \"near\"\ntype = \"sensor\"\nsensor = \"long\"\ntarget = 0.7\nat = \"{at}\"\n"
            );
            check(&format!("{kind} of {of} {at}"), &format!("{ARM}{sensor}{counted}"), 1e-8);
        }
    }
}

/// Numbers of sensors themselves, at the end and along the path.
#[test]
fn values_of_sensors_agree_with_differences() {
    let more = "[[sensor]]\nname = \"turn\"\ntype = \"angular_velocity\"\nof = \"lower\"\n[[sensor]]\nname = \"hold\"\ntype = \"reaction\"\nof = \"shoulder\"\n";
    for sensor in ["tip.z", "angle", "turn.y", "hold.fx"] {
        for at in ["end", "path"] {
            let counted = format!(
                "[[objective]]\nname = \"itself\"\ntype = \"value\"\nsensor = \"{sensor}\"\nat = \"{at}\"\nweight = -2.0\n"
            );
            check(&format!("{sensor} {at}"), &format!("{ARM}{more}{counted}"), 1e-8);
        }
    }
}

/// What is asked for by names that the model has no objectives or parameters of.
fn asked(text: &str, of: &[&str], only: &[&str], step: bool) -> ModelGradient {
    let text = ModelText::from_text(Path::new("model.toml"), text);
    let model = text.model(&[]).unwrap();
    let list = |all: &[&str]| all.iter().map(|own| (*own).to_owned()).collect();
    let values = vec![vec![0.5, -0.3, 0.2, 0.7]; model.controls.len()];
    let (of, only) = (list(of), list(only));
    let wanted = Wanted { of, only, step, values, ..Wanted::everything() };
    let mut found = gradient(&text, &[], &model, &wanted).unwrap();
    found.check(&text, &[], &model, &wanted).unwrap();
    for own in &found.checks {
        println!("{} {}: {} {:.1e}", own.by, own.direction, own.derivative, own.relative);
    }
    assert!(found.worst() < 1e-8, "{:.1e}", found.worst());
    found
}

/// `½ (y − target)²` has the derivatives `(y − target) ∂y`, by parameters and by numbers of the
/// file.
#[test]
fn sensors_and_numbers_of_the_file_are_named() {
    let square = asked(ARM, &["height"], &["speed", "joint.shoulder.spring.rest"], false);
    let own = asked(ARM, &["tip.z"], &["speed", "joint.shoulder.spring.rest"], false);
    let e = own.value - 1.5;
    for (square, own) in square.parameters.iter().zip(&own.parameters) {
        let apart = (square.derivative / (e * own.derivative) - 1.0).abs();
        println!("{}: {} {apart:.1e}", own.name, own.derivative);
        assert!(apart < 1e-12, "{}: {apart:.1e}", own.name);
    }
    assert_eq!(own.parameters[1].name, "joint.shoulder.spring.rest");
    assert_eq!(own.parameters[1].value, 0.2);
}

/// The length of all steps, with efforts, rates of controls, costs along the path, by compositions
/// and by Galerkin's method.
#[test]
fn lengths_of_steps_agree_with_differences() {
    let cheap = "[[objective]]\nname = \"cheap\"\ntype = \"effort\"\n[[objective]]\nname = \"when\"\ntype = \"time\"\nweight = 0.3\n[[objective]]\nname = \"smooth\"\ntype = \"rate\"\nweight = 0.01\n";
    let plain = format!("{ARM}{cheap}");
    let undamped =
        changed(&plain, &[("damper = { damping = \"= damping\" }", ""), ("damping = 0.2", "")]);
    for (name, text) in [
        ("plain", plain.clone()),
        ("linkage", LINKAGE.to_owned()),
        ("composition", changed(&undamped, &[("step = 0.01", "step = 0.01\norder = 4")])),
        (
            "galerkin",
            changed(&plain, &[("step = 0.01", "step = 0.01\norder = 4\nmethod = \"galerkin\"")]),
        ),
    ] {
        let by = asked(&text, &[], &[], true).by_step;
        println!("{name}: {by:?}");
        assert!(by.is_some_and(|by| by != 0.0));
    }
}

/// Momenta along the joints of a tree at the end.
#[test]
fn momenta_of_joints_agree_with_differences() {
    let counted = "[[objective]]\nname = \"still\"\ntype = \"momentum\"\nweight = 0.7\n";
    check("momentum", &format!("{ARM}{counted}"), 1e-8);
    let refused = found(&format!("{LINKAGE}{counted}"), false).unwrap_err().to_string();
    assert!(refused.contains("momenta along joints"), "{refused}");
}

/// A controller that reads angles, beside lengths that change: anchors move no angle. A
/// displacement between anchors that move is refused.
#[test]
fn laws_that_read_angles_count_beside_lengths() {
    let law = |read: &str| {
        format!(
            "{ARM}[[signal]]\nname = \"steer\"\npid = {{ of = \"0.6 - shoulder - 0.2*{read}\", proportional = 5.0, integral = 2.0, derivative = 0.3, filter = 0.02 }}\n\
             [[law]]\nname = \"motor\"\njoint = \"shoulder\"\neffort = \"steer + 0.1*{read}.rate*lower.vx\"\n"
        )
    };
    let pull = "[[sensor]]\nname = \"pull\"\ntype = \"expression\"\nvalue = \"2*steer\"\n\
                [[objective]]\nname = \"gently\"\ntype = \"value\"\nsensor = \"pull\"\nat = \"path\"\n";
    check("angles", &(law("elbow.1") + pull), 1e-8);
    let refused = |text: &str| found(text, false).unwrap_err().to_string();
    let (read, counted) = (refused(&law("elbow")), refused(&(law("elbow") + pull)));
    assert!(read.contains("whose geometry changes"), "{read}");
    assert!(counted.contains("moves a joint that the signal `steer` may read"), "{counted}");
}
