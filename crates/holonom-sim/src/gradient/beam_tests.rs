//! Gradients by numbers of beams and of relaxed starts against central differences of whole runs,
//! and what is refused.

use super::beam_models::{BLADE, CANTILEVER, CARRIED, CHAIN, FLYING, LINKAGE, ROPE};
use super::comparison::{PATH, SeenNumber, Worst, seen};
use super::force_models::without_objectives;
use super::prepared::{Begin, Prepared};
use super::tests::{changed, check, found};
use crate::design;
use crate::system::outside::ExternalActions;
use holonom_model::ModelText;
use std::path::Path;
use vi_control::sensitivities::{Beside, Direction, Sensitivities};

#[test]
fn sections_change_a_cantilever() {
    check("cantilever", CANTILEVER, 1e-8);
}

#[test]
fn full_matrices_change_a_beam_that_flies() {
    check("flying", FLYING, 1e-8);
}

/// The rates of free nodes are kept beside those that a joint states.
#[test]
fn nodes_keep_their_rates_beside_those_of_joints() {
    let wheel = "[[body]]\nname = \"wheel\"\nmass = 0.2\ninertia = [0.01, 0.01, 0.02]\nposition = [3.0, 0.0, 0.0]\n[[joint]]\nname = \"axle\"\ntype = \"revolute\"\nparent = \"ground\"\nchild = \"wheel\"\nposition = [3.0, 0.0, 0.0]\naxis = [0.0, 0.0, 1.0]\nrate = \"= 0.3*spin\"\n[[beam]]\nname = \"wing\"";
    check("wheel", &changed(FLYING, &[("[[beam]]\nname = \"wing\"", wheel)]), 1e-8);
}

/// A beam takes the motion of what moves it, and a second one that of the first.
#[test]
fn beams_are_carried_by_rates_of_joints() {
    check("carried", CARRIED, 1e-8);
    let order = changed(CARRIED, &[("step = 0.002", "step = 0.002, order = 4")]);
    check("carried, order 4", &order, 1e-8);
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

/// A load that changes moves what hangs, so that parameters count along the run as well.
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
}

