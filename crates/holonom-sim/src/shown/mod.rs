//! What sensors show, with its derivatives: all that gradients, estimates, designs and optimal
//! controls can count.
//!
//! | file | sensors |
//! |---|---|
//! | `configuration` | positions, distances, joint coordinates, and their rates; angular velocities |
//! | `orientation` | quaternions |
//! | `ball`, `ball_coordinate` | rotation vectors, rates and accelerations of ball joints |
//! | `acting` | efforts of what acts along joints, between points and by laws; powers |
//! | `forces` | reactions, tensions, efforts of constraints; accelerations |
//! | `work` | works of what acts |
//! | `contact` | forces and gaps of compliant contacts |
//! | `section` | strains and section forces of beams |
//! | `signal` | what expressions read of signals |
//! | `expressed` | expressions of these |
//! | `counted` | what objectives count |
//!
//! A new sensor with a derivative is a [`Quantity`](vi_control::objective::Quantity) or a
//! [`NodeQuantity`], and a line of [`Shown::of`].

mod acting;
mod ball;
mod ball_coordinate;
pub(crate) mod configuration;
mod contact;
pub(crate) mod counted;
mod expressed;
pub(crate) mod forces;
mod orientation;
mod section;
mod signal;
pub(crate) mod work;

use crate::design::{ModelTangent, refused};
use crate::sensor::{SensorColumn, columns_of, observed};
use crate::system::System;
use configuration::{MeasuredNumber, Sensed, spin};
use expressed::Expressed;
use holonom_model::{Model, ModelError, NodeReading, Sensor, SensorKind};
use vi_constraints::saddle_point::IndependentRows;
use vi_control::identification::MeasuredReading as Rate;
use vi_control::node::NodeQuantity;

/// What a sensor shows, with its derivative.
pub(crate) enum Shown {
    /// A quantity of the configuration, or its rate.
    Configuration(Sensed, Rate),
    /// A number of a node with its velocity.
    Node(Box<dyn NodeQuantity>),
}

impl Shown {
    /// By a sensor, of one of several numbers with its part; `key`: what names it in the model.
    ///
    /// # Errors
    /// [`ModelError`] of a sensor that has no derivative.
    pub(crate) fn of(
        of_run: (&Model, &IndependentRows),
        system: &mut System,
        key: &str,
        of: (&Sensor, Option<&str>),
        tangents: &[ModelTangent],
    ) -> Result<Self, ModelError> {
        let ((model, _), (sensor, _)) = (of_run, of);
        if let Some(spin) = spin(model, &system.mechanism, key, of)? {
            return Ok(Self::Node(Box::new(spin)));
        }
        if let Some(own) = observed(model, sensor) {
            let own = Expressed::new(of_run, system, key, (sensor, own), tangents)?;
            return Ok(Self::Node(Box::new(own)));
        }
        if let Some(own) = acting::of_sensor(model, system, key, of, tangents)? {
            return Ok(Self::Node(own));
        }
        let asked = Asked { model, system: &*system, key, of, tangents };
        let others = [section::of_sensor, contact::of_sensor, work::of_sensor, ball::of_sensor];
        for of_sensor in others {
            if let Some(own) = of_sensor(asked)? {
                return Ok(Self::Node(own));
            }
        }
        if let Some(own) = forces::of_sensor(asked, of_run.1)? {
            return Ok(Self::Node(own));
        }
        if let Some(own) = MeasuredNumber::orientation(model, system, key, of)? {
            return Ok(Self::Configuration(Sensed::still(own), Rate::Value));
        }
        if let Some(own) = ball::coordinate(asked)? {
            let own = MeasuredNumber::Ball(Box::new(own));
            return Ok(Self::Configuration(Sensed::still(own), Rate::Value));
        }
        let mechanism = &mut system.mechanism;
        let (measured, rate) = MeasuredNumber::of_sensor(model, mechanism, key, of)?;
        let sensed = Sensed::new(measured, mechanism, &sensor.name, tangents);
        Ok(Self::Configuration(sensed, rate))
    }
}

/// Which number of a sensor is asked for, of what, and by which parameters; `key`: what names the
/// sensor in the model.
#[derive(Clone, Copy)]
pub(crate) struct Asked<'a> {
    pub(crate) model: &'a Model,
    pub(crate) system: &'a System,
    pub(crate) key: &'a str,
    pub(crate) of: (&'a Sensor, Option<&'a str>),
    pub(crate) tangents: &'a [ModelTangent],
}

impl Asked<'_> {
    /// See [`number_of`].
    fn number(&self) -> Result<usize, ModelError> {
        number_of(self.model, self.key, self.of)
    }

    /// See [`no_derivative`].
    fn refused(&self) -> ModelError {
        no_derivative(self.key, self.of.0)
    }
}

/// What such a sensor shows; `None` of others.
type OfNode = Result<Option<Box<dyn NodeQuantity>>, ModelError>;

