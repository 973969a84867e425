//! Mechanisms without a degree of freedom: welded trees and loops, triangles of hinges, frames on
//! rods, trusses that are statically determinate, joints that all follow prescribed motions.

use super::bodies::{body, freedoms, joint};
use super::forces::path;
use crate::soak::draw::{Draw, along};
use holonom::Model;
use holonom::model::{Bar, Constraint, GROUND, JointKind, Particle};

/// One of these.
pub(super) fn locked(model: &mut Model, draw: &mut Draw) {
    match draw.index(6) {
        0 => welded(model, false, draw),
        1 => welded(model, true, draw),
        2 => triangle(model, draw),
        3 => on_rods(model, draw),
        4 => truss(model, draw),
        _ => driven(model, draw),
    }
}

/// A chain of bodies from the ground, each held by a joint of the kind that `kind` says.
fn chain(model: &mut Model, draw: &mut Draw, mut kind: impl FnMut(&mut Draw) -> JointKind) {
    let (mut parent, mut at) = (GROUND.to_owned(), [0.0; 3]);
    for k in 0..draw.count(1, 4) {
        let position = along(at, draw.between(0.4, 1.0), draw.direction());
        let child = body(format!("body{k}"), position, draw);
        let (place, axis) = (along(at, 0.5, draw.direction()), draw.direction());
        let ends = [parent.as_str(), child.name.as_str()];
        model.joints.push(joint(format!("joint{k}"), kind(draw), ends, place, axis));
        (parent, at) = (child.name.clone(), position);
        model.bodies.push(child);
    }
}

/// Bodies welded to each other and to the ground, in a chain or in a loop.
fn welded(model: &mut Model, closed: bool, draw: &mut Draw) {
    chain(model, draw, |_| JointKind::Fixed);
    if closed {
        let last = model.bodies.len() - 1;
        let ends = [model.bodies[last].name.as_str(), GROUND];
        let new = joint("last".into(), JointKind::Fixed, ends, draw.vector(1.0), [0.0, 0.0, 1.0]);
        model.joints.push(new);
    }
}

/// Two bodies and the ground with three joints of parallel axes.
fn triangle(model: &mut Model, draw: &mut Draw) {
    let axis = draw.direction();
    let ends = [[GROUND, "body0"], ["body0", "body1"], ["body1", GROUND]];
    for name in ["body0", "body1"] {
        let new = body(name.into(), draw.vector(1.0), draw);
        model.bodies.push(new);
    }
    for (k, ends) in ends.into_iter().enumerate() {
        let new = joint(format!("joint{k}"), JointKind::Revolute, ends, draw.vector(1.0), axis);
        model.joints.push(new);
    }
}

/// A body on six rods from the ground.
fn on_rods(model: &mut Model, draw: &mut Draw) {
    let new = body("body0".into(), draw.vector(0.5), draw);
    model.bodies.push(new);
    for k in 0..6 {
        model.constraints.push(Constraint::Distance {
            name: format!("rod{k}"),
            from: GROUND.to_owned(),
            to: "body0".into(),
            point_from: along([0.0; 3], 3.0, draw.direction()),
            point_to: draw.vector(0.4),
            relative_to: None,
            length: None,
        });
    }
}

/// Point masses, each held by as many bars as there are dimensions, to the ground or to earlier
/// ones.
fn truss(model: &mut Model, draw: &mut Draw) {
    let dimension = draw.pick(&[2, 3]);
    model.header.dimension = dimension;
    if !model.header.gravity.is_empty() {
        model.header.gravity = vec![0.0; dimension];
        model.header.gravity[dimension - 1] = -9.81;
    }
    for k in 0..draw.count(1, 4) {
        let position: Vec<f64> = (0..dimension)
            .map(|i| if i == 0 { k as f64 } else { draw.between(0.4, 1.0) })
            .collect();
        let (name, mass) = (format!("point{k}"), draw.magnitude(&[0.1, 1.0]));
        let velocity = vec![0.0; dimension];
        model.particles.push(Particle {
            name: name.clone(),
            mass,
            position,
            velocity,
            relative_to: None,
        });
        for i in 0..dimension {
            let held = i > 0 && k >= i && draw.chance(0.6);
            let from = if held { format!("point{}", k - i) } else { GROUND.to_owned() };
            let place = (0..dimension).map(|j| {
                let corner = if j == i { 1.5 } else { 0.0 };
                if j == 0 { k as f64 + corner } else { corner - 1.0 }
            });
            let point = (!held).then(|| place.collect());
            let name = format!("bar{}", model.bars.len());
            model.bars.push(Bar {
                name,
                from,
                to: format!("point{k}"),
                point,
                relative_to: None,
                length: None,
            });
        }
    }
}

/// A chain of which every degree of freedom follows a motion from rest.
fn driven(model: &mut Model, draw: &mut Draw) {
    let kinds =
        [JointKind::Revolute, JointKind::Prismatic, JointKind::Cylindrical, JointKind::Screw];
    chain(model, draw, |draw| draw.pick(&kinds));
    let joints = model.joints.iter().map(|joint| (joint.name.clone(), freedoms(joint.kind)));
    for (joint, count) in joints.collect::<Vec<_>>() {
        for freedom in 0..count {
            let (name, path) = (format!("{joint}_{freedom}"), path(draw));
            let joint = joint.clone();
            model.constraints.push(Constraint::Motion { name, joint, freedom, path });
        }
    }
    model.settings.project_start = true;
}
