//! Velocities that are projected: `v_0` is not what the model states, and parameters change by how
//! much it is not.

use super::tests::found;
use super::{GradientFailure, Wanted, gradient};
use crate::system::outside::JointStart;
use holonom_model::ModelText;
use std::path::Path;

/// What the cases share: two objectives, one of them of a velocity at the start alone.
fn objectives(body: &str) -> String {
    format!(
        r#"
[[sensor]]
name = "place"
type = "position"
of = "{body}"
point = [0.2, 0.1, -0.1]
[[sensor]]
name = "speed"
type = "velocity"
of = "{body}"
point = [-0.1, 0.1, 0.1]
[[objective]]
name = "there"
type = "sensor"
sensor = "place.x"
target = 1.0
[[objective]]
name = "fast"
type = "sensor"
sensor = "speed.x"
target = 2.0
"#
    )
}

/// Two bodies welded together, stated with velocities of their own.
const WELDED: &str = r#"
model = { name = "welded" }
simulation = { step = 0.01, end = 0.2, project_start = true }
parameters = { mass = 2.0, spin = 0.5, arm = 0.6 }
[[body]]
name = "plate"
mass = 1.0
inertia = [0.1, 0.2, 0.3]
velocity = [0.1, "= 0.3*spin", 0.0]
[[body]]
name = "box"
mass = "= mass"
inertia = [0.1, "= 0.1*mass", 0.15]
position = ["= 2*arm", 0.0, 0.0]
rotation_vector = [0.0, 0.3, 0.2]
angular_velocity = ["= spin", 0.4, 0.3]
[[joint]]
name = "weld"
type = "fixed"
parent = "plate"
child = "box"
position = ["= arm", 0.0, 0.0]
"#;

