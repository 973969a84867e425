//! Cylinders, boxes and capsules against one another, by a bound from convex duality:
//! ```text
//! s(n) ≤ distance ≤ |x_B − x_A|,   s(n) = min n·B − max n·A,   x_A in A, x_B in B
//! ```
//! for every unit vector `n` and all points. Where both are the same, the gap is the distance.
//! Supports and inclusions are written here on their own.

use super::outline::OutlineShape;
use super::outline_pairs::{Feature, FeatureParts};
use super::tests::off_the_gradient;
use super::*;
use crate::directors::FRAME;
use nalgebra::Matrix3;
use vi_testkit::Sample;

fn cylinder(half: f64, radius: f64) -> ContactShape {
    let along = Vector3::new(0.0, 0.0, half);
    ContactShape::Cylinder { ends: [-along, along], radius }
}

fn capsule(half: f64, radius: f64) -> ContactShape {
    let along = Vector3::new(0.0, 0.0, half);
    ContactShape::Capsule { ends: [-along, along], radius }
}

fn brick(half: [f64; 3]) -> ContactShape {
    ContactShape::Box {
        center: Vector3::zeros(),
        axes: Matrix3::identity(),
        half_lengths: half.into(),
    }
}

fn shape(kind: OutlineShape, sample: &mut Sample) -> ContactShape {
    let mut length = |least: f64| least + 0.5 * sample.number().abs();
    let (half, radius, other) = (length(0.02), length(0.02), length(0.02));
    match kind {
        OutlineShape::Cylinder => cylinder(half, radius),
        OutlineShape::Capsule => capsule(half, radius),
        OutlineShape::Box => brick([half, radius, other]),
    }
}

/// Every pair of shapes whose features these are.
const PAIRS: [[OutlineShape; 2]; 4] = [
    [OutlineShape::Cylinder, OutlineShape::Box],
    [OutlineShape::Cylinder, OutlineShape::Capsule],
    [OutlineShape::Cylinder, OutlineShape::Cylinder],
    [OutlineShape::Capsule, OutlineShape::Box],
];

/// Centre, axes and lengths of a shape in space.
fn placed(
    shape: &ContactShape,
    frame: &[f64],
) -> (Vector3<f64>, Matrix3<f64>, [f64; 3], OutlineShape) {
    let triad = Matrix3::from_column_slice(&frame[3..]);
    let at = |x: &Vector3<f64>| Vector3::from_column_slice(&frame[..3]) + triad * x;
    match shape {
        ContactShape::Box { center, axes, half_lengths } => {
            (at(center), triad * axes, (*half_lengths).into(), OutlineShape::Box)
        }
        ContactShape::Cylinder { ends, radius } | ContactShape::Capsule { ends, radius } => {
            let kind = OutlineShape::of(shape).unwrap();
            let along = triad * (ends[1] - ends[0]);
            let mut axes = Matrix3::zeros();
            axes.set_column(2, &along.normalize());
            (at(&(0.5 * (ends[0] + ends[1]))), axes, [*radius, *radius, 0.5 * along.norm()], kind)
        }
        _ => unreachable!(),
    }
}

/// `max n·x` over a shape.
fn support(shape: &ContactShape, frame: &[f64], n: &Vector3<f64>) -> f64 {
    let (center, axes, lengths, kind) = placed(shape, frame);
    let z = n.dot(&axes.column(2)).abs();
    center.dot(n)
        + match kind {
            OutlineShape::Box => {
                (0..3).map(|i| lengths[i] * n.dot(&axes.column(i)).abs()).sum::<f64>()
            }
            OutlineShape::Cylinder => z * lengths[2] + lengths[0] * n.cross(&axes.column(2)).norm(),
            OutlineShape::Capsule => z * lengths[2] + lengths[0],
        }
}

/// `s(n)`.
fn apart(pair: &ShapePair, [p, q]: [&[f64]; 2], n: &Vector3<f64>) -> f64 {
    -support(&pair.b, q, &-n) - support(&pair.a, p, n)
}

