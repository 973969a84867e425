//! Gears, screws, guides, distances and prescribed motion from a model file.

#![allow(clippy::unwrap_used)] // a test

use holonom::{Model, ModelError, Simulation};

const MODEL: &str = include_str!("../models/workshop.toml");

#[test]
fn every_kind_holds_in_every_scheme() {
    let mut ends: Vec<Vec<f64>> = Vec::new();
    for scheme in ["nodal", "reduced", "constrained", "dalembert"] {
        let text = MODEL.replace("end = 2.0", &format!("end = 2.0, scheme = \"{scheme}\""));
        let mut simulation = Simulation::new(&Model::from_toml(&text).unwrap()).unwrap();
        let report = simulation.assembly().clone();
        assert_eq!((report.counts.redundant_constraints, report.counts.dof), (0, 9), "{report:?}");
        for _ in 0..400 {
            simulation.integrator().step().unwrap();
        }
        let node = simulation.integrator().observe().unwrap().clone();
        let q = simulation.integrator().state().q.clone();
        // the wheel has turned by 3 t + 0.75 t² = 9 rad, the pinion by −9/0.4
        let angle = |body: usize| q[12 * body + 4].atan2(q[12 * body + 3]);
        let off = |found: f64, turned: f64| {
            let tau = std::f64::consts::TAU;
            ((found - turned) / tau - ((found - turned) / tau).round()).abs() * tau
        };
        let (wheel, pinion) = (off(angle(0), 9.0), off(angle(1), -9.0 / 0.4));
        // m p² + J: a_z = −g m p²/(m p² + J) with p = pitch/2π
        let p = 0.02 / std::f64::consts::TAU;
        let fall = 0.5 * 9.81 * 2.0 * p * p / (2.0 * p * p + 0.1) * 4.0;
        let nut = (q[26] + fall).abs() / fall; // order 2 in h ω, here 2e-3
        println!(
            "{scheme}: |g| ≤ {:.1e}, wheel off by {wheel:.1e}, pinion {pinion:.1e}, nut {nut:.1e} \
             (relative)",
            node.position_residual
        );
        assert!(node.position_residual < 1e-12 && wheel < 1e-12 && pinion < 1e-11);
        assert!(nut < 1e-5, "the nut has fallen by {} of {fall}", -q[26]);
        ends.push(q);
    }
    for end in &ends[1..] {
        let off = end.iter().zip(&ends[0]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("schemes differ by {off:.1e}");
        assert!(off < 1e-9, "{off:e}");
    }
}

#[test]
fn a_start_against_the_drive_is_refused_by_name() {
    let text = MODEL.replace("rate = 3.0", "rate = 2.0");
    let error = Simulation::new(&Model::from_toml(&text).unwrap()).map(|_| ()).unwrap_err();
    let ModelError::InconsistentStart(missed) = error else { panic!("{error}") };
    let keys: Vec<&str> = missed.iter().map(|m| m.key.as_str()).collect();
    println!("{missed:?}");
    assert_eq!(keys, ["constraint.drive"]);
}

#[test]
fn freedoms_that_do_not_exist_are_named() {
    let text = MODEL.replace("joint = \"wheel_axle\"", "joint = \"wheel_axle\"\nfreedom = 1");
    let error = Simulation::new(&Model::from_toml(&text).unwrap()).map(|_| ()).unwrap_err();
    println!("{error}");
    assert!(error.to_string().contains("no coordinate 1"), "{error}");
}

const TURNING: &str = include_str!("../models/turning_gears.toml");

/// Revolutions are counted in whole numbers, and a step ends at the very time at which the next one
/// starts: neither the size of the angles nor of the time is left in `g(q_n, t_n)`.
#[test]
fn driven_gears_meet_their_constraints_to_round_off_after_many_turns() {
    driven_gears(600);
}

#[test]
#[ignore = "long: cargo test --release -- --ignored"]
fn driven_gears_meet_their_constraints_to_round_off_after_95_turns() {
    driven_gears(3_000);
}

fn driven_gears(steps: u64) {
    use holonom::certificate::subject::ModelSubject;
    use holonom::verification::measure::long_run;
    use holonom::verification::subject::{SchemeSetting, SteppingMethod};
    use holonom::vi_constraints::SchemeKind;
    use holonom::vi_emscheme::EmForm;
    let subject = ModelSubject::new(Model::from_toml(TURNING).unwrap());
    let variational = SchemeKind::ALL.map(SteppingMethod::Variational);
    let energy_momentum = EmForm::ALL.map(SteppingMethod::EnergyMomentum);
    let orders = [2, 4].map(|order| variational.map(|method| (method, order)));
    let methods = orders.as_flattened().iter().copied();
    for (method, order) in methods.chain(energy_momentum.map(|method| (method, 2))) {
        let setting = SchemeSetting::new(method, order, 0.01);
        let run = match long_run(&subject, setting, steps) {
            Ok(run) => run,
            Err(why) => panic!("{} {order}: {why}", method.name()),
        };
        let gap = run.residuals().position;
        println!("{} {order}: |g| = {gap:.1e} after {steps} steps", method.name());
        assert!(gap < 1e-14, "{} {order}: {gap:e}", method.name());
    }
}
