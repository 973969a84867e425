//! The numbers of a sensor at a node.

use super::attitude::Attitude;
use super::contact::ContactGauge;
use super::effort::EffortSensor;
use super::finder::Finder;
use super::observer::Observer;
use super::power::Power;
use super::section::SectionGauge;
use super::view::View;
use super::work::WorkOfParts;
use crate::system::contact_gaps::clearance;
use holonom_model::{ReactionFrame, Sensor, SensorKind};
use nalgebra::{Matrix3, Quaternion, Vector3};
use vi_multibody::builder::ForceElements;
use vi_multibody::design::CoordinateAcceleration;
use vi_multibody::form::Form;
use vi_multibody::joint::Joint;
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_multibody::joint_motion::{JointMotion, joint_accelerations, joint_rates};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::reaction::NodeReactions;
use vi_multibody::scalar_constraint::ScalarRow;
use vi_rigid::directors;

/// What a sensor needs to know of the mechanism.
#[derive(Clone, Debug)]
pub(super) enum Gauge {
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
    Effort(EffortSensor),
    Power(Power),
    Work(WorkOfParts),
    Section(SectionGauge),
}

/// What an inertial measurement unit is made of.
#[derive(Clone, Debug)]
pub(super) struct InertialUnit {
    point: Form,
    own: Observer,
    axes: Matrix3<f64>, // its own along those of the body
    first: usize,       // coordinate of its frame
    gravity: Vector3<f64>,
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

impl Gauge {
    /// `None` only when the model is not valid.
    pub(super) fn of(sensor: &Sensor, from: &Finder<'_>) -> Option<Self> {
        let of = sensor.of.as_str();
        let joint = || from.joint(of).map(|k| from.mechanism.description().joints[k].clone());
        Some(match sensor.kind {
            SensorKind::Position => match (from.point(sensor)?, from.observer(sensor)) {
                ((point, _), Some(observer)) => Self::SeenPosition(point, observer),
                ((point, axes), None) => Self::Position(point, axes),
            },
            SensorKind::Velocity => match (from.point(sensor)?, from.observer(sensor)) {
                ((point, _), Some(observer)) => Self::SeenVelocity(point, observer),
                ((point, axes), None) => Self::Velocity(point, axes),
            },
            SensorKind::Acceleration => {
                from.point(sensor).map(|(p, axes)| Self::Acceleration(p, axes))?
            }
            SensorKind::Orientation => {
                let (own, seen_from) = (from.frame_of(of)?, from.observer(sensor));
                Self::Orientation(Attitude { own, seen_from }, Quaternion::identity())
            }
            SensorKind::AngularVelocity => {
                Self::AngularVelocity(12 * from.names.index(of)?, from.observer(sensor))
            }
            SensorKind::AngularAcceleration => {
                Self::AngularAcceleration(12 * from.names.index(of)?)
            }
            SensorKind::Imu => {
                let (point, _) = from.point(sensor)?;
                let gravity = from.mechanism.description().gravity;
                let first = 12 * from.names.index(of)?;
                Self::Imu(Box::new(InertialUnit {
                    point,
                    own: from.frame_of(of)?,
                    axes: sensor.axes(),
                    first,
                    gravity,
                }))
            }
            SensorKind::Expression => Self::Expression,
            SensorKind::Distance => Self::Distance(from.between(sensor)?),
            SensorKind::DistanceRate => Self::DistanceRate(from.between(sensor)?),
            SensorKind::JointCoordinate => Self::Coordinate(JointMotion::new(joint()?, &from.q)),
            SensorKind::JointRate => Self::Rate(joint()?),
            SensorKind::JointAcceleration => {
                let joint = joint()?;
                let freedoms = 0..joint.kind.dof();
                let own = freedoms.filter_map(|k| JointCoordinate::principal(&joint, k));
                let own = own.map(|own| CoordinateAcceleration::of(&own)).collect();
                Self::JointAcceleration(joint, own)
            }
            SensorKind::SectionForce | SensorKind::Strain => {
                Self::Section(SectionGauge::of(sensor, from)?)
            }
            SensorKind::Reaction => match from.names.model.bars.iter().position(|b| b.name == of) {
                Some(bar) => Self::Tension(bar),
                None => match from.joint(of) {
                    Some(joint) => Self::Reaction(joint, sensor.frame.unwrap_or_default()),
                    None => Self::Held(from.scalar(of)?),
                },
            },
            SensorKind::Slip if from.names.model.contact(of).is_some() => {
                Self::Contact(ContactGauge::slip(from.contacts, of))
            }
            SensorKind::Slip => slip_of(from.mechanism, from.scalar(of)?)?,
            SensorKind::Gap => Self::Contact(ContactGauge::gap(from.contacts, of)),
            SensorKind::Clearance => {
                let bodies = [of, sensor.to.as_deref()?];
                Self::Contact(ContactGauge::Gap(clearance(bodies, from.names)?))
            }
            SensorKind::ContactForce => {
                let of = from.names.model.member_name(of);
                Self::Contact(ContactGauge::force(from.contacts, &of))
            }
            SensorKind::StopForce => Self::Contact(ContactGauge::joint(from.contacts, of, true)?),
            SensorKind::FrictionTorque => {
                Self::Contact(ContactGauge::joint(from.contacts, of, false)?)
            }
            SensorKind::Effort => Self::Effort(EffortSensor::of(of, from)?),
            SensorKind::Power => Self::Power(Power::of(of, from)?),
            SensorKind::Work => Self::Work(WorkOfParts::of(of, from)?),
        })
    }

