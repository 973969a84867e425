//! Kelvin–Voigt damping of beams: decay of a vibration, energy balance, momentum, order, unresolved
//! strains.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::{Run, apart, assert_order, changes_at_halved_steps, model, orders, samples};
use holonom::{Model, Sample, Simulation};
use std::fmt::Display;
use vi_testkit::model::{beam, cantilever, damped_section, heavy, section, sensor};

/// A cantilever in the plane, resolved at 0.5 ms; its first vibration has about 5.6 Hz.
fn damped_cantilever(damping: impl Display) -> String {
    let soft = section([500.0, 500.0, 500.0, 1.0, 1.0, 1.0], [0.1, 1e-3, 1e-3]);
    heavy("cantilever", [0.0, 0.0, -1.0], "step = 5e-4, end = 1")
        + &cantilever(6, &soft.replace(" }", &format!(", damping = {damping} }}")))
        + &sensor("tip", "position", "beam.6")
}

const BLADE: &str = include_str!("../hostile/rotor_blade.toml");

fn run(model: &Model) -> Vec<Sample> {
    samples(&mut Simulation::new(model).unwrap())
}

/// Times and values of the extremes of a function of time, by parabolas through three points.
fn extremes(t: &[f64], x: &[f64]) -> Vec<(f64, f64)> {
    let turning = (1..x.len() - 1).filter(|&k| (x[k] - x[k - 1]) * (x[k + 1] - x[k]) < 0.0);
    let parabola = |k: usize| {
        let (slope, bend) = (0.5 * (x[k + 1] - x[k - 1]), x[k + 1] - 2.0 * x[k] + x[k - 1]);
        let along = -slope / bend;
        (t[k] + along * (t[1] - t[0]), x[k] + 0.5 * slope * along)
    };
    turning.map(parabola).collect()
}

/// The summary states the slope of the energy of conservative models only.
#[test]
fn only_an_elastic_beam_is_conservative() {
    for (damping, conservative) in [("2e-3", false), ("0", true)] {
        let text = damped_cantilever(damping);
        assert_eq!(model(&text, &[]).is_conservative(), conservative, "damping {damping}");
    }
}

/// A vibration of the angular frequency `ω` has the damping ratio `ζ = ωτ/2`.
#[test]
fn a_vibration_decays_with_the_ratio_of_its_relaxation_time() {
    for scheme in ["nodal", "dalembert", "em-nodal"] {
        let own =
            [("simulation.scheme", scheme), ("simulation.end", "2"), ("simulation.step", "2e-3")];
        let samples = run(&model(&damped_cantilever(2e-3), &own));
        let t: Vec<f64> = samples.iter().map(|s| s.t).collect();
        let z: Vec<f64> = samples.iter().map(|s| s.sensors[2]).collect();
        let found = extremes(&t, &z);
        // from the third extreme on the higher vibrations, damped in proportion to ω², have died
        // out
        let (first, last) = (3, found.len() - 1);
        let period = 2.0 * (found[last].0 - found[first].0) / (last - first) as f64;
        let swing = |k: usize| (found[k].1 - found[k - 1].1).abs();
        // of half a period
        let decrement = (swing(first) / swing(last)).ln() / (last - first) as f64;
        let ratio = decrement / decrement.hypot(std::f64::consts::PI);
        let omega = std::f64::consts::TAU / period / (1.0 - ratio * ratio).sqrt();
        let expected = 0.5 * omega * 2e-3;
        println!("{scheme}: ω = {omega:.3} rad/s, ζ = {ratio:.5}, ωτ/2 = {expected:.5}");
        assert!((ratio / expected - 1.0).abs() < 5e-3, "{ratio} and {expected}");
    }
}

