//! Rigid bodies and the joints between them.

use crate::soak::draw::{Draw, along, cross, normal_to};
use holonom::Model;
use holonom::model::{
    Body, Constraint, GROUND, Inertia, Joint, JointKind, Rates, Shape, ShapeKind,
};

/// Pairs with their weights.
const PAIRS: [(u32, JointKind); 8] = [
    (5, JointKind::Revolute),
    (4, JointKind::Spherical),
    (2, JointKind::Cylindrical),
    (2, JointKind::Prismatic),
    (2, JointKind::Planar),
    (2, JointKind::Universal),
    (2, JointKind::Screw),
    (1, JointKind::Fixed),
];

/// A body with random mass properties.
pub(super) fn body(name: String, position: [f64; 3], draw: &mut Draw) -> Body {
    let mut body = Body { name, position, ..Body::default() };
    match draw.index(4) {
        0 => {
            let (kind, dimensions) = match draw.index(5) {
                0 => (ShapeKind::Box, vec![0.1, 0.2, 0.3]),
                1 => (ShapeKind::Cylinder, vec![0.1, 0.4]),
                2 => (ShapeKind::Sphere, vec![0.15]),
                3 => (ShapeKind::Rod, vec![0.8, 0.03]),
                _ => (ShapeKind::Cone, vec![0.1, 0.3]),
            };
            let density = Some(draw.magnitude(&[100.0, 1000.0]));
            let dimensions = dimensions.iter().map(|d| d * draw.between(0.5, 1.5)).collect();
            body.shape = Some(Shape { density, ..Shape::new(kind, dimensions) });
        }
        _ => {
            let mass = draw.magnitude(&[0.1, 1.0]);
            let size = draw.between(0.005, 0.1);
            let moments = [draw.between(1.0, 1.4), draw.between(1.0, 1.4), draw.between(1.0, 1.4)];
            body.mass = Some(mass);
            body.inertia = Some(Inertia::Principal(moments.map(|i| mass * size * i)));
        }
    }
    if draw.chance(0.7) {
        body.quaternion = Some(draw.quaternion());
    }
    body
}

/// A joint at a point in space.
pub(super) fn joint(
    name: String,
    kind: JointKind,
    [parent, child]: [&str; 2],
    position: [f64; 3],
    axis: [f64; 3],
) -> Joint {
    Joint {
        name,
        kind,
        parent: parent.to_owned(),
        child: child.to_owned(),
        position: Some(position),
        anchor_parent: None,
        anchor_child: None,
        axis: kind.has_axis().then_some(axis),
        axis2: None,
        first_axis: None,
        relative_to: None,
        rate: None,
        cut: false,
        pitch: (kind == JointKind::Screw).then_some(0.1),
        spring: None,
        damper: None,
        motor: None,
        limits: None,
        bumper: None,
        friction: None,
    }
}

/// Degrees of freedom of a pair.
pub(super) fn freedoms(kind: JointKind) -> usize {
    match kind {
        JointKind::Spherical | JointKind::Planar => 3,
        JointKind::Cylindrical | JointKind::Universal => 2,
        JointKind::Revolute | JointKind::Prismatic | JointKind::Screw => 1,
        JointKind::Fixed => 0,
    }
}

/// A tree of bodies, held by the ground or free.
pub(super) fn tree(model: &mut Model, draw: &mut Draw) {
    let count = draw.weighted(&[(40, 1), (35, 2), (15, 3), (6, 4), (3, 6), (1, 10)]);
    grow(model, count, draw);
    match draw.index(5) {
        0 => {}
        1 | 2 => rates(model, draw),
        _ => velocities(model, draw),
    }
}

/// Bodies that each hang on an earlier one or on the ground.
fn grow(model: &mut Model, count: usize, draw: &mut Draw) {
    let (free, chain) = (draw.chance(0.25), draw.chance(0.5));
    for k in 0..count {
        let position = match model.bodies.last() {
            Some(last) if chain => along(last.position, draw.between(0.4, 1.0), draw.direction()),
            _ => draw.vector(1.5),
        };
        let child = body(format!("body{k}"), position, draw);
        let parent = match model.bodies.len() {
            0 => None,
            n if chain => Some(n - 1),
            n => (free || draw.chance(0.7)).then(|| draw.index(n)),
        };
        let (parent, at) = match parent {
            Some(p) => (model.bodies[p].name.clone(), model.bodies[p].position),
            None => (GROUND.to_owned(), [0.0; 3]),
        };
        let place = along(
            along(at, draw.between(0.2, 0.8), along(position, -1.0, at)),
            0.2,
            draw.direction(),
        );
        if parent != GROUND || !free {
            let kind = draw.weighted(&PAIRS);
            let ends = match draw.chance(0.2) {
                true => [child.name.as_str(), parent.as_str()],
                false => [parent.as_str(), child.name.as_str()],
            };
            let axis = draw.direction();
            let mut new = joint(format!("joint{k}"), kind, ends, place, axis);
            new.axis2 = kind.has_second_axis().then(|| normal_to(axis, draw));
            model.joints.push(new);
        }
        model.bodies.push(child);
    }
    if model.joints.iter().all(|joint| joint.kind == JointKind::Fixed) {
        model.joints.retain(|joint| joint.parent != GROUND && joint.child != GROUND);
    }
}

