//! Expressions of what can be read at a node: time, joint coordinates, bodies, sensors.

use std::cell::RefCell;

use crate::Model;
use crate::expression::{ExpressionError, ExpressionProgram, KnownName};
use crate::quantity::{Quantities, Quantity};
use crate::text::problem::nearest;
use crate::types::sensor::{Sensor, SensorKind};

/// A number of a node.
#[derive(Clone, Debug, PartialEq)]
pub enum NodeReading {
    /// The value of a signal.
    Signal(String),
    /// One of the numbers of a sensor, of the model or of what a name means.
    Sensor(Box<Sensor>, SensorPart),
}

/// One of the numbers of a sensor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SensorPart {
    /// Counted from 0.
    Number(usize),
    /// By its heading, after the name of the sensor.
    Heading(String),
}

/// An expression of what can be read at a node.
#[derive(Clone, Debug, PartialEq)]
pub struct Observed {
    /// The expression: its first input is the time, the others are the readings.
    pub program: ExpressionProgram,
    /// What it reads.
    pub readings: Vec<NodeReading>,
}

type Parse = fn(
    &str,
    &mut dyn FnMut(&str) -> Option<KnownName>,
) -> Result<ExpressionProgram, ExpressionError>;

impl Observed {
    /// Compiles a condition, which is true where it is positive.
    ///
    /// # Errors
    /// [`ExpressionError`].
    pub fn condition(
        text: &str,
        model: &Model,
        quantities: &Quantities<'_>,
    ) -> Result<Self, ExpressionError> {
        Self::compile(text, model, quantities, ExpressionProgram::condition, true)
    }

    /// Compiles an expression of a node that is known, so that it may read every sensor.
    ///
    /// # Errors
    /// [`ExpressionError`].
    pub fn expression(
        text: &str,
        model: &Model,
        quantities: &Quantities<'_>,
    ) -> Result<Self, ExpressionError> {
        Self::compile(text, model, quantities, ExpressionProgram::parse, false)
    }

    fn compile(
        text: &str,
        model: &Model,
        quantities: &Quantities<'_>,
        parse: Parse,
        of_state: bool,
    ) -> Result<Self, ExpressionError> {
        let (readings, refused) = (RefCell::new(Vec::<NodeReading>::new()), RefCell::new(None));
        let mut known = |name: &str| {
            if name == "t" {
                return Some(KnownName::Input(0));
            }
            if let Some(table) = quantities.curves().known(name) {
                return Some(table);
            }
            let reading = match reading(quantities, model, name, of_state)? {
                Ok(reading) => reading,
                Err(why) => {
                    refused.replace(Some(why));
                    return None;
                }
            };
            let mut all = readings.borrow_mut();
            let place = all.iter().position(|own| *own == reading).unwrap_or_else(|| {
                all.push(reading);
                all.len() - 1
            });
            Some(KnownName::Input(1 + place))
        };
        let program = parse(text, &mut known).map_err(|error| {
            let Some(name) = error.unknown.clone() else { return error };
            if let Some(why) = refused.take() {
                let help = "read a position, a velocity or a joint coordinate".to_owned();
                return ExpressionError { message: why, help, ..error };
            }
            let mut names = quantities.names();
            names.extend(model.sensors.iter().map(|sensor| sensor.name.clone()));
            let help = match nearest(&name, names.iter().map(String::as_str)) {
                Some(best) => format!("did you mean `{best}`?"),
                None => "it may read t, joints (`knee`, `knee.rate`), bodies (`arm.x` to `arm.z`, `arm.vx`, \
                         `arm.wx`, …), sensors (`tip.x`), and [parameters]"
                    .to_owned(),
            };
            ExpressionError { message: format!("`{name}` is not known"), help, ..error }
        })?;
        Ok(Self { program, readings: readings.into_inner() })
    }
}

/// What a name means; `Err` where it cannot be read at a node.
fn reading(
    quantities: &Quantities<'_>,
    model: &Model,
    name: &str,
    of_state: bool,
) -> Option<Result<NodeReading, String>> {
    let of_kind = |kind: SensorKind, of: String, number: usize| {
        let sensor = Sensor::new(format!("{kind:?} of {of}"), kind, of);
        Some(Ok(NodeReading::Sensor(Box::new(sensor), SensorPart::Number(number))))
    };
    match quantities.quantity(name) {
        Some(Quantity::Signal(signal)) => return Some(Ok(NodeReading::Signal(signal))),
        Some(Quantity::Coordinate { joint, freedom }) => {
            return of_kind(SensorKind::JointCoordinate, joint, freedom);
        }
        Some(Quantity::Rate { joint, freedom }) => {
            return of_kind(SensorKind::JointRate, joint, freedom);
        }
        Some(Quantity::Position { of, axis }) => return of_kind(SensorKind::Position, of, axis),
        Some(Quantity::Velocity { of, axis }) => return of_kind(SensorKind::Velocity, of, axis),
        Some(Quantity::AngularVelocity { of, axis }) => {
            return of_kind(SensorKind::AngularVelocity, of, axis);
        }
        Some(Quantity::Sensor { .. }) | None => {}
    }
    let (of, part) = name.split_once('.').unwrap_or((name, ""));
    let sensor = model.sensors.iter().find(|sensor| sensor.name == of)?;
    let constrained = model.constraints.iter().any(|c| c.name() == sensor.of);
    let effort = matches!(sensor.kind, SensorKind::Effort | SensorKind::Power);
    if sensor.kind == SensorKind::Expression {
        return Some(Err(format!("`{of}` is an expression itself")));
    }
    if of_state && (!sensor.kind.is_of_state() || effort && constrained) {
        let why =
            format!("`{of}` cannot be read by an expression: it depends on the step that follows");
        return Some(Err(why));
    }
    Some(Ok(NodeReading::Sensor(Box::new(sensor.clone()), SensorPart::Heading(part.to_owned()))))
}
