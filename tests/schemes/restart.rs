//! A motion goes on, bit for bit, from a state that was stored, in an integrator that is new: for
//! each scheme and order, on models whose next step depends on more than `(q_n, p_n)`. Observing a
//! node changes nothing. What a run records depends on its stored state in the same way.
#![allow(clippy::unwrap_used)] // a test

use crate::harness;

use harness::models::{overrides, shipped};
use holonom::vi_constraints::discretization::Discretization;
use holonom::vi_constraints::{Integrator, SchemeKind};
use holonom::vi_core::State;
use holonom::vi_emscheme::EmForm;
use holonom::vi_multibody::mechanism::Mechanism;
use holonom::{Model, Override, RunState, Sample, Simulation};

/// Steps before the state is stored, and after: where revolutions count, and elsewhere.
const TURNING: [u32; 2] = [60, 17];
const OTHERS: [u32; 2] = [9, 6];

/// Two rotors whose hinges a gear couples, a motor on one; 40 rad/s: the state is stored after
/// revolutions.
const GEARS: &str = include_str!("../models/gears.toml");

/// A torsion spring that is wound by more than five revolutions when the state is stored.
const TORSION: &str = include_str!("../models/torsion.toml");

/// A rope that is released: its tension and the bound of that grow.
const SWINGING: &str = include_str!("../hostile/swinging_rope.toml");

/// A nut on a screw that makes several revolutions, and a body that hangs on it.
const SCREW: &str = include_str!("../models/screw.toml");

/// A shipped model with a quarter of its elements.
fn coarse(name: &str) -> String {
    let line = |line: &str| match line.strip_prefix("elements = ") {
        Some(count) => format!("elements = {}\n", count.parse::<u32>().unwrap().div_ceil(4)),
        None if line.starts_with("element = ") && !line.ends_with('"') => {
            "element = 1\n".to_owned()
        }
        None => format!("{line}\n"),
    };
    shipped(name).lines().map(line).collect()
}

fn models() -> Vec<(&'static str, String)> {
    let xtask = |name: &str| {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../xtask/models/");
        std::fs::read_to_string(format!("{folder}{name}.toml")).unwrap()
    };
    vec![
        ("gears", GEARS.into()),
        ("torsion", TORSION.into()),
        ("screw", SCREW.into()),
        ("heavy_top", shipped("heavy_top")),
        ("tree", xtask("tree")),
        ("driven", xtask("rheonomic")),
        ("four_particles", shipped("four_particles")),
        ("redundant loop", shipped("bricard")),
        ("windows", shipped("four_bar_windows")),
        ("six-bar loop", shipped("six_hinge_cube")),
        ("singular start", shipped("four_bar_loop")),
        ("beam", coarse("flying_beam")),
        ("beam between bodies", coarse("flexible_multibody")),
        ("loop with a beam", coarse("flexible_four_bar")),
        ("rope whose tension grows", SWINGING.replace("elements = 40", "elements = 6")),
    ]
}

/// The scheme names of both families with their orders, those of the variational family given.
fn schemes(orders: &[u32]) -> Vec<(&'static str, u32)> {
    let variational = SchemeKind::ALL.map(SchemeKind::name);
    let energy_momentum = EmForm::ALL.map(EmForm::name);
    let of = |names: &[&'static str], orders: &[u32]| -> Vec<(&'static str, u32)> {
        names.iter().flat_map(|name| orders.iter().map(|order| (*name, *order))).collect()
    };
    [of(&variational, orders), of(&energy_momentum, &[2, 4])].concat()
}

fn simulation(text: &str, (scheme, order): (&str, u32)) -> Option<Simulation> {
    let set = [("simulation.scheme", scheme.to_owned()), ("simulation.order", order.to_string())];
    // a scheme may refuse the start
    Simulation::new(&Model::from_toml_with(text, &overrides(&set)).unwrap()).ok()
}

fn state(simulation: &mut Simulation) -> State {
    match simulation.energy_momentum() {
        Some(run) => run.state().clone(),
        None => simulation.integrator().state().clone(),
    }
}

fn resume(simulation: &mut Simulation, state: State) {
    match simulation.energy_momentum() {
        Some(run) => run.resume(state).unwrap(),
        None => simulation.integrator().resume(state).unwrap(),
    }
}

fn observe(simulation: &mut Simulation) {
    fn every_way<S: Discretization<Mechanism>>(run: &mut Integrator<S, Mechanism>) {
        run.observe().unwrap();
        run.observe_state().unwrap();
        run.acceleration_multiplier().unwrap();
    }
    match simulation.energy_momentum() {
        Some(run) => every_way(run),
        None => every_way(simulation.integrator()),
    }
}