/// Initial rates of the joints; a body that no joint moves gets velocities.
fn rates(model: &mut Model, draw: &mut Draw) {
    let mut known: Vec<String> = vec![GROUND.to_owned()];
    let held = |model: &Model, name: &str| {
        model.joints.iter().any(|joint| joint.child == name || joint.parent == name)
    };
    for k in 0..model.bodies.len() {
        let name = model.bodies[k].name.clone();
        let joint = model.joints.iter_mut().find(|j| j.child == name && known.contains(&j.parent));
        if let Some(joint) = joint.filter(|j| j.kind != JointKind::Spherical) {
            let count = freedoms(joint.kind);
            let rates: Vec<f64> = (0..count).map(|_| draw.between(-3.0, 3.0)).collect();
            joint.rate = (count > 0).then_some(Rates::Many(rates));
        } else if !held(model, &name) {
            model.bodies[k].velocity = draw.vector(1.0);
            model.bodies[k].angular_velocity = Some(draw.vector(3.0));
        }
        known.push(name);
    }
}

/// Initial velocities of all bodies: of one rigid motion, or random and projected onto the
/// constraints.
pub(super) fn velocities(model: &mut Model, draw: &mut Draw) {
    let rigid = draw.chance(0.2);
    let (velocity, spin) = (draw.vector(1.0), draw.vector(2.0));
    for body in model.bodies.iter_mut().filter(|body| !body.fixed) {
        if rigid {
            body.velocity = along(velocity, 1.0, cross(spin, body.position));
            body.angular_velocity = Some(spin);
        } else {
            body.velocity = draw.vector(1.0);
            match draw.chance(0.5) {
                true => body.angular_velocity = Some(draw.vector(3.0)),
                false => body.body_angular_velocity = Some(draw.vector(3.0)),
            }
        }
    }
    model.settings.project_start = true;
}

/// Closed loops, consistent because every joint is placed in the initial configuration.
pub(super) fn loops(model: &mut Model, draw: &mut Draw) {
    match draw.index(6) {
        0 => planar(model, draw),
        1 => spherical(model, draw),
        2 => hinges(model, draw),
        3 => rods(model, draw),
        _ => spatial(model, draw),
    }
    if draw.chance(0.8) {
        velocities(model, draw);
    }
}

/// The bodies of a ring from the ground to the ground at the corners of a random polygon.
fn ring(model: &mut Model, count: usize, draw: &mut Draw, point: impl Fn(&mut Draw) -> [f64; 3]) {
    for k in 0..count {
        let position = point(draw);
        let new = body(format!("body{k}"), position, draw);
        model.bodies.push(new);
    }
}

/// A loop of bodies with joints of parallel axes: three of its constraints are redundant.
fn planar(model: &mut Model, draw: &mut Draw) {
    let axis = draw.direction();
    let side = normal_to(axis, draw);
    let up = cross(axis, side);
    let flat = |draw: &mut Draw| {
        let (a, b) = (draw.between(-1.0, 1.0), draw.between(-1.0, 1.0));
        along(along([0.0; 3], a, side), b, up)
    };
    let count = draw.weighted(&[(6, 3), (2, 4), (1, 5)]);
    ring(model, count, draw, flat);
    for k in 0..=count {
        let place = along(flat(draw), draw.between(-0.2, 0.2), axis);
        let (kind, axis) = match k == 1 && draw.chance(0.4) {
            true => (JointKind::Prismatic, along(side, draw.between(-1.0, 1.0), up)),
            false => (JointKind::Revolute, axis),
        };
        push_ring(model, k, count, kind, place, axis);
    }
}