/// What a sensor reads where it is an expression: sensors of the model, and of what names mean.
pub(crate) fn sensors_read(model: &Model, name: &str) -> Vec<Sensor> {
    let sensor = model.sensors.iter().find(|own| own.name == name);
    let own = sensor.and_then(|own| observed(model, own));
    let readings = own.map_or_else(Vec::new, |own| own.readings);
    let sensor = |reading| match reading {
        NodeReading::Sensor(sensor, _) => Some(*sensor),
        NodeReading::Signal(_) => None,
    };
    readings.into_iter().filter_map(sensor).collect()
}

/// The sensors of these names, and those that they read.
pub(crate) fn all_read<'a>(model: &'a Model, names: impl Iterator<Item = &'a str>) -> Vec<Sensor> {
    let own = |name: &str| {
        let own = model.sensors.iter().filter(|own| own.name == name).cloned();
        own.chain(sensors_read(model, name)).collect::<Vec<_>>()
    };
    names.flat_map(|text| own(split(text).0)).collect()
}

/// Whether what a sensor shows depends on the numbers of another one, or of itself.
pub(crate) fn depends_on(model: &Model, sensor: &str, name: &str) -> bool {
    sensor == name || sensors_read(model, sensor).iter().any(|own| own.name == name)
}

/// Which of the columns of a sensor is meant.
///
/// # Errors
/// [`ModelError`] where that is none, or a flag.
pub(crate) fn number_of(
    model: &Model,
    key: &str,
    (sensor, part): (&Sensor, Option<&str>),
) -> Result<usize, ModelError> {
    let columns = columns_of(model, sensor);
    let named = |part: &str| columns.iter().position(|own| own.part == part);
    let found = match part {
        None => (columns.len() == 1).then_some(0),
        Some(part) => named(part).or_else(|| part.parse().ok()),
    };
    let found = found.filter(|k| columns.get(*k).is_some_and(|own| !own.is_flag()));
    found.ok_or_else(|| {
        let numbers = columns.iter().filter(|own| !own.is_flag()).map(SensorColumn::name);
        let what = format!("the sensor `{}`, which is several numbers", sensor.name);
        let help = format!("write one of them: {}", numbers.collect::<Vec<_>>().join(", "));
        refused(key, what, help)
    })
}

/// The name of a sensor, and which of its numbers.
fn split(text: &str) -> (&str, Option<&str>) {
    text.split_once('.').map_or((text, None), |(name, part)| (name, Some(part)))
}

/// What of a quantity a sensor shows.
fn shown(sensor: &Sensor) -> Rate {
    let is_rate = sensor.kind.is_rate() && sensor.kind != SensorKind::AngularVelocity;
    if is_rate { Rate::Rate } else { Rate::Value }
}

/// The same of a sensor by its name.
pub(crate) fn reading(model: &Model, text: &str) -> Rate {
    let sensor = model.sensors.iter().find(|own| own.name == split(text).0);
    sensor.map_or(Rate::Value, shown)
}

/// A sensor by its name, and which of its numbers; `key`: of the model, where it is named.
///
/// # Errors
/// [`ModelError`] where there is none.
pub(crate) fn named<'a>(
    model: &'a Model,
    key: &str,
    text: &'a str,
) -> Result<(&'a Sensor, Option<&'a str>), ModelError> {
    let (name, part) = split(text);
    let sensor = model.sensors.iter().find(|sensor| sensor.name == name);
    let missing = || refused(key, format!("a sensor `{name}`"), "add the [[sensor]]");
    Ok((sensor.ok_or_else(missing)?, part)) // checked before
}

/// The refusal of a sensor.
pub(crate) fn no_derivative(key: &str, sensor: &Sensor) -> ModelError {
    let what = format!("the derivative of the sensor `{}`", sensor.name);
    let help = match sensor.kind {
        SensorKind::JointAcceleration => "take a joint that slides or turns about its axes",
        SensorKind::Power => {
            "take the effort and a rate, and multiply them in a sensor of type \"expression\""
        }
        SensorKind::Gap | SensorKind::Clearance | SensorKind::ContactForce | SensorKind::Slip => {
            "take a distance of points, or the force or gap of a contact with a `model`"
        }
        SensorKind::StopForce | SensorKind::FrictionTorque => {
            "give the joint a `bumper`, or its friction a `model`, and take the effort"
        }
        _ => {
            "take a position, an orientation, a distance of points, a joint coordinate, one of \
             their rates, an angular velocity, an effort, or an expression of these"
        }
    };
    refused(key, what, help)
}

/// The refusal of a part that jumps where the motion leads.
fn jumps(key: &str, part: &str, of: &str) -> ModelError {
    let what = format!("the derivative of {of}: `{part}` jumps where what it reads moves");
    let help = "count something without it: smooth(x, a, b) changes from 0 to 1 without a jump, \
                abs, min, max and clamp have kinks alone";
    refused(key, what, help)
}
