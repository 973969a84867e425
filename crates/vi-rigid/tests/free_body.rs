//! A free rigid body without potential is a Moser–Veselov system: the discrete energy, the linear
//! and the angular momentum are constant to round-off. Under a load, the momenta change by exactly
//! the impulses.
#![allow(clippy::unwrap_used)] // helpers of tests

use crate::common;

use common::Stepper;
use nalgebra::{Matrix3, Vector3};
use vi_core::momentum_map::Momentum;
use vi_core::{SeparableSystem, State};
use vi_rigid::{
    Load, LoadKind, PrincipalInertia, RigidBody, SingleBody, Support, TimeHistory, directors,
    rotation,
};

fn body() -> SingleBody {
    let inertia = PrincipalInertia::new([1.0, 2.0, 2.5]).unwrap();
    SingleBody::new(RigidBody::from_inertia(3.0, &inertia).unwrap(), Support::Free)
}

fn momentum(state: &State) -> Momentum {
    let mut momentum = Momentum::default();
    directors::add_momentum(&state.q, &state.p, &mut momentum);
    momentum
}

#[test]
fn energy_and_momentum_are_constant_to_round_off() {
    let body = body();
    let q = body.configuration(
        &Vector3::new(5.0, -3.0, 2.0),
        &rotation::exp(&Vector3::new(0.3, 1.0, -0.4)),
    );
    let mut state = body.start(0.0, &q, &[1.0, -0.5, 0.25, 0.01, 3.0, 0.02]);
    let mut stepper = Stepper::new(body, body.system(&Vector3::zeros()));
    let start = momentum(&state);
    stepper.step(0.01, &mut state);
    let energy = stepper.discrete_energy();
    let (mut energy_drift, mut linear_drift, mut angular_drift) = (0.0_f64, 0.0_f64, 0.0_f64);
    for _ in 0..20_000 {
        stepper.step(0.01, &mut state);
        energy_drift = energy_drift.max((stepper.discrete_energy() / energy - 1.0).abs());
        let now = momentum(&state);
        for k in 0..3 {
            linear_drift = linear_drift.max((now.linear[k] - start.linear[k]).abs());
            angular_drift = angular_drift.max((now.angular[k] - start.angular[k]).abs());
        }
    }
    println!(
        "drift: E_d {energy_drift:.1e}, linear {linear_drift:.1e}, angular {angular_drift:.1e}"
    );
    assert!(energy_drift < 1e-12, "discrete energy drifts by {energy_drift:e} (relative)");
    assert!(linear_drift < 1e-13, "linear momentum drifts by {linear_drift:e}");
    // the centre is 230 m away at the end: ε |φ| |p| = 2e-13 per step, √N of them
    assert!(angular_drift < 2e-11, "angular momentum drifts by {angular_drift:e}");
}

#[test]
fn a_dead_load_gives_its_impulse() {
    // triangle 0 → 100 → 0 over 1 s with kinks on step boundaries: impulse 50
    let history = TimeHistory::Triangle { start: 0.0, peak: 0.5, end: 1.0, amplitude: 100.0 };
    let (force, torque) = (Vector3::new(0.8, 0.0, -0.2), Vector3::new(0.06, 0.03, 0.0));
    let load = Load::new(0, LoadKind::Dead, force, torque, history).unwrap();
    let body = body();
    let q = body.configuration(&Vector3::zeros(), &Matrix3::identity());
    let mut state = body.start(0.0, &q, &[0.0; 6]);
    let system: SeparableSystem = body.system(&Vector3::zeros()).force(Box::new(load));
    let mut stepper = Stepper::new(body, system);
    for _ in 0..50 {
        stepper.step(0.02, &mut state);
    }
    let end = momentum(&state);
    let spin =
        Vector3::from(end.angular) - directors::center(&state.q).cross(&Vector3::from(end.linear));
    let linear_error = (Vector3::from(end.linear) - 50.0 * force).norm();
    let spin_error = (spin - 50.0 * torque).norm();
    println!("impulses: off by {linear_error:.1e} and {spin_error:.1e}");
    assert!(linear_error < 1e-12, "linear impulse off by {linear_error:e}");
    assert!(spin_error < 1e-12, "angular impulse off by {spin_error:e}");
}

#[test]
fn a_follower_torque_about_a_principal_axis_spins_up_the_body() {
    // J_3 ω = τ t; the axis d_3 is not shrunk by averaging over rotations about itself
    let spin = |steps: u32| {
        let torque = Vector3::new(0.0, 0.0, 2.0);
        let history = TimeHistory::default();
        let load = Load::new(0, LoadKind::Follower, Vector3::zeros(), torque, history).unwrap();
        let body = body();
        let rotated = rotation::exp(&Vector3::new(0.2, 0.5, -0.1));
        let q = body.configuration(&Vector3::zeros(), &rotated);
        let mut state = body.start(0.0, &q, &[0.0; 6]);
        let system = body.system(&Vector3::zeros()).force(Box::new(load));
        let mut stepper = Stepper::new(body, system);
        for _ in 0..steps {
            assert!(stepper.step(2.0 / f64::from(steps), &mut state) <= 6, "quadratic convergence");
        }
        let angular = Vector3::from(momentum(&state).angular);
        (angular - 4.0 * rotated.column(2)).norm()
    };
    let error = spin(40);
    assert!(error < 1e-13, "{error:e}");
}
