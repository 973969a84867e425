//! Constraints on weighed rates as parts of a builder.

use super::joint::direction;
use super::law::Read;
use super::{BodyId, BuildError, ConstraintKind, CoordinateId, MechanismBuilder, PointOn};
use crate::constraint::joint_coordinate::JointCoordinate;
use crate::constraint::velocity_constraint::Pace;
use crate::force::law::{Input, Law, LawOfRates, ReadingLaw};
use crate::geometry::form::Form;
use crate::mechanism::description::Attachment;
use nalgebra::Vector3;
use std::sync::Arc;

/// A quantity whose rate is constrained.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ConstrainedRate {
    /// A joint coordinate.
    Coordinate(CoordinateId),
    /// A point of a body along a direction: in space, or where it `follows` along the axes of the
    /// body.
    Point {
        /// The body.
        body: BodyId,
        /// The point.
        at: PointOn,
        /// The direction; its length counts.
        along: Vector3<f64>,
        /// Whether it is fixed in the body.
        follows: bool,
    },
}

#[derive(Clone)]
pub(super) struct RatesPart {
    terms: Vec<ConstrainedRate>,
    reads: Vec<Read>,
    law: Arc<dyn Law>,
    is_driven: bool,
}

impl MechanismBuilder {
    /// The rates of `terms`, weighed by all efforts of `law` but the last, have that one as their
    /// sum: `Σ c_k ẋ_k = b`. The law reads the time, joint coordinates and points of bodies; `c`
    /// does not change with time. `is_driven`: whether `b` may be other than zero.
    pub fn rates(
        &mut self,
        name: &str,
        terms: Vec<ConstrainedRate>,
        reads: Vec<Read>,
        law: Arc<dyn Law>,
        is_driven: bool,
    ) {
        let part = RatesPart { terms, reads, law, is_driven };
        self.constraint(name, ConstraintKind::Rates(part));
    }

    pub(super) fn law_of_rates(
        &self,
        name: &str,
        part: &RatesPart,
        coordinate: impl Fn(&CoordinateId) -> Result<JointCoordinate, BuildError>,
    ) -> Result<LawOfRates, BuildError> {
        let element = || format!("constraint `{name}`");
        let pace = |term: &ConstrainedRate| -> Result<Pace, BuildError> {
            Ok(match term {
                ConstrainedRate::Coordinate(id) => Pace::Joint(Box::new(coordinate(id)?)),
                ConstrainedRate::Point { body, at, along, follows } => {
                    let [point, _] = self.ends(element, at, at)?;
                    let unit = direction(element, "direction", along)?;
                    let along = along.norm() * unit;
                    let k = body.index();
                    let direction = match follows {
                        true => {
                            let axes = self.bodies[k].resolve()?.1;
                            Form::vector(12 * k, &axes.tr_mul(&along))
                        }
                        false => Form::constant(along),
                    };
                    Pace::Along { direction, point }
                }
            })
        };
        let input = |read: &Read| -> Result<Input, BuildError> {
            match read {
                Read::Time => Ok(Input::Time),
                Read::Coordinate(id) => Ok(Input::Coordinate(coordinate(id)?)),
                Read::Position(at, axis) if !matches!(at.member, Attachment::Particle(_)) => {
                    let [point, _] = self.ends(element, at, at)?;
                    Ok(Input::Point(point, *axis))
                }
                _ => Err(BuildError::NoDirection { element: element() }),
            }
        };
        let paces = part.terms.iter().map(pace).collect::<Result<_, _>>()?;
        let inputs = part.reads.iter().map(input).collect::<Result<_, _>>()?;
        let reading = ReadingLaw::new(part.law.clone(), inputs, Vec::new());
        Ok(LawOfRates { paces, reading, is_driven: part.is_driven })
    }
}
