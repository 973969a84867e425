//! Conditions of events at a node.

use crate::sensor::{SensorColumn, Sensors, View, columns_of, columns_of_signal};
use crate::system;
use crate::system::outside::ExternalActions;
use holonom_model::expression::ExpressionProgram;
use holonom_model::{
    Event, Locate, Model, ModelError, NodeReading, Observed, Problem, Quantities, SensorPart,
};
use vi_constraints::saddle_point::IndependentRows;
use vi_multibody::mechanism::Mechanism;

/// When the events of a model act.
#[derive(Debug)]
pub(crate) struct EventConditions {
    events: Vec<EventTiming>,
    sensors: Sensors, // of what is read
    values: Vec<f64>, // of their columns, scratch
    inputs: Vec<f64>, // of an expression, scratch
}

/// When an event acts.
#[derive(Debug)]
struct EventTiming {
    name: String,
    at: Option<f64>, // s
    program: Option<ExpressionProgram>,
    reads: Vec<usize>, // columns, in the order of its inputs after the time
}

impl EventConditions {
    pub(crate) fn new(
        model: &Model,
        events: &[Event],
        outside: &ExternalActions,
    ) -> Result<Self, ModelError> {
        let quantities = Quantities::new(model);
        let (mut watched, mut first) = (Vec::new(), Vec::new());
        // the columns of signals come first
        let signals: Vec<SensorColumn> = model.signals.iter().flat_map(columns_of_signal).collect();
        let mut count = signals.len();
        let mut all = Vec::new();
        for event in events {
            let (mut program, mut reads) = (None, Vec::new());
            if let Some(text) = &event.when {
                let key = format!("event.{}.when", event.name);
                let refused = |message: String, help: String| {
                    ModelError::Assembly(vec![Problem::new(key.clone(), message).help(help)])
                };
                let found = Observed::condition(text, model, &quantities)
                    .map_err(|error| refused(error.message, error.help))?;
                for reading in found.readings {
                    let (sensor, part) = match reading {
                        NodeReading::Signal(name) => {
                            reads.extend(signals.iter().position(|column| column.name() == name));
                            continue;
                        }
                        NodeReading::Sensor(sensor, part) => (*sensor, part),
                    };
                    let columns = columns_of(model, &sensor);
                    let place = watched.iter().position(|own| *own == sensor);
                    let start = place.map_or(count, |place| first[place]);
                    let own = match &part {
                        SensorPart::Number(k) => Some(*k),
                        SensorPart::Heading(part) => {
                            columns.iter().position(|column| column.part == *part)
                        }
                    };
                    let Some(own) = own else {
                        let known: Vec<String> = columns.iter().map(SensorColumn::name).collect();
                        let message = format!("`{}` has no number of this name", sensor.name);
                        return Err(refused(message, format!("it has {}", known.join(", "))));
                    };
                    if place.is_none() {
                        first.push(count);
                        count += columns.len();
                        watched.push(sensor);
                    }
                    reads.push(start + own);
                }
                program = Some(found.program);
            }
            all.push(EventTiming { name: event.name.clone(), at: event.at, program, reads });
        }
        let sensors = system::build_sensing(model, outside, &[], &watched)?.sensors;
        Ok(Self { events: all, sensors, values: Vec::new(), inputs: Vec::new() })
    }

    /// The time at which an event acts, s; `None` of one with a condition.
    pub(crate) fn time(&self, event: usize) -> Option<f64> {
        self.events[event].at
    }

    pub(crate) fn sensors(&mut self) -> &mut Sensors {
        &mut self.sensors
    }

    /// Whether they need the configuration of a node alone.
    pub(crate) fn are_of_configurations(&self) -> bool {
        self.sensors.are_of_configurations()
    }

    /// `sides ←` the value of each condition at a node, 0 of times.
    ///
    /// # Errors
    /// The name of the event whose condition has no value there, and why.
    pub(crate) fn read(
        &mut self,
        mechanism: &Mechanism,
        rows: &IndependentRows,
        at: View<'_>,
        sides: &mut Vec<f64>,
    ) -> Result<(), String> {
        let Self { events, sensors, values, inputs } = self;
        let t = at.t;
        sensors.read(mechanism, rows, at, values);
        sides.clear();
        for EventTiming { name, program, reads, .. } in events {
            let Some(program) = program else {
                sides.push(0.0);
                continue;
            };
            inputs.clear();
            inputs.push(t);
            inputs.extend(reads.iter().map(|column| values[*column]));
            let value = program.value(inputs);
            sides.push(value.map_err(|undefined| format!("event `{name}`: {undefined}"))?);
        }
        Ok(())
    }
}

/// Whether an event is located within a step.
pub(crate) fn is_located(event: &Event) -> bool {
    event.locate == Locate::Root
}
