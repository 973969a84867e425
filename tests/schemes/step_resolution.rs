//! What a step makes of rotations and of the fastest motion, and what is said of it before a run,
//! at its end and where it fails.

#![allow(clippy::unwrap_used)] // a test

use crate::harness::hostile::hostile;
use crate::harness::models::{all_shipped, read};
use holonom::model::Scheme;
use holonom::modes::{About, ModalAnalysis};
use holonom::simulation::{RunFailure, RunOutcome};
use holonom::{Model, Override, Sample, Simulation};
use vi_testkit::model::{AXES, along, body_at, heavy, hinge, joint};

fn with(text: &str, own: &[(&str, &str)]) -> Model {
    let own: Vec<Override> = own.iter().map(|(key, value)| Override::new(*key, *value)).collect();
    Model::from_toml_with(text, &own).unwrap()
}

/// The outcome, the last sample, what was said at the start, and all that was said.
fn run(model: &Model) -> (RunOutcome, Sample, [Vec<String>; 2]) {
    let mut simulation = Simulation::new(model).unwrap();
    let start = simulation.warnings();
    let mut last = Sample::default();
    let mut observe = |sample: &Sample| {
        last.clone_from(sample);
        Ok::<(), std::convert::Infallible>(())
    };
    let outcome = simulation.run(&mut observe, &mut |_, _| {}).unwrap();
    (outcome, last, [start, simulation.warnings()])
}

fn failure(outcome: RunOutcome) -> RunFailure {
    let RunOutcome::Failed(failure) = outcome else { panic!("done") };
    println!("step {}: {}; {}", failure.step, failure.message, failure.remedy);
    failure
}

/// The number after a word.
fn number_after(text: &str, word: &str) -> f64 {
    let (_, rest) = text.split_once(word).unwrap_or_else(|| panic!("no `{word}` in {text}"));
    rest.split_whitespace().next().unwrap().trim_end_matches([',', ';']).parse().unwrap()
}

/// The rotor turns by arcsin(hω) in each step; what is said of it is what happens, and both cures
/// cure it.
#[test]
fn a_fast_rotor_is_named_with_its_phase_error_and_a_cure() {
    let text = hostile("fast_rotor");
    let (outcome, last, [start, _]) = run(&with(&text, &[]));
    assert_eq!(outcome, RunOutcome::Done);
    let (turned, exact) = (last.sensors[0], 100.0 * 0.6_f64.asin());
    println!("turned by {turned} rad, {start:?}");
    assert!((turned - exact).abs() < 1e-9);
    let [warning] = &start[..] else { panic!("{start:?}") };
    assert!(warning.contains("`r` turns by 0.600 rad in a step (60 rad/s)"), "{warning}");
    let percent = number_after(warning, "makes ");
    assert!((percent - 100.0 * (exact / 60.0 - 1.0)).abs() < 0.01, "{percent} %");
    let step = number_after(warning, "a step below ").to_string();
    assert!(warning.contains("write order = 6"), "{warning}");
    for (own, error) in
        [(("simulation.order", "6"), 1e-4), (("simulation.step", step.as_str()), 1e-3)]
    {
        let (_, last, [start, end]) = run(&with(&text, &[own]));
        let found = last.sensors[0] / (60.0 * last.t) - 1.0;
        println!("{own:?}: {found:.1e}, {start:?}");
        assert!(
            found.abs() < error && start.is_empty() && end.is_empty(),
            "{own:?}: {found:e}, {end:?}"
        );
    }
}

#[test]
fn the_bound_of_a_step_is_a_radian_and_its_remedy_works() {
    let text = hostile("fast_rotor").replace("rate = 60.0", "rate = 120.0");
    let (outcome, _, [start, _]) = run(&with(&text, &[]));
    let failure = failure(outcome);
    println!("{start:?}");
    assert!(failure.step == 0 && failure.remedy.contains("less than 1.000 rad"));
    assert!(failure.remedy.contains("`r` turns by 1.200 rad"), "{}", failure.remedy);
    let step = format!("{}", 0.99 * number_after(&failure.remedy, "write a step below "));
    let (outcome, ..) = run(&with(&text, &[("simulation.step", &step)]));
    assert_eq!(outcome, RunOutcome::Done);
    let (outcome, last, [_, end]) = run(&with(&text, &[("simulation.scheme", "\"em-nodal\"")]));
    assert_eq!(outcome, RunOutcome::Done);
    let exact = 200.0 * 0.6_f64.atan();
    println!("em-nodal: {} of {exact}, {end:?}", last.sensors[0]);
    assert!((last.sensors[0] - exact).abs() < 1e-9 && end[0].contains("less than that"), "{end:?}");
}

