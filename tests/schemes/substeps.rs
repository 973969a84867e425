//! A step that is refused as a whole is taken in smaller parts, where the model asks for that.
#![allow(clippy::unwrap_used)] // a test

use crate::{benchmark, harness};

use benchmark::{apart, model, samples};
use harness::models::shipped;
use holonom::experiment::RunnableModel;
use holonom::model::{OnFailure, Settings};
use holonom::simulation::RunOutcome;
use holonom::{Model, Override, Sample, Simulation};

/// A free body for which no whole step exists: about one axis `sin θ = h ω` is the turn `θ` of a
/// step, and `h ω = 1.5`.
fn spinning(on_failure: &str, step: &str) -> Model {
    let (action, every) = (format!("\"{on_failure}\""), if step == "0.25" { "2" } else { "1" });
    let overrides = [
        ("body.nut.body_angular_velocity", "[0.1, 3.0, 0.1]"),
        ("simulation.step", step),
        ("simulation.end", "10.0"),
        ("simulation.every", every),
        ("simulation.on_failure", &action),
    ];
    model(&shipped("free_body"), &overrides)
}

fn outcome(model: &Model) -> (Simulation, Vec<Sample>, RunOutcome) {
    let mut simulation = Simulation::new(model).unwrap();
    let mut nodes = Vec::new();
    let mut observe = |sample: &Sample| {
        nodes.push(sample.clone());
        Ok::<(), ()>(())
    };
    let outcome = simulation.run(&mut observe, &mut |_, _| {}).unwrap();
    (simulation, nodes, outcome)
}

#[test]
fn refused_steps_are_taken_in_parts() {
    let stops = outcome(&spinning("stop", "0.5"));
    let RunOutcome::Failed(failure) = &stops.2 else { panic!("the step is not refused") };
    println!("{} {}", failure.message, failure.remedy);
    assert_eq!((failure.step, stops.1.len()), (0, 1));

    let (simulation, nodes, end) = outcome(&spinning("substep", "0.5"));
    assert_eq!((end, nodes.len()), (RunOutcome::Done, 21));
    let divided = simulation.divided_steps().unwrap();
    assert_eq!((divided.count, divided.most_parts, divided.first), (20, 2, 0.0));
    let warnings = simulation.warnings();
    assert!(warnings.iter().any(|w| w.starts_with("20 steps were refused")), "{warnings:?}");

    // the motion is that of half the step, and what holds in any step holds
    let halves = outcome(&spinning("stop", "0.25")).1;
    let off = nodes.iter().zip(&halves).map(|(a, b)| apart(&a.q, &b.q)).fold(0.0, f64::max);
    let first = nodes[0].momentum.angular;
    let drift = nodes.iter().map(|n| apart(&n.momentum.angular, &first)).fold(0.0, f64::max);
    let residual = nodes.iter().map(|n| n.residuals.position).fold(0.0, f64::max);
    println!("off by {off:.1e}, angular momentum drifts {drift:.1e}, residual {residual:.1e}");
    assert!(off < 1e-11 && drift < 1e-12 && residual < 1e-14);
}

/// Only what is refused is divided: a run without such a step has the same bits under both
/// settings.
#[test]
fn other_steps_are_what_they_were() {
    for name in ["chain8", "four_bar_loop", "four_particles"] {
        let [stop, substep] = ["\"stop\"", "\"substep\""].map(|action| {
            let overrides = [("simulation.on_failure", action), ("simulation.end", "0.2")];
            samples(&mut Simulation::new(&model(&shipped(name), &overrides)).unwrap())
        });
        assert!(stop.iter().zip(&substep).all(|(a, b)| a.q == b.q), "{name}");
        assert_eq!(stop.len(), substep.len(), "{name}");
    }
}

/// A run that is taken up between divided steps goes on with the same bits, in every scheme and
/// composition.
#[test]
fn a_run_with_divided_steps_restarts_to_the_bit() {
    let spinning = |scheme: &str, order: &str, speed: &str| {
        let more =
            [("scheme", format!("\"{scheme}\"")), ("order", order.into()), ("end", "5.0".into())];
        let more = more.map(|(key, value)| Override::new(format!("simulation.{key}"), value));
        let speed = Override::new("body.nut.body_angular_velocity", format!("[0.1, {speed}, 0.1]"));
        spinning("substep", "0.5").with_overrides(&[&more[..], &[speed]].concat()).unwrap()
    };
    let top = [
        ("simulation.scheme", "\"em-nodal\""),
        ("simulation.step", "0.4"),
        ("simulation.end", "8.0"),
        ("simulation.every", "1"),
        ("simulation.on_failure", "\"substep\""),
    ];
    let models = [
        spinning("nodal", "2", "3.0"),
        spinning("nodal", "4", "10.0"),
        spinning("constrained", "2", "3.0"),
        model(&shipped("heavy_top"), &top),
    ];
    for model in models {
        let Settings { scheme, order, on_failure, .. } = model.settings;
        let scheme = scheme.name();
        assert_eq!(on_failure, OnFailure::Substep);
        let (whole, expected, end) = outcome(&model);
        assert_eq!(end, RunOutcome::Done, "{scheme} {order}");
        let mut first = Simulation::new(&model).unwrap();
        let mut nodes = Vec::new();
        let mut observe = |sample: &Sample| {
            nodes.push(sample.clone());
            Ok::<(), ()>(())
        };
        first.run_while(&mut observe, &mut |step, _| step < 8).unwrap();
        let mut second = Simulation::new(&model).unwrap();
        second.resume(first.state()).unwrap();
        second.run(&mut observe, &mut |_, _| {}).unwrap();
        assert_eq!(nodes, expected, "{scheme} {order}");
        assert_eq!(second.divided_steps(), whole.divided_steps());
        assert!(whole.divided_steps().is_some(), "{scheme} {order}");
        println!("{scheme} {order}: {:?}", whole.divided_steps());
    }
}

/// Where no part of a step can be taken, the run ends as it would have: with the reason of the
/// whole step.
#[test]
fn what_cannot_be_taken_in_parts_fails_as_a_whole() {
    let [stop, substep] = ["\"stop\"", "\"substep\""].map(|action| {
        let overrides =
            [("simulation.on_failure", action), ("simulation.newton_max_iterations", "1")];
        outcome(&model(&shipped("heavy_top"), &overrides)).2
    });
    assert!(matches!(stop, RunOutcome::Failed(_)));
    assert_eq!(stop, substep);
}
