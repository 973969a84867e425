//! Contacts of shapes: many shapes, what stands.

use crate::contact_runs::{G, box_shape, coulomb, floor, run_by};
use nalgebra::Vector3;
use vi_constraints::nonsmooth::Method;
use vi_multibody::FrameId::{self, Ground};
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_rigid::gap::ContactShape;

/// Spheres that fall into a corner of planes come to rest without overlap, the same to the bit as
/// pairs one by one.
#[test]
fn a_group_of_shapes_is_that_of_its_pairs() {
    let places = [[0.3, 0.3, 0.2], [0.55, 0.32, 0.22], [0.42, 0.5, 0.5], [0.2, 0.55, 0.3]];
    let build = |grouped: bool| {
        let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -G]);
        let planes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let plane = |normal| ContactShape::Plane { point: Vector3::zeros(), normal };
        let mut shapes: Vec<(FrameId, ContactShape)> =
            planes.iter().map(|normal| (Ground, plane(*normal))).collect();
        for (k, at) in places.iter().enumerate() {
            let inertia = Inertia::principal(1.0, [0.004; 3]);
            let ball =
                builder.body(&format!("ball{k}"), inertia).at(*at).velocity([-1.0, -0.5, 0.0]);
            shapes.push((ball.id().into(), ContactShape::sphere(Vector3::zeros(), 0.1)));
        }
        let law = coulomb(0.3, 0.2);
        if grouped {
            builder.shape_group("bed", shapes, &[], law).unwrap();
        } else {
            for (k, a) in shapes.iter().enumerate() {
                for b in shapes[k + 1..].iter().filter(|b| b.0 != Ground) {
                    let name = format!("pair {k}");
                    builder.shape_contact(&name, a.clone(), b.clone(), law).unwrap();
                }
            }
        }
        run_by(&builder, 0.005, Method::Stepping)
    };
    let (mut one, mut other) = (build(true), build(false));
    for step in 0..300 {
        one.step().unwrap();
        other.step().unwrap();
        let off = one.state().q.iter().zip(&other.state().q).map(|(a, b)| (a - b).abs());
        let off = off.fold(0.0, f64::max);
        assert!(off < 1e-9, "step {step}: {off:e}");
    }
    let counts = one.state().contacts.counts;
    println!("{counts:?}");
    assert!(counts.smallest_gap.unwrap() > -1e-12 && counts.most_contacts >= 5, "{counts:?}");
    assert!(counts.largest_work < 1e-12, "{counts:?}");
}

/// A box lies on a box, planks cross, a cylinder stands on its rim: nothing
/// moves that is at rest, for each pair of shapes that can bear.
#[test]
fn what_stands_stays() {
    let planks = ([0.5, 0.1, 0.05], [0.1, 0.5, 0.05]);
    let bricks = ([0.3, 0.3, 0.1], [0.1, 0.2, 0.1]);
    for (lower, upper) in [planks, bricks, (bricks.1, bricks.0)] {
        let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -G]);
        let inertia = Inertia::principal(1.0, [0.01, 0.02, 0.02]);
        let first = builder.body("first", inertia).at([0.0, 0.0, lower[2]]).id();
        let second = builder.body("second", inertia).at([0.0, 0.0, 2.0 * lower[2] + upper[2]]).id();
        let shapes = vec![
            (Ground, floor()),
            (first.into(), box_shape(lower)),
            (second.into(), box_shape(upper)),
        ];
        builder.shape_group("stack", shapes, &[], coulomb(0.4, 0.3)).unwrap();
        let mut run = run_by(&builder, 0.01, Method::Stepping);
        let start = run.state().q.clone();
        for _ in 0..200 {
            run.step().unwrap();
        }
        let off = run.state().q.iter().zip(&start).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("{upper:?} on {lower:?}: moved by {off:.1e}");
        assert!(off < 1e-12, "{upper:?} on {lower:?}: {off:e}");
    }
    for (along, height) in [(Vector3::z(), 0.2)] {
        let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -G]);
        let inertia = Inertia::principal(1.0, [0.01, 0.01, 0.01]);
        let roller = builder.body("roller", inertia).at([0.0, 0.0, height]).id();
        let ends = [-0.2 * along, 0.2 * along];
        let shape = ContactShape::Cylinder { ends, radius: 0.1 };
        let law = coulomb(0.4, 0.3);
        builder.shape_contact("floor", (Ground, floor()), (roller, shape), law).unwrap();
        let mut run = run_by(&builder, 0.01, Method::Stepping);
        let start = run.state().q.clone();
        for _ in 0..200 {
            run.step().unwrap();
        }
        let off = run.state().q.iter().zip(&start).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("cylinder along {along:?}: moved by {off:.1e}");
        assert!(off < 1e-12, "{off:e}");
    }
}
