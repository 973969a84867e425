//! Equilibria of bodies, point masses and closed loops under springs and weight, and their modes.

#![allow(clippy::unwrap_used)] // a test

use nalgebra::{Matrix3, Vector3};
use vi_core::Quadrature;
use vi_multibody::description::joint_at;
use vi_multibody::form::Form;
use vi_multibody::joint::{FrameId, complete_axis};
use vi_multibody::mechanism::{
    Attachment, Bar, BarEnd, BodySpec, Description, Mechanism, ParticleSpec,
};
use vi_multibody::pair::{PairKind, Properties, cylindrical};
use vi_multibody::spring::{Spring, SpringLaw};
use vi_rigid::body::RigidBody;
use vi_rigid::directors;
use vi_statics::modes;
use vi_statics::{StaticProblem, StaticSettings};

const G: f64 = 9.81;

fn vector(x: f64, y: f64, z: f64) -> Vector3<f64> {
    Vector3::new(x, y, z)
}

/// A body of 2 kg with moments of inertia 0.3, 0.4, 0.5 kg·m².
fn body(name: &str, center: Vector3<f64>) -> BodySpec {
    let inertia = vi_rigid::inertia::PrincipalInertia::new([0.3, 0.4, 0.5]).unwrap();
    BodySpec {
        name: name.into(),
        body: Some(RigidBody::from_inertia(2.0, &inertia).unwrap()),
        center,
        triad: Matrix3::identity(),
        velocity: Vector3::zeros(),
        omega: Vector3::zeros(),
    }
}

fn description(bodies: Vec<BodySpec>) -> Description {
    let gravity = vector(0.0, 0.0, -G);
    Description { dimension: 3, gravity, bodies, ..Description::default() }
}

fn join(
    description: &mut Description,
    kind: PairKind,
    [parent, child]: [Option<usize>; 2],
    point: Vector3<f64>,
) {
    let axes = complete_axis(&Vector3::y());
    let frames = [parent, child].map(|frame| frame.map_or(FrameId::Ground, FrameId::Frame));
    let (name, bodies) = (format!("joint {}", description.joints.len()), &description.bodies);
    let joint = joint_at(&name, kind, frames, [point; 2], &axes, bodies);
    description.joints.push(joint);
}

fn spring(between: Form, stiffness: f64, natural_length: f64) -> Spring {
    Spring { between, stiffness, natural_length, law: SpringLaw::Linear }
}

fn problem(mechanism: Mechanism, springs: Vec<Spring>) -> StaticProblem {
    let mut system = mechanism.system(Quadrature::Midpoint);
    for spring in springs {
        system = system.potential(spring);
    }
    StaticProblem::new(system, mechanism)
}

fn center(q: &[f64], body: usize) -> Vector3<f64> {
    directors::center(&q[12 * body..12 * body + 12])
}

#[test]
fn a_chain_of_bodies_comes_to_hang() {
    for kind in [PairKind::Revolute, PairKind::Spherical] {
        let at = |k: usize| vector(0.5 + k as f64, 0.0, 0.0);
        let mut description = description((0..5).map(|k| body(&format!("{k}"), at(k))).collect());
        for k in 0..5_usize {
            let parent = k.checked_sub(1);
            join(&mut description, kind, [parent, Some(k)], vector(k as f64, 0.0, 0.0));
        }
        let mut problem = problem(Mechanism::new(description), vec![]);
        let point = problem.equilibrate().unwrap();
        let mut worst = 0.0_f64;
        for k in 0..5_usize {
            let exact = vector(0.0, 0.0, -0.5 - k as f64);
            worst = worst.max((center(&point.q, k) - exact).norm());
        }
        let neutral = problem.is_neutral();
        println!(
            "{kind:?}: off the vertical by {worst:.1e} m after {} iterations, residual {:.1e}, neutral \
             {neutral}",
            point.iterations, point.residual
        );
        assert!(worst < 1e-6 && point.residual < 1e-9, "{worst:e}");
        assert_eq!(neutral, kind == PairKind::Spherical, "spin about the vertical");
        let found = modes(&mut problem).unwrap();
        let zeros = (0..found.squared.len()).filter(|&k| found.is_zero(k)).count();
        assert_eq!(zeros, if neutral { 5 } else { 0 }, "{:?}", found.squared);
        // the top support carries the weight
        let weight = 10.0 * G;
        let rows = problem.mechanism().joint_rows(0);
        let vertical = point.multipliers[rows.start + 2];
        assert!((vertical.abs() / weight - 1.0).abs() < 1e-9, "{vertical} against {weight}");
    }
}

