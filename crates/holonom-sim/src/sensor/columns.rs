//! Columns of `sensors.csv`: names, quantities and units.

use std::collections::{BTreeMap, BTreeSet};

use crate::output::columns::{self as output, POSITION_NAMES, SECTION, STRAINS};
use crate::system::joint_drive::joint_parts as driven_parts;
use holonom_model::{Constraint, Joint, Law, Model, Sensor, SensorKind, Signal, VelocityTerm};
use vi_multibody::pair::PairKind;

/// The part of a sensor that is 1 where its numbers are unique, else 0.
pub const UNIQUE: &str = "unique";
/// The parts of a reaction: force and moment.
pub const REACTION: [&str; 6] = ["fx", "fy", "fz", "mx", "my", "mz"];

/// A column of `sensors.csv`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SensorColumn {
    /// Name of the sensor.
    pub sensor: String,
    /// Which of its numbers; empty when there is only one.
    pub part: String,
    /// What it is: columns of one sensor with the same quantity belong in one chart; empty for
    /// flags.
    pub quantity: &'static str,
    /// Its unit; empty when it has none.
    pub unit: &'static str,
}

impl SensorColumn {
    /// Its name in the header: `NAME.part`, or `NAME`.
    #[must_use]
    pub fn name(&self) -> String {
        if self.part.is_empty() {
            return self.sensor.clone();
        }
        format!("{}.{}", self.sensor, self.part)
    }

    /// Whether it holds 0 or 1: no or yes.
    #[must_use]
    pub fn is_flag(&self) -> bool {
        self.quantity.is_empty()
    }
}

/// The numbers of a signal, the value first: of a controller the error `e`, the output `u` before
/// its limits, the integral `i` and the filtered error `d`.
pub(crate) fn parts_of_signal(signal: &Signal) -> Vec<&'static str> {
    let Some(pid) = &signal.pid else { return vec![""] };
    let sampled = signal.every.is_some();
    let stated = [
        ("", true),
        ("e", true),
        ("u", !sampled),
        ("i", sampled || pid.integral != 0.0),
        ("d", sampled || pid.derivative != 0.0),
    ];
    stated.into_iter().filter_map(|(part, stated)| stated.then_some(part)).collect()
}

/// The columns of all signals and sensors of a model, in order.
#[must_use]
pub fn columns(model: &Model) -> Vec<SensorColumn> {
    let members = SensedParts::of(model);
    let signals = model.signals.iter().flat_map(columns_of_signal);
    signals.chain(model.sensors.iter().flat_map(|sensor| members.columns(sensor))).collect()
}

/// The columns of a signal.
pub(crate) fn columns_of_signal(signal: &Signal) -> impl Iterator<Item = SensorColumn> {
    parts_of_signal(signal).into_iter().map(|part| SensorColumn {
        sensor: signal.name.clone(),
        part: part.to_owned(),
        quantity: "signal",
        unit: "",
    })
}

/// The columns of a sensor of a model.
pub(crate) fn columns_of(model: &Model, sensor: &Sensor) -> Vec<SensorColumn> {
    SensedParts::of(model).columns(sensor)
}

/// Part, quantity and unit of a number.
type NumberLabel = (String, &'static str, &'static str);

/// What sensors are of, by name.
struct SensedParts<'a> {
    dimension: usize,
    particles: BTreeSet<&'a str>,
    bars: BTreeSet<&'a str>,
    joints: BTreeMap<&'a str, &'a Joint>,
    constraints: BTreeMap<&'a str, &'a Constraint>,
    bushings: BTreeSet<&'a str>,
    laws: BTreeMap<&'a str, &'a Law>,
}

impl<'a> SensedParts<'a> {
    fn of(model: &'a Model) -> Self {
        Self {
            dimension: model.header.dimension,
            particles: model.particles.iter().map(|particle| particle.name.as_str()).collect(),
            bars: model.bars.iter().map(|bar| bar.name.as_str()).collect(),
            joints: model.joints.iter().map(|joint| (joint.name.as_str(), joint)).collect(),
            constraints: model.constraints.iter().map(|c| (c.name(), c)).collect(),
            bushings: model.bushings.iter().map(|own| own.name.as_str()).collect(),
            laws: model.laws.iter().map(|law| (law.name.as_str(), law)).collect(),
        }
    }

    fn columns(&self, sensor: &Sensor) -> Vec<SensorColumn> {
        let column = |(part, quantity, unit)| SensorColumn {
            sensor: sensor.name.clone(),
            part,
            quantity,
            unit,
        };
        self.parts(sensor).into_iter().map(column).collect()
    }

