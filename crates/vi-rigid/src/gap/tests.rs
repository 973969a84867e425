use super::*;
use crate::directors::FRAME;
use crate::reparametrization::reparametrize;
use box_box::PlacedBox;
use nalgebra::Matrix3;
use vi_testkit::Sample;

fn unit(sample: &mut Sample) -> Vector3<f64> {
    sample.of_length(1.0)
}

fn axes(sample: &mut Sample) -> Matrix3<f64> {
    crate::rotation::exp(&sample.of_length(1.3))
}

/// The corners of a box.
fn corners(center: Vector3<f64>, axes: &Matrix3<f64>, lengths: [f64; 3]) -> ContactShape {
    let corner = |k: usize| {
        let side = |i: usize| if k >> i & 1 == 1 { 0.5 } else { -0.5 };
        center + axes * Vector3::from_fn(|i, _| side(i) * lengths[i])
    };
    ContactShape::Points { points: (0..8).map(corner).collect(), radius: 0.0 }
}

/// Pairs of every kind, with a shift of B that keeps them apart.
fn pairs(sample: &mut Sample) -> Vec<ShapePair> {
    let plane = ContactShape::Plane { point: sample.vector(), normal: unit(sample) };
    let box_axes = axes(sample);
    let corners = corners(sample.vector(), &box_axes, [0.4, 0.6, 0.8]);
    let ball = ContactShape::sphere(sample.vector(), 0.3);
    let small = ContactShape::sphere(sample.vector(), 0.1);
    let ends = [sample.vector(), sample.vector()];
    let capsule = ContactShape::Capsule { ends, radius: 0.2 };
    let ends = [sample.vector(), sample.vector()];
    let other = ContactShape::Capsule { ends, radius: 0.1 };
    let half_axes = Vector3::new(0.3, 0.5, 0.9);
    let ellipsoid =
        ContactShape::Ellipsoid { center: sample.vector(), axes: axes(sample), half_axes };
    let brick = ContactShape::Box {
        center: sample.vector(),
        axes: axes(sample),
        half_lengths: Vector3::new(0.2, 0.3, 0.4),
    };
    let (half_lengths, other_axes) = (Vector3::new(0.5, 0.1, 0.3), axes(sample));
    let slab = ContactShape::Box { center: sample.vector(), axes: other_axes, half_lengths };
    let ends = [sample.vector(), sample.vector()];
    let roller = ContactShape::Cylinder { ends, radius: 0.25 };
    let balls = ContactShape::Points {
        points: (0..4).map(|_| 0.3 * sample.vector()).collect(),
        radius: 0.05,
    };
    [
        (plane.clone(), corners.clone()),
        (plane.clone(), ball.clone()),
        (capsule.clone(), plane.clone()),
        (ellipsoid, plane.clone()),
        (ball.clone(), small.clone()),
        (ball.clone(), capsule.clone()),
        (capsule.clone(), other),
        (plane.clone(), brick.clone()),
        (roller.clone(), plane),
        (brick.clone(), small.clone()),
        (roller.clone(), small),
        (balls.clone(), brick.clone()),
        (capsule, corners.clone()),
        (corners.clone(), brick.clone()),
        (roller.clone(), corners),
        (brick, slab),
        (balls, roller),
    ]
    .map(|(a, b)| ShapePair::new(a, b).unwrap())
    .into()
}

/// Those that count in a configuration.
fn active_features(pair: &ShapePair, [p, q]: &[[f64; FRAME]; 2]) -> Vec<u32> {
    let mut active = Vec::new();
    pair.active(p, q, f64::MAX, &mut active);
    active.iter().map(|(feature, _)| *feature).collect()
}

fn frames(sample: &mut Sample) -> [[f64; FRAME]; 2] {
    let (a, mut b) = (sample.frame(), sample.frame());
    b[0] += 6.0;
    [a, b]
}

