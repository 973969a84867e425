//! The model file: what is read is what is written, and everything has its place.
#![allow(clippy::unwrap_used)] // a test

use holonom::model::{Inertia, LineColumn, ModelError, Override, Problem, line_column, locate};
use holonom::{Model, Simulation};
use proptest::prelude::*;

const MODELS: [&str; 6] = [
    include_str!("../../examples/models/pendulum.toml"),
    include_str!("../../examples/models/pendulum_free.toml"),
    include_str!("../../examples/models/free_body.toml"),
    include_str!("../../examples/models/heavy_top_fast.toml"),
    include_str!("../../examples/models/heavy_top_steady.toml"),
    include_str!("../../examples/models/four_particles.toml"),
];

const SLIDER_CRANK: &str = include_str!("../../examples/models/slider_crank.toml");

const EVERYTHING: &str = include_str!("../models/every_section.toml");

#[test]
fn what_is_read_is_what_is_written() {
    for text in MODELS.into_iter().chain([EVERYTHING, SLIDER_CRANK]) {
        let model = Model::from_toml(text).unwrap();
        let again = Model::from_toml(&model.to_toml()).unwrap();
        assert_eq!(model, again, "{}", model.to_toml());
        assert_eq!(model.to_toml(), again.to_toml());
    }
}

#[test]
fn what_the_text_leaves_open_is_filled_in() {
    let model = Model::from_toml(EVERYTHING).unwrap();
    let rod = model.body("b").unwrap();
    let mass = 7800.0 * std::f64::consts::PI * 1e-4;
    assert!((rod.mass.unwrap() - mass).abs() < 1e-12);
    assert!(matches!(rod.inertia, Some(Inertia::Principal([x, _, _])) if x > mass / 12.0));
    // Its third axis is along z, the spring is held at its upper end.
    assert!((model.springs[0].natural_length.unwrap() - (1.0f64 + 8.5 * 8.5).sqrt()).abs() < 1e-15);
}

#[test]
fn the_heavy_tops_turn_about_their_tips() {
    for text in [MODELS[3], MODELS[4]] {
        let model = Model::from_toml(text).unwrap();
        let top = &model.bodies[0];
        let arm = nalgebra::Vector3::from(top.position);
        let velocity = top.spatial_angular_velocity().cross(&arm);
        let error = (velocity - nalgebra::Vector3::from(top.velocity)).amax();
        assert!(error < 1e-14, "{}: the tip moves by {error:e} m/s", model.header.name);
    }
    let steady = Model::from_toml(MODELS[4]).unwrap();
    let axis = steady.bodies[0].rotation().column(2).into_owned();
    let from_tip = nalgebra::Vector3::from(steady.bodies[0].position) - axis * 0.075;
    assert!(from_tip.amax() < 1e-15, "the tip is {from_tip} away from the joint");
}

#[test]
fn replaced_values_are_checked_like_others() {
    let model = Model::from_toml(MODELS[0]).unwrap();
    let set = |key: &str, value: &str| model.with_overrides(&[Override::new(key, value)]);
    let heavier = set("particle.bob.mass", "2.5").unwrap();
    assert!((heavier.particles[0].mass - 2.5).abs() < 1e-15);
    assert_eq!(set("simulation.scheme", "reduced").unwrap().settings.scheme.name(), "reduced");
    assert!(matches!(set("particle.bob.mass", "0"), Err(ModelError::Invalid(_))));
    let longer = set("bar.rod.length", "2");
    let Err(ModelError::InconsistentStart(missed)) = longer else { panic!("{longer:?}") };
    assert!((missed[0].distance - 1.0).abs() < 1e-15);
    let moved = model.with_overrides(&[
        Override::new("bar.rod.length", "2"),
        Override::new("simulation.project_start", "true"),
    ]);
    assert!(moved.is_ok(), "the start may be moved onto the constraints");
}

#[test]
fn keys_have_places() {
    let place = |key: &str| {
        let span = locate(EVERYTHING, key).unwrap();
        (line_column(EVERYTHING, span.start), &EVERYTHING[span])
    };
    assert_eq!(place("joint.hinge.axis"), (LineColumn { line: 34, column: 8 }, "[0, 0, 2]"));
    assert_eq!(place("body.b.shape.density"), (LineColumn { line: 14, column: 61 }, "7800"));
    assert_eq!(place("load.swing.history.frequency").1, "2");
    assert_eq!(locate(EVERYTHING, "nothing"), None);
}

