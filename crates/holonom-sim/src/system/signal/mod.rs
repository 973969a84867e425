//! `[[signal]]` of a model: terms of a network, states, held values, what happens at nodes.
//!
//! Formulas of filters, controllers and transfer functions: `holonom_model`, `signal_parts`.
//!
//! | file | concept |
//! |---|---|
//! | `kinds` | what the value of a signal of each kind is, and the rates of its states |
//! | `network` | expressions that read one another, with their slopes |
//! | `parts` | what of the network a law needs, and all signals |
//! | `tasks` | what happens at nodes, in the order of dependence |
//! | `sampler` | what happens at nodes and at the start |
//! | `output` | signals along a run |

mod kinds;
pub(crate) mod network;
pub(crate) mod output;
mod parts;
pub(crate) mod sampler;
mod tasks;

use crate::digits::rounded;
use crate::sensor::{SensorColumn, columns_of, ends_of};
use crate::system::names::Names;
use holonom_model::expression::{ExpressionError, ExpressionProgram, KnownName};
use holonom_model::{
    Formula, MOTION, Model, ModelError, Problem, Quantities, Quantity, Sensor, SensorKind, Signal,
};
use kinds::sizes;
use network::{NetworkTerm, NumberSource};
pub(crate) use parts::Needed;
use std::collections::BTreeMap;
use vi_multibody::builder::{PointOn, Read};
use vi_multibody::law::Past;

/// The terms of the laws and signals of a model, as far as they are known.
pub(crate) struct Terms<'a> {
    names: &'a Names<'a>,
    quantities: &'a Quantities<'a>,
    terms: Vec<NetworkTerm>,
    inputs: Vec<(Read, String)>, // the time first
    signals: BTreeMap<&'a str, NumberSource>,
    places: BTreeMap<&'a str, usize>, // the first internal variable of each signal
    parts: BTreeMap<&'a str, Vec<(String, NumberSource)>>, // parts of signals, as far as known
    states: usize,
    rates: Vec<Option<NumberSource>>,
    start: Vec<f64>,
    pasts: BTreeMap<&'a str, Past>,
    filtered: Vec<(usize, NumberSource)>,
    measured: Vec<(String, usize)>, // columns of sensors, and where they are held
    output: Vec<output::OutputNumber>,
    unseen: Vec<(String, NumberSource)>, // states that are not written
}

impl<'a> Terms<'a> {
    /// Those of the signals of a model.
    pub(crate) fn new(
        names: &'a Names<'a>,
        quantities: &'a Quantities<'a>,
    ) -> Result<Self, ModelError> {
        let model = names.model;
        let mut own = Self {
            names,
            quantities,
            terms: Vec::new(),
            inputs: vec![(Read::Time, "t".to_owned())],
            signals: BTreeMap::new(),
            places: BTreeMap::new(),
            parts: BTreeMap::new(),
            states: 0,
            rates: Vec::new(),
            start: Vec::new(),
            pasts: BTreeMap::new(),
            filtered: Vec::new(),
            measured: Vec::new(),
            output: Vec::new(),
            unseen: Vec::new(),
        };
        let (mut states, mut held) = (0, 0);
        let all = model.signals.iter().map(|signal| (signal, sizes(signal, model.settings.step)));
        let all: Vec<_> = all.collect();
        own.states = all.iter().map(|(_, [states, _])| states).sum();
        for (signal, [own_states, own_held]) in &all {
            let place = if *own_states > 0 { states } else { own.states + held };
            own.places.insert(&signal.name, place);
            (states, held) = (states + own_states, held + own_held);
        }
        own.rates = vec![None; own.states];
        own.start = vec![0.0; own.states + held];
        for signal in &model.signals {
            own.signal(signal)?;
        }
        for signal in &model.signals {
            own.add_rates(signal)?;
        }
        own.list_output();
        Ok(own)
    }

    fn place(&self, signal: &Signal) -> usize {
        self.places[signal.name.as_str()]
    }

    pub(crate) fn input(&mut self, read: Read, name: String) -> NumberSource {
        let known = self.inputs.iter().position(|(own, _)| *own == read);
        NumberSource::Input(known.unwrap_or_else(|| {
            self.inputs.push((read, name));
            self.inputs.len() - 1
        }))
    }

