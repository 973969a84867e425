//! What the builder refuses, by name and with a reason.

use crate::builder::{BODY, Z, pair};
use nalgebra::Matrix3;
use vi_multibody::builder::{BodyId, BuildError, Inertia, MechanismBuilder};
use vi_multibody::joint::FrameId;
use vi_multibody::{FrameId::Ground, PairKind};
use vi_rigid::{Shape, TimeHistory};

/// What a builder says after a change of a valid mechanism.
fn message(change: impl FnOnce(&mut MechanismBuilder, BodyId)) -> String {
    let (mut builder, second) = pair(PairKind::Revolute);
    builder.build().unwrap();
    change(&mut builder, second);
    builder.build().unwrap_err().to_string()
}

#[test]
fn what_makes_no_sense_is_refused_by_name() {
    let thin = Inertia::principal(1.0, [1.0, 0.1, 0.2]);
    let other = || {
        let mut other = MechanismBuilder::new();
        (0..9).map(|_| other.body("other", BODY).id()).last().unwrap()
    };
    let stranger = {
        let mut other = MechanismBuilder::new();
        let id = |_| other.particle("p", 1.0, [0.0; 3], [0.0; 3]);
        (0..3).map(id).last().unwrap()
    };
    let cases: Vec<(&str, String)> = vec![
        (
            "body `x`: the mass is 0; it must be positive",
            message(|b, _| {
                b.body("x", Inertia::principal(0.0, [1.0; 3]));
            }),
        ),
        (
            "body `x`: J1 = 1 kg·m² exceeds J2 + J3 = 0.30000000000000004 kg·m² by 7.000e-1 kg·m²; no distribution of mass has such an inertia",
            message(|b, _| {
                b.body("x", thin);
            }),
        ),
        (
            "body `x`: the density is -1; it must be positive",
            message(|b, _| {
                b.body("x", Inertia::shape(Shape::Sphere { radius: 1.0 }, -1.0));
            }),
        ),
        (
            "body `x`: a number of the position is NaN; it must be finite",
            message(|b, _| {
                b.body("x", BODY).at([0.0, f64::NAN, 0.0]);
            }),
        ),
        (
            "body `x`: the matrix of its attitude misses a rotation by 3.0e0; its columns must be orthonormal and right-handed",
            message(|b, _| {
                b.body("x", BODY).attitude(2.0 * Matrix3::identity());
            }),
        ),
        (
            "particle `p`: the mass is -1; it must be positive",
            message(|b, _| {
                b.particle("p", -1.0, [0.0; 3], [0.0; 3]);
            }),
        ),
        (
            "joint `j` refers to body 8, but there are 2; use the id that this builder returned",
            message(|b, _| {
                b.joint("j", PairKind::Spherical, Ground, other());
            }),
        ),
        (
            "joint `j` connects a component with itself; give it two different components",
            message(|b, second| {
                b.joint("j", PairKind::Spherical, second, second);
            }),
        ),
        (
            "joint `j`: its position is missing; add `.at([x, y, z])`",
            message(|b, second| {
                b.joint("j", PairKind::Spherical, Ground, second);
            }),
        ),
        (
            "joint `j`: a revolute joint needs an axis; add `.axis([x, y, z])`",
            message(|b, second| {
                b.joint("j", PairKind::Revolute, Ground, second).at([0.0; 3]);
            }),
        ),
        (
            "joint `j`: the axis has length zero; give a direction, such as [0, 0, 1]",
            message(|b, second| {
                b.joint("j", PairKind::Revolute, Ground, second).at(Z).axis([0.0; 3]);
            }),
        ),
        (
            "joint `j`: its second axis is parallel to the first; give one across it",
            message(|b, second| {
                let joint = b.joint("j", PairKind::Universal, Ground, second).at(Z);
                joint.axis(Z).second_axis([0.0, 0.0, 2.0]);
            }),
        ),
        (
            "joint `j`: a number of the position is inf; it must be finite",
            message(|b, second| {
                let joint = b.joint("j", PairKind::Spherical, Ground, second);
                joint.at([f64::INFINITY, 0.0, 0.0]);
            }),
        ),
        (
            "joint `j`: 2 rate(s) for 1 degree(s) of freedom",
            message(|b, _| {
                let x = b.body("x", BODY).id();
                b.joint("j", PairKind::Revolute, Ground, x).at(Z).axis(Z).rates(&[1.0, 2.0]);
            }),
        ),
        (
            "bar `rod`: its ends coincide; move one, or use a spherical joint",
            message(|b, _| {
                let p = b.particle("p", 1.0, Z, [0.0; 3]);
                b.bar("rod", Z, p);
            }),
        ),
        (
            "bar `rod`: the length is 0; it must be positive",
            message(|b, _| {
                let p = b.particle("p", 1.0, Z, [0.0; 3]);
                b.bar_of_length("rod", [0.0; 3], p, 0.0);
            }),
        ),
        (
            "bar `rod` refers to particle 2, but there are 0; use the id that this builder returned",
            message(|b, _| b.bar("rod", Z, stranger)),
        ),
        (
            "constraint `rod`: its ends coincide; move one, or use a spherical joint",
            message(|b, second| b.distance("rod", Z, second.point_at(Z))),
        ),
        (
            "spring 0 between points: its ends coincide, its force has no direction; move one",
            message(|b, second| {
                b.spring(Z, second.point_at(Z), 3.0).natural_length(1.0);
            }),
        ),
        (
            "damper 0 between points: its ends coincide, its force has no direction; move one",
            message(|b, second| {
                b.damper(Z, second.point_at(Z), 2.0);
            }),
        ),
        (
            "constraint `rod`: a distance to a point mass is a bar; use `bar`",
            message(|b, second| {
                let p = b.particle("p", 1.0, Z, [0.0; 3]);
                b.distance("rod", second.point(Z), p);
            }),
        ),
        (
            "constraint `guide`: the direction has length zero; give a direction, such as [0, 0, 1]",
            message(|b, second| b.point_on_plane("guide", Ground, second, Z, [0.0; 3])),
        ),
        (
            "force on joint `j`: a spherical joint has no coordinate 0; it has none: use springs between points, or loads",
            message(|b, second| {
                let x = b.body("x", BODY).id();
                let j = b.joint("j", PairKind::Spherical, second, x).at([0.0; 3]).id();
                b.motor(j.coordinate(0), |_| 1.0);
            }),
        ),
        (
            "constraint `gear`: a planar joint has no coordinate 3; its coordinates are 0 to 2",
            message(|b, second| {
                let x = b.body("x", BODY).id();
                let j = b.joint("j", PairKind::Planar, second, x).at([0.0; 3]).axis(Z).id();
                b.gear("gear", j.coordinate(0), j.coordinate(3), 1.0);
            }),
        ),
        (
            "spring 0 between points: a number of the parameters is NaN; it must be finite",
            message(|b, second| {
                b.spring(Z, second.point(Z), f64::NAN);
            }),
        ),
        (
            "load on body `second`: a component of the force is NaN; it must be a finite number",
            message(|b, second| {
                b.load(second).force([f64::NAN, 0.0, 0.0]);
            }),
        ),
        (
            "load on body `second`: the table of the time history has no points",
            message(|b, second| {
                b.load(second).history(TimeHistory::Table { points: Vec::new() });
            }),
        ),
        (
            "the mechanism: a number of the gravity is NaN; it must be finite",
            message(|b, _| *b = std::mem::take(b).gravity([f64::NAN; 3])),
        ),
    ];
    for (expected, found) in cases {
        assert_eq!(found, expected);
    }
}