/// By how much a point is outside of a shape, m.
fn outside(shape: &ContactShape, frame: &[f64], x: &Vector3<f64>) -> f64 {
    let (center, axes, lengths, kind) = placed(shape, frame);
    let arm = x - center;
    let z = arm.dot(&axes.column(2));
    let across = |z: f64| (arm - axes.column(2) * z).norm();
    match kind {
        OutlineShape::Box => {
            (0..3).fold(f64::MIN, |most, i| most.max(arm.dot(&axes.column(i)).abs() - lengths[i]))
        }
        OutlineShape::Cylinder => (z.abs() - lengths[2]).max(across(z) - lengths[0]),
        OutlineShape::Capsule => across(z.clamp(-lengths[2], lengths[2])) - lengths[0],
    }
}

/// The features that count, with the smallest of their gaps.
fn nearest(pair: &ShapePair, [p, q]: [&[f64]; 2]) -> (Vec<(u32, f64)>, (u32, f64)) {
    let mut found = Vec::new();
    pair.active(p, q, f64::MAX, &mut found);
    let least = *found.iter().min_by(|a, b| a.1.total_cmp(&b.1)).expect("a feature");
    (found, least)
}

/// Of which parts a feature is.
fn parts_of(pair: &ShapePair, feature: u32) -> String {
    let [a, b] = pair.shapes().map(|own| OutlineShape::of(own).unwrap());
    let feature = outline_pairs::Feature::numbered(feature, a.min(b), a.max(b)).unwrap();
    format!("{:?}", feature.parts)
}

/// Two shapes in any attitude, with this gap.
/// `lean`: how far axes are from parallel or perpendicular ones, or any attitude.
fn placement(
    kinds: [OutlineShape; 2],
    sample: &mut Sample,
    (gap, lean): (f64, Option<f64>),
) -> (ShapePair, [[f64; FRAME]; 2]) {
    let pair = ShapePair::new(shape(kinds[0], sample), shape(kinds[1], sample)).unwrap();
    let separate = |p: &[f64], q: &[f64]| smallest_gap((&pair.a, p), (&pair.b, q)).unwrap();
    let (mut p, mut q) = (sample.frame(), sample.frame());
    let mut direction: Vector3<f64> = sample.of_length(1.0);
    let aside: Vector3<f64> = 0.3 * sample.vector();
    if let Some(lean) = lean {
        let quarters: Vector3<f64> =
            [Vector3::zeros(), Vector3::x(), Vector3::y()][sample.index(3)];
        let small = crate::rotation::exp(&(lean * sample.vector()));
        let turned = crate::rotation::exp(&(std::f64::consts::FRAC_PI_2 * quarters));
        p[3..].copy_from_slice(&GROUND[3..]);
        q[3..].copy_from_slice((small * turned).as_slice());
        if sample.index(2) == 0 {
            direction = [Vector3::x(), Vector3::y(), Vector3::z()][sample.index(3)];
        }
    }
    let (mut least, mut most) = (0.0, 4.0);
    for _ in 0..60 {
        let far = 0.5 * (least + most);
        (0..3).for_each(|i| q[i] = p[i] + aside[i] + far * direction[i]);
        if separate(&p, &q) < gap { least = far } else { most = far }
    }
    (pair, [p, q])
}

/// Of a third of the seeds from 0.1 down to 1e-12; any attitude of the others.
fn lean(seed: u64) -> Option<f64> {
    let power = -1 - (seed / 3 % 12) as i32;
    seed.is_multiple_of(3).then(|| 10.0_f64.powi(power))
}

