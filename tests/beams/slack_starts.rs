//! Beams that begin without tension and are pulled within a few steps: the run that ends there
//! names the bound of the tension with which it does not.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark::{model, samples};
use holonom::Simulation;
use vi_testkit::model::{beam, body, head, joint, load, section};

const ACROSS: [[f64; 3]; 2] = [[0.0; 3], [1.0, 0.0, 0.0]];

/// A string, 1 mm thick, that is pushed in its middle.
fn string() -> String {
    let own = section([1.65e5, 6e4, 6e4, 0.0103, 0.0103, 0.008], [6.2e-3, 3.9e-10, 3.9e-10]);
    head("string", "step = 0.01, end = 0.5")
        + &beam("b", &ACROSS, 20)
        + "start = \"pinned\"\nend = \"pinned\"\n"
        + &own
        + &load("push", "b.10", [[0.0, 0.0, 50.0], [0.0; 3]])
}

/// A rope that is stretched between walls and pulled aside.
fn rope() -> String {
    let own = section([2e5, 2e4, 2e4, 1e-3, 1e-3, 1e-3], [0.05, 1e-7, 1e-7]);
    head("rope", "step = 1e-3, end = 0.5")
        + &beam("b", &[[0.0; 3], [4.0, 0.0, 0.0]], 16)
        + "element = \"rope\"\nstart = \"pinned\"\nend = \"pinned\"\n"
        + &own
        + &load("push", "b.8", [[0.0, 10.0, -200.0], [0.0; 3]])
}

/// A ball between two wires of elements of the second order.
fn ball() -> String {
    let own = section([6.6e5, 2.5e5, 2.5e5, 0.165, 0.165, 0.127], [0.0247, 6.2e-9, 6.2e-9]);
    let wire = |name: &str, from: f64, held: &str| {
        let points = [[from, 0.0, 0.0], [from + 1.0, 0.0, 0.0]];
        let held = format!("element = \"second_order\"\n{held} = \"clamped\"\n");
        beam(name, &points, 10) + &held + &own
    };
    head("ball", "step = 3e-3, end = 0.3")
        + &wire("b", -1.0, "start")
        + &wire("right", 0.0, "end")
        + &body("ball", 0.5, [1e-3; 3])
        + &joint("fixed", "l", ["b.end", "ball"], [0.0; 3])
        + &joint("fixed", "r", ["right.start", "ball"], [0.0; 3])
        + &load("push", "ball", [[0.0, 0.0, 3000.0], [0.0; 3]])
}

#[test]
fn the_bound_that_a_run_needs_is_named_where_it_ends() {
    for text in [string(), rope(), ball()] {
        let plain = model(&text, &[]);
        let name = &plain.header.name;
        let run = Simulation::new(&plain).unwrap().samples().collect::<Result<Vec<_>, _>>();
        let failure = run.unwrap_err();
        println!("{name}: {}; {}", failure.message, failure.remedy);
        let after = |words: &str, end: char| {
            let rest = failure.remedy.split(words).nth(1).expect("no bound is named");
            rest.split(end).next().unwrap().to_owned()
        };
        let (bound, steps) = (after("`tension = ", '`'), after("the first ", ' '));
        let steps: f64 = steps.parse().unwrap();
        let end = format!("{:e}", steps * plain.settings.step);
        let mut own = vec![("beam.b.tension", bound.as_str()), ("simulation.end", end.as_str())];
        own.extend(plain.beams.get(1).map(|_| ("beam.right.tension", bound.as_str())));
        let found = samples(&mut Simulation::new(&model(&text, &own)).unwrap());
        let left = found.iter().find_map(|own| own.notice.clone());
        let off = found.iter().map(|own| (own.energy - own.work).abs()).fold(0.0, f64::max);
        println!("{name}, tension = {bound} N: {steps} steps, energy to {off:.1e} J");
        assert!(failure.step as f64 + 40.0 < steps, "{name}: {steps} steps");
        assert!(left.is_none(), "{name}: {left:?}"); // the energy stays in its band
    }
}

/// What is stout, has stated its bound or has mean directors is not asked for one.
#[test]
fn a_bound_is_asked_of_slender_beams_that_follow_their_tension_alone() {
    let words = "`tension = …`";
    let stout = "EI1 = 50.0, EI2 = 50.0";
    let own = string().replace("EI1 = 0.0103, EI2 = 0.0103", stout);
    for (text, replaced) in [
        (string(), vec![("beam.b.tension", "100.0")]),
        (string(), vec![("beam.b.element", "\"mean_directors\"")]),
        (own, vec![("simulation.step", "0.5"), ("load.push.force", "[0.0, 0.0, 1e5]")]),
    ] {
        let run = Simulation::new(&model(&text, &replaced))
            .unwrap()
            .samples()
            .collect::<Result<Vec<_>, _>>();
        if let Err(failure) = run {
            println!("{replaced:?}: {}; {}", failure.message, failure.remedy);
            assert!(!failure.remedy.contains("tension ="), "{words}: {}", failure.remedy);
        }
    }
}
