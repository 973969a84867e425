//! Sensors along a run: from `[[sensor]]` to the numbers of a node.
//!
//! ```text
//! position           x = φ + ϱ_I d_I                      velocity   ẋ, with v̂ of ᵠp_n
//! orientation        R = (d_1 d_2 d_3) Aᵀ,  A: principal axes in the body's own frame
//! angular velocity   ω = ½ Σ d_I × ḋ_I                    with v̂
//! seen from a body   the same in its frame                observer
//! acceleration       ẍ,  ω̇ = ½ Σ d_I × d̈_I                of the steps beside the node
//! imu                Aᵀ Rᵀ (ẍ − γ),  Aᵀ Rᵀ ω              along its own axes A in the body
//! expression         of the other numbers of the node
//! distance           l = |D|,  l̇ = D̂·Ḋ                    between two points
//! joint              coordinates counted on, rates        vi_multibody::coordinates
//! reaction           −Gᵀ λ_n on the child                 vi_multibody::reaction
//! effort             springs, motors, prescribed motions  effort
//! power              of these and of loads                power
//! work               of these since the start             work
//! section force      N_I, M_I                             strain   Γ_I, K_I         vi_beam::section_force
//! ```
//! `λ_n` is that of the node (36) at order 2. It is that of the acceleration level with composed
//! steps, at a node from which no step could be taken, and at the start, where (47) is of first
//! order only (it is a one-sided difference). Accelerations are second differences of the
//! coordinates at order 2, those of the acceleration level at the other nodes. Unwrapped angles of
//! joints and the sign of quaternions are followed at every step, whether it is recorded or not.
//!
//! | file | concept |
//! |---|---|
//! | `columns` | names, quantities and units of the numbers |
//! | `gauge` | the numbers of a sensor |
//! | `finder` | what sensors name |
//! | `view` | what sensors see of a node |
//! | `observer` | what is seen from a body |
//! | `attitude` | orientations |
//! | `ends` | what a distance is between |
//! | `contact` | gaps and forces of contacts, stops, dry friction |
//! | `effort` | springs, dampers, motors, prescribed motions |
//! | `power` | what these and loads put into the system |
//! | `work` | the same since the start |
//! | `section` | section forces and strains of beams |

mod attitude;
mod columns;
mod contact;
mod effort;
mod ends;
mod finder;
mod gauge;
mod observer;
mod power;
mod section;
mod view;
mod work;

pub(crate) use attitude::{Attitude, sign};
pub use columns::{REACTION, SensorColumn, UNIQUE, columns};
pub(crate) use columns::{columns_of, columns_of_signal, parts_of_signal};
pub(crate) use contact::{Signs, signed};
pub(crate) use effort::EffortSensor;
pub(crate) use ends::{ends_of, line_of};
pub(crate) use section::{PlaceChange, SectionGauge};
pub(crate) use view::{View, Works};

use crate::dynamics::Dynamics;
use crate::run::run_state::same_length;
use crate::stepper::WantedOfNode;
use crate::system::beams::Beams;
use crate::system::contact_origin::ContactOrigin;
use crate::system::names::Names;
use crate::system::signal::output::{SignalGauge, SignalNetwork};
use finder::Finder;
use gauge::Gauge;
use holonom_model::expression::ExpressionProgram;
use holonom_model::{Model, NodeReading, Observed, Quantities, Sensor, SensorKind, SensorPart};
use std::ops::Range;
use vi_constraints::integrator::ResumeError;
use vi_constraints::saddle_point::IndependentRows;
use vi_core::Configuration;
use vi_multibody::builder::ForceElements;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::reaction::ReactionObserver;

/// An expression of other numbers of a node.
#[derive(Debug)]
struct ExpressionGauge {
    program: ExpressionProgram,
    place: usize,      // of its number
    reads: Vec<usize>, // numbers, in the order of its inputs after the time
}

/// The part that a sensor is of.
#[derive(Debug)]
struct MeasuredPart {
    name: String,
    columns: Range<usize>,
    idle: bool, // whether it is gone, or does not act
}

/// The sensors of a model, ready to read.
#[derive(Debug, Default)]
pub struct Sensors {
    columns: Vec<SensorColumn>,
    hidden: Vec<SensorColumn>, // of what expressions read, after these
    expressions: Vec<ExpressionGauge>,
    inputs: Vec<f64>, // of an expression, scratch
    gauges: Vec<Gauge>,
    of: Vec<MeasuredPart>,              // of each gauge
    observer: Option<ReactionObserver>, // where sensors ask for reactions
    accelerations: bool,                // whether any asks for them
    contacts: bool,                     // likewise
    signals: Option<SignalGauge>,
}

