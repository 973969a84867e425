//! Joint springs, dampers, motors and single constraints of a model, as numbers.

use crate::dynamics::Dynamics;
use crate::model::{Constraint, Joint as JointModel, JointMotor, ModelError, Problem};
use nalgebra::Vector3;
use std::sync::Arc;
use vi_multibody::coordinate::JointCoordinate;
use vi_multibody::joint::Joint;
use vi_multibody::joint_force::{JointForce, JointSpring, Motor, PdControl, Viscous};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::scalar_constraint::ScalarConstraint;

/// Coordinate `freedom` of a joint for a constraint.
fn coordinate(joint: &Joint, freedom: usize, key: &str) -> Result<JointCoordinate, ModelError> {
    JointCoordinate::principal(joint, freedom).ok_or_else(|| {
        let count = (0..6).filter(|k| JointCoordinate::principal(joint, *k).is_some()).count();
        let kind = joint.kind.name();
        let message = format!("a {kind} joint has no coordinate {freedom}");
        let help = match count {
            0 => format!("{kind} joints have no joint coordinates: use a [[spring]] or a [[load]]"),
            1 => "its only coordinate is 0".to_owned(),
            _ => format!("its coordinates are 0 to {}", count - 1),
        };
        ModelError::Assembly(vec![Problem::new(key, message).help(help)])
    })
}

/// Adds what acts on the coordinates of joint `k`.
pub(crate) fn add_joint_forces(
    mut dynamics: Dynamics,
    model: &JointModel,
    (mechanism, k): (&mut Mechanism, usize),
) -> Result<Dynamics, ModelError> {
    let key = |what: &str| format!("joint.{}.{what}", model.name);
    let mut listed = |freedom: usize, what: &str| match mechanism.coordinate(k, freedom) {
        Some(coordinate) => Ok(coordinate),
        None => coordinate(&mechanism.description().joints[k], freedom, &key(what)), // the error
    };
    if let Some(spring) = &model.spring {
        let coordinate = listed(spring.freedom, "spring.freedom")?;
        let (stiffness, rest) = (spring.stiffness, spring.rest);
        let spring = JointSpring { coordinate, stiffness, rest };
        dynamics = dynamics.joint_spring(spring);
    }
    if let Some(damper) = &model.damper {
        let coordinate = listed(damper.freedom, "damper.freedom")?;
        let law = Viscous(damper.damping);
        dynamics = dynamics.joint_force(JointForce { coordinate, law });
    }
    if let Some(motor) = &model.motor {
        let coordinate = listed(motor.freedom, "motor.freedom")?;
        dynamics = add_motor(dynamics, motor, &coordinate);
    }
    Ok(dynamics)
}

fn add_motor(mut dynamics: Dynamics, motor: &JointMotor, coordinate: &JointCoordinate) -> Dynamics {
    if motor.effort != 0.0 {
        let (effort, history) = (motor.effort, motor.history.time_history());
        let law = Motor(Arc::new(move |t| effort * history.value(t)));
        dynamics = dynamics.joint_force(JointForce { coordinate: coordinate.clone(), law });
    }
    if motor.proportional != 0.0 || motor.derivative != 0.0 {
        let path = motor.path;
        let reference = Arc::new(move |t| {
            let [value, rate, _] = path.at(t);
            (value, rate)
        });
        let (proportional, derivative) = (motor.proportional, motor.derivative);
        let law = PdControl { proportional, derivative, reference };
        dynamics = dynamics.joint_force(JointForce { coordinate: coordinate.clone(), law });
    }
    dynamics
}

/// A `[[constraint]]` that couples or drives joint coordinates; `None` for the geometric ones.
pub(crate) fn coordinate_constraint(
    constraint: &Constraint,
    joints: &[Joint],
    q: &[f64],
) -> Result<Option<ScalarConstraint>, ModelError> {
    let find = |name: &str| joints.iter().find(|j| j.name == name);
    let key = |what: &str| format!("constraint.{}.{what}", constraint.name());
    match constraint {
        Constraint::Gear { name, joints: [a, b], freedoms, ratio } => {
            let (Some(a), Some(b)) = (find(a), find(b)) else { return Ok(None) };
            let a = coordinate(a, freedoms[0], &key("freedoms"))?;
            let b = coordinate(b, freedoms[1], &key("freedoms"))?;
            Ok(Some(ScalarConstraint::coupling(name, (a, b), *ratio, q)))
        }
        Constraint::Motion { name, joint, freedom, path } => {
            let Some(joint) = find(joint) else { return Ok(None) };
            let coordinate = coordinate(joint, *freedom, &key("freedom"))?;
            let path = *path;
            let reference = Arc::new(move |t| path.at(t));
            Ok(Some(ScalarConstraint::motion(name, coordinate, reference)))
        }
        _ => Ok(None),
    }
}

/// A vector from numbers.
pub(crate) fn vector(x: &[f64; 3]) -> Vector3<f64> {
    Vector3::from(*x)
}
