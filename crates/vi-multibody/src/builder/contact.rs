//! Joint stops and dry friction as parts of a builder.

use super::error::finite;
use super::{BuildError, CoordinateId, ForceElements, MechanismBuilder};
use crate::contact::compliant_contact::CompliantContact;
use crate::contact::joint_friction::JointFriction;
use crate::contact::joint_stop::JointStop;
use crate::contact::shape_contact::ShapeContact;
use crate::contact::shape_group::{GroupError, ShapeGroup};
use crate::mechanism::Mechanism;
use crate::pair::joint::FrameId;
use std::sync::Arc;
use vi_constraints::nonsmooth::{ContactLaw, Unilateral};
use vi_core::linear::norm_inf;
use vi_rigid::gap::{ContactShape, NoGap, ShapePair};

/// Limits of a joint coordinate: stops.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointLimits {
    /// The lower limit, m or rad, revolutions counted.
    pub lower: Option<f64>,
    /// The upper limit, m or rad.
    pub upper: Option<f64>,
    /// Coefficient of restitution, between 0 and 1.
    pub restitution: f64,
}

/// Dry friction of a joint coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DryFriction {
    /// A constant force or torque while it slides, N or N·m; at rest it holds as much.
    Effort(f64),
    /// In proportion to the force that the joint transmits across its axis.
    Coefficient {
        /// Coefficient of friction.
        coefficient: f64,
        /// Radius of the pin of an angle, m; 1 for a length.
        radius: f64,
    },
}

#[derive(Clone)]
pub(super) enum ContactPart {
    Stop(CoordinateId, JointLimits),
    Friction(CoordinateId, DryFriction, f64),
    Own(Arc<dyn Unilateral>),
}

impl MechanismBuilder {
    /// Adds stops to a joint coordinate.
    pub fn joint_limits(&mut self, coordinate: CoordinateId, limits: JointLimits) {
        self.contacts.push(ContactPart::Stop(coordinate, limits));
    }

    /// Adds dry friction to a joint coordinate.
    pub fn joint_friction(&mut self, coordinate: CoordinateId, friction: DryFriction) {
        self.static_joint_friction(coordinate, friction, 1.0);
    }

    /// The same with a static friction of `ratio` times that of sliding, 1 or more: up to that it
    /// holds what sticks.
    pub fn static_joint_friction(
        &mut self,
        coordinate: CoordinateId,
        friction: DryFriction,
        ratio: f64,
    ) {
        self.contacts.push(ContactPart::Friction(coordinate, friction, ratio));
    }

    /// Adds the contact of a shape on one frame with a shape on another frame; shapes stand in the
    /// components along the directors of their frame, from its centre of mass.
    ///
    /// # Errors
    /// [`NoGap`] where the gap between two such shapes is not known.
    pub fn shape_contact(
        &mut self,
        name: &str,
        a: (impl Into<FrameId>, ContactShape),
        b: (impl Into<FrameId>, ContactShape),
        law: ContactLaw,
    ) -> Result<(), NoGap> {
        let pair = ShapePair::new(a.1, b.1)?;
        let (frames, name) = ([a.0.into(), b.0.into()], name.to_owned());
        let size = pair.extent();
        let contact = ShapeContact { source: name.clone(), name, pair, frames, law, size };
        self.contact(Arc::new(contact));
        Ok(())
    }

    /// Adds the contacts of many shapes, each with each but for `excluded` pairs of their numbers.
    ///
    /// # Errors
    /// [`GroupError`].
    pub fn shape_group(
        &mut self,
        name: &str,
        shapes: Vec<(FrameId, ContactShape)>,
        excluded: &[(usize, usize)],
        law: ContactLaw,
    ) -> Result<(), GroupError> {
        self.contact(Arc::new(ShapeGroup::new(name, shapes, excluded, law)?));
        Ok(())
    }

    /// Adds a compliant contact; the work of its damping and friction is listed under its name.
    pub fn compliant_contact(&mut self, name: &str, contact: CompliantContact) {
        self.compliant.push((name.to_owned(), contact));
    }

    /// Adds a contact of your own.
    pub fn contact(&mut self, contact: Arc<dyn Unilateral>) {
        self.contacts.push(ContactPart::Own(contact));
    }

    pub(super) fn add_contacts(
        &self,
        mechanism: &mut Mechanism,
        forces: &mut ForceElements,
    ) -> Result<(), BuildError> {
        let bodies = &mechanism.description().bodies;
        let extent = bodies.iter().fold(0.0, |size: f64, body| size.max(body.center.amax()));
        for part in &self.contacts {
            let (id, limits) = match part {
                ContactPart::Own(contact) => {
                    forces.contacts.elements.push(contact.clone());
                    continue;
                }
                ContactPart::Stop(id, limits) => (id, [limits.lower, limits.upper]),
                ContactPart::Friction(id, ..) => (id, [None, None]),
            };
            let coordinate = self.followed(*id, mechanism)?;
            let name = self.joints[id.joint.index()].name.clone();
            let limits = limits.map(|limit| limit.unwrap_or(0.0));
            let size = if coordinate.is_angle() { 1.0 } else { extent.max(norm_inf(&limits)) };
            let size = if size > 0.0 { size } else { 1.0 };
            let place = forces.contacts.elements.len() as u32;
            forces.contacts.elements.push(match part {
                ContactPart::Stop(_, limits) => {
                    let JointLimits { lower, upper, restitution } = *limits;
                    check_limits(&name, limits)?;
                    Arc::new(JointStop { name, coordinate, lower, upper, restitution, size })
                }
                ContactPart::Friction(_, friction, static_ratio) => {
                    let static_ratio = *static_ratio;
                    let [effort, lever] = numbers_of(&name, *friction)?;
                    if static_ratio.is_nan() || static_ratio < 1.0 {
                        let element = format!("friction of joint `{name}`");
                        return Err(BuildError::StaticFriction { element, ratio: static_ratio });
                    }
                    if lever > 0.0 {
                        forces.contacts.by_reaction.push((place, id.joint.index()));
                    }
                    Arc::new(JointFriction { name, coordinate, effort, lever, static_ratio, size })
                }
                ContactPart::Own(contact) => contact.clone(),
            });
        }
        Ok(())
    }
}

/// `τ_c` and `μr`.
fn numbers_of(joint: &str, friction: DryFriction) -> Result<[f64; 2], BuildError> {
    let element = || format!("friction of joint `{joint}`");
    let not_negative = |what: &'static str, value: f64| {
        finite(element, what, &[value])?;
        match value < 0.0 {
            true => Err(BuildError::Negative { element: element(), what, value }),
            false => Ok(value),
        }
    };
    Ok(match friction {
        DryFriction::Effort(effort) => [not_negative("effort", effort)?, 0.0],
        DryFriction::Coefficient { coefficient, radius } => {
            let radius = not_negative("radius", radius)?;
            [0.0, not_negative("coefficient", coefficient)? * radius]
        }
    })
}

fn check_limits(joint: &str, limits: &JointLimits) -> Result<(), BuildError> {
    let element = || format!("limits of joint `{joint}`");
    let JointLimits { lower, upper, restitution } = *limits;
    let [a, b] = [lower, upper].map(|limit| limit.unwrap_or(0.0));
    finite(element, "numbers", &[a, b, restitution])?;
    if !(0.0..=1.0).contains(&restitution) {
        return Err(BuildError::Restitution { element: element(), value: restitution });
    }
    if let (Some(lower), Some(upper)) = (lower, upper)
        && lower >= upper
    {
        return Err(BuildError::Limits { joint: joint.to_owned(), lower, upper });
    }
    Ok(())
}
