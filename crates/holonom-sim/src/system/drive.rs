//! Joint springs, dampers, motors and scalar constraints of a model, as parts of a mechanism.

use super::coordinate::coordinate;
use super::joint_drive::{ElementLaw, JointDrive};
use super::names::Names;
use super::time_function::TimeFunctions;
use super::works::force_of;
use holonom_model::{Constraint, ModelError};
use nalgebra::Vector3;
use vi_multibody::builder::{MechanismBuilder, RollingPart};

/// Adds what acts on the coordinates of a joint.
pub(crate) fn add_joint_forces(
    builder: &mut MechanismBuilder,
    joint: &holonom_model::Joint,
    names: &Names<'_>,
    times: &mut TimeFunctions<'_>,
) -> Result<(), ModelError> {
    let id = names.joints[joint.name.as_str()].1;
    for JointDrive { part, freedom, law, .. } in names.elements(joint, times) {
        let key = format!("joint.{}.{part}.freedom", joint.name);
        let at = coordinate(joint, id, freedom, key)?;
        match law {
            ElementLaw::Spring { stiffness, rest } => builder.joint_spring(at, stiffness, rest),
            ElementLaw::Force(law) => {
                builder.joint_force(at, law).named(&force_of(&joint.name, part));
            }
            ElementLaw::Idle => {}
        }
    }
    Ok(())
}

/// Adds a `[[constraint]]`; those of sums of rates stand in [`super::rates`].
pub(crate) fn add_constraint(
    builder: &mut MechanismBuilder,
    constraint: &Constraint,
    names: &Names<'_>,
    times: &mut TimeFunctions<'_>,
) -> Result<(), ModelError> {
    let of = |joint: &str, freedom: usize, what: &str| {
        let found = names.joint(joint);
        let key = format!("constraint.{}.{what}", constraint.name());
        found.map(|(joint, id)| coordinate(joint, id, freedom, key)).transpose()
    };
    match constraint {
        Constraint::Distance { name, from, to, point_from, point_to, length, .. } => {
            let (from, to) = (names.point(from, *point_from), names.point(to, *point_to));
            match length {
                Some(length) => builder.distance_of_length(name, from, to, *length),
                None => builder.distance(name, from, to),
            }
        }
        Constraint::PointOnLine { name, parent, child, position, axis, .. } => {
            let (parent, child) = (names.frame(parent), names.frame(child));
            builder.point_on_line(name, parent, child, *position, *axis);
        }
        Constraint::PointOnPlane { name, parent, child, position, axis, .. } => {
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
            if let Some(coordinate) = of(joint, *freedom, "freedom")? {
                match names.outside.path(name) {
                    Some(path) => builder.motion(name, coordinate, move |t| path(t)),
                    None => {
                        let path = times.path(&format!("the path of `{name}`"), path);
                        builder.motion(name, coordinate, path);
                    }
                }
            }
        }
        Constraint::Rolling { name, body, axis, radius, tube, plane, .. } => {
            if let Some(body) = names.body(body) {
                let axis = axis.map(Vector3::from);
                let (origin, normal) = (plane.position.into(), plane.normal.into());
                let (radius, tube, spin) = (*radius, *tube, plane.spin);
                let part = RollingPart { body, axis, radius, tube, origin, normal, spin };
                builder.rolling(name, part);
            }
        }
        Constraint::Blade { name, body, position, axis, .. } => {
            if let Some(body) = names.body(body) {
                builder.blade(name, body, *position, *axis);
            }
        }
        Constraint::Velocity { .. } => {}
    }
    Ok(())
}
