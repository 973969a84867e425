//! Numbers that a model file may not state: distances without a direction, lengths too large to
//! compute with, vectors with an entry too many.

#![allow(clippy::unwrap_used)] // a test

use crate::harness::hostile::{hinge, hostile, refusal, run};
use holonom::Model;
use holonom::simulation::RunOutcome;

#[test]
fn springs_between_coincident_points_need_no_direction_or_are_refused() {
    let text = hostile("zero_length_spring");
    let words = refusal(&text).expect("refused");
    println!("{words}");
    assert!(words.contains("spring.s") && words.contains("no direction"), "{words}");
    let damped = text.replace("natural_length = 1.0", "damping = 2.0");
    assert!(refusal(&damped).is_some_and(|words| words.contains("no direction")));
    for law in ["natural_length = 0.0", "", "natural_length = 1.0\nlaw = \"quadratic_stretch\""] {
        let (outcome, largest) = run(&text.replace("natural_length = 1.0", law));
        assert!(outcome == RunOutcome::Done && largest < 1e-14, "{law}: {outcome:?}");
    }
    // held at a rotated body: the points coincide but for rounding
    let held = text.replace(
        "inertia = [1.0, 1.0, 1.0]",
        "inertia = [1.0, 1.0, 1.0]\nposition = [0.1, 0.2, 0.3]\nrotation_vector = [0.3, -0.7, 0.2]",
    );
    let held = held.replace(
        "natural_length = 1.0",
        "point_from = [0.1, 0.2, 0.3]\npoint_to = [0.0, 0.0, 0.0]",
    );
    let (outcome, largest) = run(&held);
    assert!(outcome == RunOutcome::Done && largest < 1e-14, "{outcome:?}");
}

#[test]
fn numbers_that_follow_can_be_stated_again() {
    let base = "[model]\nname = \"m\"\n[simulation]\nstep = 0.01\nend = 0.1\n";
    let body = |name: &str, x: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nposition = [{x}, {x}, 0.0]\n\
             shape = {{ type = \"cylinder\", dimensions = [1.0, 2.0], density = 1.0 }}\n"
        )
    };
    let spring = "[[spring]]\nname = \"s\"\nfrom = \"a\"\nto = \"b\"\nstiffness = 0.0\n";
    for (text, key) in [
        (format!("{base}{}{}{spring}", body("a", "1e100"), body("b", "-1e100")), "spring.s"),
        (
            format!("{base}{}", body("a", "0.0").replace("[1.0, 2.0]", "[1e30, 1e60]")),
            "body.a.mass",
        ),
    ] {
        let words = refusal(&text).expect("refused");
        println!("{words}");
        assert!(words.contains(key) && words.contains("too large"), "{words}");
    }
    let text = format!("{base}{}{}{spring}", body("a", "1e50"), body("b", "-1e50"));
    let model = Model::from_toml(&text).unwrap();
    assert_eq!(Model::from_toml(&model.to_toml()).unwrap(), model);
}

#[test]
fn vectors_have_exactly_the_entries_they_need() {
    let words = refusal(&hostile("vector_too_long")).unwrap();
    println!("{words}");
    assert!(words.contains("body.a.position: 6 given where 3 entries are needed"), "{words}");
    let base = hinge(&["{}"], false);
    for (old, new, key) in [
        ("position = [0.5, 0.0, 0.0]", "position = [0.5, 0.0, 0.0, 1.0]", "body.a.position"),
        ("position = [0.5, 0.0, 0.0]", "position = [0.5, 0.0]", "body.a.position"),
        ("inertia = [1.0, 1.0, 1.0]", "inertia = [1.0, 1.0, 1.0, 1.0]", "body.a.inertia"),
        (
            "inertia = [1.0, 1.0, 1.0]",
            "inertia = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]",
            "body.a.inertia",
        ),
        ("mass = 1.0", "mass = 1.0\nquaternion = [1.0, 0.0, 0.0, 0.0, 5.0]", "body.a.quaternion"),
        ("axis = [0.0, 1.0, 0.0]", "axis = [0.0, 1.0, 0.0, \"up\"]", "joint.j0.axis"),
        (
            "type = \"motion\"\njoint = \"j0\"\npath = {}",
            "type = \"distance\"\nfrom = \"ground\"\nto = \"a\"\npoint_to = [1.0, 2.0, 3.0, {}]",
            "constraint.m0.point_to",
        ),
        (
            "type = \"motion\"\njoint = \"j0\"\npath = {}",
            "type = \"gear\"\njoints = [\"j0\", \"j0\", \"j0\"]\nratio = 1.0",
            "constraint.m0.joints",
        ),
    ] {
        assert!(base.contains(old), "{old}");
        let text = base.replacen(old, new, 1);
        let error = Model::from_toml(&text).unwrap_err();
        let problems = error.problems(&text);
        println!("{new}: {problems:?}");
        assert_eq!(problems[0].key, key, "{new}");
        let span = problems[0].span.clone().unwrap();
        assert!(new.contains(&text[span]), "{new}");
    }
}
