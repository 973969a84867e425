//! Bodies of all shapes that touch: free or on joints with stops and friction, on the ground and on
//! one another, next to each other in any attitude or flush.

use super::contacts::{along_joint, rule};
use super::{bodies, empty};
use crate::soak::draw::{Draw, along};
use holonom::Model;
use holonom::model::{
    Body, BodyNames, ContactMethod, ContactPlane, ContactSide, GROUND, Impact, JointKind, Mesh,
    Meshes, PlaneSide, Scale, Shape, ShapeKind,
};
use holonom::nalgebra::{Matrix3, Vector3};
use holonom::vi_rigid::directors::set_frame;
use holonom::vi_rigid::gap::{ContactShape, GROUND as ORIGIN, has_gap, smallest_gap};
use std::fmt::Write;
use std::path::Path;
use vi_testkit::model::cube_of_squares;

/// Steps of such a mechanism.
const STEPS: u64 = 40;
/// Shapes are apart by this at least, m.
const APART: f64 = 1e-12;

/// The mechanism with this seed and index.
#[must_use]
pub fn touching(seed: u64, index: u64) -> Model {
    let mut draw = Draw::new(seed ^ 0x746f_7563_6869_6e67, index);
    let draw = &mut draw;
    let mut model = empty(format!("touching-{seed}-{index}"));
    model.meshes = meshes();
    if draw.chance(0.75) {
        model.header.gravity = vec![0.0, 0.0, -9.81];
    }
    let ground = draw.weighted(&[(5, Ground::Plane), (3, Ground::Solid), (2, Ground::None)]);
    let aligned = draw.chance(0.4);
    let count = draw.weighted(&[(4, 1), (8, 2), (5, 3), (2, 4), (1, 6)]);
    if ground == Ground::Solid {
        let mut slab = Body { name: "slab".to_owned(), fixed: true, ..Body::default() };
        slab.mass = Some(1.0);
        slab.collision = vec![shape(0.4, draw)];
        if !aligned {
            slab.quaternion = Some(draw.quaternion());
        }
        model.bodies.push(slab);
    }
    let count =
        if model.bodies.is_empty() && ground == Ground::None { count.max(2) } else { count };
    for k in 0..count {
        place(&mut model, k, aligned, ground, draw);
    }
    joints(&mut model, draw);
    if draw.chance(0.8) {
        bodies::velocities(&mut model, draw);
    }
    rules(&mut model, ground, draw);
    let settings = &mut model.settings;
    settings.step = draw.magnitude(&[1e-5, 1e-4, 5e-4, 5e-4]);
    settings.end = settings.step * STEPS as f64;
    settings.contact = draw.pick(&[ContactMethod::Events, ContactMethod::Stepping]);
    settings.impact =
        draw.weighted(&[(6, Impact::Newton), (1, Impact::Moreau), (1, Impact::Sequential)]);
    if settings.impact == Impact::Moreau {
        model.contacts.iter_mut().for_each(|own| own.tangential_restitution = 0.0);
    }
    model
}

/// What does not move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ground {
    /// A plane through the origin.
    Plane,
    /// A body.
    Solid,
    /// Nothing.
    None,
}

/// The meshes of these mechanisms: the corners of a cube, of squares on a cube, and of an
/// icosahedron, each of length 1 or 2.
///
/// # Panics
/// Never: they are valid.
#[must_use]
pub fn meshes() -> Meshes {
    let known = [
        ("cube.obj", cube_of_squares(1)),
        ("squares.obj", cube_of_squares(6)),
        ("stone.obj", icosahedron()),
    ];
    known.into_iter().fold(Meshes::default(), |meshes, (name, text)| {
        let mesh = Mesh::from_bytes(Path::new(name), text.into_bytes()).expect("a valid mesh");
        meshes.with(name, mesh).expect("a small mesh")
    })
}

