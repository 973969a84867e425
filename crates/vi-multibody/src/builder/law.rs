//! Laws of anything that moves, and the states of signals, as parts of a builder.

use super::error::finite;
use super::force::{ElementForce, ForceElements, ForceEntry};
use super::{BodyId, BuildError, CoordinateId, MechanismBuilder, PointOn, added};
use crate::constraint::joint_coordinate::JointCoordinate;
use crate::force::law::input::Past;
use crate::force::law::{
    Input, Law, LawForce, ReadingLaw, RelativeWrench, Sampler, SignalStates, Target,
};
use crate::force::wrench_law::ActsOn;
use crate::geometry::form::{BilinearRow, Form};
use crate::mechanism::Mechanism;
use crate::mechanism::description::Attachment;
use std::sync::Arc;

/// A quantity that a law reads: [`Input`] of the parts of a builder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Read {
    /// `t`, s.
    Time,
    /// A joint coordinate, m or rad.
    Coordinate(CoordinateId),
    /// Its rate.
    Rate(CoordinateId),
    /// A component (0 to 2) of a point in space, m.
    Position(PointOn, usize),
    /// A component of its velocity, m/s.
    Velocity(PointOn, usize),
    /// The distance of two points, m.
    Distance([PointOn; 2]),
    /// Its rate, m/s.
    DistanceRate([PointOn; 2]),
    /// A component in space of the angular velocity of a body, rad/s.
    AngularVelocity(BodyId, usize),
    /// A component (0 to 2) along the axes of a body of the way from its centre to a point, m.
    Along(BodyId, PointOn, usize),
    /// Its rate, m/s.
    AlongRate(BodyId, PointOn, usize),
    /// A component along the axes of the first body of the angular velocity of the second less
    /// that of the first, rad/s.
    RelativeSpin([BodyId; 2], usize),
    /// A value that is held over a step, among the internal variables of signals.
    Held(usize),
    /// A value of the past.
    Past(Past),
    /// Of the bushing that reads it: a coordinate (0 to 5), or the rate of one (6 to 11).
    Six {
        /// Tells what is read by one bushing from what is read by another.
        bushing: usize,
        /// Which.
        part: usize,
    },
}

/// What a law acts on: [`Target`] of the parts of a builder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ActOn {
    /// Along a joint coordinate, N or N·m.
    Coordinate(CoordinateId),
    /// Between two points, N: positive where it pulls them together.
    Points([PointOn; 2]),
    /// On a body at a point, or on a point mass: force (N) and torque (N·m), in space or along the
    /// axes of the body where it `follows`.
    Member {
        /// The point.
        at: PointOn,
        /// Whether components are along the axes of the body.
        follows: bool,
    },
    /// The same along the axes of another body, the base, or those of the body where it `follows`;
    /// the base takes the opposite.
    Relative {
        /// The point.
        at: PointOn,
        /// The other body.
        base: BodyId,
        /// Whether components are along the axes of the body.
        follows: bool,
    },
}

#[derive(Clone)]
pub(super) struct LawPart {
    pub(super) name: String,
    on: ActOn,
    reads: Vec<Read>,
    states: Vec<usize>,
    law: Arc<dyn Law>,
}

#[derive(Clone)]
pub(super) struct SignalsPart {
    reads: Vec<Read>,
    states: Vec<usize>,
    law: Arc<dyn Law>,
    sampler: Arc<dyn Sampler>,
}

