//! What a sensor measures as a function of the configuration, with its derivative.

use super::ball_coordinate::BallCoordinate;
use super::orientation::Turned;
use super::{no_derivative, number_of, shown, split};
use crate::design::{ModelTangent, refused};
use crate::sensor::ends_of;
use crate::system::System;
use holonom_model::{Model, ModelError, Sensor, SensorKind};
use nalgebra::Vector3;
use vi_control::identification::MeasuredReading;
use vi_control::objective::{NotedNode, PointComponent, Quantity};
use vi_core::{Configuration, Motion};
use vi_multibody::design::MovedCoordinate;
use vi_multibody::form::{BilinearRow, Form};
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_multibody::law::Input;
use vi_multibody::mechanism::{Attachment, Mechanism};
use vi_rigid::directors::FRAME;

/// A number that a sensor measures.
#[derive(Clone, Debug)]
pub(crate) enum MeasuredNumber {
    /// A component of a point, m.
    Point(PointComponent),
    /// A component of a point along an axis of a body, from its centre of mass, m.
    Seen(BilinearRow),
    /// From one point to another: their distance, m.
    Distance(Form),
    /// A joint coordinate, m or rad.
    Joint {
        /// Of the mechanism.
        joint: usize,
        /// Which of its coordinates.
        freedom: usize,
        /// What it is.
        coordinate: Box<JointCoordinate>,
    },
    /// A number of the quaternion of an orientation.
    Orientation(Box<Turned>),
    /// A number of the rotation vector of a ball joint, rad.
    Ball(Box<BallCoordinate>),
}

impl Quantity for MeasuredNumber {
    fn value(&self, at: Configuration<'_>) -> f64 {
        match self {
            Self::Point(own) => own.value(at),
            Self::Seen(own) => Quantity::value(own, at),
            Self::Distance(between) => between.at(at.q).norm(),
            Self::Joint { coordinate, .. } => coordinate.at(at),
            Self::Orientation(own) => own.value(at),
            Self::Ball(own) => own.value(at),
        }
    }
    fn add_slope(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        match self {
            Self::Point(own) => own.add_slope(at, scale, out),
            Self::Seen(own) => own.add_slope(at, scale, out),
            Self::Distance(between) => {
                let line = between.at(at.q);
                between.add_transposed(&(scale / line.norm() * line), out);
            }
            Self::Joint { coordinate, .. } => coordinate.add_slope(at, scale, out),
            Self::Orientation(own) => own.add_slope(at, scale, out),
            Self::Ball(own) => own.add_slope(at, scale, out),
        }
    }
    fn add_bend(&self, at: Motion<'_>, scale: f64, out: &mut [f64]) {
        match self {
            Self::Point(own) => own.add_bend(at, scale, out),
            Self::Seen(own) => own.add_bend(at, scale, out),
            Self::Distance(between) => between.add_length_bend(at.q, at.v, scale, out),
            Self::Joint { coordinate, .. } => coordinate.add_bend(at.q, at.v, scale, out),
            Self::Orientation(own) => own.add_bend(at, scale, out),
            Self::Ball(own) => own.add_bend(at, scale, out),
        }
    }
    fn add_third(&self, at: Configuration<'_>, along: [&[f64]; 2], scale: f64, out: &mut [f64]) {
        match self {
            Self::Point(own) => own.add_third(at, along, scale, out),
            Self::Seen(own) => own.add_third(at, along, scale, out),
            Self::Distance(between) => between.add_length_third(at.q, along, scale, out),
            Self::Joint { coordinate, .. } => coordinate.add_third(at, along, scale, out),
            Self::Orientation(own) => own.add_third(at, along, scale, out),
            Self::Ball(own) => own.add_third(at, along, scale, out),
        }
    }
    fn follow(&self, node: Configuration<'_>, seen: NotedNode) {
        if let Self::Orientation(own) = self {
            own.follow(node, seen);
        }
    }
}

impl MeasuredNumber {
    /// The number of a quaternion that a sensor shows; `None` where it measures another number.
    ///
    /// # Errors
    /// [`ModelError`] where it names none of its numbers.
    pub(crate) fn orientation(
        model: &Model,
        system: &System,
        key: &str,
        (sensor, part): (&Sensor, Option<&str>),
    ) -> Result<Option<Self>, ModelError> {
        let Some(attitude) = system.sensors.attitude(&sensor.name) else { return Ok(None) };
        let part = number_of(model, key, (sensor, part))?;
        Ok(Some(Self::Orientation(Box::new(Turned::new(attitude.clone(), part)))))
    }

    /// A coordinate of a joint; `None` where it has none.
    pub(crate) fn coordinate(
        model: &Model,
        mechanism: &mut Mechanism,
        name: &str,
        freedom: usize,
    ) -> Option<Self> {
        let joint = model.joints.iter().position(|joint| joint.name == name)?;
        let coordinate = Box::new(mechanism.coordinate(joint, freedom)?);
        Some(Self::Joint { joint, freedom, coordinate })
    }

