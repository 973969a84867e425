use super::super::compliant_change::CompliantChange;
use super::*;
use crate::design::ForceChange as _;
use nalgebra::{DMatrix, Rotation3};
use vi_core::Motion;
use vi_core::force::MidpointForce;
use vi_core::interval::Interval;
use vi_testkit::slope_error;

const LAW: CompliantLaw = CompliantLaw {
    stiffness: 40.0,
    exponent: 1.5,
    dissipation: 0.7,
    friction: Some((
        0.4,
        Stribeck { transition_velocity: 0.2, static_ratio: 1.3, stribeck_velocity: 0.5 },
    )),
};

fn body(at: [f64; 3], turned: [f64; 3]) -> Vec<f64> {
    let rotation = Rotation3::new(Vector3::from(turned)).into_inner();
    at.into_iter().chain(rotation.iter().copied()).collect()
}

/// Pairs of unlike shapes on two bodies that overlap a little, and on the ground.
fn contacts() -> Vec<(&'static str, CompliantContact)> {
    let point = Vector3::new(0.1, 0.0, -0.2);
    let plane = ContactShape::Plane { point, normal: Vector3::new(0.0, 0.6, 0.8) };
    let capsule = |x: f64| ContactShape::Capsule {
        ends: [Vector3::new(-0.4 * x, 0.3, -0.5), Vector3::new(0.5, 0.2 * x, 0.4)],
        radius: 0.5,
    };
    let sphere = ContactShape::sphere(Vector3::new(0.05, -0.1, 0.0), 0.9);
    let axes = Rotation3::new(Vector3::new(0.3, 0.1, -0.2)).into_inner();
    let (center, half) = (Vector3::new(0.1, 0.0, 0.1), Vector3::new(0.3, 0.5, 0.4));
    let ellipsoid = ContactShape::Ellipsoid { center, axes, half_axes: 2.0 * half };
    let large = ContactShape::Box { center, axes, half_lengths: 2.0 * half };
    let block = ContactShape::Box { center, axes, half_lengths: half };
    let ends = [Vector3::new(0.0, 0.0, -0.4), Vector3::new(0.1, 0.0, 0.4)];
    let cylinder = ContactShape::Cylinder { ends, radius: 0.3 };
    let (a, b) = (FrameId::Frame(0), FrameId::Frame(1));
    let all = [
        ("plane of a body", [a, b], [plane.clone(), sphere.clone()]),
        ("plane of the ground", [FrameId::Ground, b], [plane.clone(), ellipsoid]),
        ("box on a plane", [a, b], [plane, large]),
        ("capsules", [a, b], [capsule(1.0), capsule(-1.0)]),
        ("sphere on a box", [a, b], [block, sphere.clone()]),
        ("cylinder, named last", [b, a], [sphere, cylinder]),
    ];
    let made = |(name, frames, shapes)| {
        (name, CompliantContact::new(frames, shapes, LAW).expect("a smooth pair"))
    };
    all.into_iter().map(made).collect()
}

fn step() -> Interval {
    let q0 = [body([0.1, 0.2, -0.3], [0.3, -0.5, 0.2]), body([0.3, 0.35, 0.4], [0.1, 0.2, 0.7])];
    let q1 = [body([0.12, 0.2, -0.28], [0.4, -0.5, 0.1]), body([0.3, 0.3, 0.37], [0.2, 0.1, 0.9])];
    Interval::between(0.4, 0.1, &q0.concat(), &q1.concat())
}

