//! The builder: the same bits as a description made by hand, every pair.

use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;
use vi_constraints::{Constraints, Options, SchemeKind};
use vi_core::force::Source;
use vi_core::linear::norm_inf;
use vi_core::{Configuration, MechanicalSystem, Quadrature, SparseMatrix};
use vi_multibody::builder::{BodyId, ElementForce, Inertia, MechanismBuilder};
use vi_multibody::joint::{FrameId, GROUND, Joint, Side, complete_axis};
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_multibody::joint_force::{PdControl, Setpoint, Viscous};
use vi_multibody::mechanism::{Bar, BarEnd, BodySpec, Description, Mechanism, ParticleSpec};
use vi_multibody::scalar_constraint::ScalarConstraint;
use vi_multibody::{FrameId::Ground, PairKind};
use vi_rigid::body::RigidBody;
use vi_rigid::inertia::PrincipalInertia;
use vi_rigid::{directors, rotation};

pub(crate) const BODY: Inertia = Inertia::Principal { mass: 2.0, moments: [0.3, 0.4, 0.5] };
pub(crate) const Z: [f64; 3] = [0.0, 0.0, 1.0];

fn residual(mechanism: &Mechanism) -> f64 {
    let mut g = vec![0.0; mechanism.len()];
    mechanism.value(Configuration::new(0.0, &mechanism.initial_configuration()), &mut g);
    norm_inf(&g)
}

/// `(q, v, g, G v)` of the initial configuration.
fn numbers(mechanism: &Mechanism) -> [Vec<f64>; 4] {
    let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
    let (m, n) = (mechanism.len(), mechanism.dim());
    let (mut g, mut rate) = (vec![0.0; m], vec![0.0; m]);
    mechanism.value(Configuration::new(0.0, &q), &mut g);
    let jacobian = SparseMatrix::assemble(m, n, |out| mechanism.jacobian(0.0, &q, out));
    jacobian.mul_add(1.0, &v, &mut rate);
    [q, v, g, rate]
}

/// A chain of two bodies with a gear, a guide, a rod and a driven hinge, by hand.
fn by_hand() -> Mechanism {
    let inertia = PrincipalInertia::new([0.3, 0.4, 0.5]).unwrap();
    let body = |name: &str, center, triad, omega| BodySpec {
        name: name.into(),
        body: Some(RigidBody::from_inertia(2.0, &inertia).unwrap()),
        center,
        triad,
        velocity: Vector3::new(0.1, -0.2, 0.3),
        omega,
    };
    let rotated = rotation::exp(&Vector3::new(0.3, -0.2, 0.9));
    let mut d = Description {
        dimension: 3,
        gravity: Vector3::new(0.3, 0.2, -9.81),
        bodies: vec![
            body("a", Vector3::new(0.1, 0.2, -0.3), rotated, Vector3::new(0.3, -0.2, 1.0)),
            body("b", Vector3::new(0.9, -0.2, 0.4), Matrix3::identity(), Vector3::z()),
        ],
        ..Description::default()
    };
    let joint = |kind, [parent, child]: [FrameId; 2], point: Vector3<f64>, axis: Vector3<f64>| {
        let axes = complete_axis(&axis.normalize());
        let side = |id: FrameId| match id {
            FrameId::Ground => Side::at(id, &GROUND, &point, &axes),
            FrameId::Frame(k) => {
                let (mut q, b) = ([0.0; 12], &d.bodies[k]);
                directors::set_frame(&mut q, &b.center, &b.triad);
                Side::at(id, &q, &point, &axes)
            }
        };
        Joint { name: "joint".into(), kind, parent: side(parent), child: side(child) }
    };
    let (ground, a, b) = (FrameId::Ground, FrameId::Frame(0), FrameId::Frame(1));
    let at = Vector3::new(0.4, 0.1, 0.2);
    let axis = Vector3::new(1.0, 2.0, -1.0);
    let base = joint(PairKind::Revolute, [ground, a], Vector3::zeros(), Vector3::z());
    let elbow = joint(PairKind::Cylindrical, [a, b], at, axis);
    let guide = joint(PairKind::Free, [ground, b], at, axis);
    let principal = |joint, freedom| JointCoordinate::principal(joint, freedom).unwrap();
    let q = Mechanism::new(d.clone()).initial_configuration();
    let between = vi_multibody::form::Form::point(12, &Vector3::new(-0.3, 0.0, 0.0))
        .minus(&vi_multibody::form::Form::constant(Vector3::new(0.5, 0.0, 2.0)));
    let length = between.at(&q).norm();
    d.scalars = vec![
        ScalarConstraint::gear("gear", principal(&base, 0), principal(&elbow, 1), -0.37, &q),
        ScalarConstraint::point_on_line(&guide),
        ScalarConstraint::distance("rod", &between, length),
        ScalarConstraint::motion("drive", principal(&base, 0), Arc::new(|t| [t, 1.0, 0.0])),
    ];
    d.joints = vec![base, elbow];
    Mechanism::new(d)
}

