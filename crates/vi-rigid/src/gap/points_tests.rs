//! Points on boxes and cylinders: the face with which each counts, and which of many count.

use super::*;
use crate::directors::FRAME;
use nalgebra::Matrix3;
use vi_testkit::Sample;

fn moved(sample: &mut Sample) -> [f64; FRAME] {
    sample.frame()
}

fn brick(half: [f64; 3]) -> ContactShape {
    let (center, axes) = (Vector3::zeros(), Matrix3::identity());
    ContactShape::Box { center, axes, half_lengths: half.into() }
}

fn can(half: f64, radius: f64) -> ContactShape {
    ContactShape::Cylinder { ends: [-half, half].map(|z| Vector3::new(0.0, 0.0, z)), radius }
}

fn points(points: Vec<Vector3<f64>>) -> ContactShape {
    ContactShape::Points { points, radius: 0.0 }
}

/// The corners of squares of a box of this many squares along each edge, on its surface.
fn grid(half: [f64; 3], squares: usize) -> Vec<Vector3<f64>> {
    let place = |k: usize| 2.0 * k as f64 / squares as f64 - 1.0;
    let count = squares + 1;
    let all = (0..count * count * count).map(|k| [k % count, k / count % count, k / count / count]);
    let on_face = all.filter(|own| own.iter().any(|k| *k == 0 || *k == squares));
    on_face.map(|own| Vector3::from_fn(|i, _| place(own[i]) * half[i])).collect()
}

/// A frame seen from another one, as one in space: `of` on `base`.
fn on(base: &[f64; FRAME], of: &[f64; FRAME]) -> [f64; FRAME] {
    let mut out = [0.0; FRAME];
    for i in 0..4 {
        let part = Vector3::new(of[3 * i], of[3 * i + 1], of[3 * i + 2]);
        let own = if i == 0 { in_space(base, &part) } else { turned(base, &part) };
        out[3 * i..3 * i + 3].copy_from_slice(own.as_slice());
    }
    out
}

fn at(x: [f64; 3]) -> [f64; FRAME] {
    let mut frame = GROUND;
    frame[..3].copy_from_slice(&x);
    frame
}

/// By the rule of a solid in its own components: which face a point has passed, none outside.
fn passed_face(solid: &ContactShape, from: Vector3<f64>, to: Vector3<f64>) -> Option<u32> {
    let outside = |x: &Vector3<f64>| -> Vec<u32> {
        let faces: Vec<(f64, u32)> = match solid {
            ContactShape::Box { half_lengths, .. } => (0..3)
                .flat_map(|i| {
                    [(x[i] - half_lengths[i], 2 * i), (-x[i] - half_lengths[i], 2 * i + 1)]
                })
                .map(|(s, f)| (s, f as u32))
                .collect(),
            ContactShape::Cylinder { ends, radius } => {
                vec![(x.z - ends[1].z, 0), (ends[0].z - x.z, 1), (x.x.hypot(x.y) - radius, 2)]
            }
            _ => unreachable!(),
        };
        faces.iter().filter(|(s, _)| *s > 0.0).map(|(_, f)| *f).collect()
    };
    let steps = 4000;
    let mut last = outside(&from);
    for k in 1..=steps {
        let now = outside(&(from + (to - from) * (f64::from(k) / f64::from(steps))));
        if now.is_empty() && !last.is_empty() {
            return last.first().copied().filter(|_| outside(&to).is_empty());
        }
        last = now;
    }
    None
}

