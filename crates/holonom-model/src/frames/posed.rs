//! Parts of a model restated in the inertial frame: each function takes a part and the frame in
//! which it was stated.

use nalgebra::{Matrix3, Vector3};
use vi_multibody::joint::complete_axis;

use super::start::is_ground;
use crate::types::frame::Frame;
use crate::types::reference_frame::MovingFrame;
use crate::{
    Bar, Beam, Body, Bushing, Constraint, Contact, ContactSide, Control, Curve, Joint, Law, Load,
    Normal, Particle, Spring, Twist,
};

/// A body; with `by_joints`, its velocities follow from its joints unless it states some.
pub(crate) fn body(body: &mut Body, frame: &MovingFrame, by_joints: bool) {
    body.relative_to = None;
    if body.orientation().fault().is_some() {
        return; // reported by the checks
    }
    let omega = body.spatial_angular_velocity(); // components in the frame
    let states = omega.iter().chain(&body.velocity).any(|v| *v != 0.0);
    point(&mut body.position, frame);
    let twice = body.angular_velocity.is_some() && body.body_angular_velocity.is_some();
    if !twice && (states || !by_joints) {
        velocity(&mut body.velocity, &body.position, frame);
        let omega = frame.omega + frame.rotation * omega;
        if omega != Vector3::zeros() {
            (body.angular_velocity, body.body_angular_velocity) = (Some(omega.into()), None);
        }
    }
    if frame.rotation != Matrix3::identity() {
        let rotation = frame.rotation * body.rotation();
        body.matrix = Some(std::array::from_fn(|i| std::array::from_fn(|j| rotation[(i, j)])));
        (body.quaternion, body.rotation_vector, body.euler) = (None, None, None);
    }
}

/// A beam; with `by_joints`, its velocities follow from its joints unless it states some. Axes of
/// its section that it does not state are those that it has in the frame.
pub(crate) fn beam(beam: &mut Beam, frame: &MovingFrame, by_joints: bool) {
    beam.relative_to = None;
    if frame.rotation != Matrix3::identity() && beam.normal.is_none() {
        let first = |mesh: vi_beam::mesh::BeamMesh| {
            Some(mesh.triads.first()?.column(0).into_owned().into())
        };
        let normals: Option<Vec<[f64; 3]>> =
            beam.meshes().ok().and_then(|legs| legs.into_iter().map(first).collect());
        beam.normal = normals.map(Normal::Legs);
        beam.twist = Twist::Minimal;
    }
    beam.points.iter_mut().for_each(|x| point(x, frame));
    match &mut beam.curve {
        Some(Curve::Arc { from, center, axis, .. } | Curve::Helix { from, center, axis, .. }) => {
            point(from, frame);
            point(center, frame);
            direction(axis, frame);
        }
        Some(Curve::Spline { points }) => points.iter_mut().for_each(|x| point(x, frame)),
        None => {}
    }
    match &mut beam.normal {
        Some(Normal::One(normal)) => direction(normal, frame),
        Some(Normal::Legs(normals)) => normals.iter_mut().for_each(|n| direction(n, frame)),
        None => {}
    }
    let states = beam.velocity.iter().chain(&beam.angular_velocity).any(|v| *v != 0.0);
    if let Some(first) = first_point(beam).filter(|_| states || !by_joints) {
        velocity(&mut beam.velocity, &first, frame);
        direction(&mut beam.angular_velocity, frame);
        let omega = Vector3::from(beam.angular_velocity) + frame.omega;
        beam.angular_velocity = omega.into();
    }
}

/// The point of a beam whose velocity it states.
fn first_point(beam: &Beam) -> Option<[f64; 3]> {
    match &beam.curve {
        Some(Curve::Arc { from, .. } | Curve::Helix { from, .. }) => Some(*from),
        Some(Curve::Spline { points }) => points.first().copied(),
        None => beam.points.first().copied(),
    }
}