const GYROSTAT: &str = include_str!("../models/gyrostat.toml");
const CONICAL: &str = r#"
model = { name = "circling", dimension = 2, gravity = [0.0, 0.0] }
simulation = { step = 0.01, end = 0.5 }
particle = [{ name = "bob", mass = 1.0, position = [0.5, 0.0], velocity = [0.0, 10.0] }]
bar = [{ name = "rod", from = "ground", to = "bob" }]
"#;
const SHAFT: &str = include_str!("../models/shaft_with_flywheel.toml");

/// A wheel on a free hull, a point mass on a bar, a flywheel on an elastic shaft; a Galerkin scheme
/// and a composition, whose phases are right.
#[test]
fn whatever_turns_fast_is_named() {
    for (text, name, angle) in
        [(GYROSTAT, "wheel", 0.4), (CONICAL, "rod", 0.2), (SHAFT, "flywheel", 0.25)]
    {
        for scheme in ["nodal", "constrained", "em-nodal"] {
            let scheme_of = format!("\"{scheme}\"");
            let model = with(text, &[("simulation.scheme", &scheme_of)]);
            let simulation = Simulation::new(&model).unwrap();
            let found = simulation.assembly().fastest_rotation.clone().unwrap();
            println!("{scheme}: {found:?}");
            let shaft = [name, "shaft"].contains(&found.member.as_str());
            assert!(shaft && (found.angle - angle).abs() < 0.01, "{found:?}");
            let warned = simulation.warnings().iter().any(|words| words.contains("rad in a step"));
            assert!(warned && found.is_notable(), "{:?}", simulation.warnings());
        }
        for method in ["galerkin", "composition"] {
            let method = format!("\"{method}\"");
            if text == SHAFT {
                continue; // its vibrations are another matter
            }
            let model = with(text, &[("simulation.order", "6"), ("simulation.method", &method)]);
            let (_, _, [_, end]) = run(&model);
            assert_eq!(end, [""; 0], "{method}");
        }
    }
}

/// A crank that a path turns is turned exactly, and so are those that it carries; a free wheel on
/// it is not.
#[test]
fn what_a_path_turns_has_no_phase_error() {
    let crank = include_str!("../models/driven_crank.toml");
    for scheme in ["\"nodal\"", "\"em-nodal\""] {
        let (outcome, last, [start, end]) = run(&with(crank, &[("simulation.scheme", scheme)]));
        assert_eq!(outcome, RunOutcome::Done);
        println!("{scheme}: {:?}, {end:?}", last.sensors);
        assert!(
            (last.sensors[0] - 30.0).abs() < 1e-9 && start.is_empty() && end.is_empty(),
            "{end:?}"
        );
        let wheel = crank
            .replace("type = \"fixed\"", "type = \"revolute\", axis = [0, 0, 1], rate = -10.0");
        let model = with(&wheel, &[("simulation.scheme", scheme)]);
        let found = Simulation::new(&model).unwrap().assembly().fastest_rotation.clone().unwrap();
        println!("{scheme}: {found:?}");
        assert!(found.member == "tool" && (found.rate - 50.0).abs() < 1e-6, "{found:?}");
    }
}

/// A rotor at rest that a motor spins up: nothing to say at the start, and at the end the largest
/// rate with its time.
#[test]
fn a_rotation_that_comes_with_the_motion_is_told_at_the_end() {
    let text = hostile("fast_rotor").replace("rate = 60.0", "motor = { effort = 0.02 }");
    for every in ["1", "7"] {
        let model = with(&text, &[("simulation.every", every)]);
        let mut simulation = Simulation::new(&model).unwrap();
        assert!(simulation.warnings().is_empty(), "{:?}", simulation.warnings());
        let last = simulation.samples().last().unwrap().unwrap();
        let warnings = simulation.warnings();
        println!("{warnings:?}, {:?}", last.sensors);
        let [warning] = &warnings[..] else { panic!("{warnings:?}") };
        assert!(warning.contains("`r` turns by 0.2") && warning.contains("at t = "), "{warning}");
    }
}

