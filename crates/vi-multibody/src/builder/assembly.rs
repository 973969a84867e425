//! From the parts of a builder to a description, a mechanism, and its force elements.

use super::error::{finite, positive};
use super::force::{
    ElementForce, JointElementKind, LoadPart, ParticleLoadPart, TensionPart, WrenchPart,
};
use super::joint::direction;
use super::{
    BuildError, BuiltMechanism, ConstraintKind, ConstraintPart, CoordinateId, ForceElements, Guide,
    MechanismBuilder, PointOn, PointPlace, RollingPart,
};
use crate::constraint::joint_coordinate::JointCoordinate;
use crate::constraint::rolling::{RolledPlane, Rolling};
use crate::constraint::scalar_constraint::ScalarConstraint;
use crate::force::joint_force::{JointForce, JointSpring};
use crate::force::particle_load::ParticleLoad;
use crate::force::spring::{Damper, Spring, SpringLaw};
use crate::force::tension::Tension;
use crate::force::wrench_law::{ActsOn, WrenchForce};
use crate::geometry::form::Form;
use crate::mechanism::Mechanism;
use crate::mechanism::description::{Attachment, Bar, BarEnd, Description, joint_at};
use crate::mechanism::initial_rates;
use crate::pair::PairKind;
use crate::pair::joint::{FrameId, Joint, complete_axis};
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;

/// The length of a bar, by default the initial distance of its ends; `sizes`: how far they are from
/// the origin.
fn length_of(
    element: impl Fn() -> String,
    stated: Option<f64>,
    distance: f64,
    sizes: f64,
) -> Result<f64, BuildError> {
    if stated.is_none() && distance <= 8.0 * f64::EPSILON * sizes {
        return Err(BuildError::ZeroLength { element: element() });
    }
    let length = stated.unwrap_or(distance);
    positive(element, "length", length)?;
    Ok(length)
}

fn known(
    element: impl Fn() -> String,
    kind: &'static str,
    index: usize,
    count: usize,
) -> Result<(), BuildError> {
    if index < count {
        return Ok(());
    }
    Err(BuildError::UnknownId { element: element(), kind, index, count })
}

impl MechanismBuilder {
    /// The mechanism, and what acts on it.
    ///
    /// # Errors
    /// [`BuildError`] for the first part that makes no sense.
    pub fn build(&self) -> Result<BuiltMechanism, BuildError> {
        let mut mechanism = Mechanism::new(self.description()?);
        let forces = self.forces(&mut mechanism)?;
        Ok(BuiltMechanism { mechanism, forces })
    }

    /// The description of the mechanism: everything but the force elements.
    ///
    /// # Errors
    /// [`BuildError`] for the first part that makes no sense.
    pub fn description(&self) -> Result<Description, BuildError> {
        finite(|| "the mechanism".to_owned(), "gravity", self.gravity.as_slice())?;
        let mut description = Description {
            dimension: self.dimension,
            gravity: self.gravity,
            particles: self.particles.clone(),
            ..Description::default()
        };
        for body in &self.bodies {
            description.bodies.push(body.resolve()?.0);
        }
        for particle in &self.particles {
            let element = || format!("particle `{}`", particle.name);
            finite(element, "position", particle.position.as_slice())?;
            finite(element, "velocity", particle.velocity.as_slice())?;
            positive(element, "mass", particle.mass)?;
        }
        for joint in &self.joints {
            self.check_frames(|| format!("joint `{}`", joint.name), joint.frames())?;
            if let Some(rates) = &joint.rates {
                finite(|| format!("joint `{}`", joint.name), "rate", rates)?;
            }
            description.joints.push(joint.resolve(&description.bodies)?);
        }
        description.cuts = (0..self.joints.len()).filter(|&k| self.joints[k].cut).collect();
        for k in 0..self.bars.len() {
            description.bars.push(self.bar_at(k)?);
        }
        let q = description.configuration();
        for constraint in &self.constraints {
            let made = self.scalar(constraint, &description, &q)?;
            description.scalars.push(made);
        }
        let rates: Vec<_> = self.joints.iter().map(|joint| joint.rates.as_deref()).collect();
        initial_rates::apply(&mut description, &rates, &self.beams).map_err(|refused| {
            BuildError::Rate {
                joint: self.joints[refused.joint].name.clone(),
                source: refused.error,
            }
        })?;
        Ok(description)
    }