#[test]
fn a_parallelogram_with_a_spring_balances_its_torques() {
    // cranks of 1 m from (0, 0, 0) and (2, 0, 0), a coupler of 2 m: a loop of four revolutes,
    // overconstrained
    let (angle, a) = (0.9_f64, vector(0.3, 0.0, 2.5));
    let tip = vector(angle.cos(), 0.0, angle.sin());
    let across = vector(2.0, 0.0, 0.0);
    let mut description = description(vec![
        body("left", 0.5 * tip),
        body("right", across + 0.5 * tip),
        body("coupler", tip + 0.5 * across),
    ]);
    join(&mut description, PairKind::Revolute, [None, Some(0)], Vector3::zeros());
    join(&mut description, PairKind::Revolute, [None, Some(1)], across);
    join(&mut description, PairKind::Revolute, [Some(0), Some(2)], tip);
    join(&mut description, PairKind::Revolute, [Some(1), Some(2)], tip + across);
    let mechanism = Mechanism::new(description);
    let k = 40.0;
    let between = mechanism
        .point_of(Attachment::Body(2), &Vector3::zeros())
        .minus(&mechanism.point_of(Attachment::Ground, &a));
    let mut problem = problem(mechanism, vec![spring(between, k, 0.0)]);
    let point = problem.equilibrate().unwrap();
    let middle = center(&point.q, 2);
    let (c, s) = (middle.x - 1.0, middle.z);
    assert!((c * c + s * s - 1.0).abs() < 1e-13);
    // V = 4 kg·g sin θ + ½ k |x − a|²
    let torque = 4.0 * G * c + k * ((middle.x - a.x) * -s + (middle.z - a.z) * c);
    println!("θ = {:.6}, torque left {torque:.1e}, {} rows", s.atan2(c), problem.rows().len());
    assert!(torque.abs() < 1e-9 && !problem.is_neutral(), "{torque:e}");
    assert_eq!(problem.rows().len(), 17, "three of 20 constraints follow from the others");
    // ω² = V''/I with I = 2 (0.4 + 2/4) + 2
    let curvature = -4.0 * G * s + k * (1.0 + (middle.x - a.x) * -c + (middle.z - a.z) * -s);
    let found = modes(&mut problem).unwrap();
    let error = found.squared[0] / (curvature / 3.8) - 1.0;
    println!("ω² = {:.6}, relative error {error:.1e}", found.squared[0]);
    assert!(found.squared.len() == 1 && error.abs() < 1e-10, "{:?}", found.squared);
}

#[test]
fn point_masses_on_bars_and_springs() {
    // a mass on a bar, pulled aside by a spring of natural length zero: tan φ = k a/(m g + k h)
    let (mass, k, a, h) = (1.5, 6.0, 0.8, -0.4);
    let particle = |name: &str, position| ParticleSpec {
        name: name.into(),
        mass,
        position,
        velocity: Vector3::zeros(),
    };
    for dimension in [2, 3] {
        let gravity = vector(0.0, -G, 0.0);
        let start = vector(0.6, -0.8, 0.0);
        let bars = vec![Bar {
            name: "bar".into(),
            from: BarEnd::Ground(Vector3::zeros()),
            to: 0,
            length: 1.0,
        }];
        let particles = vec![particle("one", start)];
        let description =
            Description { dimension, gravity, particles, bars, ..Description::default() };
        let mechanism = Mechanism::new(description);
        let between = mechanism
            .point_of(Attachment::Particle(0), &Vector3::zeros())
            .minus(&mechanism.point_of(Attachment::Ground, &vector(a, h, 0.0)));
        let mut problem = problem(mechanism, vec![spring(between, k, 0.0)]);
        let point = problem.equilibrate().unwrap();
        let exact = vector(k * a, -mass * G + k * h, 0.0).normalize();
        let found = vector(point.q[0], point.q[1], if dimension == 3 { point.q[2] } else { 0.0 });
        let error = (found - exact).norm();
        println!("{dimension}D: mass off by {error:.1e}");
        assert!(error < 1e-13, "{found:?}");
        let modes = modes(&mut problem).unwrap();
        let pull = vector(k * a, -mass * G + k * h, 0.0).norm();
        let error = modes.squared[0] / (pull / mass) - 1.0;
        assert!(modes.squared.len() == dimension - 1 && error.abs() < 1e-12, "{modes:?}");
    }
}

