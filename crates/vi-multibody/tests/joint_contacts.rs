//! Joint stops and dry friction of joints: closed forms, what is conserved, what is refused.

use crate::contact_runs::{G, run_by};
use vi_constraints::nonsmooth::{ContactStatus, Method};
use vi_constraints::setup::SetupError;
use vi_constraints::{Options, SchemeKind};
use vi_core::{Composition, State};
use vi_multibody::builder::{
    BuildError, BuiltMechanism, CoordinateId, DryFriction, Inertia, JointLimits, MechanismBuilder,
};
use vi_multibody::{FrameId::Ground, PairKind};

/// A builder with one body that slides along an axis from the origin, at a speed.
fn slider(gravity: [f64; 3], axis: [f64; 3], speed: f64) -> (MechanismBuilder, CoordinateId) {
    let mut builder = MechanismBuilder::new().gravity(gravity);
    let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
    let velocity = axis.map(|x| speed * x / length);
    let body = builder.body("carriage", Inertia::principal(2.0, [0.1; 3])).velocity(velocity).id();
    let guide = builder.joint("guide", PairKind::Prismatic, Ground, body).at([0.0; 3]).axis(axis);
    let coordinate = guide.id().coordinate(0);
    (builder, coordinate)
}

/// A rod of 1 m that hangs on a hinge, turned by an angle about −y from there.
fn pendulum(angle: f64) -> (MechanismBuilder, CoordinateId) {
    let (s, c) = (angle.sin(), angle.cos());
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -G]);
    let rod = builder.body("rod", Inertia::principal(1.0, [1e-3, 1.0 / 12.0, 1.0 / 12.0]));
    let attitude = nalgebra::Matrix3::new(s, 0.0, c, 0.0, 1.0, 0.0, -c, 0.0, s);
    let rod = rod.at([0.5 * s, 0.0, -0.5 * c]).attitude(attitude).id();
    let hinge = builder.joint("hinge", PairKind::Revolute, Ground, rod).at([0.0; 3]);
    let coordinate = hinge.axis([0.0, -1.0, 0.0]).id().coordinate(0);
    (builder, coordinate)
}

fn limits(lower: Option<f64>, upper: Option<f64>, restitution: f64) -> JointLimits {
    JointLimits { lower, upper, restitution }
}

fn refusal(builder: &MechanismBuilder, options: Options) -> SetupError {
    builder.build().unwrap().integrator(options).unwrap_err()
}

