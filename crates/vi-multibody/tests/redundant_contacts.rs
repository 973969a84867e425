//! Contacts whose impulses are not unique: the motion is, and what is at rest stays so.

use crate::contact_runs::{G, box_shape, coulomb, floor, run_by};
use nalgebra::Vector3;
use vi_constraints::nonsmooth::Method;
use vi_multibody::FrameId::{self, Ground};
use vi_multibody::PairKind;
use vi_multibody::builder::{DryFriction, Inertia, JointLimits, MechanismBuilder};
use vi_multibody::joint_force::Viscous;
use vi_multibody::run::MechanismIntegrator;
use vi_rigid::gap::ContactShape;

const METHODS: [Method; 2] = [Method::Events, Method::Stepping];

/// Takes steps until the time, then as many more in which nothing may move.
fn comes_to_rest(name: &str, mut run: MechanismIntegrator, steps: usize) {
    for step in 0..steps {
        run.step().unwrap_or_else(|error| panic!("{name}, step {step}: {error}"));
    }
    let still = run.state().q.clone();
    for step in 0..100 {
        run.step().unwrap_or_else(|error| panic!("{name}, step {step} at rest: {error}"));
    }
    let moved = run.state().q.iter().zip(&still).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let counts = run.state().contacts.counts;
    println!("{name}: moved {moved:.1e} at rest, {counts:?}");
    assert!(moved < 1e-13, "{name}: moved {moved:e}");
    assert!(counts.smallest_gap.is_some_and(|gap| gap > -1e-12), "{name}: {counts:?}");
}

/// A door with a closer whose hinge rubs ends on its stop, with a small and a large friction.
#[test]
fn a_door_with_friction_ends_on_its_stop() {
    for (effort, restitution) in [(0.8, 0.4), (0.8, 0.0), (0.05, 0.4), (2.5, 0.9)] {
        for method in METHODS {
            let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -G]);
            let (x, z) = (25.0 * 0.04 * 0.04 / 12.0, 25.0 * 0.81 / 12.0);
            let leaf = builder.body("leaf", Inertia::principal(25.0, [x, z, z]));
            let rate = 3.5;
            let leaf = leaf.at([0.45, 0.0, 1.0]).velocity([0.0, 0.45 * rate, 0.0]);
            let leaf = leaf.angular_velocity([0.0, 0.0, rate]).id();
            let hinge = builder.joint("hinge", PairKind::Revolute, Ground, leaf);
            let hinge = hinge.at([0.0, 0.0, 1.0]).axis([0.0, 0.0, 1.0]).id().coordinate(0);
            let (lower, upper) = (Some(0.0), Some(100_f64.to_radians()));
            builder.joint_limits(hinge, JointLimits { lower, upper, restitution });
            builder.joint_friction(hinge, DryFriction::Effort(effort));
            builder.joint_spring(hinge, 8.0, -20_f64.to_radians());
            builder.joint_force(hinge, Viscous(3.0));
            let name = format!("{method:?}, {effort} N m, e = {restitution}");
            comes_to_rest(&name, run_by(&builder, 0.005, method), 2000);
        }
    }
}

/// A carriage falls on its stop along a guide that rubs, by an effort or by the force across.
#[test]
fn a_carriage_with_friction_ends_on_its_stop() {
    let across = DryFriction::Coefficient { coefficient: 0.3, radius: 1.0 };
    for friction in [DryFriction::Effort(3.0), across] {
        for (method, restitution) in METHODS.into_iter().flat_map(|m| [(m, 0.0), (m, 0.5)]) {
            let mut builder = MechanismBuilder::new().gravity([3.0, 0.0, -G]);
            let body = builder.body("carriage", Inertia::principal(2.0, [0.1; 3])).id();
            let guide = builder.joint("guide", PairKind::Prismatic, Ground, body).at([0.0; 3]);
            let along = guide.axis([0.0, 0.0, 1.0]).id().coordinate(0);
            let (lower, upper) = (Some(-0.3), Some(0.2));
            builder.joint_limits(along, JointLimits { lower, upper, restitution });
            builder.joint_friction(along, friction);
            let name = format!("{method:?}, {friction:?}, e = {restitution}");
            comes_to_rest(&name, run_by(&builder, 0.01, method), 300);
        }
    }
}

/// A chain whose joints rub hangs with each of them on its stop.
#[test]
fn a_chain_with_friction_ends_on_its_stops() {
    for (links, method) in METHODS.into_iter().flat_map(|m| [(2, m), (4, m)]) {
        let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -G]);
        let mut parent = Ground;
        for k in 0..links {
            let inertia = Inertia::principal(1.0, [1e-3, 0.02, 0.02]);
            let at = [0.25 + 0.5 * f64::from(k), 0.0, 0.0];
            let body = builder.body(&format!("link{k}"), inertia).at(at).id();
            let hinge = builder.joint(&format!("hinge{k}"), PairKind::Revolute, parent, body);
            let hinge = hinge.at([0.5 * f64::from(k), 0.0, 0.0]).axis([0.0, 1.0, 0.0]).id();
            let hinge = hinge.coordinate(0);
            let (lower, upper) = (Some(-0.2), Some(0.1));
            builder.joint_limits(hinge, JointLimits { lower, upper, restitution: 0.2 });
            builder.joint_friction(hinge, DryFriction::Effort(0.3));
            parent = body.into();
        }
        let name = format!("{method:?}, {links} links");
        comes_to_rest(&name, run_by(&builder, 0.005, method), 600);
    }
}

