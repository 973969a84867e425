//! Heavy tops with published or independent values: approached with the order of the scheme.
//!
//! Physics: a symmetric body with a fixed point under gravity. The steady top precesses uniformly
//! (closed form); the fast top of Brüls, Cardona & Arnold (2012) has independent values at 0.2 s
//! and 1 s. The vertical angular momentum is exact.

#![allow(clippy::unwrap_used)] // a test

use crate::harness;

use harness::models::{orders, simulation};

fn run_to(name: &str, end: f64, steps: u32, order: u32) -> [f64; 3] {
    let overrides = [
        ("simulation.step", format!("{:e}", end / f64::from(steps))),
        ("simulation.order", order.to_string()),
    ];
    let mut simulation = simulation(name, &overrides);
    for _ in 0..steps {
        simulation.integrator().step().unwrap();
    }
    let q = &simulation.integrator().state().q;
    [q[0], q[1], q[2]]
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn the_steady_top_precesses_with_the_order_of_the_scheme() {
    let arm = 0.075;
    let (sin, cos) = (60.0_f64.to_radians().sin(), 60.0_f64.to_radians().cos());
    let turn = 10.0_f64; // precession 10 rad/s for 1 s
    let exact = [arm * sin * turn.sin(), -arm * sin * turn.cos(), arm * cos];
    for (order, steps) in [(2, 2000), (4, 400), (6, 400)] {
        let errors = [steps, 2 * steps, 4 * steps]
            .map(|steps| distance(run_to("heavy_top_steady", 1.0, steps, order), exact));
        let slopes = orders(&errors);
        println!("steady top, order {order}: errors {errors:?}, slopes {slopes:.3?}");
        for slope in &slopes {
            assert!((slope - f64::from(order)).abs() < 0.25, "order {order}: {slopes:?}");
        }
    }
}

#[test]
fn the_fast_top_approaches_the_independent_values() {
    for (end, exact) in [
        (0.2, [0.605_550_56, 0.598_957_68, -0.523_983_03]),
        (1.0, [0.173_343_96, 0.640_088_59, -0.748_490_79]),
    ] {
        let steps = (end / 1e-3) as u32;
        let errors = [2 * steps, 4 * steps, 8 * steps]
            .map(|steps| distance(run_to("heavy_top_fast", end, steps, 2), exact));
        let slopes = orders(&errors);
        println!("fast top at {end} s: errors {errors:?}, slopes {slopes:.3?}");
        for slope in &slopes {
            assert!((slope - 2.0).abs() < 0.1, "order 2: {slopes:?}");
        }
        // the reference has eight digits
        for (order, steps) in [(4, 2 * steps), (6, steps)] {
            let error = distance(run_to("heavy_top_fast", end, steps, order), exact);
            println!("fast top at {end} s, order {order}: off by {error:.1e}");
            assert!(error < 3e-8, "order {order}: {error:e}");
        }
    }
}

#[test]
fn the_schemes_agree_and_condition_numbers_behave() {
    let run = |scheme: &str, h: f64| {
        let overrides =
            [("simulation.scheme", scheme.to_owned()), ("simulation.step", format!("{h:e}"))];
        let mut simulation = simulation("heavy_top_steady", &overrides);
        for _ in 0..200 {
            simulation.integrator().step().unwrap();
        }
        let condition = simulation.integrator().condition();
        (simulation.integrator().state().q.clone(), condition)
    };
    let (reference, _) = run("nodal", 1e-3);
    for (scheme, exponent) in
        [("constrained", Some(3.0)), ("dalembert", Some(1.0)), ("nodal", None), ("reduced", None)]
    {
        let (q, coarse) = run(scheme, 1e-3);
        let off = (0..12).map(|i| (q[i] - reference[i]).abs()).fold(0.0, f64::max);
        println!("{scheme}: off by {off:.1e} from nodal after 200 steps");
        assert!(off < 1e-12, "{scheme}: {off:e}");
        let (Some(expected), Some(coarse)) = (exponent, coarse) else { continue };
        let (_, fine) = run(scheme, 1e-5);
        let fine = fine.unwrap();
        let written = (fine.as_written / coarse.as_written).log10() / 2.0;
        let scaled = (fine.scaled / coarse.scaled).log10() / 2.0;
        println!("{scheme}: κ ~ h^{:.2} as written, h^{:.2} scaled", -written, -scaled);
        assert!((written - expected).abs() < 0.15, "{scheme}: h^{:.2}", -written);
        assert!(scaled.abs() < 0.15, "{scheme}: scaled h^{:.2}", -scaled);
    }
}

#[test]
fn the_condition_number_of_the_nodal_scheme_does_not_depend_on_the_step() {
    use vi_multibody::run::Solver;
    for scheme in ["nodal", "reduced"] {
        let at = |h: f64| {
            let overrides =
                [("simulation.scheme", scheme.to_owned()), ("simulation.step", format!("{h:e}"))];
            let model = harness::models::model("heavy_top_steady", &overrides);
            let mut simulation = holonom::Simulation::with_solver(&model, Solver::Dense).unwrap();
            for _ in 0..3 {
                simulation.integrator().step().unwrap();
            }
            simulation.integrator().condition().unwrap().as_written
        };
        // above, the rotation in a step would be too large
        let numbers = [4e-3, 1e-3, 1e-4, 1e-5].map(at);
        println!("{scheme}: κ = {numbers:.3?} at h = 4e-3, 1e-3, 1e-4, 1e-5");
        let spread = numbers[3] / numbers[1];
        assert!((0.9..1.1).contains(&spread), "{scheme}: {numbers:?}");
    }
}