/// Shapes that are apart: the smallest gap of the features that count is the distance.
#[test]
fn gaps_are_distances_by_duality() {
    for kinds in PAIRS {
        let (mut worst, mut other, mut upright, mut most) = (0.0_f64, 0.0_f64, 0.0_f64, 0);
        let mut of_parts = std::collections::BTreeMap::new();
        for seed in 0..3000 {
            let mut sample = Sample::new(seed);
            let apart_by = [1e-6, 1e-3, 0.1, 1.0][seed as usize % 4];
            let (pair, [p, q]) = placement(kinds, &mut sample, (apart_by, lean(seed)));
            let (found, (feature, gap)) = nearest(&pair, [&p, &q]);
            let contact = pair.contact(feature, &p, &q);
            assert_eq!(contact.gap.to_bits(), gap.to_bits());
            let x = [-0.5, 0.5].map(|part| contact.point + contact.normal * (part * gap));
            let off = outside(&pair.a, &p, &x[0]).max(outside(&pair.b, &q, &x[1]));
            let bound = apart(&pair, [&p, &q], &contact.normal);
            let error = (gap - bound).abs().max(off);
            let sensed = smallest_gap((&pair.a, &p), (&pair.b, &q)).unwrap();
            let of_sensor = (sensed - gap).abs();
            let parts = parts_of(&pair, feature);
            let stands = kinds[0] == OutlineShape::Cylinder && kinds[1] != OutlineShape::Capsule;
            if stands && lean(seed).is_some_and(|lean| lean < 3e-6) {
                // the lowest point of what stands upright is moved to a fixed one, by δ
                assert!(error < 1e-9 && of_sensor < 1e-9, "{kinds:?} {seed}: {error:e}");
                upright = upright.max(error);
                continue;
            }
            assert!(error < 1e-12, "{kinds:?} {seed}: {feature} {gap:e} {bound:e} {off:e}");
            worst = worst.max(error);
            other = other.max(of_sensor);
            most = most.max(found.len());
            *of_parts.entry(parts).or_insert(0) += 1;
        }
        println!(
            "{kinds:?}: distances to {worst:.1e} m, sensors to {other:.1e} m, upright {upright:.1e} m, {most} rows, {of_parts:?}"
        );
        assert!(other < 1e-12, "{kinds:?}: {other:e}");
    }
}

/// Shapes that overlap: no direction separates better, by steps uphill from many directions.
#[test]
fn overlaps_are_the_least_ways_apart() {
    for kinds in PAIRS {
        let (mut worst, mut listed, mut overlaps) = (0.0_f64, 0.0_f64, 0);
        for seed in 0..300 {
            let mut sample = Sample::new(7000 + seed);
            let apart_by = [-1e-9, -1e-4, -0.01, -0.1][seed as usize % 4];
            let (pair, [p, q]) = placement(kinds, &mut sample, (apart_by, lean(seed)));
            let gap = smallest_gap((&pair.a, &p), (&pair.b, &q)).unwrap();
            if gap >= 0.0 {
                continue;
            }
            overlaps += 1;
            let best = uphill(&pair, [&p, &q], &mut sample);
            worst = worst.max(best - gap);
            assert!(best - gap < 1e-12, "{kinds:?} {seed}: {best:e} better than {gap:e}");
            let (_, (feature, least)) = nearest(&pair, [&p, &q]);
            let normal = pair.contact(feature, &p, &q).normal;
            let off = (apart(&pair, [&p, &q], &normal) - gap).abs() / -gap;
            assert!(least <= gap + 1e-9 && least >= 1.03 * gap - 1e-10, "{seed} {least:e} {gap:e}");
            listed = listed.max(off);
        }
        println!("{kinds:?}: {overlaps} overlaps, {worst:.1e} m better, rows to {listed:.1e}");
        assert!(overlaps > 100);
    }
}

/// The largest `s(n)` that steps uphill on the sphere find.
fn uphill(pair: &ShapePair, frames: [&[f64]; 2], sample: &mut Sample) -> f64 {
    let mut best = f64::MIN;
    for _ in 0..60 {
        let mut n: Vector3<f64> = sample.of_length(1.0);
        let (mut value, mut step) = (apart(pair, frames, &n), 0.5);
        while step > 1e-9 {
            let mut improved = false;
            for _ in 0..6 {
                let trial = (n + step * sample.vector()).normalize();
                let own = apart(pair, frames, &trial);
                if own > value {
                    (n, value, improved) = (trial, own, true);
                }
            }
            if !improved {
                step *= 0.6;
            }
        }
        best = best.max(value);
    }
    best
}