/// A ball between two walls that lean, a block in a slot, a box on its corners.
#[test]
fn shapes_with_more_contacts_than_needed_rest() {
    let plane = |point: [f64; 3], normal: [f64; 3]| {
        let (point, normal) = (point.into(), Vector3::from(normal).normalize());
        (Ground, ContactShape::Plane { point, normal })
    };
    for (friction, method) in METHODS.into_iter().flat_map(|m| [(0.0, m), (0.3, m), (0.8, m)]) {
        let law = coulomb(friction, 0.3);
        let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -G]);
        let ball = builder.body("ball", Inertia::principal(1.0, [0.004; 3])).at([0.0, 0.0, 0.3]);
        let ball = (FrameId::from(ball.id()), ContactShape::sphere(Vector3::zeros(), 0.1));
        let walls = [plane([0.0; 3], [1.0, 0.0, 1.0]), plane([0.0; 3], [-1.0, 0.0, 1.0])];
        let across =
            [plane([0.0, 0.1, 0.0], [0.0, -1.0, 0.0]), plane([0.0, -0.1, 0.0], [0.0, 1.0, 0.0])];
        for (k, wall) in walls.into_iter().chain(across).enumerate() {
            builder.shape_contact(&format!("wall {k}"), wall, ball.clone(), law).unwrap();
        }
        comes_to_rest(
            &format!("wedge {method:?} {friction}"),
            run_by(&builder, 0.005, method),
            1000,
        );

        if friction > 0.5 {
            continue; // the block would jam
        }
        let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -G]);
        let block = builder.body("block", Inertia::principal(1.0, [0.01, 0.02, 0.03]));
        let block = block.at([0.0, 0.0, 0.2]).id();
        let half = [0.1, 0.2, 0.05];
        let sides = [
            plane([0.1, 0.0, 0.0], [-1.0, 0.0, 0.0]),
            plane([-0.1, 0.0, 0.0], [1.0, 0.0, 0.0]),
            (Ground, floor()),
        ];
        for (k, side) in sides.into_iter().enumerate() {
            let own = (FrameId::from(block), box_shape(half));
            builder.shape_contact(&format!("side {k}"), side, own, law).unwrap();
        }
        comes_to_rest(&format!("slot {method:?} {friction}"), run_by(&builder, 0.005, method), 150);
    }
}

/// A triangle of bars keeps its shape: a stop that is closed from the start on a hinge of it, with
/// or without friction, bears nothing and is no fault; a pendulum on it swings as without.
#[test]
fn a_stop_on_what_a_loop_locks_is_no_fault() {
    let build = |stops: usize, rubs: bool, method: Method| {
        let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -G]);
        let inertia = Inertia::principal(1.0, [0.1; 3]);
        let left = builder.body("left", inertia).at([0.25, 0.0, 0.5]).id();
        let right = builder.body("right", inertia).at([0.75, 0.0, 0.5]).id();
        let bob = builder.body("bob", inertia).at([1.0, 0.0, 1.0]).id();
        let hinges: [(&str, FrameId, FrameId, [f64; 3]); 4] = [
            ("left foot", Ground, left.into(), [0.0; 3]),
            ("right foot", Ground, right.into(), [1.0, 0.0, 0.0]),
            ("top", left.into(), right.into(), [0.5, 0.0, 1.0]),
            ("pin", left.into(), bob.into(), [0.5, 0.0, 1.0]),
        ];
        for (k, (name, parent, child, at)) in hinges.into_iter().enumerate() {
            let hinge = builder.joint(name, PairKind::Revolute, parent, child);
            let hinge = hinge.at(at).axis([0.0, 1.0, 0.0]).id().coordinate(0);
            if k < stops {
                let (lower, upper) = (Some(0.0), Some(1.5));
                builder.joint_limits(hinge, JointLimits { lower, upper, restitution: 0.0 });
            }
            if k < stops && rubs {
                builder.joint_friction(hinge, DryFriction::Effort(0.1));
            }
        }
        let mut run = run_by(&builder, 0.005, method);
        for step in 0..100 {
            run.step().unwrap_or_else(|error| panic!("{stops} stops, step {step}: {error}"));
        }
        run.state().q.clone()
    };
    let alone = build(0, false, Method::Events);
    for (stops, method) in METHODS.into_iter().flat_map(|m| [(1, m), (2, m), (3, m)]) {
        for rubs in [false, true] {
            let q = build(stops, rubs, method);
            let off = q.iter().zip(&alone).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            println!("{stops} stops, friction {rubs}, {method:?}: off by {off:.1e}");
            assert!(off < 1e-11, "{off:e}");
        }
    }
}

/// A ball falls on a box that stands on a floor without friction, with masses of several ratios.
#[test]
fn a_ball_rests_on_a_box() {
    let cases = [(0.0, 10.0), (0.3, 10.0), (0.0, 1000.0), (0.0, 0.1)];
    for (method, (friction, mass)) in METHODS.into_iter().flat_map(|m| cases.map(|own| (m, own))) {
        let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -G]);
        let lower = Inertia::principal(mass, [0.02 * mass; 3]);
        let lower = builder.body("box", lower).at([0.0, 0.0, 0.1]).id();
        let ball = Inertia::principal(1.0, [0.001; 3]);
        let ball = builder.body("ball", ball).at([0.05, 0.02, 0.2501]).id();
        let shapes = vec![
            (Ground, floor()),
            (lower.into(), box_shape([0.2, 0.2, 0.1])),
            (ball.into(), ContactShape::sphere(Vector3::zeros(), 0.05)),
        ];
        builder.shape_group("stack", shapes, &[], coulomb(friction, 0.0)).unwrap();
        let name = format!("{method:?}, {mass} kg, friction {friction}");
        comes_to_rest(&name, run_by(&builder, 0.005, method), 60);
    }
}
