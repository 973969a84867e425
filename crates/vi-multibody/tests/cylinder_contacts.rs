//! Cylinders on cylinders, boxes and capsules: what rests stays, a heap does not overlap.

use crate::contact_runs::{G, box_shape, coulomb, moved, run_by};
use nalgebra::Vector3;
use vi_constraints::nonsmooth::Method;
use vi_multibody::FrameId::Ground;
use vi_multibody::PairKind;
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_rigid::gap::ContactShape;

fn along(axis: Vector3<f64>, half: f64) -> [Vector3<f64>; 2] {
    [-half * axis, half * axis]
}

fn log(half: f64, radius: f64) -> ContactShape {
    ContactShape::Cylinder { ends: along(Vector3::x(), half), radius }
}

fn can(half: f64, radius: f64) -> ContactShape {
    ContactShape::Cylinder { ends: along(Vector3::z(), half), radius }
}

fn pill(half: f64, radius: f64) -> ContactShape {
    ContactShape::Capsule { ends: along(Vector3::x(), half), radius }
}

/// One body on what is fixed: it rests to rounding errors, on a level and on a slope that friction
/// holds.
#[test]
fn what_rests_on_fixed_shapes_stays() {
    let quarter = [0.0, 0.0, std::f64::consts::FRAC_PI_2];
    let table = box_shape([1.0, 1.0, 0.1]);
    let beam = box_shape([1.0, 0.06, 0.1]);
    let cases = [
        ("can on a table", &table, can(0.2, 0.1), [0.1, 0.2, 0.3], [0.0; 3], 0.2),
        ("can over an edge", &table, can(0.2, 0.1), [0.95, 0.3, 0.3], [0.0; 3], 0.0),
        ("can on a beam", &beam, can(0.2, 0.1), [0.1, 0.0, 0.3], [0.0; 3], 0.0),
        ("can on a can", &can(0.1, 0.1), can(0.2, 0.1), [0.0, 0.0, 0.3], [0.0; 3], 0.2),
        ("can aside on a can", &can(0.1, 0.1), can(0.2, 0.1), [0.05, 0.02, 0.3], [0.0; 3], 0.0),
        (
            "box on a can",
            &can(0.1, 0.3),
            box_shape([0.1, 0.2, 0.1]),
            [0.05, 0.0, 0.2],
            [0.0; 3],
            0.2,
        ),
        ("log on a table", &table, log(0.3, 0.1), [0.1, 0.2, 0.2], [0.0; 3], 0.0),
        ("log across a beam", &beam, log(0.3, 0.1), [0.1, 0.0, 0.2], quarter, 0.0),
        ("log on a can", &can(0.1, 0.2), log(0.3, 0.1), [0.03, 0.0, 0.2], [0.0; 3], 0.0),
        ("log on a log", &log(0.2, 0.1), log(0.3, 0.1), [0.05, 0.0, 0.2], [0.0; 3], 0.0),
        ("pill on a log", &log(0.2, 0.1), pill(0.3, 0.1), [0.05, 0.0, 0.2], [0.0; 3], 0.0),
        ("pill on a can", &can(0.1, 0.2), pill(0.3, 0.1), [0.0, 0.03, 0.2], [0.0; 3], 0.0),
        ("pill on a table", &table, pill(0.3, 0.1), [0.1, 0.2, 0.2], [0.0; 3], 0.0),
        ("pill across a beam", &beam, pill(0.3, 0.1), [0.1, 0.0, 0.2], quarter, 0.0),
    ];
    for (name, fixed, shape, at, turned, slope) in cases {
        for method in [Method::Stepping, Method::Events] {
            let slope: f64 = slope;
            let gravity = [G * slope.sin(), 0.0, -G * slope.cos()];
            let mut builder = MechanismBuilder::new().gravity(gravity);
            let inertia = Inertia::principal(1.0, [0.01, 0.012, 0.014]);
            let body = builder.body("body", inertia).at(at).rotation_vector(turned).id();
            let pair = ((Ground, fixed.clone()), (body, shape.clone()));
            builder.shape_contact("rest", pair.0, pair.1, coulomb(0.5, 0.3)).unwrap();
            let off = moved(&mut run_by(&builder, 0.01, method), 200);
            println!("{name}, slope {slope}, {method:?}: moved by {off:.1e} m");
            assert!(off < 1e-12, "{name}, {method:?}: {off:e}");
        }
    }
}

