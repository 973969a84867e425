//! Random trees of all pairs that move from the start.

use vi_multibody::builder::{BodyId, CoordinateId, Inertia};
use vi_multibody::{FrameId, MechanismBuilder, PairKind};
use vi_testkit::Sample;

/// A random tree before what acts on it.
pub(crate) struct MovingTree {
    pub(crate) builder: MechanismBuilder,
    pub(crate) bodies: Vec<BodyId>,
    /// Of each body; none on the ground.
    pub(crate) parents: Vec<Option<usize>>,
    /// Coordinates of all joints.
    pub(crate) coordinates: Vec<CoordinateId>,
}

/// Bodies on earlier ones or on the ground, by joints of all kinds that have rates.
pub(crate) fn moving_tree(bodies: usize, random: &mut Sample) -> MovingTree {
    let mut builder = MechanismBuilder::new().gravity([0.3, -1.0, -9.0]);
    let (mut links, mut parents, mut coordinates) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..bodies {
        let inertia = Inertia::principal(2.0 + random.number(), [1.1, 1.2, 1.4]);
        let body = builder.body(&format!("body {k}"), inertia).at(2.0 * random.vector());
        let body = body.rotation_vector(random.vector()).id();
        let kind = PairKind::ALL[random.index(PairKind::ALL.len() - 1)];
        let parent =
            if random.index(3) > 0 { k.checked_sub(1) } else { random.index(k + 1).checked_sub(1) };
        let frame = parent.map_or(FrameId::Ground, |parent| FrameId::from(links[parent]));
        let joint = builder.joint(&format!("joint {k}"), kind, frame, body).at(random.vector());
        let joint = if kind.has_axis() { joint.axis(random.vector()) } else { joint };
        let (rates, count): ([f64; 6], usize) = (random.array(), kind.coordinate_count());
        let joint = if count > 0 { joint.rates(&rates[..count]) } else { joint };
        let id = joint.id();
        coordinates.extend((0..count).map(|freedom| id.coordinate(freedom)));
        links.push(body);
        parents.push(parent);
    }
    MovingTree { builder, bodies: links, parents, coordinates }
}
