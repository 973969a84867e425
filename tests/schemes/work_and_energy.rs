//! Work of discrete forces: what motors, dampers and loads do is what the energy changes by.
//!
//! Discrete Lagrange–d'Alembert forces do the work `Σ f_d·Δq` over the steps; the balance
//! `H_d(N) − H_d(0) = Σ τ Δθ` holds to second order, and momentum is taken up exactly as impulse.

#![allow(clippy::unwrap_used)] // a test

use crate::harness;

use harness::models::{orders, overrides};
use holonom::output::{EnergySummary, SummaryBuilder};
use holonom::{Model, ModelError, Simulation};
use vi_multibody::run::MechanismIntegrator;
use vi_testkit::model::{changed, heavy, motion, two_links};

/// Two links on hinges, each with `own` keys.
fn links(settings: &str, own: [&str; 2]) -> String {
    heavy("arm", [0.0, 0.0, -9.81], settings)
        + &two_links([2.0, 1.0], [[0.02, 0.2, 0.2], [0.01, 0.1, 0.1]], own)
}

/// A two-link arm: motor and spring at the first hinge, damper at the second.
fn arm(step: f64, order: u32, damping: f64) -> String {
    links(
        &format!("step = {step:e}, end = 1.0, order = {order}"),
        [
            "motor = { effort = -20.0, history = { type = \"harmonic\", frequency = 0.7, phase = 1.0 } }\n\
             spring = { stiffness = 15.0, rest = 0.2 }\n",
            &format!("damper = {{ damping = {damping:?} }}\n"),
        ],
    )
}

/// A sensor of the work of the only motion has the column of all, and the integral of its power; of
/// one of several it is refused.
#[test]
fn the_only_motion_has_its_work() {
    let sensors = vi_testkit::model::sensor("done", "work", "drive")
        + &vi_testkit::model::sensor("power", "power", "drive");
    let text = |step: f64, more: &str| {
        links(&format!("step = {step:e}, end = 0.5, project_start = true"), ["", ""])
            + &motion("drive", "shoulder", "{ moves = [{ start = 0.0, end = 0.5, by = 0.8 }] }")
            + &sensors
            + more
    };
    let differences = [0.01, 0.005, 0.0025].map(|step| {
        let model = Model::from_toml(&text(step, "")).unwrap();
        let mut simulation = Simulation::new(&model).unwrap();
        let nodes: Vec<_> = simulation.samples().map(Result::unwrap).collect();
        let mut sum = 0.0;
        for (k, node) in nodes.iter().enumerate() {
            let [.., motions, _] = node.energies[..] else { panic!() };
            assert!((node.sensors[0] - motions).abs() <= 1e-12 * (1.0 + motions.abs()));
            if k > 0 {
                sum += 0.5 * step * (nodes[k - 1].sensors[1] + node.sensors[1]);
            }
        }
        let done = nodes.last().unwrap().sensors[0];
        println!("{step}: work {done}, integral of the power {sum}");
        assert!(done.abs() > 1.0);
        (done - sum).abs()
    });
    let orders = orders(&differences);
    println!("{differences:?}: orders {orders:?}");
    assert!(orders.iter().all(|order| (1.7..2.4).contains(order)), "{orders:?}");
    let other = motion("other", "elbow", "{ moves = [{ start = 0.0, end = 0.5, by = 0.1 }] }");
    let error = Model::from_toml(&text(0.01, &other)).unwrap_err();
    assert!(format!("{error:?}").contains("is kept with that of other motions"), "{error:?}");
}

/// Energy at the end less energy at the start less the work of motor and damper.
fn imbalance(steps: u32) -> f64 {
    let h = 1.0 / f64::from(steps);
    let model = Model::from_toml(&arm(h, 2, 0.8)).unwrap();
    let mut simulation = Simulation::new(&model).unwrap();
    let run = simulation.integrator();
    // of the motor and the damper, in this order
    let angles = |run: &MechanismIntegrator| run.state().angles.clone();
    let start = run.observe_state().unwrap().hamiltonian_projected.total();
    let mut work = 0.0;
    for n in 0..steps {
        let before = angles(run);
        run.step().unwrap();
        let after = angles(run);
        let t = (f64::from(n) + 0.5) * h;
        let effort = -20.0 * (std::f64::consts::TAU * 0.7 * t + 1.0).sin();
        work += effort * (after[0] - before[0]); // τ Δθ
        let turn = after[1] - before[1];
        work -= 0.8 * turn / h * turn; // c θ̇ Δθ taken out
    }
    run.observe_state().unwrap().hamiltonian_projected.total() - start - work
}

#[test]
fn energy_changes_by_the_work_done_to_second_order() {
    let errors = [100, 200, 400, 800].map(|steps| imbalance(steps).abs());
    let slopes = orders(&errors);
    println!("imbalance {errors:?} J, slopes {slopes:.3?}");
    for slope in &slopes {
        assert!((slope - 2.0).abs() < 0.15, "{slopes:?}");
    }
}

/// The energy of a run as its summary reports it.
fn energy(text: &str, settings: &[(&str, String)]) -> EnergySummary {
    let model = Model::from_toml_with(text, &overrides(settings)).unwrap();
    let mut simulation = Simulation::new(&model).unwrap();
    let mut summary = SummaryBuilder::default();
    let mut observe = |sample: &holonom::Sample| {
        summary.record(sample);
        Ok::<(), ()>(())
    };
    let outcome = simulation.run(&mut observe, &mut |_, _| {}).unwrap();
    summary.finish(&model, simulation.assembly(), &outcome, 0.0).energy
}

