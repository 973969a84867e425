//! Springs, dampers, controls and prescribed motion on joint coordinates: energy and momentum
//! balances.
#![allow(clippy::unwrap_used)] // helpers of tests

use crate::common;

use vi_core::MechanicalSystem;
use vi_core::momentum_map::Momentum;
use vi_core::sparse::SparseMatrix;
use vi_emscheme::EmIntegrator;
use vi_emscheme::constraint::DiscreteConstraints;
use vi_emscheme::{EmForm, EmOptions};
use vi_multibody::PairKind;
use vi_multibody::joint_force::{JointForce, Viscous};
use vi_multibody::mechanism::Mechanism;

fn momentum(run: &EmIntegrator<Mechanism>) -> Momentum {
    let mut p = vec![0.0; run.state().q.len()];
    run.system().mass().mul_add(1.0, &run.state().v, &mut p);
    run.constraints().momentum(&run.state().q, &p)
}

fn drift(a: &Momentum, b: &Momentum) -> f64 {
    common::distance(&a.linear, &b.linear).max(common::distance(&a.angular, &b.angular))
}

/// Free-floating pairs with a spring on every joint coordinate: several turns, energy to round-off.
#[test]
fn joint_springs_keep_energy_and_momenta() {
    for kind in [
        PairKind::Revolute,
        PairKind::Cylindrical,
        PairKind::Prismatic,
        PairKind::Planar,
        PairKind::Universal,
        PairKind::Screw(0.15.into()),
    ] {
        for form in EmForm::ALL {
            let model = common::pair(kind, false);
            let springs = (0..kind.dof()).filter_map(|k| common::joint_spring(&model, k));
            let system = springs.fold(model.system(), |system, spring| system.gradient(spring));
            let options = EmOptions::new(form, 0.01);
            let mut run =
                vi_emscheme::run::integrator(system, model.mechanism.clone(), options).unwrap();
            let (energy, start, mut worst) =
                (run.system().energy(run.state()), momentum(&run), [0.0_f64; 2]);
            for _ in 0..500 {
                run.step().unwrap();
                worst[0] = worst[0].max((run.system().energy(run.state()) - energy).abs());
                worst[1] = worst[1].max(drift(&momentum(&run), &start));
            }
            println!("{:<11} {:<15} energy, momenta off by {worst:?}", kind.name(), form.name());
            assert!(worst[0] < 5e-12 && worst[1] < 1e-12, "{}: {worst:?}", kind.name());
        }
    }
}

/// A damper takes out `c (Δθ)²/h` in a step, and no momentum.
#[test]
fn a_damper_takes_out_what_its_law_says() {
    let mut model = common::pair(PairKind::Revolute, false);
    let coordinate = model.mechanism.coordinate(0, 0).unwrap();
    let system =
        model.system().load(JointForce { coordinate: coordinate.clone(), law: Viscous(0.7) });
    let options = EmOptions::new(EmForm::Nodal, 0.01);
    let mut run = vi_emscheme::run::integrator(system, model.mechanism.clone(), options).unwrap();
    let (start, mut worst, mut lost) = (momentum(&run), [0.0_f64; 2], 0.0);
    for _ in 0..500 {
        let energy = run.system().energy(run.state());
        run.step().unwrap();
        let turn = coordinate.change(run.interval()).difference;
        let work = 0.7 * turn * turn / 0.01;
        lost += work;
        worst[0] = worst[0].max((run.system().energy(run.state()) - energy + work).abs());
        worst[1] = worst[1].max(drift(&momentum(&run), &start));
    }
    println!("{lost:.2} J lost, balance off by {worst:?}");
    assert!(lost > 0.5 && worst[0] < 1e-12 && worst[1] < 1e-12, "{lost}: {worst:?}");
}

/// Prescribed motion: `H_{n+1} − H_n = −λ Δθ`, in every form the same.
#[test]
fn a_prescribed_motion_does_the_work_of_its_multiplier() {
    let model = common::driven();
    let mut ends = Vec::new();
    for form in EmForm::ALL {
        let mut run = model.run(form, 0.01);
        let (mut worst, mut done) = (0.0_f64, 0.0);
        for _ in 0..300 {
            let energy = run.system().energy(run.state());
            run.step().unwrap();
            let lambda = run.node_before().unwrap().lambda_mid.clone();
            let (m, n) = (lambda.len(), run.state().q.len());
            let s = run.interval();
            let jacobian = SparseMatrix::assemble(m, n, |out| {
                run.constraints().discrete_jacobian(s, out);
            });
            let mut rate = vec![0.0; m];
            jacobian.mul_add(1.0, &s.dq, &mut rate);
            let work: f64 = rate.iter().zip(&lambda).map(|(g, l)| g * l).sum();
            done += work.abs();
            worst = worst.max((run.system().energy(run.state()) - energy + work).abs());
        }
        println!("{:<15} {done:.1} J of work, balance off by {worst:.1e}", form.name());
        assert!(done > 1.0 && worst < 1e-11, "{}: {worst:e}", form.name());
        ends.push(run.state().q.clone());
    }
    for end in &ends[1..] {
        let off = common::distance(end, &ends[0]);
        assert!(off < 1e-10, "the forms differ by {off:e}");
    }
}