/// By how much the change of a gap along an increment of both frames, by central differences of
/// this step, is off `B_n`.
pub(super) fn off_the_gradient(
    pair: &ShapePair,
    feature: u32,
    at: &[[f64; FRAME]; 2],
    sample: &mut Sample,
    step: f64,
) -> f64 {
    let contact = pair.contact(feature, &at[0], &at[1]);
    let twists: [[f64; 6]; 2] = [sample.array(), sample.array()];
    let mut rate = 0.0;
    for (body, sign) in [(0, -1.0), (1, 1.0)] {
        let mut velocity = [0.0; FRAME];
        let twist = nalgebra::SVector::from(twists[body]);
        crate::null_space::push_forward(&at[body], &twist, &mut velocity);
        let row = row(&at[body], &contact.point, &contact.normal);
        rate += sign * (0..FRAME).map(|k| row[k] * velocity[k]).sum::<f64>();
    }
    let gap = |scale: f64| {
        let moved = [0, 1].map(|body| {
            let (mut q, mut dq) = ([0.0; FRAME], [0.0; FRAME]);
            let u = twists[body].map(|u| u * scale);
            reparametrize(&u, &at[body], &mut q, &mut dq).unwrap();
            q
        });
        pair.contact(feature, &moved[0], &moved[1]).gap
    };
    ((gap(step) - gap(-step)) / (2.0 * step) - rate).abs()
}

/// The change of each gap is its normal row.
#[test]
fn the_normal_row_is_the_gradient_of_the_gap() {
    let mut worst = 0.0_f64;
    for seed in 0..200 {
        let mut sample = Sample::new(seed);
        for pair in pairs(&mut sample) {
            let at = frames(&mut sample);
            for feature in active_features(&pair, &at) {
                let error = off_the_gradient(&pair, feature, &at, &mut sample, 1e-5);
                assert!(error < 1e-7, "seed {seed}: {pair:?} {feature}: {error:e}");
                worst = worst.max(error);
            }
        }
    }
    println!("gradients to {worst:.1e}");
}

/// The gap of the exchanged shapes is the same to rounding errors, the normal has the other sign.
#[test]
fn a_gap_does_not_depend_on_the_order_of_the_shapes() {
    for seed in 0..500 {
        let mut sample = Sample::new(seed);
        for pair in pairs(&mut sample) {
            let [p, q] = frames(&mut sample);
            let exchanged = ShapePair::new(pair.b.clone(), pair.a.clone()).unwrap();
            for feature in active_features(&pair, &[p, q]) {
                let boxes = pair.shapes().iter().all(|shape| shape.name() == "box");
                let capsules = pair.shapes().iter().all(|shape| shape.name() == "capsule");
                let turned = match (boxes, feature) {
                    (_, 1 | 2) if capsules => feature + 2, // ends of A
                    (_, 3 | 4) if capsules => feature - 2,
                    (true, 0..48) => feature + 48,
                    (true, 48..96) => feature - 48,
                    (true, _) => 96 + (feature - 96) % 12 * 12 + (feature - 96) / 12,
                    _ => feature,
                };
                let one = pair.contact(feature, &p, &q);
                let other = exchanged.contact(turned, &q, &p).exchanged();
                let counts = active_features(&exchanged, &[q, p]).contains(&turned);
                assert!(counts, "{pair:?} {feature}");
                assert!((one.gap - other.gap).abs() < 1e-15 * 8.0, "{pair:?}");
                assert!((one.normal - other.normal).norm() < 1e-14);
                assert!((one.point - other.point).norm() < 1e-14);
            }
        }
    }
}

/// Gaps by the distance of many points on both shapes.
#[test]
fn gaps_are_the_least_distances() {
    for seed in 0..20 {
        let mut sample = Sample::new(seed);
        let [p, q] = frames(&mut sample);
        for pair in pairs(&mut sample) {
            let mut active = Vec::new();
            pair.active(&p, &q, f64::MAX, &mut active);
            let found = active.iter().map(|(_, gap)| *gap).fold(f64::INFINITY, f64::min);
            let [a, b] = pair.shapes().map(ContactShape::name);
            let of_points = |of: &ContactShape| matches!(of, ContactShape::Points { radius, .. } if *radius == 0.0);
            let is_edged = |name: &str| name == "box" || name == "cylinder";
            if (a == "box" && b == "box")
                || pair.shapes().iter().any(|own| of_points(own))
                    && [a, b].iter().any(|own| is_edged(own))
            {
                continue; // gaps of lines and planes: tested where they touch
            }
            let least = sampled(&pair, &p, &q);
            assert!(found <= least + 1e-12 && found > least - 0.02, "{pair:?} {found} {least}");
        }
    }
}