    /// Part, quantity and unit of each number of a sensor.
    fn parts(&self, sensor: &Sensor) -> Vec<NumberLabel> {
        let of = sensor.of.as_str();
        let named = |names: &[&str], quantity, unit| -> Vec<NumberLabel> {
            names.iter().map(|name| ((*name).to_owned(), quantity, unit)).collect()
        };
        let planar = self.particles.contains(of) && sensor.seen_from.is_none();
        let axes = if planar { self.dimension } else { 3 };
        let axes = &POSITION_NAMES[..axes];
        let section = |columns: &[output::OutputColumn]| -> Vec<NumberLabel> {
            columns.iter().map(|own| (own.name.to_owned(), own.quantity, own.unit)).collect()
        };
        let pair = self.joints.get(of).map(|joint| joint.pair());
        match sensor.kind {
            SensorKind::Position => named(axes, "position", "m"),
            SensorKind::Velocity => named(axes, "velocity", "m/s"),
            SensorKind::Acceleration => named(axes, "acceleration", "m/s²"),
            SensorKind::Orientation => named(&["w", "x", "y", "z"], "quaternion", ""),
            SensorKind::AngularVelocity => named(axes, "angular velocity", "rad/s"),
            SensorKind::AngularAcceleration => named(axes, "angular acceleration", "rad/s²"),
            SensorKind::Imu => {
                let mut parts = named(&["ax", "ay", "az"], "acceleration", "m/s²");
                parts.extend(named(&["gx", "gy", "gz"], "angular velocity", "rad/s"));
                parts
            }
            SensorKind::Expression => named(&[""], "expression", ""),
            SensorKind::Distance => named(&[""], "distance", "m"),
            SensorKind::DistanceRate => named(&[""], "speed", "m/s"),
            SensorKind::JointCoordinate => {
                joint_parts(pair, ["angle", "rad"], ["displacement", "m"])
            }
            SensorKind::JointRate => joint_parts(pair, ["angular rate", "rad/s"], ["speed", "m/s"]),
            SensorKind::JointAcceleration => {
                joint_parts(pair, ["angular acceleration", "rad/s²"], ["acceleration", "m/s²"])
            }
            SensorKind::Reaction => {
                let mut parts = if self.bars.contains(of) {
                    named(&["tension"], "tension", "N")
                } else if self.constraints.get(of).is_some_and(|c| c.carries_a_body()) {
                    named(&REACTION[..3], "force", "N")
                } else {
                    let mut parts = named(&REACTION[..3], "force", "N");
                    parts.extend(named(&REACTION[3..], "moment", "N·m"));
                    parts
                };
                parts.extend(named(&[UNIQUE], "", ""));
                parts
            }
            SensorKind::Slip => match self.constraints.get(of) {
                Some(Constraint::Rolling { .. }) => named(&POSITION_NAMES, "slip", "m/s"),
                Some(Constraint::Velocity { terms, .. }) => {
                    let angle = self.unit_of_term(terms.first()) == "N·m";
                    named(&[""], "slip", if angle { "rad/s" } else { "m/s" })
                }
                _ => named(&[""], "slip", "m/s"),
            },
            SensorKind::Gap => named(&[""], "gap", "m"),
            SensorKind::Clearance => named(&[""], "clearance", "m"),
            SensorKind::ContactForce => named(&REACTION[..3], "force", "N"),
            SensorKind::StopForce | SensorKind::FrictionTorque => {
                let joint = self.joints.get(of);
                let freedom = joint.and_then(|joint| match sensor.kind {
                    SensorKind::StopForce => joint.stops().map(|own| own.freedom),
                    _ => joint.friction.map(|own| own.freedom),
                });
                let angle = joint.zip(freedom).is_none_or(|(own, k)| own.pair().is_angle(k));
                if angle { named(&[""], "torque", "N·m") } else { named(&[""], "force", "N") }
            }
            SensorKind::Effort => self.effort_parts(of),
            SensorKind::Power => named(&self.acting_parts(of), "power", "W"),
            SensorKind::Work => named(&self.acting_parts(of), "work", "J"),
            SensorKind::SectionForce => section(&SECTION[STRAINS.len()..]),
            SensorKind::Strain => section(&SECTION[..STRAINS.len()]),
        }
    }

