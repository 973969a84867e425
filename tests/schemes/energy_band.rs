//! The warning that a run gains energy: never of a motion that begins at rest, whatever drives it.

#![allow(clippy::unwrap_used)] // a test

use crate::harness::hostile::hostile;
use holonom::model::History;
use holonom::simulation::RunOutcome;
use holonom::{Model, Simulation};
use vi_testkit::model::{AXES, along, body_at, heavy, hinge, motion};

/// Every kind of history, from the start and after a rest, over about a second.
const HISTORIES: [&str; 14] = [
    "\"sin(9*t)^2\"",
    "{ type = \"constant\" }",
    "{ type = \"linear\", end = 0.5 }",
    "{ type = \"ramp\", start = 0.0, end = 0.2 }",
    "{ type = \"ramp\", start = 0.3, end = 0.5 }",
    "{ type = \"pulse\", start = 0.0, end = 0.1 }",
    "{ type = \"pulse\", start = 0.3, end = 0.4 }",
    "{ type = \"triangle\", start = 0.0, peak = 0.1, end = 0.2 }",
    "{ type = \"harmonic\", frequency = 2.0 }",
    "{ type = \"harmonic\", frequency = 2.0, phase = 1.0 }",
    "{ type = \"table\", times = [0.0, 0.1, 0.2, 0.6], values = [0.0, 1.0, -1.0, 0.0] }",
    "{ type = \"table\", times = [0.0, 0.3, 0.4, 0.6], values = [0.0, 0.0, -1.0, 0.0] }",
    "{ type = \"steps\", values = [1.0, -0.5, 0.0, 0.8], step = 0.1 }",
    "{ type = \"steps\", values = [0.0, 0.0, -1.0] }",
];

/// Every kind of path from rest.
const PATHS: [&str; 5] = [
    "{ moves = [{ start = 0.0, end = 0.6, by = 0.8 }] }",
    "{ moves = [{ start = 0.1, end = 0.6, by = 0.8 }] }",
    "{ amplitude = 0.2, frequency = 1.0, rate = -1.2566370614359172 }",
    "{ acceleration = 1.0 }",
    "{ table = { times = [0.0, 0.3, 0.5], values = [0.0, 0.2, 0.1] } }",
];

/// Schemes and orders.
const METHODS: [&str; 5] = [
    "",
    ", scheme = \"constrained\"",
    ", scheme = \"em-nodal\"",
    ", order = 4",
    ", order = 4, method = \"galerkin\"",
];

/// A body on a joint of a kind, with what the joint has, and what else there is.
fn body((step, method): (f64, &str), kind: &str, own: &str, beside: &str) -> String {
    [
        heavy("m", [0.0; 3], &format!("step = {step:?}, end = 0.8 {method}")),
        body_at([0.0; 3], "b", 1.0, [0.1; 3]),
        along(AXES[0], kind, "j", ["ground", "b"], [0.0; 3]),
        format!("{own}\n{beside}"),
    ]
    .concat()
}

/// A cantilever with a load at its end, at rest in the equilibrium of the constant part of it.
fn beam(step: f64, end: f64, method: &str, history: &str) -> String {
    format!(
        "model = {{ name = \"m\", gravity = [0.0, 0.0, 0.0] }}\n\
         simulation = {{ step = {step:?}, end = {end:?}, start = \"relaxed\" {method} }}\n\
         [[beam]]\nname = \"b\"\npoints = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]\nelements = 4\nnormal = [0.0, 0.0, 1.0]\n\
         section = {{ shape = {{ type = \"rectangle\", dimensions = [0.01, 0.02] }}, material = {{ E = 7e10, nu = 0.33, density = 2700.0 }} }}\n\
         start = \"clamped\"\n\
         [[load]]\nname = \"own\"\nbody = \"b.end\"\nforce = [0.0, 0.0, 2.0]\nhistory = {history}\n\
         [[load]]\nname = \"pull\"\nbody = \"b.end\"\nforce = [50.0, 0.0, 0.0]\n"
    )
}

