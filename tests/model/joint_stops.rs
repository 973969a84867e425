//! Stops and dry friction of joints: what is refused, and where the energy goes.

#![allow(clippy::unwrap_used)] // a test

use holonom::{Model, ModelError, RunOutcome, Sample};
use vi_testkit::model::{changed, head, hinge, sensor, slider};

fn problem(text: &str) -> String {
    match Model::from_toml(text) {
        Err(ModelError::Invalid(problems)) => {
            let first = &problems[0];
            format!("{}: {} | {}", first.key, first.message, first.help.clone().unwrap_or_default())
        }
        other => panic!("{text} is refused: {other:?}"),
    }
}

fn cart(keys: &str) -> String {
    head("cart", "step = 0.01, end = 0.1") + &slider("cart", "slide", 1.0) + keys + "\n"
}

#[test]
fn limits_that_cannot_hold_are_refused_with_what_to_write() {
    for (keys, says) in [
        ("limits = [0.5, -0.5]", "the lower limit 0.5 is not below the upper one -0.5"),
        ("limits = [0.1, 1.0]", "`slide` starts at 0, outside of its limits 0.1 … 1"),
        ("limits = { upper = -0.2 }", "starts at 0, outside of its limits  … -0.2"),
        ("limits = {}", "limits without a limit"),
        (
            "limits = { upper = 1.0, restitution = 1.2 }",
            "restitution of the limits of `slide` is 1.2",
        ),
        ("bumper = { stiffness = 10.0 }", "a bumper stands at a limit"),
        ("limits = [-1, 1]\nbumper = { stiffness = -1.0 }", "the stiffness -1 is not positive"),
        ("limits = [-1, 1]\nbumper = { stiffness = 1.0, damping = -1.0 }", "feed energy in"),
        (
            "limits = { upper = 1.0, restitution = 0.5 }\nbumper = { stiffness = 1.0 }",
            "a bumper has no restitution",
        ),
        ("friction = { torque = 1.0 }", "coordinate 0 of the joint is a displacement"),
        ("friction = {}", "friction without an effort"),
        ("friction = { force = -1.0 }", "-1 is negative"),
        ("friction = { coefficient = 0.1, radius = 0.1 }", "a displacement has no radius"),
        ("friction = { force = 1.0, coefficient = 0.1 }", "friction is stated twice"),
    ] {
        let said = problem(&cart(keys));
        println!("{said}");
        assert!(said.contains(says), "{keys}: {said}");
    }
    let drum = head("drum", "step = 0.01, end = 0.1")
        + &vi_testkit::model::body("drum", 1.0, [1.0; 3])
        + &hinge("pin", ["ground", "drum"], [0.0; 3], [0.0, 1.0, 0.0]);
    let said = problem(&(drum + "friction = { coefficient = 0.1 }\n"));
    assert!(said.contains("the radius of the pin is missing"), "{said}");
}

#[test]
fn schemes_without_impulses_are_refused_by_name() {
    for keys in ["limits = [-1.0, 1.0]", "friction = { force = 1.0 }"] {
        for (old, new, says) in [
            ("end = 0.1", "end = 0.1, scheme = \"em-nodal\"", "the scheme em-nodal"),
            ("end = 0.1", "end = 0.1, order = 4", "with order 2, not 4"),
            ("end = 0.1", "end = 0.1, scheme = \"static\"", "statics has no equilibria"),
            ("end = 0.1", "end = 0.1, start = \"relaxed\"", "no relaxed start"),
        ] {
            let said = problem(&changed(&cart(keys), old, new));
            assert!(said.contains(says), "{said}");
        }
    }
    // elastic stops are forces: every scheme has them
    let elastic = cart("limits = [-1.0, 1.0]\nbumper = { stiffness = 10.0 }");
    for scheme in ["em-nodal", "constrained", "dalembert", "reduced"] {
        let new = format!("end = 0.1, scheme = \"{scheme}\"");
        Model::from_toml(&changed(&elastic, "end = 0.1", &new)).unwrap();
    }
}

