//! Boxes on boxes: what is stacked stays, to rounding.

use crate::contact_runs::{G, box_shape, coulomb, floor, run_by};
use vi_constraints::nonsmooth::{ContactLaw, Method};
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

/// Boxes that fall on one another name other features of a pair within a step, with gaps that may
/// be negative there: a short part of the step, to a first touch, does not close these at once.
#[test]
fn other_features_of_falling_boxes_are_closed_within_a_step() {
    let mut overlaps = 0;
    for shift in [0.0, 1e-3, 2e-3, 3e-3, 4e-3, 5e-3] {
        let fallen = [
            ([0.161, 0.258, 0.107], 424.1, [0.0197, -0.0043, 0.1662], [-0.811, -0.39, 1.038]),
            ([0.181, 0.085, 0.063], 109.2, [0.0203, 0.0029, 0.4422], [-0.663, -1.099, -0.358]),
            ([0.15, 0.121, 0.243], 298.1, [0.0442 + shift, 0.0302, 0.7121], [0.147, 1.112, 1.12]),
            ([0.185, 0.16, 0.161], 3481.0, [0.0420, 0.0205, 1.0236], [-1.053, -0.529, 0.045]),
        ];
        let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -G]);
        let mut shapes: Vec<(FrameId, ContactShape)> = vec![(Ground, floor())];
        for (k, (lengths, density, at, turned)) in fallen.into_iter().enumerate() {
            let mass = density * lengths.iter().product::<f64>();
            let [a, b, c] = lengths.map(|x| x * x * mass / 12.0);
            let inertia = Inertia::principal(mass, [b + c, a + c, a + b]);
            let name = format!("box{k}");
            let body = builder.body(&name, inertia).at(at).rotation_vector(turned).id();
            shapes.push((body.into(), box_shape(lengths.map(|x| 0.5 * x))));
        }
        let law = ContactLaw::Frictionless { restitution: 0.2 };
        builder.shape_group("pile", shapes, &[], law).unwrap();
        let mut run = run_by(&builder, 0.001, Method::Events);
        let start = run.state().q.clone();
        for step in 0..450 {
            run.step().unwrap_or_else(|error| panic!("shift {shift}: step {step}: {error}"));
        }
        let way = run.state().q.iter().zip(&start).map(|(a, b)| (a - b).abs());
        let (way, gap) = (way.fold(0.0, f64::max), run.state().contacts.counts.smallest_gap);
        println!("shift {shift}: moved by {way:.2} m, smallest gap {gap:?}");
        overlaps += usize::from(gap.unwrap() < -1e-10);
        assert!(way < 2.5, "nothing is thrown: {way} m");
    }
    assert!(overlaps > 0, "some do");
}
