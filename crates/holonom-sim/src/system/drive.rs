//! Joint springs, dampers, motors and scalar constraints of a model, as parts of a mechanism.

use super::names::Names;
use super::time_function::TimeFunctions;
use holonom_model::{Constraint, ModelError, Problem};
use nalgebra::Vector3;
use std::sync::Arc;
use vi_multibody::builder::{CoordinateId, JointId, MechanismBuilder, RollingPart};
use vi_multibody::held_effort::HeldEffort;
use vi_multibody::joint_force::{JointLaw, Motor, PdControl, Setpoint, Viscous};

/// Degree of freedom `freedom` of joint `id`.
pub(super) fn coordinate(
    joint: &holonom_model::Joint,
    id: JointId,
    freedom: usize,
    key: String,
) -> Result<CoordinateId, ModelError> {
    check_coordinate(joint, freedom, key).map(|()| id.coordinate(freedom))
}

/// Refuses a coordinate that the joint does not have.
pub(crate) fn check_coordinate(
    joint: &holonom_model::Joint,
    freedom: usize,
    key: String,
) -> Result<(), ModelError> {
    let kind = joint.pair();
    let count = kind.coordinate_count();
    if freedom < count {
        return Ok(());
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

/// What acts on one coordinate of a joint.
#[derive(Clone, Debug)]
pub(crate) struct JointDrive {
    /// `spring`, `damper` or `motor`.
    pub(crate) part: &'static str,
    /// Which degree of freedom of the joint.
    pub(crate) freedom: usize,
    /// Its effort.
    pub(crate) law: ElementLaw,
    /// Whether it does not act.
    pub(crate) idle: bool,
}

impl JointDrive {
    /// `τ(t, θ, θ̇)`.
    pub(crate) fn effort(&self, t: f64, coordinate: f64, rate: f64) -> f64 {
        if self.idle { 0.0 } else { self.law.effort(t, coordinate, rate) }
    }
}

/// The effort of a force element along a joint coordinate, N or N·m.
#[derive(Clone, Debug)]
pub(crate) enum ElementLaw {
    /// `−k (θ − θ_0)`.
    Spring { stiffness: f64, rest: f64 },
    /// `τ(t, θ, θ̇)`.
    Force(Arc<dyn JointLaw>),
    /// Of a motor without effort and control.
    Idle,
}

impl ElementLaw {
    /// `τ(t, θ, θ̇)`.
    pub(crate) fn effort(&self, t: f64, coordinate: f64, rate: f64) -> f64 {
        match self {
            Self::Spring { stiffness, rest } => -stiffness * (coordinate - rest),
            Self::Force(law) => law.effort(t, coordinate, rate),
            Self::Idle => 0.0,
        }
    }
}

/// Which parts act on a joint, and on which freedom, in the order of [`joint_elements`].
pub(crate) fn joint_parts(joint: &holonom_model::Joint) -> Vec<(&'static str, usize)> {
    let spring = joint.spring.as_ref().map(|own| ("spring", own.freedom));
    let damper = joint.damper.as_ref().map(|own| ("damper", own.freedom));
    let motor = joint.motor.as_ref().map(|own| ("motor", own.freedom));
    [spring, damper, motor].into_iter().flatten().collect()
}

/// Spring, damper, motor and control of a joint, in this order; `setpoint`: what the control follows
/// in the place of the path of the motor.
pub(crate) fn joint_elements(
    joint: &holonom_model::Joint,
    setpoint: Option<HeldEffort>,
    times: &mut TimeFunctions<'_>,
) -> Vec<JointDrive> {
    let mut elements = Vec::new();
    let mut add =
        |part, freedom, law| elements.push(JointDrive { part, freedom, law, idle: false });
    if let Some(spring) = &joint.spring {
        let (stiffness, rest) = (spring.stiffness, spring.rest);
        match times.spring(&format!("the spring of `{}`", joint.name), spring) {
            Some(law) => add("spring", spring.freedom, ElementLaw::Force(law)),
            None => add("spring", spring.freedom, ElementLaw::Spring { stiffness, rest }),
        }
    }
    if let Some(damper) = &joint.damper {
        add("damper", damper.freedom, ElementLaw::Force(Arc::new(Viscous(damper.damping))));
    }
    if let Some(motor) = &joint.motor {
        let controlled = motor.proportional != 0.0 || motor.derivative != 0.0;
        if motor.effort == 0.0 && !controlled {
            add("motor", motor.freedom, ElementLaw::Idle);
        }
        if motor.effort != 0.0 {
            let owner = format!("the history of the motor of `{}`", joint.name);
            let (effort, history) = (motor.effort, times.history(&owner, &motor.history));
            let law = Motor(Arc::new(move |t| effort * history.value(t)));
            add("motor", motor.freedom, ElementLaw::Force(Arc::new(law)));
        }
        if controlled {
            let path =
                times.path(&format!("the path of the motor of `{}`", joint.name), &motor.path);
            let reference = Arc::new(move |t| match &setpoint {
                Some(held) => Setpoint { value: held.get(), rate: 0.0 },
                None => {
                    let [value, rate, _] = path(t);
                    Setpoint { value, rate }
                }
            });
            let (proportional, derivative) = (motor.proportional, motor.derivative);
            let law = PdControl { proportional, derivative, reference };
            add("motor", motor.freedom, ElementLaw::Force(Arc::new(law)));
        }
    }
    elements
}

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
                builder.joint_force(at, law).named(&format!("{}.{part}", joint.name));
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