/// The frames of the nodes of a beam that is stated in the inertial frame; none when it has no
/// nodes.
pub(crate) fn nodes(beam: &Beam) -> Vec<MovingFrame> {
    let (velocity, omega) = (Vector3::from(beam.velocity), Vector3::from(beam.angular_velocity));
    let Some(first) = first_point(beam) else { return Vec::new() };
    let moving = MovingFrame { origin: first.into(), velocity, omega, ..MovingFrame::inertial() };
    let legs = beam.meshes().unwrap_or_default().into_iter();
    let nodes = legs.flat_map(|leg| leg.centers.into_iter().zip(leg.triads));
    let frame = |(origin, rotation): (Vector3<f64>, Matrix3<f64>)| MovingFrame {
        origin,
        rotation,
        velocity: moving.velocity_at(&origin),
        omega,
    };
    nodes.map(frame).collect()
}

/// A particle.
pub(crate) fn particle(particle: &mut Particle, frame: &MovingFrame) {
    particle.relative_to = None;
    let stated = <[f64; 3]>::try_from(particle.position.as_slice());
    let moves = <[f64; 3]>::try_from(particle.velocity.as_slice());
    let moves = if particle.velocity.is_empty() { Ok([0.0; 3]) } else { moves };
    if let (Ok(mut position), Ok(mut moves)) = (stated, moves) {
        point(&mut position, frame);
        velocity(&mut moves, &position, frame);
        (particle.position, particle.velocity) = (position.to_vec(), moves.to_vec());
    }
}

/// A bar: the point of the ground that holds it.
pub(crate) fn bar(bar: &mut Bar, frame: &MovingFrame) {
    bar.relative_to = None;
    if is_ground(&bar.from) || is_ground(&bar.to) {
        ground_point(&mut bar.point, frame);
    }
}

/// A joint: its position and axes, and an anchor on the ground. Axes that it does not state, of its
/// joint frame, are those that it has in the frame.
pub(crate) fn joint(joint: &mut Joint, frame: &MovingFrame) {
    joint.relative_to = None;
    if frame.rotation != Matrix3::identity() && joint.first_axis.is_none() {
        let by_bodies = joint.kind.turns_first_axis() || joint.kind.has_second_axis();
        let stated = joint.axis.map(Vector3::from).filter(|axis| axis.amax() >= 1e-100);
        match stated {
            Some(axis) if !by_bodies => {
                let across = complete_axis(&axis.normalize()).column(0).into_owned();
                joint.first_axis = Some(across.into());
            }
            None if !joint.kind.has_axis() => {
                (joint.axis, joint.first_axis) = (Some([0.0, 0.0, 1.0]), Some([1.0, 0.0, 0.0]));
            }
            _ => {}
        }
    }
    joint.position.iter_mut().for_each(|x| point(x, frame));
    let axes = [&mut joint.axis, &mut joint.axis2, &mut joint.first_axis];
    axes.into_iter().flatten().for_each(|axis| direction(axis, frame));
    let anchors =
        [(&joint.parent, &mut joint.anchor_parent), (&joint.child, &mut joint.anchor_child)];
    for (end, anchor) in anchors {
        if is_ground(end) {
            anchor.iter_mut().for_each(|x| point(x, frame));
        }
    }
}

/// A spring: the points of the ground that hold it.
pub(crate) fn spring(spring: &mut Spring, frame: &MovingFrame) {
    spring.relative_to = None;
    let ends = [(&spring.from, &mut spring.point_from), (&spring.to, &mut spring.point_to)];
    for (end, held) in ends {
        if is_ground(end) {
            ground_point(held, frame);
        }
    }
}

/// A bushing: its place and its axes.
pub(crate) fn bushing(bushing: &mut Bushing, frame: &MovingFrame) {
    bushing.relative_to = None;
    if bushing.orientation().fault().is_some() {
        return; // reported by the checks
    }
    point(&mut bushing.position, frame);
    if frame.rotation != Matrix3::identity() {
        let axes = frame.rotation * bushing.axes();
        bushing.matrix = Some(std::array::from_fn(|i| std::array::from_fn(|j| axes[(i, j)])));
        (bushing.quaternion, bushing.rotation_vector, bushing.euler) = (None, None, None);
    }
}

