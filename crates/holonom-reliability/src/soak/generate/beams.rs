//! Beams of a few elements: clamped, pinned, free, with a body at the end.

use super::bodies::{body, joint};
use crate::soak::draw::{Draw, along, cross, normal_to};
use holonom::Model;
use holonom::model::{
    Beam, BeamMass, Count, Curve, Damping, End, GROUND, JointKind, Material, Normal, Outline,
    OutlineKind, Section, Twist,
};

/// One or two beams, perhaps with bodies.
pub(super) fn beams(model: &mut Model, draw: &mut Draw) {
    let start = draw.pick(&[End::Clamped, End::Clamped, End::Pinned, End::Free]);
    let first = beam("beam0", draw.vector(0.5), start, draw);
    model.beams.push(first);
    match draw.index(4) {
        0 => with_body(model, draw),
        1 if start != End::Free => swing(model, draw),
        _ => {}
    }
    if start == End::Free {
        let moves = draw.chance(0.7) && model.joints.is_empty();
        let beam = &mut model.beams[0];
        if moves {
            (beam.velocity, beam.angular_velocity) = (draw.vector(1.0), draw.vector(2.0));
        }
    }
    model.settings.project_start = true;
}

fn section(draw: &mut Draw) -> Section {
    let (kind, dimensions) = match draw.index(3) {
        0 => (OutlineKind::Rectangle, vec![0.03, 0.02]),
        1 => (OutlineKind::Circle, vec![0.015]),
        _ => (OutlineKind::Tube, vec![0.02, 0.015]),
    };
    let young = draw.magnitude(&[1e6, 1e8, 1e10]);
    let material = Material { young, shear: None, nu: Some(0.3), density: 2700.0 };
    Section {
        shape: Some(Outline { kind, dimensions }),
        material: Some(material),
        ..Section::default()
    }
}

fn beam(name: &str, from: [f64; 3], start: End, draw: &mut Draw) -> Beam {
    let axis = draw.direction();
    let length = draw.between(0.5, 1.5);
    let order = draw.pick(&[1, 1, 1, 2, 3]);
    let normal = normal_to(axis, draw);
    let end = along(from, length, axis);
    let mut points = vec![from, end];
    let mut curve = None;
    let mut normals = Normal::One(normal);
    match draw.index(4) {
        0 => {
            points.push(along(end, length, normal));
            normals = Normal::Legs(vec![normal, axis]);
        }
        1 => {
            points.clear();
            let center = along(from, length, normal);
            let across = cross(axis, normal);
            curve = Some(Curve::Arc { from, center, axis: across, angle: draw.between(0.4, 1.2) });
            normals = Normal::One(across);
        }
        _ => {}
    }
    let mass = if draw.chance(0.3) { BeamMass::Lumped } else { BeamMass::Consistent };
    Beam {
        name: name.to_owned(),
        points,
        curve,
        elements: Count::Each(draw.count(1, 3)),
        element: None,
        order,
        normal: Some(normals),
        twist: Twist::Normal,
        section: section(draw),
        stations: None,
        length: None,
        curvature: None,
        prestress: None,
        radius: None,
        mass,
        tension: None,
        start,
        end: End::Free,
        relative_to: None,
        velocity: [0.0; 3],
        angular_velocity: [0.0; 3],
    }
}

/// A body at the end of a straight beam.
fn with_body(model: &mut Model, draw: &mut Draw) {
    let Some(end) = model.beams[0].points.last().copied() else { return };
    let hung = body("body0".into(), along(end, 0.3, draw.direction()), draw);
    let kind = draw.pick(&[JointKind::Fixed, JointKind::Revolute, JointKind::Spherical]);
    let new = joint("joint0".into(), kind, ["beam0.end", "body0"], end, draw.direction());
    model.joints.push(new);
    model.bodies.push(hung);
}

/// A beam that a joint holds instead of a clamp, with material damping.
fn swing(model: &mut Model, draw: &mut Draw) {
    let beam = &mut model.beams[0];
    beam.start = End::Free;
    if draw.chance(0.5) {
        beam.section.damping = Some(Damping::Time(draw.magnitude(&[1e-5, 1e-4])));
    }
    let at = match &beam.curve {
        Some(Curve::Arc { from, .. }) => *from,
        _ => beam.points.first().copied().unwrap_or_default(),
    };
    let kind = draw.pick(&[JointKind::Revolute, JointKind::Spherical, JointKind::Fixed]);
    let new = joint("joint0".into(), kind, [GROUND, "beam0.start"], at, draw.direction());
    model.joints.push(new);
}
