//! Gradients by numbers of beams and of relaxed starts against central differences of whole runs,
//! and what is refused.

use super::prepared::{Begin, Prepared};
use super::tests::found;
use crate::design;
use crate::system::outside::Outside;
use holonom_model::ModelText;
use std::path::Path;
use vi_control::sensitivities::{Beside, Direction, Sensitivities};

/// A cantilever with a weight at its tip, a load along it and one at its tip.
const CANTILEVER: &str = r#"
model = { name = "cantilever", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.002, end = 0.1 }
[parameters]
young = 2.0e9
radius = 0.012
density = 1400.0
relaxation = 0.004
force = -30.0
line = 8.0
speed = 0.7
[[beam]]
name = "rod"
points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
elements = 4
start = "clamped"
angular_velocity = [0.0, 0.0, 0.0]
[beam.section]
shape = { type = "circle", dimensions = ["= radius"] }
material = { E = "= young", nu = 0.3, density = "= density" }
damping = "= relaxation"
[[body]]
name = "weight"
mass = 0.3
inertia = [0.001, 0.002, 0.002]
position = [1.0, 0.0, 0.0]
[[joint]]
name = "grip"
type = "fixed"
parent = "rod.end"
child = "weight"
position = [1.0, 0.0, 0.0]
[[load]]
name = "pull"
body = "rod.end"
force = [5.0, 3.0, "= force"]
[[load]]
name = "wind"
beam = "rod"
force = [0.0, "= line", 0.0]
[[sensor]]
name = "tip"
type = "position"
of = "rod.end"
[[objective]]
name = "sag"
type = "sensor"
sensor = "tip.z"
at = "path"
target = 0.1
weight = 5.0
[[objective]]
name = "aside"
type = "sensor"
sensor = "tip.y"
target = -0.2
"#;

/// A beam that flies and turns, with full matrices.
const FLYING: &str = r#"
model = { name = "flying", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.002, end = 0.08 }
[parameters]
shear = 900.0
bend = 6.0
twist = 0.7
line = 0.6
moment = 2.0e-3
viscous = 0.05
spin = 2.0
[[beam]]
name = "wing"
points = [[0.0, 0.0, 0.0], [1.0, 0.2, 0.0]]
normal = [0.0, 0.0, 1.0]
elements = 3
velocity = [0.3, 0.0, "= 0.5*spin"]
angular_velocity = [0.2, "= spin", 0.5]
[beam.section]
stiffness = [
    ["= shear", 20.0, 0.0, 0.0, 0.0, 3.0],
    [20.0, 1100.0, 0.0, 0.0, 0.0, -2.0],
    [0.0, 0.0, 4000.0, 5.0, -8.0, 0.0],
    [0.0, 0.0, 5.0, "= bend", 0.4, "= twist"],
    [0.0, 0.0, -8.0, 0.4, 9.0, -0.3],
    [3.0, -2.0, 0.0, "= twist", -0.3, 4.0],
]
mass = [
    ["= line", 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, "= line", 0.0, 0.0, 0.0, 0.0],
    [0.0, 0.0, "= line", 0.0, 0.0, 0.0],
    [0.0, 0.0, 0.0, "= moment", 0.0, 0.0],
    [0.0, 0.0, 0.0, 0.0, 0.003, 0.0],
    [0.0, 0.0, 0.0, 0.0, 0.0, "= moment + 0.003"],
]
damping = { EA = 0.001, GA1 = 0.001, GA2 = 0.001, EI1 = "= viscous", EI2 = 0.002, GJ = 0.003 }
[[load]]
name = "push"
body = "wing.1"
force = [0.0, 4.0, 3.0]
frame = "body"
[[sensor]]
name = "tip"
type = "position"
of = "wing.end"
[[objective]]
name = "place"
type = "sensor"
sensor = "tip.z"
target = 0.4
[[objective]]
name = "course"
type = "sensor"
sensor = "tip.y"
at = "path"
weight = 20.0
"#;

