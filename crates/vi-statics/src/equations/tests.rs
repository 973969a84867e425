//! The tangent against differences of the residual.

use super::*;
use nalgebra::Vector3;
use vi_beam::{BeamMesh, BeamModel, FrameRule, Section};
use vi_core::force::MidpointForce;
use vi_multibody::form::Form;
use vi_multibody::joint_force::{JointForce, JointSpring, PdControl, Setpoint};
use vi_multibody::mechanism::Attachment;
use vi_multibody::pair::PairKind;
use vi_multibody::scalar_constraint::ScalarConstraint;
use vi_multibody::spring::{Damper, Spring, SpringLaw};
use vi_rigid::load::{Load, LoadKind};
use vi_rigid::time_history::TimeHistory;
use vi_testkit::Sample;

/// ground – pair – beam – pair – beam – pair (a node on the ground), weight, loads, springs, a
/// guide.
fn work(kinds: [PairKind; 3], sample: &mut Sample) -> EquilibriumEquations {
    let section = Section::new([90.0, 80.0, 120.0, 5.0, 4.0, 3.0], [1.0, 0.1, 0.1, 0.0]).unwrap();
    let mut model = BeamModel::new(Vector3::new(0.2, 0.3, -1.0));
    let rule = FrameRule::Normal(Vector3::z());
    let (corner, end) = (Vector3::new(1.0, 0.2, 0.0), Vector3::new(1.4, 1.1, 0.3));
    for (from, to) in [(Vector3::zeros(), corner), (corner, end)] {
        let mesh = BeamMesh::straight(from, to, 2, rule).unwrap();
        model.add_beam("beam", &mesh, section).unwrap();
    }
    let mut point = |at: Vector3<f64>| at + 0.3 * sample.vector();
    let axis = Vector3::new(0.3, -0.5, 1.0);
    model.join(kinds[0], None, 0, &point(Vector3::zeros()), &axis);
    model.join(kinds[1], Some(2), 3, &point(corner), &axis);
    model.join(kinds[2], Some(3), 4, &point(end), &axis);
    let held = Form::point(12, &Vector3::x()).minus(&Form::constant(Vector3::y()));
    let length = held.at(&model.configuration()).norm();
    let rod = ScalarConstraint::distance("rod", &held, length);
    model.description.scalars.push(rod);
    let mut mechanism = model.mechanism();
    let coordinate = mechanism.coordinate(0, 0);
    let mut load = |frame: usize, kind| {
        let (force, torque) = (sample.vector(), sample.vector());
        let load = Load::new(12 * frame, kind, force, torque, TimeHistory::default()).unwrap();
        load.at(sample.vector()).unwrap()
    };
    let loads = vec![load(1, LoadKind::Follower), load(3, LoadKind::Dead), load(4, LoadKind::Dead)];
    let mut system = model.static_system(&mechanism, loads);
    let [a, b] = [0, 4].map(|k| mechanism.point_of(Attachment::Body(k), &Vector3::x()));
    let law = SpringLaw::Linear;
    let between = b.minus(&a);
    system = system.potential(Spring { between, stiffness: 3.0, natural_length: 0.5, law });
    if let Some(coordinate) = coordinate {
        let spring = JointSpring { coordinate: coordinate.clone(), stiffness: 2.0, rest: 0.4 };
        let reference = std::sync::Arc::new(|t: f64| Setpoint { value: 0.3 * t, rate: 0.3 });
        let law = PdControl { proportional: 1.5, derivative: 0.7, reference };
        system = system.discrete_potential(Box::new(spring));
        system = system.force(Box::new(JointForce { coordinate, law }));
    }
    let q = model.configuration();
    EquilibriumEquations::new(system, mechanism, 0.7, &q)
}

/// In a steady rotation, with dampers from the ground and between bodies, on points off the axis,
/// and control of a length from the ground.
fn rotating(kinds: [PairKind; 3], sample: &mut Sample) -> EquilibriumEquations {
    let mut work = work(kinds, sample);
    let ground = Form::constant(sample.vector() + 3.0 * Vector3::x());
    let [a, b] = [0, 3].map(|k| work.mechanism.point_of(Attachment::Body(k), &sample.vector()));
    for (between, damping) in [(a.minus(&ground), 0.8), (b.minus(&ground), 1.3), (b.minus(&a), 2.1)]
    {
        let none = SeparableSystem::new(SparseMatrix::assemble(0, 0, |_| {}));
        let system = std::mem::replace(&mut work.system, none);
        work.system = system.force(Box::new(MidpointForce(Damper { between, damping })));
    }
    let (point, velocity) = (sample.vector(), 1.5 * sample.vector());
    work.rotate(&SteadyRotation { point, velocity });
    work
}

/// The largest entry of `K⁻¹ ∂r/∂x − I`.
fn off_the_derivative(work: &mut EquilibriumEquations, sample: &mut Sample) -> f64 {
    let mut worst = 0.0_f64;
    let size = work.unknowns() + work.rows.len();
    work.sigma = 0.1;
    let x: Vec<f64> = (0..size).map(|_| 0.2 * sample.number()).collect();
    let residual = |work: &mut EquilibriumEquations, x: &[f64]| {
        let mut r = vec![0.0; size];
        work.evaluate(x, &mut r).unwrap();
        r
    };
    // K applied by its inverse: K⁻¹ (∂r/∂x e_j) = e_j
    for j in 0..size {
        let (e, mut plus, mut minus) = (1e-5, x.clone(), x.clone());
        (plus[j], minus[j]) = (x[j] + e, x[j] - e);
        let (plus, minus) = (residual(work, &plus), residual(work, &minus));
        let mut column: Vec<f64> =
            plus.iter().zip(&minus).map(|(a, b)| (a - b) / (2.0 * e)).collect();
        residual(work, &x);
        work.fill_tangent(&x);
        work.solve(&mut column).unwrap();
        column[j] -= 1.0;
        worst = worst.max(norm_inf(&column));
    }
    worst
}

#[test]
fn the_tangent_is_the_derivative_of_the_residual() {
    use PairKind::{Cylindrical, Fixed, Planar, Prismatic, Revolute, Spherical, Universal};
    let mut sample = Sample::new(41);
    let mut worst = 0.0_f64;
    for kinds in [
        [Fixed, Spherical, Revolute],
        [Revolute, Universal, Fixed],
        [Spherical, Cylindrical, Prismatic],
        [Planar, Revolute, Spherical],
        [Universal, Fixed, Planar],
    ] {
        worst = worst.max(off_the_derivative(&mut work(kinds, &mut sample), &mut sample));
    }
    println!("K⁻¹ ∂r/∂x off the identity by {worst:.1e}");
    assert!(worst < 1e-6, "{worst:e}");
}

#[test]
fn the_tangent_in_a_rotation_is_the_derivative_of_the_residual() {
    use PairKind::{Fixed, Planar, Prismatic, Revolute, Spherical, Universal};
    let mut sample = Sample::new(43);
    for kinds in
        [[Planar, Revolute, Spherical], [Prismatic, Spherical, Revolute], [Fixed, Universal, Fixed]]
    {
        let mut work = rotating(kinds, &mut sample);
        let off = off_the_derivative(&mut work, &mut sample);
        println!("{kinds:?}: K⁻¹ ∂r/∂x off the identity by {off:.1e}");
        assert!(off < 1e-6, "{off:e}");
    }
}
