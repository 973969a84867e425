//! Curved beams of sections with unlike stiffnesses and ropes that sag: warnings where elements are
//! too long, and frequencies that are right where there is none; what stands for elements with more
//! nodes.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark::model;
use holonom::modes::{About, ModalAnalysis, ModeKind};
use holonom::run::prepare;
use holonom::{Model, Simulation};
use vi_testkit::model::{beam, cantilever, head, heavy, load, section, soft_section};

/// A half circle of radius 1 that is clamped at its start, curved about `d_1`.
fn arc([about_1, about_2, twist]: [f64; 3], elements: usize) -> String {
    let own = section([1e6, 1e6, 1e6, about_1, about_2, twist], [1.0, 1e-3, 1e-3]);
    format!(
        "{}[[beam]]\nname = \"arc\"\nelements = {elements}\nnormal = [0, 0, 1]\nstart = \"clamped\"\n\
         curve = {{ type = \"arc\", from = [0, 0, 0], center = [1, 0, 0], axis = [0, 0, -1], angle = {:?} }}\n{own}",
        heavy("arc", [0.0; 3], "step = 0.01, end = 0.01"),
        std::f64::consts::PI
    )
}

fn warnings(model: &Model) -> Vec<String> {
    Simulation::new(model).unwrap().assembly().warnings.clone()
}

/// Frequencies of the three slowest vibrations, Hz.
fn slowest(model: &Model) -> [f64; 3] {
    let report = ModalAnalysis::new(model, About::Start).unwrap().modes(3).unwrap();
    std::array::from_fn(|k| report.modes[k].frequency)
}

#[test]
fn elements_too_long_for_their_curvature_are_named_where_frequencies_are_wrong() {
    let members = [
        ("strip", [1.0, 400.0, 1.5]),
        ("blade", [1.0, 10.0, 0.3]),
        ("open section", [50.0, 1.0, 0.01]),
    ];
    for (name, stiffness) in members {
        let exact = slowest(&model(&arc(stiffness, 40), &[]));
        let mut worst_warned = 0.0_f64;
        for elements in [2, 4, 8, 16] {
            let own = model(&arc(stiffness, elements), &[]);
            let found = slowest(&own);
            let off = (0..3).map(|k| (found[k] / exact[k] - 1.0).abs()).fold(0.0, f64::max);
            let warned = warnings(&own).iter().any(|text| text.contains("times as many elements"));
            println!("{name}, {elements} elements: off by {off:.1e}, warned: {warned}");
            assert!(warned || off < 0.03, "{name}, {elements} elements: off by {off:.1e}");
            worst_warned = worst_warned.max(if warned { off } else { 0.0 });
        }
        assert!(worst_warned > 0.05, "{name}: the warning says nothing");
    }
    let equal = warnings(&model(&arc([1.0; 3], 4), &[]));
    assert!(equal.is_empty(), "{equal:?}");
    let mean = [("beam.arc.element", "mean_directors")];
    assert!(warnings(&model(&arc([1.0, 400.0, 1.5], 4), &mean)).is_empty());
}

/// What the modes about the equilibrium warn of, how many are unstable, the three slowest, Hz.
fn about_equilibrium(model: &Model) -> (Vec<String>, usize, Vec<f64>) {
    let report = ModalAnalysis::new(model, About::Static).unwrap().modes(3).unwrap();
    let slowest = report.modes.iter().filter(|mode| mode.kind == ModeKind::Vibration);
    (report.warnings, report.unstable, slowest.map(|mode| mode.frequency).collect())
}