    /// Whether it reads the configuration of a node alone.
    pub(super) fn is_of_configuration(&self) -> bool {
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

    /// Whether it asks for the reactions of a node.
    pub(super) fn needs_force(&self) -> bool {
        match self {
            Self::Reaction(..) | Self::Tension(_) | Self::Held(_) => true,
            Self::Effort(effort) => effort.needs_force(),
            Self::Power(power) => power.needs_force(),
            _ => false,
        }
    }

    /// Whether it asks for its accelerations.
    pub(super) fn needs_acceleration(&self) -> bool {
        match self {
            Self::Acceleration(..)
            | Self::Imu(_)
            | Self::AngularAcceleration(_)
            | Self::JointAcceleration(..) => true,
            Self::Section(section) => section.needs_acceleration(),
            _ => false,
        }
    }

    /// Whether it asks for the contacts of the step from it.
    pub(super) fn needs_contacts(&self) -> bool {
        matches!(self, Self::Contact(contact) if contact.needs_step())
    }

    /// Goes on with another mechanism of the same members; returns whether what it reads, of this
    /// name, is gone or does not act.
    pub(super) fn act_by(
        &mut self,
        name: &str,
        mechanism: &Mechanism,
        forces: &ForceElements,
        idle: &dyn Fn(&str, &str) -> bool,
    ) -> bool {
        let description = mechanism.description();
        let joint = || description.joints.iter().position(|joint| joint.name == name);
        let bar = || description.bars.iter().position(|bar| bar.name == name);
        let scalar = || description.scalars.iter().position(|own| own.name == name);
        match self {
            Self::Slip(_) | Self::BladeSlip(_) => {
                let next = scalar().and_then(|k| slip_of(mechanism, k));
                next.map(|own| *self = own).is_none()
            }
            Self::Reaction(k, _) => joint().map(|own| *k = own).is_none(),
            Self::Tension(k) => bar().map(|own| *k = own).is_none(),
            Self::Effort(effort) => effort.act_by(name, mechanism, forces, idle),
            Self::Power(power) => power.act_by(name, mechanism, forces, idle),
            Self::Work(work) => {
                work.act_by(name, idle);
                false // what was done stays
            }
            _ => false,
        }
    }

    /// Begins to count at the configuration `q`.
    pub(super) fn begin(&mut self, q: &[f64]) {
        match self {
            Self::Coordinate(tracker) => *tracker = JointMotion::new(tracker.joint().clone(), q),
            Self::Orientation(attitude, last) => {
                *last = attitude.next(q, &Quaternion::identity()); // w ≥ 0
            }
            Self::Effort(effort) => effort.begin(q),
            Self::Power(power) => power.effort_mut().into_iter().for_each(|e| e.begin(q)),
            Self::Work(work) => work.begin(q),
            _ => {}
        }
    }

    /// Goes on to the next step; allocates nothing.
    pub(super) fn follow(&mut self, q: &[f64]) {
        match self {
            Self::Coordinate(tracker) => tracker.follow(q),
            Self::Orientation(attitude, last) => *last = attitude.next(q, last),
            Self::Effort(effort) => effort.follow(q),
            Self::Power(power) => power.effort_mut().into_iter().for_each(|e| e.follow(q)),
            Self::Work(work) => work.follow(q),
            _ => {}
        }
    }

    /// What is followed.
    pub(super) fn state(&self) -> Vec<f64> {
        match self {
            Self::Coordinate(tracker) => tracker.values().to_vec(),
            Self::Orientation(_, last) => last.coords.as_slice().to_vec(),
            Self::Effort(effort) => effort.followed().to_vec(),
            Self::Power(power) => power.effort().map_or(Vec::new(), |e| e.followed().to_vec()),
            Self::Work(work) => work.state(),
            _ => Vec::new(),
        }
    }

    /// Continues from what was followed, of the same length.
    pub(super) fn resume(&mut self, values: &[f64]) {
        match self {
            Self::Coordinate(tracker) => tracker.resume(values),
            Self::Orientation(_, last) => last.coords.as_mut_slice().copy_from_slice(values),
            Self::Effort(effort) => effort.resume(values),
            Self::Power(power) => power.effort_mut().into_iter().for_each(|e| e.resume(values)),
            Self::Work(work) => work.resume(values),
            _ => {}
        }
    }

    /// Adds its numbers at a node.
    pub(super) fn read(
        &self,
        at: &View<'_>,
        reactions: Option<&NodeReactions<'_>>,
        out: &mut Vec<f64>,
    ) {
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
            Self::DistanceRate(between) => out.push(at.length_rate(between)),
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
