//! Circulatory forces: dampers to the ground of what rotates, followers, and modes beside them,
//! against closed forms.

use crate::common;

use common::{load, straight, vector};
use nalgebra::{Complex, Vector3};
use vi_beam::{BeamModel, ElementKind, Section};
use vi_core::Quadrature;
use vi_multibody::builder::{BuiltMechanism, Inertia, MechanismBuilder};
use vi_multibody::joint_force::Viscous;
use vi_multibody::{FrameId::Ground, PairKind};
use vi_rigid::load::LoadKind;
use vi_statics::{
    MotionKind, StaticLinearization, StaticProblem, SteadyRotation, Vibrations, vibrations,
};

fn z(speed: f64) -> SteadyRotation {
    SteadyRotation { point: Vector3::zeros(), velocity: Vector3::new(0.0, 0.0, speed) }
}

fn about(built: BuiltMechanism, rotation: &SteadyRotation) -> Vibrations {
    let system = built.system(Quadrature::Midpoint);
    let mut problem = StaticProblem::new(system, built.mechanism).in_rotation(rotation);
    problem.equilibrate().unwrap();
    vibrations(&mut problem).unwrap()
}

fn counts(found: &Vibrations) -> [usize; 4] {
    [MotionKind::Growth, MotionKind::Rigid, MotionKind::Vibration, MotionKind::Decay]
        .map(|m| found.count(m))
}

/// `m z̈ + c ż + k z = 0` in space, whatever the speed: `λ = −c/2m ± i(ω ± Ω)` in the frame that
/// rotates.
#[test]
fn dampers_to_the_ground_do_not_know_the_speed() {
    let (m, k, c) = (1.5, 150.0, 1.2);
    for along_joint in [true, false] {
        for speed in [0.5, 20.0] {
            let mut builder = MechanismBuilder::new();
            let disk = Inertia::principal(m, [0.01, 0.01, 0.02]);
            let disk = builder.body("disk", disk).id();
            let plane = builder.joint("plane", PairKind::Planar, Ground, disk);
            let plane = plane.at([0.0; 3]).axis([0.0, 0.0, 1.0]).id();
            builder.spring([0.0; 3], disk.point([0.0; 3]), k);
            if along_joint {
                for i in [0, 1] {
                    builder.joint_force(plane.coordinate(i), Viscous(c));
                }
            } else {
                let far = 1e4;
                for at in [[far, 0.0, 0.0], [0.0, far, 0.0]] {
                    builder.damper(at, disk.point([0.0; 3]), c);
                }
            }
            let found = about(builder.build().unwrap(), &z(speed));
            let omega = (k / m - (0.5 * c / m).powi(2)).sqrt();
            let mut exact = [(omega - speed).abs(), omega + speed];
            exact.sort_by(f64::total_cmp);
            let mut worst = 0.0_f64;
            for (i, exact) in exact.into_iter().enumerate() {
                let value = found.get(MotionKind::Vibration, i).unwrap().value;
                worst = worst.max((value.im - exact).abs()).max((value.re + 0.5 * c / m).abs());
            }
            println!("joint {along_joint}, {speed} rad/s: λ off by {worst:.1e}");
            assert!(worst < 1e-6, "{worst:e}");
            assert_eq!(counts(&found), [0, 1, 2, 0]);
        }
    }
}