/// A pendulum of two links, thrown: links of lengths that are parameters, joints across one
/// another.
pub(crate) const LINKS: &str = r#"
model = { name = "links", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.01, end = 0.2, project_start = true }
parameters = { length = 0.4, mass = 0.7, thrown = 1.3, tilt = 0.2 }
[[body]]
name = "upper"
mass = "= mass"
inertia = [0.02, 0.03, 0.02]
position = ["= length", 0.0, 0.0]
velocity = [0.3, 0.2, "= thrown"]
[[body]]
name = "lower"
mass = 1.0
inertia = [0.02, 0.03, 0.02]
position = ["= 3*length", 0.0, 0.0]
velocity = ["= -thrown", 0.5, 0.4]
angular_velocity = [0.6, "= -thrown", 0.0]
[[joint]]
name = "hinge"
type = "revolute"
parent = "ground"
child = "upper"
position = [0.0, 0.0, 0.0]
axis = ["= tilt", 1.0, 0.0]
[[joint]]
name = "elbow"
type = "universal"
parent = "upper"
child = "lower"
position = ["= 2*length", 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
axis2 = [0.0, 0.0, 1.0]
"#;

/// A parallelogram in its plane: a closed loop with redundant rows.
pub(crate) const PARALLELOGRAM: &str = r#"
model = { name = "parallelogram", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.01, end = 0.2, project_start = true }
parameters = { width = 0.8, mass = 0.7, thrown = 1.3 }
[[body]]
name = "left"
mass = 0.5
inertia = [0.02, 0.03, 0.02]
position = [0.0, 0.0, 0.3]
[[body]]
name = "top"
mass = "= mass"
inertia = [0.02, "= 0.04*mass", 0.03]
position = ["= width/2", 0.0, 0.6]
velocity = ["= thrown", 0.5, 0.4]
[[body]]
name = "right"
mass = 0.5
inertia = [0.02, 0.03, 0.02]
position = ["= width", 0.0, 0.3]
angular_velocity = [0.1, "= 0.2*thrown", 0.4]
[[joint]]
name = "a"
type = "revolute"
parent = "ground"
child = "left"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
[[joint]]
name = "b"
type = "revolute"
parent = "left"
child = "top"
position = [0.0, 0.0, 0.6]
axis = [0.0, 1.0, 0.0]
[[joint]]
name = "c"
type = "revolute"
parent = "top"
child = "right"
position = ["= width", 0.0, 0.6]
axis = [0.0, 1.0, 0.0]
[[joint]]
name = "d"
type = "revolute"
parent = "ground"
child = "right"
position = ["= width", 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
cut = true
"#;

/// A drive that turns from the start on what is stated at rest.
pub(crate) const DRIVEN: &str = r#"
model = { name = "driven", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.01, end = 0.2, project_start = true }
parameters = { rate = 2.0, mass = 0.7, length = 0.4 }
[[body]]
name = "crank"
mass = 0.5
inertia = [0.02, 0.03, 0.02]
position = ["= length/2", 0.0, 0.0]
[[body]]
name = "bob"
mass = "= mass"
inertia = [0.02, 0.03, "= 0.05*mass"]
position = ["= 1.5*length", 0.0, 0.0]
velocity = [0.1, 0.2, 0.3]
[[joint]]
name = "shaft"
type = "revolute"
parent = "ground"
child = "crank"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.3]
[[joint]]
name = "ball"
type = "spherical"
parent = "crank"
child = "bob"
position = ["= length", 0.0, 0.0]
[[constraint]]
name = "drive"
type = "motion"
joint = "shaft"
path = { rate = "= rate" }
"#;

/// An arm on a hinge whose axis goes through a ball joint of a rod that holds it: the distance of
/// both balls does not change, so one row is redundant, and the rod turns freely about itself. The
/// force along the rod is not determined; it has a vertical part once the arm has turned.
pub(crate) const BALLS: &str = r#"
[model]
name = "balls"
gravity = [0.0, 0.0, -9.81]
[simulation]
step = 0.01
end = 0.1
[parameters]
mass = 0.7
[[body]]
name = "arm"
mass = "= mass"
inertia = [0.02, 0.03, 0.02]
position = [0.25, 0.0, 0.0]
[[body]]
name = "rod"
mass = 0.5
inertia = [0.02, 0.03, 0.01]
position = [0.25, 0.2, 0.0]
[[joint]]
name = "hinge"
type = "revolute"
parent = "ground"
child = "arm"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
[[joint]]
name = "p"
type = "spherical"
parent = "ground"
child = "rod"
position = [0.0, 0.4, 0.0]
[[joint]]
name = "q"
type = "spherical"
parent = "arm"
child = "rod"
position = [0.5, 0.0, 0.0]
cut = true
"#;

/// Where the coordinate of a joint is given, its rate stays that of the model, and the reverse;
/// both may follow parameters.
#[test]
fn starts_of_which_a_part_is_given_follow_parameters() {
    let given = |name: &str, value: f64| vec![(name.to_owned(), 0, value)];
    for (text, body, joint) in
        [(LINKS, "lower", "hinge"), (LINKS, "lower", "elbow"), (PARALLELOGRAM, "top", "a")]
    {
        let text = text.to_owned() + &objectives(body);
        let text = ModelText::from_text(Path::new("model.toml"), &text);
        let model = text.model(&[]).unwrap();
        for (coordinates, rates) in
            [(given(joint, 0.3), Vec::new()), (Vec::new(), given(joint, 0.6))]
        {
            let start = JointStart { coordinates, rates };
            let wanted = Wanted { start, ..Wanted::everything() };
            let mut found = gradient(&text, &[], &model, &wanted).unwrap();
            found.check(&text, &[], &model, &wanted).unwrap();
            let name = format!("{} {joint} {:?}", found.model, wanted.start);
            println!("{name}: apart by {:.1e}", found.worst());
            assert!(found.worst() < 1e-8, "{name}: {:?}", found.checks);
            assert!(found.checks.iter().any(|own| own.by == "parameters"), "{name}");
        }
    }
}

/// The force along a rod between two balls is not determined; a component of it that is zero at
/// the start is not later.
#[test]
fn reactions_that_are_not_determined_on_the_way_are_refused() {
    for (of, at, order) in [
        ("fz", "", ""),
        ("fz", "at = \"path\"\n", ""),
        ("fz", "", "method = \"galerkin\"\norder = 4\n"),
        ("fx", "", ""), // nor at the start
    ] {
        let text = BALLS.replace("[simulation]\n", &format!("[simulation]\n{order}"))
            + "[[sensor]]\nname = \"held\"\ntype = \"reaction\"\nof = \"p\"\nframe = \"space\"\n"
            + &format!(
                "[[objective]]\nname = \"least\"\ntype = \"sensor\"\nsensor = \"held.{of}\"\n{at}"
            );
        match found(&text, false) {
            Err(GradientFailure::Run(error)) if of == "fz" => {
                println!("{error}");
                assert!(error.to_string().contains("not determined"), "{error}");
            }
            Err(GradientFailure::Model(error)) if of == "fx" => {
                println!("{error}");
                assert!(error.to_string().contains("does not determine"), "{error}");
            }
            found => panic!("{of} {at} {order}: {found:?}"),
        }
    }
}

#[test]
fn projected_velocities_follow_parameters() {
    for (text, body) in [(WELDED, "box"), (LINKS, "lower"), (PARALLELOGRAM, "top"), (DRIVEN, "bob")]
    {
        let found = found(&(text.to_owned() + &objectives(body)), true).unwrap();
        println!("{}: apart by {:.1e}", found.model, found.worst());
        assert!(found.worst() < 1e-8, "{}: {:?}", found.model, found.checks);
        assert!(found.parameters.iter().all(|own| own.derivative.abs() > 1e-4), "{found:?}");
    }
}