/// The faces of an icosahedron, outwards.
fn icosahedron() -> String {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let corner = |k: usize| {
        let side = |bit: usize| if k >> bit & 1 == 1 { 0.5 } else { -0.5 };
        let mut x = Vector3::new(0.0, side(0), side(1) * golden);
        (0..k / 4).for_each(|_| x = Vector3::new(x.z, x.x, x.y));
        x
    };
    let corners: Vec<Vector3<f64>> = (0..12).map(corner).collect();
    let mut text = String::new();
    corners.iter().for_each(|x| _ = writeln!(text, "v {} {} {}", x.x, x.y, x.z));
    let near = |i: usize, j: usize| (corners[i] - corners[j]).norm() < 1.1;
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if near(i, j) && near(j, k) && near(i, k) {
                    let [a, b, c] = [i, j, k].map(|own| corners[own]);
                    let is_outwards = (b - a).cross(&(c - a)).dot(&a) > 0.0;
                    let (j, k) = if is_outwards { (j, k) } else { (k, j) };
                    let _ = writeln!(text, "f {} {} {}", i + 1, j + 1, k + 1);
                }
            }
        }
    }
    text
}

/// A shape of about this size, at the centre of mass.
fn shape(size: f64, draw: &mut Draw) -> Shape {
    let mut length = || size * draw.between(0.3, 1.0);
    let (a, b, c) = (length(), length(), length());
    match draw.index(6) {
        0 => Shape::new(ShapeKind::Sphere, vec![0.5 * a]),
        1 => Shape::new(ShapeKind::Capsule, vec![0.4 * a, b]),
        2 => Shape::new(ShapeKind::Cylinder, vec![0.5 * a, b]),
        3 | 4 => Shape::new(ShapeKind::Box, vec![a, b, c]),
        _ => {
            let file = draw.pick(&["cube.obj", "squares.obj", "stone.obj"]).to_owned();
            let (file, scale) = (Some(file), Some(Scale::Axes([a, b, c])));
            let position = Some([0.0; 3]);
            Shape { file, scale, position, ..Shape::new(ShapeKind::Mesh, Vec::new()) }
        }
    }
}

/// The shapes of a body, and its frame.
fn placed(model: &Model, body: &Body) -> (Vec<ContactShape>, [f64; 12]) {
    let mut frame = ORIGIN;
    set_frame(&mut frame, &Vector3::from(body.position), &body.rotation());
    (model.contact_shapes(body, &Matrix3::identity()), frame)
}

/// How far two bodies are apart, m; `None` where some of their shapes do not touch.
fn apart(model: &Model, a: &Body, b: &Body) -> Option<f64> {
    let ((of_a, at_a), (of_b, at_b)) = (placed(model, a), placed(model, b));
    let both = of_a.iter().flat_map(|a| of_b.iter().map(move |b| (a, b)));
    both.map(|(a, b)| {
        let gap = has_gap(a, b).then(|| smallest_gap((a, &at_a), (b, &at_b)));
        gap.flatten()
    })
    .try_fold(f64::INFINITY, |least, gap| Some(least.min(gap?)))
}

fn floor() -> ContactShape {
    ContactShape::Plane { point: Vector3::zeros(), normal: Vector3::z() }
}

/// Over the floor, m.
fn height(model: &Model, body: &Body) -> f64 {
    let (shapes, frame) = placed(model, body);
    let heights = shapes.iter().filter_map(|own| smallest_gap((&floor(), &ORIGIN), (own, &frame)));
    heights.fold(f64::INFINITY, f64::min)
}

/// Adds a body next to another one or to the ground.
fn place(model: &mut Model, k: usize, aligned: bool, ground: Ground, draw: &mut Draw) {
    let mut new = bodies::body(format!("body{k}"), [0.0; 3], draw);
    new.collision = vec![shape(draw.pick(&[0.1, 0.3]), draw)];
    if draw.chance(0.2) {
        let mut second = shape(0.1, draw);
        (second.position, second.quaternion) = (Some(draw.vector(0.1)), Some(draw.quaternion()));
        new.collision.push(second);
    }
    new.quaternion = match aligned {
        false => Some(draw.quaternion()),
        true => draw.chance(0.3).then_some([0.5_f64.sqrt(), 0.0, 0.5_f64.sqrt(), 0.0]),
    };
    let other = model.bodies.len().checked_sub(1).map(|last| {
        let like = aligned && draw.chance(0.3);
        if like && new.collision.len() == 1 {
            new.collision.clone_from(&model.bodies[last].collision);
        }
        model.bodies[draw.index(last + 1)].position
    });
    let up = [0.0, 0.0, 1.0];
    let mut direction = if aligned && draw.chance(0.8) { up } else { draw.direction() };
    direction[2] = direction[2].abs();
    let target = APART + draw.pick(&[0.0, 0.0, 1e-6, 1e-3, 0.02]);
    let mut far = 3.0;
    let from = other.unwrap_or_default();
    for _ in 0..200 {
        new.position = along(from, far, if other.is_some() { direction } else { up });
        let gaps = model.bodies.iter().filter_map(|own| apart(model, own, &new));
        let mut gap = gaps.fold(f64::INFINITY, f64::min);
        if ground == Ground::Plane {
            gap = gap.min(height(model, &new));
        }
        if (gap - target).abs() < 0.1 * APART || !gap.is_finite() {
            break;
        }
        far = (far - (gap - target)).clamp(0.0, 3.0);
    }
    model.bodies.push(new);
}