/// Exchanged shapes have the same gaps and opposite normals.
#[test]
fn gaps_do_not_depend_on_the_order_of_the_shapes() {
    for kinds in PAIRS {
        let mut worst = 0.0_f64;
        for seed in 0..1000 {
            let mut sample = Sample::new(seed);
            let apart_by = [1e-3, 0.1, -1e-3, 1e-9][seed as usize % 4];
            let (pair, [p, q]) = placement(kinds, &mut sample, (apart_by, lean(seed)));
            let other = ShapePair::new(pair.b.clone(), pair.a.clone()).unwrap();
            let (found, least) = nearest(&pair, [&p, &q]);
            let (exchanged, least_other) = nearest(&other, [&q, &p]);
            let off = (least.1 - least_other.1).abs();
            if off > 1e-14 || found.len() != exchanged.len() {
                println!("{kinds:?} {seed} {apart_by}: {found:?} {exchanged:?}");
                for (own, at) in [(&found, (&pair, &p, &q)), (&exchanged, (&other, &q, &p))] {
                    for (k, gap) in own {
                        println!(
                            "{} {gap} {:?}",
                            parts_of(&pair, *k),
                            at.0.contact(*k, at.1, at.2)
                        );
                    }
                }
            }
            assert!(off < 1e-14, "{kinds:?} {seed}: {off:e}");
            worst = worst.max(off);
            assert_eq!(found.len(), exchanged.len(), "{kinds:?} {seed}");
            let sensed = smallest_gap((&pair.a, &p), (&pair.b, &q)).unwrap();
            let reverse = smallest_gap((&pair.b, &q), (&pair.a, &p)).unwrap();
            worst = worst.max((sensed - reverse).abs());
            if least.1 > 1e-6 {
                let [one, two] =
                    [pair.contact(least.0, &p, &q), other.contact(least_other.0, &q, &p)];
                let turned = (one.normal + two.normal).norm();
                assert!(turned < 1e-9, "{kinds:?} {seed}: {turned:e} {one:?} {two:?}");
            }
        }
        println!("{kinds:?}: exchanged to {worst:.1e} m");
        assert!(worst < 1e-14, "{kinds:?}: {worst:e}");
    }
}

/// The change of each gap that counts along an increment of both frames is its normal row.
#[test]
fn rows_are_gradients() {
    for kinds in PAIRS {
        let (mut worst, mut count) = (0.0_f64, 0);
        for seed in 0..400 {
            let mut sample = Sample::new(seed);
            let apart_by = [0.01, 0.3, -1e-3][seed as usize % 3];
            let (pair, at) = placement(kinds, &mut sample, (apart_by, None));
            for (feature, gap) in nearest(&pair, [&at[0], &at[1]]).0 {
                if gap.abs() < 1e-4 {
                    continue; // tangent edges that meet have a kink
                }
                let error = off_the_gradient(&pair, feature, &at, &mut sample, 1e-6);
                assert!(error < 1e-6, "{kinds:?} {seed} {feature}: {error:e}");
                (worst, count) = (worst.max(error), count + 1);
            }
        }
        println!("{kinds:?}: {count} gradients to {worst:.1e}");
    }
}

/// Frames: turned by a rotation vector and moved.
fn frame(turned: [f64; 3], at: [f64; 3]) -> [f64; FRAME] {
    let mut q = [0.0; FRAME];
    crate::directors::set_frame(&mut q, &at.into(), &crate::rotation::exp(&turned.into()));
    q
}

/// The contacts within a reach of shapes that lie on one another.
fn contacts(a: &ContactShape, b: &ContactShape, q: &[f64; FRAME]) -> Vec<(u32, ContactPoint)> {
    let (pair, mut found) = (ShapePair::new(a.clone(), b.clone()).unwrap(), Vec::new());
    pair.active(&GROUND, q, 1e-3, &mut found);
    found.iter().map(|own| (own.0, pair.contact(own.0, &GROUND, q))).collect()
}

