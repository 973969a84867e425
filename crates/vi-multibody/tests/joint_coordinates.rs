//! Springs, dampers, motors, couplings and prescribed motion of joint coordinates, with turns counted.

#![allow(clippy::unwrap_used)] // a test

use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;
use vi_constraints::{Constraints, Options, SchemeKind};
use vi_core::{Composition, Configuration, Quadrature};
use vi_multibody::coordinate::JointCoordinate;
use vi_multibody::joint::{FrameId, GROUND, Joint, Side, complete_axis};
use vi_multibody::joint_force::{JointForce, JointSpring, Motor, PdControl, Viscous};
use vi_multibody::mechanism::{BodySpec, Description, Mechanism};
use vi_multibody::pair::PairKind;
use vi_multibody::run::{MechanismIntegrator, Solver, integrator};
use vi_multibody::scalar_constraint::ScalarConstraint;
use vi_rigid::body::RigidBody;
use vi_rigid::directors;
use vi_rigid::inertia::PrincipalInertia;
use vi_rigid::rotation;

fn body(name: &str, center: Vector3<f64>, omega: Vector3<f64>) -> BodySpec {
    let inertia = PrincipalInertia::new([0.3, 0.4, 0.5]).unwrap();
    BodySpec {
        name: name.into(),
        body: Some(RigidBody::from_inertia(2.0, &inertia).unwrap()),
        center,
        triad: Matrix3::identity(),
        velocity: Vector3::zeros(),
        omega,
    }
}

fn joint(
    description: &Description,
    kind: PairKind,
    [parent, child]: [FrameId; 2],
    point: Vector3<f64>,
    axis: Vector3<f64>,
) -> Joint {
    let axes = complete_axis(&axis.normalize());
    let side = |id: FrameId| match id {
        FrameId::Ground => Side::at(id, &GROUND, &point, &axes),
        FrameId::Frame(k) => {
            let mut q = [0.0; 12];
            let b = &description.bodies[k];
            directors::set_frame(&mut q, &b.center, &b.triad);
            Side::at(id, &q, &point, &axes)
        }
    };
    let (parent, child) = (side(parent), side(child));
    Joint { name: format!("{}-{}", kind.name(), description.joints.len()), kind, parent, child }
}

const G: FrameId = FrameId::Ground;
const A: FrameId = FrameId::Frame(0);
const B: FrameId = FrameId::Frame(1);

fn empty() -> Description {
    Description { dimension: 3, ..Description::default() }
}

/// Two rotors about z, side by side, `J = 0.5` each.
fn rotors(omega: [f64; 2]) -> Description {
    let mut d = empty();
    let (left, right) = (Vector3::zeros(), Vector3::new(2.0, 0.0, 0.0));
    d.bodies.push(body("left", left, omega[0] * Vector3::z()));
    d.bodies.push(body("right", right, omega[1] * Vector3::z()));
    for (frame, point) in [(A, left), (B, right)] {
        let hinge = joint(&d, PairKind::Revolute, [G, frame], point, Vector3::z());
        d.joints.push(hinge);
    }
    d
}

/// For a constraint.
fn principal(d: &Description, k: usize, freedom: usize) -> JointCoordinate {
    JointCoordinate::principal(&d.joints[k], freedom).unwrap()
}

fn turned(run: &MechanismIntegrator, coordinate: &JointCoordinate) -> f64 {
    coordinate.at(run.state().configuration())
}

/// Steps to the end and reads a coordinate.
fn follow(run: &mut MechanismIntegrator, coordinate: &JointCoordinate, steps: u32) -> f64 {
    for _ in 0..steps {
        run.step().unwrap();
    }
    turned(run, coordinate)
}

fn start(
    mechanism: Mechanism,
    system: vi_core::SeparableSystem,
    options: Options,
) -> MechanismIntegrator {
    let (q, v) = mechanism.start();
    integrator(mechanism, system, options, Solver::Auto, (0.0, &q, &v)).unwrap()
}

