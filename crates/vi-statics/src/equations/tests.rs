//! The tangent against differences of the residual.

use super::*;
use nalgebra::Vector3;
use vi_beam::{BeamModel, FrameRule, Mesh, Section};
use vi_multibody::form::Form;
use vi_multibody::joint_force::{JointForce, JointSpring, PdControl, Setpoint};
use vi_multibody::mechanism::Attachment;
use vi_multibody::pair::PairKind;
use vi_multibody::scalar_constraint::ScalarConstraint;
use vi_multibody::spring::{Spring, SpringLaw};
use vi_rigid::load::{Load, LoadKind};
use vi_rigid::time_history::TimeHistory;
use vi_testkit::Sample;

/// ground – pair – beam – pair – beam – pair (a node on the ground), weight, loads, springs, a guide.
fn work(kinds: [PairKind; 3], sample: &mut Sample) -> Equations {
    let section = Section::new([90.0, 80.0, 120.0, 5.0, 4.0, 3.0], [1.0, 0.1, 0.1, 0.0]).unwrap();
    let mut model = BeamModel::new(Vector3::new(0.2, 0.3, -1.0));
    let rule = FrameRule::Normal(Vector3::z());
    let (corner, end) = (Vector3::new(1.0, 0.2, 0.0), Vector3::new(1.4, 1.1, 0.3));
    for (from, to) in [(Vector3::zeros(), corner), (corner, end)] {
        let mesh = Mesh::straight(from, to, 2, rule).unwrap();
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
    Equations::new(system, mechanism, (0.7, &q))
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
        let mut work = work(kinds, &mut sample);
        let size = work.unknowns() + work.rows.len();
        work.sigma = 0.1;
        let x: Vec<f64> = (0..size).map(|_| 0.2 * sample.number()).collect();
        let residual = |work: &mut Equations, x: &[f64]| {
            let mut r = vec![0.0; size];
            work.evaluate(x, &mut r).unwrap();
            r
        };
        // K applied by its inverse: K⁻¹ (∂r/∂x e_j) = e_j
        for j in 0..size {
            let (e, mut plus, mut minus) = (1e-5, x.clone(), x.clone());
            (plus[j], minus[j]) = (x[j] + e, x[j] - e);
            let (plus, minus) = (residual(&mut work, &plus), residual(&mut work, &minus));
            let mut column: Vec<f64> =
                plus.iter().zip(&minus).map(|(a, b)| (a - b) / (2.0 * e)).collect();
            residual(&mut work, &x);
            work.fill_tangent(&x);
            work.solve(&mut column).unwrap();
            column[j] -= 1.0;
            worst = worst.max(norm_inf(&column));
        }
    }
    println!("K⁻¹ ∂r/∂x off the identity by {worst:.1e}");
    assert!(worst < 1e-6, "{worst:e}");
}