    /// The force elements, for a mechanism of this description; the joint coordinates that they
    /// need are listed in it.
    ///
    /// # Errors
    /// [`BuildError`] for the first part that makes no sense.
    pub fn forces(&self, mechanism: &mut Mechanism) -> Result<ForceElements, BuildError> {
        let mut forces = ForceElements::default();
        let q = mechanism.initial_configuration();
        for (k, element) in self.point_elements.iter().enumerate() {
            let (law, damping) = (element.law, element.damping);
            let name = || {
                let kind = if element.stiffness.is_some() { "spring" } else { "damper" };
                format!("{kind} {k} between points")
            };
            let stiffness = element.stiffness.unwrap_or_default();
            let natural_length = element.natural_length;
            finite(name, "parameters", &[stiffness, natural_length, damping])?;
            let [from, to] = self.ends(name, &element.from, &element.to)?;
            let between = to.minus(&from);
            let rest = element.stiffness.is_some() && natural_length != 0.0;
            let directed = damping != 0.0 || rest && law == SpringLaw::Linear;
            let (a, b) = (from.at(&q), to.at(&q));
            if directed && (b - a).norm() <= 8.0 * f64::EPSILON * a.amax().max(b.amax()) {
                return Err(BuildError::NoDirection { element: name() });
            }
            let damper = Damper { between: between.clone(), damping };
            if element.stiffness.is_some() {
                forces.springs.push(Spring { between, stiffness, natural_length, law });
            }
            if damping != 0.0 {
                forces.add(&element.name, ElementForce::Coordinates(Arc::new(damper)));
            }
        }
        for element in &self.joint_elements {
            let coordinate = self.listed(element.coordinate, mechanism)?;
            match &element.kind {
                JointElementKind::Spring { stiffness, rest } => {
                    let (stiffness, rest) = (*stiffness, *rest);
                    let at = element.coordinate.joint.index();
                    let name = || format!("spring on joint `{}`", self.joints[at].name);
                    finite(name, "parameters", &[stiffness, rest])?;
                    forces.joint_springs.push(JointSpring { coordinate, stiffness, rest });
                }
                JointElementKind::Force(law) => {
                    let force = JointForce { coordinate, law: law.clone() };
                    forces.add(&element.name, ElementForce::Joint(force));
                }
            }
        }
        for (k, load) in self.loads.iter().enumerate() {
            let (name, load) = match load {
                LoadPart::Given(name, load) => {
                    let (body, count) = (load.offset() / 12, self.bodies.len());
                    known(|| format!("load {k}"), "body", body, count)?;
                    (name, load.clone())
                }
                LoadPart::Described(load) => {
                    let body = load.body.index();
                    known(|| format!("load {k}"), "body", body, self.bodies.len())?;
                    let axes = self.bodies[body].resolve()?.1;
                    let along = |components: &Vector3<f64>| axes.transpose() * components;
                    let place = load.place;
                    let point = self.components(&PointOn { member: load.body.into(), place })?;
                    (&load.name, load.resolve(self.bodies[body].name(), point, along)?)
                }
            };
            forces.add(name, ElementForce::Body(load));
        }
        for (k, load) in self.particle_loads.iter().enumerate() {
            let element = || format!("load {k} on point masses");
            let ParticleLoadPart { name, particle, force, history } = load.clone();
            known(element, "particle", particle.index(), self.particles.len())?;
            finite(element, "force", force.as_slice())?;
            history.validate().map_err(|source| {
                let body = self.particles[particle.index()].name.clone();
                BuildError::Load { body, source: source.into() }
            })?;
            let offset = mechanism.particle_offset(particle.index());
            let dimension = mechanism.description().dimension;
            let load = ParticleLoad { offset, dimension, force, history };
            forces.add(&name, ElementForce::Coordinates(Arc::new(load)));
        }
        for (k, TensionPart { name, from, to, law }) in self.tensions.iter().enumerate() {
            let element = || match name.as_str() {
                "" => format!("tension {k} between points"),
                name => format!("`{name}`"),
            };
            let [from, to] = self.ends(element, from, to)?;
            let (a, b) = (from.at(&q), to.at(&q));
            if (b - a).norm() <= 8.0 * f64::EPSILON * a.amax().max(b.amax()) {
                return Err(BuildError::NoDirection { element: element() });
            }
            let tension = Tension { between: to.minus(&from), law: law.clone() };
            forces.add(name, ElementForce::Tension(tension));
        }
        for WrenchPart { name, at, follows, law } in &self.wrenches {
            let element = || format!("`{name}`");
            let on = match at.member {
                Attachment::Body(k) => {
                    known(element, "body", k, self.bodies.len())?;
                    let axes = self.bodies[k].resolve()?.1.transpose();
                    let point = self.components(at)?;
                    finite(element, "point", point.as_slice())?;
                    ActsOn::Frame { offset: 12 * k, point, axes: follows.then_some(axes) }
                }
                Attachment::Particle(k) => {
                    known(element, "particle", k, self.particles.len())?;
                    let dimension = mechanism.description().dimension;
                    ActsOn::Particle { offset: mechanism.particle_offset(k), dimension }
                }
                Attachment::Ground => continue, // nothing moves
            };
            forces.add(name, ElementForce::Wrench(WrenchForce { on, law: law.clone() }));
        }
        self.add_bushings(mechanism, &mut forces)?;
        for own in &self.own_forces {
            forces.add(&own.name, ElementForce::Coordinates(own.force.clone()));
        }
        for (name, contact) in &self.compliant {
            forces.compliant.push(contact.clone());
            if contact.is_dissipative() {
                forces.add(name, ElementForce::Coordinates(Arc::new(contact.clone())));
            }
        }
        self.add_contacts(mechanism, &mut forces)?;
        self.add_laws(mechanism, &mut forces)?;
        Ok(forces)
    }

