//! A free flexible body: linear and angular momentum at round-off, reversibility, energy in a band.

#![allow(clippy::unwrap_used)] // a test

use crate::common;

use common::{distance, flying_section, straight, vector};
use nalgebra::Vector3;
use vi_beam::model::{BeamModel, StrainRule};
use vi_beam::{BeamMesh, ElementKind, FrameRule, Section};
use vi_constraints::{InitialValues, Integrator, Options, SchemeKind};
use vi_core::SeparableSystem;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::{Solver, integrator};

type Run = Integrator<SeparableSystem, Mechanism>;

fn spinning(mut model: BeamModel) -> BeamModel {
    let omega = vector(0.7, 0.4, -0.9);
    for body in &mut model.description.bodies {
        body.omega = omega;
        let wave = 0.2 * (3.0 * body.center.norm()).sin();
        body.velocity = vector(0.5, -0.2, 0.3) + omega.cross(&body.center) + wave * Vector3::z();
    }
    model
}

/// A beam that spins and shears initially.
fn model(mesh: &BeamMesh, section: Section) -> BeamModel {
    let mut model = BeamModel::new(Vector3::zeros());
    model.add_beam("beam", mesh, section).unwrap();
    spinning(model)
}

fn run(model: &BeamModel, rule: StrainRule, kind: SchemeKind, h: f64) -> Run {
    let mechanism = model.mechanism();
    let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
    let system = model.system(&mechanism, rule);
    integrator(
        mechanism,
        system,
        Options::new(kind, h),
        Solver::Auto,
        InitialValues::new(0.0, &q, &v),
    )
    .unwrap()
}

#[test]
fn momentum_energy_and_reversal() {
    let rule = FrameRule::RotationMinimizing(Vector3::x());
    let radius = 2.0 * Vector3::x();
    let mesh = BeamMesh::helix(Vector3::zeros(), radius, Vector3::z(), 3.0, 4.0, 12, rule).unwrap();
    let model = model(&mesh, flying_section());
    for rule in [StrainRule::Midpoint, StrainRule::Averaged, StrainRule::MassScaled] {
        let mut run = run(&model, rule, SchemeKind::Nodal, 0.01);
        let start = run.state().q.clone();
        let mechanism = model.mechanism();
        let momentum = |run: &Run| mechanism.momentum(&run.state().q, &run.state().p);
        let (first, mut drift, steps) = (momentum(&run), [0.0_f64; 2], 1000);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut iterations = 0;
        for _ in 0..steps {
            iterations += run.step().unwrap().iterations;
            let now = momentum(&run);
            drift[0] = drift[0].max(distance(&now.linear, &first.linear));
            drift[1] = drift[1].max(distance(&now.angular, &first.angular));
            let energy = run.node_before().unwrap().hamiltonian_projected.total();
            (low, high) = (low.min(energy), high.max(energy));
        }
        run.reverse();
        for _ in 0..steps {
            run.step().unwrap();
        }
        let back = distance(&run.state().q, &start);
        let spread = (high - low) / high;
        println!(
            "{rule:?}: momentum drift {:.1e}, {:.1e} of {:.2}; H_d spread {spread:.1e}; back at \
             {back:.1e}; {:.2} iterations",
            drift[0],
            drift[1],
            common::largest(first.angular),
            iterations as f64 / f64::from(steps)
        );
        assert!(drift[0] < 1e-12 && drift[1] < 1e-10, "{drift:?}");
        assert!(spread < 2e-2 && back < 1e-8, "{spread:e}, {back:e}");
    }
}

#[test]
fn lumped_masses_fly_too() {
    let mut model = model(&straight(10.0, 8), flying_section());
    model.elements.set_mass(0..8, vi_beam::MassKind::Lumped);
    let mechanism = model.mechanism();
    let mut run = run(&model, StrainRule::Averaged, SchemeKind::Nodal, 0.05);
    let momentum = |run: &Run| mechanism.momentum(&run.state().q, &run.state().p);
    let first = momentum(&run);
    for _ in 0..200 {
        run.step().unwrap();
    }
    let drift = distance(&momentum(&run).angular, &first.angular);
    println!("lumped: angular momentum drifts by {drift:.1e}");
    assert!(drift < 1e-10, "{drift:e}");
}

/// Dissipative strains change no momentum, whatever the step, and the four forms of a scheme agree.
#[test]
fn dissipative_beams_keep_their_momentum_in_all_forms() {
    for strains in [ElementKind::MeanDirectors, ElementKind::Helicoidal] {
        let mut model = model(&straight(10.0, 4), flying_section());
        let q = model.configuration();
        model.elements.set_strains(0..4, strains, &q).unwrap();
        let mechanism = model.mechanism();
        let momentum = |run: &Run| mechanism.momentum(&run.state().q, &run.state().p);
        let mut ends = Vec::new();
        for kind in SchemeKind::ALL {
            let mut run = run(&model, StrainRule::Dissipative, kind, 0.1);
            let (first, mut drift) = (momentum(&run), 0.0_f64);
            for _ in 0..40 {
                run.step().unwrap();
                let now = momentum(&run);
                drift = drift.max(distance(&now.linear, &first.linear));
                drift = drift.max(distance(&now.angular, &first.angular));
            }
            let energy = run.observe().unwrap().hamiltonian_projected.total();
            println!("{strains:?}, {}: drift {drift:.1e}, {energy} J", kind.name());
            assert!(drift < 1e-11, "{drift:e}");
            ends.push(run.state().clone());
        }
        for end in &ends[1..] {
            let apart =
                distance(&end.q, &ends[0].q).max(distance(&end.internal, &ends[0].internal));
            assert!(apart < 1e-9, "{apart:e}");
        }
    }
}