/// Points of a shape in space, with the radius about them.
fn cloud(shape: &ContactShape, frame: &[f64]) -> (Vec<Vector3<f64>>, f64) {
    let count = 200;
    let (points, radius) = match shape {
        ContactShape::Points { points, radius } => (points.clone(), *radius),
        ContactShape::Capsule { ends, radius } => {
            let at = |k: usize| ends[0] + (ends[1] - ends[0]) * (k as f64 / count as f64);
            ((0..=count).map(at).collect(), *radius)
        }
        ContactShape::Ellipsoid { center, axes, half_axes } => {
            let direction = |i: usize, j: usize| {
                let (polar, turn) = (
                    std::f64::consts::PI * i as f64 / 100.0,
                    std::f64::consts::TAU * j as f64 / 100.0,
                );
                Vector3::new(polar.sin() * turn.cos(), polar.sin() * turn.sin(), polar.cos())
            };
            let places = (0..=100).flat_map(|i| (0..100).map(move |j| (i, j)));
            let at = |(i, j)| center + axes * direction(i, j).component_mul(half_axes);
            (places.map(at).collect(), 0.0)
        }
        ContactShape::Box { center, axes, half_lengths } => {
            let side = |k: usize| k as f64 / 8.0 - 1.0;
            let places =
                (0..17 * 17 * 17).map(|k| [side(k % 17), side(k / 17 % 17), side(k / 289)]);
            let on_face = places.filter(|place| place.iter().any(|x| x.abs() > 0.999));
            let at = |x: [f64; 3]| center + axes * Vector3::from(x).component_mul(half_lengths);
            (on_face.map(at).collect(), 0.0)
        }
        ContactShape::Cylinder { ends, radius } => {
            let along = (ends[1] - ends[0]).normalize();
            let first = solids::perpendicular(&along);
            let second = along.cross(&first);
            let at = |k: usize| {
                let (turn, place) = (std::f64::consts::TAU * (k % 80) as f64 / 80.0, k / 80);
                let (part, size) = match place {
                    0..=20 => (place as f64 / 20.0, 1.0),
                    _ => (f64::from(u8::from(place % 2 == 0)), (place - 20) as f64 / 20.0),
                };
                let across = first * turn.cos() + second * turn.sin();
                ends[0] + (ends[1] - ends[0]) * part + across * (*radius * size)
            };
            ((0..80 * 41).map(at).collect(), 0.0)
        }
        ContactShape::Plane { .. } => unreachable!(),
    };
    (points.iter().map(|point| contact_point::in_space(frame, point)).collect(), radius)
}

fn sampled(pair: &ShapePair, p: &[f64], q: &[f64]) -> f64 {
    let (plane, other) = match (&pair.a, &pair.b) {
        (ContactShape::Plane { point, normal }, other) => (Some((point, normal, p)), (other, q)),
        (other, ContactShape::Plane { point, normal }) => (Some((point, normal, q)), (other, p)),
        (a, _) => (None, (a, p)),
    };
    let (points, radius) = cloud(other.0, other.1);
    if let Some((point, normal, frame)) = plane {
        let plane = points_plane::Plane::in_space(point, normal, frame);
        let height = |x: &Vector3<f64>| plane.normal.dot(&(x - plane.point)) - radius;
        return points.iter().map(height).fold(f64::INFINITY, f64::min);
    }
    let (others, more) = cloud(&pair.b, q);
    let distances = points.iter().flat_map(|x| others.iter().map(move |y| (x - y).norm()));
    distances.fold(f64::INFINITY, f64::min) - radius - more
}

/// A capsule that lies on another one touches it at both ends of the overlap.
#[test]
fn parallel_capsules_touch_at_the_ends_of_their_overlap() {
    let capsule = |from: f64, to: f64| ContactShape::Capsule {
        ends: [Vector3::new(from, 0.0, 0.0), Vector3::new(to, 0.0, 0.0)],
        radius: 0.1,
    };
    let pair = ShapePair::new(capsule(0.0, 1.0), capsule(0.4, 2.0)).unwrap();
    let (mut above, mut found) = (GROUND, Vec::new());
    above[2] = 0.5;
    pair.active(&GROUND, &above, f64::MAX, &mut found);
    let features: Vec<u32> = found.iter().map(|(feature, _)| *feature).collect();
    assert_eq!(features, [2, 3]); // the last end of A, the first one of B
    for (feature, x) in [(0, 0.7), (2, 1.0), (3, 0.4), (5 + 717, 717.0 / 1024.0)] {
        let contact = pair.contact(feature, &GROUND, &above);
        assert!((contact.point.x - x).abs() < 1e-15 && (contact.gap - 0.3).abs() < 1e-15);
    }
}

