//! `[[sensor]]`: what is measured along a run and written to `sensors.csv`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::JointKind;
use super::beam::Beam;
use super::checks::Checker;
use super::connection::Joint;
use super::drive::Constraint;

/// What a sensor measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SensorKind {
    /// Of a body, at `point`, or of a particle, in space, m.
    Position,
    /// Of a body, at `point`, or of a particle, in space, m/s.
    Velocity,
    /// Of a body: the quaternion `w, x, y, z` of its own frame, body to space; its sign does not jump.
    Orientation,
    /// Of a body, spatial components, rad/s.
    AngularVelocity,
    /// Of a joint: lengths in m, angles in rad. Angles count on beyond ±π. Of a spherical joint the
    /// rotation vector of the child against the parent, at most π long.
    JointCoordinate,
    /// Of a joint: the rates of its coordinates, m/s and rad/s. Of a spherical joint the angular
    /// velocity of the child relative to the parent.
    JointRate,
    /// Of a joint: the force (N) and the moment about the joint's place on the child (N·m) that the
    /// joint exerts on the child, in the joint frame of the parent; of a fixed body the same of what
    /// holds it; of a bar its tension (N).
    Reaction,
    /// What drives or resists a motion, N or N·m: of a joint the efforts of its spring, damper and motor along
    /// its coordinate; of a `[[spring]]` its tension, with its damper; of a `[[constraint]]` the effort of a
    /// prescribed motion, of a gear on its first joint, the tension of a distance.
    Effort,
    /// Of a beam at `element`: the shear forces `N1, N2` and the normal force `N3`, N, and the moments
    /// about its directors, `M1, M2` bending and `M3` twisting, N·m.
    SectionForce,
    /// Of a beam at `element`: `Gamma1, Gamma2` shear, `Gamma3` extension; `K1, K2` bending, `K3` twist,
    /// 1/m; all measured from the stress-free beam.
    Strain,
}

impl SensorKind {
    /// Whether it is measured at an element of a beam.
    #[must_use]
    pub fn has_element(self) -> bool {
        matches!(self, Self::SectionForce | Self::Strain)
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
    /// The point of a body (`position`, `velocity`): body components from the centre of mass, m; the
    /// centre by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point: Option<[f64; 3]>,
    /// The element of a beam, counted along it from 0 (`section_force`, `strain`): at its middle; the mean
    /// of its Gauss points when it has several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub element: Option<usize>,
    /// The place on a beam (`section_force`, `strain`) in the place of `element`: arc length from its start, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at: Option<f64>,
    /// The axes of the components of a `reaction`: the joint frame of the parent by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<ReactionFrame>,
}

impl Checker<'_> {
    pub(super) fn sensor(&mut self, key: &str, sensor: &Sensor) {
        let of = format!("{key}.of");
        match sensor.kind {
            SensorKind::Position | SensorKind::Velocity => {
                self.reference(of, &sensor.of, &["body", "particle"]);
            }
            SensorKind::Orientation | SensorKind::AngularVelocity => {
                self.reference(of, &sensor.of, &["body"]);
            }
            SensorKind::JointCoordinate | SensorKind::JointRate => {
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
        }
        self.sensor_frame(key, sensor);
        self.sensor_point(key, sensor);
        self.sensor_element(key, sensor);
        self.sensor_place(key, sensor);
    }

    fn sensor_effort(&mut self, of: String, sensor: &Sensor) {
        self.reference(of.clone(), &sensor.of, &["joint", "spring", "constraint"]);
        let name = &sensor.of;
        let idle =
            |joint: &Joint| [joint.spring.is_none(), joint.damper.is_none(), joint.motor.is_none()];
        let joint = self.model.joints.iter().find(|joint| joint.name == *name);
        if joint.is_some_and(|joint| idle(joint) == [true; 3]) {
            let message = format!("joint `{name}` has no spring, no damper and no motor");
            let help = "measure its reaction, or the [[constraint]] that prescribes its motion";
            self.report(of.clone(), message, help);
        }
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
        let moves = matches!(sensor.kind, SensorKind::Position | SensorKind::Velocity);
        let key = format!("{key}.point");
        if !moves {
            let message = "a point is only for positions and velocities".to_owned();
            self.report(key, message, "remove `point`");
        } else if self.kinds.get(sensor.of.as_str()) == Some(&"particle") {
            let message = format!("`{}` is a particle, it has no other points", sensor.of);
            self.report(key, message, "remove `point`");
        }
    }
}
