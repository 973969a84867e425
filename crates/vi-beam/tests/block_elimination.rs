//! The elimination of a beam by its blocks solves the same equations as a dense LU of the same
//! matrix, and is in use wherever beams are: free, clamped, branched, on bodies, as rings, damped,
//! stiff against the step.

#![allow(clippy::unwrap_used)] // a test

use crate::common;

use common::{flying_section, largest, straight, vector};
use nalgebra::{Matrix3, Vector3};
use vi_beam::model::{BeamModel, StrainRule};
use vi_beam::{BeamMesh, FrameRule, Section};
use vi_constraints::NodalOperators;
use vi_core::linear::DenseLu;
use vi_core::state::Memory;
use vi_core::{DiscreteLagrangian, Entries, Interval};
use vi_multibody::mechanism::BodySpec;
use vi_multibody::pair::PairKind;
use vi_multibody::sparse_nodal::SparseNodal;
use vi_rigid::body::RigidBody;
use vi_rigid::inertia::EulerMoments;

fn empty() -> BeamModel {
    BeamModel::new(vector(0.0, 0.0, -9.81))
}

fn mesh(from: Vector3<f64>, to: Vector3<f64>, elements: usize) -> BeamMesh {
    let rule = FrameRule::RotationMinimizing(vector(0.2, 1.0, 0.1));
    BeamMesh::straight(from, to, elements, rule).unwrap()
}

/// A beam along x, free or clamped.
fn one(section: Section, is_clamped: bool) -> BeamModel {
    let mut model = empty();
    let beam = model.add_beam("beam", &straight(1.0, 8), section).unwrap();
    if is_clamped {
        model.clamp(beam.nodes.start);
    }
    model
}

fn hub(model: &mut BeamModel) -> usize {
    model.add_frame(BodySpec {
        name: "hub".into(),
        body: Some(RigidBody::new(1.7, EulerMoments([0.3, 0.4, 0.2])).unwrap()),
        center: Vector3::zeros(),
        triad: Matrix3::identity(),
        velocity: Vector3::zeros(),
        omega: Vector3::zeros(),
    })
}

/// Beams that are joined to one body by the given pairs.
fn on_a_body(kinds: &[PairKind]) -> BeamModel {
    let mut model = empty();
    let hub = hub(&mut model);
    for (k, kind) in kinds.iter().enumerate() {
        let angle = 1.3 * k as f64;
        let along = vector(angle.cos(), angle.sin(), 0.2);
        let beam = model.add_beam("arm", &mesh(0.1 * along, along, 5), flying_section()).unwrap();
        let axis = vector(0.3, 0.2, 1.0);
        model.join(*kind, Some(hub), beam.nodes.start, &(0.1 * along), &axis);
    }
    model
}

/// Three beams that share a corner.
fn branched() -> BeamModel {
    let mut model = empty();
    let ends = [vector(1.0, 0.0, 0.0), vector(-1.0, 0.1, 0.0), vector(0.0, 1.2, 0.3)];
    let corners = ends.map(|end| {
        let mesh = mesh(Vector3::zeros(), end, 4);
        model.add_beam("leg", &mesh, flying_section()).unwrap().nodes.start
    });
    for corner in &corners[1..] {
        let point = Vector3::zeros();
        model.join(PairKind::Fixed, Some(corners[0]), *corner, &point, &Vector3::z());
    }
    model
}

/// A beam of which the last node is coupled to the first by an element.
fn ring() -> BeamModel {
    let mut model = one(flying_section(), false);
    let q = model.configuration();
    model.elements.add_stress_free([8, 0], 1.0, 0, &q).unwrap();
    model
}

/// Backward error of the solution by blocks, relative to the entries of the matrix.
fn backward_error(model: &BeamModel, rule: StrainRule, h: f64) -> f64 {
    let mechanism = model.mechanism();
    let (system, q) = (model.system(&mechanism, rule), model.configuration());
    let mut operators = SparseNodal::new(&mechanism).for_elements(&q);
    let d = operators.dof();
    let mut s = Interval::new(q.len());
    s.open(0.0, h, &q);
    operators.begin(&s, &Memory::default(), None);
    let u: Vec<f64> = (0..d).map(|k| 0.02 * (1.0 + k as f64).sin()).collect();
    operators.reparametrize(&u, &mut s).unwrap();
    let right: Vec<f64> = (0..d).map(|k| (2.0 + k as f64).sin()).collect();
    let mut x = right.clone();
    let emit = |out: &mut dyn Entries| system.forced_d2_d1(&s, out);
    operators.solve(&emit, &u, &s, &mut x).unwrap();
    assert!(operators.is_by_blocks(), "another elimination was used");
    let matrix = operators.matrix();
    let mut dense = right.clone();
    DenseLu::new(d).solve(&matrix, &mut dense).unwrap();
    let error = |x: &[f64]| {
        let x = nalgebra::DVector::from_column_slice(x);
        let right = nalgebra::DVector::from_column_slice(&right);
        let size = matrix.abs() * x.abs() + right.abs();
        largest((&matrix * x - right).component_div(&size).iter().copied())
    };
    let (blocks, dense) = (error(&x), error(&dense));
    println!("backward error {blocks:.1e} by blocks, {dense:.1e} dense");
    blocks
}

#[test]
fn beams_are_eliminated_by_blocks_to_round_off() {
    let damped = flying_section().with_damping([1e-3; 6]).unwrap();
    let stiff = Section::new([1e9, 1e9, 1e9, 500.0, 500.0, 500.0], [1.0, 0.1, 0.1, 0.0]).unwrap();
    let hinged = [PairKind::Revolute, PairKind::Spherical, PairKind::Fixed, PairKind::Universal];
    let mut helix = one(flying_section(), false);
    let (q, count) = (helix.configuration(), helix.elements.list().len());
    helix.elements.set_strains(0..count, vi_beam::ElementKind::Helicoidal, &q).unwrap();
    let cases = [
        ("free", one(flying_section(), false)),
        ("clamped", one(flying_section(), true)),
        ("damped", one(damped, true)),
        ("stiff", one(stiff, true)),
        ("hinged to a body", on_a_body(&hinged[..1])),
        ("four on a body", on_a_body(&hinged)),
        ("branched", branched()),
        ("ring", ring()),
        ("helicoidal", helix),
    ];
    for (name, model) in cases {
        for rule in [StrainRule::Averaged, StrainRule::MassScaled, StrainRule::Dissipative] {
            for h in [1e-5, 0.01, 0.3] {
                let error = backward_error(&model, rule, h);
                assert!(error < 1e-12, "{name}, {rule:?}, h = {h}: {error:e}");
            }
        }
    }
}