/// A contact: the plane of the ground. One on a body, or with bodies, is left to the checks.
pub(crate) fn contact(contact: &mut Contact, frame: &MovingFrame) {
    let ContactSide::Plane(side) = &mut contact.a else { return };
    if is_ground(&side.plane.on) {
        contact.relative_to = None;
        point(&mut side.plane.position, frame);
        direction(&mut side.plane.normal, frame);
    }
}

/// A law: the points of the ground that hold it. Others are left to the checks.
pub(crate) fn law(law: &mut Law, frame: &MovingFrame) {
    if law.from.is_none() {
        return;
    }
    law.relative_to = None;
    let ends = [(&law.from, &mut law.point_from), (&law.to, &mut law.point_to)];
    for (end, held) in ends {
        if end.as_deref().is_some_and(is_ground) {
            ground_point(held, frame);
        }
    }
}

/// A load: directions that are fixed in space. One whose directions are those of its body is left
/// to the checks.
pub(crate) fn load(load: &mut Load, frame: &MovingFrame) {
    if load.frame == Frame::Space {
        load.relative_to = None;
        direction(&mut load.force, frame);
        direction(&mut load.torque, frame);
    }
}

/// A control: the directions of its wrench, as those of a load.
pub(crate) fn control(control: &mut Control, frame: &MovingFrame) {
    if let Some(mut own) = control.load() {
        load(&mut own, frame);
        let Load { force, torque, relative_to, .. } = own;
        (control.force, control.torque, control.relative_to) = (force, torque, relative_to);
    }
}

/// A constraint: points of the ground, or position and axis.
pub(crate) fn constraint(constraint: &mut Constraint, frame: &MovingFrame) {
    match constraint {
        Constraint::Distance { from, to, point_from, point_to, relative_to, .. } => {
            *relative_to = None;
            for (end, held) in [(from, point_from), (to, point_to)] {
                if is_ground(end) {
                    point(held, frame);
                }
            }
        }
        Constraint::PointOnLine { position, axis, relative_to, .. }
        | Constraint::PointOnPlane { position, axis, relative_to, .. } => {
            *relative_to = None;
            point(position, frame);
            direction(axis, frame);
        }
        Constraint::Rolling { axis, plane, relative_to, .. } => {
            *relative_to = None;
            axis.iter_mut().for_each(|axis| direction(axis, frame));
            point(&mut plane.position, frame);
            direction(&mut plane.normal, frame);
        }
        Constraint::Blade { position, axis, relative_to, .. } => {
            *relative_to = None;
            point(position, frame);
            direction(axis, frame);
        }
        Constraint::Gear { .. } | Constraint::Motion { .. } | Constraint::Velocity { .. } => {}
    }
}

/// A point of the ground, the origin of the frame if it is not stated; one of another dimension is
/// left to the checks.
fn ground_point(held: &mut Option<Vec<f64>>, frame: &MovingFrame) {
    let stated = held.clone().unwrap_or_else(|| vec![0.0; 3]);
    if let Ok(mut x) = <[f64; 3]>::try_from(stated) {
        point(&mut x, frame);
        *held = Some(x.to_vec());
    }
}

fn point(x: &mut [f64; 3], frame: &MovingFrame) {
    *x = frame.point(Vector3::from(*x)).into();
}

fn direction(x: &mut [f64; 3], frame: &MovingFrame) {
    *x = (frame.rotation * Vector3::from(*x)).into();
}

/// A velocity relative to the frame, of a point that is at `position` in space.
fn velocity(v: &mut [f64; 3], position: &[f64; 3], frame: &MovingFrame) {
    let relative = frame.rotation * Vector3::from(*v);
    *v = (frame.velocity_at(&Vector3::from(*position)) + relative).into();
}