/// What the run says of its energy, at once or at the end; the run has to reach its end.
fn words(text: &str) -> Option<String> {
    let mut simulation = Simulation::new(&Model::from_toml(text).expect(text)).expect(text);
    let mut notices = Vec::new();
    let mut observe = |sample: &holonom::Sample| {
        notices.extend(sample.notice.clone());
        Ok::<(), std::convert::Infallible>(())
    };
    let outcome = simulation.run(&mut observe, &mut |_, _| {}).unwrap();
    assert_eq!(outcome, RunOutcome::Done, "{text}");
    notices.extend(simulation.warnings());
    notices.into_iter().find(|words| words.contains("left its band"))
}

#[test]
fn the_list_of_histories_is_complete() {
    let text = |history: &str| format!("history = {history}");
    let mut found = [0; 9];
    for history in HISTORIES {
        let model = body(
            (0.1, ""),
            "prismatic",
            "",
            "[[load]]\nname = \"l\"\nbody = \"b\"\nforce = [1.0, 0.0, 0.0]\n",
        );
        let model = Model::from_toml(&(model + &text(history))).unwrap();
        let place = match model.loads[0].history {
            History::Unstated | History::Constant => 0,
            History::Linear { .. } => 1,
            History::Ramp { .. } => 2,
            History::Pulse { .. } => 3,
            History::Triangle { .. } => 4,
            History::Harmonic { .. } => 5,
            History::Table { .. } => 6,
            History::Expression(_) => 7,
            History::Steps { .. } => 8,
            History::Function(_) => unreachable!("of no file"),
        };
        found[place] += 1;
    }
    assert!(found.iter().all(|count| *count > 0), "{found:?}");
}

#[test]
fn whatever_drives_a_body_from_rest_its_energy_stays_in_its_band() {
    let mut accused = Vec::new();
    let mut models = 0;
    let mut judge = |name: String, text: &str| {
        models += 1;
        accused.extend(words(text).map(|words| format!("{name}: {words}")));
    };
    for step in [0.02, 0.005] {
        for method in METHODS {
            let own = (step, method);
            for history in HISTORIES {
                let load = format!(
                    "[[load]]\nname = \"l\"\nbody = \"b\"\nforce = [1.0, 0.0, 0.0]\ntorque = [1.0, 0.0, 0.0]\n\
                     history = {history}\n"
                );
                let motor = format!("motor = {{ effort = 3.0, history = {history} }}");
                let spring = "spring = { stiffness = 500.0 }";
                for (kind, held) in [("prismatic", ""), ("revolute", ""), ("prismatic", spring)] {
                    judge(format!("{kind}, {own:?}, {history}"), &body(own, kind, held, &load));
                }
                judge(format!("motor, {own:?}, {history}"), &body(own, "revolute", &motor, ""));
                if method.is_empty() || method.contains("em") {
                    let damper = "damper = { damping = 5.0 }";
                    judge(
                        format!("damper, {own:?}, {history}"),
                        &body(own, "prismatic", damper, &load),
                    );
                }
            }
            for path in PATHS {
                let drive = motion("drive", "j", path);
                judge(format!("{own:?}, {path}"), &body(own, "prismatic", "", &drive));
                let arm = body_at([0.0, 1.0, 0.0], "c", 1.0, [0.1; 3])
                    + &hinge("j2", ["b", "c"], [0.0, 0.5, 0.0], AXES[0]);
                judge(
                    format!("arm, {own:?}, {path}"),
                    &body(own, "revolute", "", &format!("{arm}{drive}")),
                );
                if method.contains("order = 4") {
                    continue; // no damping in a composition; a Galerkin step resolves the control
                }
                let control =
                    format!("motor = {{ proportional = 200.0, derivative = 20.0, path = {path} }}");
                judge(format!("control, {own:?}, {path}"), &body(own, "revolute", &control, ""));
            }
        }
    }
    println!("{models} models, accused: {accused:#?}");
    assert!(models > 500 && accused.is_empty(), "{accused:#?}");
}