fn advance(simulation: &mut Simulation, steps: u32, seen: bool) {
    for n in 0..steps {
        if seen {
            observe(simulation);
        }
        simulation.step().unwrap_or_else(|error| panic!("step {n}: {error}"));
    }
}

/// Every scheme and order continues on some model, every model by every scheme.
#[test]
fn a_stored_state_continues_bit_for_bit() {
    let composed =
        ["gears", "screw", "heavy_top", "tree", "driven", "four_particles", "singular start"];
    stored_states_continue(|name| if composed.contains(&name) { &[2, 4, 6, 8] } else { &[2, 4] });
}

#[test]
#[ignore = "long: cargo test --release -- --ignored"]
fn a_stored_state_continues_bit_for_bit_at_every_order() {
    stored_states_continue(|_| &[2, 4, 6, 8]);
}

fn stored_states_continue(orders: impl Fn(&str) -> &'static [u32]) {
    let (mut checked, mut angles) = (0, 0.0_f64);
    for (name, text) in models() {
        let mut schemes_of_model = Vec::new();
        let steps = if matches!(name, "gears" | "torsion" | "screw") { TURNING } else { OTHERS };
        for scheme in schemes(orders(name)) {
            let Some(mut run) = simulation(&text, scheme) else { continue };
            advance(&mut run, steps[0], false);
            let stored = serde_json::to_string(&state(&mut run)).unwrap();
            let read: State = serde_json::from_str(&stored).unwrap();
            assert_eq!(
                read,
                state(&mut run),
                "{name}, {scheme:?}: what is read is what was stored"
            );
            angles = read.angles.iter().fold(angles, |largest, angle| largest.max(angle.abs()));
            let mut again = simulation(&text, scheme).unwrap();
            resume(&mut again, read);
            advance(&mut run, steps[1], false);
            advance(&mut again, steps[1], true);
            assert_eq!(state(&mut again), state(&mut run), "{name}, {scheme:?}");
            schemes_of_model.push(format!("{} {}", scheme.0, scheme.1));
            checked += 1;
        }
        println!("{name:<20} {} schemes and orders", schemes_of_model.len());
        assert!(schemes_of_model.len() >= 10, "{name}: {schemes_of_model:?}");
    }
    println!("{checked} motions; the largest angle stored {angles:.1} rad");
    assert!(checked > 200 && angles > 5.0 * std::f64::consts::TAU, "{checked}, {angles}");
}

/// A model with a sensor of every kind that it has a place for, momenta, and rows at every third of
/// 23 steps.
fn measured(text: &str, (scheme, order): (&str, u32)) -> Model {
    let plain = Model::from_toml(text).unwrap();
    let mut text = text.to_owned();
    let mut sensor = |kind: &str, of: &str| {
        text +=
            &format!("\n[[sensor]]\nname = \"{kind} {of}\"\ntype = \"{kind}\"\nof = \"{of}\"\n");
        if kind == "section_force" {
            text += "element = 0\n";
        }
    };
    let moving = plain.joints.iter().filter(|joint| joint.pair().dof() > 0);
    for joint in moving {
        sensor("joint_coordinate", &joint.name);
        sensor("joint_rate", &joint.name);
        sensor("reaction", &joint.name);
    }
    for body in plain.bodies.iter().filter(|body| !body.fixed) {
        sensor("orientation", &body.name);
    }
    plain.bars.iter().for_each(|bar| sensor("reaction", &bar.name));
    plain.beams.iter().for_each(|beam| sensor("section_force", &beam.name));
    let set = [
        ("scheme", format!("{scheme:?}")),
        ("order", order.to_string()),
        ("every", "3".into()),
        ("momenta", "true".into()),
        ("end", format!("{:?}", 23.0 * plain.settings.step)),
    ];
    let set = set.map(|(key, value)| Override::new(format!("simulation.{key}"), value));
    Model::from_toml_with(&text, &set).unwrap()
}

/// Samples of a run that is paused before the steps in `stops`: each time its state is stored,
/// read, and taken up by a new simulation.
fn samples(model: &Model, stops: &[u64]) -> Option<(Vec<Sample>, Vec<String>)> {
    let mut samples = Vec::new();
    let mut stored: Option<String> = None;
    for stop in stops.iter().copied().chain([u64::MAX]) {
        let mut simulation = Simulation::new(model).ok()?;
        if let Some(stored) = &stored {
            let read: RunState = serde_json::from_str(stored).unwrap();
            simulation.resume(read.clone()).unwrap();
            assert_eq!(simulation.state(), read, "what is taken up is what was stored");
        }
        let mut observe = |sample: &Sample| -> Result<(), std::convert::Infallible> {
            samples.push(sample.clone());
            Ok(())
        };
        let outcome = simulation.run_while(&mut observe, &mut |step, _| step != stop).unwrap();
        if stop == u64::MAX {
            assert_eq!(outcome, Some(holonom::RunOutcome::Done));
            return Some((samples, simulation.warnings()));
        }
        assert_eq!(outcome, None);
        stored = Some(serde_json::to_string(&simulation.state()).unwrap());
    }
    None
}