/// By tangents beside the run.
fn forward(text: &str) -> Vec<(String, f64)> {
    let text = ModelText::from_text(Path::new("model.toml"), text);
    let model = text.model(&[]).unwrap();
    let mut prepared = Prepared::new(&model, &[], &[], &ExternalActions::default()).unwrap();
    let tangents = design::tangents(&text, &[], &model, &prepared.system).unwrap();
    prepared.depend(&[], &super::Prices::default(), &tangents).unwrap();
    let begin = Begin::new(&mut prepared).unwrap();
    let design = crate::design::mechanism_design(&prepared.system, &begin.mass, &tangents).unwrap();
    let of = begin.of(&model, &prepared.system.mechanism);
    let run = prepared.simulation.integrator();
    let changes = begin.changes(&of, run, &design, &tangents).unwrap();
    let all = tangents.iter().zip(&changes).enumerate();
    let directions = all.map(|(k, (own, change))| Direction {
        start: begin.tangent(run, change, Some(own)),
        parameter: Some(k),
        ..Direction::default()
    });
    let mut beside = Sensitivities::new(run, model.settings.step, directions.collect()).unwrap();
    let (controls, objective) = (&prepared.controls, &prepared.costs.sum);
    let with = Beside { controls, design: Some(&design), objective };
    for _ in 0..prepared.steps {
        beside.advance(run, with).unwrap();
    }
    let rates = beside.rates(with, run.state());
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

/// A cantilever with a load along it that turns with it.
fn rod(strain: &str, element: &str) -> String {
    let strain = format!("end = 0.1, strain = \"{strain}\" }}");
    let element = format!("elements = 4\nelement = \"{element}\"");
    let text = without_objectives(CANTILEVER);
    let load = "[[load]]\nname = \"tug\"\nbeam = \"rod\"\nat = 0.3\n\
                force = [\"= 0.3*line\", 2.0, -4.0]\nframe = \"body\"\n";
    changed(&text, &[("end = 0.1 }", &strain), ("elements = 4", &element)]) + load
}

/// Strains and section forces in the middle of an element, and between those of mean directors.
#[test]
fn sections_of_beams_agree_with_differences() {
    let mut worst = Worst::default();
    for (strain, element, place, at) in [
        ("averaged", "helicoidal", "element = 1\n", ""),
        ("averaged", "helicoidal", "element = 2\n", PATH),
        ("mass_scaled", "helicoidal", "element = 0\n", ""),
        ("mass_scaled", "second_order", "element = 0\n", PATH),
        ("averaged", "mean_directors", "at = 0.4\n", PATH),
    ] {
        println!("{element}, {strain}, {place}{at}");
        let parts = &["0", "2", "4"];
        let all = [("section_force", "rod", place, &parts[..]), ("strain", "rod", place, parts)];
        worst.compare_all(&rod(strain, element), &seen(&all, at), [1e-8, 1e-11]);
    }
    let first = "element = 1\n";
    let all = [("section_force", "wing", first, &["3"][..]), ("strain", "wing", first, &["5"][..])];
    worst.compare_all(&without_objectives(FLYING), &seen(&all, PATH), [1e-8, 1e-11]);
}

/// A load along the rod of which a parameter changes the history, and a weight that one changes.
fn loaded(text: &str) -> String {
    let gust = "[[load]]\nname = \"gust\"\nbeam = \"rod\"\nforce = [1.0, 2.0, 0.5]\n\
                history = \"1 + sin(pulse*t)\"\n";
    let pairs = [("speed = 0.7\n", "pulse = 30.0\nweight = -9.81\n"), ("-9.81]", "\"= weight\"]")];
    changed(text, &pairs) + gust
}

/// Of derivatives and differences, and of forward and backward: accelerations of a beam are rounded
/// by what its stiffness makes of its coordinates.
const APART: [f64; 2] = [1e-8, 1e-10];

/// The same of a soft rod for a short while, so that differences resolve much.
fn soft(text: &str) -> String {
    changed(text, &[("young = 2.0e9", "young = 2.0e7"), ("end = 0.1", "end = 0.03")])
}

/// Within an element the inertia of the beam, its weight and its loads enter.
#[test]
fn sections_within_elements_agree_with_differences() {
    let mut worst = Worst::default();
    for (strain, element, place, at) in [
        ("averaged", "helicoidal", 0.35, ""),
        ("averaged", "helicoidal", 0.3, PATH),
        ("mass_scaled", "helicoidal", 0.0, ""),
        ("mass_scaled", "helicoidal", 0.28, PATH),
        ("mass_scaled", "second_order", 0.9, PATH),
        ("dissipative", "helicoidal", 0.35, PATH),
        ("dissipative", "helicoidal", 0.2, ""),
    ] {
        println!("{element}, {strain}, at {place} {at}");
        let place = format!("at = {place}\n");
        let all = [
            ("section_force", "rod", place.as_str(), &["1", "4"][..]),
            ("strain", "rod", &place, &["2"]),
        ];
        worst.compare_all(&soft(&loaded(&rod(strain, element))), &seen(&all, at), APART);
    }
}

/// The same by the acceleration level of all nodes.
#[test]
fn sections_within_elements_in_galerkin_steps_agree_with_differences() {
    let text = soft(&loaded(&rod("averaged", "helicoidal")));
    let text = changed(&text, &[("strain = \"averaged\"", "method = \"galerkin\", order = 4")]);
    let place = "at = 0.35\n";
    let mut all = seen(&[("section_force", "rod", place, &["4"])], "");
    all.extend(seen(&[("strain", "rod", place, &["2"])], PATH));
    Worst::default().compare_all(&text, &all, APART);
}

/// Strains are interpolated between the control points of a step, those of the midpoint rule are
/// not.
#[test]
fn sections_change_galerkin_steps() {
    for (order, strain) in [(4, "averaged"), (6, "averaged"), (4, "midpoint")] {
        let element = if strain == "midpoint" { "mean_directors" } else { "helicoidal" };
        let element = format!("elements = 4\nelement = \"{element}\"");
        let by =
            format!("end = 0.1, strain = \"{strain}\", method = \"galerkin\", order = {order} }}");
        let text = changed(CANTILEVER, &[("end = 0.1 }", &by), ("elements = 4", &element)]);
        check(&format!("{strain}, order {order}"), &text, 1e-8);
    }
}

/// Steps add to the masses that carry the momentum of a node, by the configuration and by the
/// bounds of tension that follow it.
#[test]
fn velocities_of_beams_agree_with_differences() {
    let mut worst = Worst::default();
    for (strain, element) in [
        ("mass_scaled", "helicoidal"),
        ("mass_scaled", "mean_directors"),
        ("dissipative", "helicoidal"),
    ] {
        println!("{strain}, {element}");
        let all = [
            ("type = \"velocity\"\nof = \"rod.2\"\n", "2", PATH),
            ("type = \"angular_velocity\"\nof = \"rod.end\"\n", "1", ""),
            ("type = \"acceleration\"\nof = \"rod.3\"\n", "1", PATH),
            (
                "type = \"expression\"\nvalue = \"rod.3.vz*rod.1.z + 0.1*tip_a.z\"\n[[sensor]]\n\
                 name = \"tip_a\"\ntype = \"acceleration\"\nof = \"rod.end\"\n",
                "",
                PATH,
            ),
        ];
        let all = all.map(|(sensor, part, at)| SeenNumber::new(sensor, part, at));
        worst.compare_all(&soft(&loaded(&rod(strain, element))), &all, APART);
    }
    let all = [("velocity", "rope.2", "", &["0"][..])];
    let all: Vec<_> = ["", PATH].into_iter().flat_map(|at| seen(&all, at)).collect();
    worst.compare_all(&without_objectives(ROPE), &all, APART);
}