/// Joints between some of the bodies, or to the ground, with stops and dry friction.
fn joints(model: &mut Model, draw: &mut Draw) {
    const KINDS: [JointKind; 6] = [
        JointKind::Revolute,
        JointKind::Spherical,
        JointKind::Prismatic,
        JointKind::Cylindrical,
        JointKind::Planar,
        JointKind::Universal,
    ];
    for k in 0..model.bodies.len() {
        if model.bodies[k].fixed || !draw.chance(0.3) {
            continue;
        }
        let child = &model.bodies[k];
        let parent = match draw.index(k + 1) {
            j if j < k && !model.bodies[j].fixed => model.bodies[j].name.clone(),
            _ => GROUND.to_owned(),
        };
        let (kind, axis) = (draw.pick(&KINDS), draw.direction());
        let at = along(child.position, 0.3, draw.direction());
        let ends = [parent.as_str(), child.name.as_str()];
        let mut joint = bodies::joint(format!("joint{k}"), kind, ends, at, axis);
        joint.axis2 = kind.has_second_axis().then(|| super::super::draw::normal_to(axis, draw));
        along_joint(&mut joint, draw);
        model.joints.push(joint);
    }
}

/// A rule for the ground, a plane on a body, and one for each pair that is apart.
fn rules(model: &mut Model, ground: Ground, draw: &mut Draw) {
    let plane = |position, normal, on: &str| {
        let plane = ContactPlane { position, normal, on: on.to_owned() };
        ContactSide::Plane(PlaneSide { plane })
    };
    if ground == Ground::Plane {
        let over = model.bodies.iter().filter(|own| height(model, own) > 0.0);
        let names: Vec<String> = over.map(|own| own.name.clone()).collect();
        if !names.is_empty() {
            let side = plane([0.0; 3], [0.0, 0.0, 1.0], GROUND);
            model.contacts.push(rule("floor", side, BodyNames::Several(names), draw));
        }
    }
    let shared = |model: &Model, a: &str, b: &str| {
        let ends = |own: &holonom::model::Joint| [own.parent.clone(), own.child.clone()];
        model.joints.iter().any(|own| ends(own) == [a, b] || ends(own) == [b, a])
    };
    for i in 0..model.bodies.len() {
        for j in i + 1..model.bodies.len() {
            let [a, b] = [i, j].map(|k| &model.bodies[k]);
            if a.fixed && b.fixed || shared(model, &a.name, &b.name) {
                continue;
            }
            let gap = apart(model, a, b).filter(|gap| *gap > 0.0);
            let [a, b] = [a, b].map(|own| BodyNames::One(own.name.clone()));
            let name = format!("touch{i}_{j}");
            let side = match gap {
                Some(_) => ContactSide::Bodies(a),
                // a plane on the first body that the second one is behind of
                None => {
                    let [own, other] = [i, j].map(|k| &model.bodies[k]);
                    let way = Vector3::from(other.position) - Vector3::from(own.position);
                    let back = own.rotation().transpose() * way;
                    if back.norm() < 1e-3 {
                        continue;
                    }
                    let normal = back.normalize();
                    let origin = ContactShape::Plane { point: Vector3::zeros(), normal };
                    let ((_, at), (shapes, at_other)) = (placed(model, own), placed(model, other));
                    let over =
                        shapes.iter().filter_map(|s| smallest_gap((&origin, &at), (s, &at_other)));
                    let height = over.fold(f64::INFINITY, f64::min) - draw.pick(&[1e-9, 1e-3]);
                    if !height.is_finite() {
                        continue;
                    }
                    plane((normal * height).into(), normal.into(), &own.name)
                }
            };
            let own = rule(&name, side, b, draw);
            model.contacts.push(own);
        }
    }
}
