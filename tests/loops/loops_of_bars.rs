//! Bars that close loops, and loops of bodies beside point masses: all four schemes give one
//! motion.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::{Run, assert_order, study};
use holonom::{Model, Override, Simulation};
use nalgebra::Vector3;

const TETRAHEDRON: &str = include_str!("../models/tetrahedron_of_bars.toml");

const LINKAGE: &str = include_str!("../models/square_and_pendulum.toml");

fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn the_four_schemes_agree() {
    for text in [TETRAHEDRON, LINKAGE] {
        let start = |scheme| Run::with(text, 0.005, 2, &[("simulation.scheme", scheme)]);
        for scheme in ["dalembert", "nodal", "reduced"] {
            let (mut run, mut reference) = (start(scheme), start("constrained"));
            let (mut q, mut p) = (0.0_f64, 0.0_f64);
            for _ in 0..100 {
                run.steps(2);
                reference.steps(2);
                q = q.max(apart(run.q(), reference.q()));
                let momentum = |run: &mut Run| {
                    let node = run.simulation.integrator().observe_state().unwrap();
                    node.p_projected.clone()
                };
                p = p.max(apart(&momentum(&mut run), &momentum(&mut reference)));
            }
            let closed = run.residual();
            println!(
                "{}, {scheme}: q apart by {q:.1e}, p by {p:.1e}, |g| {closed:.1e}, {} iterations",
                run.model.header.name, run.iterations
            );
            assert!(q < 1e-11 && p < 1e-11 && closed < 1e-14, "{scheme}: {q:e} {p:e} {closed:e}");
        }
    }
}

#[test]
fn positions_converge_with_the_nominal_order() {
    for (text, member) in [(TETRAHEDRON, "e"), (LINKAGE, "bob")] {
        let place = |h: f64, order: u32| {
            let mut run = Run::new(text, h, order);
            run.until(0.8);
            Vector3::from_column_slice(&run.coordinates(member)[..3])
        };
        let fine = place(0.005, 8);
        for (nominal, steps) in [(2, [0.02, 0.01, 0.005]), (4, [0.02, 0.01, 0.005])] {
            let what = format!("{member}, order {nominal}");
            let (_, orders) = study(&what, &steps, |h| (place(h, nominal) - fine).norm());
            assert_order(&orders, f64::from(nominal), 0.5);
        }
    }
}

#[test]
fn a_flat_start_is_refused() {
    let flat = include_str!("../models/flat_bars.toml");
    for scheme in ["constrained", "dalembert", "nodal", "reduced"] {
        let overrides = [Override::new("simulation.scheme", scheme)];
        let model = Model::from_toml_with(flat, &overrides).unwrap();
        let refused = Simulation::new(&model).unwrap_err().to_string();
        println!("{refused}");
        assert!(refused.contains("rank 2 there and rank 3 next to it"), "{refused}");
    }
}