    /// What does work: the parts that act on a joint, or the whole.
    fn acting_parts(&self, of: &str) -> Vec<&'static str> {
        let Some(joint) = self.joints.get(of) else { return vec![""] };
        let driven = driven_parts(joint);
        PARTS.into_iter().filter(|part| driven.iter().any(|(own, _)| own == part)).collect()
    }

    /// The unit of the effort along a term of a sum of rates.
    fn unit_of_term(&self, term: Option<&VelocityTerm>) -> &'static str {
        let joint = term.and_then(|term| Some((self.joints.get(term.joint.as_deref()?)?, term)));
        match joint {
            Some((joint, term)) if joint.pair().is_angle(term.freedom) => "N·m",
            _ => "N",
        }
    }

    /// Part, quantity and unit of each number of an effort.
    fn effort_parts(&self, of: &str) -> Vec<NumberLabel> {
        let quantity = |unit| if unit == "N" { "force" } else { "torque" };
        let along = |pair, freedom: usize| {
            let parts = joint_parts(Some(pair), ["", "N·m"], ["", "N"]);
            parts.get(freedom).map_or("N·m", |part| part.2)
        };
        let row = |unit| vec![("effort".to_owned(), quantity(unit), unit), (UNIQUE.into(), "", "")];
        let joint = |name: &str| self.joints.get(name).copied();
        if let Some(joint) = joint(of) {
            let driven = driven_parts(joint);
            let part = |part: &'static str| {
                let (_, freedom) = driven.iter().find(|(own, _)| *own == part)?;
                let unit = along(joint.pair(), *freedom);
                Some((part.to_owned(), quantity(unit), unit))
            };
            return PARTS.into_iter().filter_map(part).collect();
        }
        match self.constraints.get(of) {
            Some(Constraint::Motion { joint: name, freedom, .. }) => {
                row(joint(name).map_or("N·m", |joint| along(joint.pair(), *freedom)))
            }
            Some(Constraint::Gear { joints: [name, _], freedoms, .. }) => {
                row(joint(name).map_or("N·m", |joint| along(joint.pair(), freedoms[0])))
            }
            Some(Constraint::Velocity { terms, .. }) => row(self.unit_of_term(terms.first())),
            Some(_) => row("N"),
            None if self.bushings.contains(of) => {
                let parts = |names: &[&str], quantity, unit| {
                    names
                        .iter()
                        .map(|n| ((*n).to_owned(), quantity, unit))
                        .collect::<Vec<NumberLabel>>()
                };
                let forces = parts(&REACTION[..3], "force", "N");
                [forces, parts(&REACTION[3..], "torque", "N·m")].concat()
            }
            None => match self.laws.get(of) {
                Some(law) => self.law_parts(law),
                None => vec![(String::new(), "force", "N")],
            },
        }
    }

    /// Part, quantity and unit of each number that a law states.
    fn law_parts(&self, law: &Law) -> Vec<NumberLabel> {
        let parts = |names: &[&str], quantity, unit| -> Vec<NumberLabel> {
            names.iter().map(|name| ((*name).to_owned(), quantity, unit)).collect()
        };
        if let Some(on) = law.on.as_deref() {
            if self.particles.contains(on) {
                return parts(&REACTION[..self.dimension], "force", "N");
            }
            let forces = parts(&REACTION[..3], "force", "N");
            return [forces, parts(&REACTION[3..], "torque", "N·m")].concat();
        }
        let joint = law.joint.as_deref().and_then(|name| self.joints.get(name));
        match joint.is_some_and(|joint| joint.pair().is_angle(law.freedom)) {
            true => parts(&[""], "torque", "N·m"),
            false => parts(&[""], "force", "N"),
        }
    }
}

/// `x, y, z` for rotation vectors; `u…` for lengths and `theta…` for angles, numbered when there
/// are several; nothing when there is only one degree of freedom.
fn joint_parts(
    pair: Option<PairKind>,
    angle: [&'static str; 2],
    length: [&'static str; 2],
) -> Vec<NumberLabel> {
    let Some(pair) = pair else { return Vec::new() };
    let freedoms = pair.dof();
    let of_kind = |angle: bool| (0..freedoms).filter(|&k| pair.is_angle(k) == angle).count();
    let part = |k: usize| {
        let is_angle = pair.is_angle(k);
        let [quantity, unit] = if is_angle { angle } else { length };
        let letter = if is_angle { "theta" } else { "u" };
        let number = 1 + (0..k).filter(|&j| pair.is_angle(j) == is_angle).count();
        let name = match (pair.rotation_vector(), of_kind(is_angle)) {
            (Some(first), _) if k >= first => ["x", "y", "z"][k - first].to_owned(),
            _ if freedoms == 1 => String::new(),
            (_, 1) => letter.to_owned(),
            _ => format!("{letter}{number}"),
        };
        (name, quantity, unit)
    };
    (0..freedoms).map(part).collect()
}

/// The parts of the effort of a joint, in the order of their columns.
pub(super) const PARTS: [&str; 5] = ["spring", "damper", "bumper", "friction", "motor"];

#[cfg(test)]
mod tests {
    use super::*;
    use holonom_model::JointKind;

    #[test]
    fn joint_columns_have_names_by_their_freedoms() {
        let names = |kind: JointKind| {
            let parts = joint_parts(Some(kind.pair(None)), ["angle", "rad"], ["displacement", "m"]);
            parts.into_iter().map(|p| format!("{} {}", p.0, p.2)).collect::<Vec<_>>().join(", ")
        };
        assert_eq!(names(JointKind::Revolute), " rad");
        assert_eq!(names(JointKind::Prismatic), " m");
        assert_eq!(names(JointKind::Cylindrical), "u m, theta rad");
        assert_eq!(names(JointKind::Planar), "u1 m, u2 m, theta rad");
        assert_eq!(names(JointKind::Spherical), "x rad, y rad, z rad");
    }
}