/// A point that comes into a solid counts with the face that it has passed last, however far it
/// goes; one that stays outside has a positive gap.
#[test]
fn a_point_counts_with_the_face_that_it_has_passed() {
    let (mut inside, mut outside, mut unlike) = (0, 0, 0);
    for seed in 0..2000 {
        let mut sample = Sample::new(seed);
        let base = moved(&mut sample);
        let solid = if seed % 2 == 0 { brick([0.5, 0.3, 0.04]) } else { can(0.3, 0.4) };
        let [from, to]: [Vector3<f64>; 2] = [sample.vector(), 0.5 * sample.vector()];
        let pair = ShapePair::new(solid.clone(), points(vec![Vector3::zeros()])).unwrap();
        let frames = [from, to].map(|x| on(&base, &at(x.into())));
        let mut found = Vec::new();
        let [p, q] = [&frames[0], &frames[1]].map(|frame| &frame[..]);
        pair.active_in_step([&base; 2], [p, q], f64::MAX, &mut found);
        let [(feature, gap)] = found[..] else { panic!("{found:?}") };
        let is_outside = match &solid {
            ContactShape::Box { half_lengths, .. } => {
                (0..3).any(|i| from[i].abs() > half_lengths[i])
            }
            _ => from.z.abs() > 0.3 || from.x.hypot(from.y) > 0.4,
        };
        match passed_face(&solid, from, to) {
            _ if !is_outside => {}
            None => {
                assert!(gap > 0.0, "seed {seed}: {gap}");
                outside += 1;
            }
            Some(face) => {
                assert!(gap < 0.0, "seed {seed}: {gap}");
                inside += 1;
                // how far a point is from the side of a cylinder is not linear along its way
                assert!(feature == face || seed % 2 == 1, "seed {seed}: {feature} for {face}");
                unlike += usize::from(feature != face);
            }
        }
    }
    println!("{inside} come in, {outside} stay outside, {unlike} with another face");
    assert!(inside > 300 && outside > 300 && unlike * 50 < inside, "{inside} {outside} {unlike}");
}

/// Above a face and inside, a point has the gap and the normal of a ball without a radius.
#[test]
fn a_point_is_a_ball_without_a_radius() {
    let mut counted = 0;
    for seed in 0..2000 {
        let mut sample = Sample::new(seed);
        let base = moved(&mut sample);
        let shape = if seed % 2 == 0 { brick([0.5, 0.3, 0.2]) } else { can(0.3, 0.4) };
        let x = 0.6 * sample.vector();
        let frame = on(&base, &at(x.into()));
        let pair = ShapePair::new(shape.clone(), points(vec![Vector3::zeros()])).unwrap();
        let ball = Solid::in_space(&shape, &base[..])
            .unwrap()
            .contact(&in_space(&frame, &Vector3::<f64>::zeros()), 0.0);
        let mut found = Vec::new();
        pair.active(&base, &frame, f64::MAX, &mut found);
        let contact = pair.contact(found[0].0, &base, &frame);
        if found[0].1 > 0.0 && ball.gap > found[0].1 + 1e-12 {
            continue; // next to an edge
        }
        counted += 1;
        assert!((contact.gap - ball.gap).abs() < 1e-14, "seed {seed}");
        assert!((contact.normal - ball.normal).norm() < 1e-14, "seed {seed}");
        assert!((contact.point - ball.point).norm() < 1e-14, "seed {seed}");
        let exchanged = ShapePair::new(pair.shapes()[1].clone(), shape).unwrap();
        let other = exchanged.contact(found[0].0, &frame, &base).exchanged();
        assert_eq!(
            (other.gap, other.normal, other.point),
            (contact.gap, contact.normal, contact.point)
        );
    }
    assert!(counted > 1000, "{counted}");
}

/// A body whose corners are on edges and corners of a solid stands on a face of it: also after a
/// step that goes through it, and where it slides down a side it is beside that.
#[test]
fn corners_on_edges_stand_on_a_face() {
    let ring = |count: usize| {
        let turn = |k: usize| std::f64::consts::TAU * k as f64 / count as f64;
        let both = (0..count).flat_map(move |k| [-0.1, 0.1].map(|z| (turn(k), z)));
        both.map(|(t, z)| Vector3::new(0.3 * t.cos(), 0.3 * t.sin(), z)).collect::<Vec<_>>()
    };
    let cube = || grid([0.3, 0.3, 0.1], 1);
    for seed in 0..200 {
        let mut sample = Sample::new(seed);
        let base = moved(&mut sample);
        let features_of =
            |shape: &ContactShape, of: Vec<Vector3<f64>>, from: [f64; 3], to: [f64; 3]| {
                let pair = ShapePair::new(shape.clone(), points(of)).unwrap();
                let frames = [from, to].map(|x| on(&base, &at(x)));
                let mut found = Vec::new();
                pair.active_in_step([&base; 2], [&frames[0][..], &frames[1]], 1e-3, &mut found);
                found
            };
        let box_solid = brick([0.3, 0.3, 0.2]);
        let top = 4; // of a box
        for (fall, depth) in [(0.0, 0.0), (0.004, 0.005), (0.004, 0.0)] {
            let (from, to) = ([0.0, 0.0, 0.3 + fall], [0.0, 0.0, 0.3 - depth]);
            let found = features_of(&box_solid, cube(), from, to);
            let on_top =
                found.iter().filter(|(f, gap)| f % 6 == top && (gap + depth).abs() < 1e-14);
            assert_eq!((on_top.count(), found.len()), (4, 4), "seed {seed}: {found:?}");
            let found = features_of(&can(0.2, 0.3), ring(24), from, to);
            let on_top = found.iter().filter(|(f, gap)| f % 3 == 0 && (gap + depth).abs() < 1e-14);
            assert_eq!((on_top.count(), found.len()), (24, 24), "seed {seed}: {found:?}");
        }
        // a cube that slides down beside the box, its lower corners past the upper edge
        let found = features_of(&box_solid, cube(), [0.6, 0.0, 0.301], [0.6, 0.0, 0.299]);
        let beside = found.iter().filter(|(f, gap)| f % 6 == 0 && gap.abs() < 1e-14);
        assert_eq!((beside.count(), found.len()), (2, 2), "seed {seed}: {found:?}");
    }
}

