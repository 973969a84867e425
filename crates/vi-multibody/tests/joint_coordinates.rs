//! Springs, dampers, motors, couplings and prescribed motion of joint coordinates, with turns
//! counted.

#![allow(clippy::unwrap_used)] // a test

use nalgebra::Vector3;
use std::sync::Arc;
use vi_constraints::{Constraints, Options, SchemeKind};
use vi_core::{Composition, Configuration};
use vi_multibody::FrameId::Ground;
use vi_multibody::builder::{BodyEntry, BuiltMechanism, CoordinateId, Inertia, MechanismBuilder};
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_multibody::joint_force::{PdControl, Setpoint, Viscous};
use vi_multibody::pair::PairKind;
use vi_multibody::run::MechanismIntegrator;
use vi_rigid::{directors, rotation};

const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

fn body<'a>(builder: &'a mut MechanismBuilder, name: &str, center: [f64; 3]) -> BodyEntry<'a> {
    builder.body(name, Inertia::principal(2.0, [0.3, 0.4, 0.5])).at(center)
}

/// Two rotors about z, side by side, `J = 0.5` each, and their angles.
fn rotors(rates: [f64; 2]) -> (MechanismBuilder, [CoordinateId; 2]) {
    let mut builder = MechanismBuilder::new();
    let angles = [("left", [0.0; 3], rates[0]), ("right", [2.0, 0.0, 0.0], rates[1])].map(
        |(name, center, rate)| {
            let rotor = body(&mut builder, name, center).angular_velocity([0.0, 0.0, rate]).id();
            let hinge = builder.joint(name, PairKind::Revolute, Ground, rotor);
            hinge.at(center).axis(Z).id().coordinate(0)
        },
    );
    (builder, angles)
}

fn rotated(run: &MechanismIntegrator, coordinate: &JointCoordinate) -> f64 {
    coordinate.at(run.state().configuration())
}

/// Steps to the end and reads a coordinate.
fn follow(run: &mut MechanismIntegrator, coordinate: &JointCoordinate, steps: u32) -> f64 {
    for _ in 0..steps {
        run.step().unwrap();
    }
    rotated(run, coordinate)
}

/// The mechanism, and coordinates of it as they are read along a run.
fn built<const N: usize>(
    builder: &MechanismBuilder,
    coordinates: [CoordinateId; N],
) -> (BuiltMechanism, [JointCoordinate; N]) {
    let mut built = builder.build().unwrap();
    let coordinates = coordinates.map(|coordinate| built.coordinate(coordinate).unwrap());
    (built, coordinates)
}

