//! What acts on a mechanism, and what couples its joints.

use super::MechanismKind;
use super::bodies::freedoms;
use crate::soak::draw::Draw;
use holonom::Model;
use holonom::model::{
    Constraint, Frame, GROUND, History, Joint, JointDamper, JointKind, JointMotor, JointSpring,
    Load, MotionPath, Move, Spring, SpringLaw,
};

/// Adds forces to most mechanisms.
pub(super) fn add(model: &mut Model, kind: MechanismKind, draw: &mut Draw) {
    for _ in 0..draw.weighted(&[(5, 0), (3, 1), (1, 2)]) {
        spring(model, draw);
    }
    for k in 0..model.joints.len() {
        if has_coordinate(&model.joints[k]) && draw.chance(0.3) {
            along_joint(&mut model.joints[k], draw);
        }
    }
    for _ in 0..draw.weighted(&[(6, 0), (3, 1), (1, 2)]) {
        load(model, draw);
    }
    if kind == MechanismKind::Tree && draw.chance(0.12) {
        gear(model, draw);
    } else if matches!(kind, MechanismKind::Tree | MechanismKind::Loops) && draw.chance(0.1) {
        drive(model, draw);
    }
}

/// Whether springs, dampers, motors, gears and motions act along a coordinate of this joint.
fn has_coordinate(joint: &Joint) -> bool {
    !matches!(joint.kind, JointKind::Spherical | JointKind::Fixed)
}

/// Components of a model that a force acts on; a beam by its nodes.
fn components(model: &Model) -> Vec<String> {
    let bodies = model.bodies.iter().map(|body| body.name.clone());
    let points = model.particles.iter().map(|point| point.name.clone());
    let nodes = model.beams.iter().map(|beam| format!("{}.end", beam.name));
    bodies.chain(points).chain(nodes).collect()
}

fn spring(model: &mut Model, draw: &mut Draw) {
    let all = components(model);
    let from = all[draw.index(all.len())].clone();
    let others: Vec<&String> = all.iter().filter(|name| **name != from).collect();
    let to = match others.is_empty() || draw.chance(0.4) {
        true => GROUND.to_owned(),
        false => others[draw.index(others.len())].clone(),
    };
    let dimension = model.header.dimension;
    let mut point = |name: &str, size: f64| {
        let held = model.particle(name).is_none() && (name == GROUND || draw.chance(0.7));
        held.then(|| draw.vector(size)[..dimension].to_vec())
    };
    let (point_from, mut point_to) = (point(&from, 0.3), point(&to, 0.3));
    if to == GROUND {
        point_to = Some((0..dimension).map(|i| if i == 0 { -2.7 } else { 1.9 }).collect());
    }
    let (law, stiffness) = match draw.chance(0.8) {
        true => (SpringLaw::Linear, draw.magnitude(&[1.0, 10.0, 100.0])),
        false => (SpringLaw::QuadraticStretch, draw.magnitude(&[0.1, 1.0])),
    };
    let natural_length = draw.chance(0.3).then(|| draw.between(0.0, 1.0));
    let damping = if draw.chance(0.25) { draw.magnitude(&[0.01, 0.1, 1.0]) } else { 0.0 };
    let name = format!("spring{}", model.springs.len());
    model.springs.push(Spring {
        tension: None,
        name,
        from,
        to,
        point_from,
        point_to,
        relative_to: None,
        stiffness,
        natural_length,
        law,
        damping,
    });
}

/// A spring, damper or motor along a joint coordinate.
fn along_joint(joint: &mut Joint, draw: &mut Draw) {
    let freedom = draw.index(freedoms(joint.kind));
    match draw.index(4) {
        0 => {
            let damping = draw.magnitude(&[0.01, 0.1]);
            joint.damper = Some(JointDamper { freedom, damping });
        }
        1 => {
            let controlled = draw.chance(0.4);
            let gain = |size: f64| if controlled { size } else { 0.0 };
            joint.motor = Some(JointMotor {
                freedom,
                effort: draw.between(-2.0, 2.0),
                history: history(draw),
                proportional: gain(10.0),
                derivative: gain(0.5),
                path: if controlled { path(draw) } else { MotionPath::default() },
            });
        }
        _ => {
            let (stiffness, rest) = (draw.magnitude(&[0.1, 1.0, 10.0]), draw.between(-0.3, 0.3));
            joint.spring = Some(JointSpring { freedom, stiffness, rest, table: None });
        }
    }
}

