//! Driven ends and closed loops: prescribed motion of a beam's end and of a linkage with elastic
//! links. The coordinate follows its path to round-off, and the work of the drive is what the
//! energy changes by.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::{Run, assert_order, orders};
use holonom::Simulation;
use holonom::model::Scheme;

const FOUR_BAR: &str = include_str!("../../examples/models/flexible_four_bar.toml");

const ARM: &str = include_str!("../models/driven_soft_arm.toml");

/// The path of the drive: value and rate.
fn path(t: f64) -> [f64; 2] {
    let w = std::f64::consts::PI;
    [1.0 - (w * t).cos(), w * (w * t).sin()]
}

/// Energy at 0.5 s less energy at 0 less the work `Σ h τ θ̇` of the drive, with `τ = λ` of the
/// constraint by the trapezoidal rule; and how far the angle is off its path.
fn imbalance(h: f64) -> (f64, f64) {
    let mut run = Run::with(ARM, h, 2, &[]);
    let steps = (0.5 / h).round() as usize;
    let start = run.energy();
    let row = run.simulation.mechanism().scalar_rows(0).start;
    let (mut work, mut off) = (0.0, 0.0_f64);
    for n in 0..=steps {
        let node = run.simulation.integrator().observe().unwrap();
        let power = -node.lambda[row] * path(n as f64 * h)[1];
        work += h * power * if n == 0 || n == steps { 0.5 } else { 1.0 };
        off =
            off.max((run.simulation.integrator().state().angles[0] - path(n as f64 * h)[0]).abs());
        if n < steps {
            run.steps(1);
        }
    }
    (run.energy() - start - work, off)
}

#[test]
fn the_work_of_the_drive_is_what_the_energy_changes_by() {
    let steps = [1e-3, 5e-4, 2.5e-4];
    let found: Vec<(f64, f64)> = steps.map(imbalance).into();
    let errors: Vec<f64> = found.iter().map(|f| f.0.abs()).collect();
    let energy = orders("energy less work of the drive", &steps, &errors);
    let off = found.iter().map(|f| f.1).fold(0.0, f64::max);
    println!("the angle is off its path by {off:.1e} rad");
    assert_order(&energy, 2.0, 0.3);
    assert!(off < 1e-13, "{off:e}");
}

fn ends(text: &str, overrides: &[(&str, &str)], steps: usize) -> Vec<f64> {
    let mut run = Run::with(text, 1e-3, 2, overrides);
    run.steps(steps);
    run.q().to_vec()
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Sparse, dense; and all variational schemes, on a loop with elements.
#[test]
fn solvers_and_schemes_agree_on_loops() {
    for (name, text) in [("arm", ARM), ("four-bar", FOUR_BAR)] {
        let reference = ends(text, &[], 30);
        let dense = apart(&reference, &ends(text, &[("simulation.solver", "dense")], 30));
        println!("{name}: dense and sparse are {dense:.1e} apart");
        assert!(dense < 1e-9, "{dense:e}");
        for scheme in Scheme::ALL.into_iter().filter(|scheme| !scheme.is_energy_momentum()) {
            let off = apart(&reference, &ends(text, &[("simulation.scheme", scheme.name())], 30));
            println!("{name}: {} is {off:.1e} from nodal", scheme.name());
            assert!(off < 1e-9, "{}: {off:e}", scheme.name());
        }
    }
}

/// A rod from the middle of the arm to the load: a loop that elements alone do not close.
#[test]
fn a_beam_in_a_loop_of_joints() {
    let text = ARM.replace(
        "[simulation]",
        "[[constraint]]\nname = \"rod\"\ntype = \"distance\"\nfrom = \"arm.3\"\nto = \"load\"\n[simulation]",
    );
    let model = holonom::Model::from_toml(&text).unwrap();
    let simulation = Simulation::new(&model).unwrap();
    assert_eq!(simulation.assembly().counts.dof, 6 * 7 - 5 + 3 - 2);
    let mut run = Run::with(&text, 1e-3, 2, &[]);
    let length = |q: &[f64]| {
        let (a, b) = (&q[12 + 12 * 3..], &q[..3]);
        (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
    };
    let (start, load) = (length(run.q()), run.q()[..3].to_vec());
    run.steps(200);
    let moved = apart(&load, &run.q()[..3]);
    let change = (length(run.q()) - start).abs();
    println!("the load moves {moved:.2} m, the rod changes its length by {change:.1e} m");
    assert!(moved > 0.05, "{moved}");
    assert!(change < 1e-13 && run.residual() < 1e-13);
}
