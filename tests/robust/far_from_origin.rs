//! Mechanisms that fly away from the origin: Galilean invariance.
//!
//! A uniform velocity of the whole mechanism changes none of its relative motion. What is left are
//! roundings: of positions `φ`, to `ε |φ|`, and of increments in a step, to `ε` of themselves.

#![allow(clippy::unwrap_used)] // a test

use crate::harness::models::simulation;
use holonom::vi_constraints::{Options, OrderMethod, SchemeKind};
use holonom::vi_core::composition::Composition;
use holonom::vi_core::galerkin::Stages;
use holonom::vi_core::linear::norm_inf;
use holonom::vi_emscheme::{EmForm, EmOptions, EmSystem, run};
use holonom::vi_multibody::PairKind;
use holonom::vi_multibody::builder::{BuiltMechanism, Inertia, MechanismBuilder};

const H: f64 = 0.01;
const STEPS: usize = 100;

/// Four rods in a plane, hinged to a quadrilateral with a spring across it, turning at 1 rad/s.
fn quadrilateral(velocity: f64) -> BuiltMechanism {
    let corners = [[0.0, 0.0], [1.0, 0.2], [1.3, 1.5], [-0.2, 1.1]];
    let mut builder = MechanismBuilder::new();
    let rods: Vec<_> = (0..4)
        .map(|k| {
            let ([x, y], [next_x, next_y]) = (corners[k], corners[(k + 1) % 4]);
            let center = [0.5 * (x + next_x), 0.5 * (y + next_y), 0.0];
            let inertia = Inertia::principal(1.0 + k as f64, [0.1, 0.12, 0.2]);
            let rod = builder.body(&format!("rod{k}"), inertia).at(center);
            let turning = [velocity - center[1], center[0], 0.0];
            rod.velocity(turning).angular_velocity([0.0, 0.0, 1.0]).id()
        })
        .collect();
    for (k, [x, y]) in corners.into_iter().enumerate() {
        let (before, next) = (rods[(k + 3) % 4], rods[k]);
        let hinge = builder.joint(&format!("hinge{k}"), PairKind::Revolute, before, next);
        hinge.at([x, y, 0.0]).axis([0.0, 0.0, 1.0]);
    }
    let [from, to] = [rods[0], rods[2]].map(|rod| rod.point([0.0; 3]));
    builder.spring(from, to, 1e3).natural_length(1.0);
    builder.build().unwrap()
}

/// Two bodies without joints, held together by a spring that does not act on their centres.
fn pair(velocity: f64) -> BuiltMechanism {
    let mut builder = MechanismBuilder::new();
    let inertia = Inertia::principal(1.0, [0.008, 0.01, 0.004]);
    let mut body = |name: &str, x: f64, speed: f64| {
        let body = builder.body(name, inertia).at([x, 0.0, 0.0]);
        body.velocity([velocity, speed, 0.0]).angular_velocity([0.3, speed, 2.0]).id()
    };
    let (a, b) = (body("a", 0.0, 0.5), body("b", 1.0, -0.5));
    builder.spring(a.point([0.1, 0.05, 0.1]), b.point([-0.1, 0.02, 0.03]), 1e3).natural_length(0.8);
    builder.build().unwrap()
}

/// The configuration after a run.
fn variational(built: &BuiltMechanism, (kind, method): (SchemeKind, OrderMethod)) -> Vec<f64> {
    let options = Options { method, ..Options::new(kind, H) };
    let mut run = built.clone().integrator(options).unwrap();
    for _ in 0..STEPS {
        run.step().unwrap();
    }
    run.state().q.clone()
}

fn energy_momentum(built: &BuiltMechanism) -> Vec<f64> {
    let springs = built.forces.springs.iter().cloned();
    let system = springs.fold(EmSystem::of_mechanism(&built.mechanism), EmSystem::spring);
    let options = EmOptions::new(EmForm::Nodal, H);
    let mut run = run::integrator(system, built.mechanism.clone(), options).unwrap();
    for _ in 0..STEPS {
        run.step().unwrap();
    }
    run.state().q.clone()
}

/// How far the frames of two runs differ after the shift of the first of them is taken off.
fn difference(near: &[f64], far: &[f64]) -> f64 {
    let relative = |q: &[f64]| -> Vec<f64> {
        let frames = q.chunks_exact(12);
        let shifted = |frame: &[f64]| {
            let own = frame.iter().enumerate();
            own.map(|(i, x)| if i < 3 { x - q[i] } else { *x }).collect::<Vec<_>>()
        };
        frames.flat_map(shifted).collect()
    };
    let (near, far) = (relative(near), relative(far));
    norm_inf(&near.iter().zip(&far).map(|(a, b)| a - b).collect::<Vec<_>>())
}