    /// The principal axes (columns) of a body in the components that it was described in: where
    /// inertia was given as a tensor, they differ from its own axes.
    ///
    /// # Errors
    /// [`BuildError`] when the body makes no sense.
    pub fn principal_axes(&self, body: super::BodyId) -> Result<Matrix3<f64>, BuildError> {
        known(|| "the question".to_owned(), "body", body.index(), self.bodies.len())?;
        Ok(self.bodies[body.index()].resolve()?.1)
    }

    pub(super) fn check_frames(
        &self,
        element: impl Fn() -> String,
        frames: [FrameId; 2],
    ) -> Result<(), BuildError> {
        for frame in frames {
            if let FrameId::Frame(k) = frame {
                known(&element, "body", k, self.bodies.len())?;
            }
        }
        if frames[0] == frames[1] {
            return Err(BuildError::SameMember { element: element() });
        }
        Ok(())
    }

    fn bar_at(&self, k: usize) -> Result<Bar, BuildError> {
        let bar = &self.bars[k];
        let element = || format!("bar `{}`", bar.name);
        let count = self.particles.len();
        known(element, "particle", bar.to.index(), count)?;
        let from = match bar.from {
            BarEnd::Ground(point) => point,
            BarEnd::Particle(from) => {
                known(element, "particle", from, count)?;
                self.particles[from].position
            }
        };
        finite(element, "end on the ground", from.as_slice())?;
        let between = self.particles[bar.to.index()].position - from;
        let sizes = from.norm() + self.particles[bar.to.index()].position.norm();
        let length = length_of(element, bar.length, between.norm(), sizes)?;
        Ok(Bar { name: bar.name.clone(), from: bar.from, to: bar.to.index(), length })
    }