/// What the damping takes is what the energy loses, to second order.
#[test]
fn the_work_of_the_damping_closes_the_energy_balance() {
    let cases =
        [("nodal", "helicoidal"), ("dalembert", "mean_directors"), ("em-nodal", "helicoidal")];
    for (scheme, element) in cases {
        let steps = [8e-4, 4e-4, 2e-4];
        let imbalance = steps.map(|h| {
            let h = format!("{h:e}");
            let own = [
                ("simulation.step", h.as_str()),
                ("simulation.scheme", scheme),
                ("simulation.end", "0.04"),
                ("beam.beam.element", element),
            ];
            let samples = run(&model(&damped_cantilever(2e-3), &own));
            let (first, last) = (&samples[0], samples.last().unwrap());
            assert!(last.work < -1e-9, "the damping takes {} J", last.work);
            (last.hamiltonian - first.hamiltonian - last.work).abs()
        });
        println!("{scheme}, {element}: imbalance {imbalance:?} J");
        if scheme == "em-nodal" {
            assert!(imbalance.iter().all(|error| *error < 1e-16)); // exact
        } else {
            assert_order(&orders("energy balance", &steps, &imbalance), 2.0, 0.3);
        }
    }
}

/// Order 2 in the coordinates, with mass scaling that vanishes with the step.
#[test]
fn damped_beams_converge_with_second_order() {
    let steps = [8e-4, 4e-4, 2e-4];
    let differences = changes_at_halved_steps(&steps, |h| {
        Run::with(&damped_cantilever(2e-3), h, 2, &[]).configuration_at(0.1)
    });
    assert_order(&orders("damped cantilever", &steps, &differences), 2.0, 0.3);
}

/// A blade on a free hub in steps far beyond its vibrations: these die out, the rotation keeps its
/// momentum.
#[test]
fn unresolved_vibrations_of_a_damped_blade_die_out() {
    for (h, scheme) in [(0.01, "nodal"), (0.001, "em-nodal")] {
        let (step, end) = (format!("{h:e}"), format!("{:e}", 300.0 * h));
        let own = [
            ("simulation.step", step.as_str()),
            ("simulation.end", end.as_str()),
            ("simulation.scheme", scheme),
            ("beam.blade1.section.damping", "1e-3"),
        ];
        let samples = run(&model(BLADE, &own));
        let energies: Vec<f64> = samples.iter().map(|s| s.hamiltonian).collect();
        let drift = samples.iter().map(|s| s.momentum.angular[2] / samples[0].momentum.angular[2]);
        let drift = drift.map(|ratio| (ratio - 1.0).abs()).fold(0.0, f64::max);
        // gravity bends the blade in the plane of no rotation; what is left is that of a steady
        // rotation
        let late = &energies[energies.len() - 100..];
        let (least, most) =
            late.iter().fold((f64::MAX, f64::MIN), |(a, b), e| (a.min(*e), b.max(*e)));
        let lost = energies[0] - late[0];
        let left = (most - least) / energies[0];
        println!(
            "{scheme}, h = {h}: lost {lost:.3e} J of {:.3e} J, changes by {left:.1e} at the end, J_z {drift:.1e}",
            energies[0]
        );
        assert!(drift < 1e-12 && lost > 0.0 && left < 1e-4);
        // the damping takes what is lost
        let last = samples.last().unwrap();
        let balance = last.energies.last().unwrap() / lost;
        println!("work of the damping {:.3} J, balance {balance:.1e} of what is lost", last.work);
        assert!(last.work < 0.0 && balance.abs() < 0.05, "{} J, {balance}", last.work);
    }
}

#[test]
fn damping_is_read_in_all_its_forms() {
    let end = |damping: &str| {
        let text = damped_cantilever(damping);
        let model = Model::from_toml(&text).unwrap_or_else(|error| panic!("{error:?}"));
        let written = Model::from_toml(&model.to_toml()).unwrap();
        assert_eq!(written, model);
        let mut model = model;
        model.settings.end = 0.02;
        run(&model).last().unwrap().q.clone()
    };
    let time = end("2e-3");
    let loss = end("{ loss_factor = 0.02, frequency = 1.5915494309189535 }"); // 10 rad/s
    let each = end("{ EA = 2e-3, GA1 = 2e-3, GA2 = 2e-3, EI1 = 2e-3, EI2 = 2e-3, GJ = 2e-3 }");
    let [loss, each] = [loss, each].map(|q| apart(&q, &time));
    println!("loss factor {loss:.1e}, each strain {each:.1e}");
    assert!(loss < 1e-9 && each == 0.0 && apart(&end("{ EI1 = 1e-3 }"), &time) > 1e-6);
    for (damping, expected) in [
        ("-1e-3", "damping = -0.001 is negative"),
        ("{ loss_factor = 0.1, frequency = 0 }", "frequency = 0 is not positive"),
        ("{ loss_factor = 0.1 }", "damping is a relaxation time"),
        ("{ EI3 = 1 }", "damping is a relaxation time"),
        ("{ EI1 = -1 }", "damping.EI1 = -1 is negative"),
        ("nan", "not a number"),
    ] {
        let text = damped_cantilever(damping);
        let error = Model::from_toml(&text).unwrap_err().to_string();
        println!("{damping}: {error}");
        assert!(error.contains(expected), "{damping}: {error}");
    }
}

