//! Vibrations about steady rotations against closed forms.
#![allow(clippy::unwrap_used)] // a test

use nalgebra::Vector3;
use vi_core::Quadrature;
use vi_multibody::builder::{BuiltMechanism, Inertia, MechanismBuilder};
use vi_multibody::{FrameId::Ground, PairKind};
use vi_statics::{
    MotionKind, RotationError, StaticProblem, SteadyRotation, Vibrations, vibrations,
};

fn about(built: BuiltMechanism, rotation: &SteadyRotation) -> (Vec<f64>, Vibrations) {
    let system = built.system(Quadrature::Midpoint);
    rotation.check(&system, &built.mechanism, &built.mechanism.initial_configuration()).unwrap();
    let mut problem = StaticProblem::new(system, built.mechanism).in_rotation(rotation);
    let point = problem.equilibrate().unwrap();
    (point.q, vibrations(&mut problem).unwrap())
}

fn z(speed: f64) -> SteadyRotation {
    SteadyRotation { point: Vector3::zeros(), velocity: Vector3::new(0.0, 0.0, speed) }
}

#[test]
fn a_bead_on_a_turning_rod_vibrates_as_its_closed_form() {
    // m r̈ = …: ω² = k/m − Ω² + 4 Ω² m r²/(J + m r²), k (r − r_0) = m r Ω²
    let (m, k, r0, hub) = (0.7, 40.0, 0.8, 0.3);
    for speed in [0.0, 1.0, 3.0, 6.0] {
        let mut builder = MechanismBuilder::new();
        let rod = builder.body("rod", Inertia::principal(1.0, [0.2, 0.2, hub])).id();
        let bead = Inertia::principal(m, [0.15, 0.15, 0.2]);
        let bead = builder.body("bead", bead).at([r0, 0.0, 0.0]).id();
        builder.joint("hub", PairKind::Revolute, Ground, rod).at([0.0; 3]).axis([0.0, 0.0, 1.0]);
        let slide = builder.joint("slide", PairKind::Prismatic, rod, bead);
        let slide = slide.at([r0, 0.0, 0.0]).axis([1.0, 0.0, 0.0]).id();
        builder.joint_spring(slide.coordinate(0), k, 0.0);
        let (q, found) = about(builder.build().unwrap(), &z(speed));
        let r = r0 * k / (k - m * speed * speed);
        let inertia = hub + 0.2 + m * r * r;
        let square = k / m - speed * speed + 4.0 * speed * speed * m * r * r / inertia;
        let swing = found.get(MotionKind::Vibration, 0).unwrap();
        let (place, error) = (q[12] - r, swing.value.im / square.sqrt() - 1.0);
        println!(
            "{speed} rad/s: r off by {place:.1e}, ω off by {error:.1e}, {:.1e}",
            swing.residual
        );
        assert!(place.abs() < 1e-11 && error.abs() < 1e-11);
        let counts =
            [MotionKind::Growth, MotionKind::Rigid, MotionKind::Vibration, MotionKind::Decay];
        assert_eq!(counts.map(|motion| found.count(motion)), [0, 1, 1, 0]);
    }
}

#[test]
fn a_body_that_spins_about_its_middle_axis_tumbles_at_eulers_rate() {
    let [a, b, c] = [1.0, 2.0, 2.5];
    for (inertia, stable) in [([b, c, a], true), ([a, c, b], false), ([a, b, c], true)] {
        let mut builder = MechanismBuilder::new();
        builder.body("body", Inertia::principal(2.0, inertia));
        let speed = 4.0;
        let (_, found) = about(builder.build().unwrap(), &z(speed));
        // about e_3: λ² = −Ω² (J_3 − J_1)(J_3 − J_2)/(J_1 J_2)
        let [j1, j2, j3] = inertia;
        let square = speed * speed * (j3 - j1) * (j3 - j2) / (j1 * j2);
        let growth = found.get(MotionKind::Growth, 0).map(|v| v.value);
        println!("spin about {j3} of {inertia:?}: {growth:?}");
        assert_eq!(found.count(MotionKind::Growth), usize::from(!stable));
        if stable {
            let near = (0..found.count(MotionKind::Vibration)).map(|k| {
                (found.get(MotionKind::Vibration, k).unwrap().value.im - square.sqrt()).abs()
            });
            assert!(near.fold(f64::INFINITY, f64::min) < 1e-9 * speed);
        } else {
            assert!((growth.unwrap().re - (-square).sqrt()).abs() < 1e-10 * speed);
        }
    }
}

#[test]
fn what_does_not_turn_with_the_system_is_refused() {
    let arm = |kind: PairKind, gravity: [f64; 3], axis: [f64; 3]| -> Result<(), RotationError> {
        let mut builder = MechanismBuilder::new().gravity(gravity);
        let arm = builder.body("arm", Inertia::principal(1.0, [0.1; 3])).at([0.5, 0.0, 0.0]).id();
        let hinge = builder.joint("hinge", kind, Ground, arm).at([0.0; 3]).axis(axis);
        if kind == PairKind::Universal {
            hinge.second_axis(if axis[2] == 0.0 { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] });
        }
        let built = builder.build().unwrap();
        let q = built.mechanism.initial_configuration();
        z(2.0).check(&built.system(Quadrature::Midpoint), &built.mechanism, &q)
    };
    let (down, aside) = ([0.0, 0.0, -9.81], [0.0, -9.81, 0.0]);
    assert_eq!(arm(PairKind::Revolute, down, [0.0, 0.0, 1.0]), Ok(()));
    assert_eq!(arm(PairKind::Spherical, down, [0.0, 0.0, 1.0]), Ok(()));
    assert_eq!(
        arm(PairKind::Revolute, aside, [0.0, 0.0, 1.0]),
        Err(RotationError::Force("the weight".into()))
    );
    let hinge = Err(RotationError::Constraint("hinge".into()));
    assert_eq!(arm(PairKind::Revolute, down, [0.0, 1.0, 0.0]), hinge);
    assert_eq!(
        arm(PairKind::Universal, down, [0.0, 0.0, 1.0]),
        Ok(()),
        "its first axis is the ground's"
    );
    assert_eq!(
        arm(PairKind::Universal, down, [1.0, 0.0, 0.0]),
        hinge,
        "it flaps about x of the ground"
    );
}
