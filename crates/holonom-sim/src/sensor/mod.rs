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
mod observer;
mod power;
mod section;
mod view;
mod work;

pub(crate) use attitude::{Attitude, sign};
pub use columns::{Column, REACTION, UNIQUE, columns};
pub(crate) use columns::{columns_of, columns_of_signal, parts_of_signal};
pub(crate) use contact::{Signs, signed};
pub(crate) use effort::Effort;
pub(crate) use ends::ends_of;
pub(crate) use view::{View, Works};

use contact::ContactGauge;
use observer::Observer;
use power::Power;
pub(crate) use section::SectionGauge;
use work::Work;

use crate::dynamics::Dynamics;
use crate::run::run_state::same_length;
use crate::stepper::Wanted;
use crate::system::beams::Beams;
use crate::system::contact_gaps::clearance;
use crate::system::contact_origin::ContactOrigin;
use crate::system::names::Names;
use crate::system::signal::output::{SignalGauge, SignalNetwork};
use holonom_model::expression::Program;
use holonom_model::{
    GROUND, Model, Observed, Part, Quantities, ReactionFrame, Reading, Sensor, SensorKind, spatial,
};
use nalgebra::{Matrix3, Quaternion, Vector3};
use std::collections::BTreeMap;
use std::ops::Range;
use vi_constraints::integrator::ResumeError;
use vi_constraints::saddle_point::IndependentRows;
use vi_core::Configuration;
use vi_multibody::builder::ForceElements;
use vi_multibody::design::CoordinateAcceleration;
use vi_multibody::form::Form;
use vi_multibody::joint::Joint;
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_multibody::joint_motion::{JointMotion, joint_accelerations, joint_rates};
use vi_multibody::mechanism::{Attachment, Mechanism};
use vi_multibody::reaction::{NodeReactions, ReactionObserver};
use vi_multibody::scalar_constraint::ScalarRow;
use vi_rigid::directors;

/// What a sensor needs to know of the mechanism.
#[derive(Clone, Debug)]
enum Gauge {
    Position(Form, usize),
    Velocity(Form, usize),
    Acceleration(Form, usize),
    SeenPosition(Form, Observer),
    SeenVelocity(Form, Observer),
    Orientation(Attitude, Quaternion<f64>), // with the last one
    AngularVelocity(usize, Option<Observer>), // first coordinate of the frame
    AngularAcceleration(usize),
    Imu(Box<InertialUnit>),
    Expression, // a number that is written when all others are known
    Distance(Form),
    DistanceRate(Form),
    Coordinate(JointMotion),
    Rate(Joint),
    JointAcceleration(Joint, Vec<CoordinateAcceleration>), // of its coordinates, if it has them
    Reaction(usize, ReactionFrame),                        // joint of the description
    Tension(usize),                                        // bar of the description
    Held(usize),                                           // scalar constraint of the description
    Slip(Vec<(usize, Vector3<f64>)>), // of what rolls: rows among those of velocities, directions
    BladeSlip(usize),
    Contact(ContactGauge),
    Effort(Effort),
    Power(Power),
    Work(Work),
    Section(SectionGauge),
}

/// `l̇ = D̂·Ḋ` of the vector between two points, m/s; `|Ḋ|` where they coincide, the rate from
/// there on.
fn length_rate(between: &Form, at: &View<'_>) -> f64 {
    let (d, rate) = (between.at(at.q), between.rate(at.v));
    let length = d.norm();
    if length > 0.0 { d.dot(&rate) / length } else { rate.norm() }
}

/// What an inertial measurement unit is made of.
#[derive(Clone, Debug)]
struct InertialUnit {
    point: Form,
    own: Observer,
    axes: Matrix3<f64>, // its own along those of the body
    first: usize,       // coordinate of its frame
    gravity: Vector3<f64>,
}