/// The same joint with the ground as its child: its displacements lie along axes of the disk, and
/// its dampers turn with the disk. `λ² + (c/m + 2iΩ) λ + k/m − Ω² = 0`: unstable above the critical
/// speed.
#[test]
fn dampers_along_axes_that_turn_are_internal() {
    let (m, k, c) = (1.5, 150.0, 1.2);
    for speed in [5.0, 20.0] {
        let mut builder = MechanismBuilder::new();
        let disk = builder.body("disk", Inertia::principal(m, [0.01, 0.01, 0.02])).id();
        let plane = builder.joint("plane", PairKind::Planar, disk, Ground);
        let plane = plane.at([0.0; 3]).axis([0.0, 0.0, 1.0]).id();
        builder.spring([0.0; 3], disk.point([0.0; 3]), k);
        for i in [0, 1] {
            builder.joint_force(plane.coordinate(i), Viscous(c));
        }
        let found = about(builder.build().unwrap(), &z(speed));
        let half = Complex::new(0.5 * c / m, speed);
        let root = (half * half - (k / m - speed * speed)).sqrt();
        for exact in [-half + root, -half - root] {
            let motion = if exact.re > 0.0 { MotionKind::Growth } else { MotionKind::Vibration };
            let values = (0..found.count(motion)).map(|i| found.get(motion, i).unwrap().value);
            let off =
                values.map(|value| (value.re - exact.re).abs() + (value.im - exact.im.abs()).abs());
            let off = off.fold(f64::INFINITY, f64::min);
            println!("{speed} rad/s: {exact:.6} off by {off:.1e}");
            assert!(off < 1e-9);
        }
        assert_eq!(found.count(MotionKind::Growth), usize::from(speed > 10.0));
    }
}

/// A damper within what rotates adds no circulatory term: `m λ² + c λ + m ω² = 0` of the bead on a
/// turning rod.
#[test]
fn dampers_between_bodies_turn_with_them() {
    let (m, k, c, r0, hub, speed) = (0.7, 40.0, 0.9, 0.8, 0.3, 3.0);
    for along_joint in [true, false] {
        let mut builder = MechanismBuilder::new();
        let rod = builder.body("rod", Inertia::principal(1.0, [0.2, 0.2, hub])).id();
        let bead = Inertia::principal(m, [0.15, 0.15, 0.2]);
        let bead = builder.body("bead", bead).at([r0, 0.0, 0.0]).id();
        builder.joint("hub", PairKind::Revolute, Ground, rod).at([0.0; 3]).axis([0.0, 0.0, 1.0]);
        let slide = builder.joint("slide", PairKind::Prismatic, rod, bead);
        let slide = slide.at([r0, 0.0, 0.0]).axis([1.0, 0.0, 0.0]).id();
        builder.joint_spring(slide.coordinate(0), k, 0.0);
        if along_joint {
            builder.joint_force(slide.coordinate(0), Viscous(c));
        } else {
            builder.damper(rod.point([0.0; 3]), bead.point([0.0; 3]), c);
        }
        let found = about(builder.build().unwrap(), &z(speed));
        let r = r0 * k / (k - m * speed * speed);
        let inertia = hub + 0.2 + m * r * r;
        let square = k / m - speed * speed + 4.0 * speed * speed * m * r * r / inertia;
        let value = found.get(MotionKind::Vibration, 0).unwrap().value;
        let exact = (square - (0.5 * c / m).powi(2)).sqrt();
        println!("joint {along_joint}: λ = {value:.10}, ω = {exact:.10}");
        assert!((value.im - exact).abs() < 1e-9 && (value.re + 0.5 * c / m).abs() < 1e-9);
        assert_eq!(counts(&found), [0, 1, 1, 0]);
    }
}

/// A column, `EI = 1`, under a tip force that follows it.
fn beck(force: f64, elements: usize, kind: ElementKind) -> StaticProblem {
    let section = Section::new([1e6, 1e6, 1e6, 1.0, 1e3, 1e3], [1.0, 1e-6, 1e-6, 0.0]).unwrap();
    let mut model = BeamModel::new(Vector3::zeros());
    let beam = common::beam(&mut model, &straight(1.0, elements), section, kind);
    model.clamp(0);
    let tip = beam.nodes.end - 1;
    let follower = load(tip, LoadKind::Follower, vector(0.0, 0.0, -force), Vector3::zeros());
    let mut problem = common::problem(&model, &model.mechanism(), vec![follower]);
    problem.solve(&[1.0], &vi_statics::StaticSettings::default()).unwrap();
    problem
}

