//! Compliant contacts, elastic stops and smooth friction by the numbers of their laws.
//!
//! Shapes that touch do not change: a parameter that enters one is refused.

use super::{Chain, LEAVE_OUT, ModelTangent, refused};
use crate::system::joint_drive::{bumper, friction};
use holonom_model::{Contact, FrictionCourse, Limits, ModelError};
use std::sync::Arc;
use vi_core::num_dual::Dual64;
use vi_multibody::bumper::Bumper;
use vi_multibody::contact::compliant_change::CompliantChange;
use vi_multibody::contact::compliant_contact::CompliantLaw;
use vi_multibody::design::EffortTangent;
use vi_multibody::stribeck::Stribeck;

/// A course that does not change.
const STEADY: Stribeck =
    Stribeck { transition_velocity: 0.0, static_ratio: 0.0, stribeck_velocity: 0.0 };

impl Chain<'_> {
    fn slope(&self, key: &str, value: f64) -> f64 {
        self.slopes.number(key, value).eps
    }

    /// The derivatives of the course of friction below a key, as it is stated.
    fn course(&self, key: &str, stated: &FrictionCourse, of: &Stribeck) -> Stribeck {
        let number = |part: &str, value| self.slope(&format!("{key}.{part}"), value);
        let transition_velocity = number("transition_velocity", of.transition_velocity);
        let stribeck_velocity = match stated.stribeck_velocity {
            Some(own) => number("stribeck_velocity", own),
            None => transition_velocity,
        };
        let static_ratio = number("static_ratio", of.static_ratio);
        Stribeck { transition_velocity, static_ratio, stribeck_velocity }
    }

    /// Smooth friction and elastic stops of joint `k`: part, freedom, derivative of the effort.
    pub(super) fn resistances(&self, k: usize) -> Vec<(&'static str, usize, EffortTangent)> {
        let (joint, mut found) = (&self.stated.joints[k], Vec::new());
        let key = format!("joint.{}", joint.name);
        if let (Some((freedom, law)), Some(own)) = (friction(joint), joint.friction) {
            let part = if own.torque.is_some() { "torque" } else { "force" };
            let effort = self.slope(&format!("{key}.friction.{part}"), law.effort);
            let course = own.model.map_or(STEADY, |model| {
                self.course(&format!("{key}.friction.model"), &model.course(), &law.course)
            });
            if effort != 0.0 || course != STEADY {
                let by: EffortTangent = Arc::new(move |_, _, rate| {
                    let turned = law.course.change(&course, rate);
                    -effort * law.course.value(rate) - law.effort * turned
                });
                found.push(("friction", freedom, by));
            }
        }
        if let Some((freedom, law)) = bumper(joint) {
            let [lower, upper] = match joint.limits {
                Some(Limits::Both(_)) => ["limits.0", "limits.1"],
                _ => ["limits.lower", "limits.upper"],
            };
            let number = |part: &str, value| self.slopes.number(&format!("{key}.{part}"), value);
            let dual: Bumper<Dual64> = Bumper {
                lower: law.lower.map(|own| number(lower, own)),
                upper: law.upper.map(|own| number(upper, own)),
                stiffness: number("bumper.stiffness", law.stiffness),
                damping: number("bumper.damping", law.damping),
            };
            let limits = dual.lower.into_iter().chain(dual.upper);
            if limits.chain([dual.stiffness, dual.damping]).any(|own| own.eps != 0.0) {
                let by: EffortTangent = Arc::new(move |_, x, rate| dual.effort_at(x, rate).eps);
                found.push(("bumper", freedom, by));
            }
        }
        found
    }

    /// Laws of compliant contacts.
    ///
    /// # Errors
    /// [`ModelError`] where a shape or a plane changes.
    pub(super) fn contacts(&self, found: &mut ModelTangent) -> Result<(), ModelError> {
        let out = &mut found.numbers;
        for (k, origin) in self.system.contacts.iter().enumerate() {
            let (Some(contact), Some(shapes)) = (origin.compliant(), origin.shapes()) else {
                continue;
            };
            let stated = self.stated.contacts.iter().find(|own| own.name == shapes.contact);
            let Some(stated) = stated else { continue };
            let sides = shapes.sides(0);
            [sides.a, sides.b].into_iter().try_for_each(|name| self.keeps_shape(name))?;
            self.keeps_plane(stated)?;
            let Some(by) = self.contact_law(stated, contact.law()) else { continue };
            found.contacts.push((k, by));
            let change = CompliantChange { contact: (**contact).clone(), by };
            let quadrature = self.system.dynamics.quadrature;
            out.potentials.push(Arc::from(quadrature.discretize(change.clone())));
            out.forces.push((stated.name.clone(), Arc::new(change)));
        }
        Ok(())
    }

    /// The derivatives of a law; `None` where it does not change.
    fn contact_law(&self, stated: &Contact, law: &CompliantLaw) -> Option<CompliantLaw> {
        let model = stated.model?;
        let key = format!("contact.{}", stated.name);
        let of_model = format!("{key}.model");
        let number = |part: &str, value| self.slope(&format!("{of_model}.{part}"), value);
        let friction = law.friction.map(|(mu, course)| {
            let by = model.course().map(|stated| self.course(&of_model, &stated, &course));
            (self.slope(&format!("{key}.friction"), mu), by.unwrap_or(STEADY))
        });
        let by = CompliantLaw {
            stiffness: number("stiffness", law.stiffness),
            exponent: number("exponent", law.exponent),
            dissipation: number("dissipation", law.dissipation),
            friction,
        };
        let steady = CompliantLaw {
            stiffness: 0.0,
            exponent: 0.0,
            dissipation: 0.0,
            friction: by.friction.map(|_| (0.0, STEADY)),
        };
        (by != steady).then_some(by)
    }

    /// Refuses a body whose shape changes.
    fn keeps_shape(&self, name: &str) -> Result<(), ModelError> {
        let Some(body) = self.stated.body(name) else { return Ok(()) };
        let part = if body.collision.is_empty() { "shape" } else { "collision" };
        let key = format!("body.{name}.{part}");
        self.refuse_where(self.slopes.touches(&key), &key)
    }

    /// Refuses a plane that is placed by a frame that moves.
    fn keeps_plane(&self, stated: &Contact) -> Result<(), ModelError> {
        let moves = stated.relative_to.as_deref().is_some_and(|frame| self.moves(frame));
        self.refuse_where(moves, &format!("contact.{}.relative_to", stated.name))
    }

    fn refuse_where(&self, changes: bool, key: &str) -> Result<(), ModelError> {
        if !changes {
            return Ok(());
        }
        let name = self.formulas.name();
        let what = format!("the derivative by `{name}`, which changes a shape that touches");
        let help = format!("state its `collision` by numbers of its own, or {LEAVE_OUT}");
        Err(refused(key, what, help))
    }
}
