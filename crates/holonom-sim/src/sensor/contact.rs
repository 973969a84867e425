//! Gaps and forces of contacts, stops and dry friction.
//!
//! ```text
//! gap             min g(q_n)                         over all pairs of shapes of a contact
//! force           Σ Λ_n / ½(h_{n−1} + h_n)           on the bodies of `b`, or on a body
//! slip            max |σ|                            over its points that touch
//! stop, friction  ± Λ_n / ½(h_{n−1} + h_n)           along the joint coordinate
//! ```

use crate::run::contacts::ContactSample;
use crate::system::contact_origin::{ContactOrigin, ShapeElement, TouchingShapes};
use nalgebra::Vector3;
use vi_core::Configuration;
use vi_multibody::contact::joint_stop::LOWER;

/// What is read of contacts.
#[derive(Clone, Debug)]
pub(super) enum ContactGauge {
    /// The smallest gap.
    Gap(Vec<ShapeElement>),
    /// The sum of forces in space: elements, with the sign of each.
    Force(Vec<(u32, Signs)>),
    /// The largest slip of these elements.
    Slip(Vec<u32>),
    /// The effort of the stops of a joint along its coordinate.
    Stop(u32),
    /// The effort of dry friction along a joint coordinate.
    Friction(u32),
}

/// How forces are added up.
#[derive(Clone, Debug)]
pub(crate) enum Signs {
    /// On the second sides of a contact.
    Whole,
    /// On a body, of these shapes.
    Of(String, Box<TouchingShapes>),
}

impl Signs {
    /// That of a feature.
    pub(crate) fn of(&self, feature: u32) -> f64 {
        let Self::Of(body, shapes) = self else { return 1.0 };
        let sides = shapes.sides(feature);
        match () {
            () if sides.b == body => 1.0,
            () if sides.a == body => -1.0,
            () => 0.0,
        }
    }
}

/// The elements whose forces a contact has on the bodies of its `b`, or all contacts on a body,
/// each with its sign.
pub(crate) fn signed(origins: &[ContactOrigin], of: &str) -> Vec<(u32, Signs)> {
    let sign = |origin: &ContactOrigin| {
        let shapes = origin.shapes()?;
        match () {
            () if shapes.contact == of => Some(Signs::Whole),
            () if shapes.has(of) => Some(Signs::Of(of.to_owned(), Box::new(shapes.clone()))),
            () => None,
        }
    };
    (0..).zip(origins).filter_map(|(k, own)| Some((k, sign(own)?))).collect()
}

impl ContactGauge {
    /// The smallest gap of a contact.
    pub(super) fn gap(origins: &[ContactOrigin], contact: &str) -> Self {
        let shapes = origins.iter().filter_map(ContactOrigin::shapes);
        let own = shapes.filter(|own| own.contact == contact);
        Self::Gap(own.map(|own| own.element.clone()).collect())
    }

    /// The force of a contact on the bodies of its `b`, or of all contacts on a body.
    pub(super) fn force(origins: &[ContactOrigin], of: &str) -> Self {
        Self::Force(signed(origins, of))
    }

    /// The slip of a contact.
    pub(super) fn slip(origins: &[ContactOrigin], contact: &str) -> Self {
        let own = |origin: &ContactOrigin| origin.shapes().is_some_and(|s| s.contact == contact);
        Self::Slip((0..).zip(origins).filter(|(_, o)| own(o)).map(|(k, _)| k).collect())
    }

    /// The stops of a joint, or its dry friction.
    pub(super) fn joint(origins: &[ContactOrigin], joint: &str, stop: bool) -> Option<Self> {
        let of = |origin: &ContactOrigin| match origin {
            ContactOrigin::Stop { joint: own } => stop && own == joint,
            ContactOrigin::Friction { joint: own } => !stop && own == joint,
            ContactOrigin::Shapes(_) => false,
        };
        let element = origins.iter().position(of)? as u32;
        Some(if stop { Self::Stop(element) } else { Self::Friction(element) })
    }

    /// Whether the step from a node is needed.
    pub(super) fn needs_step(&self) -> bool {
        !matches!(self, Self::Gap(_))
    }

    /// Adds its numbers; not numbers where no step from the node is known.
    pub(super) fn read(
        &self,
        at: Configuration<'_>,
        contacts: Option<&[ContactSample]>,
        out: &mut Vec<f64>,
    ) {
        if let Self::Gap(pairs) = self {
            let gaps = pairs.iter().filter_map(|own| own.gap(at));
            return out.push(gaps.min_by(f64::total_cmp).unwrap_or(f64::NAN));
        }
        let numbers = if matches!(self, Self::Force(_)) { 3 } else { 1 };
        let Some(contacts) = contacts else {
            return out.extend((0..numbers).map(|_| f64::NAN));
        };
        match self {
            Self::Gap(_) => {}
            Self::Force(elements) => {
                let mut sum = Vector3::zeros();
                for contact in contacts {
                    let own = elements.binary_search_by_key(&contact.element, |own| own.0);
                    if let Ok(own) = own {
                        let sign = elements[own].1.of(contact.feature);
                        sum += sign * Vector3::from(contact.in_space());
                    }
                }
                out.extend(&sum);
            }
            Self::Slip(elements) => {
                let own = |own: &&ContactSample| elements.binary_search(&own.element).is_ok();
                let slips = contacts.iter().filter(own).map(|own| own.slip);
                out.push(slips.fold(0.0, f64::max));
            }
            Self::Stop(element) => {
                let own = contacts.iter().filter(|own| own.element == *element);
                let sign = |own: &ContactSample| if own.feature == LOWER { 1.0 } else { -1.0 };
                out.push(own.map(|own| sign(own) * own.force[0]).sum::<f64>() + 0.0);
            }
            Self::Friction(element) => {
                let own = contacts.iter().filter(|own| own.element == *element);
                out.push(own.map(|own| own.force[0]).sum::<f64>() + 0.0);
            }
        }
    }
}