/// Beck's column: `2 + 2 cosh a cos b ω²/… = 0`, 5.1758 and 18.587 rad/s at `P = 10`; flutter at
/// 20.05.
#[test]
fn an_undamped_follower_is_circulatory() {
    let mut problem = beck(10.0, 16, ElementKind::Helicoidal);
    let linear = StaticLinearization::all(&mut problem).unwrap();
    assert!(linear.is_circulatory().unwrap());
    let found = linear.vibrations().unwrap();
    let [a, b] = [0, 1].map(|k| found.get(MotionKind::Vibration, k).unwrap().value);
    println!("P = 10: {a:.6}, {b:.6}");
    assert_eq!(found.count(MotionKind::Growth), 0);
    assert!((a.im - 5.1758).abs() < 2e-3 && (b.im - 18.587).abs() < 1e-2);
    assert!(a.re == 0.0 && b.re == 0.0, "no force takes energy out");
    for (force, growing) in [(19.8, 0), (20.3, 1)] {
        let mut problem = beck(force, 16, ElementKind::Helicoidal);
        let found = vibrations(&mut problem).unwrap();
        println!("P = {force}: growing {}", found.count(MotionKind::Growth));
        assert_eq!(found.count(MotionKind::Growth), growing, "flutter begins at 20.05");
    }
    let mut dead = {
        let section = Section::new([1e3, 1e3, 1e3, 1.0, 2.0, 1.0], [1.0, 1e-3, 1e-3, 0.0]).unwrap();
        let mut model = BeamModel::new(Vector3::zeros());
        model.add_beam("beam", &straight(1.0, 8), section).unwrap();
        model.clamp(0);
        let loads = vec![common::dead(8, vector(-0.3, 0.1, 0.05))];
        common::problem(&model, &model.mechanism(), loads)
    };
    dead.solve(&[1.0], &vi_statics::StaticSettings::default()).unwrap();
    assert!(!StaticLinearization::all(&mut dead).unwrap().is_circulatory().unwrap());
}

/// The same of a large system, whose lowest modes are found in a subspace.
#[test]
fn an_undamped_follower_of_a_large_system() {
    for force in [10.0, 20.6] {
        let mut problem = beck(force, 60, ElementKind::MeanDirectors);
        let linear = StaticLinearization::lowest(&mut problem, 3).unwrap();
        let found = linear.vibrations().unwrap();
        println!(
            "P = {force}: growing {}, {} in all",
            found.count(MotionKind::Growth),
            found.len()
        );
        assert_eq!(found.count(MotionKind::Growth), usize::from(force > 20.05));
        if force < 20.0 {
            let [a, b] = [0, 1].map(|k| found.get(MotionKind::Vibration, k).unwrap().value.im);
            assert!((a - 5.1758).abs() < 1e-2 && (b - 18.587).abs() < 5e-2, "{a} {b}");
        }
    }
}

/// Ziegler's double pendulum, masses 2 and 1 at the ends of its rods, springs `k`: flutter at
/// `(7/2 − √2) k/l`.
#[test]
fn a_follower_on_rigid_bodies_is_circulatory() {
    let found = |force: f64| {
        let mut builder = MechanismBuilder::new();
        let mass = |m: f64| Inertia::principal(m, [1e-9; 3]);
        let lower = builder.body("lower", mass(2.0)).at([1.0, 0.0, 0.0]).id();
        let upper = builder.body("upper", mass(1.0)).at([2.0, 0.0, 0.0]).id();
        let hinge = |name: &str, k: usize, builder: &mut MechanismBuilder| {
            let (parent, child) = if k == 0 { (Ground, lower) } else { (lower.into(), upper) };
            let joint = builder.joint(name, PairKind::Revolute, parent, child);
            let joint = joint.at([k as f64, 0.0, 0.0]).axis([0.0, 0.0, 1.0]).id();
            builder.joint_spring(joint.coordinate(0), 1.0, 0.0);
        };
        hinge("a", 0, &mut builder);
        hinge("b", 1, &mut builder);
        builder.load(upper).force([-force, 0.0, 0.0]).follower();
        let built = builder.build().unwrap();
        let mut problem = StaticProblem::new(built.system(Quadrature::Midpoint), built.mechanism);
        problem.equilibrate().unwrap();
        vibrations(&mut problem).unwrap()
    };
    let critical = 3.5 - 2.0_f64.sqrt();
    for (part, growing) in [(0.0, 0), (0.99, 0), (1.01, 1)] {
        let found = found(part * critical);
        println!("P = {part} of {critical:.4}: {:?}", counts(&found));
        assert_eq!(found.count(MotionKind::Growth), growing);
    }
}