#[test]
fn a_run_that_is_taken_up_records_the_same_nodes() {
    let mut checked = 0;
    for (name, text) in models() {
        let mut schemes_of_model = 0;
        for scheme in
            [("nodal", 2), ("nodal", 4), ("dalembert", 2), ("em-nodal", 2), ("em-constrained", 4)]
        {
            let model = measured(&text, scheme);
            let Some(whole) = samples(&model, &[]) else { continue };
            let bits = |samples: &[Sample]| -> Vec<Vec<u64>> {
                samples.iter().map(|s| s.sensors.iter().map(|x| x.to_bits()).collect()).collect()
            };
            for stops in [&[0, 1][..], &[2, 3, 4, 11], &[22]] {
                let (parts, warnings) = samples(&model, stops).unwrap();
                assert_eq!(bits(&parts), bits(&whole.0), "{name}, {scheme:?}: sensors, {stops:?}");
                let without = |samples: &[Sample]| -> Vec<Sample> {
                    // NaN is not equal to itself
                    let clear = |s: &Sample| Sample { sensors: vec![], ..s.clone() };
                    samples.iter().map(clear).collect()
                };
                assert_eq!(without(&parts), without(&whole.0), "{name}, {scheme:?}, {stops:?}");
                assert_eq!(warnings, whole.1, "{name}, {scheme:?}, {stops:?}");
                checked += stops.len();
            }
            schemes_of_model += 1;
        }
        println!("{name:<20} {schemes_of_model} schemes");
        assert!(schemes_of_model >= 3, "{name}: {schemes_of_model}");
    }
    println!("{checked} pauses");
}

#[test]
fn a_state_of_another_model_is_refused() {
    let simulation = |text: &str| Simulation::new(&measured(text, ("nodal", 2))).unwrap();
    let (mut gears, torsion) = (simulation(GEARS), simulation(TORSION));
    let before = gears.state();
    assert!(gears.resume(torsion.state()).is_err());
    assert_eq!(gears.state(), before, "a refused state changes nothing");
}

/// The models at their start, with their states as values that can be changed.
fn stored_states() -> impl Iterator<Item = (&'static str, Simulation, serde_json::Value)> {
    models().into_iter().filter_map(|(name, text)| {
        let simulation = Simulation::new(&measured(&text, ("nodal", 2))).ok()?;
        let state = serde_json::to_value(simulation.state()).unwrap();
        Some((name, simulation, state))
    })
}

/// An impulse with an entry too few and a velocity with one too many have the right number of
/// entries in all.
#[test]
fn an_impulse_of_another_length_is_refused() {
    let mut tried = 0;
    for (_, mut simulation, mut state) in stored_states() {
        let Some(p) = state.pointer_mut("/motion/impulse/p") else { continue };
        p.as_array_mut().unwrap().pop();
        let v = state.pointer_mut("/motion/impulse/v").unwrap().as_array_mut().unwrap();
        v.push(0.0.into());
        let state: RunState = serde_json::from_value(state).unwrap();
        let refused = simulation.resume(state).unwrap_err();
        assert!(refused.to_string().contains("impulse"), "{refused}");
        tried += 1;
    }
    assert!(tried > 0);
}

/// Momenta of 1e308 overflow in energies, momentum maps and residuals: the run ends in words,
/// without such numbers.
#[test]
fn a_state_that_overflows_gives_no_number_that_is_not_finite() {
    let mut refused = 0;
    for (name, mut simulation, mut state) in stored_states() {
        let p = state.pointer_mut("/motion/state/p").and_then(|p| p.as_array_mut());
        let Some(p) = p else { continue };
        p.iter_mut().for_each(|p| *p = 1e308.into());
        if simulation.resume(serde_json::from_value(state).unwrap()).is_err() {
            continue;
        }
        let mut observe = |sample: &Sample| -> Result<(), std::convert::Infallible> {
            assert!(sample.is_finite(), "{name}: {sample:?}");
            Ok(())
        };
        let Ok(outcome) = simulation.run_while(&mut observe, &mut |step, _| step < 3);
        refused += u32::from(format!("{outcome:?}").contains("not finite"));
    }
    assert!(refused > 0);
}