/// A loop of revolute joints whose axes meet in a point.
fn spherical(model: &mut Model, draw: &mut Draw) {
    let count = draw.count(3, 4);
    ring(model, count, draw, |draw| draw.vector(1.0));
    let center = draw.vector(0.5);
    for k in 0..=count {
        let axis = draw.direction();
        let place = along(center, draw.between(0.2, 1.0), axis);
        push_ring(model, k, count, JointKind::Revolute, place, axis);
    }
}

/// Joint `k` of a ring of `count` bodies that begins and ends at the ground.
fn push_ring(
    model: &mut Model,
    k: usize,
    count: usize,
    kind: JointKind,
    place: [f64; 3],
    axis: [f64; 3],
) {
    let name = |k: usize| match (1..=count).contains(&k) {
        true => model.bodies[k - 1].name.clone(),
        false => GROUND.to_owned(),
    };
    let (parent, child) = match k == count {
        true => (GROUND.to_owned(), name(k)),
        false => (name(k), name(k + 1)),
    };
    let new = joint(format!("joint{k}"), kind, [&parent, &child], place, axis);
    model.joints.push(new);
}

/// A tree with a second joint beside one of its joints, on the same axis.
fn hinges(model: &mut Model, draw: &mut Draw) {
    let count = draw.count(1, 3);
    grow(model, count, draw);
    let kinds = [JointKind::Revolute, JointKind::Prismatic, JointKind::Cylindrical];
    for k in 0..model.joints.len() {
        let twice = k == 0 || draw.chance(0.3);
        let first = &mut model.joints[k];
        if !twice || first.kind == JointKind::Fixed {
            continue;
        }
        first.kind = draw.pick(&kinds);
        let axis = draw.direction();
        (first.axis, first.axis2, first.pitch) = (Some(axis), None, None);
        let mut second = first.clone();
        second.name = format!("second{k}");
        let at = first.position.unwrap_or_default();
        second.position = Some(along(at, draw.between(0.1, 1.0), axis));
        model.joints.push(second);
    }
}

/// A tree with scalar constraints: rods, points on lines and planes.
fn rods(model: &mut Model, draw: &mut Draw) {
    let count = draw.weighted(&[(6, 2), (3, 3), (1, 4)]);
    grow(model, count, draw);
    for joint in &mut model.joints {
        if draw.chance(0.7) {
            (joint.kind, joint.axis, joint.axis2, joint.pitch) =
                (JointKind::Spherical, None, None, None);
        }
    }
    let mobility: usize = 6 * model.bodies.len()
        - model.joints.iter().map(|joint| 6 - freedoms(joint.kind)).sum::<usize>();
    for k in 0..draw.count(1, 2).min(mobility.saturating_sub(4) / 2) {
        let b = draw.index(model.bodies.len());
        let child = model.bodies[b].name.clone();
        let name = format!("scalar{k}");
        let (position, axis) =
            (along(model.bodies[b].position, 0.3, draw.direction()), draw.direction());
        let parent = GROUND.to_owned();
        model.constraints.push(match draw.index(3) {
            0 => Constraint::PointOnLine { name, parent, child, position, axis, relative_to: None },
            1 => {
                Constraint::PointOnPlane { name, parent, child, position, axis, relative_to: None }
            }
            _ => Constraint::Distance {
                name,
                from: parent,
                to: child,
                point_from: draw.vector(2.0),
                point_to: draw.vector(0.3),
                relative_to: None,
                length: None,
            },
        });
    }
}

/// A chain that is closed by a joint, with pairs that leave it movable: `Σ f_i − 6 > 0`.
fn spatial(model: &mut Model, draw: &mut Draw) {
    let count = draw.weighted(&[(6, 2), (4, 3), (1, 4), (1, 5)]);
    ring(model, count, draw, |draw| draw.vector(1.2));
    let kinds = [
        (4, JointKind::Revolute),
        (6, JointKind::Spherical),
        (3, JointKind::Cylindrical),
        (2, JointKind::Universal),
        (1, JointKind::Planar),
        (1, JointKind::Prismatic),
    ];
    let mut chosen: Vec<JointKind> = (0..=count).map(|_| draw.weighted(&kinds)).collect();
    let mut k = 0;
    while chosen.iter().map(|kind| freedoms(*kind)).sum::<usize>() < 7 {
        (chosen[k % (count + 1)], k) = (JointKind::Spherical, k + 1);
    }
    for (k, kind) in chosen.into_iter().enumerate() {
        let (place, axis) = (draw.vector(1.0), draw.direction());
        push_ring(model, k, count, kind, place, axis);
        if let Some(last) = model.joints.last_mut() {
            last.axis2 = kind.has_second_axis().then(|| normal_to(axis, draw));
        }
    }
}
