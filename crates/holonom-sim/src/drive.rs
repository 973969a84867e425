//! Joint springs, dampers, motors and scalar constraints of a model, as parts of a mechanism.

use crate::names::Names;
use holonom_model::{Constraint, ModelError, Problem};
use std::sync::Arc;
use vi_multibody::builder::{CoordinateId, JointId, MechanismBuilder};
use vi_multibody::joint_force::{PdControl, Setpoint, Viscous};

/// Degree of freedom `freedom` of joint `id`.
fn coordinate(
    joint: &holonom_model::Joint,
    id: JointId,
    freedom: usize,
    key: String,
) -> Result<CoordinateId, ModelError> {
    let kind = joint.pair();
    let count = kind.coordinate_count();
    if freedom < count {
        return Ok(id.coordinate(freedom));
    }
    let name = kind.name();
    let message = format!("a {name} joint has no coordinate {freedom}");
    let help = match count {
        0 => format!("{name} joints have no joint coordinates: use a [[spring]] or a [[load]]"),
        1 => "its only coordinate is 0".to_owned(),
        _ => format!("its coordinates are 0 to {}", count - 1),
    };
    Err(ModelError::Assembly(vec![Problem::new(key, message).help(help)]))
}

/// Adds what acts on the coordinates of a joint.
pub(crate) fn add_joint_forces(
    builder: &mut MechanismBuilder,
    joint: &holonom_model::Joint,
    id: JointId,
) -> Result<(), ModelError> {
    let of = |freedom: usize, what: &str| {
        coordinate(joint, id, freedom, format!("joint.{}.{what}.freedom", joint.name))
    };
    if let Some(spring) = &joint.spring {
        builder.joint_spring(of(spring.freedom, "spring")?, spring.stiffness, spring.rest);
    }
    if let Some(damper) = &joint.damper {
        builder.joint_force(of(damper.freedom, "damper")?, Viscous(damper.damping));
    }
    if let Some(motor) = &joint.motor {
        let at = of(motor.freedom, "motor")?;
        if motor.effort != 0.0 {
            let (effort, history) = (motor.effort, motor.history.time_history());
            builder.motor(at, move |t| effort * history.value(t));
        }
        if motor.proportional != 0.0 || motor.derivative != 0.0 {
            let path = motor.path;
            let reference = Arc::new(move |t| {
                let [value, rate, _] = path.at(t);
                Setpoint { value, rate }
            });
            let (proportional, derivative) = (motor.proportional, motor.derivative);
            builder.joint_force(at, PdControl { proportional, derivative, reference });
        }
    }
    Ok(())
}

/// Adds a `[[constraint]]`.
pub(crate) fn add_constraint(
    builder: &mut MechanismBuilder,
    constraint: &Constraint,
    names: &Names<'_>,
) -> Result<(), ModelError> {
    let of = |joint: &str, freedom: usize, what: &str| {
        let found = names.joint(joint);
        let key = format!("constraint.{}.{what}", constraint.name());
        found.map(|(joint, id)| coordinate(joint, id, freedom, key)).transpose()
    };
    match constraint {
        Constraint::Distance { name, from, to, point_from, point_to, length } => {
            let (from, to) = (names.point(from, *point_from), names.point(to, *point_to));
            match length {
                Some(length) => builder.distance_of_length(name, from, to, *length),
                None => builder.distance(name, from, to),
            }
        }
        Constraint::PointOnLine { name, parent, child, position, axis } => {
            let (parent, child) = (names.frame(parent), names.frame(child));
            builder.point_on_line(name, parent, child, *position, *axis);
        }
        Constraint::PointOnPlane { name, parent, child, position, axis } => {
            let (parent, child) = (names.frame(parent), names.frame(child));
            builder.point_on_plane(name, parent, child, *position, *axis);
        }
        Constraint::Gear { name, joints: [a, b], freedoms, ratio } => {
            let a = of(a, freedoms[0], "freedoms")?;
            if let (Some(a), Some(b)) = (a, of(b, freedoms[1], "freedoms")?) {
                builder.gear(name, a, b, *ratio);
            }
        }
        Constraint::Motion { name, joint, freedom, path } => {
            let path = *path;
            if let Some(coordinate) = of(joint, *freedom, "freedom")? {
                builder.motion(name, coordinate, move |t| path.at(t));
            }
        }
    }
    Ok(())
}