/// A tapered blade with a twist of its axes and centres off the line of its nodes.
const BLADE: &str = r#"
model = { name = "blade", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.002, end = 0.06 }
[parameters]
root = 0.05
tip = 0.02
young = 6.0e8
factor = 0.8
place = 0.004
angle = 0.2
[[beam]]
name = "blade"
points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
normal = [0.0, 0.0, 1.0]
elements = 3
start = "clamped"
[beam.section]
material = { E = "= young", G = 2.0e8, density = 900.0 }
shear_factors = ["= factor", 0.7]
mass_center = ["= place", 0.0]
angle = "= angle"
[[beam.stations]]
at = 0.0
section = { shape = { type = "rectangle", dimensions = ["= root", 0.03] } }
[[beam.stations]]
at = 0.45
section = { shape = { type = "rectangle", dimensions = ["= 0.5*root + 0.5*tip", 0.03] } }
[[beam.stations]]
at = 1.0
section = { shape = { type = "rectangle", dimensions = ["= tip", 0.02] } }
[[sensor]]
name = "tip"
type = "position"
of = "blade.end"
[[objective]]
name = "sag"
type = "sensor"
sensor = "tip.z"
target = 0.1
[[objective]]
name = "aside"
type = "sensor"
sensor = "tip.y"
at = "path"
target = 0.05
weight = 30.0
"#;

/// A crank that drives a flexible coupler on a rocker.
const LINKAGE: &str = r#"
model = { name = "linkage", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.002, end = 0.1 }
[parameters]
young = 4.0e8
width = 0.03
density = 1100.0
mass = 0.8
stiffness = 9.0
[[body]]
name = "crank"
position = [0.0, 0.0, 0.2]
mass = "= mass"
inertia = [0.02, 0.02, 0.001]
[[body]]
name = "rocker"
position = [1.0, 0.0, 0.2]
mass = 0.7
inertia = [0.015, 0.015, 0.001]
[[beam]]
name = "coupler"
points = [[0.0, 0.0, 0.4], [1.0, 0.0, 0.4]]
normal = [0.0, 0.0, 1.0]
elements = 3
[beam.section]
shape = { type = "rectangle", dimensions = [0.02, "= width"] }
material = { E = "= young", nu = 0.3, density = "= density" }
damping = { loss_factor = 0.05, frequency = 20.0 }
[[joint]]
name = "shaft"
type = "revolute"
parent = "ground"
child = "crank"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
spring = { stiffness = "= stiffness", rest = 0.5 }
[[joint]]
name = "pin"
type = "revolute"
parent = "crank"
child = "coupler.start"
position = [0.0, 0.0, 0.4]
axis = [0.0, 1.0, 0.0]
[[joint]]
name = "pivot"
type = "revolute"
parent = "ground"
child = "rocker"
position = [1.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
[[joint]]
name = "knee"
type = "revolute"
parent = "rocker"
child = "coupler.end"
position = [1.0, 0.0, 0.4]
axis = [0.0, 1.0, 0.0]
[[sensor]]
name = "middle"
type = "position"
of = "coupler.1"
[[objective]]
name = "place"
type = "sensor"
sensor = "middle.z"
at = "path"
target = 0.3
weight = 9.0
[[objective]]
name = "reach"
type = "sensor"
sensor = "middle.x"
target = 0.6
"#;

/// A rope that swings with a weight.
const ROPE: &str = r#"
model = { name = "rope", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.002, end = 0.08 }
[parameters]
stretch = 900.0
bend = 0.02
line = 0.3
[[beam]]
name = "rope"
points = [[0.0, 0.0, 0.0], [0.8, 0.0, -0.6]]
elements = 4
element = "rope"
start = "pinned"
normal = [0.0, 1.0, 0.0]
[beam.section]
EA = "= stretch"
EI1 = "= bend"
EI2 = "= bend"
GJ = 0.02
rhoA = "= line"
rhoI1 = 2.0e-5
rhoI2 = 2.0e-5
damping = 0.01
[[body]]
name = "weight"
mass = 0.5
inertia = [0.001, 0.001, 0.001]
position = [0.8, 0.0, -0.6]
[[joint]]
name = "grip"
type = "spherical"
parent = "rope.end"
child = "weight"
position = [0.8, 0.0, -0.6]
[[load]]
name = "pull"
body = "weight"
force = [0.0, 4.0, 0.0]
[[sensor]]
name = "tip"
type = "position"
of = "weight"
[[objective]]
name = "depth"
type = "sensor"
sensor = "tip.z"
target = -0.2
[[objective]]
name = "course"
type = "sensor"
sensor = "tip.y"
at = "path"
weight = 40.0
"#;

fn changed(text: &str, pairs: &[(&str, &str)]) -> String {
    pairs.iter().fold(text.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    })
}