    /// What a sensor measures, or whose rate it does; of one of several numbers with its part.
    ///
    /// # Errors
    /// [`ModelError`] of a sensor that has no derivative.
    pub(crate) fn of_sensor(
        model: &Model,
        mechanism: &mut Mechanism,
        key: &str,
        (sensor, part): (&Sensor, Option<&str>),
    ) -> Result<(Self, MeasuredReading), ModelError> {
        let name = sensor.name.as_str();
        let own = match sensor.kind {
            SensorKind::Position | SensorKind::Velocity => {
                let axis = component(key, name, part, model.header.dimension)?;
                let point = point(model, mechanism, &sensor.of, sensor.point);
                Ok(match &sensor.seen_from {
                    None => Self::Point(PointComponent { point, axis }),
                    Some(observer) => {
                        let [left, right] = seen(model, mechanism, point, axis, observer);
                        Self::Seen(BilinearRow::product(left, right, 0.0))
                    }
                })
            }
            SensorKind::Distance | SensorKind::DistanceRate => {
                let [from, to] = ends_of(model, sensor)
                    .ok_or_else(|| no_derivative(key, sensor))?
                    .map(|(name, own)| point(model, mechanism, name, Some(own)));
                Ok(Self::Distance(to.minus(&from)))
            }
            SensorKind::JointCoordinate | SensorKind::JointRate => {
                let freedom = part.map_or(Ok(0), str::parse::<usize>).ok();
                let found = freedom
                    .and_then(|freedom| Self::coordinate(model, mechanism, &sensor.of, freedom));
                found.ok_or_else(|| {
                    let text = part.map_or(name.to_owned(), |part| format!("{name}.{part}"));
                    let what = format!("`{text}`, which is no coordinate of a joint");
                    let help = "write the number of the coordinate, such as \"NAME.0\"";
                    refused(key, what, help)
                })
            }
            _ => Err(no_derivative(key, sensor)),
        };
        Ok((own?, shown(sensor)))
    }
}

/// The component of a vector that a sensor shows.
fn component(
    key: &str,
    name: &str,
    part: Option<&str>,
    dimension: usize,
) -> Result<usize, ModelError> {
    let axis = part
        .and_then(|part| ["x", "y", "z"].iter().position(|own| *own == part).or(part.parse().ok()));
    axis.filter(|axis| *axis < dimension).ok_or_else(|| {
        let what = format!("the sensor `{name}`, which is several numbers");
        refused(key, what, "write one of them, such as \"NAME.z\"")
    })
}

/// The angular velocity that a sensor measures, in space or as another body sees it; `None` where
/// it measures another number.
///
/// # Errors
/// [`ModelError`] where it names none of its components.
pub(crate) fn spin(
    model: &Model,
    mechanism: &Mechanism,
    key: &str,
    (sensor, part): (&Sensor, Option<&str>),
) -> Result<Option<Input>, ModelError> {
    let Some(frame) = model.frame(&sensor.of) else { return Ok(None) };
    if sensor.kind != SensorKind::AngularVelocity {
        return Ok(None);
    }
    let (of, axis) = (FRAME * frame, component(key, &sensor.name, part, 3)?);
    let Some(observer) = &sensor.seen_from else { return Ok(Some(Input::Spin(of, axis))) };
    let Some(base) = model.frame(observer) else { return Ok(None) };
    let [_, along] = seen(model, mechanism, Form::constant(Vector3::zeros()), axis, observer);
    Ok(Some(Input::RelativeSpin { of, base: FRAME * base, along }))
}

/// A point less the centre of mass of an observer, and the axis of the observer.
fn seen(
    model: &Model,
    mechanism: &Mechanism,
    point_seen: Form,
    axis: usize,
    observer: &str,
) -> [Form; 2] {
    let mut along = [0.0; 3];
    along[axis] = 1.0;
    let center = point(model, mechanism, observer, None);
    let right = point(model, mechanism, observer, Some(along)).minus(&center);
    [point_seen.minus(&center), right]
}

/// A point of a member, by components along the axes of the model.
pub(crate) fn point(
    model: &Model,
    mechanism: &Mechanism,
    name: &str,
    components: Option<[f64; 3]>,
) -> Form {
    let own = Vector3::from(components.unwrap_or_default());
    let frame = model.frame(name);
    let along = match frame.and_then(|frame| Some((frame, model.bodies.get(frame)?))) {
        Some((frame, body)) => {
            mechanism.description().bodies[frame].triad.tr_mul(&(body.rotation() * own))
        }
        None => own,
    };
    let particle = || model.particles.iter().position(|own| own.name == name);
    let member = match frame {
        Some(frame) => Attachment::Body(frame),
        None => particle().map_or(Attachment::Ground, Attachment::Particle),
    };
    mechanism.point_of(member, &along)
}

/// What a sensor measures, and how it depends on the parameters of a model beside `q`.
#[derive(Clone, Debug)]
pub(crate) struct Sensed {
    of: MeasuredNumber,
    by: Vec<QuantityChange>, // in the order of the parameters
}