/// An expression of other numbers of a node.
#[derive(Debug)]
struct ExpressionGauge {
    program: Program,
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
    columns: Vec<Column>,
    hidden: Vec<Column>, // of what expressions read, after these
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
        let joints = mechanism.description().joints.iter();
        let builder = Builder {
            names,
            mechanism,
            dynamics,
            beams,
            contacts,
            joints: joints.map(|joint| joint.name.as_str()).zip(0..).collect(),
            q: mechanism.initial_configuration(),
        };
        let (mut gauges, mut of) = (Vec::new(), Vec::new());
        let mut columns: Vec<Column> = model.signals.iter().flat_map(columns_of_signal).collect();
        let mut expressions = Vec::new();
        let mut add = |sensor: &Sensor, columns: &mut Vec<Column>| {
            let Some(gauge) = builder.gauge(sensor) else { return };
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
                let read = |reading: Reading| match reading {
                    Reading::Signal(name) => columns.iter().position(|own| own.name() == name),
                    Reading::Sensor(sensor, part) => {
                        let known = |own: &Column| own.sensor == sensor.name;
                        if !columns.iter().any(known) {
                            add(&sensor, &mut columns);
                        }
                        let first = columns.iter().position(known)?;
                        let own = columns[first..].iter().take_while(|own| known(own));
                        match part {
                            Part::Number(k) => Some(first + k),
                            Part::Heading(part) => {
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
        let reactions = gauges.iter().any(|gauge| match gauge {
            Gauge::Reaction(..) | Gauge::Tension(_) | Gauge::Held(_) => true,
            Gauge::Effort(effort) => effort.needs_force(),
            Gauge::Power(power) => power.needs_force(),
            _ => false,
        });
        let accelerations = gauges.iter().any(|gauge| {
            matches!(
                gauge,
                Gauge::Acceleration(..)
                    | Gauge::Imu(_)
                    | Gauge::AngularAcceleration(_)
                    | Gauge::JointAcceleration(..)
            ) || matches!(gauge, Gauge::Section(section) if section.needs_acceleration())
        });
        let contacts =
            gauges.iter().any(|own| matches!(own, Gauge::Contact(own) if own.needs_step()));
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
    pub fn columns(&self) -> &[Column] {
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
    pub(crate) fn effort(&self, name: &str) -> Option<&Effort> {
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
    pub(crate) fn wanted(&self) -> Wanted {
        Wanted {
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
        let description = mechanism.description();
        let joint = |name: &str| description.joints.iter().position(|joint| joint.name == name);
        let bar = |name: &str| description.bars.iter().position(|bar| bar.name == name);
        let scalar = |name: &str| description.scalars.iter().position(|own| own.name == name);
        for (gauge, of) in self.gauges.iter_mut().zip(&mut self.of) {
            of.idle = match gauge {
                Gauge::Slip(_) | Gauge::BladeSlip(_) => {
                    let next = scalar(&of.name).and_then(|k| slip_of(mechanism, k));
                    next.map(|own| *gauge = own).is_none()
                }
                Gauge::Reaction(k, _) => joint(&of.name).map(|own| *k = own).is_none(),
                Gauge::Tension(k) => bar(&of.name).map(|own| *k = own).is_none(),
                Gauge::Effort(effort) => effort.act_by(&of.name, (mechanism, forces), idle),
                Gauge::Power(power) => power.act_by(&of.name, (mechanism, forces), idle),
                Gauge::Work(work) => {
                    work.act_by(&of.name, idle);
                    false // what was done stays
                }
                _ => false,
            };
        }
        if let Some(observer) = &mut self.observer {
            *observer = ReactionObserver::new(mechanism);
        }
    }

    /// Begins to count at the configuration `q`.
    pub(crate) fn begin(&mut self, q: &[f64]) {
        for gauge in &mut self.gauges {
            match gauge {
                Gauge::Coordinate(tracker) => {
                    *tracker = JointMotion::new(tracker.joint().clone(), q);
                }
                Gauge::Orientation(attitude, last) => {
                    *last = attitude.next(q, &Quaternion::identity()); // w ≥ 0
                }
                Gauge::Effort(effort) => effort.begin(q),
                Gauge::Power(power) => power.effort_mut().into_iter().for_each(|e| e.begin(q)),
                Gauge::Work(work) => work.begin(q),
                _ => {}
            }
        }
    }

    /// Goes on to the next step; allocates nothing.
    pub(crate) fn follow(&mut self, q: &[f64]) {
        for gauge in &mut self.gauges {
            match gauge {
                Gauge::Coordinate(tracker) => tracker.follow(q),
                Gauge::Orientation(attitude, last) => *last = attitude.next(q, last),
                Gauge::Effort(effort) => effort.follow(q),
                Gauge::Power(power) => power.effort_mut().into_iter().for_each(|e| e.follow(q)),
                Gauge::Work(work) => work.follow(q),
                _ => {}
            }
        }
    }

    /// What is followed, of each sensor.
    pub(crate) fn state(&self) -> Vec<Vec<f64>> {
        let followed = |gauge: &Gauge| match gauge {
            Gauge::Coordinate(tracker) => tracker.values().to_vec(),
            Gauge::Orientation(_, last) => last.coords.as_slice().to_vec(),
            Gauge::Effort(effort) => effort.followed().to_vec(),
            Gauge::Power(power) => power.effort().map_or(Vec::new(), |e| e.followed().to_vec()),
            Gauge::Work(work) => work.state(),
            _ => Vec::new(),
        };
        self.gauges.iter().map(followed).collect()
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
        for (gauge, values) in self.gauges.iter_mut().zip(state) {
            match gauge {
                Gauge::Coordinate(tracker) => tracker.resume(values),
                Gauge::Orientation(_, last) => {
                    last.coords.as_mut_slice().copy_from_slice(values);
                }
                Gauge::Effort(effort) => effort.resume(values),
                Gauge::Power(power) => {
                    power.effort_mut().into_iter().for_each(|e| e.resume(values));
                }
                Gauge::Work(work) => work.resume(values),
                _ => {}
            }
        }
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
            let View { t, q, angles, signals: internal, v, .. } = at;
            signals.read(Configuration { t, q, angles, internal }, v, values);
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

impl Gauge {
    /// Whether it reads the configuration of a node alone.
    fn is_of_configuration(&self) -> bool {
        matches!(
            self,
            Self::Position(..)
                | Self::SeenPosition(..)
                | Self::Orientation(..)
                | Self::Distance(_)
                | Self::Coordinate(_)
                | Self::Contact(ContactGauge::Gap(_))
        )
    }

    fn read(&self, at: &View<'_>, reactions: Option<&NodeReactions<'_>>, out: &mut Vec<f64>) {
        let frame = |first: usize| (&at.q[first..first + 12], &at.v[first..first + 12]);
        match self {
            Self::Position(point, axes) => out.extend(&point.at(at.q).as_slice()[..*axes]),
            Self::Velocity(point, axes) => out.extend(&point.rate(at.v).as_slice()[..*axes]),
            Self::Acceleration(point, axes) => out.extend(&point.rate(at.a).as_slice()[..*axes]),
            Self::SeenPosition(point, from) => {
                out.extend(&from.position(at.q, point.at(at.q)));
            }
            Self::SeenVelocity(point, from) => {
                out.extend(&from.velocity(at.q, at.v, point.at(at.q), point.rate(at.v)));
            }
            Self::Orientation(_, last) => out.extend([last.w, last.i, last.j, last.k]),
            Self::AngularVelocity(first, from) => {
                let (q, v) = frame(*first);
                let omega = directors::angular_velocity(q, v);
                let seen = from.as_ref().map(|from| from.angular_velocity(at.q, at.v, omega));
                out.extend(&seen.unwrap_or(omega));
            }
            Self::AngularAcceleration(first) => {
                let own = *first..first + 12;
                out.extend(&directors::angular_velocity(&at.q[own.clone()], &at.a[own]));
            }
            Self::Imu(unit) => {
                let InertialUnit { point, own, axes, first, gravity } = &**unit;
                let (q, v) = frame(*first);
                let axes = own.axes(at.q) * axes;
                out.extend(&axes.tr_mul(&(point.rate(at.a) - gravity)));
                out.extend(&axes.tr_mul(&directors::angular_velocity(q, v)));
            }
            Self::Expression => out.push(f64::NAN),
            Self::Distance(between) => out.push(between.at(at.q).norm()),
            Self::DistanceRate(between) => out.push(length_rate(between, at)),
            Self::Coordinate(tracker) => out.extend(tracker.values()),
            Self::Rate(joint) => {
                out.extend(&joint_rates(joint, at.q, at.v)[..joint.kind.dof()]);
            }
            Self::JointAcceleration(joint, own) if own.len() == joint.kind.dof() => {
                out.extend(own.iter().map(|own| own.value([at.q, at.v, at.a])));
            }
            Self::JointAcceleration(joint, _) => {
                let all = joint_accelerations(joint, at.q, at.v, at.a);
                out.extend(&all[..joint.kind.dof()]);
            }
            Self::Reaction(joint, frame) => {
                let Some(reactions) = reactions else { return };
                let reaction = match frame {
                    ReactionFrame::Parent => reactions.joint(*joint),
                    ReactionFrame::Child => reactions.joint_along_child(*joint),
                    ReactionFrame::Space => reactions.joint_along(*joint, &Matrix3::identity()),
                };
                out.extend(reaction.components().map(|c| c.unwrap_or(f64::NAN)));
                out.push(f64::from(u8::from(reaction.is_unique())));
            }
            Self::Tension(bar) => {
                let Some(tension) = reactions.map(|all| all.bar(*bar)) else { return };
                out.push(if tension.unique { tension.force } else { f64::NAN });
                out.push(f64::from(u8::from(tension.unique)));
            }
            Self::Held(scalar) => {
                let Some(reactions) = reactions else { return };
                let (force, unique) = reactions.scalar_force(*scalar);
                out.extend((0..3).map(|k| if unique[k] { force[k] } else { f64::NAN }));
                out.push(f64::from(u8::from(unique == [true; 3])));
            }
            Self::Slip(rows) => {
                let slip = |(row, along): &(usize, Vector3<f64>)| {
                    at.slips.get(*row).copied().unwrap_or(0.0) * along
                };
                out.extend(&rows.iter().map(slip).sum::<Vector3<f64>>());
            }
            Self::BladeSlip(row) => out.push(at.slips.get(*row).copied().unwrap_or(0.0)),
            Self::Contact(contact) => contact.read(at.configuration(), at.contacts, out),
            Self::Effort(effort) => effort.read(at, reactions, out),
            Self::Power(power) => power.read(at, reactions, out),
            Self::Work(work) => work.read(at, out),
            Self::Section(section) => section.read(at, out),
        }
    }
}

/// The expression of a sensor; `None` of others.
pub(crate) fn observed(model: &Model, sensor: &Sensor) -> Option<Observed> {
    let value = sensor.value.as_ref().filter(|_| sensor.kind == SensorKind::Expression)?;
    Observed::expression(&value.0, model, &Quantities::new(model)).ok()
}

/// The slip of what rolls, or of a blade, scalar constraint `k`.
fn slip_of(mechanism: &Mechanism, k: usize) -> Option<Gauge> {
    let own = mechanism.scalar_rows(k);
    let rows = mechanism.velocity_rows().enumerate();
    let places: Vec<usize> =
        rows.filter(|(_, (row, _))| own.contains(row)).map(|(place, _)| place).collect();
    let first = mechanism.description().scalars[k].rows.first()?;
    let ScalarRow::Height(rolling) = first else {
        return places.first().map(|place| Gauge::BladeSlip(*place));
    };
    let along = |(place, i)| (place, rolling.plane.axes.column(i).into_owned());
    Some(Gauge::Slip(places.into_iter().zip(0..2).map(along).collect()))
}

/// Finds what sensors name.
struct Builder<'a> {
    names: &'a Names<'a>,
    mechanism: &'a Mechanism,
    dynamics: &'a Dynamics,
    beams: &'a Beams,
    contacts: &'a [ContactOrigin],
    joints: BTreeMap<&'a str, usize>, // of the description, by name
    q: Vec<f64>,                      // initial configuration
}

impl Builder<'_> {
    /// The joint of this name; what holds a fixed body or the end of a beam has the name of that.
    fn joint(&self, name: &str) -> Option<usize> {
        self.joints.get(name).copied()
    }

    /// The scalar constraint of this name.
    fn scalar(&self, name: &str) -> Option<usize> {
        self.mechanism.description().scalars.iter().position(|own| own.name == name)
    }

    /// A point of a body or node by its own components, of the ground in space, or a particle.
    fn end(&self, name: &str, components: &[f64]) -> Option<Form> {
        let own = Vector3::from(spatial(components));
        if let Some(k) = self.names.index(name) {
            let along_directors = self.names.principal[k].tr_mul(&own);
            return Some(self.mechanism.point_of(Attachment::Body(k), &along_directors));
        }
        if name == GROUND {
            return Some(Form::constant(own));
        }
        let k = self.names.particles.get(name)?.index();
        Some(self.mechanism.point_of(Attachment::Particle(k), &Vector3::zeros()))
    }

    /// The point of a position, velocity or acceleration, and how many components it has.
    fn point(&self, sensor: &Sensor) -> Option<(Form, usize)> {
        let point = self.end(&sensor.of, &sensor.point.unwrap_or_default())?;
        let planar = self.names.particles.contains_key(sensor.of.as_str());
        Some((point, if planar { self.names.model.header.dimension } else { 3 }))
    }

    /// `D` between the ends of a distance.
    fn between(&self, sensor: &Sensor) -> Option<Form> {
        let [(from, a), (to, b)] = ends_of(self.names.model, sensor)?;
        Some(self.end(to, &b)?.minus(&self.end(from, &a)?))
    }

    /// The body that something is seen from.
    fn observer(&self, sensor: &Sensor) -> Option<Observer> {
        self.frame_of(sensor.seen_from.as_deref()?)
    }

    /// The frame of a body or node with its own axes.
    fn frame_of(&self, name: &str) -> Option<Observer> {
        let k = self.names.index(name)?;
        Some(Observer::new(12 * k, &self.names.principal[k]))
    }

    /// `None` only when the model is not valid.
    fn gauge(&self, sensor: &Sensor) -> Option<Gauge> {
        let of = sensor.of.as_str();
        let joint = || self.joint(of).map(|k| self.mechanism.description().joints[k].clone());
        Some(match sensor.kind {
            SensorKind::Position => match (self.point(sensor)?, self.observer(sensor)) {
                ((point, _), Some(observer)) => Gauge::SeenPosition(point, observer),
                ((point, axes), None) => Gauge::Position(point, axes),
            },
            SensorKind::Velocity => match (self.point(sensor)?, self.observer(sensor)) {
                ((point, _), Some(observer)) => Gauge::SeenVelocity(point, observer),
                ((point, axes), None) => Gauge::Velocity(point, axes),
            },
            SensorKind::Acceleration => {
                self.point(sensor).map(|(p, axes)| Gauge::Acceleration(p, axes))?
            }
            SensorKind::Orientation => {
                let (own, seen_from) = (self.frame_of(of)?, self.observer(sensor));
                Gauge::Orientation(Attitude { own, seen_from }, Quaternion::identity())
            }
            SensorKind::AngularVelocity => {
                Gauge::AngularVelocity(12 * self.names.index(of)?, self.observer(sensor))
            }
            SensorKind::AngularAcceleration => {
                Gauge::AngularAcceleration(12 * self.names.index(of)?)
            }
            SensorKind::Imu => {
                let (point, _) = self.point(sensor)?;
                let gravity = self.mechanism.description().gravity;
                let first = 12 * self.names.index(of)?;
                Gauge::Imu(Box::new(InertialUnit {
                    point,
                    own: self.frame_of(of)?,
                    axes: sensor.axes(),
                    first,
                    gravity,
                }))
            }
            SensorKind::Expression => Gauge::Expression,
            SensorKind::Distance => Gauge::Distance(self.between(sensor)?),
            SensorKind::DistanceRate => Gauge::DistanceRate(self.between(sensor)?),
            SensorKind::JointCoordinate => Gauge::Coordinate(JointMotion::new(joint()?, &self.q)),
            SensorKind::JointRate => Gauge::Rate(joint()?),
            SensorKind::JointAcceleration => {
                let joint = joint()?;
                let freedoms = 0..joint.kind.dof();
                let own = freedoms.filter_map(|k| JointCoordinate::principal(&joint, k));
                let own = own.map(|own| CoordinateAcceleration::of(&own)).collect();
                Gauge::JointAcceleration(joint, own)
            }
            SensorKind::SectionForce | SensorKind::Strain => {
                Gauge::Section(SectionGauge::of(sensor, self)?)
            }
            SensorKind::Reaction => match self.names.model.bars.iter().position(|b| b.name == of) {
                Some(bar) => Gauge::Tension(bar),
                None => match self.joint(of) {
                    Some(joint) => Gauge::Reaction(joint, sensor.frame.unwrap_or_default()),
                    None => Gauge::Held(self.scalar(of)?),
                },
            },
            SensorKind::Slip if self.names.model.contact(of).is_some() => {
                Gauge::Contact(ContactGauge::slip(self.contacts, of))
            }
            SensorKind::Slip => slip_of(self.mechanism, self.scalar(of)?)?,
            SensorKind::Gap => Gauge::Contact(ContactGauge::gap(self.contacts, of)),
            SensorKind::Clearance => {
                let bodies = [of, sensor.to.as_deref()?];
                Gauge::Contact(ContactGauge::Gap(clearance(bodies, self.names)?))
            }
            SensorKind::ContactForce => Gauge::Contact(ContactGauge::force(self.contacts, of)),
            SensorKind::StopForce => Gauge::Contact(ContactGauge::joint(self.contacts, of, true)?),
            SensorKind::FrictionTorque => {
                Gauge::Contact(ContactGauge::joint(self.contacts, of, false)?)
            }
            SensorKind::Effort => Gauge::Effort(Effort::of(of, self)?),
            SensorKind::Power => Gauge::Power(Power::of(of, self)?),
            SensorKind::Work => Gauge::Work(Work::of(of, self)?),
        })
    }
}
