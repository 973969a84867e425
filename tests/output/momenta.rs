//! `simulation.momenta`: multipliers, discrete Legendre transforms and parts of the energies of the
//! recorded nodes, against the functions of the library and against the other columns of the same
//! row.
#![allow(clippy::unwrap_used)] // a test

use crate::harness;

use harness::case::distance;
use harness::models::{model, overrides};
use holonom::{Momenta, Sample, Simulation};
use nalgebra::DMatrix;
use vi_constraints::{Constraints, LegendreTransforms, Reparametrization};
use vi_core::Interval;
use vi_multibody::tree_map::TreeMap;

fn run(name: &str, settings: &[(&str, &str)]) -> (Simulation, Vec<Sample>) {
    let own = [("simulation.momenta", "true"), ("simulation.every", "1")];
    let all = overrides(&[&own[..], settings].concat());
    let model = model(name, &[]).with_overrides(&all).unwrap();
    let mut simulation = Simulation::new(&model).unwrap();
    let mut samples = Vec::new();
    let mut observe = |sample: &Sample| -> Result<(), std::convert::Infallible> {
        samples.push(sample.clone());
        Ok(())
    };
    let outcome = simulation.run(&mut observe, &mut |_, _| {}).unwrap();
    assert_eq!(outcome, holonom::RunOutcome::Done, "{name}");
    (simulation, samples)
}

fn momenta(sample: &Sample) -> &Momenta {
    sample.momenta.as_deref().expect("the model asks for them")
}

/// The row of a node is what the functions of the library say of three neighbouring rows; returns
/// the largest deviation, forces relative to the round-off of `q` over `h²`.
fn against_the_library(name: &str, settings: &[(&str, &str)]) {
    let (mut simulation, samples) = run(name, settings);
    let names = simulation.momenta_names().unwrap();
    let run = simulation.integrator();
    let (system, mechanism) = (run.system(), run.constraints());
    let h = samples[1].t - samples[0].t;
    let of = LegendreTransforms::with_rows(system, mechanism, run.rows()).unwrap();
    let mut of = of.of_steps(h);
    let map = TreeMap::new(mechanism);
    let mut tree = DMatrix::zeros(mechanism.dim(), map.dof());
    let (mut p_off, mut force_off, mut size) = (0.0_f64, 0.0_f64, 1.0_f64);
    let raise = |worst: &mut f64, a: &[f64], b: &[f64]| *worst = worst.max(distance(a, b));
    for rows in samples.windows(3) {
        let found = momenta(&rows[1]);
        let between = |k: usize| Interval::between(rows[k].t, h, &rows[k].q, &rows[k + 1].q);
        let (before, after) = (between(0), between(1));
        let at = after.start();
        assert_eq!(found.lambda.len(), names.constraints.len());
        assert_eq!(found.p.len(), names.coordinates.len());
        assert_eq!(found.p_reduced.len(), names.rates.len());

        let lambda = of.multiplier(&before, &after).unwrap();
        let force = |of: &mut LegendreTransforms<'_, _, _>, l: &[f64]| of.constraint_force(at, l);
        let forces = (force(&mut of, &lambda).unwrap(), force(&mut of, &found.lambda).unwrap());
        raise(&mut force_off, &forces.0, &forces.1);
        raise(&mut p_off, &found.p, &of.momentum_minus(&after, &lambda).unwrap());
        raise(&mut p_off, &found.p, &of.momentum_plus(&before, &lambda).unwrap());
        let projected = of.projected_momentum_minus(&after).unwrap();
        raise(&mut p_off, &found.p_projected, &projected);
        map.null_space(at.q, &mut tree);
        let reduced = tree.tr_mul(&nalgebra::DVector::from_column_slice(&projected));
        raise(&mut p_off, &found.p_reduced, reduced.as_slice());
        if !mechanism.has_loops() {
            let reduced = of.reduced_momentum_plus(&before, &tree).unwrap(); // (42)
            raise(&mut p_off, &found.p_reduced, &reduced);
        }
        let e_d = found.discrete_energy.unwrap();
        assert_eq!(e_d.total().to_bits(), rows[1].energy.to_bits());
        let expected = of.discrete_energy(&after).unwrap();
        let scale = 1.0 + e_d.kinetic.abs().max(e_d.potential.abs());
        assert!((e_d.kinetic - expected.kinetic).abs() < 1e-9 * scale, "{name}: {e_d:?}");
        let h_d = found.hamiltonian_projected.unwrap();
        assert_eq!(h_d.total().to_bits(), rows[1].hamiltonian.to_bits());
        assert_eq!(found.hamiltonian.is_some(), of.hamiltonian(at, &found.p).unwrap().is_some());
        size = size.max(vi_core::linear::norm_inf(&found.p));
    }
    println!("{name}: p off by {p_off:.1e}, force by {force_off:.1e}, |p| ≤ {size:.1e}");
    assert!(p_off < 1e-10 * size, "{name}: p off by {p_off:e}");
    assert!(force_off * h < 1e-9 * size, "{name}: force off by {force_off:e}");
}