/// How a quantity changes with a parameter.
#[derive(Clone, Debug)]
enum QuantityChange {
    /// It does not.
    None,
    /// The change of its point, or of the line between its points.
    Form(Form),
    /// The joint itself changes.
    Joint(Box<MovedCoordinate>),
}

impl Sensed {
    /// What no parameter changes at a configuration.
    pub(crate) fn still(of: MeasuredNumber) -> Self {
        Self { of, by: Vec::new() }
    }

    /// The distance along `D`, which parameters change so.
    pub(crate) fn between(of: Form, changes: impl Iterator<Item = Option<Form>>) -> Self {
        let by =
            changes.map(|own| own.map_or(QuantityChange::None, QuantityChange::Form)).collect();
        Self { of: MeasuredNumber::Distance(of), by }
    }

    /// The joint and which of its coordinates it is; `None` of others.
    pub(crate) fn joint(&self) -> Option<(usize, usize)> {
        match self.of {
            MeasuredNumber::Joint { joint, freedom, .. } => Some((joint, freedom)),
            _ => None,
        }
    }

    /// From one point to another, where it is their distance.
    pub(crate) fn between_points(&self) -> Option<&Form> {
        match &self.of {
            MeasuredNumber::Distance(between) => Some(between),
            _ => None,
        }
    }

    /// Of a sensor, by its name or that of one of its numbers.
    pub(crate) fn new(
        of: MeasuredNumber,
        mechanism: &Mechanism,
        text: &str,
        tangents: &[ModelTangent],
    ) -> Self {
        let (name, _) = split(text);
        let change = |own: &ModelTangent| match &of {
            MeasuredNumber::Joint { coordinate, .. } => {
                MovedCoordinate::of(mechanism, &own.numbers, coordinate)
                    .map_or(QuantityChange::None, |own| QuantityChange::Joint(Box::new(own)))
            }
            _ => own
                .sensors
                .get(name)
                .map_or(QuantityChange::None, |form| QuantityChange::Form(form.clone())),
        };
        let by = tangents.iter().map(change).collect();
        Self { of, by }
    }
}

impl Quantity for Sensed {
    fn value(&self, at: Configuration<'_>) -> f64 {
        self.of.value(at)
    }
    fn add_slope(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        self.of.add_slope(at, scale, out);
    }
    fn add_bend(&self, at: Motion<'_>, scale: f64, out: &mut [f64]) {
        self.of.add_bend(at, scale, out);
    }
    fn add_third(&self, at: Configuration<'_>, along: [&[f64]; 2], scale: f64, out: &mut [f64]) {
        self.of.add_third(at, along, scale, out);
    }
    fn is_continued(&self) -> bool {
        matches!(self.of, MeasuredNumber::Orientation(_))
    }
    fn follow(&self, node: Configuration<'_>, seen: NotedNode) {
        self.of.follow(node, seen);
    }
    fn by_parameter(&self, parameter: usize, at: Configuration<'_>) -> f64 {
        match (self.by.get(parameter), &self.of) {
            (_, MeasuredNumber::Ball(own)) => own.by_parameter(parameter, at),
            (Some(QuantityChange::Joint(own)), _) => own.by(at.q),
            (Some(QuantityChange::Form(change)), MeasuredNumber::Point(own)) => {
                change.at(at.q)[own.axis]
            }
            (Some(QuantityChange::Form(change)), MeasuredNumber::Seen(own)) => {
                change.at(at.q).dot(&own.b.at(at.q))
            }
            (Some(QuantityChange::Form(change)), MeasuredNumber::Distance(between)) => {
                let line = between.at(at.q);
                line.dot(&change.at(at.q)) / line.norm()
            }
            _ => 0.0,
        }
    }
    fn rate_by_parameter(&self, parameter: usize, at: Motion<'_>) -> f64 {
        match (self.by.get(parameter), &self.of) {
            (_, MeasuredNumber::Ball(own)) => own.rate_by_parameter(parameter, at),
            (Some(QuantityChange::Joint(own)), _) => own.rate_by(at.q, at.v),
            (Some(QuantityChange::Form(change)), MeasuredNumber::Point(own)) => {
                change.rate(at.v)[own.axis]
            }
            (Some(QuantityChange::Form(change)), MeasuredNumber::Seen(own)) => {
                let [axis, turning] = [own.b.at(at.q), own.b.rate(at.v)];
                change.rate(at.v).dot(&axis) + change.at(at.q).dot(&turning)
            }
            (Some(QuantityChange::Form(change)), MeasuredNumber::Distance(between)) => {
                let (line, rate) = (between.at(at.q), between.rate(at.v));
                let (moved, length) = (change.at(at.q), line.norm());
                let along = line / length;
                // of D̂·Ḋ
                let turned = rate.dot(&moved) - along.dot(&rate) * along.dot(&moved);
                along.dot(&change.rate(at.v)) + turned / length
            }
            _ => 0.0,
        }
    }
}
