//! Boxes on boxes: what is stacked stays, to rounding.

use crate::contact_runs::{G, box_shape, coulomb, floor, run_by};
use vi_constraints::nonsmooth::Method;
use vi_multibody::FrameId::{self, Ground};
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_rigid::gap::ContactShape;

/// Boxes on one another: half lengths, mass, offset from the axis of the stack.
fn creep(boxes: &[([f64; 3], f64, [f64; 2])], slope: f64, method: Method, steps: usize) -> f64 {
    let gravity = [G * slope.sin(), 0.0, -G * slope.cos()];
    let mut builder = MechanismBuilder::new().gravity(gravity);
    let mut shapes: Vec<(FrameId, ContactShape)> = vec![(Ground, floor())];
    let mut top = 0.0;
    for (k, &(half, mass, [x, y])) in boxes.iter().enumerate() {
        let [a, b, c] = half.map(|x| x * x * mass / 3.0);
        let inertia = Inertia::principal(mass, [b + c, a + c, a + b]);
        let body = builder.body(&format!("box{k}"), inertia).at([x, y, top + half[2]]).id();
        shapes.push((body.into(), box_shape(half)));
        top += 2.0 * half[2];
    }
    builder.shape_group("stack", shapes, &[], coulomb(0.5, 0.0)).unwrap();
    let mut run = run_by(&builder, 0.005, method);
    let start = run.state().q.clone();
    let mut worst = 0.0_f64;
    for step in 0..steps {
        run.step().unwrap_or_else(|error| panic!("step {step}: {error}"));
        let off = run.state().q.iter().zip(&start).map(|(a, b)| (a - b).abs());
        worst = worst.max(off.fold(0.0, f64::max));
    }
    worst
}

/// Equal boxes that are aligned, of which each corner lies on two edges: on a floor, on a slope.
#[test]
fn aligned_boxes_do_not_creep() {
    for (count, slope) in [(2, 0.0), (3, 0.0), (2, 0.2)] {
        for method in [Method::Stepping, Method::Events] {
            let boxes = vec![([0.05; 3], 1.0, [0.0; 2]); count];
            let off = creep(&boxes, slope, method, 100);
            println!("{count} boxes, slope {slope}, {method:?}: moved by {off:.1e} m");
            assert!(off < 1e-13, "{count} boxes, slope {slope}, {method:?}: {off:e}");
        }
    }
}

/// Boxes aside of one another; boxes of other sizes.
#[test]
fn unlike_boxes_do_not_creep() {
    let half = [0.05; 3];
    let aside = [(half, 1.0, [0.0; 2]), (half, 1.0, [0.01, 0.0]), (half, 1.0, [0.01, 0.02])];
    let sizes = [([0.1, 0.05, 0.05], 1.0, [0.0; 2]), (half, 2.0, [0.05, 0.0])];
    for (name, boxes) in [("sizes", &sizes[..]), ("aside", &aside[..])] {
        for method in [Method::Stepping, Method::Events] {
            let off = creep(boxes, 0.0, method, 60);
            println!("{name}, {method:?}: moved by {off:.1e} m");
            assert!(off < 1e-13, "{name}, {method:?}: {off:e}");
        }
    }
}