fn history(draw: &mut Draw) -> History {
    match draw.index(7) {
        0 => History::Linear { end: draw.between(0.1, 1.0) },
        1 => History::Ramp { start: 0.0, end: draw.between(0.01, 0.5) },
        2 => History::Pulse { start: 0.02, end: draw.between(0.05, 0.5) },
        3 => History::Triangle { start: 0.0, peak: 0.05, end: draw.between(0.1, 0.5) },
        4 => History::Harmonic { frequency: draw.between(0.1, 5.0), phase: draw.between(0.0, 3.0) },
        5 => History::Table { times: vec![0.0, 0.1, 0.3], values: vec![0.0, 1.0, -0.5] },
        _ => History::Constant,
    }
}

/// A path that begins at rest.
pub(super) fn path(draw: &mut Draw) -> MotionPath {
    match draw.chance(0.5) {
        true => MotionPath { acceleration: draw.between(-2.0, 2.0), ..MotionPath::default() },
        false => {
            let moves = vec![Move { start: 0.0, end: 1.0, by: draw.between(-0.8, 0.8) }];
            MotionPath { moves, ..MotionPath::default() }
        }
    }
}

fn load(model: &mut Model, draw: &mut Draw) {
    if model.header.dimension == 2 || !model.particles.is_empty() {
        return; // loads act on bodies and beams
    }
    let all = components(model);
    let along = !model.beams.is_empty() && draw.chance(0.4);
    let target = all[draw.index(all.len())].clone();
    model.loads.push(Load {
        name: format!("load{}", model.loads.len()),
        body: (!along).then_some(target),
        beam: along.then(|| model.beams[0].name.clone()),
        at: None,
        force: draw.vector(1.0),
        point: (!along && draw.chance(0.5)).then(|| draw.vector(0.3)),
        torque: if draw.chance(0.5) { draw.vector(0.05) } else { [0.0; 3] },
        frame: draw.pick(&[Frame::Space, Frame::Body]),
        relative_to: None,
        history: history(draw),
    });
}

/// A gear constraint between two joints of a tree that have no initial rates of their own.
fn gear(model: &mut Model, draw: &mut Draw) {
    let fits = |joint: &&mut Joint| has_coordinate(joint);
    let mut joints: Vec<&mut Joint> = model.joints.iter_mut().filter(fits).collect();
    if joints.len() < 2 {
        return;
    }
    let first = draw.index(joints.len() - 1);
    let pair = [first, first + 1];
    let freedoms = pair.map(|k| draw.index(freedoms(joints[k].kind)));
    let names = pair.map(|k| joints[k].name.clone());
    joints.iter_mut().for_each(|joint| joint.rate = None);
    let ratio = draw.between(0.5, 3.0);
    let name = "gear".to_owned();
    model.constraints.push(Constraint::Gear { name, joints: names, freedoms, ratio });
    model.settings.project_start = true;
}

/// A prescribed motion of a joint, from rest.
fn drive(model: &mut Model, draw: &mut Draw) {
    let fits = |k: &usize| has_coordinate(&model.joints[*k]);
    let able: Vec<usize> = (0..model.joints.len()).filter(fits).collect();
    if able.is_empty() || model.constraints.len() > 1 {
        return;
    }
    let joint = &mut model.joints[draw.pick(&able)];
    (joint.motor, joint.rate) = (None, None);
    let freedom = draw.index(freedoms(joint.kind));
    let (name, joint) = ("drive".to_owned(), joint.name.clone());
    model.constraints.push(Constraint::Motion { name, joint, freedom, path: path(draw) });
    model.joints.iter_mut().for_each(|joint| joint.rate = None);
    model.settings.project_start = true;
}