/// Straight without stress, bent by a force at the tip: the curvature is that of the load.
#[test]
fn elements_too_long_for_the_curvature_of_loads_are_named_where_frequencies_are_wrong() {
    let members = [
        ("strip", [1.0, 400.0, 1.5], [0.0, 0.0, 12.0]),
        ("blade", [1.0, 40.0, 0.3], [0.0, 0.0, 12.0]),
        ("open section", [50.0, 1.0, 0.02], [0.0, 12.0, 0.0]),
    ];
    for (name, [about_1, about_2, twist], force) in members {
        let own = section([1e6, 1e6, 1e6, about_1, about_2, twist], [1.0, 1e-3, 1e-3]);
        let of = |elements: usize| {
            let text = head(name, "step = 0.25, end = 1.0, scheme = \"static\"")
                + &cantilever(elements, &own)
                    .replace("normal = [0.0, 0.0, 1.0]", "normal = [0.0, 1.0, 0.0]")
                + &load("tip", "beam.end", [force, [0.0; 3]]);
            model(&text, &[])
        };
        let exact = about_equilibrium(&of(60)).2;
        let mut worst_warned = 0.0_f64;
        for elements in [2, 4, 8, 16, 32] {
            let (warnings, _, found) = about_equilibrium(&of(elements));
            let off = found.iter().zip(&exact).map(|(own, exact)| (own / exact - 1.0).abs());
            let off = off.fold(0.0, f64::max);
            let warned = warnings.iter().any(|text| text.contains("elements = "));
            println!("{name}, {elements} elements: off by {off:.1e}, warned: {warned}");
            assert!(warned || off < 0.03, "{name}, {elements} elements: off by {off:.1e}");
            worst_warned = worst_warned.max(if warned { off } else { 0.0 });
        }
        assert!(worst_warned > 0.05, "{name}: the warning says nothing");
        // statics and a run end with the same warning
        let mut run = prepare(&of(4)).unwrap();
        run.run(&mut |_| Ok(()), &mut |_, _| {}).unwrap();
        let said = run.warnings();
        assert!(said.iter().any(|text| text.contains("is curved or twisted by")), "{said:?}");
    }
}

/// Between walls: stiff in twist, soft in twist, between places of unlike height.
#[test]
fn a_rope_of_default_elements_is_named_where_it_has_false_directions() {
    let level = [10.0, 0.0, 0.0];
    let members = [
        ("rope", 1e-4, 1e-4, level),
        ("tape", 0.1, 0.01, level),
        ("steep", 1e-3, 5e-4, [8.0, 0.0, -5.0]),
    ];
    for (name, bending, twist, end) in members {
        let own = section([1e6, 1e5, 1e5, bending, bending, twist], [1.0, 1e-6, 1e-6]);
        let of = |elements: usize, element: &str| {
            let settings = "step = 0.01, end = 0.1, start = \"relaxed\"";
            let text = heavy(name, [0.0, 0.0, -9.81], settings)
                + &beam("rope", &[[0.0; 3], end], elements)
                + "length = 11.0\nstart = \"pinned\"\nend = \"pinned\"\n"
                + &own;
            model(&text, &[("beam.rope.element", element)])
        };
        let mut named = 0;
        for elements in [10, 20, 40, 80] {
            let (warnings, unstable, _) = about_equilibrium(&of(elements, "\"helicoidal\""));
            let sags = |all: &[String]| all.iter().any(|text| text.contains("element = \"rope\""));
            println!(
                "{name}, {elements} elements: {unstable} unstable, named: {}",
                sags(&warnings)
            );
            assert!(unstable == 0 || sags(&warnings), "{name}, {elements}: {unstable} unstable");
            named += usize::from(unstable > 0);
            let (warnings, unstable, _) = about_equilibrium(&of(elements, "\"rope\""));
            assert!(unstable == 0 && !sags(&warnings), "{name}: {unstable}, {warnings:?}");
            if elements == 10 {
                // `check` and a run say it as well
                let said = self::warnings(&of(10, "\"helicoidal\""));
                assert!(sags(&said), "{said:?}");
            }
        }
        assert!(named > 0, "{name}: nothing is wrong");
    }
}

#[test]
fn elements_with_more_nodes_stand_for_several_with_two() {
    let text = heavy("cantilever", [0.0, 0.0, -1.0], "step = 1e-3, end = 1e-3")
        + &cantilever(4, &soft_section());
    let slow = slowest(&model(&text, &[("beam.beam.elements", "12")]));
    for (order, elements) in [("2", "8"), ("3", "12")] {
        let own = model(&text, &[("beam.beam.order", order)]);
        let simulation = Simulation::new(&own).unwrap();
        assert_eq!(simulation.assembly().counts.elements.to_string(), elements);
        let warning = &warnings(&own)[0];
        let advice = format!("write elements = {elements} and remove `order`");
        assert!(warning.contains("beam.beam.order") && warning.contains(&advice), "{warning}");
        if order == "3" {
            assert_eq!(slowest(&own).map(f64::to_bits), slow.map(f64::to_bits));
        }
    }
    assert!(warnings(&model(&text, &[])).is_empty());
}
