//! Gradients by what moves beams and their rest shapes: points, curves, lengths, directions of the
//! axes, places of stations and of loads, against central differences of whole runs.

use super::beam_models::{CANTILEVER, LINKAGE, ROPE};
use super::comparison::{PATH, Worst, seen};
use super::force_models::without_objectives;
use super::tests::{changed, check, found};

/// A cantilever that becomes longer with all that it carries.
pub(super) fn longer() -> String {
    changed(
        CANTILEVER,
        &[
            ("speed = 0.7\n", "length = 1.0\nlift = 0.1\n"),
            ("[1.0, 0.0, 0.0]]\nelements", "[\"= length\", 0.0, \"= lift\"]]\nelements"),
            ("position = [1.0, 0.0, 0.0]", "position = [\"= length\", 0.0, \"= lift\"]"),
        ],
    )
}

/// The same with a load at a part of its length.
fn loaded() -> String {
    longer()
        + "[[load]]\nname = \"tug\"\nbeam = \"rod\"\nat = \"= 0.3*length\"\nforce = [0.5, 2.0, -4.0]\nframe = \"body\"\n"
}

#[test]
fn points_move_a_cantilever_with_its_loads() {
    check("longer", &longer(), 1e-8);
    check("loaded", &loaded(), 1e-8);
    let place = changed(&loaded(), &[("\"= 0.3*length\"", "\"= 0.3 + 0.1*lift\"")]);
    check("place of a load", &place, 1e-8);
}

#[test]
fn lengths_change_every_rule_of_strains() {
    for (settings, element) in [
        ("strain = \"dissipative\"", "helicoidal"),
        ("strain = \"mass_scaled\"", "second_order"),
        ("strain = \"mass_scaled\"", "mean_directors"),
        ("strain = \"averaged\"", "helicoidal"),
        ("strain = \"midpoint\"", "mean_directors"),
    ] {
        let settings = format!("end = 0.1, {settings} }}");
        let element = format!("elements = 4\nelement = \"{element}\"");
        let pairs = [("end = 0.1 }", settings.as_str()), ("elements = 4", &element)];
        check(&format!("{settings} {element}"), &changed(&loaded(), &pairs), 1e-8);
    }
    for (strain, element) in [("averaged", "helicoidal"), ("midpoint", "mean_directors")] {
        let by = format!("end = 0.1, strain = \"{strain}\", method = \"galerkin\", order = 4 }}");
        let element = format!("elements = 4\nelement = \"{element}\"");
        let pairs = [("end = 0.1 }", by.as_str()), ("elements = 4", &element)];
        check(&format!("galerkin, {element}"), &changed(&loaded(), &pairs), 1e-8);
    }
}

/// A beam that is longer than the way between what holds it.
#[test]
fn stress_free_lengths_change_a_beam() {
    let slack = changed(
        CANTILEVER,
        &[
            ("speed = 0.7\n", "length = 1.01\n"),
            ("elements = 4", "elements = 4\nlength = \"= length\""),
        ],
    );
    check("slack", &slack, 1e-8);
    let rope = changed(
        ROPE,
        &[
            ("line = 0.3\n", "line = 0.3\nlength = 0.995\n"),
            ("elements = 4", "elements = 4\nlength = \"= length\""),
        ],
    );
    check("taut rope", &rope, 1e-8);
}

/// Beams on a hub that moves and turns with parameters, along curves of every kind.
const CURVED: &str = r#"
model = { name = "curved", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.002, end = 0.06 }
[parameters]
place = 0.1
turn = 0.2
radius = 0.5
angle = 1.1
tilt = 0.1
speed = 0.4
[[body]]
name = "hub"
position = ["= place", 0.0, 0.0]
rotation_vector = [0.0, "= turn", 0.3]
mass = 0.7
inertia = [0.01, 0.02, 0.02]
angular_velocity = [0.2, "= speed", -0.5]
[[beam]]
name = "bow"
relative_to = "hub"
CURVE
elements = 3
SECTION
angular_velocity = [0.0, 0.0, 0.0]
[[joint]]
name = "grip"
type = "fixed"
parent = "hub"
child = "bow.start"
relative_to = "hub"
position = [0.0, 0.0, 0.0]
[[body]]
name = "bob"
relative_to = "bow.end"
position = [0.0, 0.02, 0.05]
mass = 0.2
inertia = [0.001, 0.001, 0.002]
[[joint]]
name = "ball"
type = "spherical"
parent = "bow.end"
child = "bob"
relative_to = "bow.end"
position = [0.0, 0.0, 0.0]
[[sensor]]
name = "tip"
type = "position"
of = "bob"
[[objective]]
name = "high"
type = "sensor"
sensor = "tip.z"
target = 0.4
[[objective]]
name = "aside"
type = "sensor"
sensor = "tip.y"
at = "path"
target = 0.05
weight = 30.0
"#;

