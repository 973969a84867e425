//! Gradients of equilibria against differences of paths of equilibria, of which sensors are read as
//! a run records them, and what is refused.

#![allow(clippy::float_cmp)] // what is exact

use super::beam_models::{CANTILEVER, LINKAGE, ROPE};
use super::beam_shape_tests::longer;
use super::static_models::{DRIVEN, FRAME, LYING, MIXED, UPRIGHT};
use super::tests::{changed, found};
use super::{ModelGradient, Wanted, gradient};
use crate::experiment::RunnableModel;
use crate::run::outcome::RunOutcome;
use crate::statics::Statics;
use holonom_model::{CountedAt, ModelText, Override};
use std::path::Path;

/// A sensor with an objective of it.
fn sensing(name: &str, sensor: &str, part: &str, target: f64) -> String {
    let read = if part.is_empty() { name.to_owned() } else { format!("{name}.{part}") };
    format!(
        "[[sensor]]\nname = \"{name}\"\n{sensor}\n[[objective]]\nname = \"o_{name}\"\n\
         type = \"sensor\"\nsensor = \"{read}\"\ntarget = {target}\n"
    )
}

fn position(name: &str, of: &str, part: &str, target: f64) -> String {
    sensing(name, &format!("type = \"position\"\nof = \"{of}\""), part, target)
}

/// The cost by a path of equilibria of its own, from what its sensors record at the end.
fn cost(text: &ModelText, overrides: &[Override], of: &str) -> f64 {
    let model = text.model(overrides).unwrap();
    let mut statics = Statics::new(&model).unwrap();
    let mut last = Vec::new();
    let mut observe = |sample: &crate::sample::Sample| {
        last.clone_from(&sample.sensors);
        Ok(())
    };
    let outcome = statics.run(&mut observe, &mut |_, _| {}).unwrap();
    assert_eq!(outcome, RunOutcome::Done);
    let columns = statics.sensors().columns();
    let cost = |own: &holonom_model::Objective| {
        assert_eq!(own.at, CountedAt::End);
        let sensor = own.sensor.as_deref().unwrap();
        let named = columns.iter().position(|column| column.name() == sensor);
        let column = named.unwrap_or_else(|| {
            let (name, part) = sensor.split_once('.').unwrap();
            let first = columns.iter().position(|column| column.sensor == name).unwrap();
            first + part.parse::<usize>().unwrap()
        });
        0.5 * own.weight * (last[column] - own.target).powi(2)
    };
    let chosen = model.objectives.iter().filter(|own| of.is_empty() || own.name == of);
    chosen.map(cost).sum()
}

/// Derivatives by differences that are extrapolated twice.
fn differences(text: &ModelText, found: &ModelGradient, of: &str) -> Vec<f64> {
    let one = |own: &super::ByParameter| {
        let by = |e: f64| {
            let at = |sign: f64| {
                let value = own.value + sign * e * own.value.abs();
                let key = format!("parameters.{}", own.name);
                cost(text, &[Override::new(key, format!("{value:?}"))], of)
            };
            (at(1.0) - at(-1.0)) / (2.0 * e * own.value.abs())
        };
        let [a, b, c] = [4e-3, 2e-3, 1e-3].map(by);
        let [ab, bc] = [(4.0 * b - a) / 3.0, (4.0 * c - b) / 3.0];
        (16.0 * bc - ab) / 15.0
    };
    found.parameters.iter().map(one).collect()
}

