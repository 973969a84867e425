//! Rigid stops and dry friction of joints, as parts of a mechanism.

use super::contact_origin::ContactOrigin;
use super::coordinate::coordinate;
use super::names::Names;
use holonom_model::{ContactMethod, Impact, Joint, ModelError, Settings};
use vi_constraints::nonsmooth::{ImpactLaw, Method, NonsmoothOptions};
use vi_multibody::builder::{DryFriction, JointLimits, MechanismBuilder};

/// Adds stops and dry friction of a joint.
pub(crate) fn add_joint_contacts(
    builder: &mut MechanismBuilder,
    joint: &Joint,
    names: &Names<'_>,
    origins: &mut Vec<ContactOrigin>,
) -> Result<(), ModelError> {
    let id = names.joints[joint.name.as_str()].1;
    let of = |part: &str, freedom: usize| {
        coordinate(joint, id, freedom, format!("joint.{}.{part}.freedom", joint.name))
    };
    if let Some(limits) = joint.stops() {
        let at = of("limits", limits.freedom)?;
        let (lower, upper, restitution) = (limits.lower, limits.upper, limits.restitution);
        builder.joint_limits(at, JointLimits { lower, upper, restitution });
        origins.push(ContactOrigin::Stop { joint: joint.name.clone() });
    }
    if let Some(friction) = joint.dry_friction() {
        let at = of("friction", friction.freedom)?;
        let law = match friction.coefficient {
            Some(coefficient) => {
                DryFriction::Coefficient { coefficient, radius: friction.radius.unwrap_or(1.0) }
            }
            None => DryFriction::Effort(friction.effort()),
        };
        builder.static_joint_friction(at, law, friction.static_ratio.unwrap_or(1.0));
        origins.push(ContactOrigin::Friction { joint: joint.name.clone() });
    }
    Ok(())
}

/// How impacts are placed in time, and what they are.
#[must_use]
pub fn nonsmooth_options(settings: &Settings) -> NonsmoothOptions {
    let method = match settings.contact {
        ContactMethod::Events => Method::Events,
        ContactMethod::Stepping => Method::Stepping,
    };
    let impact_law = match settings.impact {
        Impact::Newton => ImpactLaw::Newton,
        Impact::Moreau => ImpactLaw::Moreau,
        Impact::Sequential => ImpactLaw::Sequential,
    };
    let (max_events, uniqueness) = (settings.max_events, settings.contacts);
    NonsmoothOptions { method, max_events, impact_law, uniqueness, ..NonsmoothOptions::default() }
}