    fn scalar(
        &self,
        constraint: &ConstraintPart,
        description: &Description,
        q: &[f64],
    ) -> Result<ScalarConstraint, BuildError> {
        let name = &constraint.name;
        let element = || format!("constraint `{name}`");
        let guide = |guide: &Guide| -> Result<Joint, BuildError> {
            let frames = [guide.parent, guide.child];
            self.check_frames(element, frames)?;
            finite(element, "point", guide.point.as_slice())?;
            let axes = complete_axis(&direction(element, "direction", &guide.axis)?);
            let points = [guide.point; 2];
            Ok(joint_at(name, PairKind::Free, frames, points, &axes, &description.bodies))
        };
        let coordinate = |id: &CoordinateId| {
            known(element, "joint", id.joint.index(), self.joints.len())?;
            let joint = id.joint.index();
            let found = principal(&description.joints[joint], id.freedom, element)?;
            Ok(found.placed(joint, id.freedom))
        };
        Ok(match &constraint.kind {
            ConstraintKind::Distance { from, to, length } => {
                let is_particle = |end: &PointOn| matches!(end.member, Attachment::Particle(_));
                if is_particle(from) || is_particle(to) {
                    return Err(BuildError::DistanceOfParticle { element: element() });
                }
                let ends = self.ends(element, from, to)?;
                let between = ends[1].minus(&ends[0]);
                let sizes = ends.iter().map(|end| end.at(q).norm()).sum();
                let length = length_of(element, *length, between.at(q).norm(), sizes)?;
                ScalarConstraint::distance(name, &between, length)
            }
            ConstraintKind::PointOnLine(line) => ScalarConstraint::point_on_line(&guide(line)?),
            ConstraintKind::PointOnPlane(plane) => ScalarConstraint::point_on_plane(&guide(plane)?),
            ConstraintKind::Gear { a, b, ratio } => {
                finite(element, "ratio", &[*ratio])?;
                ScalarConstraint::gear(name, coordinate(a)?, coordinate(b)?, *ratio, q)
            }
            ConstraintKind::Held { coordinate: id, target } => {
                finite(element, "target", &[*target])?;
                ScalarConstraint::held(name, coordinate(id)?, *target)
            }
            ConstraintKind::Motion { coordinate: id, reference } => {
                finite(element, "reference at t = 0", &reference(0.0))?;
                ScalarConstraint::motion(name, coordinate(id)?, reference.clone())
            }
            ConstraintKind::Rolling(part) => {
                ScalarConstraint::rolling(name, self.rolls(element, part)?)
            }
            ConstraintKind::Blade { body, point, axis } => {
                self.check_frames(element, [FrameId::Ground, (*body).into()])?;
                finite(element, "point", point.as_slice())?;
                let axis = direction(element, "axis", axis)?;
                let (body, offset) = (&description.bodies[body.index()], 12 * body.index());
                let along = Form::vector(offset, &body.triad.tr_mul(&axis));
                let arm = body.triad.tr_mul(&(point - body.center));
                ScalarConstraint::blade(name, along, Form::point(offset, &arm))
            }
            ConstraintKind::Rates(part) => {
                let law = self.law_of_rates(name, part, coordinate)?;
                ScalarConstraint::velocity(name, law)
            }
        })
    }