#[test]
fn coordinates_have_exact_derivatives() {
    let mut d = empty();
    d.bodies.push(body("a", Vector3::new(0.1, 0.2, -0.3), Vector3::zeros()));
    d.bodies.push(body("b", Vector3::new(0.9, -0.2, 0.4), Vector3::zeros()));
    d.bodies[0].triad = rotation::exp(&Vector3::new(0.3, -0.2, 0.9));
    for (kind, freedoms) in [
        (PairKind::Revolute, 1),
        (PairKind::Cylindrical, 2),
        (PairKind::Prismatic, 1),
        (PairKind::Planar, 3),
        (PairKind::Universal, 2),
    ] {
        let j = joint(&d, kind, [A, B], Vector3::new(0.4, 0.1, 0.2), Vector3::new(1.0, 2.0, -1.0));
        let q: Vec<f64> = {
            let mut q = vec![0.0; 24];
            for (k, b) in d.bodies.iter().enumerate() {
                let shaken = rotation::exp(&Vector3::new(0.3, 0.2, -0.1)) * b.triad;
                let triad = if k == 1 { shaken } else { b.triad };
                directors::set_frame(&mut q[12 * k..12 * k + 12], &b.center, &triad);
            }
            q
        };
        for freedom in 0..freedoms {
            let c = JointCoordinate::principal(&j, freedom).unwrap();
            let e = 1e-5;
            let v: Vec<f64> = (0..24).map(|i| (f64::from(i) * 1.7).sin()).collect();
            let w: Vec<f64> = (0..24).map(|i| (f64::from(i) * 0.7).cos()).collect();
            let at = |s: f64, t: f64| -> f64 {
                let x: Vec<f64> = (0..24).map(|i| q[i] + s * v[i] + t * w[i]).collect();
                c.at(Configuration::new(0.0, &x))
            };
            let first = (at(e, 0.0) - at(-e, 0.0)) / (2.0 * e);
            let rate = c.rate(&q, &v);
            assert!((first - rate).abs() < 1e-8, "{kind:?} {freedom}: {first} vs {rate}");
            let mixed = (at(e, e) - at(e, -e) - at(-e, e) + at(-e, -e)) / (4.0 * e * e);
            let second = c.second(&q, &v, &w);
            assert!((mixed - second).abs() < 1e-4, "{kind:?} {freedom}: {mixed} vs {second}");
            let mut wrench_rate = 0.0;
            let twists = [(0.3, -0.8), (0.9, 0.2)];
            let mut motion = vec![0.0; 24];
            for (k, (a, b)) in twists.into_iter().enumerate() {
                let (linear, omega) = (Vector3::new(a, b, -a), Vector3::new(b, a, 0.4));
                let own = 12 * k..12 * k + 12;
                let rate = directors::spin_velocity(&q[own.clone()], &linear, &omega);
                motion[own].copy_from_slice(&rate);
                c.for_each_wrench(&q, |frame, w| {
                    if frame == k {
                        wrench_rate += w.linear.dot(&linear) + w.angular.dot(&omega);
                    }
                });
            }
            let expected = c.rate(&q, &motion);
            assert!((wrench_rate - expected).abs() < 1e-13, "{kind:?}: {wrench_rate} {expected}");
        }
    }
}

#[test]
fn a_torsional_spring_winds_over_several_turns() {
    // J θ̈ = −k θ: θ = θ̇_0/w sin w t with w = √(k/J); amplitude 25 rad = 4 turns
    let error = |steps: u32, composition: Composition| {
        let d = rotors([5.0, 0.0]);
        let mut mechanism = Mechanism::new(d);
        let coordinate = mechanism.coordinate(0, 0).unwrap();
        let spring = JointSpring { coordinate: coordinate.clone(), stiffness: 0.02, rest: 0.0 };
        let system = mechanism.system(Quadrature::Midpoint).discrete_potential(Box::new(spring));
        let (w, end) = ((0.02_f64 / 0.5).sqrt(), 12.0);
        let options =
            Options::new(SchemeKind::Nodal, end / f64::from(steps)).composition(composition);
        let mut run = start(mechanism, system, options);
        let found = follow(&mut run, &coordinate, steps);
        (found - 5.0 / w * (w * end).sin()).abs()
    };
    // the potential of the spring is quadratic in the angle, the rotation is not: an honest order
    for (composition, steps) in [(Composition::Identity, 400), (Composition::Suzuki5, 100)] {
        let (coarse, fine) = (error(steps, composition), error(2 * steps, composition));
        let order = (coarse / fine).log2();
        println!("{composition:?}: errors {coarse:.2e}, {fine:.2e}, order {order:.2}");
        assert!((order - f64::from(composition.order())).abs() < 0.2, "{order}");
    }
}