    /// The variables of a law at a point of a member: time, place, velocity, angular velocity; in
    /// space, or relative to another frame.
    pub(crate) fn of_point(
        &mut self,
        at: PointOn,
        frame: Option<usize>,
        base: Option<usize>,
    ) -> Vec<(&'static str, NumberSource)> {
        let mut own = vec![("t", NumberSource::Input(0))];
        let id = |k: usize| self.names.frames[k];
        for (k, name) in MOTION.into_iter().enumerate().skip(1) {
            let axis = (k - 1) % 3;
            let read = match (k, frame.map(id), base.map(id)) {
                (1..4, _, None) => Read::Position(at, axis),
                (4..7, _, None) => Read::Velocity(at, axis),
                (1..4, _, Some(base)) => Read::Along(base, at, axis),
                (4..7, _, Some(base)) => Read::AlongRate(base, at, axis),
                (_, Some(frame), None) => Read::AngularVelocity(frame, axis),
                (_, Some(frame), Some(base)) => Read::RelativeSpin([base, frame], axis),
                _ => continue,
            };
            own.push((name, self.input(read, name.to_owned())));
        }
        own
    }

    fn held(&mut self, place: usize, name: &str) -> NumberSource {
        self.input(Read::Held(place), name.to_owned())
    }

    /// What a quantity is read from, in the expression of a key.
    fn quantity(&mut self, key: &str, quantity: &Quantity) -> Result<NumberSource, ModelError> {
        let name = quantity.name();
        let joint = |joint: &str, freedom: usize| {
            self.names.joint(joint).map(|(_, id)| id.coordinate(freedom))
        };
        let center = |of: &str| -> PointOn { self.names.point(of, [0.0; 3]) };
        let read = match quantity {
            Quantity::Signal(name) => {
                let signal = self.names.model.signals.iter().find(|own| own.name == *name);
                return self.signal(signal.expect("it was found by its name"));
            }
            Quantity::Coordinate { joint: of, freedom } => {
                joint(of, *freedom).map(Read::Coordinate)
            }
            Quantity::Rate { joint: of, freedom } => joint(of, *freedom).map(Read::Rate),
            Quantity::Position { of, axis } => Some(Read::Position(center(of), *axis)),
            Quantity::Velocity { of, axis } => Some(Read::Velocity(center(of), *axis)),
            Quantity::AngularVelocity { of, axis } => {
                let frame = self.names.index(of).map(|k| self.names.frames[k]);
                frame.map(|frame| Read::AngularVelocity(frame, *axis))
            }
            Quantity::Sensor { sensor, part, at_once, .. } => {
                match self.column(key, sensor, part) {
                    Ok((column, found)) if *at_once => self.sensed(found, column),
                    Err(error) if *at_once || !is_of_what_went(self.names.model, sensor) => {
                        return Err(error);
                    }
                    _ => Some(self.measured_at(&name)),
                }
            }
        };
        Ok(self.input(read.expect("it was found by its name"), name))
    }

    /// Which number of a sensor has this heading.
    fn column(
        &self,
        key: &str,
        sensor: &str,
        part: &str,
    ) -> Result<(usize, &'a Sensor), ModelError> {
        let model = self.names.model;
        let found = model.sensors.iter().find(|own| own.name == sensor);
        let found = found.expect("it was found by its name");
        let columns = columns_of(model, found);
        let place = columns.iter().position(|column| column.part == part);
        place.map(|place| (place, found)).ok_or_else(|| {
            let known: Vec<String> = columns.iter().map(SensorColumn::name).collect();
            let message = format!("`{sensor}` has no number of this name");
            let help = format!("it has {}", known.join(", "));
            ModelError::Assembly(vec![Problem::new(key, message).help(help)])
        })
    }

    /// A number of a sensor of configuration and velocity.
    fn sensed(&self, sensor: &Sensor, k: usize) -> Option<Read> {
        let names = self.names;
        let at = names.point(&sensor.of, sensor.point.unwrap_or_default());
        let base = sensor.seen_from.as_deref().and_then(|base| names.body(base));
        let ends = || {
            let ends = ends_of(names.model, sensor)?;
            Some(ends.map(|(name, point)| names.point(name, point)))
        };
        let coordinate = || names.joint(&sensor.of).map(|(_, id)| id.coordinate(k));
        match (sensor.kind, base) {
            (SensorKind::Position, None) => Some(Read::Position(at, k)),
            (SensorKind::Position, Some(base)) => Some(Read::Along(base, at, k)),
            (SensorKind::Velocity, None) => Some(Read::Velocity(at, k)),
            (SensorKind::Velocity, Some(base)) => Some(Read::AlongRate(base, at, k)),
            (SensorKind::AngularVelocity, base) => {
                let frame = names.body(&sensor.of)?;
                Some(match base {
                    Some(base) => Read::RelativeSpin([base, frame], k),
                    None => Read::AngularVelocity(frame, k),
                })
            }
            (SensorKind::Distance, _) => ends().map(Read::Distance),
            (SensorKind::DistanceRate, _) => ends().map(Read::DistanceRate),
            (SensorKind::JointCoordinate, _) => coordinate().map(Read::Coordinate),
            (SensorKind::JointRate, _) => coordinate().map(Read::Rate),
            _ => None,
        }
    }