/// Two legs at an angle, each strain with a stiffness and a relaxation time of its own.
fn two_legs() -> String {
    heavy("legs", [6.0, 9.0, -12.0], "step = 1e-4, end = 0.05")
        + &beam("beam", &[[0.0; 3], [0.6, 0.0, 0.0], [0.6, 0.4, 0.3]], 4)
        + "element = \"mean_directors\"\nnormal = [0, 0, 1]\nstart = \"clamped\"\n"
        + &damped_section()
}

/// Of both legs, four of each.
const ELEMENTS: usize = 8;

/// `C_i` and `τ_i` of `Γ_1, Γ_2, Γ_3, K_1, K_2, K_3`.
const STRAINS: [(f64, f64); 6] =
    [(25.0, 1e-3), (40.0, 2e-3), (60.0, 3e-3), (0.4, 5e-3), (0.7, 4e-3), (0.3, 6e-3)];

/// Strains of all elements, and those at two places by their arc length.
fn strain_sensors() -> String {
    let strain = |name: &str, place: &str| sensor(name, "strain", "beam") + place + "\n";
    let each = (0..ELEMENTS).map(|k| strain(&format!("s{k}"), &format!("element = {k}")));
    let places = [("early", 0.1), ("late", 0.6 + 0.4)].into_iter();
    each.chain(places.map(|(name, at)| strain(name, &format!("at = {at}")))).collect()
}

/// `W = −Σ_e l_e Σ_i τ_i C_i ∫ ε̇_i² dt`, and strains at an arc length lie between those of the
/// elements beside it.
#[test]
fn each_relaxation_time_damps_the_strain_it_names() {
    for scheme in ["nodal", "em-nodal"] {
        let text = two_legs() + &strain_sensors();
        let mut simulation =
            Simulation::new(&model(&text, &[("simulation.scheme", scheme)])).unwrap();
        let samples = samples(&mut simulation);
        let columns = simulation.energy_columns();
        let work = columns.iter().position(|name| name == "work_of_material_damping").unwrap();
        let lengths: [f64; ELEMENTS] = std::array::from_fn(|e| if e < 4 { 0.15 } else { 0.125 });
        let mut expected = [0.0; 6]; // of each strain
        for pair in samples.windows(2) {
            let h = pair[1].t - pair[0].t;
            for (e, length) in lengths.iter().enumerate() {
                for (i, (stiffness, time)) in STRAINS.iter().enumerate() {
                    let rate = (pair[1].sensors[6 * e + i] - pair[0].sensors[6 * e + i]) / h;
                    expected[i] -= length * time * stiffness * rate * rate * h;
                }
            }
        }
        let total: f64 = expected.iter().sum();
        let found = samples.last().unwrap().energies[work];
        let parts = expected.map(|part| format!("{part:.1e}"));
        println!("{scheme}: {found:.6e} J, expected {total:.6e} J of {parts:?}");
        assert!(expected.iter().all(|part| part / total > 0.01), "a strain stays at rest");
        assert!((found / total - 1.0).abs() < 2e-3, "{scheme}: {found:e} and {total:e} J");
        for sample in &samples {
            let at = |k: usize| &sample.sensors[6 * k..6 * k + 6];
            let between = |a: usize, b: usize, share: f64| -> Vec<f64> {
                at(a).iter().zip(at(b)).map(|(a, b)| a + share * (b - a)).collect()
            };
            // of the middles at 0.075 and 0.225 m, and of those 0.3125 and 0.4375 m along the
            // second leg
            let early = apart(at(ELEMENTS), &between(0, 1, 1.0 / 6.0));
            let late = apart(at(ELEMENTS + 1), &between(6, 7, 0.7));
            assert!(early < 1e-12 && late < 1e-12, "at {} s: {early:e}, {late:e}", sample.t);
        }
    }
}
