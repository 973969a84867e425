//! Checks of compliant contacts and of smooth friction.

use crate::checks::Checker;
use crate::types::contact::{Contact, ContactModel};
use crate::types::friction::FrictionCourse;

impl Checker<'_> {
    /// `model` of a contact.
    pub(super) fn contact_model(&mut self, key: &str, contact: &Contact) {
        let Some(model) = &contact.model else { return };
        let ContactModel::HuntCrossley { stiffness, exponent, dissipation, .. } = *model;
        let ContactModel::HuntCrossley { static_ratio, stribeck_velocity, .. } = *model;
        let at = format!("{key}.model");
        let settings = &self.model.settings;
        if settings.scheme.is_energy_momentum() {
            let message =
                format!("the scheme {} has no compliant contacts", settings.scheme.name());
            self.report(&at, message, "write a variational scheme, such as \"nodal\"");
        }
        if stiffness.is_nan() || stiffness <= 0.0 {
            let message = format!("the stiffness {stiffness} is not positive");
            self.report(format!("{at}.stiffness"), message, "without `model` contacts are rigid");
        }
        if exponent < 1.0 {
            let message = format!("the exponent {exponent} is below 1");
            let help = "write 1 for a linear spring, 1.5 for spheres after Hertz";
            self.report(format!("{at}.exponent"), message, help);
        }
        if dissipation < 0.0 {
            let message = format!("{dissipation} is negative: it would feed energy in");
            self.report(format!("{at}.dissipation"), message, "write 0 or more");
        }
        let restitutions = [
            ("restitution", contact.restitution),
            ("tangential_restitution", contact.tangential_restitution),
        ];
        for (name, _) in restitutions.into_iter().filter(|(_, value)| *value > 0.0) {
            let message = "a compliant contact has no restitution: its dissipation takes energy";
            let help = format!("remove `{name}`, or `model`");
            self.report(format!("{key}.{name}"), message.to_owned(), help);
        }
        match model.course() {
            Some(course) if contact.friction > 0.0 => self.friction_course(&at, &course),
            None if contact.friction > 0.0 => {
                let message = "friction of a compliant contact has a velocity of transition";
                let help = "write `transition_velocity`, m/s: far below the velocities of sliding";
                self.report(at, message.to_owned(), help);
            }
            None if static_ratio.to_bits() == 1.0_f64.to_bits() && stribeck_velocity.is_none() => {}
            _ => {
                let message = "without friction nothing acts across the normal".to_owned();
                let help = "write `friction` of the contact, or remove what belongs to it";
                self.report(at, message, help);
            }
        }
    }

    /// Numbers of smooth friction.
    pub(super) fn friction_course(&mut self, at: &str, course: &FrictionCourse) {
        let FrictionCourse { transition_velocity, static_ratio, stribeck_velocity } = *course;
        let velocities = [
            ("transition_velocity", Some(transition_velocity)),
            ("stribeck_velocity", stribeck_velocity),
        ];
        for (name, velocity) in velocities {
            if let Some(velocity) = velocity.filter(|own| own.is_nan() || *own <= 0.0) {
                let message = format!("the velocity {velocity} is not positive");
                let help = "write a velocity far below those of sliding, m/s or rad/s";
                self.report(format!("{at}.{name}"), message, help);
            }
        }
        if static_ratio < 1.0 {
            let message = format!("static friction is {static_ratio} of that of sliding");
            self.report(format!("{at}.static_ratio"), message, "write 1 or more");
        }
        let (raised, stated) = (static_ratio > 1.0, stribeck_velocity.is_some());
        if raised && !stated {
            let message = "nothing says where static friction ends".to_owned();
            let help = "write `stribeck_velocity`, m/s or rad/s, or remove `static_ratio`";
            self.report(format!("{at}.static_ratio"), message, help);
        }
        if stated && !raised {
            let message = "static friction is that of sliding".to_owned();
            let help = "write `static_ratio` above 1, or remove `stribeck_velocity`";
            self.report(format!("{at}.stribeck_velocity"), message, help);
        }
    }
}