#[test]
fn joint_springs_and_dampers_keep_the_momentum_of_a_free_pair() {
    let mut d = empty();
    d.bodies.push(body("a", Vector3::zeros(), Vector3::new(0.3, -0.2, 1.0)));
    d.bodies.push(body("b", Vector3::new(1.0, 0.0, 0.0), Vector3::zeros()));
    let hinge = joint(&d, PairKind::Revolute, [A, B], Vector3::new(0.5, 0.0, 0.0), Vector3::y());
    d.joints.push(hinge);
    // consistent rates: b turns with a, plus 2 rad/s about the hinge
    let omega = d.bodies[0].omega;
    let spin = omega + 2.0 * Vector3::y();
    d.bodies[1].omega = spin;
    let arm = Vector3::new(0.5, 0.0, 0.0);
    d.bodies[1].velocity = omega.cross(&arm) + spin.cross(&arm);
    let mut mechanism = Mechanism::new(d);
    let coordinate = mechanism.coordinate(0, 0).unwrap();
    let spring = JointSpring { coordinate: coordinate.clone(), stiffness: 3.0, rest: 0.4 };
    let damper = JointForce { coordinate, law: Viscous(0.2) };
    let mut ends = Vec::new();
    for scheme in SchemeKind::ALL {
        let system = mechanism
            .system(Quadrature::Midpoint)
            .discrete_potential(Box::new(spring.clone()))
            .force(Box::new(JointForce { coordinate: damper.coordinate.clone(), law: damper.law }));
        let mut run = start(mechanism.clone(), system, Options::new(scheme, 0.01));
        let before = mechanism.momentum(&run.state().q, &run.state().p);
        for _ in 0..500 {
            run.step().unwrap();
        }
        let after = mechanism.momentum(&run.state().q, &run.state().p);
        let off = (0..3)
            .map(|i| {
                (before.angular[i] - after.angular[i])
                    .abs()
                    .max((before.linear[i] - after.linear[i]).abs())
            })
            .fold(0.0, f64::max);
        println!("{scheme:?}: momenta off by {off:.1e} after 500 steps");
        assert!(off < 1e-12, "{scheme:?}: {off:e}");
        ends.push(run.state().q.clone());
    }
    for end in &ends[1..] {
        let off = (0..24).map(|i| (end[i] - ends[0][i]).abs()).fold(0.0, f64::max);
        assert!(off < 1e-11, "schemes differ by {off:e}");
    }
}

#[test]
fn gears_with_any_ratio_over_many_turns() {
    // motor T on the left rotor, θ_l + ρ θ_r = const: (J + J/ρ²) θ̈_l = T
    let (ratio, torque, end) = (-0.37, 0.8, 6.0);
    for scheme in SchemeKind::ALL {
        let mut d = rotors([0.0, 0.0]);
        let pair = (principal(&d, 0, 0), principal(&d, 1, 0));
        let q = Mechanism::new(d.clone()).start().0;
        d.scalars.push(ScalarConstraint::coupling("gear", pair, ratio, &q));
        let mut mechanism = Mechanism::new(d);
        let [left, right] = [0, 1].map(|k| mechanism.coordinate(k, 0).unwrap());
        let law = Motor(Arc::new(move |_| torque));
        let motor = JointForce { coordinate: left.clone(), law };
        let system = mechanism.system(Quadrature::Midpoint).force(Box::new(motor));
        let mut run = start(mechanism, system, Options::new(scheme, 0.005));
        let steps = (end / 0.005) as u32;
        for _ in 0..steps {
            run.step().unwrap();
        }
        let (l, r) = (turned(&run, &left), turned(&run, &right));
        let exact = 0.5 * torque / (0.5 + 0.5 / (ratio * ratio)) * end * end;
        println!(
            "{scheme:?}: left {l:.6} rad (exact {exact:.6}), gear off by {:.1e}",
            l + ratio * r
        );
        assert!((l + ratio * r).abs() < 1e-12);
        assert!((l - exact).abs() < 2e-4 * exact, "{l} vs {exact}");
        assert!(r.abs() > 6.3, "more than a turn: {r}");
    }
}

