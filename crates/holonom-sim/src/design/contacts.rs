//! Compliant contacts by the numbers of their laws and shapes, elastic stops and smooth friction by
//! those of their laws.
//!
//! Shapes that touch change with their dimensions and places; a parameter that turns one, or that
//! enters a mesh or a plane, is refused.

use super::{LEAVE_OUT, ModelTangent, NumberChain, refused};
use crate::system::contact_origin::TouchingBodies;
use crate::system::joint_drive::{bumper, friction};
use holonom_model::{Beam, Contact, FrictionCourse, Limits, ModelError, ShapeKind};
use nalgebra::Vector3;
use std::sync::Arc;
use vi_core::Number;
use vi_core::num_dual::Dual64;
use vi_multibody::bumper::Bumper;
use vi_multibody::contact::compliant_change::CompliantChange;
use vi_multibody::contact::compliant_contact::{CompliantContact, CompliantLaw};
use vi_multibody::design::EffortTangent;
use vi_multibody::stribeck::Stribeck;
use vi_rigid::gap::ContactShape;

/// A course that does not change.
const STEADY: Stribeck =
    Stribeck { transition_velocity: 0.0, static_ratio: 0.0, stribeck_velocity: 0.0 };

impl NumberChain<'_> {
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

    /// Laws and shapes of compliant contacts.
    ///
    /// # Errors
    /// [`ModelError`] where a shape turns, or a plane or a mesh changes.
    pub(super) fn contacts(&self, found: &mut ModelTangent) -> Result<(), ModelError> {
        let out = &mut found.numbers;
        for (k, origin) in self.system.contacts.iter().enumerate() {
            let (Some(contact), Some(shapes)) = (origin.compliant(), origin.shapes()) else {
                continue;
            };
            let stated = self.stated.contacts.iter().find(|own| own.name == shapes.contact);
            let Some(stated) = stated else { continue };
            self.keeps_plane(stated)?;
            let by = self.contact_law(stated, contact.law());
            let moved = self.shapes(&shapes.bodies, contact)?;
            if by.is_none() && moved.is_none() {
                continue;
            }
            let change = CompliantChange { contact: contact.clone(), by, shapes: moved };
            found.contacts.push((k, change.clone()));
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

    /// A contact with the derivatives of its shapes; `None` where these do not change.
    fn shapes(
        &self,
        bodies: &TouchingBodies,
        contact: &CompliantContact,
    ) -> Result<Option<Arc<CompliantContact<Dual64>>>, ModelError> {
        let TouchingBodies::Pair { a, b, shapes: which, .. } = bodies else { return Ok(None) };
        let [on_a, on_b] = contact.pair().shapes();
        let own = [(&a[..], which[0], on_a), (&b[..], which[1], on_b)].map(|own| self.shape(own));
        let [on_a, on_b] = own;
        let (on_a, on_b) = (on_a?, on_b?);
        if on_a.is_none() && on_b.is_none() {
            return Ok(None);
        }
        let [of_a, of_b] = contact.pair().shapes().map(ContactShape::lifted);
        let moved = contact.with_tangent([on_a.unwrap_or(of_a), on_b.unwrap_or(of_b)]);
        Ok(moved.map(Arc::new))
    }

    /// A shape of a body with its derivative; `None` where it does not change.
    fn shape(
        &self,
        (name, which, own): (&str, usize, &ContactShape),
    ) -> Result<Option<ContactShape<Dual64>>, ModelError> {
        if let Some(beam) = name.split_once('.').and_then(|(beam, _)| self.stated.beam(beam)) {
            return Ok(self.node_shape(beam));
        }
        let body = self.stated.body(name).filter(|_| !matches!(own, ContactShape::Plane { .. }));
        let Some((body, frame)) = body.and_then(|own| Some((own, self.model.frame(name)?))) else {
            return Ok(None);
        };
        let axes = self.principal(frame).transpose();
        let is_own = !body.collision.is_empty();
        let mut seen = 0;
        for (i, shape) in body.contact_shapes().iter().enumerate() {
            let key = match is_own {
                true => format!("body.{name}.collision.{i}"),
                false => format!("body.{name}.shape"),
            };
            let touches = |part: &str| self.slopes.touches(&format!("{key}.{part}"));
            let changes = touches("dimensions") || touches("position");
            let is_mesh = shape.kind == ShapeKind::Mesh;
            self.refuse_where(is_mesh && self.slopes.touches(&key), &key)?;
            let at = |k: usize| {
                let own = shape.dimensions.get(k).copied().unwrap_or_default();
                self.slopes.number(&format!("{key}.dimensions.{k}"), own)
            };
            let position = shape.position.unwrap_or_default();
            let position = self.slopes.vector(&format!("{key}.position"), position);
            let found = shape.contact_shape_of(&axes, &at, position, Vec::new());
            let below = format!("{key}.");
            let left =
                |own: &String| is_own && own.starts_with(&below) && !own.ends_with(".density");
            if let Some(key) = self.slopes.left().into_iter().find(left) {
                self.refuse_where(true, &key)?;
            }
            if found.is_some() {
                if seen == which {
                    return Ok(found.filter(|_| changes));
                }
                seen += 1;
            }
        }
        Ok(None)
    }

    /// The sphere of a node with its derivative; `None` where it does not change.
    fn node_shape(&self, beam: &Beam) -> Option<ContactShape<Dual64>> {
        let of = if beam.radius.is_some() { "radius" } else { "section.shape.dimensions.0" };
        let key = format!("beam.{}.{of}", beam.name);
        let radius = beam.touching_radius().filter(|_| self.slopes.touches(&key))?;
        let center = Vector3::from_element(Dual64::of(0.0));
        Some(ContactShape::sphere(center, self.slopes.number(&key, radius)))
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
        let what = format!(
            "the derivative by `{name}`, which turns a shape that touches, or changes a mesh or a plane"
        );
        let help =
            format!("let it change `dimensions` and `position` of other shapes, or {LEAVE_OUT}");
        Err(refused(key, what, help))
    }
}
