//! Point masses beside bodies: steps of the operators of each against dense matrices over all.

use crate::dense::off_dense;
use vi_constraints::{Options, SchemeKind};
use vi_core::Composition;
use vi_multibody::builder::{BodyId, Inertia};
use vi_multibody::{BuiltMechanism, FrameId, MechanismBuilder, PairKind};

/// What the bodies are.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Bodies {
    /// A chain of different joints.
    Tree,
    /// Parallelograms side by side: closed loops with redundant constraints.
    Loops,
}

/// What the point masses are.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Points {
    /// A free one, and two that hang on one another and on the ground.
    Tree,
    /// Three that bars join to one another: a loop with another of four bars.
    Loops,
}

const BAR: [f64; 3] = [0.1, 0.02, 0.1];

fn chain(builder: &mut MechanismBuilder) -> BodyId {
    let kinds = [PairKind::Revolute, PairKind::Universal, PairKind::Spherical, PairKind::Prismatic];
    let mut parent = FrameId::Ground;
    let mut bodies = Vec::new();
    for (k, kind) in kinds.into_iter().enumerate() {
        let body =
            builder.body("link", Inertia::principal(1.0, BAR)).at([k as f64 + 0.5, 0.0, 0.0]);
        let body = body.id();
        let joint = builder.joint("joint", kind, parent, body).at([k as f64, 0.0, 0.0]);
        let joint = if kind.has_axis() { joint.axis([0.0, 1.0, 0.2]) } else { joint };
        if kind != PairKind::Spherical {
            joint.rates(&[0.7, -0.4][..kind.coordinate_count()]);
        }
        parent = body.into();
        bodies.push(body);
    }
    bodies[1]
}

fn parallelograms(builder: &mut MechanismBuilder, count: usize) -> BodyId {
    let mut bar = |x: f64, y: f64, [v, w]: [f64; 2]| {
        let bar = builder.body("bar", Inertia::principal(1.0, BAR)).at([x, y, 0.0]);
        bar.velocity([v, 0.0, 0.0]).angular_velocity([0.0, 0.0, w]).id()
    };
    let cranks: Vec<BodyId> = (0..=count).map(|i| bar(i as f64, 0.5, [0.5, -1.0])).collect();
    let couplers: Vec<BodyId> = (0..count).map(|i| bar(i as f64 + 0.5, 1.0, [1.0, 0.0])).collect();
    let mut hinge = |parent: FrameId, child: BodyId, x: f64, y: f64| {
        let hinge = builder.joint("hinge", PairKind::Revolute, parent, child);
        hinge.at([x, y, 0.0]).axis([0.0, 0.0, 1.0]);
    };
    for (i, crank) in cranks.iter().enumerate() {
        hinge(FrameId::Ground, *crank, i as f64, 0.0);
    }
    for (i, coupler) in couplers.iter().enumerate() {
        hinge(cranks[i].into(), *coupler, i as f64, 1.0);
        hinge((*coupler).into(), cranks[i + 1], (i + 1) as f64, 1.0);
    }
    couplers[0]
}

/// A mechanism of both, with springs between point masses; with `coupled` also between a body and a
/// point mass.
fn mechanism(bodies: Bodies, points: Points, coupled: bool) -> BuiltMechanism {
    let mut builder = MechanismBuilder::new().gravity([0.3, -9.0, -1.0]);
    let body = match bodies {
        Bodies::Tree => chain(&mut builder),
        Bodies::Loops => parallelograms(&mut builder, 2),
    };
    let free = builder.particle("free", 0.7, [3.0, 1.0, 2.0], [0.5, 2.0, -1.0]);
    let upper = builder.particle("upper", 1.1, [4.0, 1.0, 0.0], [0.0, 0.0, 0.4]);
    let lower = builder.particle("lower", 0.9, [4.0, 0.2, 0.6], [0.0, 0.0, 0.4]);
    builder.bar("rod", [4.0, 2.0, 0.0], upper);
    builder.bar("rod", upper, lower);
    if points == Points::Loops {
        builder.bar("rod", [4.6, 2.0, 0.3], lower);
    }
    builder.spring(free, upper, 30.0);
    if coupled {
        builder.spring(body.point([0.2, 0.1, 0.0]), lower, 20.0);
    }
    builder.build().unwrap()
}

#[test]
fn point_masses_beside_bodies_move_as_by_dense_matrices() {
    for bodies in [Bodies::Tree, Bodies::Loops] {
        for points in [Points::Tree, Points::Loops] {
            for coupled in [false, true] {
                let composed = [
                    (SchemeKind::Nodal, Composition::Identity),
                    (SchemeKind::Reduced, Composition::Suzuki5),
                ];
                for (scheme, composition) in composed {
                    let built = mechanism(bodies, points, coupled);
                    let options = Options::new(scheme, 0.01).composition(composition);
                    let (off, count) = off_dense(&built, options);
                    let what = format!("{bodies:?} {points:?} {coupled} {scheme:?}");
                    println!("{what}: off by {off:.1e}, iterations {count:?}");
                    assert!(off < 2e-12, "{what}: off by {off:.1e}");
                }
            }
        }
    }
}