#[test]
fn loads_on_a_relaxed_beam_do_not_drive_its_energy_out_of_its_band() {
    for method in ["", ", scheme = \"em-nodal\"", ", order = 4"] {
        for history in HISTORIES {
            for (step, end) in [(0.02, 0.6), (0.002, 0.1)] {
                let words = words(&beam(step, end, method, history));
                assert_eq!(words, None, "{step} {method} {history}");
            }
        }
    }
    assert_eq!(words(&hostile("pulse_on_a_taut_beam")), None);
}

/// A hub spins up an elastic arm from rest, at steps that resolve none of its vibrations.
#[test]
fn a_coarse_spin_up_keeps_its_band() {
    let arm = "[[beam]]\nname = \"arm\"\npoints = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]\nelements = 4\nnormal = [1.0, 0.0, 0.0]\n\
               section = { shape = { type = \"rectangle\", dimensions = [0.01, 0.02] }, material = { E = 7e10, nu = 0.33, density = 2700.0 } }\n\
               [[joint]]\nname = \"root\"\ntype = \"fixed\"\nparent = \"b\"\nchild = \"arm.start\"\nposition = [0.0, 0.0, 0.0]\n";
    let motors = ["{ effort = 0.4, history = { type = \"ramp\", start = 0.0, end = 0.5 } }"];
    let paths = ["{ moves = [{ start = 0.0, end = 0.8, by = 1.0 }] }", PATHS[2]];
    let drives = paths.map(|path| motion("drive", "j", path));
    for step in [0.05, 0.02, 0.005] {
        for drive in &drives {
            let text = body((step, ""), "revolute", "", &format!("{arm}{drive}"));
            assert_eq!(words(&text), None, "{step} {drive}");
        }
        for motor in motors {
            let text = body((step, ""), "revolute", &format!("motor = {motor}"), arm);
            assert_eq!(words(&text), None, "{step} {motor}");
        }
    }
}

/// Under forces and stresses that are large beside what moves, rounding is no motion.
#[test]
fn what_rests_under_large_loads_keeps_its_band() {
    let load =
        |force: [f64; 3]| format!("[[load]]\nname = \"l\"\nbody = \"b\"\nforce = {force:?}\n");
    for method in METHODS {
        for force in [1e4, 1e6] {
            let hanging = body((0.002, method), "spherical", "", &load([0.0, 0.0, -force]))
                .replacen("position = [0.0, 0.0, 0.0]", "position = [1.0, 2.0, -0.5]", 1)
                .replace(
                    "position = [0.0, 0.0, 0.0]\naxis = [1.0, 0.0, 0.0]",
                    "position = [1.0, 2.0, 0.0]",
                );
            assert_eq!(words(&hanging), None, "hanging, {force} N {method}");
            if method.contains("galerkin") {
                continue; // it resolves its vibrations
            }
            let relaxed = format!("{method}, start = \"relaxed\"");
            let spring = "spring = { stiffness = 1e9 }";
            let spring = body((0.002, &relaxed), "prismatic", spring, &load([force, 0.0, 0.0]));
            assert_eq!(words(&spring), None, "spring, {force} N {method}");
            let text = beam(0.002, 0.2, method, HISTORIES[0]);
            let text = text.replace("[0.01, 0.02]", "[0.1, 0.1]");
            let text = text.replace("[50.0, 0.0, 0.0]", &format!("[{force:?}, 0.0, 0.0]"));
            assert_eq!(words(&text), None, "beam, {force} N {method}");
        }
    }
}

/// What is left of forces is rounding, the more the shorter the sub-steps.
const LOCKED: &str = include_str!("../models/locked_bodies.toml");

#[test]
fn what_rests_in_short_sub_steps_keeps_its_band() {
    for method in [
        "scheme = \"em-constrained\"\norder = 8",
        "scheme = \"em-nodal\"\norder = 8",
        "scheme = \"em-dalembert\"\norder = 6",
        "order = 8",
    ] {
        let found = words(&LOCKED.replace("end = 1.7e-3", &format!("end = 1.7e-3\n{method}")));
        println!("{method}: {found:?}");
        assert!(found.is_none(), "{method}");
    }
}