/// Links hanging from the ground, as long as heavy; `more`: what else there is.
fn hanging(links: usize, more: &str) -> String {
    let mut text = heavy("chain", [0.0, 0.0, -9.81], "step = 0.003, end = 0.03");
    for k in 0..links {
        let parent = if k == 0 { "ground".to_owned() } else { format!("l{}", k - 1) };
        let link = format!("l{k}");
        let (kind, axis) = [("revolute", "axis = [0.0, 1.0, 0.0]\n"), ("spherical", "")][k % 2];
        let (top, mass) = (-0.1 * k as f64, if k + 1 == links { 50.0 } else { 0.1 });
        text += &(body_at([0.0, 0.0, top - 0.05], &link, mass, [1e-4, 1e-4, 2e-5])
            + &joint(kind, &format!("j{k}"), [&parent, &link], [0.0, 0.0, top])
            + axis);
    }
    text + more
}

/// A symmetric linkage of four bars in its equilibrium.
fn hanging_linkage() -> String {
    let mut text = heavy("linkage", [0.0, 0.0, -9.81], "step = 0.003, end = 0.03");
    for (name, mass, x, z) in
        [("left", 0.1, 0.05, -0.15), ("coupler", 50.0, 0.3, -0.3), ("right", 0.1, 0.55, -0.15)]
    {
        text += &body_at([x, 0.0, z], name, mass, [1e-3; 3]);
    }
    for (parent, child, x, z) in [
        ("ground", "left", 0.0, 0.0),
        ("left", "coupler", 0.1, -0.3),
        ("coupler", "right", 0.5, -0.3),
        ("ground", "right", 0.6, 0.0),
    ] {
        text += &hinge(&format!("{parent}_{child}"), [parent, child], [x, 0.0, z], AXES[1]);
    }
    text
}

/// About an equilibrium the fastest motion is the fastest of the modes that a dense eigensolver of
/// other matrices finds.
#[test]
fn the_fastest_motion_is_the_fastest_mode() {
    let spring = "[[spring]]\nname = \"s\"\nfrom = \"ground\"\nto = \"l2\"\npoint_from = [0.5, 0.0, -0.25]\nstiffness = 1e5\n\
                  natural_length = 0.5\n";
    let beam = "[[beam]]\nname = \"b\"\npoints = [[1.0, 0.0, 0.0], [1.5, 0.0, 0.0]]\nelements = 3\nnormal = [0, 0, 1]\nstart = \"clamped\"\n\
                section = { shape = { type = \"circle\", dimensions = [0.02] }, material = { E = 2e8, nu = 0.3, density = 1000.0 } }\n";
    let chains = [("chain", ""), ("spring", spring), ("beam beside it", beam)];
    let chains = chains.map(|(name, more)| (name, hanging(6, more)));
    for (name, text) in chains.into_iter().chain([("linkage", hanging_linkage())]) {
        for scheme in ["nodal", "constrained", "em-nodal"] {
            let own = format!("\"{scheme}\"");
            let model = with(&text, &[("simulation.scheme", &own)]);
            let simulation = Simulation::new(&model).unwrap();
            let found = simulation.assembly().fastest_motion.clone().unwrap();
            let modes = ModalAnalysis::new(&model, About::Start).unwrap().modes(500).unwrap().modes;
            let exact = modes.iter().map(|mode| mode.omega).fold(0.0, f64::max);
            let error = found.all.omega_max / exact - 1.0;
            println!("{name}, {scheme}: {found:?}, modes {exact}, {error:.1e}");
            assert!((-0.01..1e-6).contains(&error), "{name}, {scheme}: {error:e}");
        }
    }
}