/// Between two stops without forces every motion is known.
#[test]
fn a_carriage_bounces_between_its_stops_as_it_should() {
    let (mut builder, coordinate) = slider([0.0; 3], [1.0, 2.0, 2.0], 3.0);
    builder.joint_limits(coordinate, limits(Some(-0.5), Some(1.0), 0.8));
    let mut run = run_by(&builder, 0.01, Method::Events);
    // it reaches 1.0 after 1/3 s, then −0.5 after 1.5/2.4 s more, then 1.0 after 1.5/1.92 s more
    let hits = [1.0 / 3.0, 1.0 / 3.0 + 0.625, 1.0 / 3.0 + 0.625 + 0.78125];
    let (mut found, mut impulses) = (Vec::new(), Vec::new());
    for _ in 0..200 {
        run.step().unwrap();
        for (node, contacts) in run.nonsmooth().unwrap().nodes() {
            for hit in contacts.iter().filter(|own| own.status == ContactStatus::Impact) {
                found.push(node.t);
                impulses.push(hit.impulse[0]);
            }
        }
    }
    println!("hits at {found:?}, impulses {impulses:?}");
    assert_eq!(found.len(), 3);
    for (k, (t, hit)) in found.iter().zip(hits).enumerate() {
        assert!((t - hit).abs() < 1e-12, "{t} for {hit}");
        let impulse = 2.0 * 1.8 * 3.0 * 0.8_f64.powi(k as i32);
        assert!((impulses[k] - impulse).abs() < 1e-12, "{} for {impulse}", impulses[k]);
    }
    let left = 2.0 - hits[2];
    let x = run.state().q[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
    assert!((x - (1.0 - 3.0 * 0.512 * left)).abs() < 1e-12, "{x}");
    let counts = run.state().contacts.counts;
    assert_eq!((counts.impacts, counts.events, counts.exhausted), (3, 3, 0));
    let lost = 9.0 * (1.0 - 0.8_f64.powi(6));
    assert!((counts.dissipated - lost).abs() < 1e-12, "{} for {lost}", counts.dissipated);
}

/// A stop between two nodes that are open is met: the body turns back within the step.
#[test]
fn a_stop_that_is_passed_between_two_nodes_is_met() {
    let (speed, step) = (3.0, 0.05);
    let top = 0.5 * speed * speed / G; // after 0.306 s, between the nodes 6 and 7
    let (mut builder, coordinate) = slider([0.0, 0.0, -G], [0.0, 0.0, 1.0], speed);
    builder.joint_limits(coordinate, limits(None, Some(top - 1e-4), 0.5));
    let mut run = run_by(&builder, step, Method::Events);
    let mut hits = Vec::new();
    for _ in 0..10 {
        run.step().unwrap();
        for (node, contacts) in run.nonsmooth().unwrap().nodes() {
            let hit = contacts.iter().any(|own| own.status == ContactStatus::Impact);
            hits.extend(hit.then_some(node.t));
        }
    }
    let exact = (speed - (2.0 * G * 1e-4_f64).sqrt()) / G;
    println!("met at {hits:?}, without the bend of a step at {exact}");
    assert_eq!(hits.len(), 1, "{hits:?}");
    assert!((hits[0] - exact).abs() < 2e-2 && run.state().contacts.counts.events == 1);
}

/// What lies on a stop stays there, and the stop bears its weight.
#[test]
fn a_rod_lies_still_on_its_stop() {
    for restitution in [0.0, 0.5, 1.0] {
        for method in [Method::Events, Method::Stepping] {
            let (mut builder, coordinate) = pendulum(1.0);
            builder.joint_limits(coordinate, limits(Some(0.0), None, restitution));
            let mut run = run_by(&builder, 0.01, method);
            let start = run.state().q.clone();
            let mut off = 0.0_f64;
            let mut solved = 0;
            for step in 0..1000 {
                let report = run.step().unwrap();
                solved += if step < 100 { 0 } else { report.iterations };
                let moved = run.state().q.iter().zip(&start).map(|(q, q_0)| (q - q_0).abs());
                off = off.max(moved.fold(0.0, f64::max));
            }
            let (_, contacts) = run.nonsmooth().unwrap().nodes().next().unwrap();
            let (moment, weight) = (contacts[0].impulse[0] / 0.01, 0.5 * G * 1.0_f64.sin());
            println!("e = {restitution}, {method:?}: moved {off:.1e}, {moment} N·m of {weight}");
            assert!(off < 1e-13, "it moved by {off:e}");
            assert!(solved <= 910, "900 nodes at rest take {solved} solutions of a step");
            assert!((moment - weight).abs() < 1e-10, "{moment} for {weight}");
        }
    }
}

/// With `e = 1` no energy is lost, by either method.
#[test]
fn elastic_stops_conserve_the_energy_of_impacts() {
    for method in [Method::Events, Method::Stepping] {
        let (mut builder, coordinate) = pendulum(1.2);
        builder.joint_limits(coordinate, limits(Some(-1.2), Some(0.3), 1.0));
        let mut run = run_by(&builder, 0.01, method);
        for _ in 0..300 {
            run.step().unwrap();
        }
        let counts = run.state().contacts.counts;
        println!("{method:?}: {} impacts, lost {:.1e} J", counts.impacts, counts.dissipated);
        assert!(counts.impacts >= 3, "{}", counts.impacts);
        assert!(counts.dissipated.abs() < 1e-13, "lost {:e} J", counts.dissipated);
        assert!(counts.smallest_gap.unwrap() > -1e-14, "{:?}", counts.smallest_gap);
    }
}

/// A body that an impact sets in motion does not pass a stop in the same step.
#[test]
fn a_stop_behind_a_stop_is_not_passed() {
    for method in [Method::Events, Method::Stepping] {
        let mut builder = MechanismBuilder::new();
        let inertia = Inertia::principal(1.0, [0.1; 3]);
        let x = [1.0, 0.0, 0.0];
        let first = builder.body("first", inertia).velocity([2.0, 0.0, 0.0]).id();
        let second = builder.body("second", inertia).velocity([2.0, 0.0, 0.0]).id();
        let rail = builder.joint("rail", PairKind::Prismatic, Ground, first).at([0.0; 3]).axis(x);
        let rail = rail.id().coordinate(0);
        let slot = builder.joint("slot", PairKind::Prismatic, first, second).at([0.0; 3]).axis(x);
        let slot = slot.id().coordinate(0);
        builder.joint_limits(rail, limits(None, Some(0.005), 0.5));
        builder.joint_limits(slot, limits(Some(-1e-3), Some(1e-3), 0.0));
        let mut run = run_by(&builder, 0.01, method);
        for _ in 0..20 {
            run.step().unwrap();
        }
        let counts = run.state().contacts.counts;
        println!("{method:?}: {counts:?}");
        assert!(counts.smallest_gap.unwrap() > -1e-14, "{:?}", counts.smallest_gap);
        assert!(counts.impacts >= 1);
    }
}

/// Impacts that follow one another ever faster end in rest, in finite work.
#[test]
fn bounces_end_in_rest() {
    for method in [Method::Events, Method::Stepping] {
        let (mut builder, coordinate) = slider([0.0, 0.0, -G], [0.0, 0.0, 1.0], 0.0);
        builder.joint_limits(coordinate, limits(Some(-0.3), None, 0.5));
        let mut run = run_by(&builder, 0.01, method);
        for _ in 0..200 {
            run.step().unwrap();
        }
        let gap = run.state().q[2] + 0.3;
        let counts = run.state().contacts.counts;
        println!("{method:?}: gap {gap:e}, {counts:?}");
        assert!(gap.abs() < 1e-15, "{gap:e}");
        assert!(counts.impacts < 40, "{}", counts.impacts);
    }
}

/// Dry friction holds without creep, or brakes as Coulomb says.
#[test]
fn friction_holds_or_brakes() {
    let (angle, step) = (0.4_f64, 0.01);
    let gravity = [G * angle.sin(), 0.0, -G * angle.cos()];
    let weight = 2.0 * gravity[0];
    for (part, t) in [(1.1, 10.0), (0.6, 1.0)] {
        let (mut builder, coordinate) = slider(gravity, [1.0, 0.0, 0.0], 0.0);
        builder.joint_friction(coordinate, DryFriction::Effort(part * weight));
        let mut run = run_by(&builder, step, Method::Events);
        for _ in 0..(t / step) as usize {
            run.step().unwrap();
        }
        let (x, exact) = (run.state().q[0], 0.5 * gravity[0] * (1.0_f64 - part).max(0.0) * t * t);
        println!("friction of {part} of the weight: {x} m after {t} s, exact {exact}");
        assert!((x - exact).abs() < 1e-12, "{x} for {exact}");
    }
}

/// The same by the force across the guide: `μ m g cos α`.
#[test]
fn friction_follows_the_force_across_the_joint() {
    let (angle, step, coefficient) = (0.4_f64, 0.01, 0.25);
    let gravity = [G * angle.sin(), 0.0, -G * angle.cos()];
    let (mut builder, coordinate) = slider(gravity, [1.0, 0.0, 0.0], 0.0);
    let friction = DryFriction::Coefficient { coefficient, radius: 1.0 };
    builder.joint_friction(coordinate, friction);
    let mut run = run_by(&builder, step, Method::Events);
    for _ in 0..100 {
        run.step().unwrap();
    }
    let exact = 0.5 * G * (angle.sin() - coefficient * angle.cos());
    let x = run.state().q[0];
    println!("{x} m, exact {exact}");
    assert!((x - exact).abs() < 1e-12, "{x} for {exact}");
}

/// A pendulum with friction of its pin, from the force in the pin: order 2 while it swings.
#[test]
fn friction_of_a_pin_is_of_order_two() {
    let end = |step: f64| {
        let (mut builder, coordinate) = pendulum(1.2);
        let friction = DryFriction::Coefficient { coefficient: 0.3, radius: 0.05 };
        builder.joint_friction(coordinate, friction);
        let mut run = run_by(&builder, step, Method::Events);
        for _ in 0..(1.6 / step).round() as usize {
            run.step().unwrap();
        }
        run.state().q[0]
    };
    let found = [0.02, 0.01, 0.005, 0.0025].map(end);
    let changes = [found[1] - found[0], found[2] - found[1], found[3] - found[2]];
    let orders = [changes[0] / changes[1], changes[1] / changes[2]].map(|r| r.abs().log2());
    println!("{found:?}: orders {orders:?}");
    assert!(orders.iter().all(|order| *order > 1.7), "{orders:?}");
}

/// A spring that the step does not resolve does not keep the impulses from converging.
#[test]
fn stops_beside_stiff_springs_converge() {
    for stiffness in [1e4, 1e6, 1e8] {
        let (mut builder, coordinate) = slider([0.0, 0.0, -G], [0.0, 0.0, 1.0], 0.0);
        builder.joint_limits(coordinate, limits(Some(-0.1), None, 0.5));
        builder.joint_spring(coordinate, stiffness, -0.2);
        let mut run = run_by(&builder, 0.01, Method::Stepping);
        for _ in 0..100 {
            run.step().unwrap();
        }
        let counts = run.state().contacts.counts;
        println!("{stiffness:e} N/m: at most {} solutions of a step", counts.most_iterations);
        assert!(counts.smallest_gap.unwrap() > -1e-13, "{:?}", counts.smallest_gap);
        assert!(counts.most_iterations <= 20, "{}", counts.most_iterations);
    }
}

/// The next steps depend on the state alone, to the bit.
#[test]
fn a_stored_state_continues_to_the_bit() {
    let begin = || {
        let (mut builder, coordinate) = pendulum(1.2);
        builder.joint_limits(coordinate, limits(Some(-1.5), Some(0.2), 0.6));
        builder.joint_friction(coordinate, DryFriction::Effort(0.2));
        run_by(&builder, 0.01, Method::Events)
    };
    let mut run = begin();
    let mut differ = false;
    for stored in [7, 60, 61, 95, 130] {
        while run.state().step < stored {
            run.step().unwrap();
        }
        let text = serde_json::to_string(run.state()).unwrap();
        let mut other = begin();
        other.resume(serde_json::from_str::<State>(&text).unwrap()).unwrap();
        for _ in 0..40 {
            run.step().unwrap();
            run.observe().unwrap();
            other.step().unwrap();
            assert_eq!(run.state(), other.state(), "from step {stored}");
        }
        differ |= !run.state().contacts.contacts.is_empty();
    }
    assert!(differ);
}

/// An old state has no contacts.
#[test]
fn a_state_without_contacts_is_read() {
    let state = State::new(0.0, vec![1.0], vec![0.5]);
    let mut value = serde_json::to_value(&state).unwrap();
    value.as_object_mut().unwrap().remove("contacts").unwrap();
    assert_eq!(serde_json::from_value::<State>(value).unwrap(), state);
}

#[test]
fn what_has_no_contacts_is_refused_by_name() {
    let (mut builder, coordinate) = pendulum(1.0);
    builder.joint_limits(coordinate, limits(Some(-1.0), None, 0.5));
    for scheme in [SchemeKind::Constrained, SchemeKind::Dalembert, SchemeKind::Reduced] {
        let error = refusal(&builder, Options::new(scheme, 0.01));
        println!("{error}");
        assert!(error.to_string().contains(scheme.name()), "{error}");
    }
    let composed = Options::new(SchemeKind::Nodal, 0.01).composition(Composition::KahanLi9);
    let stages = vi_core::galerkin::Stages::of_order(4).unwrap();
    let galerkin = Options::new(SchemeKind::Nodal, 0.01).galerkin(stages);
    let backward = Options::new(SchemeKind::Nodal, -0.01);
    for options in [composed, galerkin, backward] {
        let error = refusal(&builder, options);
        println!("{error}");
        assert!(matches!(error, SetupError::Contacts { .. }), "{error}");
    }
}

#[test]
fn bad_limits_and_frictions_are_refused() {
    let built = |limits: JointLimits| {
        let (mut builder, coordinate) = pendulum(1.0);
        builder.joint_limits(coordinate, limits);
        builder.build()
    };
    let error = |built: Result<BuiltMechanism, BuildError>| {
        let error = built.unwrap_err();
        println!("{error}");
        error
    };
    let found = error(built(limits(Some(1.0), Some(-1.0), 0.5)));
    assert!(matches!(found, BuildError::Limits { .. }));
    for restitution in [-0.1, 1.2] {
        let found = error(built(limits(Some(-1.0), None, restitution)));
        assert!(matches!(found, BuildError::Restitution { .. }));
    }
    let found = error(built(limits(Some(f64::NAN), None, 0.0)));
    assert!(matches!(found, BuildError::NotFinite { .. }));
    let (mut builder, coordinate) = pendulum(1.0);
    builder.joint_friction(coordinate, DryFriction::Effort(-0.1));
    assert!(matches!(error(builder.build()), BuildError::Negative { .. }));
    let (mut builder, coordinate) = pendulum(1.0);
    builder.joint_limits(coordinate, limits(Some(0.1), Some(1.0), 0.5));
    let found = refusal(&builder, Options::new(SchemeKind::Nodal, 0.01));
    println!("{found}");
    assert!(
        matches!(&found, SetupError::Overlap { element, depth } if element == "hinge" && (depth - 0.1).abs() < 1e-15)
    );
}

/// Parallel stops on one coordinate share what is not unique; a prescribed coordinate cannot be
/// stopped.
#[test]
fn redundant_stops_and_stops_against_what_is_prescribed() {
    let (mut builder, coordinate) = slider([0.0, 0.0, -G], [0.0, 0.0, 1.0], 0.0);
    builder.joint_limits(coordinate, limits(Some(-0.1), None, 0.5));
    builder.joint_limits(coordinate, limits(Some(-0.1), None, 0.5));
    let mut run = run_by(&builder, 0.01, Method::Events);
    for _ in 0..100 {
        run.step().unwrap();
    }
    assert!((run.state().q[2] + 0.1).abs() < 1e-14, "{}", run.state().q[2] + 0.1);
    let (mut builder, coordinate) = slider([0.0; 3], [0.0, 0.0, 1.0], 0.5);
    builder.motion("drive", coordinate, |t| [0.5 * t, 0.5, 0.0]);
    builder.joint_limits(coordinate, limits(None, Some(0.1), 0.5));
    let mut run = run_by(&builder, 0.01, Method::Events);
    let error = (0..40).find_map(|_| run.step().err()).expect("it cannot go on");
    println!("{error}; {}", error.remedy());
    assert!(error.to_string().contains("guide"), "{error}");
    assert!((run.state().t - 0.2).abs() < 0.011, "{}", run.state().t);
}