proptest! {
    /// Whatever the text, there is an answer and no panic, and places lie within the text.
    #[test]
    fn no_text_is_too_odd(line in 0usize..98, junk in "[\\PC\n]{0,12}", replace: bool) {
        let mut lines: Vec<&str> = EVERYTHING.lines().collect();
        let line = line.min(lines.len() - 1);
        if replace { lines[line] = &junk } else { lines.insert(line, &junk) }
        let text = lines.join("\n");
        if let Err(error) = Model::from_toml(&text) {
            for problem in error.problems(&text) {
                if let Some(span) = problem.span {
                    prop_assert!(span.end <= text.len());
                    prop_assert!(line_column(&text, span.start).line <= text.lines().count() + 1);
                }
            }
        }
    }

    /// Numbers survive the resolved model bit for bit.
    #[test]
    fn numbers_survive(x in -1e50f64..1e50, y in proptest::num::f64::NORMAL) {
        prop_assume!(y.abs() < 1e100 && (x != 0.0 || y != 0.0));
        let text = MODELS[0].replace("[1.0, 0.0]", &format!("[{x:?}, {y:?}]"))
            .replace("length = 1.0", "");
        if let Ok(model) = Model::from_toml(&text) {
            let again = Model::from_toml(&model.to_toml()).unwrap();
            prop_assert_eq!(again.particles[0].position[1].to_bits(), y.to_bits());
            prop_assert_eq!(model, again);
        }
    }
}

/// A model with a body of this shape beside one that moves.
fn with_shape(shape: &str, more: &str) -> String {
    format!(
        "[model]\nname = \"shape\"\n[simulation]\nstep = 0.01\nend = 0.1\n[[body]]\nname = \"part\"\n{more}\n\
         shape = {shape}\n[[body]]\nname = \"other\"\nmass = 1.0\ninertia = [1.0, 1.0, 1.0]\n"
    )
}

#[test]
fn a_fixed_shape_without_density_is_written_as_it_is_read() {
    let text = with_shape("{ type = \"box\", dimensions = [1.0, 1.0, 0.1] }", "fixed = true");
    let model = Model::from_toml(&text).unwrap();
    assert_eq!((model.bodies[0].mass, &model.bodies[0].inertia), (None, &None));
    assert_eq!(Model::from_toml(&model.to_toml()).as_ref(), Ok(&model));
}

#[test]
fn shapes_whose_mass_or_inertia_rounds_to_nothing_are_refused_by_name() {
    let cone = "{ type = \"cone\", dimensions = [0.05, 5e-324], density = 2700.0 }";
    let ball = "{ type = \"sphere\", dimensions = [1e-90], density = 2700.0 }";
    for (shape, key) in [(cone, "body.part.mass"), (ball, "body.part.inertia")] {
        let text = with_shape(shape, "");
        let problems = Model::from_toml(&text).unwrap_err().problems(&text);
        println!("{problems:?}");
        assert!(problems.iter().any(|p| p.key == key && p.help.is_some()), "{problems:?}");
    }
}

#[test]
fn an_override_of_too_many_parts_is_refused() {
    let text = with_shape("{ type = \"sphere\", dimensions = [0.1], density = 700.0 }", "");
    let key = format!("model{}", ".a".repeat(65_000));
    let error = Model::from_toml_with(&text, &[Override::new(key, "1")]).unwrap_err();
    let problems = error.problems(&text);
    println!("{problems:?}");
    assert!(problems[0].message.contains("65001 parts") && problems[0].key.len() < 200);
}

#[test]
fn what_follows_from_valid_numbers_is_refused_with_a_remedy() {
    let steep = "\n[[load]]\nname = \"steep\"\nbody = \"other\"\nforce = [1.0, 0.0, 0.0]\n\
                 history = { type = \"linear\", end = 5e-324 }\n";
    let thin = "\n[[body]]\nname = \"needle\"\nmass = 1.0\ninertia = [1.0, 1.0, 0.0]\n";
    let shape = with_shape("{ type = \"sphere\", dimensions = [0.1], density = 700.0 }", "");
    for (more, name) in [(steep, "other"), (thin, "needle")] {
        let text = shape.clone() + more;
        let error = Simulation::new(&Model::from_toml(&text).unwrap()).expect_err("refused");
        let problems = error.problems(&text);
        println!("{problems:?}");
        let helps = |p: &Problem| p.help.is_some() && p.to_string().contains(name);
        assert!(problems.iter().all(helps), "{problems:?}");
    }
}