/// Steps of a taut chain just below `h ω = 2` are taken, those well above fail and say what works.
#[test]
fn a_taut_chain_fails_beyond_two_and_says_what_works() {
    // let go beside the vertical
    let text = hanging(6, "")
        .replace("name = \"l5\"\n", "name = \"l5\"\nangular_velocity = [0.0, 0.3, 0.0]\n");
    let text = text.replace("end = 0.03", "end = 0.3, project_start = true");
    let omega = Simulation::new(&with(&text, &[])).unwrap();
    let omega = omega.assembly().fastest_motion.clone().unwrap().by_constraint_forces.omega_max;
    for (product, done) in [(0.8, true), (4.0, false)] {
        let step = format!("{}", product / omega);
        let (outcome, _, [start, _]) = run(&with(&text, &[("simulation.step", &step)]));
        println!("h ω = {product}: {outcome:?}, {start:?}");
        assert_eq!(outcome == RunOutcome::Done, done, "h ω = {product}");
        let warned = start.iter().any(|words| words.contains("by the forces that joints"));
        assert_eq!(warned, !done, "{start:?}");
        if !done {
            let own =
                [("simulation.step", step.as_str()), ("simulation.on_failure", "\"substep\"")];
            let (_, _, [_, end]) = run(&with(&text, &own));
            println!("in parts: {end:?}");
            let divided = end.iter().find(|words| words.contains("refused as a whole")).unwrap();
            let resolving = number_after(divided, "reduce the time step to ");
            assert!(resolving * omega < 1.0 && resolving * omega > 0.5, "{divided}");
            let failure = failure(outcome);
            let step = format!("{}", number_after(&failure.remedy, "a step below "));
            let (outcome, ..) = run(&with(&text, &[("simulation.step", &step)]));
            assert_eq!(outcome, RunOutcome::Done, "{step}");
        }
    }
}

/// Two light links under a heavy load: told before the run and where it fails; both remedies work.
#[test]
fn taut_light_links_are_told_and_the_remedies_work() {
    let text = hostile("taut_light_links");
    let model = with(&text, &[("simulation.end", "0.2")]);
    let simulation = Simulation::new(&model).unwrap();
    let motion = simulation.assembly().fastest_motion.clone().unwrap();
    println!("{motion:?}\n{:?}", simulation.warnings());
    assert!(motion.all.omega_max > 1e4 && motion.all.member.starts_with('l'), "{motion:?}");
    let warned = simulation.warnings().iter().any(|words| words.contains("em-nodal"));
    assert!(warned);
    let (outcome, ..) = run(&model);
    let failure = failure(outcome);
    assert!(
        failure.remedy.contains("rad/s") && failure.remedy.contains("em-nodal"),
        "{}",
        failure.remedy
    );
    let (outcome, last, [_, em]) =
        run(&with(&text, &[("simulation.end", "1.0"), ("simulation.scheme", "\"em-nodal\"")]));
    assert_eq!(outcome, RunOutcome::Done);
    let place = &last.q[24..27];
    println!("em-nodal: {place:?}, {em:?}");
    assert!(
        (place[0] - 0.0031878).abs() < 1e-5 && (place[2] + 0.3999872).abs() < 1e-5,
        "{place:?}"
    );
    let step = number_after(&failure.remedy, "a step below ");
    let own = format!("{step}");
    let (outcome, ..) = run(&with(&text, &[("simulation.end", "0.05"), ("simulation.step", &own)]));
    assert_eq!(outcome, RunOutcome::Done, "step {own}");
}

/// No model that is shipped is accused of a vibration or a rotation that it has not.
#[test]
fn the_step_of_every_shipped_model_is_judged() {
    for (name, path) in all_shipped() {
        let model = read(&path, &[]);
        if model.settings.scheme == Scheme::Static {
            continue;
        }
        let simulation = Simulation::new(&model).unwrap();
        let found = simulation.assembly();
        let motion = found.fastest_motion.as_ref().unwrap_or_else(|| panic!("{name}"));
        let rotation = found.fastest_rotation.as_ref().map(|own| own.angle);
        println!("{name}: h ω_max {:.3}, rotation {rotation:?}", motion.all.h_omega_max);
        for warning in &found.warnings {
            assert!(!warning.contains("by the forces that"), "{name}: {warning}");
        }
    }
}

