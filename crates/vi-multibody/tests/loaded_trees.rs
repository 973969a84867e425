//! Random trees for tests of what moves them.

use nalgebra::Vector3;
use vi_multibody::builder::{BodyId, Inertia, JointId, MechanismBuilder};
use vi_multibody::{BuiltMechanism, FrameId, PairKind};
use vi_testkit::Sample;

/// A random tree of all pairs, its root on a hinge, free or on any of them; with `loaded` bodies a
/// following load, springs to the ground and a motor at a hinge of the root.
pub(crate) fn tree(bodies: usize, loaded: bool, seed: u64) -> BuiltMechanism {
    varied_tree(bodies, loaded, seed, 0.0)
}

/// The same; `other` changes masses, positions and rates of the bodies, not their topology.
pub(crate) fn varied_tree(bodies: usize, loaded: bool, seed: u64, other: f64) -> BuiltMechanism {
    tree_with(bodies, seed, other, |builder, k, part| {
        if !loaded {
            return;
        }
        let body = part.body;
        builder.spring([1.0, 0.5, -0.2], body.point([0.1, 0.2, 0.3]), 20.0);
        builder.load(body).force([1.0, -2.0, 0.5]).torque([0.2, 0.1, -0.3]).follower();
        if part.kind == PairKind::Revolute && k == 0 {
            builder.motor(part.joint.coordinate(0), |t| 2.0 * t);
        }
    })
}

/// A body of a tree and the joint that carries it.
#[derive(Clone, Copy)]
pub(crate) struct Part {
    pub(crate) body: BodyId,
    pub(crate) joint: JointId,
    pub(crate) kind: PairKind,
}

/// The same with what `act(builder, k, part)` adds to each part.
pub(crate) fn tree_with(
    bodies: usize,
    seed: u64,
    other: f64,
    act: impl Fn(&mut MechanismBuilder, usize, Part),
) -> BuiltMechanism {
    let mut random = Sample::new(seed);
    let mut builder = MechanismBuilder::new().gravity([0.3, -1.0, -9.0]);
    let mut frames = vec![FrameId::Ground];
    for k in 0..bodies {
        let j = Vector3::new(1.0, 1.2, 1.5) + 0.15 * random.vector();
        let inertia = Inertia::principal(2.0 + other + random.number(), j.into());
        let at = 2.0 * (1.0 + 0.1 * other) * random.vector();
        let kind = match (k, seed % 3) {
            (0, 0) => PairKind::Revolute,
            (0, 1) => PairKind::Free,
            _ => PairKind::ALL[random.index(PairKind::ALL.len() - 1)],
        };
        let parent = if random.index(2) == 0 { frames[k] } else { frames[random.index(k + 1)] };
        let body = builder.body(&format!("body {k}"), inertia).at(at);
        let body = body.rotation_vector(random.vector());
        let free = kind == PairKind::Free;
        let body = if free { body.angular_velocity(random.vector()) } else { body }.id();
        let joint = builder.joint(&format!("joint {k}"), kind, parent, body).at(random.vector());
        let joint = if kind.has_axis() { joint.axis(random.vector()) } else { joint };
        let rates: [f64; 6] = random.array();
        let count = kind.coordinate_count();
        let joint =
            if count > 0 { joint.rates(&rates.map(|rate| rate - other)[..count]) } else { joint };
        let joint = joint.id();
        act(&mut builder, k, Part { body, joint, kind });
        frames.push(body.into());
    }
    builder.build().unwrap()
}