/// A shaft with `EI = 1`, 1.44 in two bearings:
/// `λ⁴ + λ²(ω₁² + ω₂² + 2Ω²) + (ω₁² − Ω²)(ω₂² − Ω²) = 0`. Its free spin has a round-off of the size
/// of `λ²`.
#[test]
fn no_whirl_is_lost_beside_a_free_spin() {
    for speed in [5.0, 9.8, 11.7, 12.0, 15.0] {
        let section =
            Section::new([1e6, 1e6, 1e6, 1.0, 1.44, 1e3], [1.0, 1e-7, 1e-7, 0.0]).unwrap();
        let mut model = BeamModel::new(Vector3::zeros());
        let kind = ElementKind::Helicoidal;
        let beam = common::beam(&mut model, &straight(1.0, 16), section, kind);
        let end = beam.nodes.end - 1;
        model.join(PairKind::Spherical, None, 0, &Vector3::zeros(), &Vector3::x());
        let small = vi_rigid::inertia::PrincipalInertia::new([1e-6; 3]).unwrap();
        let roller = model.add_frame(vi_multibody::mechanism::BodySpec {
            name: "roller".into(),
            body: Some(vi_rigid::body::RigidBody::from_inertia(1e-3, &small).unwrap()),
            center: Vector3::x(),
            triad: nalgebra::Matrix3::identity(),
            velocity: Vector3::zeros(),
            omega: Vector3::zeros(),
        });
        model.join(PairKind::Cylindrical, None, roller, &Vector3::x(), &Vector3::x());
        model.join(PairKind::Spherical, Some(roller), end, &Vector3::x(), &Vector3::x());
        let velocity = Vector3::new(speed, 0.0, 0.0);
        let rotation = SteadyRotation { point: Vector3::zeros(), velocity };
        let mechanism = model.mechanism();
        let mut problem = common::problem(&model, &mechanism, vec![]).in_rotation(&rotation);
        problem.equilibrate().unwrap();
        let found = vibrations(&mut problem).unwrap();
        let (a, b) = (std::f64::consts::PI.powi(4), 1.44 * std::f64::consts::PI.powi(4));
        let (sum, product) =
            (a + b + 2.0 * speed * speed, (a - speed * speed) * (b - speed * speed));
        let square = -0.5 * sum + (0.25 * sum * sum - product).sqrt(); // the softer λ²
        let value = if square > 0.0 {
            found.get(MotionKind::Growth, 0).map_or(f64::NAN, |found| found.value.re)
        } else {
            found.get(MotionKind::Vibration, 0).map_or(f64::NAN, |found| found.value.im)
        };
        let exact = square.abs().sqrt();
        println!("{speed} rad/s: {value:.6}, closed form {exact:.6}, {:?}", counts(&found));
        assert!((value / exact - 1.0).abs() < 0.03, "shear and rotary inertia apart");
        assert_eq!(found.count(MotionKind::Growth), usize::from(square > 0.0));
        assert_eq!(found.count(MotionKind::Rigid), 2, "the spins of shaft and roller");
    }
}