/// A feature that counts at one end of a step has a gap at the other one, though it does not count
/// there: capsules that turn off each other, a cylinder that falls over.
#[test]
fn a_gap_is_smooth_beyond_where_its_feature_counts() {
    let along = |half: f64| [Vector3::new(-half, 0.0, 0.0), Vector3::new(half, 0.0, 0.0)];
    let capsule = |half: f64| ContactShape::Capsule { ends: along(half), radius: 0.1 };
    let upright = [Vector3::new(0.0, 0.0, -0.2), Vector3::new(0.0, 0.0, 0.2)];
    let drum = ContactShape::Cylinder { ends: upright, radius: 0.3 };
    let floor = ContactShape::Plane { point: Vector3::zeros(), normal: Vector3::z() };
    for (pair, height, axis) in [
        (ShapePair::new(capsule(0.5), capsule(0.5)).unwrap(), 0.2, 2),
        (ShapePair::new(capsule(0.5), capsule(0.3)).unwrap(), 0.2, 1),
        (ShapePair::new(floor.clone(), drum.clone()).unwrap(), 0.2, 0),
        (ShapePair::new(drum, floor).unwrap(), -0.2, 1),
    ] {
        let (mut q, mut dq, mut found, mut last) = (GROUND, GROUND, Vec::new(), Vec::new());
        q[2] = height;
        pair.active(&GROUND, &q, f64::MAX, &mut found);
        assert!(found.len() > 1, "{found:?}");
        let start = q;
        for k in 0..=40 {
            let angle = 0.01 * f64::from(k);
            let mut u = [0.0; 6];
            u[3 + axis] = angle;
            reparametrize(&u, &start, &mut q, &mut dq).unwrap();
            let gaps = found.iter().map(|own| pair.contact(own.0, &GROUND, &q).gap);
            let gaps: Vec<f64> = gaps.collect();
            if k > 0 {
                let jump = gaps.iter().zip(&last).map(|(a, b): (&f64, &f64)| (a - b).abs());
                let most = jump.fold(0.0, f64::max);
                assert!(most < 0.01, "{pair:?} at {angle}: {gaps:?} after {last:?}");
            }
            last = gaps;
        }
        let mut now = Vec::new();
        pair.active(&GROUND, &q, f64::MAX, &mut now);
        assert!(now.len() < found.len(), "{now:?}");
    }
}

/// Rolling without slip: a ball that turns about the normal, too, has no mean displacement at the
/// contact, to the third order of the step.
#[test]
fn the_slip_of_a_rolling_ball_is_of_third_order() {
    let radius = 0.2;
    let slip = |h: f64| {
        let omega = Vector3::new(0.7, -1.1, 4.0);
        let mut q0 = GROUND;
        q0[2] = radius;
        let velocity = omega.cross(&Vector3::new(0.0, 0.0, radius));
        let u: [f64; 6] =
            std::array::from_fn(|k| h * if k < 3 { velocity[k] } else { omega[k - 3] });
        let (mut q1, mut dq) = ([0.0; FRAME], [0.0; FRAME]);
        reparametrize(&u, &q0, &mut q1, &mut dq).unwrap();
        let foot = |q: &[f64; FRAME]| Vector3::new(q[0], q[1], 0.0);
        displacement([(&q0, &foot(&q0)), (&q1, &foot(&q1))], &dq).xy().norm()
    };
    let (coarse, fine) = (slip(0.02), slip(0.01));
    println!("{coarse:.2e} {fine:.2e}");
    assert!((coarse / fine).log2() > 2.9, "{coarse:e} {fine:e}");
}

