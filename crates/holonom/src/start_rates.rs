//! Start velocities from joint rates: `t² = X t¹ + S τ`, root first (LMO08 (71)–(75)).
//!
//! In a model that states the `rate` of some joint, a body without velocities of its own moves with
//! its joint: at the stated rate, or at rest relative to what carries it. A beam states its own velocities.

use crate::model::{Model, ModelError, Problem};
use nalgebra::Vector3;
use vi_multibody::joint::Joint;
use vi_multibody::mechanism::{Description, Mechanism};
use vi_multibody::pair::{PairKind, Twist};
use vi_multibody::tree::Link;

/// Fills in the velocities of the bodies that joint rates determine.
///
/// # Errors
/// [`ModelError`] when a rate is stated where it cannot be used.
pub(crate) fn apply(model: &Model, description: &mut Description) -> Result<(), ModelError> {
    if model.joints.iter().all(|joint| joint.rate.is_none()) {
        return Ok(());
    }
    let mechanism = Mechanism::new(description.clone());
    let (q, _) = mechanism.start();
    let tree = mechanism.tree();
    for &k in mechanism.cut_joints() {
        if model.joints.get(k).is_some_and(|joint| joint.rate.is_some()) {
            let message = "the rate of a joint that closes a loop follows from the others";
            return Err(refuse(model, k, message, "state the rate of another joint of the loop"));
        }
    }
    let is_node = |frame: usize| frame >= model.bodies.len();
    let mut twists: Vec<Twist> = Vec::with_capacity(tree.links().len());
    for link in tree.links() {
        let joint = model.joints.iter().position(|joint| joint.name == link.joint.name);
        let body = &description.bodies[link.frame];
        let own = Twist::new(body.velocity, body.omega);
        let still = body.velocity == Vector3::zeros() && body.omega == Vector3::zeros();
        let stated = joint.and_then(|k| model.joints[k].rate.as_ref().map(|rate| (k, rate)));
        let twist = match stated {
            None if !still || link.joint.kind == PairKind::Free || is_node(link.frame) => own,
            None => carried(&mechanism, link, &q, &twists, &[]),
            Some((k, rate)) => {
                let rates = rate.values();
                check(model, k, (&mechanism.description().joints[k], link), (rates, still))?;
                carried(&mechanism, link, &q, &twists, rates)
            }
        };
        twists.push(twist);
    }
    for (link, twist) in tree.links().iter().zip(&twists) {
        let body = &mut description.bodies[link.frame];
        (body.velocity, body.omega) = (twist.linear, twist.angular);
    }
    Ok(())
}

/// `X t¹ + S τ`; a spherical joint at rest turns with its parent.
fn carried(
    mechanism: &Mechanism,
    link: &Link,
    q: &[f64],
    twists: &[Twist],
    rates: &[f64],
) -> Twist {
    let map = link.joint.kind.velocity_map(&mechanism.tree().placement(link, q));
    let parent = link.parent.map_or(Twist::zero(), |p| twists[p]);
    let mut twist = map.transfer.apply(&parent);
    if link.joint.kind == PairKind::Spherical {
        for (column, omega) in map.columns().iter().zip(parent.angular.iter()) {
            twist.linear += *omega * column.linear;
            twist.angular += *omega * column.angular;
        }
    }
    for (column, rate) in map.columns().iter().zip(rates) {
        twist.linear += *rate * column.linear;
        twist.angular += *rate * column.angular;
    }
    twist
}

fn check(
    model: &Model,
    k: usize,
    (joint, link): (&Joint, &Link),
    (rates, still): (&[f64], bool),
) -> Result<(), ModelError> {
    let freedoms = joint.kind.freedoms();
    if matches!(joint.kind, PairKind::Spherical | PairKind::Fixed) {
        let message = format!("a {} joint has no rates", joint.kind.name());
        return Err(refuse(model, k, &message, "state the angular velocity of the body"));
    }
    if rates.len() != freedoms {
        let message = format!("{} rate(s) for {freedoms} freedom(s)", rates.len());
        return Err(refuse(model, k, &message, &format!("write {freedoms} number(s)")));
    }
    if link.joint.parent.frame != joint.parent.frame {
        let message = "the joint carries its parent, seen from the ground or the free root";
        return Err(refuse(
            model,
            k,
            message,
            "exchange parent and child, and the sign of the rate",
        ));
    }
    if link.frame >= model.bodies.len() {
        let message = "the joint carries a node of a beam, whose velocity the beam states";
        let help = "remove the rate; write `velocity` and `angular_velocity` of the beam";
        return Err(refuse(model, k, message, help));
    }
    if !still {
        let message = "the velocity of the child is stated twice: by itself and by the joint";
        return Err(refuse(model, k, message, "keep the velocities of the body or the `rate`"));
    }
    Ok(())
}

fn refuse(model: &Model, k: usize, message: &str, help: &str) -> ModelError {
    let key = format!("joint.{}.rate", model.joints[k].name);
    ModelError::Assembly(vec![Problem::new(key, message).help(help)])
}