    /// A wheel or a sphere with its plane.
    fn rolls(
        &self,
        element: impl Fn() -> String + Copy,
        part: &RollingPart,
    ) -> Result<Rolling, BuildError> {
        self.check_frames(element, [FrameId::Ground, part.body.into()])?;
        finite(element, "numbers", &[part.tube, part.spin])?;
        finite(element, "point of the plane", part.origin.as_slice())?;
        positive(element, "radius", part.radius)?;
        let axes = complete_axis(&direction(element, "normal", &part.normal)?);
        let axis = part.axis.map(|axis| direction(element, "axis", &axis)).transpose()?;
        let body = &self.bodies[part.body.index()].resolve()?.0;
        let plane = RolledPlane { origin: part.origin, axes, spin: part.spin };
        let circle = if axis.is_some() { part.radius - part.tube } else { 0.0 };
        let section = part.radius - circle;
        let axis = axis.map(|axis| body.triad.tr_mul(&axis));
        Ok(Rolling { frame: part.body.index(), axis, circle, section, plane })
    }

    /// Two points as forms.
    pub(super) fn ends(
        &self,
        element: impl Fn() -> String,
        from: &PointOn,
        to: &PointOn,
    ) -> Result<[Form; 2], BuildError> {
        let end = |point: &PointOn| -> Result<Form, BuildError> {
            match point.member {
                Attachment::Ground => {}
                Attachment::Body(k) => known(&element, "body", k, self.bodies.len())?,
                Attachment::Particle(k) => known(&element, "particle", k, self.particles.len())?,
            }
            let components = self.components(point)?;
            finite(&element, "point", components.as_slice())?;
            Ok(match point.member {
                Attachment::Ground => Form::constant(components),
                Attachment::Body(k) => Form::point(12 * k, &components),
                Attachment::Particle(k) => {
                    Form::particle(12 * self.bodies.len() + self.dimension * k, self.dimension)
                }
            })
        };
        Ok([end(from)?, end(to)?])
    }

    /// The components of a point along the directors of its member, from its centre.
    pub(super) fn components(&self, point: &PointOn) -> Result<Vector3<f64>, BuildError> {
        let Attachment::Body(k) = point.member else {
            return Ok(match point.place {
                PointPlace::Components(x) | PointPlace::Space(x) => x,
            });
        };
        let (body, axes) = self.bodies[k].resolve()?;
        Ok(match point.place {
            PointPlace::Components(components) => axes.transpose() * components,
            PointPlace::Space(position) => body.triad.transpose() * (position - body.center),
        })
    }

    /// A joint coordinate whose revolutions the mechanism counts.
    pub(super) fn listed(
        &self,
        id: CoordinateId,
        mechanism: &mut Mechanism,
    ) -> Result<JointCoordinate, BuildError> {
        let joint = id.joint.index();
        known(|| "force on a joint".to_owned(), "joint", joint, self.joints.len())?;
        let element = || format!("force on joint `{}`", self.joints[joint].name);
        principal(&mechanism.description().joints[joint], id.freedom, element)?;
        Ok(mechanism.coordinate(joint, id.freedom).expect("its principal value exists"))
    }

    /// The same for contacts.
    pub(super) fn followed(
        &self,
        id: CoordinateId,
        mechanism: &mut Mechanism,
    ) -> Result<JointCoordinate, BuildError> {
        let joint = id.joint.index();
        known(|| "contact of a joint".to_owned(), "joint", joint, self.joints.len())?;
        let element = || format!("contact of joint `{}`", self.joints[joint].name);
        principal(&mechanism.description().joints[joint], id.freedom, element)?;
        let found = mechanism.followed_coordinate(joint, id.freedom);
        Ok(found.expect("its principal value exists"))
    }
}

/// A joint coordinate by its principal value.
fn principal(
    joint: &Joint,
    freedom: usize,
    element: impl Fn() -> String,
) -> Result<JointCoordinate, BuildError> {
    JointCoordinate::principal(joint, freedom).ok_or_else(|| {
        let (pair, count) = (joint.kind.name(), joint.kind.coordinate_count());
        BuildError::NoCoordinate { element: element(), pair, freedom, count }
    })
}
