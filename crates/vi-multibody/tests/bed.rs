//! Spheres that fall into a box and settle.

use vi_constraints::nonsmooth::ContactLaw;
use vi_multibody::FrameId::Ground;
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_rigid::gap::ContactShape;

/// Layers of spheres.
pub(crate) const LAYERS: usize = 5;
const RADIUS: f64 = 0.05;
const PITCH: f64 = 0.108;

/// `side × side` columns of spheres that are not straight, in a box without a lid.
pub(crate) fn bed(side: usize) -> MechanismBuilder {
    silo(side, LAYERS)
}

/// The same with another number of layers.
pub(crate) fn silo(side: usize, layers: usize) -> MechanismBuilder {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let mut seed = 12345_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 33) as f64 / (1_u64 << 31) as f64 - 0.5
    };
    let width = PITCH * side as f64;
    let wall = |point: [f64; 3], normal: [f64; 3]| {
        (Ground, ContactShape::Plane { point: point.into(), normal: normal.into() })
    };
    let mut shapes = vec![
        wall([0.0; 3], [0.0, 0.0, 1.0]),
        wall([0.0; 3], [1.0, 0.0, 0.0]),
        wall([0.0; 3], [0.0, 1.0, 0.0]),
        wall([width, 0.0, 0.0], [-1.0, 0.0, 0.0]),
        wall([0.0, width, 0.0], [0.0, -1.0, 0.0]),
    ];
    for k in 0..side * side * layers {
        let place = [k % side, k / side % side, k / (side * side)];
        let at = place.map(|i| PITCH * (i as f64 + 0.5) + 0.006 * random());
        let inertia = Inertia::principal(1.0, [0.4 * RADIUS * RADIUS; 3]);
        let body = builder.body(&format!("sphere{k}"), inertia).at(at).id();
        shapes.push((body.into(), ContactShape::sphere([0.0; 3].into(), RADIUS)));
    }
    builder.shape_group("bed", shapes, &[], ContactLaw::coulomb(0.3, 0.0)).unwrap();
    builder
}
