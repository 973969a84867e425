//! `energy.csv`: parts of the energy, the work of each force, and the balance.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::{assert_order, model, orders, samples};
use holonom::{Model, Sample, Simulation};

const MODEL: &str = include_str!("../models/every_force.toml");

fn run(model: &Model) -> (Vec<String>, Vec<Sample>) {
    let mut simulation = Simulation::new(model).unwrap();
    let samples = samples(&mut simulation);
    (simulation.energy_columns().to_vec(), samples)
}

#[test]
fn parts_add_up_and_the_balance_closes() {
    for scheme in ["nodal", "em-nodal"] {
        let steps = [2e-3, 1e-3, 5e-4];
        let balances = steps.map(|h| {
            let step = format!("{h:e}");
            let own = [("simulation.step", step.as_str()), ("simulation.scheme", scheme)];
            let (columns, samples) = run(&model(MODEL, &own));
            let expected = [
                "kinetic",
                "gravity",
                "elastic",
                "springs",
                "total",
                "work_of_material_damping",
                "work.coil",
                "work.shoulder.motor",
                "work.elbow.damper",
                "work.elbow.motor",
                "work.push",
                "work.wind",
                "work_of_motions",
                "balance",
            ];
            assert_eq!(columns, expected);
            let mut sum = 0.0_f64;
            for s in &samples {
                let e = &s.energies;
                assert_eq!(e.len(), expected.len());
                sum = sum.max((e[0] + e[1] + e[2] + e[3] - e[4]).abs());
                let works: f64 = e[5..13].iter().sum();
                assert!((works - s.work).abs() < 1e-13);
                assert!((e[4] - samples[0].energies[4] - works - e[13]).abs() < 1e-12);
            }
            assert!(sum < 1e-12, "{scheme}: the parts miss the total by {sum:e} J");
            let last = &samples.last().unwrap().energies;
            println!("{scheme}, h = {h}: parts off by {sum:.1e} J, at the end {last:.3?}");
            // what dissipates takes energy
            assert!(last[5] < -1e-6 && last[6] < 0.0 && last[8] < 0.0);
            assert!(last[5..13].iter().all(|work| work.abs() > 1e-6));
            let largest = |s: &Sample| s.energies[13].abs();
            samples.iter().map(largest).fold(0.0, f64::max)
        });
        if scheme == "em-nodal" {
            println!("balance {balances:?} J");
            // by the prescribed motion
            assert_order(&orders("balance", &steps, &balances), 2.0, 0.3);
        } else {
            assert_order(&orders("balance", &steps, &balances), 2.0, 0.3);
        }
    }
}

const DRIVEN: &str = include_str!("../models/driven_pendulum.toml");

/// The sub-steps of a composition have weights of opposite sign; the work of motions keeps its
/// order all the same.
#[test]
fn the_work_of_motions_has_the_order_of_the_composition() {
    for (order, scheme) in [(4, "nodal"), (4, "constrained"), (6, "nodal")] {
        let steps = [8e-2, 4e-2, 2e-2];
        let balances = steps.map(|h| {
            let (step, order) = (format!("{h:e}"), order.to_string());
            let own = [
                ("simulation.step", step.as_str()),
                ("simulation.order", order.as_str()),
                ("simulation.scheme", scheme),
            ];
            let (_, samples) = run(&model(DRIVEN, &own));
            let balance = |s: &Sample| s.energies.last().unwrap().abs();
            let work = samples.iter().map(|s| s.work.abs()).fold(0.0, f64::max);
            assert!(work > 0.1, "the drive works: {work} J");
            samples.iter().map(balance).fold(0.0, f64::max)
        });
        println!("{scheme}, order {order}: balance {balances:?} J");
        assert_order(&orders("balance", &steps, &balances), f64::from(order), 0.5);
    }
}

/// Without prescribed motions an energy–momentum scheme closes the balance to round-off.
#[test]
fn energy_momentum_schemes_close_the_balance_exactly() {
    let drive = MODEL.find("[[constraint]]").unwrap()..MODEL.find("[[spring]]").unwrap();
    let text = MODEL.replace(&MODEL[drive], "");
    let own = [("simulation.scheme", "em-nodal"), ("simulation.step", "2e-3")];
    let (columns, samples) = run(&model(&text, &own));
    assert!(!columns.contains(&"work_of_motions".to_owned()));
    let balance = samples.iter().map(|s| s.energies.last().unwrap().abs()).fold(0.0, f64::max);
    println!("balance {balance:.1e} J");
    assert!(balance < 1e-11);
}

/// The work of a constant torque on a wheel is the torque times the angle.
#[test]
fn the_work_of_a_motor_is_its_effort_times_the_angle() {
    let text = include_str!("../models/wheel.toml");
    let (columns, samples) = run(&Model::from_toml(text).unwrap());
    assert_eq!(columns, ["kinetic", "total", "work.axle.motor", "balance"]);
    let last = samples.last().unwrap();
    // θ = ½ (τ/I) t²
    let error = (last.energies[2] - 2.0 * last.sensors[0]).abs() / last.energies[2];
    println!("angle {} rad, work {} J, off by {error:.1e}", last.sensors[0], last.energies[2]);
    assert!((last.sensors[0] - 18.0).abs() < 1e-3 && error < 1e-4);
}