/// The derivatives of each objective by itself against differences, in parts of the largest
/// relative slope.
fn compare(what: &str, text: &str, allowed: f64) {
    let text = ModelText::from_text(Path::new("model.toml"), text);
    let model = text.model(&[]).unwrap();
    for own in &model.objectives {
        let wanted = Wanted { of: vec![own.name.clone()], ..Wanted::everything() };
        let found = gradient(&text, &[], &model, &wanted);
        let found = found.unwrap_or_else(|error| panic!("{what}: {}: {error}", own.name));
        let j = cost(&text, &[], &own.name);
        let off = (found.value - j).abs() / j.abs();
        assert!(off < 1e-7, "{what}: {}: {} instead of {j}", own.name, found.value);
        let by = differences(&text, &found, &own.name);
        let scaled = |(own, by): (&super::ByParameter, &f64)| (own.value * by).abs();
        let size = found.parameters.iter().zip(&by).map(scaled).fold(j.abs(), f64::max);
        for (one, by) in found.parameters.iter().zip(&by) {
            let apart = (one.value * (one.derivative - by)).abs() / size;
            println!("{what}: {} by {}: {} {apart:.1e}", own.name, one.name, one.derivative);
            assert!(
                apart < allowed,
                "{what}: {} by {}: {} {by}",
                own.name,
                one.name,
                one.derivative
            );
        }
        assert!(found.parameters.len() > 1 && found.initial.is_empty());
    }
}

#[test]
fn a_loop_on_springs_has_the_derivatives_of_its_equilibrium() {
    let text = [
        FRAME.to_owned(),
        position("place", "top", "x", 1.0),
        sensing("lean", "type = \"joint_coordinate\"\nof = \"a\"", "", 0.9),
        sensing("held", "type = \"reaction\"\nof = \"a\"", "fx", 2.0),
        sensing("turns", "type = \"effort\"\nof = \"a\"", "spring", 1.0),
        sensing("length", "type = \"distance\"\nof = \"top\"\nto = \"left\"", "", 0.2),
    ]
    .concat();
    compare("frame", &text, 1e-8);
}

#[test]
fn laws_tables_signals_and_motors_count_in_equilibria() {
    let text = [
        MIXED.to_owned(),
        position("place", "bob", "z", 0.5),
        sensing("angle", "type = \"joint_coordinate\"\nof = \"hinge\"", "", 0.9),
        sensing("slid", "type = \"joint_coordinate\"\nof = \"slide\"", "", 0.9),
        sensing("tight", "type = \"reaction\"\nof = \"thread\"", "tension", 2.0),
        sensing("bent", "type = \"reaction\"\nof = \"hinge\"\nframe = \"space\"", "fz", 1.0),
    ]
    .concat();
    compare("mixed", &text, 1e-8);
}

/// A controller whose derivative rests at its error, a filter of it with a start of its own, and a
/// transfer function.
#[test]
fn signals_with_states_count_in_equilibria() {
    let pid = "pid = { of = \"turn - hinge - 0.1*c*slide\", proportional = \"= 0.3*gain\", derivative = \"= c\", filter = \"= 0.1*c\", feedforward = \"k*sin(turn)\" }\n\
               [[signal]]\nname = \"late\"\nfilter = { of = \"c*slow + hinge + 0.2*shaped\", time_constant = \"= 0.2*c\" }\nstart = \"= c\"\n\
               [[signal]]\nname = \"shaped\"\ntransfer = { of = \"hinge + 0.3*slow\", numerator = [\"= k\", 3.0], denominator = [1.0, \"= 2*k\", \"= 9*c\"] }";
    let mixed = [("value = \"hinge + 0.1*slide\"", pid), ("- 2*slow", "+ 2*late")];
    let text = [
        changed(MIXED, &mixed),
        position("place", "bob", "z", 0.5),
        sensing("angle", "type = \"joint_coordinate\"\nof = \"hinge\"", "", 0.9),
        sensing("acts", "type = \"effort\"\nof = \"stiffens\"", "", 2.0),
        sensing("shown", "type = \"expression\"\nvalue = \"late + c*slow\"", "", 2.0),
        sensing("bent", "type = \"reaction\"\nof = \"hinge\"\nframe = \"space\"", "fz", 1.0),
    ]
    .concat();
    compare("lag", &text, 1e-8);
}