#[test]
fn a_joint_that_closes_a_loop_has_no_rate_of_its_own() {
    let mut builder = MechanismBuilder::new();
    let bar = |builder: &mut MechanismBuilder, x: f64, y: f64| {
        builder.body("bar", BODY).at([x, y, 0.0]).id()
    };
    let bars = [(0.0, 0.5), (0.5, 1.0), (1.0, 0.5)].map(|(x, y)| bar(&mut builder, x, y));
    let joint = |builder: &mut MechanismBuilder, parent: FrameId, child, at: [f64; 3]| {
        builder.joint("hinge", PairKind::Revolute, parent, child).at(at).axis(Z).id()
    };
    joint(&mut builder, Ground, bars[0], [0.0; 3]);
    joint(&mut builder, bars[0].into(), bars[1], [0.0, 1.0, 0.0]);
    joint(&mut builder, bars[1].into(), bars[2], [1.0, 1.0, 0.0]);
    let last = builder.joint("last", PairKind::Revolute, bars[2], Ground).at([1.0, 0.0, 0.0]);
    last.axis(Z).cut().rate(1.0);
    let error = builder.build().unwrap_err();
    assert!(matches!(error, BuildError::Rate { .. }), "{error}");
    assert_eq!(
        error.to_string(),
        "joint `last`: the rate of a joint that closes a loop follows from the others"
    );
}
