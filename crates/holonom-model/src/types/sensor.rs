//! `[[sensor]]`: what is measured along a run and written to `sensors.csv`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::beam::Beam;
use super::connection::Joint;
use super::drive::Constraint;
use crate::checks::Checker;
use crate::{GROUND, JointKind};

/// What a sensor measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SensorKind {
    /// Of a body, at `point`, or of a particle, in space or as `seen_from` another body, m.
    Position,
    /// Of a body, at `point`, or of a particle, in space or as `seen_from` another body, m/s.
    Velocity,
    /// Of a body, at `point`, or of a particle, in space, m/s².
    Acceleration,
    /// Of a body: the quaternion `w, x, y, z` of its own frame, body to space or to the body it is
    /// `seen_from`; its sign does not jump.
    Orientation,
    /// Of a body, spatial components, rad/s; `seen_from` another body the relative one, along the
    /// axes of that.
    AngularVelocity,
    /// Of a body, spatial components, rad/s².
    AngularAcceleration,
    /// Between the `point` of a body or a particle and the point `point_to` of another one, m. Of a
    /// `[[spring]]`, a `[[bar]]` or a distance constraint its length, also as `length`.
    #[serde(alias = "length")]
    Distance,
    /// The rate of a distance, m/s, also as `length_rate`.
    #[serde(alias = "length_rate")]
    DistanceRate,
    /// Of a joint: lengths in m, angles in rad. Angles count on beyond ±π. Of a spherical joint the
    /// rotation vector of the child against the parent, at most π long.
    JointCoordinate,
    /// Of a joint: the rates of its coordinates, m/s and rad/s. Of a spherical joint the angular
    /// velocity of the child relative to the parent.
    JointRate,
    /// Of a joint: the rates of its rates, m/s² and rad/s².
    JointAcceleration,
    /// Of a joint: the force (N) and the moment about the joint's place on the child (N·m) that the
    /// joint exerts on the child, in the joint frame of the parent; of a fixed body the same of
    /// what holds it; of a bar its tension (N).
    Reaction,
    /// What drives or resists a motion, N or N·m: of a joint the efforts of its spring, damper and
    /// motor along its coordinate; of a `[[spring]]` its tension, with its damper; of a
    /// `[[constraint]]` the effort of a prescribed motion, of a gear on its first joint, the
    /// tension of a distance.
    Effort,
    /// What is put into the system in a second, W, negative where it is taken out: of a joint by
    /// its spring, damper and motor; of a `[[spring]]`, with its damper; of a `[[load]]`; of a
    /// `[[constraint]]` by a prescribed motion.
    Power,
    /// Of a beam at `element`: the shear forces `N1, N2` and the normal force `N3`, N, and the
    /// moments about its directors, `M1, M2` bending and `M3` twisting, N·m.
    SectionForce,
    /// Of a beam at `element`: `Gamma1, Gamma2` shear, `Gamma3` extension; `K1, K2` bending, `K3`
    /// twist, 1/m; all measured from the stress-free beam.
    Strain,
}

impl SensorKind {
    /// Whether it is measured at an element of a beam.
    #[must_use]
    pub fn has_element(self) -> bool {
        matches!(self, Self::SectionForce | Self::Strain)
    }

    /// Whether it is the distance of two points or its rate.
    #[must_use]
    pub fn is_distance(self) -> bool {
        matches!(self, Self::Distance | Self::DistanceRate)
    }

    /// Whether it is of a point of a body.
    fn has_point(self) -> bool {
        self.is_distance() || matches!(self, Self::Position | Self::Velocity | Self::Acceleration)
    }

    /// Whether it can be seen from another body.
    fn is_relative(self) -> bool {
        matches!(self, Self::Position | Self::Velocity | Self::Orientation | Self::AngularVelocity)
    }
}

/// The axes along which a reaction is given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReactionFrame {
    /// The joint frame `m_1, m_2, n` of the parent.
    #[default]
    Parent,
    /// The joint frame `m_1', m_2', n'` of the child.
    Child,
    /// The inertial axes x, y, z.
    Space,
}

impl Sensor {
    /// One without any choice.
    #[must_use]
    pub fn new(name: String, kind: SensorKind, of: String) -> Self {
        let (point, seen_from, to, point_to) = (None, None, None, None);
        let (element, at, frame) = (None, None, None);
        Self { name, kind, of, point, seen_from, to, point_to, element, at, frame }
    }
}