fn curved(curve: &str, section: &str) -> String {
    changed(CURVED, &[("CURVE", curve), ("SECTION", section)])
}

const ROUND: &str = "section = { shape = { type = \"circle\", dimensions = [0.02] }, material = { E = 2e8, nu = 0.33, density = 2700.0 } }";
const FLAT: &str = "section = { shape = { type = \"rectangle\", dimensions = [0.03, 0.02] }, material = { E = 2e8, nu = 0.33, density = 2700.0 } }";

#[test]
fn curves_normals_and_frames_move_beams() {
    let curves = [
        "curve = { type = \"arc\", from = [0, 0, 0], center = [0.0, \"= radius\", \"= tilt\"], axis = [0.0, \"= tilt\", 1.0], angle = \"= angle\" }",
        "curve = { type = \"helix\", from = [0, 0, 0], center = [0.0, \"= radius\", 0.0], axis = [0.0, \"= tilt\", 1.0], angle = \"= -angle\", pitch = \"= 0.3*radius\" }",
        "curve = { type = \"spline\", points = [[0, 0, 0], [\"= 0.5*radius\", 0.1, \"= tilt\"], [0.5, 0.2, \"= -0.2*angle\"]] }",
        "points = [[0, 0, 0], [\"= radius\", 0.1, \"= tilt\"], [0.5, \"= 0.5*angle\", \"= 0.4*radius\"]]",
    ];
    for curve in curves {
        check(curve, &curved(curve, ROUND), 1e-8);
        let order = [("step = 0.002", "step = 0.002, order = 4")];
        check(&format!("{curve}, order 4"), &changed(&curved(curve, ROUND), &order), 1e-8);
        let legs = if curve.starts_with("points") { 2 } else { 1 };
        for (normal, twist) in [
            ("[0.1, \"= tilt\", 1.0]", "normal"),
            ("[0.1, \"= tilt\", 1.0]", "minimal"),
            ("[[0.1, \"= tilt\", 1.0], [0.2, 0.1, \"= 1 + tilt\"]]", "normal"),
        ] {
            if normal.starts_with("[[") && legs == 1 {
                continue;
            }
            let section = format!("normal = {normal}\ntwist = \"{twist}\"\n{FLAT}");
            check(&format!("{curve}, {normal}, {twist}"), &curved(curve, &section), 1e-8);
        }
    }
}

/// Places of stations and their twist, as the length of the blade.
#[test]
fn stations_move_along_a_blade() {
    let stations = |at: &str, twist: &str| {
        format!(
            "points = [[0, 0, 0], [\"= radius\", 0.0, 0.0]]\nnormal = [0.0, \"= tilt\", 1.0]\n\
             section = {{ material = {{ E = 2e8, nu = 0.33, density = 2700.0 }} }}\n\
             [[beam.stations]]\nat = 0.0\nsection = {{ shape = {{ type = \"rectangle\", dimensions = [0.03, 0.02] }} }}\n\
             [[beam.stations]]\nat = {at}\ntwist = {twist}\nsection = {{ shape = {{ type = \"rectangle\", dimensions = [0.026, 0.015] }} }}\n\
             [[beam.stations]]\nat = \"= radius\"\ntwist = 0.3\nsection = {{ shape = {{ type = \"rectangle\", dimensions = [0.01, 0.01] }} }}\n"
        )
    };
    let blade = |at: &str, twist: &str| {
        let text = curved("points = [[0, 0, 0]]", "");
        let text = changed(
            &text,
            &[(
                "points = [[0, 0, 0]]\nelements = 3\n\nangular_velocity = [0.0, 0.0, 0.0]\n",
                "elements = 3\nSTATIONS",
            )],
        );
        changed(&text, &[("STATIONS", &stations(at, twist))])
    };
    check("at a part", &blade("\"= 0.44*radius\"", "\"= 0.1*angle\""), 1e-8);
    check("at a place", &blade("\"= 0.2 + 0.1*tilt\"", "\"= 0.1*angle\""), 1e-8);
    let kink = found(&blade("\"= radius/3 + tilt - 0.1\"", "\"= 0.1*angle\""), false);
    let message = kink.unwrap_err().to_string();
    assert!(message.contains("beam.bow.stations") && message.contains("kink"), "{message}");
}