/// Of a face with many corners those count that hold the others between them; the least gap is
/// always that of a corner that counts.
#[test]
fn of_many_points_at_most_32_count() {
    let cube = points(grid([0.2, 0.3, 0.1], 12));
    let plane = ContactShape::Plane { point: Vector3::zeros(), normal: Vector3::z() };
    let ball = ContactShape::sphere(Vector3::zeros(), 0.2);
    for other in [plane, ball, brick([1.0, 1.0, 0.2]), can(0.2, 1.0)] {
        let height = if matches!(other, ContactShape::Plane { .. }) { 0.1 } else { 0.3 };
        let pair = ShapePair::new(other.clone(), cube.clone()).unwrap();
        let ContactShape::Points { points: corners, .. } = &cube else { unreachable!() };
        let each = pair.features() / corners.len() as u32;
        for seed in 0..40 {
            let mut sample = Sample::new(seed);
            let tilt = if seed < 20 { Vector3::zeros() } else { 0.2 * sample.vector() };
            let (mut frame, turn) =
                (at([0.0, 0.0, height + 0.05 * sample.number()]), crate::rotation::exp(&tilt));
            frame[3..].copy_from_slice(turn.as_slice());
            let (base, mut found) = (moved(&mut sample), Vec::new());
            let frame = on(&base, &frame);
            pair.active(&base, &frame, f64::MAX, &mut found);
            assert!(found.len() <= 32 && found.is_sorted_by_key(|own| own.0), "{found:?}");
            let least = found.iter().map(|own| own.1).fold(f64::INFINITY, f64::min);
            let single = |x: &Vector3<f64>| {
                let (pair, mut own) =
                    (ShapePair::new(other.clone(), points(vec![*x])).unwrap(), Vec::new());
                pair.active(&base, &frame, f64::MAX, &mut own);
                own[0].1
            };
            let all = corners.iter().map(single).fold(f64::INFINITY, f64::min);
            assert!((least - all).abs() < 1e-13, "{} seed {seed}: {least} for {all}", other.name());
            if seed < 20 && other.name() != "sphere" {
                let deep = found.iter().filter(|own| own.1 < least + 1e-12);
                let ends = deep.filter(|own| {
                    let x = corners[(own.0 / each) as usize];
                    x.x.abs() > 0.2 - 1e-12 && x.y.abs() > 0.3 - 1e-12
                });
                assert_eq!(ends.count(), 4, "{} seed {seed}: {found:?}", other.name());
            }
        }
    }
}

/// At places whose squares overflow, too, a point counts with a face that there is.
#[test]
fn places_that_overflow_have_a_face() {
    for solid in [can(0.2, 0.3), brick([0.1, 0.2, 0.3])] {
        for far in [1e41, 1e160, 1e308, f64::NAN] {
            let pair = ShapePair::new(solid.clone(), points(grid([0.1; 3], 6))).unwrap();
            let mut found = Vec::new();
            pair.active(&GROUND, &at([far, -far, far]), f64::MAX, &mut found);
            assert!(found.iter().all(|own| own.0 < pair.features()), "{far}: {found:?}");
        }
    }
}