/// The first link is driven, the second one swings freely.
fn driven() -> String {
    links("step = 0.01, end = 1.0", ["rate = 1.2566370614359172\n", ""])
        + &motion("drive", "shoulder", "{ amplitude = 0.2, frequency = 1.0 }")
}

#[test]
fn the_balance_of_the_summary_is_of_second_order_in_every_scheme() {
    let (arm, driven) = (arm(0.01, 2, 0.8), driven());
    for (name, text) in [("motor and damper", arm.as_str()), ("prescribed motion", driven.as_str())]
    {
        for (scheme, order) in [
            ("nodal", 2),
            ("reduced", 2),
            ("constrained", 2),
            ("dalembert", 2),
            ("em-nodal", 2),
            ("em-constrained", 2),
        ] {
            let errors = [100, 200, 400].map(|steps| {
                let energy = energy(
                    text,
                    &[
                        ("simulation.step", format!("{:?}", 1.0 / f64::from(steps))),
                        ("simulation.scheme", format!("\"{scheme}\"")),
                        ("simulation.order", order.to_string()),
                        ("simulation.every", "30".to_owned()), // not a divisor of the steps
                    ],
                );
                assert!(energy.drift_per_step.is_none() && energy.work.abs() > 0.5, "{energy:?}");
                let balance = energy.last - energy.initial - energy.work;
                assert!((balance - energy.balance_error).abs() < 1e-12);
                energy.balance_error.abs()
            });
            println!("{name}, {scheme}, order {order}: {errors:.2?} J, {:.2?}", orders(&errors));
            let exact = errors[2] < 1e-9;
            assert!(
                exact || orders(&errors).iter().all(|o| *o > 1.8),
                "{name}, {scheme}: {errors:?}"
            );
        }
    }
}

#[test]
fn conservative_systems_report_the_slope_of_the_shadow_energy() {
    let text = harness::models::shipped("pendulum");
    for (scheme, order) in [("nodal", 2), ("nodal", 4), ("em-nodal", 2), ("em-nodal", 4)] {
        let set = [
            ("simulation.scheme", format!("\"{scheme}\"")),
            ("simulation.order", order.to_string()),
            ("simulation.end", "10.0".into()),
        ];
        let energy = energy(&text, &set);
        let drift = energy.drift_per_step.unwrap();
        let error = energy.max_abs_error;
        println!("{scheme}, order {order}: {drift:.1e} J per step, error {error:.1e} J");
        // a band of the error that is not seen would show as much as error / steps
        let most = f64::max(1e-5 * error, 1e-15);
        assert!(drift.abs() < most && energy.work == 0.0, "{energy:?}");
        assert!((energy.balance_error - (energy.last - energy.initial)).abs() < 1e-14);
    }
}

#[test]
fn dampers_refuse_backward_sub_steps_and_motors_do_not() {
    let damped = Model::from_toml(&arm(0.01, 4, 0.8)).unwrap();
    let Err(ModelError::Unsupported { key, what, help }) = Simulation::new(&damped).map(|_| ())
    else {
        panic!("a damper with backward sub-steps must be refused");
    };
    println!("{key}: {what}; {help}");
    assert_eq!(
        (key.as_str(), help.as_str()),
        ("simulation.order", "write order = 2, or method = \"galerkin\"")
    );

    // without the damper the order is that of the composition, motor and spring included
    let end = |steps: u32| {
        let text = changed(&arm(1.0 / f64::from(steps), 4, 0.0), "damper", "# damper");
        let mut simulation = Simulation::new(&Model::from_toml(&text).unwrap()).unwrap();
        for _ in 0..steps {
            simulation.integrator().step().unwrap();
        }
        simulation.integrator().state().q.clone()
    };
    let fine = end(640);
    let error = |steps| {
        let q = end(steps);
        (0..24).map(|i| (q[i] - fine[i]).powi(2)).sum::<f64>().sqrt()
    };
    let slopes = orders(&[error(40), error(80), error(160)]);
    println!("order 4 with a motor: slopes {slopes:.3?}");
    assert!(slopes.iter().all(|slope| (slope - 4.0).abs() < 0.3), "{slopes:?}");
}

#[test]
fn the_solvers_and_the_cuts_give_the_same_motion() {
    let run = |text: &str| {
        let mut simulation = Simulation::new(&Model::from_toml(text).unwrap()).unwrap();
        for _ in 0..200 {
            simulation.integrator().step().unwrap();
        }
        simulation.integrator().state().q.clone()
    };
    let difference =
        |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let text = harness::models::shipped("chain8");
    let motion = |solver: &str| {
        run(&text.replace("[simulation]", &format!("[simulation]\nsolver = \"{solver}\"")))
    };
    let reference = motion("auto");
    for solver in ["articulated", "dense", "sparse"] {
        let off = difference(&motion(solver), &reference);
        println!("{solver}: off by {off:.1e}");
        assert!(off < 1e-11, "{solver}: {off:e}");
    }
    // a four-bar loop, cut at each of its joints in turn
    let text = harness::models::shipped("bricard");
    let reference = run(&text);
    for joint in 0..6 {
        let mut count = 0;
        let lines = text.lines().map(|line| {
            let here = line.trim() == "[[joint]]";
            count += usize::from(here);
            if here && count == joint + 1 { "[[joint]]\ncut = true" } else { line }
        });
        let off = difference(&run(&lines.collect::<Vec<_>>().join("\n")), &reference);
        println!("Bricard cut at joint {joint}: off by {off:.1e}");
        assert!(off < 1e-9, "cut at joint {joint}: {off:e}");
    }
}