/// A heap of logs between two walls: gaps are not passed, and it comes to rest.
#[test]
fn a_heap_of_logs_does_not_overlap() {
    let radius = 0.1;
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -G]);
    let mut shapes = vec![(Ground, box_shape([1.0, 0.5, 0.05]))];
    for side in [-1.0, 1.0] {
        let center = Vector3::new(0.0, side * 0.42, 0.3);
        let (axes, half_lengths) = (nalgebra::Matrix3::identity(), Vector3::new(1.0, 0.05, 0.3));
        shapes.push((Ground, ContactShape::Box { center, axes, half_lengths }));
    }
    for k in 0..6 {
        let (row, place) = (k / 3, k % 3);
        let at = [
            0.01 * f64::from(k),
            0.22 * f64::from(place) - 0.24 + 0.03 * f64::from(row),
            0.16 + 0.25 * f64::from(row) + 0.01 * f64::from(place),
        ];
        let inertia = Inertia::principal(2.0, [0.01, 0.07, 0.07]);
        let body = builder.body(&format!("log{k}"), inertia).at(at).id();
        shapes.push((body.into(), log(0.3, radius)));
    }
    builder.shape_group("heap", shapes, &[], coulomb(0.4, 0.0)).unwrap();
    let mut run = run_by(&builder, 0.004, Method::Stepping);
    for step in 0..250 {
        run.step().unwrap_or_else(|error| panic!("step {step}: {error}"));
    }
    let counts = run.state().contacts.counts;
    let off = moved(&mut run, 20);
    println!("moved by {off:.1e} m, {counts:?}");
    assert!(counts.smallest_gap.unwrap() > -1e-9, "{counts:?}");
    assert!(counts.largest_work < 1e-12, "{counts:?}");
    assert!(off < 1e-3, "{off:e}");
}

/// The end of a log slides past an edge that it lies on, or that lies on it: what lies stays at its
/// height.
#[test]
fn an_end_that_slides_past_an_edge_changes_no_height() {
    let inertia = || Inertia::principal(1.0, [0.01, 0.012, 0.014]);
    let top = box_shape([0.0995, 0.2, 0.05]);
    let mut below = MechanismBuilder::new().gravity([0.0, 0.0, -G]);
    let roller = below.body("roller", inertia()).velocity([0.1, 0.0, 0.0]).id();
    let block = below.body("block", inertia()).at([0.0, 0.0, 0.15]).id();
    below.joint("rail", PairKind::Prismatic, Ground, roller).at([0.0; 3]).axis([1.0, 0.0, 0.0]);
    let pair = ((roller, log(0.1, 0.1)), (block, top));
    below.shape_contact("touch", pair.0, pair.1, coulomb(0.0, 0.0)).unwrap();
    let mut above = MechanismBuilder::new().gravity([0.0, 0.0, -G]);
    let at = [0.0, 0.0, 0.15];
    let sliding = above.body("log", inertia()).at(at).velocity([0.1, 0.0, 0.0]).id();
    let pair = ((Ground, box_shape([0.0995, 0.2, 0.05])), (sliding, log(0.1, 0.1)));
    above.shape_contact("touch", pair.0, pair.1, coulomb(0.0, 0.3)).unwrap();
    for (name, builder, body) in [("block on a roller", below, 1), ("log on a block", above, 0)] {
        for (h, method) in [(0.01, Method::Stepping), (0.003, Method::Events)] {
            let mut run = run_by(&builder, h, method);
            let mut worst = 0.0_f64;
            while run.state().t < 0.3 {
                run.step().unwrap_or_else(|error| panic!("{name}, {method:?}: {error}"));
                worst = worst.max((run.state().q[12 * body + 2] - 0.15).abs());
            }
            println!("{name}, {method:?}: height changes by {worst:.1e} m");
            assert!(worst < 1e-13, "{name}, {method:?}: {worst:e}");
        }
    }
}