impl MechanismBuilder {
    /// Adds a force by a law of these inputs, in the order of `reads`, and of states of signals.
    pub fn law(
        &mut self,
        on: ActOn,
        reads: Vec<Read>,
        states: Vec<usize>,
        law: Arc<dyn Law>,
    ) -> ForceEntry<'_> {
        let part = LawPart { name: String::new(), on, reads, states, law };
        ForceEntry { name: &mut added(&mut self.laws, part).name }
    }

    /// Adds the states of signals, whose rates are those of `law`, and what is held over steps.
    pub fn signals(
        &mut self,
        reads: Vec<Read>,
        states: Vec<usize>,
        law: Arc<dyn Law>,
        sampler: Arc<dyn Sampler>,
    ) {
        self.signals = Some(SignalsPart { reads, states, law, sampler });
    }

    /// Adds laws and signals to the forces of a mechanism.
    pub(super) fn add_laws(
        &self,
        mechanism: &mut Mechanism,
        forces: &mut ForceElements,
    ) -> Result<(), BuildError> {
        let start = self.start_of_signals();
        for LawPart { name, on, reads, states, law } in &self.laws {
            let target = self.target(name, *on, mechanism)?;
            let inputs = self.inputs(name, reads, mechanism)?;
            let mut reading = ReadingLaw::new(law.clone(), inputs, states.clone());
            reading.start = start.clone();
            forces.add(name, ElementForce::Law(LawForce { target, reading }));
        }
        if let Some(SignalsPart { reads, states, law, sampler }) = &self.signals {
            let inputs = self.inputs("signals", reads, mechanism)?;
            let mut reading = ReadingLaw::new(law.clone(), inputs, states.clone());
            reading.start = start;
            forces.signals = Some(SignalStates::new(reading, sampler.clone()));
        }
        Ok(())
    }

    /// The internal variables of signals at the start.
    pub(super) fn start_of_signals(&self) -> Arc<[f64]> {
        self.signals.as_ref().map(|own| own.sampler.start()).unwrap_or_default()
    }

    fn target(
        &self,
        name: &str,
        on: ActOn,
        mechanism: &mut Mechanism,
    ) -> Result<Target, BuildError> {
        Ok(match on {
            ActOn::Coordinate(id) => Target::Coordinate(self.listed(id, mechanism)?),
            ActOn::Points(ends) => Target::Points(self.between(name, ends, mechanism)?),
            ActOn::Member { at, follows } => {
                Target::Member(self.acts_on(name, at, follows, mechanism)?)
            }
            ActOn::Relative { at, base, follows } => {
                let on = self.acts_on(name, at, follows, mechanism)?;
                let base = self.acts_on(name, base.point([0.0; 3]), !follows, mechanism)?;
                Target::Relative(Box::new(RelativeWrench { on, base }))
            }
        })
    }

    /// A member at a point, whose axes carry what acts on it where that `follows`.
    fn acts_on(
        &self,
        name: &str,
        at: PointOn,
        follows: bool,
        mechanism: &Mechanism,
    ) -> Result<ActsOn, BuildError> {
        Ok(match at.member {
            Attachment::Body(k) => {
                let axes = self.bodies[k].resolve()?.1.transpose();
                let point = self.components(&at)?;
                finite(|| format!("`{name}`"), "point", point.as_slice())?;
                ActsOn::Frame { offset: 12 * k, point, axes: follows.then_some(axes) }
            }
            Attachment::Particle(k) => {
                let dimension = mechanism.description().dimension;
                ActsOn::Particle { offset: mechanism.particle_offset(k), dimension }
            }
            Attachment::Ground => {
                return Err(BuildError::NoDirection { element: format!("`{name}`") });
            }
        })
    }

    /// An axis of a body.
    fn axis(&self, body: BodyId, axis: usize) -> Result<Form, BuildError> {
        let axes = self.bodies[body.index()].resolve()?.1.transpose();
        Ok(Form::vector(12 * body.index(), &axes.column(axis).into_owned()))
    }

    /// The way from the centre of a body to a point, along one of its axes.
    fn along(
        &self,
        name: &str,
        part: (BodyId, PointOn, usize),
    ) -> Result<JointCoordinate, BuildError> {
        let (base, at, axis) = part;
        let [center, to] = self.ends(|| format!("`{name}`"), &base.point([0.0; 3]), &at)?;
        let row = BilinearRow::product(self.axis(base, axis)?, to.minus(&center), 0.0);
        Ok(JointCoordinate::length(row))
    }

    /// `X_b − X_a`, which must have a direction initially.
    fn between(
        &self,
        name: &str,
        [from, to]: [PointOn; 2],
        mechanism: &Mechanism,
    ) -> Result<Form, BuildError> {
        let element = || format!("`{name}`");
        let q = mechanism.initial_configuration();
        let [from, to] = self.ends(element, &from, &to)?;
        let (a, b) = (from.at(&q), to.at(&q));
        if (b - a).norm() <= 8.0 * f64::EPSILON * a.amax().max(b.amax()) {
            return Err(BuildError::NoDirection { element: element() });
        }
        Ok(to.minus(&from))
    }

    pub(super) fn inputs(
        &self,
        name: &str,
        reads: &[Read],
        mechanism: &mut Mechanism,
    ) -> Result<Vec<Input>, BuildError> {
        let point = |at: PointOn| -> Result<Form, BuildError> {
            let [form, _] = self.ends(|| format!("`{name}`"), &at, &at)?;
            Ok(form)
        };
        let mut inputs = Vec::new();
        for read in reads {
            inputs.push(match *read {
                Read::Time => Input::Time,
                Read::Coordinate(id) => Input::Coordinate(self.listed(id, mechanism)?),
                Read::Rate(id) => Input::Rate(self.listed(id, mechanism)?),
                Read::Position(at, axis) => Input::Point(point(at)?, axis),
                Read::Velocity(at, axis) => Input::PointRate(point(at)?, axis),
                Read::Distance(ends) => Input::Length(self.between(name, ends, mechanism)?),
                Read::DistanceRate(ends) => Input::LengthRate(self.between(name, ends, mechanism)?),
                Read::AngularVelocity(body, axis) => Input::Spin(12 * body.index(), axis),
                Read::Along(base, at, axis) => {
                    Input::Coordinate(self.along(name, (base, at, axis))?)
                }
                Read::AlongRate(base, at, axis) => Input::Rate(self.along(name, (base, at, axis))?),
                Read::RelativeSpin([base, of], axis) => Input::RelativeSpin {
                    of: 12 * of.index(),
                    base: 12 * base.index(),
                    along: self.axis(base, axis)?,
                },
                Read::Held(place) => Input::Held(place),
                Read::Past(past) => Input::Past(past),
                Read::Six { part, .. } => Input::Six(part),
            });
        }
        Ok(inputs)
    }
}