#[test]
fn a_uniform_velocity_changes_no_relative_motion() {
    let velocity = 1e6; // m/s: 1000 km in the 100 steps
    type Case = (&'static str, fn(f64) -> BuiltMechanism);
    let cases: [Case; 2] = [("quadrilateral", quadrilateral), ("pair", pair)];
    for (name, of) in cases {
        let (near, far) = (of(0.0), of(velocity));
        let check = |scheme: String, near: Vec<f64>, far: Vec<f64>| {
            let (reached, off) = (far[0], difference(&near, &far));
            println!("{name}, {scheme}: relative motion off by {off:.1e} at {reached:.2e} m");
            assert!(reached > 0.9e6, "{name}: it flies away");
            assert!(off < 1e-7, "{name}, {scheme}: {off:e}");
        };
        for kind in SchemeKind::ALL {
            let by = (kind, OrderMethod::default());
            check(kind.name().into(), variational(&near, by), variational(&far, by));
        }
        let by = (SchemeKind::Nodal, OrderMethod::Composition(Composition::Suzuki5));
        check("order 4".into(), variational(&near, by), variational(&far, by));
        if name == "pair" {
            let by = (SchemeKind::Nodal, OrderMethod::Galerkin(Stages::new(3).unwrap()));
            check("galerkin".into(), variational(&near, by), variational(&far, by));
        }
        check("em-nodal".into(), energy_momentum(&near), energy_momentum(&far));
    }
}

/// A beam that was pushed and flies away at 1 km/s.
#[test]
fn a_beam_flies_far_away_from_the_origin() {
    let value = |text: &str| text.to_owned();
    let run = |velocity: &str| {
        let changes = [
            ("simulation.step", value("0.01")),
            ("beam.beam.elements", value("12")),
            ("beam.beam.velocity", value(velocity)),
        ];
        let mut simulation = simulation("flying_beam", &changes);
        let run = simulation.integrator();
        for _ in 0..600 {
            run.step().unwrap();
        }
        run.state().q.clone()
    };
    let (near, far) = (run("[0.0, 0.0, 0.0]"), run("[1e6, 0.0, 0.0]"));
    let (reached, off) = (far[0], difference(&near, &far));
    println!("beam: relative motion off by {off:.1e} at {reached:.2e} m");
    assert!(reached > 5e6 && off < 1e-4, "{off:e} at {reached:e}");
}

/// A satellite with flexible panels at the velocity of an orbit: screws relative to its own motion.
#[test]
fn a_satellite_vibrates_at_any_velocity() {
    let run = |scheme: &str, velocity: &str| {
        let changes = [
            ("simulation.scheme", scheme.to_owned()),
            ("simulation.start", "stated".to_owned()),
            ("body.hub.velocity", velocity.to_owned()),
        ];
        let mut simulation = simulation("satellite", &changes);
        let most = (0..400).map(|_| simulation.step().unwrap().iterations).max().unwrap();
        (simulation.configuration().to_vec(), most)
    };
    for scheme in ["nodal", "reduced", "em-nodal"] {
        let (near, _) = run(scheme, "[0.0, 0.0, 0.0]");
        let (far, iterations) = run(scheme, "[7500.0, 0.0, 0.0]");
        let off = difference(&near, &far);
        println!("{scheme}: off by {off:.1e} at {:.2e} m, {iterations} iterations at most", far[0]);
        assert!(off < 1e-5 && far[0] > 29e3, "{scheme}: {off:e}");
        assert!(iterations < 6, "{scheme}: {iterations} iterations");
    }
}

/// Two hinged bodies without springs: the balance of momenta is rounded to `ε` of them.
#[test]
fn hinged_bodies_fly_at_any_velocity() {
    let hinged = |velocity: f64| {
        let mut builder = MechanismBuilder::new();
        let inertia = Inertia::principal(1.0, [0.008, 0.01, 0.004]);
        let hub = builder.body("hub", inertia).velocity([velocity, 0.0, 0.0]);
        let hub = hub.angular_velocity([0.003, 0.001, 0.002]).id();
        let panel = builder.body("panel", inertia).at([0.3, 0.1, 0.0]).id();
        let hinge = builder.joint("hinge", PairKind::Revolute, hub, panel);
        hinge.at([0.1, 0.1, 0.0]).axis([0.0, 1.0, 0.0]).rate(0.002);
        builder.build().unwrap()
    };
    let by = (SchemeKind::Nodal, OrderMethod::default());
    let near = variational(&hinged(0.0), by);
    for k in 1..=20 {
        let velocity = 5e3 * f64::from(k);
        let off = difference(&near, &variational(&hinged(velocity), by));
        println!("{velocity} m/s: off by {off:.1e}");
        assert!(off < 1e-8, "{off:e} at {velocity} m/s");
    }
}