    /// A column that is held as it was at the node before.
    fn measured_at(&mut self, column: &str) -> Read {
        let known = self.measured.iter().find(|(name, _)| name == column);
        Read::Held(known.map(|(_, place)| *place).unwrap_or_else(|| {
            self.start.push(0.0);
            self.measured.push((column.to_owned(), self.start.len() - 1));
            self.start.len() - 1
        }))
    }

    /// Adds an expression of its own variables and of what it names.
    pub(crate) fn formula(
        &mut self,
        owner: &str,
        key: &str,
        formula: &Formula,
        own: &[(&str, NumberSource)],
    ) -> Result<NumberSource, ModelError> {
        let names: Vec<&str> = own.iter().map(|(name, _)| *name).collect();
        let mut reads = Vec::new();
        let program = self.quantities.compile(formula, &names, &mut reads);
        let program = program.map_err(|error| refusal(key, error))?;
        let mut from: Vec<(NumberSource, String)> =
            own.iter().map(|(name, source)| (*source, (*name).to_owned())).collect();
        for read in &reads {
            from.push((self.quantity(key, read)?, read.name()));
        }
        Ok(self.term(NetworkTerm { owner: owner.to_owned(), program, from, is_own: false }))
    }

    /// Adds an expression of what is known.
    pub(crate) fn part(
        &mut self,
        owner: &str,
        text: &str,
        from: &[(&str, NumberSource)],
    ) -> NumberSource {
        let place = |name: &str| from.iter().position(|(own, _)| *own == name);
        let program = ExpressionProgram::parse(text, &mut |name| place(name).map(KnownName::Input));
        let program = program.expect("numbers of a valid model");
        let from = from.iter().map(|(name, source)| (*source, (*name).to_owned())).collect();
        self.term(NetworkTerm { owner: owner.to_owned(), program, from, is_own: true })
    }

    fn term(&mut self, term: NetworkTerm) -> NumberSource {
        self.terms.push(term);
        NumberSource::Term(self.terms.len() - 1)
    }
}

fn label(name: &str) -> String {
    format!("signal `{name}`")
}

fn key(name: &str, key: &str) -> String {
    format!("signal.{name}.{key}")
}

/// Time constants that the step does not resolve.
pub(crate) fn warnings(model: &Model) -> Vec<String> {
    let step = model.settings.step;
    let warning = |signal: &Signal| {
        let filter = signal.filter.as_ref().map(|own| own.time_constant);
        let pid = signal.pid.as_ref().filter(|_| signal.every.is_none());
        let time = filter.or(pid.and_then(|own| own.filter))?;
        (step > 0.5 * time).then(|| {
            format!(
                "signal `{}`: its time constant is {time} s, of which a step of {step} s is more than half: it \
                 oscillates from step to step; step = {} would resolve it",
                signal.name,
                rounded(0.5 * time, 3)
            )
        })
    };
    model.signals.iter().filter_map(warning).collect()
}

/// An expression that is none.
pub(crate) fn refusal(key: &str, error: ExpressionError) -> ModelError {
    ModelError::Assembly(vec![Problem::new(key, error.message).help(error.help)])
}

/// Whether a sensor is of a part that an event has taken away: the model of the start has judged
/// its columns.
fn is_of_what_went(model: &Model, sensor: &str) -> bool {
    let Some(own) = model.sensors.iter().find(|own| own.name == sensor) else { return false };
    let events = model.events.iter();
    let mut taken = events.flat_map(|event| event.release.iter().chain(&event.disable));
    let is = |name: &str| name == own.of;
    let stays = model.joint(&own.of).is_some()
        || model.bars.iter().any(|part| is(&part.name))
        || model.constraints.iter().any(|part| is(part.name()))
        || model.springs.iter().any(|part| is(&part.name))
        || model.bushings.iter().any(|part| is(&part.name))
        || model.laws.iter().any(|part| is(&part.name));
    taken.any(|name| is(name)) && !stays
}
