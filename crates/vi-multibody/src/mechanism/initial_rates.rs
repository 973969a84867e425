//! Initial velocities from joint rates: `t² = X t¹ + S τ`, root first (LMO08 (71)–(75)).
//!
//! Where some joint states its rates, a body without velocities of its own moves with its joint: at the
//! stated rates, or at rest relative to its parent. Frames without mass of their own (nodes of
//! beams) have given velocities.

use crate::mechanism::Mechanism;
use crate::mechanism::description::Description;
use crate::pair::joint::Joint;
use crate::pair::{PairKind, Twist};
use crate::tree::Link;
use nalgebra::Vector3;

/// Why the rates of a joint cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RateError {
    /// The joint closes a loop.
    #[error("the rate of a joint that closes a loop follows from the others")]
    ClosesLoop,
    /// A spherical or fixed joint.
    #[error("a {pair} joint has no rates")]
    NoRates {
        /// The kinematic pair.
        pair: &'static str,
    },
    /// Not one rate for each freedom.
    #[error("{found} rate(s) for {expected} degree(s) of freedom")]
    Count {
        /// Rates stated.
        found: usize,
        /// Degrees of freedom of the joint.
        expected: usize,
    },
    /// The spanning tree passes the joint from child to parent.
    #[error("the parent is the outboard body, seen from the ground or the free root")]
    OutboardParent,
    /// The child is a frame without mass of its own.
    #[error("the outboard body is a node of a beam, whose velocity the beam states")]
    OutboardNode,
    /// The child has a velocity of its own.
    #[error("the velocity of the child is stated twice: by itself and by the joint")]
    StatedTwice,
}

impl RateError {
    /// What to state instead.
    #[must_use]
    pub fn help(&self) -> String {
        match self {
            Self::ClosesLoop => "state the rate of another joint of the loop".to_owned(),
            Self::NoRates { .. } => "state the angular velocity of the body".to_owned(),
            Self::Count { expected, .. } => format!("write {expected} number(s)"),
            Self::OutboardParent => {
                "exchange parent and child, and the sign of the rate".to_owned()
            }
            Self::OutboardNode => {
                "remove the rate; write `velocity` and `angular_velocity` of the beam".to_owned()
            }
            Self::StatedTwice => "keep the velocities of the body or the `rate`".to_owned(),
        }
    }
}

/// The rates of a joint that cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RefusedRate {
    /// Number of the joint.
    pub joint: usize,
    /// Why.
    pub error: RateError,
}

/// Fills in the velocities of the bodies that joint rates determine; `rates`: those of the first joints of
/// the description, translations first (m/s), then rotations (rad/s).
///
/// # Errors
/// [`RefusedRate`].
pub fn apply(description: &mut Description, rates: &[Option<&[f64]>]) -> Result<(), RefusedRate> {
    if rates.iter().all(Option::is_none) {
        return Ok(());
    }
    let mechanism = Mechanism::new(description.clone());
    let stated = |joint: usize| rates.get(joint).copied().flatten();
    if let Some(&joint) = mechanism.cut_joints().iter().find(|&&joint| stated(joint).is_some()) {
        return Err(RefusedRate { joint, error: RateError::ClosesLoop });
    }
    let q = mechanism.initial_configuration();
    let links = mechanism.tree().links();
    let mut twists: Vec<Twist> = Vec::with_capacity(links.len());
    for link in links {
        let number = number_of(&link.joint, &mechanism.description().joints);
        let body = &description.bodies[link.frame];
        let own = Twist::new(body.velocity, body.omega);
        let still = body.velocity == Vector3::zeros() && body.omega == Vector3::zeros();
        let is_node = body.body.is_none();
        let twist = match number.and_then(|k| stated(k).map(|rates| (k, rates))) {
            None if !still || link.joint.kind == PairKind::Free || is_node => own,
            None => transmitted(&mechanism, link, &q, &twists, &[]),
            Some((joint, rates)) => {
                let stated_as = &mechanism.description().joints[joint];
                check(stated_as, link, rates, (still, is_node))
                    .map_err(|error| RefusedRate { joint, error })?;
                transmitted(&mechanism, link, &q, &twists, rates)
            }
        };
        twists.push(twist);
    }
    for (link, twist) in links.iter().zip(&twists) {
        let body = &mut description.bodies[link.frame];
        (body.velocity, body.omega) = (twist.linear, twist.angular);
    }
    Ok(())
}

/// The joint that a link of the spanning tree comes from; `None` for free roots.
fn number_of(link: &Joint, joints: &[Joint]) -> Option<usize> {
    let is_it = |joint: &Joint| joint == link || joint.reversed() == *link;
    joints.iter().position(|joint| joint.name == link.name && is_it(joint))
}

/// `X t¹ + S τ`; a spherical joint at rest rotates with its parent.
fn transmitted(
    mechanism: &Mechanism,
    link: &Link,
    q: &[f64],
    twists: &[Twist],
    rates: &[f64],
) -> Twist {
    let map = link.joint.kind.velocity_map(&mechanism.tree().configuration(link, q));
    let parent = link.parent.map_or(Twist::zero(), |p| twists[p]);
    let mut twist = map.transfer.apply(&parent);
    if link.joint.kind.rotation_vector() == Some(0) {
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
    joint: &Joint,
    link: &Link,
    rates: &[f64],
    (still, is_node): (bool, bool),
) -> Result<(), RateError> {
    let (found, expected) = (rates.len(), joint.kind.dof());
    if expected == 0 || joint.kind.rotation_vector() == Some(0) {
        return Err(RateError::NoRates { pair: joint.kind.name() });
    }
    if found != expected {
        return Err(RateError::Count { found, expected });
    }
    if link.joint.parent.frame != joint.parent.frame {
        return Err(RateError::OutboardParent);
    }
    if is_node {
        return Err(RateError::OutboardNode);
    }
    if !still {
        return Err(RateError::StatedTwice);
    }
    Ok(())
}
