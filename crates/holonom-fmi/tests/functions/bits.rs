//! Outputs have the bits of a run of the program.

use crate::unit::{OK, Unit, shipped};
use holonom::model::{Scheme, SensorKind};
use holonom::{Model, Simulation};
use holonom_fmu::Version;

/// Steps that are compared.
const STEPS: usize = 20;

/// Columns of accelerations, and of section forces, which balance the inertia: a run takes them
/// from the steps beside a node, of which a unit has not taken the second.
fn is_acceleration(model: &Model, column: usize) -> bool {
    let columns = holonom::sensor::columns(model);
    let sensor = model.sensors.iter().find(|own| own.name == columns[column].sensor);
    let of_level = [
        SensorKind::Acceleration,
        SensorKind::AngularAcceleration,
        SensorKind::JointAcceleration,
        SensorKind::Imu,
        SensorKind::SectionForce,
    ];
    sensor.is_some_and(|sensor| of_level.contains(&sensor.kind))
}

/// Sensors, energy and residual at the nodes of a run.
fn nodes(model: &Model) -> Vec<(f64, Vec<f64>, [f64; 2])> {
    let mut simulation = Simulation::new(model).unwrap();
    let samples = simulation.samples().take(STEPS + 1);
    samples
        .map(|sample| {
            let sample = sample.unwrap();
            (sample.t, sample.sensors, [sample.hamiltonian, sample.residuals.position])
        })
        .collect()
}

fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}

/// Whether it has contacts, stops or dry friction.
fn touches(model: &Model) -> bool {
    let joint = |own: &holonom::model::Joint| own.limits.is_some() || own.friction.is_some();
    !model.contacts.is_empty() || model.joints.iter().any(joint)
}

#[test]
fn outputs_have_the_bits_of_the_run_on_all_shipped_models() {
    let (mut models, mut compared) = (0, 0);
    for (name, text) in shipped() {
        let unit = match Model::from_toml(&text).unwrap().settings.scheme {
            Scheme::Static => continue,
            _ => Unit::new(&text, &[("simulation.every", "1")], &[], &[]),
        };
        models += 1;
        let expected = nodes(&unit.model);
        let (columns, h) = (unit.columns(), unit.model.settings.step);
        let references: Vec<u32> = columns.iter().map(|own| own.0).collect();
        let others = [unit.reference("energy.H"), unit.reference("residual.position")];
        // a communication step of three steps reads every third node
        for (version, every) in [(Version::Fmi3, 1), (Version::Fmi2, 3)] {
            let instance = unit.begun(version);
            for (n, (t, sensors, rest)) in expected.iter().enumerate().step_by(every) {
                if n > 0 {
                    let from = expected[n - every].0;
                    assert_eq!(instance.step(from, h * every as f64).0, OK, "{}", instance.said());
                }
                assert_eq!(instance.get(&[0])[0].to_bits(), t.to_bits(), "{name}: time");
                for (value, (_, column)) in instance.get(&references).iter().zip(&columns) {
                    let of_run = sensors[*column];
                    if is_acceleration(&unit.model, *column) {
                        continue;
                    }
                    compared += 1;
                    let named = &holonom::sensor::columns(&unit.model)[*column];
                    let words = format!("{name}: {} at node {n}", named.name());
                    assert!(same(*value, of_run), "{words}: {value:e}, of the run {of_run:e}");
                }
                // a unit knows the impulses of contacts of a node after its next step alone
                let known = usize::from(touches(&unit.model));
                for (value, of_run) in instance.get(&others).iter().zip(rest).skip(known) {
                    assert!(same(*value, *of_run), "{name}, node {n}: {value:e} {of_run:e}");
                    compared += 1;
                }
            }
        }
    }
    println!("{models} models, {compared} numbers with equal bits");
    assert!(models > 30 && compared > 3000);
}