/// How far a gradient is from differences.
fn check(what: &str, text: &str, allowed: f64) {
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

#[test]
fn sections_change_a_cantilever() {
    check("cantilever", CANTILEVER, 1e-8);
}

#[test]
fn full_matrices_change_a_beam_that_flies() {
    check("flying", FLYING, 1e-8);
}

#[test]
fn stations_change_a_blade() {
    check("blade", BLADE, 1e-8);
}

#[test]
fn sections_change_a_closed_loop() {
    check("linkage", LINKAGE, 1e-8);
}

#[test]
fn sections_change_a_rope() {
    check("rope", ROPE, 1e-8);
}

/// Every rule of strains, with every kind of element that goes with it.
#[test]
fn every_rule_of_strains_has_its_derivatives() {
    let with = |strain: &str, element: &str| {
        let strain = format!("end = 0.1, strain = \"{strain}\" }}");
        let element = format!("elements = 4\nelement = \"{element}\"");
        changed(CANTILEVER, &[("end = 0.1 }", &strain), ("elements = 4", &element)])
    };
    for (strain, element) in [
        ("dissipative", "helicoidal"),
        ("mass_scaled", "second_order"),
        ("mass_scaled", "mean_directors"),
        ("averaged", "helicoidal"),
        ("averaged", "mean_directors"),
        ("midpoint", "mean_directors"),
    ] {
        check(&format!("{strain}, {element}"), &with(strain, element), 1e-8);
    }
    let trapezoidal = with("midpoint", "mean_directors");
    let trapezoidal = changed(
        &trapezoidal,
        &[
            ("step = 0.002", "step = 2e-5, quadrature = \"trapezoidal\""),
            ("end = 0.1", "end = 1e-3"),
        ],
    );
    check("trapezoidal", &trapezoidal, 1e-7);
}

/// What a beam is as drawn: a prestress, a curvature, a bound of its tension, lumped masses.
#[test]
fn what_a_beam_is_as_drawn_has_its_derivatives() {
    let of = |own: &str| {
        let own = format!("elements = 4\n{own}");
        let text = changed(
            CANTILEVER,
            &[("elements = 4", &own), ("speed = 0.7\n", "speed = 0.7\nown = 6.0\n")],
        );
        changed(
            &text,
            &[("angular_velocity = [0.0, 0.0, 0.0]", "angular_velocity = [0.0, \"= speed\", 0.0]")],
        )
    };
    // the clamp does not turn: the velocities are projected
    let free = [
        ("start = \"clamped\"\n", ""),
        (
            "angular_velocity = [0.0, \"= speed\", 0.0]",
            "angular_velocity = [0.1, \"= speed\", 0.2]",
        ),
    ];
    let weight = [(
        "position = [1.0, 0.0, 0.0]\n[[joint]]",
        "position = [1.0, 0.0, 0.0]\nvelocity = [0.0, 0.2, \"= -speed\"]\nangular_velocity = [0.1, \"= speed\", 0.2]\n[[joint]]",
    )];
    for (what, own) in [
        ("prestress", "prestress = \"= own\""),
        ("curvature", "curvature = [\"= 0.1*own\", 0.2, \"= 0.05*own\"]"),
        ("bound", "tension = \"= own\""),
        ("lumped", "mass = \"lumped\"\nprestress = \"= own\""),
    ] {
        let text = changed(&changed(&of(own), &free), &weight);
        check(what, &text, 1e-8);
    }
}

/// A chain of two bodies on springs, a rod on a spring: where they hang.
const CHAIN: &str = r#"
model = { name = "chain", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.005, end = 0.1, start = "relaxed" }
[parameters]
mass = 1.4
stiffness = 30.0
rest = 0.2
arm = 0.5
force = 2.0
damping = 0.3
[[body]]
name = "upper"
position = ["= arm", 0.0, 0.0]
mass = "= mass"
inertia = [0.01, 0.1, 0.1]
[[body]]
name = "lower"
position = ["= 2.5*arm", 0.0, 0.0]
mass = 0.8
inertia = [0.01, 0.05, 0.05]
[[joint]]
name = "shoulder"
type = "revolute"
parent = "ground"
child = "upper"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
spring = { stiffness = "= stiffness", rest = "= rest" }
damper = { damping = "= damping" }
[[joint]]
name = "elbow"
type = "revolute"
parent = "upper"
child = "lower"
position = ["= 2*arm", 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
[[load]]
name = "pull"
body = "lower"
force = ["= force", 0.0, 1.0]
history = { type = "harmonic", frequency = 3.0, phase = 0.7 }
[[sensor]]
name = "tip"
type = "position"
of = "lower"
[[objective]]
name = "depth"
type = "sensor"
sensor = "tip.z"
at = "path"
weight = 3.0
[[objective]]
name = "reach"
type = "sensor"
sensor = "tip.x"
target = 0.3
"#;

/// A step in the load moves what hangs, so that parameters count along the run as well.
#[test]
fn relaxed_starts_change_with_their_equilibrium() {
    check("chain", CHAIN, 1e-7);
    let kicked = |text: &str| {
        let at_end = "start = \"relaxed\"";
        changed(text, &[("end = 0.1", &format!("end = 0.1, {at_end}"))])
    };
    let gust = [(
        "force = [5.0, 3.0, \"= force\"]",
        "force = [5.0, 3.0, \"= force\"]\nhistory = { type = \"harmonic\", frequency = 7.0, phase = 0.6 }",
    )];
    let still = [("speed = 0.7\n", "")];
    check("relaxed cantilever", &changed(&changed(&kicked(CANTILEVER), &gust), &still), 1e-6);
    check("relaxed linkage", &kicked(LINKAGE), 1e-6);
}

#[test]
fn what_has_no_derivative_of_a_beam_is_named() {
    let refused = |pairs: &[(&str, &str)]| {
        let error = found(&changed(CANTILEVER, pairs), false).err();
        error.map(|error| error.to_string()).unwrap_or_default()
    };
    let moved =
        refused(&[("[1.0, 0.0, 0.0]]\nelements", "[\"= 100*radius - 0.2\", 0.0, 0.0]]\nelements")]);
    assert!(moved.contains("beam.rod.points"), "{moved}");
    let neutral = changed(
        CHAIN,
        &[
            ("type = \"revolute\"\nparent = \"upper\"", "type = \"spherical\"\nparent = \"upper\""),
            (
                "position = [\"= 2*arm\", 0.0, 0.0]\naxis = [0.0, 1.0, 0.0]",
                "position = [\"= 2*arm\", 0.0, 0.0]",
            ),
            ("force = [\"= force\", 0.0, 1.0]", "force = [0.0, 0.0, 1.0]"),
        ],
    );
    let neutral = found(&neutral, false).unwrap_err().to_string();
    assert!(neutral.contains("simulation.start") && neutral.contains("other places"), "{neutral}");
    let slack = refused(&[("elements = 4", "elements = 4\nlength = \"= 1.02*speed/0.7\"")]);
    assert!(slack.contains("beam.rod.length"), "{slack}");
}

/// By tangents beside the run.
fn forward(text: &str) -> Vec<(String, f64)> {
    let text = ModelText::from_text(Path::new("model.toml"), text);
    let model = text.model(&[]).unwrap();
    let mut prepared = Prepared::new(&model, &[], (&[], &Outside::default())).unwrap();
    let tangents = design::tangents(&text, &[], &model, &prepared.system).unwrap();
    prepared.depend(&model, &[], &tangents).unwrap();
    let begin = Begin::new(&model, &mut prepared).unwrap();
    let design = super::prepared::design(&prepared, &begin.mass, &tangents).unwrap();
    let of = begin.of(&model, &prepared.system.mechanism);
    let run = prepared.simulation.integrator();
    let changes = begin.changes(&of, run, (&design, &tangents)).unwrap();
    let all = tangents.iter().zip(&changes).enumerate();
    let directions = all.map(|(k, (own, change))| Direction {
        start: begin.tangent(run, change, Some(own)),
        parameter: Some(k),
        ..Direction::default()
    });
    let mut beside = Sensitivities::new(run, model.settings.step, directions.collect()).unwrap();
    let (controls, objective) = (&prepared.controls, &prepared.costs.sum);
    for _ in 0..prepared.steps {
        beside.advance(run, Beside { controls, design: Some(&design), objective }).unwrap();
    }
    let rates = beside.rates(objective, run.state());
    tangents.iter().map(|own| own.name.clone()).zip(rates).collect()
}

#[test]
fn tangents_beside_the_run_say_the_same_as_costates() {
    let dissipative = changed(CANTILEVER, &[("end = 0.1", "end = 0.1, strain = \"dissipative\"")]);
    let relaxed = changed(LINKAGE, &[("end = 0.1", "end = 0.1, start = \"relaxed\"")]);
    for text in [CANTILEVER, FLYING, BLADE, LINKAGE, ROPE, CHAIN, &dissipative, &relaxed] {
        let backward = found(text, false).unwrap();
        for ((name, by_tangent), own) in forward(text).iter().zip(&backward.parameters) {
            let off = (by_tangent / own.derivative - 1.0).abs();
            println!("{} {name}: {by_tangent} off by {off:.1e}", backward.model);
            assert!(name == &own.name && off < 1e-9, "{name}: {off:e}");
        }
    }
}

/// Two vibrations that are the highest together, of which a parameter changes one.
#[test]
fn a_kink_of_the_added_mass_is_refused_where_mass_is_added() {
    let round = changed(
        CANTILEVER,
        &[
            (
                "shape = { type = \"circle\", dimensions = [\"= radius\"] }\n",
                "GA1 = \"= 2e4*radius\"\nGA2 = 240.0\nEA = 9e5\nEI1 = 30.0\nEI2 = 30.0\nGJ = 0.24\nrhoA = 0.6\nrhoI1 = 2e-9\nrhoI2 = 2e-9\n",
            ),
            ("material = { E = \"= young\", nu = 0.3, density = \"= density\" }\n", ""),
            ("young = 2.0e9\n", ""),
            ("density = 1400.0\n", ""),
            ("elements = 4", "elements = 4\nnormal = [0.0, 0.0, 1.0]"),
        ],
    );
    let message = found(&round, false).unwrap_err().to_string();
    assert!(
        message.contains("same highest frequency") && message.contains("beam.rod"),
        "{message}"
    );
    let averaged = changed(&round, &[("end = 0.1", "end = 0.1, strain = \"averaged\"")]);
    check("averaged", &averaged, 1e-6);
}