/// Weights on chains of light point masses of any number of bars: the frequency by the tension is
/// printed. A stretched chain with the tension T has ω² < 4 T/(m l), and comes close to it.
#[test]
fn taut_chains_of_many_bars_have_their_fastest_vibration() {
    for count in [20, 300] {
        let mut text = "[model]\nname = \"taut\"\ndimension = 2\ngravity = [0.0, -9.81]\n[simulation]\nstep = 0.002\nend = 0.02\n".to_owned();
        for k in 0..count {
            let mass = if k + 1 == count { 100.0 } else { 0.01 };
            let (from, at) = match k {
                0 => ("ground".to_owned(), "point = [0.0, 0.0]\n"),
                _ => (format!("p{}", k - 1), ""),
            };
            text += &format!(
                "[[particle]]\nname = \"p{k}\"\nmass = {mass:?}\nposition = [0.0, {:?}]\n[[bar]]\nname = \"b{k}\"\nfrom = \"{from}\"\nto = \"p{k}\"\n{at}",
                -f64::from(k + 1)
            );
        }
        let simulation = Simulation::new(&with(&text, &[])).unwrap();
        let found = simulation.assembly().fastest_motion.as_ref().unwrap();
        let tension = 9.81 * (100.0 + 0.01 * f64::from(count - 1)); // in the first bar
        let most = (4.0 * tension / 0.01).sqrt();
        println!("{count} bars: {} rad/s of at most {most}", found.all.omega_max);
        assert!((0.97..=1.0).contains(&(found.all.omega_max / most)));
    }
}

/// Where more bars meet in one point mass than a linear memory allows it is said that nothing is
/// known, and why.
#[test]
fn a_hub_of_many_bars_says_that_its_fastest_motion_is_not_known() {
    let mut text = "[model]\nname = \"hub\"\n[simulation]\nstep = 0.002\nend = 0.02\n[[particle]]\nname = \"hub\"\nmass = 1.0\nposition = [0.0, 0.0, 0.0]\n".to_owned();
    for k in 0..210 {
        let angle = 0.02 * f64::from(k);
        text += &format!(
            "[[particle]]\nname = \"p{k}\"\nmass = 1.0\nposition = [{:?}, {:?}, 0.0]\n[[bar]]\nname = \"b{k}\"\nfrom = \"hub\"\nto = \"p{k}\"\n",
            angle.cos(),
            angle.sin()
        );
    }
    let simulation = Simulation::new(&with(&text, &[])).unwrap();
    let assembly = simulation.assembly();
    let why = assembly.fastest_motion_unknown.as_deref().unwrap();
    assert_eq!(
        (why, &assembly.fastest_motion),
        ("more than 200 bars meet in one point mass", &None)
    );
}

/// A body that turns by 0.6 rad in a step is named with its phase error whatever turns it: a screw,
/// the rotation of a planar pair, a gear.
#[test]
fn fast_rotations_of_screws_planar_pairs_and_gears_are_named() {
    let body = |name: &str, x: f64| body_at([x, 0.0, 0.0], name, 1.0, [1.0; 3]);
    let joint = |name: &str, kind: &str, child: &str, x: f64, rest: &str| {
        along(AXES[2], kind, name, ["ground", child], [x, 0.0, 0.0]) + rest + "\n"
    };
    let slow = body("slow", 2.0) + &joint("b", "revolute", "slow", 2.0, "rate = 20.0");
    let gear = "[[constraint]]\nname = \"gear\"\ntype = \"gear\"\njoints = [\"b\", \"a\"]\nratio = 0.3333333333333333\n";
    for (what, rest) in [
        ("screw", joint("a", "screw", "r", 0.0, "pitch = 0.01\nrate = 60.0")),
        ("planar", joint("a", "planar", "r", 0.0, "rate = [0.1, 0.2, 60.0]")),
        ("gear", joint("a", "revolute", "r", 0.0, "") + &slow + gear),
    ] {
        let head = "[model]\nname = \"fast\"\n[simulation]\nstep = 0.01\nend = 0.1\nproject_start = true\n";
        let text = head.to_owned() + &body("r", 0.0) + &rest;
        let (outcome, _, [start, _]) = run(&with(&text, &[]));
        println!("{what}: {start:?}");
        assert_eq!(outcome, RunOutcome::Done, "{what}");
        let named = |w: &String| w.contains("`r` turns by 0.600 rad in a step (60 rad/s)");
        assert!(start.iter().any(named), "{what}: {start:?}");
    }
}