#[test]
fn prescribed_motions_and_gears_count_in_equilibria() {
    let text = [
        DRIVEN.to_owned(),
        position("place", "three", "z", 0.5),
        sensing("drives", "type = \"effort\"\nof = \"leads\"", "0", 3.0),
        sensing("meshes", "type = \"effort\"\nof = \"wheels\"", "0", 3.0),
        sensing("pressed", "type = \"effort\"\nof = \"pushes\"", "0", 3.0),
        sensing("moves", "type = \"velocity\"\nof = \"cart\"", "x", 1.0),
        sensing("bears", "type = \"reaction\"\nof = \"q\"", "fx", 1.0),
    ]
    .concat();
    compare("driven", &text, 1e-8);
}

#[test]
fn a_soft_contact_counts_in_equilibria() {
    let text = [
        LYING.to_owned(),
        position("place", "ball", "z", 0.5),
        sensing("presses", "type = \"contact_force\"\nof = \"floor\"", "2", 3.0),
    ]
    .concat();
    compare("lying", &text, 1e-7);
}

/// The simulation of a model of beams as one of statics, without its own objectives.
fn stands(text: &str, steps: usize) -> String {
    let first = text.find("[[sensor]]").unwrap();
    let line = text.lines().find(|line| line.starts_with("simulation = ")).unwrap();
    let step = 1.0 / steps as f64;
    let own = format!("simulation = {{ step = {step:?}, end = 1.0, scheme = \"static\" }}");
    text[..first].replace(line, &own)
}

#[test]
fn beams_have_the_derivatives_of_their_equilibrium() {
    let still =
        [("speed = 0.7\n", ""), ("relaxation = 0.004\n", ""), ("\"= relaxation\"", "0.004")];
    let text = [
        changed(&stands(CANTILEVER, 4), &still),
        position("tip", "rod.end", "z", 0.1),
        sensing("bent", "type = \"section_force\"\nof = \"rod\"\nat = 0.3", "4", 1.0),
        sensing("cut", "type = \"section_force\"\nof = \"rod\"\nelement = 1", "2", 1.0),
        sensing("shear", "type = \"strain\"\nof = \"rod\"\nat = 0.6", "4", 0.5),
        sensing("gripped", "type = \"reaction\"\nof = \"grip\"\nframe = \"space\"", "fz", 1.0),
    ]
    .concat();
    compare("cantilever", &text, 1e-7);
    let text = [
        stands(LINKAGE, 3),
        position("middle", "coupler.1", "z", 0.1),
        sensing("pinned", "type = \"reaction\"\nof = \"pin\"", "fx", 1.0),
    ]
    .concat();
    compare("linkage", &text, 1e-7);
    let held = [
        ("type = \"spherical\"", "type = \"fixed\""),
        ("start = \"pinned\"", "start = \"clamped\""), // else turns about its own line are free
    ];
    let text = [changed(&stands(ROPE, 2), &held), position("tip", "weight", "y", 0.9)].concat();
    compare("rope", &text, 1e-7);
}

/// Beams that become longer with what they carry, or are longer than they are drawn.
#[test]
fn lengths_of_beams_count_in_equilibria() {
    let still =
        [("speed = 0.7\n", ""), ("relaxation = 0.004\n", ""), ("\"= relaxation\"", "0.004")];
    let text = [
        changed(&stands(&longer(), 4), &still[1..]),
        position("tip", "rod.end", "z", 0.1),
        sensing("bent", "type = \"section_force\"\nof = \"rod\"\nat = \"= 0.35*length\"", "4", 1.0),
        sensing("shear", "type = \"strain\"\nof = \"rod\"\nat = \"= 0.6 + 0.1*lift\"", "4", 0.5),
        sensing("gripped", "type = \"reaction\"\nof = \"grip\"\nframe = \"space\"", "fz", 1.0),
    ]
    .concat();
    compare("longer", &text, 1e-7);
    let held = [
        ("type = \"spherical\"", "type = \"fixed\""),
        ("start = \"pinned\"", "start = \"clamped\""),
        ("line = 0.3\n", "line = 0.3\nlength = 1.01\n"),
        ("elements = 4", "elements = 4\nlength = \"= length\""),
    ];
    let text = [changed(&stands(ROPE, 2), &held), position("tip", "weight", "y", 0.9)].concat();
    compare("slack rope", &text, 1e-7);
    let text = changed(&stands(CANTILEVER, 4), &still);
    let text = changed(
        &text,
        &[
            ("force = -30.0\n", "force = -30.0\nbow = 0.01\n"),
            (
                "[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]",
                "[[0.0, 0.0, 0.0], [0.5, 0.0, \"= bow\"], [1.0, 0.0, 0.0]]",
            ),
        ],
    );
    compare("corner", &[text, position("tip", "rod.end", "z", 0.1)].concat(), 1e-7);
}

