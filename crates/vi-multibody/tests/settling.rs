//! A bed of spheres settles in a box: steps go on without end, gaps are not passed.

use crate::contact_runs::{G, coulomb, run_by};
use vi_constraints::nonsmooth::Method;
use vi_multibody::FrameId::Ground;
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_rigid::gap::ContactShape;

const SIDE: usize = 3;
const LAYERS: usize = 5;
const RADIUS: f64 = 0.05;
const PITCH: f64 = 0.108;

/// Columns of spheres that are not straight, in a box without a lid.
fn bed() -> MechanismBuilder {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -G]);
    let mut seed = 12345_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 33) as f64 / (1_u64 << 31) as f64 - 0.5
    };
    let width = PITCH * SIDE as f64;
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
    for k in 0..SIDE * SIDE * LAYERS {
        let place = [k % SIDE, k / SIDE % SIDE, k / (SIDE * SIDE)];
        let at = place.map(|i| PITCH * (i as f64 + 0.5) + 0.006 * random());
        let inertia = Inertia::principal(1.0, [0.4 * RADIUS * RADIUS; 3]);
        let body = builder.body(&format!("sphere{k}"), inertia).at(at).id();
        shapes.push((body.into(), ContactShape::sphere([0.0; 3].into(), RADIUS)));
    }
    builder.shape_group("bed", shapes, &[], coulomb(0.3, 0.0)).unwrap();
    builder
}

#[test]
fn a_bed_of_spheres_settles() {
    let mut run = run_by(&bed(), 0.005, Method::Stepping);
    for step in 0..300 {
        run.step().unwrap_or_else(|error| panic!("step {step}: {error}"));
    }
    let counts = run.state().contacts.counts;
    let contacts = run.nonsmooth().unwrap().nodes().last().map_or(0, |node| node.1.len());
    println!("{contacts} contacts, {counts:?}");
    assert!(contacts > 100, "{contacts}");
    // what a velocity deviates from the laws by bounds what a gap is passed by
    let gap = counts.smallest_gap.unwrap();
    assert!(gap > -1e-9 - 0.005 * counts.largest_deviation, "{gap:e}");
    assert!(counts.largest_deviation < 1e-5, "{counts:?}");
    assert!(counts.largest_work < 1e-9, "{counts:?}");
}