/// The displacement of a point that stays in contact is that of the point.
#[test]
fn the_displacement_of_one_material_point() {
    let mut sample = Sample::new(4);
    let q0 = sample.frame();
    let (mut q1, mut dq) = ([0.0; FRAME], [0.0; FRAME]);
    reparametrize(&sample.array::<6>(), &q0, &mut q1, &mut dq).unwrap();
    let corner = sample.vector();
    let [x0, x1] = [&q0, &q1].map(|q| contact_point::in_space(q, &corner));
    let moved = displacement([(&q0, &x0), (&q1, &x1)], &dq);
    assert!((moved - (x1 - x0)).norm() < 1e-15 * 10.0);
}

#[test]
fn tangents_are_a_right_handed_triad() {
    let mut sample = Sample::new(9);
    for _ in 0..100 {
        let normal = unit(&mut sample);
        let [t1, t2] = tangents(&normal);
        assert!((t1.cross(&t2) - normal).norm() < 1e-15 * 4.0 && t1.dot(&normal).abs() < 1e-15);
    }
    assert_eq!(tangents(&Vector3::z()), [Vector3::x(), Vector3::y()]);
}

#[test]
fn shapes_without_a_formula_are_refused() {
    let plane = ContactShape::Plane { point: Vector3::zeros(), normal: Vector3::z() };
    let ellipsoid = ContactShape::Ellipsoid {
        center: Vector3::zeros(),
        axes: Matrix3::identity(),
        half_axes: Vector3::new(1.0, 2.0, 3.0),
    };
    let ball = ContactShape::sphere(Vector3::zeros(), 1.0);
    // whether there is a gap is asked before the points of a mesh are known
    let none = ContactShape::Points { points: Vec::new(), radius: 0.0 };
    assert!(has_gap(&plane, &none) && has_gap(&none, &ball) && !has_gap(&none, &ellipsoid));
    for (a, b) in [(&plane, &plane), (&ellipsoid, &ball), (&ball, &ellipsoid)] {
        let refused = ShapePair::new(a.clone(), b.clone()).unwrap_err();
        assert_eq!((refused.a, refused.b), (a.name(), b.name()));
    }
}

/// The gap of two boxes is the distance of the nearest points of both, next to each other in any
/// attitude: by projected gradients on the coefficients of the points.
#[test]
fn gaps_of_boxes_are_distances() {
    let (mut worst, mut kinds) = (0.0_f64, [0; 3]);
    for seed in 0..800 {
        let mut sample = Sample::new(seed);
        let half = |sample: &mut Sample| sample.vector().map(|x: f64| 0.2 + 0.3 * x.abs());
        let [a, b] = [0, 1].map(|_| {
            let half_lengths = half(&mut sample);
            ContactShape::Box { center: Vector3::zeros(), axes: axes(&mut sample), half_lengths }
        });
        let pair = ShapePair::new(a, b).unwrap();
        let [p, mut q] = [GROUND, GROUND];
        let direction = unit(&mut sample);
        // moved off until they are 0.01 apart along the direction that separates them best
        let mut far = 3.0;
        for _ in 0..60 {
            (0..3).for_each(|i| q[i] = far * direction[i]);
            let mut active = Vec::new();
            pair.active(&p, &q, f64::MAX, &mut active);
            let gap = active.iter().map(|(_, gap)| *gap).fold(f64::INFINITY, f64::min);
            if !gap.is_finite() || (gap - 0.01).abs() < 1e-9 {
                break;
            }
            far -= gap - 0.01;
        }
        let mut active = Vec::new();
        pair.active(&p, &q, f64::MAX, &mut active);
        let distance = nearest_of_boxes(&pair, &p, &q);
        let Some((feature, gap)) = active.iter().min_by(|a, b| a.1.total_cmp(&b.1)) else {
            continue; // a corner beside the face: the nearest features are a corner and an edge
        };
        if distance > gap + 1e-6 {
            continue; // likewise, the gap is that of a plane
        }
        kinds[if *feature < 48 {
            0
        } else if *feature < 96 {
            1
        } else {
            2
        }] += 1;
        worst = worst.max((gap - distance).abs());
    }
    println!("corners of B, of A, edges: {kinds:?}, gaps to {worst:.1e}");
    assert!(kinds.iter().all(|kind| *kind > 20) && worst < 1e-6, "{kinds:?} {worst:e}");
}