/// `[[sensor]]`: a named column, or several, of `sensors.csv`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// Its name, unique in the model.
    pub name: String,
    /// What it measures.
    #[serde(rename = "type")]
    pub kind: SensorKind,
    /// The body, node, particle, joint, bar or beam it is attached to.
    pub of: String,
    /// The point of a body (`position`, `velocity`, `acceleration`, `distance`): body components
    /// from the centre of mass, m; the centre by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point: Option<[f64; 3]>,
    /// The body or node of a beam in whose frame a `position`, `velocity`, `orientation` or
    /// `angular_velocity` is given, as an observer on it sees it; by default space.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seen_from: Option<String>,
    /// The other end of a `distance`: a body, a node of a beam, a particle or the ground.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<String>,
    /// The point at `to`, m: body components from the centre of mass; of the ground in space.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point_to: Option<[f64; 3]>,
    /// The element of a beam, counted along it from 0 (`section_force`, `strain`): at its middle;
    /// the mean of its Gauss points when it has several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub element: Option<usize>,
    /// The place on a beam (`section_force`, `strain`) in the place of `element`: arc length from
    /// its start, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at: Option<f64>,
    /// The axes of the components of a `reaction`: the joint frame of the parent by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<ReactionFrame>,
}

impl Checker<'_> {
    pub(crate) fn sensor(&mut self, key: &str, sensor: &Sensor) {
        let of = format!("{key}.of");
        match sensor.kind {
            SensorKind::Position | SensorKind::Velocity | SensorKind::Acceleration => {
                self.reference(of, &sensor.of, &["body", "particle"]);
            }
            SensorKind::Orientation
            | SensorKind::AngularVelocity
            | SensorKind::AngularAcceleration => {
                self.reference(of, &sensor.of, &["body"]);
            }
            SensorKind::Distance | SensorKind::DistanceRate => self.sensor_distance(key, sensor),
            SensorKind::JointCoordinate | SensorKind::JointRate | SensorKind::JointAcceleration => {
                self.reference(of.clone(), &sensor.of, &["joint"]);
                let joint = self.model.joints.iter().find(|j| j.name == sensor.of);
                if joint.is_some_and(|j| j.kind == JointKind::Fixed) {
                    let message =
                        format!("`{}` is a fixed joint: it has no degree of freedom", sensor.of);
                    self.report(of, message, "measure another joint");
                }
            }
            SensorKind::Reaction if self.points.is_fixed(&sensor.of) => {}
            SensorKind::Reaction if self.model.support(&sensor.of).is_some() => {}
            SensorKind::Reaction => self.reference(of, &sensor.of, &["joint", "bar"]),
            SensorKind::SectionForce | SensorKind::Strain => {
                self.reference(of, &sensor.of, &["beam"]);
            }
            SensorKind::Effort => self.sensor_effort(of, sensor),
            SensorKind::Power => self.sensor_power(of, sensor),
        }
        self.sensor_observer(key, sensor);
        self.sensor_end(key, sensor);
        self.sensor_frame(key, sensor);
        self.sensor_point(key, sensor);
        self.sensor_element(key, sensor);
        self.sensor_place(key, sensor);
    }

    /// A distance between two points, or the length of what has two ends.
    fn sensor_distance(&mut self, key: &str, sensor: &Sensor) {
        let of = format!("{key}.of");
        let kinds = ["body", "particle", "spring", "bar", "constraint"];
        let is_it =
            |c: &Constraint| c.name() == sensor.of && matches!(c, Constraint::Distance { .. });
        if !self.refers(of.clone(), &sensor.of, &kinds) {
            return;
        }
        match self.kinds.get(sensor.of.as_str()).copied() {
            Some("constraint") if !self.model.constraints.iter().any(is_it) => {
                let message = format!("`{}` is no distance: it has no length", sensor.of);
                self.report(of, message, "measure a distance, a spring or a bar");
            }
            Some("spring" | "bar" | "constraint") => {
                for (name, stated) in
                    [("to", sensor.to.is_some()), ("point", sensor.point.is_some())]
                {
                    if stated {
                        let message = format!("`{}` has two ends of its own", sensor.of);
                        self.report(format!("{key}.{name}"), message, format!("remove `{name}`"));
                    }
                }
            }
            _ if sensor.to.is_none() => {
                let message = "the sensor does not say to where the distance is".to_owned();
                self.report(key, message, "add `to = \"…\"`, a body, a particle or `ground`");
            }
            _ => {}
        }
    }

    /// The far end of a distance.
    fn sensor_end(&mut self, key: &str, sensor: &Sensor) {
        for (name, stated) in [("to", sensor.to.is_some()), ("point_to", sensor.point_to.is_some())]
        {
            if stated && !sensor.kind.is_distance() {
                let message = format!("`{name}` is only for distances");
                return self.report(format!("{key}.{name}"), message, format!("remove `{name}`"));
            }
        }
        let Some(to) = &sensor.to else {
            if sensor.point_to.is_some() {
                let message = "`point_to` is a point of nothing".to_owned();
                self.report(format!("{key}.point_to"), message, "add `to = \"…\"`");
            }
            return;
        };
        self.reference(format!("{key}.to"), to, &["body", "particle", GROUND]);
        if sensor.point_to.is_some() && self.kinds.get(to.as_str()) == Some(&"particle") {
            let message = format!("`{to}` is a particle, it has no other points");
            self.report(format!("{key}.point_to"), message, "remove `point_to`");
        }
    }

    /// The body in whose frame something is given.
    fn sensor_observer(&mut self, key: &str, sensor: &Sensor) {
        let Some(observer) = &sensor.seen_from else { return };
        let key = format!("{key}.seen_from");
        if !sensor.kind.is_relative() {
            let message = "only positions, velocities, orientations and angular velocities are seen from a body";
            return self.report(key, message.to_owned(), "remove `seen_from`");
        }
        self.reference(key, observer, &["body"]);
    }

    fn sensor_power(&mut self, of: String, sensor: &Sensor) {
        let known = self.refers(of.clone(), &sensor.of, &["joint", "spring", "load", "constraint"]);
        let constraint = self.model.constraints.iter().find(|c| c.name() == sensor.of);
        if known && constraint.is_some_and(|c| !matches!(c, Constraint::Motion { .. })) {
            let message = format!("`{}` does no work: it prescribes no motion", sensor.of);
            self.report(of, message, "measure a motion, a joint, a spring or a load");
        } else if known {
            self.sensor_acts(of, &sensor.of);
        }
    }

    /// Whether anything acts along a joint that is measured.
    fn sensor_acts(&mut self, of: String, name: &str) {
        let idle =
            |joint: &Joint| [joint.spring.is_none(), joint.damper.is_none(), joint.motor.is_none()];
        let joint = self.model.joints.iter().find(|joint| joint.name == *name);
        if joint.is_some_and(|joint| idle(joint) == [true; 3]) {
            let message = format!("joint `{name}` has no spring, no damper and no motor");
            let help = "measure its reaction, or the [[constraint]] that prescribes its motion";
            self.report(of, message, help);
        }
    }

    fn sensor_effort(&mut self, of: String, sensor: &Sensor) {
        self.reference(of.clone(), &sensor.of, &["joint", "spring", "constraint"]);
        let name = &sensor.of;
        self.sensor_acts(of.clone(), name);
        let guide = |c: &&Constraint| {
            matches!(c, Constraint::PointOnLine { .. } | Constraint::PointOnPlane { .. })
        };
        let mut guides = self.model.constraints.iter().filter(guide);
        if guides.any(|constraint| constraint.name() == name) {
            let message = format!("`{name}` guides a point: it has no single effort");
            self.report(of, message, "measure a motion, a gear or a distance");
        }
    }

    fn sensor_frame(&mut self, key: &str, sensor: &Sensor) {
        let bar = self.kinds.get(sensor.of.as_str()) == Some(&"bar");
        if sensor.frame.is_some() && (sensor.kind != SensorKind::Reaction || bar) {
            let message = "only the reaction of a joint has a frame".to_owned();
            self.report(format!("{key}.frame"), message, "remove `frame`");
        }
    }

    fn sensor_element(&mut self, key: &str, sensor: &Sensor) {
        let at = format!("{key}.element");
        let count = self.model.beam(&sensor.of).map_or(0, Beam::element_count);
        match sensor.element {
            Some(_) if !sensor.kind.has_element() => {
                let message = "only section forces and strains are measured at an element";
                self.report(at, message.to_owned(), "remove `element`");
            }
            Some(element) if element >= count && count > 0 => {
                let message = format!("`{}` has no element {element}", sensor.of);
                self.report(at, message, format!("its elements are 0 to {}", count - 1));
            }
            None if sensor.kind.has_element() && sensor.at.is_none() => {
                let message = "the sensor does not say where on the beam".to_owned();
                let help =
                    "add `at = …`, m from the start of the beam, or `element = …`, counted from 0";
                self.report(key, message, help);
            }
            _ => {}
        }
    }

    fn sensor_place(&mut self, key: &str, sensor: &Sensor) {
        let Some(at) = sensor.at else { return };
        let key = format!("{key}.at");
        if !sensor.kind.has_element() {
            let message = "only section forces and strains are measured at a place of a beam";
            return self.report(key, message.to_owned(), "remove `at`");
        }
        if sensor.element.is_some() {
            let message = "the sensor says both `at` and `element`".to_owned();
            return self.report(key, message, "remove one of them");
        }
        let meshes = self.model.beam(&sensor.of).map(Beam::meshes);
        let Some(Ok(meshes)) = meshes else { return }; // reported with the beam
        let length: f64 = meshes.iter().flat_map(|mesh| &mesh.lengths).sum();
        if !(0.0..=length * (1.0 + 1e-12)).contains(&at) {
            let message = format!("`{}` has no place {at} m from its start", sensor.of);
            self.report(key, message, format!("its length is {length} m"));
        }
    }

    fn sensor_point(&mut self, key: &str, sensor: &Sensor) {
        if sensor.point.is_none() {
            return;
        }
        let key = format!("{key}.point");
        if !sensor.kind.has_point() {
            let message =
                "a point is only for positions, velocities, accelerations and distances".to_owned();
            self.report(key, message, "remove `point`");
        } else if self.kinds.get(sensor.of.as_str()) == Some(&"particle") {
            let message = format!("`{}` is a particle, it has no other points", sensor.of);
            self.report(key, message, "remove `point`");
        }
    }
}