impl Sensors {
    /// For a valid model and its mechanism.
    pub(crate) fn new(
        (names, sensors): (&Names<'_>, &[Sensor]),
        mechanism: &Mechanism,
        dynamics: &Dynamics,
        (beams, signals): (&Beams, Option<SignalNetwork>),
        contacts: &[ContactOrigin],
    ) -> Self {
        let model = names.model;
        let finder = Finder::new(names, mechanism, dynamics, beams, contacts);
        let (mut gauges, mut of) = (Vec::new(), Vec::new());
        let mut columns: Vec<SensorColumn> =
            model.signals.iter().flat_map(columns_of_signal).collect();
        let mut expressions = Vec::new();
        let mut add = |sensor: &Sensor, columns: &mut Vec<SensorColumn>| {
            let Some(gauge) = Gauge::of(sensor, &finder) else { return };
            let first = columns.len();
            columns.extend(columns_of(model, sensor));
            let columns = first..columns.len();
            gauges.push(gauge);
            of.push(MeasuredPart { name: sensor.of.clone(), columns, idle: false });
        };
        for sensor in sensors {
            if let Some(found) = observed(model, sensor) {
                expressions.push((columns.len(), found));
            }
            add(sensor, &mut columns);
        }
        let visible = columns.len();
        let expressions: Vec<ExpressionGauge> = expressions
            .into_iter()
            .map(|(place, Observed { program, readings })| {
                let read = |reading: NodeReading| match reading {
                    NodeReading::Signal(name) => columns.iter().position(|own| own.name() == name),
                    NodeReading::Sensor(sensor, part) => {
                        let known = |own: &SensorColumn| own.sensor == sensor.name;
                        if !columns.iter().any(known) {
                            add(&sensor, &mut columns);
                        }
                        let first = columns.iter().position(known)?;
                        let own = columns[first..].iter().take_while(|own| known(own));
                        match part {
                            SensorPart::Number(k) => Some(first + k),
                            SensorPart::Heading(part) => {
                                own.into_iter().position(|own| own.part == part).map(|k| first + k)
                            }
                        }
                    }
                };
                let reads = readings.into_iter().map(read).map(|k| k.unwrap_or(usize::MAX));
                ExpressionGauge { program, place, reads: reads.collect() }
            })
            .collect();
        let hidden = columns.split_off(visible);
        let reactions = gauges.iter().any(Gauge::needs_force);
        let accelerations = gauges.iter().any(Gauge::needs_acceleration);
        let contacts = gauges.iter().any(Gauge::needs_contacts);
        let observer = reactions.then(|| ReactionObserver::new(mechanism));
        let signals = signals.zip(dynamics.forces.signals.clone());
        let signals = signals.map(|(own, states)| SignalGauge::new(own, states));
        let inputs = Vec::new();
        Self {
            columns,
            hidden,
            expressions,
            inputs,
            gauges,
            of,
            observer,
            accelerations,
            contacts,
            signals,
        }
    }

    /// What reads the signals of the model; `None` without any.
    pub(crate) fn signal_gauge(&self) -> Option<&SignalGauge> {
        self.signals.as_ref()
    }

    /// The columns of `sensors.csv`; empty without sensors.
    #[must_use]
    pub fn columns(&self) -> &[SensorColumn] {
        &self.columns
    }

    /// The gauge of a sensor that reads the configuration of a node alone; `None` of others.
    pub(crate) fn of_configuration(&self, name: &str) -> Option<usize> {
        let own = |part: &MeasuredPart| {
            self.columns.get(part.columns.start).is_some_and(|column| column.sensor == name)
        };
        self.of.iter().position(own).filter(|k| self.gauges[*k].is_of_configuration())
    }

    /// The gauge of a sensor by its name, also of one that an expression alone reads.
    fn gauge(&self, name: &str) -> Option<&Gauge> {
        let mut columns = self.columns.iter().chain(&self.hidden);
        let first = columns.position(|column| column.sensor == name)?;
        let own = self.of.iter().position(|part| part.columns.start == first)?;
        self.gauges.get(own)
    }

    /// What acts on a joint, between points or by a law, whose effort or power a sensor reads.
    pub(crate) fn effort(&self, name: &str) -> Option<&EffortSensor> {
        match self.gauge(name)? {
            Gauge::Effort(effort) => Some(effort),
            Gauge::Power(power) => power.effort(),
            _ => None,
        }
    }

    /// The orientation that a sensor reads.
    pub(crate) fn attitude(&self, name: &str) -> Option<&Attitude> {
        match self.gauge(name)? {
            Gauge::Orientation(attitude, _) => Some(attitude),
            _ => None,
        }
    }

    /// The section of a beam that a sensor reads.
    pub(crate) fn section(&self, name: &str) -> Option<&SectionGauge> {
        match self.gauge(name)? {
            Gauge::Section(section) => Some(section),
            _ => None,
        }
    }

    /// Whether nothing but the configuration of a node is read.
    pub(crate) fn are_of_configurations(&self) -> bool {
        self.signals.is_none() && self.gauges.iter().all(Gauge::is_of_configuration)
    }

    /// Adds the numbers of such a gauge at the configuration `q` that was last followed to.
    pub(crate) fn read_configuration(&self, gauge: usize, t: f64, q: &[f64], out: &mut Vec<f64>) {
        let none = &[][..];
        let (angles, signals, v, a, force, slips) = (none, none, none, none, none, none);
        let view = View { t, q, angles, signals, v, a, force, works: None, slips, contacts: None };
        self.gauges[gauge].read(&view, None, out);
    }

    /// The numbers that only events change: signals with `start` alone, and where each is held
    /// among the internal variables of signals ([`vi_core::SeparableSystem::places_of_signals`]).
    #[must_use]
    pub fn numbers(&self) -> &[(String, usize)] {
        self.signals.as_ref().map_or(&[], SignalGauge::numbers)
    }

    /// What signals read as it was at the node before: the column, and where its number is held
    /// among the internal variables of signals.
    pub(crate) fn measured(&self) -> Vec<(usize, usize)> {
        let all = self.signals.iter().flat_map(SignalGauge::measured);
        let place = |name: &str| self.columns.iter().position(|column| column.name() == name);
        all.filter_map(|(name, held)| Some((place(name)?, *held))).collect()
    }

    /// The columns that signals read as they were at the node before, which a run measures.
    pub fn read_by_signals(&self) -> impl Iterator<Item = &str> {
        let all = self.signals.iter().flat_map(SignalGauge::measured);
        all.map(|(name, _)| name.as_str())
    }

    /// What is needed of a node.
    pub(crate) fn wanted(&self) -> WantedOfNode {
        WantedOfNode {
            forces: self.observer.is_some(),
            accelerations: self.accelerations,
            contacts: self.contacts,
            works: self.gauges.iter().any(|gauge| matches!(gauge, Gauge::Work(_))),
        }
    }

    /// Reads signals as these sensors do, which are of the mechanism in force.
    pub(crate) fn read_signals_as(&mut self, other: &Self) {
        self.signals.clone_from(&other.signals);
    }

    /// Goes on with another mechanism of the same members; `idle(name, part)`: what is gone or does
    /// not act.
    pub(crate) fn act_by(
        &mut self,
        mechanism: &Mechanism,
        forces: &ForceElements,
        idle: &dyn Fn(&str, &str) -> bool,
    ) {
        for (gauge, of) in self.gauges.iter_mut().zip(&mut self.of) {
            of.idle = gauge.act_by(&of.name, mechanism, forces, idle);
        }
        if let Some(observer) = &mut self.observer {
            *observer = ReactionObserver::new(mechanism);
        }
    }

    /// Begins to count at the configuration `q`.
    pub(crate) fn begin(&mut self, q: &[f64]) {
        self.gauges.iter_mut().for_each(|gauge| gauge.begin(q));
    }

    /// Goes on to the next step; allocates nothing.
    pub(crate) fn follow(&mut self, q: &[f64]) {
        self.gauges.iter_mut().for_each(|gauge| gauge.follow(q));
    }

    /// What is followed, of each sensor.
    pub(crate) fn state(&self) -> Vec<Vec<f64>> {
        self.gauges.iter().map(Gauge::state).collect()
    }

    /// Whether what was followed is of these sensors.
    ///
    /// # Errors
    /// [`ResumeError::Shape`].
    pub(crate) fn check(&self, state: &[Vec<f64>]) -> Result<(), ResumeError> {
        let own = self.state();
        same_length("the list of sensors", state.len(), own.len())?;
        for (own, found) in own.iter().zip(state) {
            same_length("a sensor", found.len(), own.len())?;
        }
        Ok(())
    }

    /// Continues from what was followed. Premise: [`Sensors::check`].
    pub(crate) fn resume(&mut self, state: &[Vec<f64>]) {
        self.gauges.iter_mut().zip(state).for_each(|(gauge, values)| gauge.resume(values));
    }

    /// `values ←` the numbers of all columns at the node last followed to; NaN where a reaction is
    /// not unique.
    pub(crate) fn read(
        &mut self,
        mechanism: &Mechanism,
        rows: &IndependentRows,
        at: View<'_>,
        values: &mut Vec<f64>,
    ) {
        let node = Configuration::new(at.t, at.q);
        let observer = self.observer.as_mut();
        let reactions = observer.map(|all| all.observe(mechanism, node, at.force, rows));
        values.clear();
        if let Some(signals) = &self.signals {
            signals.read(at.motion(), values);
        }
        for (gauge, of) in self.gauges.iter().zip(&self.of) {
            if of.idle {
                let all = self.columns.iter().chain(&self.hidden);
                let own = all.skip(of.columns.start).take(of.columns.len());
                values.extend(own.map(|column| f64::from(u8::from(column.is_flag()))));
            } else {
                gauge.read(&at, reactions.as_ref(), values);
            }
        }
        for ExpressionGauge { program, place, reads } in &self.expressions {
            self.inputs.clear();
            self.inputs.push(at.t);
            let read = |k: &usize| values.get(*k).copied().unwrap_or(f64::NAN);
            self.inputs.extend(reads.iter().map(read));
            values[*place] = program.value(&self.inputs).unwrap_or(f64::NAN);
        }
        values.truncate(self.columns.len());
    }
}

/// The expression of a sensor; `None` of others.
pub(crate) fn observed(model: &Model, sensor: &Sensor) -> Option<Observed> {
    let value = sensor.value.as_ref().filter(|_| sensor.kind == SensorKind::Expression)?;
    Observed::expression(&value.0, model, &Quantities::new(model)).ok()
}
