//! The right-angle cantilever of Simo & Vu-Quoc (1988): `benchmarks.md` §14, against independent
//! runs of another two-node element (lumped masses, explicit RK4); both are compared in the limit
//! of fine meshes.

#![allow(clippy::unwrap_used)] // a test

use crate::common;

use common::{center_of, vector};
use nalgebra::Vector3;
use vi_beam::model::{BeamModel, StrainRule};
use vi_beam::{BeamMesh, FrameRule, MassKind, Section};
use vi_constraints::{InitialValues, Options, SchemeKind};
use vi_multibody::run::{Solver, integrator};
use vi_rigid::load::{Load, LoadKind};
use vi_rigid::time_history::TimeHistory;

/// Out-of-plane displacements of elbow and tip at t = 2 and t = 5.
fn run(elements: usize, h: f64) -> [f64; 4] {
    let section = Section::new([1e6, 1e6, 1e6, 1e3, 1e3, 1e3], [1.0, 10.0, 10.0, 0.0]).unwrap();
    let corners = [Vector3::zeros(), vector(10.0, 0.0, 0.0), vector(10.0, 10.0, 0.0)];
    let rule = FrameRule::Normal(Vector3::z());
    let legs = BeamMesh::polyline(&corners, &[elements, elements], rule).unwrap();
    let mut model = BeamModel::new(Vector3::zeros());
    let beams = model.add_frame_work("leg", &legs, section).unwrap();
    model.clamp(0);
    model.elements.set_mass(0..2 * elements, MassKind::Lumped);
    let (elbow, tip) = (beams[0].nodes.end - 1, beams[1].nodes.end - 1);
    let history = TimeHistory::Triangle { start: 0.0, peak: 1.0, end: 2.0, amplitude: 50.0 };
    let load =
        Load::new(12 * elbow, LoadKind::Dead, Vector3::z(), Vector3::zeros(), history).unwrap();
    let mechanism = model.mechanism();
    let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
    let system = model.system(&mechanism, StrainRule::Averaged).force(Box::new(load));
    let options = Options::new(SchemeKind::Nodal, h);
    let mut run =
        integrator(mechanism, system, options, Solver::Auto, InitialValues::new(0.0, &q, &v))
            .unwrap();
    let (steps, mut out) = ((1.0 / h).round() as usize, [0.0; 4]);
    for step in 1..=5 * steps {
        run.step().unwrap();
        let row = match step {
            k if k == 2 * steps => 0,
            k if k == 5 * steps => 2,
            _ => continue,
        };
        out[row] = center_of(&run.state().q, elbow).z;
        out[row + 1] = center_of(&run.state().q, tip).z;
    }
    out
}

#[test]
fn elbow_and_tip_follow_the_independent_runs() {
    // their h² limits in space, three digits after the point
    let limit = [4.115, 0.069, 3.111, 5.479];
    let runs: Vec<[f64; 4]> = [10, 20, 40].into_iter().map(|n| run(n, 0.01)).collect();
    let found: [f64; 4] = std::array::from_fn(|i| runs[2][i] + (runs[2][i] - runs[1][i]) / 3.0);
    println!("elbow and tip at 2 s, 5 s: {runs:.4?}\nlimit {found:.4?}, expected {limit:.4?}");
    let error = common::distance(&found, &limit);
    assert!(error < 1.5e-3, "off by {error:.1e}");
}
