//! Boxes on boxes: what is stacked stays, to rounding.

use crate::contact_runs::{G, box_shape, coulomb, floor, run_by};
use vi_constraints::nonsmooth::Method;
use vi_multibody::FrameId::{self, Ground};
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_rigid::gap::ContactShape;

/// How far what rests for a second with masses of several ratios may move, m.
const RESTS: f64 = 1e-11;

/// A box: half lengths, mass, centre.
type Placed = ([f64; 3], f64, [f64; 3]);

/// Boxes on one another: half lengths, mass, offset from the axis of the stack.
fn stack(boxes: &[([f64; 3], f64, [f64; 2])]) -> Vec<Placed> {
    let mut top = 0.0;
    let mut place = |&(half, mass, [x, y]): &([f64; 3], f64, [f64; 2])| {
        top += 2.0 * half[2];
        (half, mass, [x, y, top - half[2]])
    };
    boxes.iter().map(&mut place).collect()
}

/// How far boxes on a floor that leans move within some steps of 5 ms.
fn creep(boxes: &[Placed], slope: f64, method: Method, steps: usize) -> f64 {
    let gravity = [G * slope.sin(), 0.0, -G * slope.cos()];
    let mut builder = MechanismBuilder::new().gravity(gravity);
    let mut shapes: Vec<(FrameId, ContactShape)> = vec![(Ground, floor())];
    for (k, &(half, mass, at)) in boxes.iter().enumerate() {
        let [a, b, c] = half.map(|x| x * x * mass / 3.0);
        let inertia = Inertia::principal(mass, [b + c, a + c, a + b]);
        let body = builder.body(&format!("box{k}"), inertia).at(at).id();
        shapes.push((body.into(), box_shape(half)));
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
            let off = creep(&stack(&boxes), slope, method, 100);
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
            let off = creep(&stack(boxes), 0.0, method, 60);
            println!("{name}, {method:?}: moved by {off:.1e} m");
            assert!(off < 1e-13, "{name}, {method:?}: {off:e}");
        }
    }
}

/// Light boxes bear heavy ones: ten with a heavy one on top, ten of 1 and 100 kg in turn, each
/// ten times heavier than the one below.
#[test]
fn towers_of_light_and_heavy_boxes_do_not_creep() {
    let tower = |masses: Vec<f64>| {
        let boxes: Vec<_> = masses.into_iter().map(|mass| ([0.05; 3], mass, [0.0; 2])).collect();
        stack(&boxes)
    };
    let alternate = |k: usize| if k.is_multiple_of(2) { 1.0 } else { 100.0 };
    let cases = [
        ("top", tower((0..10).map(|k| if k == 9 { 100.0 } else { 1.0 }).collect())),
        ("in turn", tower((0..10).map(alternate).collect())),
        ("growing", tower(vec![1.0, 10.0, 100.0])),
    ];
    for (name, boxes) in cases {
        for method in [Method::Stepping, Method::Events] {
            let off = creep(&boxes, 0.0, method, 200);
            println!("{name}, {method:?}: moved by {off:.1e} m");
            assert!(off < RESTS, "{name}, {method:?}: {off:e}");
        }
    }
}

/// A heavy beam on two light boxes, a plate on four legs with a load, the bricks of a wall.
#[test]
fn boxes_on_several_boxes_do_not_creep() {
    let leg = |x: f64, y: f64| ([0.03, 0.03, 0.3], 1.0, [x, y, 0.3]);
    let brick = |x: f64, z: f64| ([0.1, 0.05, 0.05], 1.0, [x, 0.0, z]);
    let cube = |x: f64| ([0.05; 3], 1.0, [x, 0.0, 0.05]);
    let bridge = vec![cube(-0.2), cube(0.2), ([0.3, 0.1, 0.05], 100.0, [0.0, 0.0, 0.15])];
    let plate = ([0.5, 0.4, 0.02], 10.0, [0.0, 0.0, 0.62]);
    let load = ([0.1; 3], 200.0, [0.05, 0.03, 0.74]);
    let table = vec![leg(0.4, 0.3), leg(-0.4, 0.3), leg(0.4, -0.3), leg(-0.4, -0.3), plate, load];
    let below = [brick(-0.1, 0.05), brick(0.1, 0.05)];
    let wall = [&below[..], &[brick(-0.2, 0.15), brick(0.0, 0.15), brick(0.2, 0.15)]].concat();
    for (name, boxes) in [("bridge", bridge), ("table", table), ("wall", wall)] {
        for method in [Method::Stepping, Method::Events] {
            let off = creep(&boxes, 0.0, method, 200);
            println!("{name}, {method:?}: moved by {off:.1e} m");
            assert!(off < RESTS, "{name}, {method:?}: {off:e}");
        }
    }
}