/// Differences of `--check`, and a path by its arc length.
#[test]
fn checks_of_equilibria_agree() {
    let text = format!("{FRAME}{}", position("place", "top", "x", 1.0));
    let arc = changed(&text, &[("scheme = \"static\"", "scheme = \"static\", arc_length = true")]);
    let [own, arc] = [text, arc].map(|text| found(&text, true).unwrap());
    assert!(own.worst() < 1e-8 && own.checks.len() == 3, "{:e}", own.worst());
    assert_eq!(own.equilibrium.as_ref().unwrap().t, 1.0);
    for (a, b) in own.parameters.iter().zip(&arc.parameters) {
        assert!((a.derivative - b.derivative).abs() < 1e-8 * a.derivative.abs().max(1e-3), "{a:?}");
    }
}

#[test]
fn what_equilibria_do_not_have_is_refused_by_its_key() {
    let place = position("place", "top", "x", 1.0);
    let refused = |text: &str| found(text, false).unwrap_err().to_string();
    let along = changed(&place, &[("target = 1", "at = \"path\"\ntarget = 1")]);
    let error = refused(&format!("{FRAME}{along}"));
    assert!(
        error.contains("objective.o_place.at") && error.contains("path of equilibria"),
        "{error}"
    );
    let work = sensing("done", "type = \"work\"\nof = \"a\"", "spring", 1.0);
    let error = refused(&format!("{FRAME}{work}"));
    assert!(error.contains("objective.o_done.sensor") && error.contains("work"), "{error}");
    let lag = "rate = \"hinge + 0.1*slide\"";
    let lag = changed(MIXED, &[("value = \"hinge + 0.1*slide\"", lag)]);
    let error = refused(&format!("{lag}{}", position("at", "bob", "x", 1.0)));
    assert!(error.contains("signal.slow.rate") && error.contains("integrates"), "{error}");
    let text = ModelText::from_text(Path::new("model.toml"), format!("{FRAME}{place}"));
    let wanted = Wanted { parameters: false, ..Wanted::everything() };
    let error = gradient(&text, &[], &text.model(&[]).unwrap(), &wanted).unwrap_err().to_string();
    assert!(error.contains("simulation.scheme") && error.contains("joints begin"), "{error}");
    let time = "[[objective]]\nname = \"long\"\ntype = \"time\"\n";
    let error = refused(&format!("{FRAME}{time}"));
    assert!(error.contains("objective.long.type"), "{error}");
}

#[test]
fn an_equilibrium_that_is_unstable_is_told_and_one_without_stiffness_refused() {
    let at = |press: &str| {
        let text =
            changed(UPRIGHT, &[("name = \"press\"", "name = \"weight\""), ("press = 20.0", press)]);
        found(&format!("{text}{}", position("place", "rod", "z", 1.0)), false)
    };
    let beyond = at("press = 20.0").unwrap();
    println!("{:?} {:?}", beyond.equilibrium, beyond.warning());
    assert_eq!(beyond.equilibrium.as_ref().unwrap().unstable, 1);
    assert!(beyond.warning().unwrap().contains("unstable in one direction"));
    let before = at("press = 7.0").unwrap();
    assert!(before.equilibrium.as_ref().unwrap().unstable == 0 && before.warning().is_none());
    let error = at("press = 8.0").unwrap_err().to_string();
    println!("{error}");
    assert!(error.contains("simulation.end") && error.contains("without stiffness"), "{error}");
}