#[test]
fn coordinates_have_exact_derivatives() {
    for kind in PairKind::ALL.into_iter().filter(|kind| kind.coordinate_count() > 0) {
        let dof = kind.coordinate_count();
        let mut builder = MechanismBuilder::new();
        let a = body(&mut builder, "a", [0.1, 0.2, -0.3]).rotation_vector([0.3, -0.2, 0.9]).id();
        let b = body(&mut builder, "b", [0.9, -0.2, 0.4]).id();
        builder.joint("joint", kind, a, b).at([0.4, 0.1, 0.2]).axis([1.0, 2.0, -1.0]);
        let d = builder.description().unwrap();
        let j = &d.joints[0];
        let q: Vec<f64> = {
            let mut q = vec![0.0; 24];
            for (k, b) in d.bodies.iter().enumerate() {
                let shaken = rotation::exp(&Vector3::new(0.3, 0.2, -0.1)) * b.triad;
                let triad = if k == 1 { shaken } else { b.triad };
                directors::set_frame(&mut q[12 * k..12 * k + 12], &b.center, &triad);
            }
            q
        };
        for freedom in 0..dof {
            let c = JointCoordinate::principal(j, freedom).unwrap();
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
        let (mut builder, [angle, _]) = rotors([5.0, 0.0]);
        builder.joint_spring(angle, 0.02, 0.0);
        let (mechanism, [coordinate]) = built(&builder, [angle]);
        let (w, end) = ((0.02_f64 / 0.5).sqrt(), 12.0);
        let options =
            Options::new(SchemeKind::Nodal, end / f64::from(steps)).composition(composition);
        let mut run = mechanism.integrator(options).unwrap();
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
    let mut builder = MechanismBuilder::new();
    let a = body(&mut builder, "a", [0.0; 3]).angular_velocity([0.3, -0.2, 1.0]).id();
    let b = body(&mut builder, "b", X).id(); // turns with a, plus 2 rad/s about the hinge
    let hinge = builder.joint("hinge", PairKind::Revolute, a, b).at([0.5, 0.0, 0.0]).axis(Y);
    let angle = hinge.rate(2.0).id().coordinate(0);
    builder.joint_spring(angle, 3.0, 0.4);
    builder.joint_force(angle, Viscous(0.2));
    let made = builder.build().unwrap();
    let mechanism = &made.mechanism;
    let mut ends = Vec::new();
    for scheme in SchemeKind::ALL {
        let mut run = made.clone().integrator(Options::new(scheme, 0.01)).unwrap();
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
        let (mut builder, [left, right]) = rotors([0.0, 0.0]);
        builder.gear("gear", left, right, ratio);
        builder.motor(left, move |_| torque);
        let (mechanism, [left, right]) = built(&builder, [left, right]);
        let mut run = mechanism.integrator(Options::new(scheme, 0.005)).unwrap();
        let steps = (end / 0.005) as u32;
        for _ in 0..steps {
            run.step().unwrap();
        }
        let (l, r) = (rotated(&run, &left), rotated(&run, &right));
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
    let mut builder = MechanismBuilder::new();
    let nut = body(&mut builder, "nut", [0.0; 3]).id();
    let guide = builder.joint("guide", PairKind::Cylindrical, Ground, nut).at([0.0; 3]).axis(Z);
    let [slide, angle] = [0, 1].map({
        let guide = guide.id();
        move |freedom| guide.coordinate(freedom)
    });
    builder.gear("thread", slide, angle, -pitch);
    builder.motor(angle, move |_| torque);
    let (mechanism, [slide, angle]) = built(&builder, [slide, angle]);
    let mut run = mechanism.integrator(Options::new(SchemeKind::Nodal, 0.002)).unwrap();
    let theta = follow(&mut run, &angle, 2000);
    let exact = 0.5 * torque / (0.5 + 2.0 * pitch * pitch) * end * end;
    let u = rotated(&run, &slide);
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
        let mut builder = MechanismBuilder::new().gravity([0.0, -9.81, 0.0]);
        let crank = body(&mut builder, "crank", [0.5, 0.0, 0.0]).id();
        let arm = body(&mut builder, "arm", [1.0, -0.7, 0.0]).velocity([0.0, 5.0, 0.0]).id();
        let base = builder.joint("base", PairKind::Revolute, Ground, crank).at([0.0; 3]).axis(Z);
        let angle = base.rate(2.0 + 3.0).id().coordinate(0);
        builder.joint("elbow", PairKind::Revolute, crank, arm).at(X).axis(Z);
        builder.motion("drive", angle, |t| {
            [2.0 * t + (3.0 * t).sin(), 2.0 + 3.0 * (3.0 * t).cos(), -9.0 * (3.0 * t).sin()]
        });
        let (mechanism, [angle]) = built(&builder, [angle]);
        let mut run = mechanism.integrator(Options::new(scheme, 0.01)).unwrap();
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
    let mut builder = MechanismBuilder::new().gravity([0.0, -9.81, 0.0]);
    let arm = body(&mut builder, "arm", [0.5, 0.0, 0.0]).id();
    let hinge = builder.joint("hinge", PairKind::Revolute, Ground, arm).at([0.0; 3]).axis(Z);
    let angle = hinge.id().coordinate(0);
    let reference = Arc::new(|_| Setpoint { value: 0.5, rate: 0.0 });
    builder.joint_force(angle, PdControl { proportional: 200.0, derivative: 40.0, reference });
    let (mechanism, [angle]) = built(&builder, [angle]);
    let mut run = mechanism.integrator(Options::new(SchemeKind::Nodal, 0.01)).unwrap();
    let theta = follow(&mut run, &angle, 1000);
    let balance = 200.0 * (0.5 - theta) - 2.0 * 9.81 * 0.5 * theta.cos();
    println!("settles at {theta:.6} rad, balance of torques {balance:.1e}");
    assert!(balance.abs() < 1e-9);
}

#[test]
fn guides_and_distances_hold_to_round_off() {
    let mut builder = MechanismBuilder::new().gravity([0.3, 0.2, -9.81]);
    let bead = body(&mut builder, "bead", [0.0; 3]).angular_velocity([0.1, 0.2, 0.3]).id();
    let slab = body(&mut builder, "slab", [2.0, 0.0, 0.0]).angular_velocity([0.0, 0.5, 0.0]).id();
    builder.point_on_line("line", Ground, bead, [0.1, 0.0, 0.0], [1.0, 1.0, -1.0]);
    builder.point_on_plane("plane", Ground, slab, [2.0, 0.2, 0.0], [0.0, 1.0, 3.0]);
    builder.distance("rod", bead.point([0.3, 0.1, 0.0]), slab.point([-0.3, 0.0, 0.0]));
    let made = builder.build().unwrap();
    let mechanism = &made.mechanism;
    let mut ends = Vec::new();
    for scheme in SchemeKind::ALL {
        let mut run = made.clone().integrator(Options::new(scheme, 0.005)).unwrap();
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
