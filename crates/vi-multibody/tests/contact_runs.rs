//! What tests of contacts share.

use nalgebra::Vector3;
use vi_constraints::nonsmooth::{ContactLaw, Method, NonsmoothOptions};
use vi_constraints::{InitialValues, Options, SchemeKind};
use vi_core::Quadrature;
use vi_multibody::builder::MechanismBuilder;
use vi_multibody::run::{MechanismIntegrator, Solver, integrator, with_contacts};
use vi_rigid::gap::ContactShape;

pub(crate) const G: f64 = 9.81;

pub(crate) fn run_by(builder: &MechanismBuilder, step: f64, method: Method) -> MechanismIntegrator {
    let built = builder.build().unwrap();
    let (q, v) = (built.mechanism.initial_configuration(), built.mechanism.initial_velocity());
    let (system, at) = (built.system(Quadrature::Midpoint), InitialValues::new(0.0, &q, &v));
    let options = Options::new(SchemeKind::Nodal, step);
    let run = integrator(built.mechanism, system, options, Solver::Auto, at).unwrap();
    let contacts = NonsmoothOptions { method, ..NonsmoothOptions::default() };
    with_contacts(run, SchemeKind::Nodal, built.forces.contacts, contacts).unwrap()
}

pub(crate) fn coulomb(friction: f64, restitution: f64) -> ContactLaw {
    ContactLaw::coulomb(friction, restitution)
}

pub(crate) fn floor() -> ContactShape {
    ContactShape::Plane { point: Vector3::zeros(), normal: Vector3::z() }
}

pub(crate) fn box_shape(half_lengths: [f64; 3]) -> ContactShape {
    let half_lengths = half_lengths.into();
    ContactShape::Box {
        center: Vector3::zeros(),
        axes: nalgebra::Matrix3::identity(),
        half_lengths,
    }
}

/// How far a run moves in steps, m.
pub(crate) fn moved(run: &mut MechanismIntegrator, steps: usize) -> f64 {
    let start = run.state().q.clone();
    let mut worst = 0.0_f64;
    for step in 0..steps {
        run.step().unwrap_or_else(|error| panic!("step {step}: {error}"));
        let off = run.state().q.iter().zip(&start).map(|(a, b)| (a - b).abs());
        worst = worst.max(off.fold(0.0, f64::max));
    }
    worst
}
