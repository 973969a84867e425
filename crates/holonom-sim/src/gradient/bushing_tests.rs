//! Bushings whose places and axes are parameters, against central differences of whole runs.

use super::tests::{changed, check, found};

/// A body on a bushing to the ground, another one on one between both: matrices that are not
/// symmetric, expressions, damping, a preload; one stated in a frame that is turned, one in a body
/// that is placed elsewhere.
const BUSHINGS: &str = r#"
model = { name = "bushings", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.004, end = 0.2 }
parameters = { across = 0.13, tilt = 0.3, long = 0.5, mass = 1.2, turn = 0.2 }
[[frame]]
name = "desk"
position = [0.1, "= across", 0.0]
rotation_vector = [0.0, "= turn", 0.1]
[[body]]
name = "block"
mass = "= mass"
inertia = [0.02, 0.03, 0.04]
position = ["= long", 0.0, 0.0]
rotation_vector = [0.1, 0.0, "= tilt"]
angular_velocity = [0.5, 0.0, 1.0]
[[body]]
name = "rider"
mass = 0.6
inertia = [0.01, 0.02, 0.015]
position = [0.7, 0.1, 0.2]
velocity = [0.3, 0.0, 0.2]
[[bushing]]
name = "mount"
from = "ground"
to = "block"
relative_to = "desk"
position = [0.3, "= 0.5*across", 0.05]
euler = { sequence = "xyz", angles = [0.2, "= tilt", 0.1] }
stiffness = [900.0, 800.0, 1200.0, 40.0, 30.0, 50.0]
damping = [3.0, 4.0, 2.0, 0.1, 0.2, 0.1]
preload = [1.0, 0.0, 5.0, 0.0, 0.3, 0.0]
[[bushing]]
name = "saddle"
from = "block"
to = "rider"
relative_to = "block"
position = ["= 0.3*long", 0.05, 0.1]
rotation_vector = [0.1, "= turn", 0.0]
force = [
    "-700*x1 - 4000*x1^3 - 2*v1",
    "-600*x2 + 30*x4",
    "-900*x3 - 3*v3",
    "-20*x4 - 10*x4*x5",
    "-25*x5 - 0.1*v5",
    "-15*x6 + sin(3*t)",
]
[[sensor]]
name = "place"
type = "position"
of = "rider"
point = [0.1, 0.0, 0.1]
"#;

const PLACE: &str =
    "[[objective]]\nname = \"o\"\ntype = \"sensor\"\nsensor = \"place.z\"\ntarget = 1.0\n";

#[test]
fn places_and_axes_of_bushings_count() {
    for scheme in ["nodal", "constrained", "dalembert"] {
        let own = format!("end = 0.2, scheme = \"{scheme}\"");
        let text = changed(&format!("{BUSHINGS}{PLACE}"), &[("end = 0.2", &own)]);
        check(scheme, &text, 1e-8);
    }
    let undamped = [
        ("damping = [3.0, 4.0, 2.0, 0.1, 0.2, 0.1]\n", ""),
        (" - 2*v1", ""),
        (" - 3*v3", ""),
        (" - 0.1*v5", ""),
        ("end = 0.2", "end = 0.2, order = 4"),
    ];
    let fourth = changed(BUSHINGS, &undamped);
    check("order 4", &format!("{fourth}{PLACE}"), 1e-8);
    let galerkin =
        changed(BUSHINGS, &[("end = 0.2", "end = 0.2, method = \"galerkin\", order = 4")]);
    check("galerkin", &format!("{galerkin}{PLACE}"), 1e-7);
    let coupled = changed(
        BUSHINGS,
        &[
            (
                "damping = [3.0, 4.0, 2.0, 0.1, 0.2, 0.1]",
                "damping = [3.0, 4.0, 2.0, 0.1, 0.2, 0.0]",
            ),
            (
                "stiffness = [900.0, 800.0, 1200.0, 40.0, 30.0, 50.0]",
                "stiffness = [[900.0, 90.0, 0.0, 0.0, 0.0, 0.0], [-90.0, 800.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1200.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 40.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 30.0, 0.0], [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]]\nrotation = \"tilt\"",
            ),
        ],
    );
    check("not symmetric", &format!("{coupled}{PLACE}"), 1e-8);
}

/// Efforts, powers and works of bushings whose frames move, at the end and along the path.
#[test]
fn what_moved_bushings_do_has_its_derivatives() {
    for (sensor, part) in [
        ("type = \"effort\"\nof = \"mount\"", "fz"),
        ("type = \"effort\"\nof = \"saddle\"", "my"),
        ("type = \"power\"\nof = \"mount\"", ""),
        ("type = \"power\"\nof = \"saddle\"", ""),
        ("type = \"work\"\nof = \"mount\"", ""),
    ] {
        for at in ["", "at = \"path\"\n"] {
            let read = if part.is_empty() { "own".to_owned() } else { format!("own.{part}") };
            let text = format!(
                "{BUSHINGS}[[sensor]]\nname = \"own\"\n{sensor}\n[[objective]]\nname = \"o\"\n\
                 type = \"sensor\"\nsensor = \"{read}\"\n{at}target = 1.0\n"
            );
            check(&format!("{sensor} {at}"), &text, 1e-8);
        }
    }
}

/// At rest, by statics, and with a start that relaxes.
#[test]
fn moved_bushings_count_in_equilibria() {
    let still =
        [("angular_velocity = [0.5, 0.0, 1.0]\n", ""), ("velocity = [0.3, 0.0, 0.2]\n", "")];
    let still = changed(BUSHINGS, &still);
    let relaxed = changed(&still, &[("end = 0.2", "end = 0.2, start = \"relaxed\"")]);
    check("relaxed", &format!("{relaxed}{PLACE}"), 1e-7);
    let own = [("step = 0.004, end = 0.2", "step = 0.5, end = 1.0, scheme = \"static\"")];
    check("static", &format!("{}{PLACE}", changed(&still, &own)), 1e-8);
}

#[test]
fn a_moved_bushing_that_reads_others_is_refused() {
    let reads = changed(BUSHINGS, &[("-600*x2 + 30*x4", "-600*x2 + 30*block.z")]);
    let error = found(&format!("{reads}{PLACE}"), false).unwrap_err().to_string();
    assert!(error.contains("bushing.saddle") && error.contains("its own coordinates"), "{error}");
}