#[test]
fn rows_are_what_the_functions_say_of_three_configurations() {
    against_the_library("pendulum", &[("simulation.end", "0.5")]);
    against_the_library("heavy_top", &[("simulation.end", "0.1"), ("simulation.step", "0.002")]);
    against_the_library("four_particles", &[("simulation.end", "0.3")]);
    // a closed loop with a redundant constraint
    against_the_library(
        "six_hinge_cube",
        &[("simulation.end", "0.4"), ("simulation.step", "0.02")],
    );
    // beams: a singular mass matrix; loads
    let short = [("simulation.end", "0.05"), ("simulation.step", "0.005")];
    against_the_library("flexible_multibody", &short);
}

#[test]
fn the_start_and_the_end_are_complete_at_order_two() {
    let (_, samples) = run("pendulum_free", &[("simulation.step", "0.1"), ("simulation.end", "1")]);
    let exact = 2.0 * (1.0 - (1.0 - 0.01_f64).sqrt()) / 0.01; // λ_n for every n, 0 included
    for sample in &samples {
        let found = momenta(sample);
        assert!(
            (found.lambda[0] - exact).abs() < 1e-11,
            "λ at {}: {:?}",
            sample.step,
            found.lambda
        );
        assert!((found.p[0].hypot(found.p[1]) - 1.0).abs() < 1e-13);
        assert!((found.p_reduced[0] - 1.0).abs() < 1e-13, "ᴾp at {}", sample.step);
        assert!((found.hamiltonian.unwrap().kinetic - 0.5).abs() < 1e-13);
        assert!((found.discrete_energy.unwrap().kinetic - 0.5 * exact).abs() < 1e-13);
    }
    assert_eq!(samples.len(), 11);
}

#[test]
fn beams_have_no_hamiltonian_of_the_unprojected_momentum() {
    let (_, samples) =
        run("flexible_multibody", &[("simulation.end", "0.02"), ("simulation.step", "0.005")]);
    for found in samples.iter().map(momenta) {
        assert!(found.hamiltonian.is_none() && found.hamiltonian_projected.is_some());
    }
}

#[test]
fn compositions_have_what_belongs_to_the_state() {
    let (mut simulation, samples) =
        run("heavy_top", &[("simulation.order", "4"), ("simulation.end", "0.05")]);
    for sample in &samples {
        let found = momenta(sample);
        assert!(found.p.is_empty() && found.discrete_energy.is_none());
        assert!(found.hamiltonian.is_none() && !found.p_reduced.is_empty());
        assert_eq!(
            found.hamiltonian_projected.unwrap().total().to_bits(),
            sample.hamiltonian.to_bits()
        );
    }
    let acceleration = simulation.integrator().acceleration_multiplier().unwrap();
    assert_eq!(momenta(samples.last().unwrap()).lambda, acceleration);
}

#[test]
fn energy_momentum_schemes_have_multipliers_momenta_and_energies() {
    let (mut simulation, samples) =
        run("heavy_top", &[("simulation.scheme", "\"em-nodal\""), ("simulation.end", "0.05")]);
    for sample in &samples {
        let found = momenta(sample);
        let energy = found.hamiltonian.unwrap();
        assert!((energy.total() - sample.hamiltonian).abs() < 1e-12 * (1.0 + energy.kinetic));
        let of = simulation.energy_momentum().unwrap().constraints().momentum(&sample.q, &found.p);
        assert_eq!(of, sample.momentum);
        assert_eq!(found.lambda.len(), simulation.mechanism().len());
        assert!(found.p_projected.is_empty() && found.p_reduced.is_empty());
        assert!(found.discrete_energy.is_none() && found.hamiltonian_projected.is_none());
    }
}

#[test]
fn ordinary_runs_have_none() {
    let model = model("pendulum", &[("simulation.end", "0.1".to_owned())]);
    let mut simulation = Simulation::new(&model).unwrap();
    assert!(simulation.momenta_names().is_none() && !model.to_toml().contains("momenta"));
    let mut observe = |sample: &Sample| -> Result<(), std::convert::Infallible> {
        assert!(sample.momenta.is_none());
        Ok(())
    };
    simulation.run(&mut observe, &mut |_, _| {}).unwrap();
}
