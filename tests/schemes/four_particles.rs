//! Four particles with springs and rigid bars (Gonzalez 1999): independent values, exact momenta.

#![allow(clippy::unwrap_used)] // a test

use crate::harness;

use harness::models::{orders, simulation};

/// `q_1` and `q_4` at t = 1, from an independent integration (five significant digits and more).
const AT_ONE: ([f64; 3], [f64; 3]) =
    ([0.007_984_33, 0.011_392_15, 0.000_415_10], [0.692_083_68, 0.655_341_36, 0.921_062_54]);

#[test]
fn the_motion_approaches_the_independent_values() {
    let error = |steps: u32, order: u32| {
        let overrides = [
            ("simulation.step", format!("{:e}", 1.0 / f64::from(steps))),
            ("simulation.order", order.to_string()),
        ];
        let mut simulation = simulation("four_particles", &overrides);
        let run = simulation.integrator();
        for _ in 0..steps {
            run.step().unwrap();
        }
        let q = &run.state().q;
        let off = |at: usize, exact: [f64; 3]| (0..3).map(move |i| (q[at + i] - exact[i]).powi(2));
        off(0, AT_ONE.0).chain(off(9, AT_ONE.1)).sum::<f64>().sqrt()
    };
    let errors = [200, 400, 800, 1600].map(|steps| error(steps, 2));
    let slopes = orders(&errors);
    println!("errors {errors:?}, slopes {slopes:.3?}");
    for slope in &slopes {
        assert!((slope - 2.0).abs() < 0.1, "{slopes:?}");
    }
    let fine = error(200, 6);
    println!("order 6, 200 steps: off by {fine:.1e} (the values have eight digits)");
    assert!(fine < 3e-8, "{fine:e}");
}

#[test]
fn momenta_are_exact_and_the_schemes_agree() {
    let mut ends = Vec::new();
    for scheme in ["nodal", "reduced", "constrained", "dalembert"] {
        let mut simulation =
            simulation("four_particles", &[("simulation.scheme", scheme.to_owned())]);
        let run = simulation.integrator();
        let mechanism = run.constraints().clone();
        let mut worst = 0.0_f64;
        for _ in 0..300 {
            run.step().unwrap();
            let state = run.state();
            let momentum = mechanism.momentum(&state.q, &state.p);
            for (found, exact) in momentum.angular.iter().zip([2.0, -2.0, 0.0]) {
                worst = worst.max((found - exact).abs());
            }
            for (found, exact) in momentum.linear.iter().zip([0.0, 0.0, 2.0]) {
                worst = worst.max((found - exact).abs());
            }
        }
        println!("{scheme}: momenta off by {worst:.1e} after 300 steps");
        assert!(worst < 1e-12, "{scheme}: {worst:e}");
        ends.push(run.state().q.clone());
    }
    for other in &ends[1..] {
        let off = (0..12).map(|i| (other[i] - ends[0][i]).abs()).fold(0.0, f64::max);
        println!("schemes differ by {off:.1e}");
        assert!(off < 1e-9, "{off:e}");
    }
}