/// By the numbers of the law, against differences of it.
#[test]
fn changes_of_the_law_against_central_differences() {
    let s = step();
    let course = Stribeck { transition_velocity: 0.3, static_ratio: -0.2, stribeck_velocity: 0.4 };
    let by = CompliantLaw {
        stiffness: 7.0,
        exponent: 0.3,
        dissipation: -0.4,
        friction: Some((0.6, course)),
    };
    let moved = |e: f64| {
        let (mu, own) = LAW.friction.unwrap();
        let own = Stribeck {
            transition_velocity: own.transition_velocity + e * course.transition_velocity,
            static_ratio: own.static_ratio + e * course.static_ratio,
            stribeck_velocity: own.stribeck_velocity + e * course.stribeck_velocity,
        };
        CompliantLaw {
            stiffness: LAW.stiffness + e * by.stiffness,
            exponent: LAW.exponent + e * by.exponent,
            dissipation: LAW.dissipation + e * by.dissipation,
            friction: Some((mu + e * 0.6, own)),
        }
    };
    let mut worst = 0.0_f64;
    for (name, contact) in contacts() {
        let all = |own: &dyn Fn(&mut [f64]), value: f64| {
            let mut out = vec![0.0; 24];
            own(&mut out);
            out.push(value);
            out
        };
        let of = |e: f64, scale: f64| {
            let own = CompliantContact { law: moved(e), ..contact.clone() };
            let fill = |out: &mut [f64]| {
                own.add_gradient(&s.q_mid, scale, out);
                own.add(s.mid_motion(), 1.0, out);
            };
            all(&fill, own.value(&s.q_mid))
        };
        let own = std::sync::Arc::new(contact.clone());
        let change = CompliantChange { contact: own, by: Some(by), shapes: None };
        for scale in [0.0, -1.0] {
            let fill = |out: &mut [f64]| {
                change.add_gradient(&s.q_mid, scale, out);
                change.add_at_node(Motion::new(0.0, &s.q_mid, &s.v_mid), out);
            };
            let exact = all(&fill, change.value(&s.q_mid));
            let e = 1e-5;
            let (plus, minus) = (of(e, scale), of(-e, scale));
            let size = exact.iter().fold(1.0, |size: f64, x| size.max(x.abs()));
            for (own, (plus, minus)) in exact.iter().zip(plus.iter().zip(&minus)) {
                let off = ((plus - minus) / (2.0 * e) - own).abs() / size;
                worst = worst.max(off);
                assert!(off < 1e-8, "{name}: off by {off:e}");
            }
        }
        let mut hessian = DMatrix::zeros(24, 24);
        change.add_hessian(&s.q_mid, 1.0, &mut hessian);
        let at = |e: f64| {
            let own = CompliantContact { law: moved(e), ..contact.clone() };
            let mut out = DMatrix::zeros(24, 24);
            own.add_hessian(&s.q_mid, 1.0, &mut out);
            out
        };
        let e = 1e-5;
        let other = (at(e) - at(-e)) / (2.0 * e);
        let off = (&other - &hessian).amax() / other.amax();
        assert!(off < 1e-7, "{name}, stiffness: off by {off:e}");
    }
    println!("changes off by {worst:.1e}");
}

/// A shape that grows and moves with a parameter.
fn grown<T: Number>(shape: &ContactShape, e: T) -> ContactShape<T> {
    let by = |k: f64| e * T::of(k);
    let moved = |x: &Vector3<T>| x + Vector3::new(by(0.3), by(-0.2), by(0.5));
    match shape.lifted::<T>() {
        ContactShape::Plane { point, normal } => {
            ContactShape::Plane { point: moved(&point), normal }
        }
        ContactShape::Points { points, radius } => ContactShape::Points { points, radius },
        ContactShape::Capsule { ends, radius } if shape.name() == "sphere" => {
            ContactShape::sphere(moved(&ends[0]), radius + by(0.8))
        }
        ContactShape::Capsule { ends: [a, b], radius } => {
            ContactShape::Capsule { ends: [moved(&a), b], radius: radius + by(0.8) }
        }
        ContactShape::Ellipsoid { center, axes, half_axes } => {
            let half_axes = half_axes + Vector3::new(by(0.2), by(0.4), by(-0.3));
            ContactShape::Ellipsoid { center: moved(&center), axes, half_axes }
        }
        ContactShape::Box { center, axes, half_lengths } => {
            let half_lengths = half_lengths + Vector3::new(by(0.2), by(0.4), by(-0.3));
            ContactShape::Box { center: moved(&center), axes, half_lengths }
        }
        ContactShape::Cylinder { ends: [a, b], radius } => {
            ContactShape::Cylinder { ends: [moved(&a), b], radius: radius + by(0.8) }
        }
    }
}

/// By the numbers of the shapes: energy, its gradient and its Hessian, the other force, the whole
/// force and the gap, of both sides at once.
#[test]
fn changes_of_shapes_against_central_differences() {
    let s = step();
    let (q, v) = (&s.q_mid[..], &s.v_mid[..]);
    let mut worst = 0.0_f64;
    for (name, contact) in contacts() {
        let shapes = contact.pair().shapes().map(|own| grown(own, Dual64::new(0.0, 1.0)));
        let shapes = contact.with_tangent(shapes).map(std::sync::Arc::new);
        assert!(shapes.is_some(), "{name}");
        let change = CompliantChange { contact: contact.clone().into(), by: None, shapes };
        let at = |e: f64| {
            let shapes = contact.pair().shapes().map(|own| grown(own, e));
            let own = CompliantContact::new(contact.frames, shapes, LAW).unwrap();
            let (mut gradient, mut force) = (vec![0.0; 24], vec![0.0; 24]);
            let mut hessian = DMatrix::zeros(24, 24);
            own.add_gradient(q, 1.0, &mut gradient);
            own.add(s.mid_motion(), 1.0, &mut force);
            own.add_hessian(q, 1.0, &mut hessian);
            let total = own.total_force(q, v);
            let numbers = [own.value(q), own.smallest_gap(q).unwrap(), total.x, total.y, total.z];
            [numbers.to_vec(), gradient, force, hessian.as_slice().to_vec()]
        };
        let (mut gradient, mut force) = (vec![0.0; 24], vec![0.0; 24]);
        let mut hessian = DMatrix::zeros(24, 24);
        change.add_gradient(q, 1.0, &mut gradient);
        change.add_at_node(Motion::new(0.0, q, v), &mut force);
        change.add_hessian(q, 1.0, &mut hessian);
        let total = change.total_force(q, v);
        let numbers = [change.value(q), change.smallest_gap(q), total.x, total.y, total.z];
        let exact = [numbers.to_vec(), gradient, force, hessian.as_slice().to_vec()];
        let e = 1e-5;
        for ((own, plus), minus) in exact.iter().zip(at(e)).zip(at(-e)) {
            let size = own.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
            assert!(size > 0.0, "{name}");
            for (own, (plus, minus)) in own.iter().zip(plus.iter().zip(&minus)) {
                worst = worst.max(((plus - minus) / (2.0 * e) - own).abs() / size);
            }
            assert!(worst < 1e-7, "{name}: off by {worst:e}");
        }
    }
    println!("changes off by {worst:.1e}");
}

