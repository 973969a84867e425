//! Initial velocities from joint rates: `t² = X t¹ + S τ`, root first (LMO08 (71)–(75)).
//!
//! A body without velocities of its own moves with its joint at the stated rates; where some joint
//! states rates, and always where a fixed joint holds it, at rest relative to its parent. Frames
//! that start as one rigid body (the nodes of a beam) without velocities take the motion of the
//! first of them that a joint moves.

use crate::mechanism::BodySpec;
use crate::mechanism::Mechanism;
use crate::mechanism::description::{Carried, Description};
use crate::pair::Twist;
use crate::pair::joint::{FrameId, Joint};
use crate::tree::TreeLink;
use nalgebra::Vector3;
use std::ops::Range;

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
            Self::StatedTwice => "keep the velocities of the child or the `rate`".to_owned(),
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

/// Fills in the velocities of the bodies that joint rates determine; `rates`: those of the first
/// joints of the description, translations first (m/s), then rotations (rad/s); `beams`: frames
/// that start as one rigid body.
///
/// # Errors
/// [`RefusedRate`].
pub fn apply(
    description: &mut Description,
    rates: &[Option<&[f64]>],
    beams: &[Range<usize>],
) -> Result<(), RefusedRate> {
    let any = rates.iter().any(Option::is_some);
    if !any && description.bodies.iter().all(BodySpec::is_still) {
        return Ok(());
    }
    let mechanism = Mechanism::new(description.clone());
    let stated = |joint: usize| rates.get(joint).copied().flatten();
    if let Some(&joint) = mechanism.cut_joints().iter().find(|&&joint| stated(joint).is_some()) {
        return Err(RefusedRate { joint, error: RateError::ClosesLoop });
    }
    let q = mechanism.initial_configuration();
    let links = mechanism.tree().links();
    let joints = &mechanism.description().joints;
    let number = |link: &TreeLink| if any { number_of(&link.joint, joints) } else { None };
    let numbers: Vec<Option<usize>> = links.iter().map(number).collect();
    let mut still: Vec<bool> = description.bodies.iter().map(BodySpec::is_still).collect();
    for (link, number) in links.iter().zip(&numbers) {
        if let Some((joint, rates)) = number.and_then(|k| stated(k).map(|rates| (k, rates))) {
            check(&joints[joint], link, rates, still[link.frame])
                .map_err(|error| RefusedRate { joint, error })?;
        }
    }
    let groups = rigid_groups(beams, description);
    let mut twists = vec![Twist::zero(); description.bodies.len()];
    loop {
        for (link, number) in links.iter().zip(&numbers) {
            let body = &description.bodies[link.frame];
            let rates = number.and_then(stated);
            let moved = any || link.joint.kind.is_fixed();
            twists[link.frame] = if still[link.frame] && !link.joint.kind.is_free() && moved {
                transmitted(&mechanism, link, &q, &twists, rates.unwrap_or_default())
            } else {
                Twist::new(body.velocity, body.omega)
            };
        }
        let carried: Vec<_> = groups
            .iter()
            .filter(|group| group.frames.clone().all(|frame| still[frame]))
            .filter_map(|group| Some((group.frames.clone(), group.moving_frame(&twists)?)))
            .collect();
        if carried.is_empty() {
            break;
        }
        for (frames, moving) in carried {
            let (center, twist) = (description.bodies[moving].center, twists[moving]);
            for frame in frames.clone() {
                still[frame] = false;
                let body = &mut description.bodies[frame];
                body.velocity = twist.linear + twist.angular.cross(&(body.center - center));
                body.omega = twist.angular;
            }
            description.carried.push(Carried { frames, with: moving });
        }
    }
    for (body, twist) in description.bodies.iter_mut().zip(&twists) {
        (body.velocity, body.omega) = (twist.linear, twist.angular);
    }
    Ok(())
}

/// Frames that start as one rigid body.
struct RigidGroup {
    frames: Range<usize>,
    fixed_to: Vec<usize>, // other frames, by fixed joints
}

impl RigidGroup {
    /// The first of its frames that the spanning tree moves, else the first moving frame that it is
    /// fixed to.
    fn moving_frame(&self, twists: &[Twist]) -> Option<usize> {
        let moves = |frame: &usize| {
            twists[*frame].linear != Vector3::zeros() || twists[*frame].angular != Vector3::zeros()
        };
        self.frames.clone().chain(self.fixed_to.iter().copied()).find(moves)
    }
}

/// The beams, and every other frame that a fixed joint holds: the spanning tree may start at it.
fn rigid_groups(beams: &[Range<usize>], description: &Description) -> Vec<RigidGroup> {
    let new = |frames: &Range<usize>| RigidGroup { frames: frames.clone(), fixed_to: Vec::new() };
    let mut groups: Vec<RigidGroup> = beams.iter().map(new).collect();
    let mut group_of = vec![None; description.bodies.len()];
    for (k, beam) in beams.iter().enumerate() {
        group_of[beam.clone()].fill(Some(k));
    }
    for joint in description.joints.iter().filter(|joint| joint.kind.is_fixed()) {
        if let [FrameId::Frame(a), FrameId::Frame(b)] = [joint.parent.frame, joint.child.frame] {
            for (own, other) in [(a, b), (b, a)] {
                let k = *group_of[own].get_or_insert_with(|| {
                    groups.push(new(&(own..own + 1)));
                    groups.len() - 1
                });
                groups[k].fixed_to.push(other);
            }
        }
    }
    groups
}

/// The joint that a link of the spanning tree comes from; `None` for free roots.
fn number_of(link: &Joint, joints: &[Joint]) -> Option<usize> {
    let is_it = |joint: &Joint| joint == link || joint.reversed() == *link;
    joints.iter().position(|joint| joint.name == link.name && is_it(joint))
}

/// `X t¹ + S τ`; a spherical joint at rest rotates with its parent.
fn transmitted(
    mechanism: &Mechanism,
    link: &TreeLink,
    q: &[f64],
    twists: &[Twist],
    rates: &[f64],
) -> Twist {
    let map = link.joint.kind.velocity_map(&mechanism.tree().configuration(link, q));
    let parent = link.parent.map_or(Twist::zero(), |p| twists[mechanism.tree().links()[p].frame]);
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

fn check(joint: &Joint, link: &TreeLink, rates: &[f64], still: bool) -> Result<(), RateError> {
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
    if !still {
        return Err(RateError::StatedTwice);
    }
    Ok(())
}
