//! The free rigid body: flips about the middle axis (Dzhanibekov) and exact invariants.
//!
//! Physics: moments of inertia (1, 2, 3), turning near the middle axis. The body angular velocity
//! has the period 39.10573419728772 s; its second component changes sign with the first one after
//! 19.55286709864386 s (complete elliptic integral). The discrete motion is a Moser–Veselov system:
//! `E_d` and `H_d(ᵠp)` are constant to round-off.

#![allow(clippy::unwrap_used)] // a test

use crate::harness;

use harness::models::{exponent, orders, simulation};
use nalgebra::{Matrix3, Vector3};

const HALF_PERIOD: f64 = 19.552_867_098_643_86;
const INERTIA: [f64; 3] = [1.0, 2.0, 3.0];

/// Body components of the angular velocity, from the projected momentum.
fn body_rates(q: &[f64], p: &[f64]) -> Vector3<f64> {
    let triad = Matrix3::from_column_slice(&q[3..12]);
    let momentum: Vector3<f64> = (0..3)
        .map(|i| {
            let at = 3 + 3 * i..6 + 3 * i;
            Vector3::from_column_slice(&q[at.clone()]).cross(&Vector3::from_column_slice(&p[at]))
        })
        .sum();
    let body = triad.transpose() * momentum;
    Vector3::new(body[0] / INERTIA[0], body[1] / INERTIA[1], body[2] / INERTIA[2])
}

/// Distance of the body rates after half a period from the exact `(−ω_1, −ω_2, ω_3)(0)`.
fn flip_error(order: u32, steps: u32) -> f64 {
    let h = HALF_PERIOD / f64::from(steps);
    let overrides =
        [("simulation.step", format!("{h:e}")), ("simulation.order", order.to_string())];
    let mut simulation = simulation("free_body", &overrides);
    let run = simulation.integrator();
    for _ in 0..steps {
        run.step().unwrap();
    }
    let q = run.state().q.clone();
    let rates = body_rates(&q, &run.observe_state().unwrap().p_projected);
    (rates - Vector3::new(-0.01, -1.0, 0.01)).norm()
}

#[test]
fn the_flip_comes_at_its_time_with_the_order_of_the_scheme() {
    for (order, steps) in [(2, 2000), (4, 500), (6, 50)] {
        let errors = [steps, 2 * steps, 4 * steps].map(|steps| flip_error(order, steps));
        let slopes = orders(&errors);
        println!("order {order}: errors {errors:?} at {steps} steps and on, slopes {slopes:.3?}");
        for slope in &slopes {
            assert!((slope - f64::from(order)).abs() < 0.2, "order {order}: slope {slope}");
        }
    }
}

#[test]
fn energies_are_constant_to_round_off_and_momentum_errors_grow_like_round_off() {
    let mut simulation = simulation("free_body", &[("simulation.step", "0.01".into())]);
    let mechanism = simulation.integrator().constraints().clone();
    let run = simulation.integrator();
    let start = mechanism.momentum(&run.state().q, &run.state().p);
    let (steps, mut worst_g, mut energy, mut drift) = (100_000, 0.0_f64, Vec::new(), Vec::new());
    for n in 1..=steps {
        run.step().unwrap();
        if n % 1000 == 0 {
            let node = run.node_before().unwrap().clone();
            let state = run.state();
            let momentum = mechanism.momentum(&state.q, &state.p);
            let off = (0..3).map(|i| (momentum.angular[i] - start.angular[i]).abs());
            drift.push(off.fold(0.0, f64::max));
            worst_g = worst_g.max(node.position_residual);
            energy.push((node.discrete_energy.total(), node.hamiltonian_projected.total()));
        }
    }
    let range = |pick: fn(&(f64, f64)) -> f64| {
        let values = energy.iter().map(pick);
        let (low, high) = values.fold((f64::MAX, f64::MIN), |(l, h), e| (l.min(e), h.max(e)));
        high - low
    };
    let steps_done: Vec<f64> = (1..=drift.len()).map(|k| 1000.0 * k as f64).collect();
    println!("angular momentum error ~ N^{:.2}", exponent(&steps_done, &drift));
    let (e_d, h_d) = (range(|e| e.0), range(|e| e.1));
    let last = drift.last().copied().unwrap();
    println!(
        "{steps} steps: |g| ≤ {worst_g:.1e}, E_d within {e_d:.1e}, H_d(ᵠp) within {h_d:.1e}, \
         angular momentum off by {last:.1e} (ε√N = {:.1e})",
        f64::EPSILON * f64::from(steps).sqrt()
    );
    assert!(worst_g <= 1e-13, "constraint residual {worst_g:e}");
    assert!(e_d < 1e-11 && h_d < 1e-11, "energies move by {e_d:e}, {h_d:e}");
    // round-off of a random walk: a few ε√N; a systematic error of ε a step would give 2e-11
    assert!(last < 2e-12, "angular momentum off by {last:e}");
}