#[test]
fn a_built_mechanism_has_the_bits_of_one_made_by_hand() {
    let mut builder = MechanismBuilder::new().gravity([0.3, 0.2, -9.81]);
    let velocity = [0.1, -0.2, 0.3];
    let a = builder
        .body("a", BODY)
        .at([0.1, 0.2, -0.3])
        .rotation_vector([0.3, -0.2, 0.9])
        .velocity(velocity)
        .angular_velocity([0.3, -0.2, 1.0])
        .id();
    let b = builder.body("b", BODY).at([0.9, -0.2, 0.4]).velocity(velocity);
    let b = b.angular_velocity(Z).id();
    let (at, axis) = ([0.4, 0.1, 0.2], [1.0, 2.0, -1.0]);
    let base = builder.joint("base", PairKind::Revolute, Ground, a).at([0.0; 3]).axis(Z).id();
    let elbow = builder.joint("elbow", PairKind::Cylindrical, a, b).at(at).axis(axis).id();
    builder.gear("gear", base.coordinate(0), elbow.coordinate(1), -0.37);
    builder.point_on_line("guide", Ground, b, at, axis);
    builder.distance("rod", [0.5, 0.0, 2.0], b.point([-0.3, 0.0, 0.0]));
    builder.motion("drive", base.coordinate(0), |t| [t, 1.0, 0.0]);
    let built = builder.build().unwrap().mechanism;
    let hand = by_hand();
    assert_eq!(built.dim(), hand.dim());
    for (what, found, expected) in numbers(&built)
        .into_iter()
        .zip(numbers(&hand))
        .zip(["q", "v", "g", "G v"])
        .map(|((found, expected), what)| (what, found, expected))
    {
        let bits = |x: &[f64]| x.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&found), bits(&expected), "{what}: {found:?} for {expected:?}");
    }
}

#[test]
fn point_masses_and_bars_have_the_bits_of_those_made_by_hand() {
    let mut builder = MechanismBuilder::planar().gravity([0.0, -9.81, 0.0]);
    let inner = builder.particle("inner", 1.0, [0.6, 0.8, 0.0], [0.0; 3]);
    let outer = builder.particle("outer", 2.0, [1.6, 0.8, 0.0], [0.0, 0.3, 0.0]);
    builder.bar("first", [0.0; 3], inner);
    builder.bar_of_length("second", inner, outer, 1.0);
    let built = builder.build().unwrap().mechanism;
    let particle = |name: &str, mass, position, velocity| ParticleSpec {
        name: name.into(),
        mass,
        position,
        velocity,
    };
    let bar = |name: &str, from, to| Bar { name: name.into(), from, to, length: 1.0 };
    let hand = Mechanism::new(Description {
        dimension: 2,
        gravity: Vector3::new(0.0, -9.81, 0.0),
        particles: vec![
            particle("inner", 1.0, Vector3::new(0.6, 0.8, 0.0), Vector3::zeros()),
            particle("outer", 2.0, Vector3::new(1.6, 0.8, 0.0), Vector3::new(0.0, 0.3, 0.0)),
        ],
        bars: vec![
            bar("first", BarEnd::Ground(Vector3::zeros()), 0),
            bar("second", BarEnd::Particle(0), 1),
        ],
        ..Description::default()
    });
    assert_eq!(numbers(&built), numbers(&hand));
}