/// The coupler of a closed loop becomes longer with the frame of the loop.
#[test]
fn lengths_change_a_closed_loop() {
    let text = changed(
        LINKAGE,
        &[
            ("mass = 0.8\n", "mass = 0.8\nlength = 1.0\nheight = 0.4\n"),
            (
                "points = [[0.0, 0.0, 0.4], [1.0, 0.0, 0.4]]",
                "points = [[0.0, 0.0, \"= height\"], [\"= length\", 0.0, \"= height\"]]",
            ),
            ("position = [1.0, 0.0, 0.4]", "position = [\"= length\", 0.0, \"= height\"]"),
            ("position = [0.0, 0.0, 0.4]", "position = [0.0, 0.0, \"= height\"]"),
            ("position = [1.0, 0.0, 0.0]", "position = [\"= length\", 0.0, 0.0]"),
            ("position = [1.0, 0.0, 0.2]", "position = [\"= length\", 0.0, 0.2]"),
        ],
    );
    check("loop", &text, 1e-8);
    let relaxed = changed(&text, &[("end = 0.1", "end = 0.1, start = \"relaxed\"")]);
    check("relaxed loop", &relaxed, 1e-6);
}

/// Equilibria of beams that become longer, from which runs begin or in which statics ends.
#[test]
fn lengths_change_equilibria() {
    let gust = "force = [5.0, 3.0, \"= force\"]";
    let gust = [(
        gust,
        format!("{gust}\nhistory = {{ type = \"harmonic\", frequency = 7.0, phase = 0.6 }}"),
    )];
    let gust = gust.each_ref().map(|(from, to)| (*from, to.as_str()));
    let relaxed = changed(&loaded(), &[("end = 0.1", "end = 0.1, start = \"relaxed\"")]);
    check("relaxed", &changed(&relaxed, &gust), 1e-6);
}

/// Strains and section forces at places that move along beams that become longer.
#[test]
fn sections_of_longer_beams_agree_with_differences() {
    let mut worst = Worst::default();
    for (strain, element, place, at) in [
        ("averaged", "helicoidal", "element = 1", PATH),
        ("averaged", "helicoidal", "at = \"= 0.35*length\"", PATH),
        ("averaged", "helicoidal", "at = 0.35", ""),
        ("mass_scaled", "second_order", "at = \"= 0.9*length + lift\"", PATH),
        ("dissipative", "helicoidal", "at = 0.0", PATH),
        ("averaged", "mean_directors", "at = \"= 0.4 + 0.1*lift\"", PATH),
    ] {
        println!("{element}, {strain}, {place}{at}");
        let text = without_objectives(&loaded());
        let (strain, element) = (
            format!("end = 0.03, strain = \"{strain}\""),
            format!("elements = 4\nelement = \"{element}\""),
        );
        let soft = [
            ("young = 2.0e9", "young = 2.0e7"),
            ("end = 0.1", &strain),
            ("elements = 4", &element),
        ];
        let (place, parts) = (format!("{place}\n"), &["0", "2", "4"][..]);
        let all =
            [("section_force", "rod", place.as_str(), parts), ("strain", "rod", &place, parts)];
        worst.compare_all(&changed(&text, &soft), &seen(&all, at), [1e-8, 1e-10]);
    }
    let jump = without_objectives(&loaded())
        + "[[sensor]]\nname = \"cut\"\ntype = \"section_force\"\nof = \"rod\"\nat = 0.3\n[[objective]]\nname = \"own\"\ntype = \"value\"\nsensor = \"cut.1\"\n";
    let message = found(&jump, false).unwrap_err().to_string();
    assert!(message.contains("sensor.cut.at") && message.contains("a jump"), "{message}");
}