/// What lies or stands on something touches it at points that hold it, whose numbers do not change
/// by rounding.
#[test]
fn what_lies_or_stands_touches_at_several_points() {
    let quarter = std::f64::consts::FRAC_PI_2;
    let (table, log) = (brick([1.0, 1.0, 0.1]), cylinder(0.5, 0.2));
    let beam = brick([2.0, 0.05, 0.1]);
    let lying = ContactShape::Cylinder {
        ends: [-0.5, 0.5].map(|x| Vector3::new(x, 0.0, 0.0)),
        radius: 0.2,
    };
    let pill =
        ContactShape::Capsule { ends: [-0.4, 0.4].map(|x| Vector3::new(x, 0.0, 0.0)), radius: 0.2 };
    let can = cylinder(0.3, 0.25);
    let cases = [
        ("can on table", &table, &can, [0.0; 3], [0.1, 0.2, 0.4], 4),
        ("can on can", &can, &can, [0.0; 3], [0.0, 0.0, 0.6], 4),
        ("can beside can", &can, &can, [0.0; 3], [0.2, 0.0, 0.6], 6),
        ("log on table", &table, &lying, [0.0; 3], [0.1, 0.2, 0.3], 2),
        ("log across a beam", &beam, &lying, [0.0, 0.0, quarter], [0.3, 0.0, 0.3], 2),
        ("log on log", &lying, &lying, [0.0; 3], [0.3, 0.0, 0.4], 2),
        ("log above log", &lying, &lying, [0.0; 3], [0.0, 0.0, 0.4], 2),
        ("log across log", &lying, &lying, [0.0, 0.0, 1.0], [0.0, 0.0, 0.4], 1),
        ("log on can", &can, &lying, [0.0; 3], [0.1, 0.05, 0.5], 2),
        ("pill on log", &lying, &pill, [0.0; 3], [0.2, 0.0, 0.4], 2),
        ("pill on can", &can, &pill, [0.0; 3], [0.0, 0.1, 0.5], 2),
        ("can on beam", &beam, &can, [0.0; 3], [0.0, 0.0, 0.4], 4),
        ("box on can", &can, &brick([0.05, 0.05, 0.1]), [0.0; 3], [0.0, 0.0, 0.4], 4),
        ("pill on table", &table, &pill, [0.0; 3], [0.2, 0.0, 0.3], 2),
        ("pill across a beam", &beam, &pill, [0.0, 0.0, quarter], [0.3, 0.0, 0.3], 2),
        ("log along an edge", &brick([1.0, 0.2, 0.2]), &lying, [0.0; 3], [0.0, 0.32, 0.36], 2),
    ];
    let _ = log;
    for (name, a, b, turned, at, count) in cases {
        let mut known: Option<Vec<u32>> = None;
        for k in 0..20 {
            let mut sample = Sample::new(k);
            let noise = if k == 0 { 0.0 } else { 1e-15 };
            let mut jitter = |x: [f64; 3]| x.map(|x| x + noise * sample.number());
            let q = frame(jitter(turned), jitter(at));
            let found = contacts(a, b, &q);
            let all: Vec<u32> = found.iter().map(|own| own.0).collect();
            let places: Vec<_> = found.iter().map(|own| (own.0, own.1.point, own.1.gap)).collect();
            assert!(found.len() >= count, "{name}: {places:?}");
            let first = known.get_or_insert_with(|| {
                println!("{name}: {} points", all.len());
                all.clone()
            });
            assert_eq!(*first, all, "{name} {k}: {places:?}");
            let gap = smallest_gap((a, &GROUND), (b, &q)).unwrap();
            for (feature, contact) in &found {
                let off = contact.gap - gap;
                assert!(off.abs() < 1e-14, "{name}: {feature} {contact:?} {gap:e}");
            }
        }
    }
}