/// Two bodies, the second on the first by the pair.
pub(crate) fn pair(kind: PairKind) -> (MechanismBuilder, BodyId) {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let first = builder.body("first", BODY).at([0.0, 0.0, -0.5]).id();
    let second = builder.body("second", BODY).at([0.5, 0.2, -1.0]);
    let second = second.rotation_vector([0.2, 0.1, -0.4]).id();
    let shoulder = builder.joint("shoulder", PairKind::Universal, Ground, first).at([0.0; 3]);
    shoulder.axis([1.0, 0.0, 0.0]).second_axis([0.0, 1.0, 0.0]);
    if kind != PairKind::Free {
        let pair = builder.joint("pair", kind, first, second).at([0.3, 0.1, -0.8]);
        pair.axis([1.0, 1.0, 0.5]);
    }
    (builder, second)
}

#[test]
fn every_pair_starts_on_its_constraints_and_keeps_them() {
    for kind in PairKind::ALL {
        let (builder, _) = pair(kind);
        let built = builder.build().unwrap();
        let (n, m) = (built.mechanism.dim(), built.mechanism.len());
        assert_eq!(n - m, 2 + kind.dof(), "{}", kind.name());
        assert!(residual(&built.mechanism) < 1e-14, "{}", kind.name());
        let mut run = built.integrator(Options::new(SchemeKind::Nodal, 0.01)).unwrap();
        let energy = run.observe().unwrap().hamiltonian_projected.total();
        for _ in 0..20 {
            run.step().unwrap();
        }
        let node = run.observe().unwrap();
        let drift = (node.hamiltonian_projected.total() - energy).abs();
        assert!(node.position_residual < 1e-13, "{}: {node:?}", kind.name());
        assert!(drift < 1e-2, "{}: energy off by {drift:e} J", kind.name());
    }
}

#[test]
fn a_tensor_is_turned_to_its_principal_axes_and_points_with_it() {
    // the same body, once along its principal axes and once turned
    let turn = rotation::exp(&Vector3::new(0.4, -0.3, 0.8));
    let moments = [0.3, 0.4, 0.5];
    let tensor = turn * Matrix3::from_diagonal(&Vector3::from(moments)) * turn.transpose();
    let arm = Vector3::new(0.5, -0.1, 0.2);
    let end = |inertia: Inertia, attitude: Matrix3<f64>, arm: Vector3<f64>| {
        let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
        let top = builder.body("top", inertia).attitude(attitude).angular_velocity([1.0, 2.0, 9.0]);
        let top = top.id();
        builder.joint("tip", PairKind::Spherical, Ground, top).at([0.0, 0.0, -0.4]);
        builder.spring([1.0, 1.0, 0.0], top.point(arm), 30.0).natural_length(0.3).damping(0.2);
        builder.load(top).force(arm).torque(2.0 * arm).follower().point(arm);
        let built = builder.build().unwrap();
        let mut run = built.integrator(Options::new(SchemeKind::Nodal, 0.01)).unwrap();
        (0..100).for_each(|_| assert!(run.step().is_ok()));
        run.state().q[..3].to_vec()
    };
    let straight = end(Inertia::principal(2.0, moments), turn, turn.transpose() * arm);
    let rotated = end(Inertia::tensor(2.0, tensor), Matrix3::identity(), arm);
    let off = (0..3).map(|i| (straight[i] - rotated[i]).abs()).fold(0.0, f64::max);
    assert!(off < 1e-11, "{straight:?} and {rotated:?} differ by {off:e}");
}

#[test]
fn points_by_components_and_in_space_are_the_same() {
    let mut builder = MechanismBuilder::new();
    let a = builder.body("a", BODY).at([1.0, 0.0, 0.0]).rotation_vector([0.0, 0.0, 0.5]).id();
    let components = Vector3::new(0.2, 0.3, 0.1);
    let position = Vector3::x() + rotation::exp(&(0.5 * Vector3::z())) * components;
    builder.spring([0.0; 3], a.point(components), 1.0);
    builder.spring([0.0; 3], a.point_at(position), 1.0);
    let built = builder.build().unwrap();
    let q = built.mechanism.initial_configuration();
    let [first, second] = [0, 1].map(|k| built.forces.springs[k].between.at(&q));
    assert!((first - position).norm() < 1e-15 && (second - position).norm() < 1e-15);
}