#[test]
fn a_screw_couples_turn_and_advance() {
    // pitch p per rad: (J + m p²) θ̈ = T
    let (pitch, torque, end) = (0.3, 0.4, 4.0);
    let mut d = empty();
    d.bodies.push(body("nut", Vector3::zeros(), Vector3::zeros()));
    let guide = joint(&d, PairKind::Cylindrical, [G, A], Vector3::zeros(), Vector3::z());
    d.joints.push(guide);
    let q = Mechanism::new(d.clone()).start().0;
    let pair = (principal(&d, 0, 0), principal(&d, 0, 1));
    d.scalars.push(ScalarConstraint::coupling("thread", pair, -pitch, &q));
    let law = Motor(Arc::new(move |_| torque));
    let mut mechanism = Mechanism::new(d);
    let [slide, angle] = [0, 1].map(|freedom| mechanism.coordinate(0, freedom).unwrap());
    let motor = JointForce { coordinate: angle.clone(), law };
    let system = mechanism.system(Quadrature::Midpoint).force(Box::new(motor));
    let mut run = start(mechanism, system, Options::new(SchemeKind::Nodal, 0.002));
    let theta = follow(&mut run, &angle, 2000);
    let exact = 0.5 * torque / (0.5 + 2.0 * pitch * pitch) * end * end;
    let u = turned(&run, &slide);
    println!(
        "turned {theta:.6} (exact {exact:.6}), advanced {u:.6}, thread off by {:.1e}",
        u - pitch * theta
    );
    assert!((u - pitch * theta).abs() < 1e-12);
    assert!((theta - exact).abs() < 1e-4 * exact);
}

#[test]
fn a_driven_hinge_follows_its_reference_exactly_in_every_scheme() {
    // θ_ref = 0.3 + 2 t + sin 3t − 0.3 at the left hinge, a pendulum hangs on it
    let mut ends = Vec::new();
    for scheme in SchemeKind::ALL {
        let mut d = empty();
        d.gravity = Vector3::new(0.0, -9.81, 0.0);
        let rate = 2.0 + 3.0;
        d.bodies.push(body("crank", Vector3::new(0.5, 0.0, 0.0), rate * Vector3::z()));
        d.bodies[0].velocity = Vector3::new(0.0, 0.5 * rate, 0.0);
        d.bodies.push(body("arm", Vector3::new(1.0, -0.7, 0.0), Vector3::zeros()));
        d.bodies[1].velocity = Vector3::new(0.0, rate, 0.0);
        let hinge = joint(&d, PairKind::Revolute, [G, A], Vector3::zeros(), Vector3::z());
        d.joints.push(hinge);
        let hinge = joint(&d, PairKind::Revolute, [A, B], Vector3::x(), Vector3::z());
        d.joints.push(hinge);
        let reference = Arc::new(|t: f64| {
            [2.0 * t + (3.0 * t).sin(), 2.0 + 3.0 * (3.0 * t).cos(), -9.0 * (3.0 * t).sin()]
        });
        d.scalars.push(ScalarConstraint::motion("drive", principal(&d, 0, 0), reference));
        let mut mechanism = Mechanism::new(d);
        let angle = mechanism.coordinate(0, 0).unwrap();
        let system = mechanism.system(Quadrature::Midpoint);
        let mut run = start(mechanism, system, Options::new(scheme, 0.01));
        assert!(run.start_report().velocity_moved < 1e-12, "{:?}", run.start_report());
        let theta = follow(&mut run, &angle, 600);
        let exact = 2.0 * 6.0 + 18.0_f64.sin();
        println!("{scheme:?}: hinge at {theta} rad, off by {:.1e}", theta - exact);
        assert!((theta - exact).abs() < 1e-12);
        let node = run.observe().unwrap();
        assert!(node.position_residual < 1e-12);
        ends.push(run.state().q.clone());
    }
    for end in &ends[1..] {
        let off = (0..24).map(|i| (end[i] - ends[0][i]).abs()).fold(0.0, f64::max);
        println!("schemes differ by {off:.1e}");
        assert!(off < 1e-9, "schemes differ by {off:e}");
    }
}