/// The distance of two boxes, by projected steps.
pub(super) fn nearest_of_boxes(pair: &ShapePair, p: &[f64], q: &[f64]) -> f64 {
    let [a, b] = [(0, p), (1, q)].map(|(k, frame)| pair.shapes()[k].place(frame).unwrap());
    let clamp = |(center, axes, half): &PlacedBox, x: &Vector3<f64>| {
        let y = axes.tr_mul(&(x - center));
        center + axes * Vector3::from_fn(|i, _| y[i].clamp(-half[i], half[i]))
    };
    let mut x = a.0;
    for _ in 0..20_000 {
        x = clamp(&a, &clamp(&b, &x));
    }
    (x - clamp(&b, &x)).norm()
}

/// A box that stands on a box has the corners above the face, and where both cross the four places
/// where their edges do.
#[test]
fn boxes_on_boxes_stand_on_four_points() {
    let brick = |half: [f64; 3]| ContactShape::Box {
        center: Vector3::zeros(),
        axes: Matrix3::identity(),
        half_lengths: half.into(),
    };
    let active = |a: [f64; 3], b: [f64; 3], at: [f64; 3]| {
        let (pair, mut q, mut found) =
            (ShapePair::new(brick(a), brick(b)).unwrap(), GROUND, Vec::new());
        q[..3].copy_from_slice(&at);
        pair.active(&GROUND, &q, 1e-3, &mut found);
        let place = |feature: u32| pair.contact(feature, &GROUND, &q);
        found.iter().map(|(feature, _)| (*feature, place(*feature))).collect::<Vec<_>>()
    };
    let small_on_large = active([1.0, 1.0, 0.2], [0.3, 0.4, 0.2], [0.1, 0.0, 0.4 + 1e-4]);
    let large_on_small = active([0.3, 0.4, 0.2], [1.0, 1.0, 0.2], [0.1, 0.0, 0.4 + 1e-4]);
    let planks = active([1.0, 0.1, 0.05], [0.1, 1.0, 0.05], [0.0, 0.0, 0.1 + 1e-4]);
    let apart = active([1.0, 0.1, 0.05], [0.1, 1.0, 0.05], [0.0, 0.0, 0.2]);
    for (found, kind) in [(&small_on_large, 0..48), (&large_on_small, 48..96), (&planks, 96..240)] {
        assert_eq!(found.len(), 4, "{found:?}");
        for (feature, contact) in found {
            assert!(kind.contains(feature), "{feature}");
            assert!((contact.gap - 1e-4).abs() < 1e-15, "{contact:?}");
            assert!((contact.normal - Vector3::z()).norm() < 1e-15, "{contact:?}");
        }
    }
    let corners: f64 = planks.iter().map(|(_, c)| c.point.xy().norm() - 0.02_f64.sqrt()).sum();
    assert!(corners.abs() < 1e-14 && apart.is_empty());
}

/// A cylinder lies on its side on two lowest points, and stands on four of a rim.
#[test]
fn a_cylinder_lies_or_stands() {
    let plane = ContactShape::Plane { point: Vector3::zeros(), normal: Vector3::z() };
    let roller = |along: Vector3<f64>| {
        let ends = [-0.5 * along, 0.5 * along];
        ShapePair::new(plane.clone(), ContactShape::Cylinder { ends, radius: 0.3 }).unwrap()
    };
    for (along, height, count) in [(Vector3::x(), 0.3, 2), (Vector3::z(), 0.5, 4)] {
        let (mut q, mut found) = (GROUND, Vec::new());
        q[2] = height;
        roller(along).active(&GROUND, &q, 1e-3, &mut found);
        assert_eq!(found.len(), count, "{found:?}");
        assert!(found.iter().all(|(_, gap)| gap.abs() < 1e-15), "{found:?}");
    }
}

/// Rounding of a normal along an axis, or in the middle between two, does not turn the tangents.
#[test]
fn tangents_do_not_turn_by_rounding() {
    let d = std::f64::consts::FRAC_1_SQRT_2;
    for normal in [[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [d, d, 0.0], [d, 0.0, d]] {
        let normal = Vector3::from(normal);
        let exact = tangents(&normal);
        for k in 0..27 {
            let off = [k % 3, k / 3 % 3, k / 9].map(|digit| 1e-12 * (f64::from(digit) - 1.0));
            let near = tangents(&(normal + Vector3::from(off)).normalize());
            for (a, b) in exact.iter().zip(&near) {
                assert!((a - b).norm() < 1e-11, "{normal} {off:?}");
            }
        }
    }
}