#[test]
fn force_elements_are_counted_with_their_revolutions() {
    // a rotor on a torsion spring, a damper and a motor: J θ̈ = −k θ − c θ̇ + T, from the rate of
    // its joint
    let mut builder = MechanismBuilder::new();
    let rotor = builder.body("rotor", BODY).id();
    let hinge = builder.joint("hinge", PairKind::Revolute, Ground, rotor);
    let hinge = hinge.at([0.0; 3]).axis(Z).rate(20.0).id().coordinate(0);
    builder.joint_spring(hinge, 0.2, 0.0);
    builder.joint_force(hinge, Viscous(0.05));
    builder.motor(hinge, |_| 0.4);
    let mut built = builder.build().unwrap();
    let angle = built.coordinate(hinge).unwrap();
    let mut run = built.integrator(Options::new(SchemeKind::Nodal, 0.001)).unwrap();
    (0..2000).for_each(|_| assert!(run.step().is_ok()));
    // x = x_p + e^{−at} (A cos wt + B sin wt)
    let (k, c, inertia, particular, t): (f64, f64, f64, f64, f64) = (0.2, 0.05, 0.5, 2.0, 2.0);
    let a = 0.5 * c / inertia;
    let w = (k / inertia - a * a).sqrt();
    let (first, second) = (-particular, (20.0 - a * particular) / w);
    let wave = first * (w * t).cos() + second * (w * t).sin();
    let exact = particular + (-a * t).exp() * wave;
    let found = angle.at(run.state().configuration());
    assert!(exact > 20.0, "three revolutions: {exact}");
    assert!((found - exact).abs() < 1e-3, "{found} for {exact}");
}

#[test]
fn rates_of_joints_give_velocities_on_the_constraints() {
    let (mut builder, second) = pair(PairKind::Free);
    let shoulder = builder.body("arm", BODY).at([0.0, 1.0, 0.0]).id();
    let y = [0.0, 1.0, 0.0];
    builder.joint("hinge", PairKind::Revolute, Ground, shoulder).at(y).axis(Z).rate(3.0);
    let slide = builder.joint("slide", PairKind::Cylindrical, shoulder, second).at(y).axis(Z);
    slide.rates(&[0.5, -1.0]);
    let built = builder.build().unwrap();
    let [_, v, _, rate] = numbers(&built.mechanism);
    assert!(norm_inf(&rate) < 1e-14, "G v = {rate:?}");
    assert!((v[12 + 2] - 0.5).abs() < 1e-15, "{}", v[14]);
    assert!(norm_inf(&v[..12]).abs() < 1e-15, "the others rest");
}

#[test]
fn the_force_elements_are_data() {
    let (mut builder, second) = pair(PairKind::Prismatic);
    let slide = builder.joint("slide", PairKind::Prismatic, Ground, second).at(Z).axis(Z);
    let slide = slide.cut().id().coordinate(0);
    builder.spring([0.0; 3], second.point(Z), 2.0).damping(0.1).named("strut");
    builder.damper([0.0; 3], second.point(Z), 0.2).named("pot");
    let reference = Arc::new(|_| Setpoint { value: 0.0, rate: 0.0 });
    let control = PdControl { proportional: 1.0, derivative: 0.1, reference };
    builder.joint_force(slide, control).named("control");
    builder.joint_spring(slide, 3.0, 0.1);
    builder.load(second).torque(Z).named("push");
    let built = builder.build().unwrap();
    let forces = &built.forces;
    let kinds = forces.forces.iter().map(|own| match own.force {
        ElementForce::Coordinates(_) => "damper",
        ElementForce::Joint(_) => "joint",
        ElementForce::Tension(_) => "tension",
        ElementForce::Body(_) => "load",
        ElementForce::Wrench(_) => "wrench",
        ElementForce::Law(_) => "law",
        ElementForce::Six(_) => "bushing",
    });
    assert!(kinds.eq(["damper", "damper", "joint", "load"]));
    assert_eq!((forces.springs.len(), forces.joint_springs.len()), (1, 1));
    let names = ["strut", "pot", "control", "push"].map(|name| Source::Element(name.to_owned()));
    assert_eq!(built.system(Quadrature::Midpoint).sources(), names);
    assert!(built.system(Quadrature::Midpoint).is_dissipative());
    assert!(format!("{builder:?}").contains("slide"), "{builder:?}");
}