#[test]
fn a_free_body_between_springs_has_the_frequencies_of_the_closed_form() {
    // a body on four vertical springs at its corners, at rest under its weight
    let mut description = description(vec![body("block", vector(0.0, 0.0, 1.0))]);
    description.gravity = Vector3::zeros();
    let mechanism = Mechanism::new(description);
    let (k, l) = (50.0, 0.7);
    let springs: Vec<Spring> = [(-l, -l), (-l, l), (l, -l), (l, l)]
        .into_iter()
        .map(|(x, y)| {
            let point = vector(x, y, 0.0);
            let from = mechanism.point_of(Attachment::Ground, &point);
            let to = mechanism.point_of(Attachment::Body(0), &point);
            spring(to.minus(&from), k, 1.0)
        })
        .collect();
    let mut problem = problem(mechanism, springs);
    problem.equilibrate().unwrap();
    assert!(problem.is_neutral(), "sideways and about the vertical nothing holds it");
    let found = modes(&mut problem).unwrap();
    let exact = [0.0, 0.0, 0.0, 4.0 * k / 2.0, 4.0 * k * l * l / 0.4, 4.0 * k * l * l / 0.3];
    println!("ω² = {:.6?}", found.squared);
    for (found, exact) in found.squared.iter().zip(exact) {
        assert!((found - exact).abs() < 1e-10, "{found} against {exact}");
    }
}

#[test]
fn what_cannot_stand_is_refused() {
    // a free body under its weight has no equilibrium
    let mechanism = Mechanism::new(description(vec![body("stone", Vector3::zeros())]));
    let mut falling = problem(mechanism, vec![]);
    let error = falling.equilibrate().unwrap_err();
    println!("{error}; {}", error.remedy());
    assert!(falling.configuration()[2].abs() < 1e-300, "the start is kept");
    // a pendulum held upright by nothing: in balance, unstable
    let mut upright = description(vec![body("rod", vector(0.0, 0.0, 0.5))]);
    join(&mut upright, PairKind::Revolute, [None, Some(0)], Vector3::zeros());
    let mut standing = problem(Mechanism::new(upright), vec![]);
    standing.equilibrate().unwrap();
    let found = modes(&mut standing).unwrap();
    println!("upright: ω² = {:?}", found.squared);
    let exact = -2.0 * G * 0.5 / (0.4 + 2.0 * 0.25);
    assert!((found.squared[0] / exact - 1.0).abs() < 1e-12, "{exact}");
    let path = standing.solve(&[1.0], &StaticSettings::default()).unwrap();
    assert_eq!(path.points.len(), 3, "nothing depends on the load parameter");
}

static SLEEVE: Properties = Properties { name: "sleeve", ..cylindrical::PROPERTIES };

/// A pair without a variant of `PairKind` has the equilibria and the modes of its data, in chains
/// and in a loop.
#[test]
fn a_pair_is_its_data() {
    let found = |kind: PairKind, closed: bool| {
        let mut description = description(vec![
            body("a", vector(0.5, 0.1, 0.0)),
            body("b", vector(1.5, 0.2, 0.3)),
            body("c", vector(2.4, 0.3, -0.2)),
        ]);
        join(&mut description, PairKind::Revolute, [None, Some(0)], Vector3::zeros());
        join(&mut description, kind, [Some(0), Some(1)], vector(1.0, 0.1, 0.2));
        join(&mut description, kind, [Some(2), Some(1)], vector(2.0, 0.3, 0.1));
        if closed {
            join(&mut description, kind, [Some(2), None], vector(2.8, 0.0, -0.1));
        }
        let mechanism = Mechanism::new(description);
        let end = |body| mechanism.point_of(Attachment::Body(body), &vector(0.1, 0.2, 0.0));
        let ground = mechanism.point_of(Attachment::Ground, &vector(1.0, 0.5, 2.0));
        let springs = [1, 2].map(|body| spring(end(body).minus(&ground), 60.0, 0.5)).to_vec();
        let mut problem = problem(mechanism, springs);
        let point = problem.equilibrate().unwrap();
        format!("{point:?} {:?}", modes(&mut problem).unwrap().squared)
    };
    for closed in [false, true] {
        let same = found(PairKind::Unlisted(&SLEEVE), closed);
        assert_eq!(same, found(PairKind::Cylindrical, closed));
        println!("closed {closed}: {} digits are equal", same.len());
    }
}