#[test]
fn derivatives_against_central_differences() {
    let s = step();
    for (name, contact) in contacts() {
        assert!(contact.closed(&s.q_mid).next().is_some(), "{name} touches");
        let error = slope_error(&MidpointForce(contact.clone()), &s);
        let (mut hessian, e) = (DMatrix::zeros(24, 24), 1e-6);
        contact.add_hessian(&s.q_mid, 1.0, &mut hessian);
        let gradient = |q: &[f64]| {
            let mut out = vec![0.0; 24];
            contact.add_gradient(q, 1.0, &mut out);
            out
        };
        let (mut first, mut second) = (0.0_f64, 0.0_f64);
        for j in 0..24 {
            let moved = |by: f64| {
                let mut q = s.q_mid.clone();
                q[j] += by;
                q
            };
            let (plus, minus) = (moved(e), moved(-e));
            let slope = (contact.value(&plus) - contact.value(&minus)) / (2.0 * e);
            first = first.max((slope - gradient(&s.q_mid)[j]).abs());
            let (plus, minus) = (gradient(&plus), gradient(&minus));
            for i in 0..24 {
                let bend = (plus[i] - minus[i]) / (2.0 * e);
                second = second.max((bend - hessian[(i, j)]).abs());
            }
        }
        println!("{name}: force {error:.1e}, gradient {first:.1e}, Hessian {second:.1e}");
        assert!(error < 1e-6 && first < 1e-7 && second < 1e-6);
    }
}

/// Forces of a step sum up to nothing, and so do their moments about the origin, however far
/// the bodies turn in it.
#[test]
fn both_bodies_take_opposite_wrenches() {
    let s = step();
    for (name, contact) in contacts().into_iter().filter(|(_, own)| own.place(0).is_some()) {
        let mut of = [vec![0.0; 24], vec![0.0; 24]];
        contact.add_gradient(&s.q_mid, 1.0, &mut of[0]);
        contact.add(s.mid_motion(), 1.0, &mut of[1]);
        for f in of {
            let at = |x: &[f64], k: usize| Vector3::new(x[k], x[k + 1], x[k + 2]);
            let force = at(&f, 0) + at(&f, FRAME);
            let triples = (0..24).step_by(3);
            let moment: Vector3<f64> = triples.map(|k| at(&s.q_mid, k).cross(&at(&f, k))).sum();
            let size = f.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
            assert!(size > 1e-3, "{name}");
            assert!(
                force.norm().max(moment.norm()) < 1e-14 * size.max(1.0),
                "{name}: {force} {moment}"
            );
        }
    }
}

#[test]
fn what_is_apart_feels_nothing_and_nothing_pulls() {
    let (_, contact) = contacts().swap_remove(0);
    let mut apart = step().q_mid;
    apart[FRAME + 2] += 9.0;
    assert!(
        contact.closed(&apart).next().is_none()
            && contact.value(&apart).to_bits() == 0.0_f64.to_bits()
    );
    let (q, mut v) = (step().q_mid, vec![0.0; 24]);
    v[FRAME + 2] = 50.0; // it leaves faster than 1/c
    let left = contact.forces(&q, &v).map(|own| own.force.norm());
    assert_eq!(left.collect::<Vec<_>>(), [0.0]);
    v[FRAME + 2] = 0.0;
    let pressed = contact.forces(&q, &v).next().unwrap();
    assert!(pressed.force.dot(&pressed.at.normal) > 0.1 && pressed.at.gap < 0.0);
}

#[test]
fn pairs_with_edges_are_refused() {
    let block = |x: f64| ContactShape::Box {
        center: Vector3::repeat(x),
        axes: Matrix3::identity(),
        half_lengths: Vector3::repeat(1.0),
    };
    let ends = [Vector3::zeros(), Vector3::z()];
    let cylinder = ContactShape::Cylinder { ends, radius: 1.0 };
    let plane = ContactShape::Plane { point: Vector3::zeros(), normal: Vector3::z() };
    let corners = ContactShape::Points { points: ends.to_vec(), radius: 0.0 };
    for shapes in [[block(0.0), block(1.0)], [plane, cylinder], [corners, block(2.0)]] {
        let frames = [FrameId::Ground, FrameId::Frame(0)];
        assert!(CompliantContact::new(frames, shapes, LAW).is_err());
    }
}