/// A line that is moved along itself stays the same line: the end of a log that slides past an edge
/// changes no gap of what touches the edge, nor does the edge's end that slides past the log.
#[test]
fn the_end_of_a_line_that_slides_past_changes_no_gap() {
    let lying = ContactShape::Cylinder {
        ends: [-0.5, 0.5].map(|x| Vector3::new(x, 0.0, 0.0)),
        radius: 0.2,
    };
    let block = brick([0.499, 0.3, 0.1]); // its edges are just within the ends of the log
    let pair = ShapePair::new(lying, block).unwrap();
    let mut worst = 0.0_f64;
    let mut count = 0;
    for seed in 0..40 {
        let mut sample = Sample::new(seed);
        let turned = [0.3 * sample.number(), 0.0, 0.0]; // about the log
        let yaw = if seed % 2 == 0 { 0.0 } else { 0.02 * sample.number() };
        let q = frame([turned[0], 0.0, yaw], [0.0, 0.0, 0.3]);
        let mut found = Vec::new();
        pair.active(&GROUND, &q, 1.0, &mut found);
        let whole = |number: &u32| {
            let own =
                Feature::numbered(*number, OutlineShape::Cylinder, OutlineShape::Box).unwrap();
            own.parts == FeatureParts::LineLine && own.own == 0
        };
        let of_lines: Vec<u32> = found.iter().map(|own| own.0).filter(whole).collect();
        for moved in [1e-4, 0.002, 0.02, -0.002] {
            let mut log = GROUND;
            log[0] = moved; // along its axis
            for feature in &of_lines {
                let [before, after] = [&GROUND, &log].map(|at| pair.contact(*feature, at, &q));
                worst = worst.max((before.gap - after.gap).abs());
                worst = worst.max((before.normal - after.normal).norm());
                worst = worst.max((before.point - after.point).norm());
                count += 1;
            }
        }
    }
    println!("{count} gaps of lines that go on: to {worst:.1e} m");
    assert!(worst < 1e-14 && count > 100, "{worst:e} {count}");
}

/// The sensor of two boxes reads their distance: not the gap of a corner and the plane of a face
/// far away from it.
#[test]
fn the_smallest_gap_of_boxes_is_their_distance() {
    let cube = brick([0.5; 3]);
    let pair = [(&cube, &GROUND[..]), (&cube, &GROUND[..])];
    for (at, exact) in [
        ([0.0, 0.0, 1.3], 0.3),
        ([1.3, 1.4, 0.0], 0.5),
        ([1.2, 1.3, 1.6], 0.7),
        ([0.9, 0.0, 0.0], -0.1),
        ([0.95, 0.9, 0.2], -0.05),
    ] {
        let q = frame([0.0; 3], at);
        let gap = smallest_gap(pair[0], (&cube, &q)).unwrap();
        assert!((gap - exact).abs() < 1e-15 * 4.0, "{at:?}: {gap} for {exact}");
    }
    let (mut worst, mut near) = (0.0_f64, 0);
    for seed in 0..400 {
        let mut sample = Sample::new(seed);
        let (pair, [p, q]) =
            placement([OutlineShape::Box, OutlineShape::Box], &mut sample, (0.05, None));
        let gap = smallest_gap((&pair.a, &p), (&pair.b, &q)).unwrap();
        let mut found = Vec::new();
        pair.active(&p, &q, f64::MAX, &mut found);
        let least = found.iter().map(|own| own.1).fold(f64::INFINITY, f64::min);
        near += usize::from((least - gap).abs() < 1e-14);
        let distance = super::tests::nearest_of_boxes(&pair, &p, &q);
        assert!(gap <= distance + 1e-14, "{seed}: {gap} {distance}");
        worst = worst.max((gap - distance).abs());
    }
    println!("distances of boxes to {worst:.1e} m, {near} of features that count");
    assert!(worst < 1e-6 && near > 200, "{worst:e} {near}");
}