#[test]
fn pd_control_settles_with_the_error_of_its_stiffness() {
    let mut d = empty();
    d.gravity = Vector3::new(0.0, -9.81, 0.0);
    d.bodies.push(body("arm", Vector3::new(0.5, 0.0, 0.0), Vector3::zeros()));
    let hinge = joint(&d, PairKind::Revolute, [G, A], Vector3::zeros(), Vector3::z());
    d.joints.push(hinge);
    let law =
        PdControl { proportional: 200.0, derivative: 40.0, reference: Arc::new(|_| (0.5, 0.0)) };
    let mut mechanism = Mechanism::new(d);
    let angle = mechanism.coordinate(0, 0).unwrap();
    let control = JointForce { coordinate: angle.clone(), law };
    let system = mechanism.system(Quadrature::Midpoint).force(Box::new(control));
    let mut run = start(mechanism, system, Options::new(SchemeKind::Nodal, 0.01));
    let theta = follow(&mut run, &angle, 1000);
    let balance = 200.0 * (0.5 - theta) - 2.0 * 9.81 * 0.5 * theta.cos();
    println!("settles at {theta:.6} rad, balance of torques {balance:.1e}");
    assert!(balance.abs() < 1e-9);
}

#[test]
fn guides_and_distances_hold_to_round_off() {
    let mut d = empty();
    d.gravity = Vector3::new(0.3, 0.2, -9.81);
    d.bodies.push(body("bead", Vector3::zeros(), Vector3::new(0.1, 0.2, 0.3)));
    d.bodies.push(body("slab", Vector3::new(2.0, 0.0, 0.0), Vector3::new(0.0, 0.5, 0.0)));
    let line = joint(
        &d,
        PairKind::Free,
        [G, A],
        Vector3::new(0.1, 0.0, 0.0),
        Vector3::new(1.0, 1.0, -1.0),
    );
    let plane =
        joint(&d, PairKind::Free, [G, B], Vector3::new(2.0, 0.2, 0.0), Vector3::new(0.0, 1.0, 3.0));
    let q = Mechanism::new(d.clone()).start().0;
    let between = vi_multibody::form::Form::point(12, &Vector3::new(-0.3, 0.0, 0.0))
        .minus(&vi_multibody::form::Form::point(0, &Vector3::new(0.3, 0.1, 0.0)));
    let length = between.at(&q).norm();
    d.scalars = vec![
        ScalarConstraint::point_on_line(&line),
        ScalarConstraint::point_on_plane(&plane),
        ScalarConstraint::distance("rod", &between, length),
    ];
    let mechanism = Mechanism::new(d);
    let mut ends = Vec::new();
    for scheme in SchemeKind::ALL {
        let system = mechanism.system(Quadrature::Midpoint);
        let mut run = start(mechanism.clone(), system, Options::new(scheme, 0.005));
        let mut worst = 0.0_f64;
        for _ in 0..400 {
            run.step().unwrap();
            let mut g = vec![0.0; mechanism.len()];
            mechanism.value(run.state().configuration(), &mut g);
            worst = worst.max(vi_core::linear::norm_inf(&g));
        }
        let scale = vi_core::linear::norm_inf(&run.state().q);
        println!("{scheme:?}: |g| ≤ {worst:.1e} over a fall of {scale:.1} m");
        assert!(worst < 1e-13 * scale.powi(2), "{scheme:?}: {worst:e}");
        ends.push(run.state().q.clone());
    }
    for end in &ends[1..] {
        let off = (0..24).map(|i| (end[i] - ends[0][i]).abs()).fold(0.0, f64::max);
        assert!(off < 1e-9, "schemes differ by {off:e}");
    }
}