/// A pendulum falls on its stop again and again: what the impacts take is in the balance, and the
/// run does not warn.
#[test]
fn impacts_are_part_of_the_balance_of_the_energy() {
    let text = "model = { name = \"door\", gravity = [0.0, 0.0, -9.81] }\n\
                simulation = { step = 0.005, end = 2.0 }\n\
                [[body]]\nname = \"rod\"\nmass = 1.0\n\
                inertia = [0.0001, 0.053333333333333344, 0.053333333333333344]\n\
                position = [0.33658839392315865, 0.0, -0.21612092234725588]\n\
                rotation_vector = [0.0, 0.5707963267948966, 0.0]\n"
        .to_owned()
        + &hinge("hinge", ["ground", "rod"], [0.0; 3], [0.0, -1.0, 0.0])
        + "limits = { lower = -1.0, restitution = 0.7 }\n"
        + &sensor("angle", "joint_coordinate", "hinge");
    for (keys, column) in
        [("", "work.hinge.stop"), ("friction = { torque = 0.5 }\n", "work.hinge.friction")]
    {
        let text = changed(&text, "limits", &format!("{keys}limits"));
        let model = Model::from_toml(&text).unwrap();
        let mut run = holonom::run::prepare(&model).unwrap();
        let mut rows: Vec<Sample> = Vec::new();
        let mut observe = |sample: &Sample| {
            rows.push(sample.clone());
            Ok(())
        };
        let outcome = run.run(&mut observe, &mut |_, _| {}).unwrap();
        assert!(matches!(outcome, RunOutcome::Done), "{outcome:?}");
        let columns = run.energy_columns();
        let of = |name: &str| columns.iter().position(|own| own == name).unwrap();
        let (work, balance, total) = (of(column), of("balance"), of("total"));
        let unbalanced = rows.iter().map(|row| row.energies[balance].abs()).fold(0.0, f64::max);
        let lost = rows[rows.len() - 1].energies[work];
        let change = rows[rows.len() - 1].energies[total] - rows[0].energies[total];
        println!("{column}: {lost:.4} J of {change:.4} J, balance to {unbalanced:.1e} J");
        assert!(lost < -0.5 && unbalanced < 2e-4 * 5.0, "{lost} {unbalanced:e}");
        let works = rows.windows(2).map(|two| two[1].energies[work] - two[0].energies[work]);
        assert!(works.fold(f64::MIN, f64::max) < 1e-3, "it takes energy out");
    }
}

/// The model of the guide: the door bounces off its frame and comes to rest by the friction of its
/// hinge; impacts and friction take out all of its energy.
#[test]
fn the_door_of_the_guide_comes_to_rest() {
    let page = include_str!("../../docs/guide/src/stops.md");
    let begin = page.find("```toml\n").unwrap() + 8;
    let text = &page[begin..begin + page[begin..].find("```").unwrap()];
    let model = Model::from_toml(text).unwrap();
    let mut run = holonom::run::prepare(&model).unwrap();
    let mut rows: Vec<Sample> = Vec::new();
    let mut observe = |sample: &Sample| {
        rows.push(sample.clone());
        Ok(())
    };
    assert!(matches!(run.run(&mut observe, &mut |_, _| {}).unwrap(), RunOutcome::Done));
    let columns = run.energy_columns();
    let of = |name: &str| columns.iter().position(|own| own == name).unwrap();
    let last = &rows[rows.len() - 1];
    let inertia = 30.0 * (0.9 * 0.9 + 0.04 * 0.04) / 12.0 + 30.0 * 0.45 * 0.45;
    // ½ J ω² falls by τ φ up to the stop at 1.2 rad, to e² of that in the impact, and by the rest
    let start = 0.5 * inertia * 1.5 * 1.5;
    let hit = start - 1.0 * 1.2;
    let [stop, friction] =
        ["work.hinge.stop", "work.hinge.friction"].map(|name| last.energies[of(name)]);
    println!("stop {stop:.6} J, friction {friction:.6} J of {start:.6} J");
    assert!((stop + hit * (1.0 - 0.4 * 0.4)).abs() < 1e-3 * hit, "{stop} {hit}");
    assert!(friction < -1.2 && last.energies[of("balance")].abs() < 1e-3 * start);
}

/// Limits that are nearer together than the way of a step lose the bounce: that is said with what
/// helps, of lengths and of angles; not where a step is short enough, or without two limits.
#[test]
fn limits_within_the_way_of_a_step_are_warned_of() {
    let warnings = |text: &str| -> Vec<String> {
        let simulation = holonom::Simulation::new(&Model::from_toml(text).unwrap()).unwrap();
        let all = simulation.warnings();
        all.iter().filter(|own| own.contains("between its limits")).cloned().collect()
    };
    let narrow = cart("rate = 3.0\nlimits = { lower = -0.01, upper = 0.01, restitution = 0.5 }");
    let found = warnings(&narrow);
    println!("{found:?}");
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].contains("joint `slide` moves by 0.03 m in a step, 1.5 times the 0.02 m"));
    assert!(found[0].contains("write a step below 0.0017 s"), "{found:?}");
    let turns = head("arm", "step = 0.01, end = 0.1")
        + "[[body]]\nname = \"arm\"\nmass = 1.0\ninertia = [0.1, 0.1, 0.1]\n"
        + &hinge("pin", ["ground", "arm"], [0.0; 3], [0.0, 0.0, 1.0])
        + "rate = -5.0\nlimits = [-0.02, 0.01]\n";
    let found = warnings(&turns);
    assert!(found[0].contains("`pin` moves by 0.05 rad in a step"), "{found:?}");
    for quiet in [
        cart("rate = 3.0\nlimits = { upper = 0.01, restitution = 0.5 }"),
        cart("rate = 1.0\nlimits = [-0.01, 0.01]"),
        changed(&narrow, "step = 0.01", "step = 0.001"),
    ] {
        assert_eq!(warnings(&quiet), Vec::<String>::new(), "{quiet}");
    }
}
