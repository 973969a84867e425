//! Checks of sensors.

use crate::checks::Checker;
use crate::checks::contact::{AVAILABLE, without_gap};
use crate::observed::Observed;
use crate::quantity::Quantities;
use crate::types::beam::Beam;
use crate::types::body::GROUND;
use crate::types::connection::{Joint, JointKind};
use crate::types::drive::Constraint;
use crate::types::sensor::{Sensor, SensorKind};

impl Checker<'_> {
    pub(crate) fn sensor(&mut self, key: &str, sensor: &Sensor) {
        let of = format!("{key}.of");
        if sensor.value.is_some() && sensor.kind != SensorKind::Expression {
            let message = "only an expression has a value".to_owned();
            self.report(format!("{key}.value"), message, "write type = \"expression\"");
        }
        if sensor.of.is_empty() && sensor.kind != SensorKind::Expression {
            let help = "add `of = …`, the name of what is measured";
            return self.report(key, "missing key `of`".to_owned(), help);
        }
        match sensor.kind {
            SensorKind::Expression => self.sensor_expression(key, sensor),
            SensorKind::Imu => self.reference(of, &sensor.of, &["body"]),
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
            SensorKind::Reaction if self.carries_a_body(&sensor.of) => {}
            SensorKind::Reaction => self.reference(of, &sensor.of, &["joint", "bar"]),
            SensorKind::Slip if self.model.contact(&sensor.of).is_some() => {}
            SensorKind::Gap => self.reference(of, &sensor.of, &["contact"]),
            SensorKind::Clearance => self.sensor_clearance(key, sensor),
            SensorKind::ContactForce => {
                if self.refers(of.clone(), &sensor.of, &["contact", "body"]) {
                    self.sensor_touches(of, &sensor.of);
                }
            }
            SensorKind::StopForce | SensorKind::FrictionTorque => {
                if self.refers(of.clone(), &sensor.of, &["joint"]) {
                    self.sensor_impulse(of, sensor);
                }
            }
            SensorKind::Slip => {
                let known = self.refers(of.clone(), &sensor.of, &["constraint"]);
                let all = &self.model.constraints;
                if known && !all.iter().any(|c| c.name() == sensor.of && c.is_of_velocities()) {
                    let message = format!("`{}` does not roll, and is no blade", sensor.of);
                    let help = "measure a [[contact]], or a [[constraint]] of type \"rolling\", \"blade\" or \"velocity\"";
                    self.report(of, message, help);
                }
            }
            SensorKind::SectionForce | SensorKind::Strain => {
                self.reference(of, &sensor.of, &["beam"]);
            }
            SensorKind::Effort => self.sensor_effort(of, sensor),
            SensorKind::Power | SensorKind::Work => self.sensor_power(of, sensor),
        }
        self.sensor_axes(key, sensor);
        self.sensor_observer(key, sensor);
        self.sensor_end(key, sensor);
        self.sensor_frame(key, sensor);
        self.sensor_point(key, sensor);
        self.sensor_element(key, sensor);
        self.sensor_place(key, sensor);
    }

    /// A body whose forces of contacts are measured touches something.
    fn sensor_touches(&mut self, of: String, name: &str) {
        let (own, pairs) = (self.model.member_name(name), self.model.contact_pairs());
        let touches = pairs.iter().any(|pair| pair.b.name == own || pair.a.name() == own);
        if self.model.contact(name).is_none() && !touches {
            let message = format!("`{name}` is in no contact");
            self.report(of, message, "name it in a [[contact]], or measure another body");
        }
    }

    /// A joint has the stops or the dry friction whose effort is measured.
    fn sensor_impulse(&mut self, of: String, sensor: &Sensor) {
        let Some(joint) = self.model.joint(&sensor.of) else { return };
        let (there, what, help) = match sensor.kind {
            SensorKind::StopForce => (
                joint.stops().is_some(),
                "rigid stops",
                "give it `limits`; the effort of a `bumper` is measured by type = \"effort\"",
            ),
            _ => (
                joint.dry_friction().is_some(),
                "dry friction",
                "give it `friction`; the effort of one with a `model` is measured by type = \"effort\"",
            ),
        };
        if !there {
            self.report(of, format!("joint `{}` has no {what}", sensor.of), help);
        }
    }

    /// Whether this is what rolls, or a blade.
    fn carries_a_body(&self, name: &str) -> bool {
        self.model.constraints.iter().any(|c| c.name() == name && c.carries_a_body())
    }

    /// The orientation of the axes of an inertial measurement unit.
    fn sensor_axes(&mut self, key: &str, sensor: &Sensor) {
        let stated = [
            ("quaternion", sensor.quaternion.is_some()),
            ("rotation_vector", sensor.rotation_vector.is_some()),
            ("matrix", sensor.matrix.is_some()),
            ("euler", sensor.euler.is_some()),
        ];
        let Some((name, _)) = stated.into_iter().find(|own| own.1) else { return };
        if sensor.kind != SensorKind::Imu {
            let message = "only an imu has axes of its own".to_owned();
            self.report(format!("{key}.{name}"), message, format!("remove `{name}`"));
        } else if let Some(problem) = sensor.orientation().fault() {
            self.add(problem.below(key));
        }
    }

    fn sensor_expression(&mut self, key: &str, sensor: &Sensor) {
        if !sensor.of.is_empty() {
            let message = "an expression is of nothing".to_owned();
            self.report(format!("{key}.of"), message, "remove `of`");
        }
        let Some(value) = &sensor.value else {
            let help = "add `value = \"…\"`, of t, joints, bodies, signals and sensors";
            return self.report(key, "the expression has no value".to_owned(), help);
        };
        let known = Quantities::new(self.model);
        if let Err(error) = Observed::expression(&value.0, self.model, &known) {
            let message = format!("the expression `{}`: {}", value.0.trim(), error.message);
            self.report(format!("{key}.value"), message, error.help);
        }
    }

    /// A distance between two points, or the length of what has two ends.
    fn sensor_distance(&mut self, key: &str, sensor: &Sensor) {
        let of = format!("{key}.of");
        let kinds = ["body", "particle", "spring", "bar", "constraint", "law"];
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
            Some("law")
                if !self
                    .model
                    .laws
                    .iter()
                    .any(|own| own.name == sensor.of && own.from.is_some()) =>
            {
                let message =
                    format!("`{}` does not act between points: it has no length", sensor.of);
                self.report(of, message, "measure a law of `from` and `to`");
            }
            Some("spring" | "bar" | "constraint" | "law") => {
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

    /// Two bodies whose shapes have a gap.
    fn sensor_clearance(&mut self, key: &str, sensor: &Sensor) {
        let (of, at) = (format!("{key}.of"), format!("{key}.to"));
        let Some(to) = &sensor.to else {
            self.reference(of, &sensor.of, &["body"]);
            let message = "the sensor does not say to what the clearance is".to_owned();
            return self.report(key, message, "add `to = \"…\"`, a body with a shape");
        };
        let known = self.refers(of.clone(), &sensor.of, &["body"]);
        if !known || !self.refers(at.clone(), to, &["body"]) {
            return;
        }
        if *to == sensor.of {
            return self.report(at, "both are the same body".to_owned(), "name another body");
        }
        let bodies = [(of, &sensor.of), (at.clone(), to)];
        for (at, name) in &bodies {
            let Some(body) = self.model.body(name) else {
                let message = format!("`{name}` is a node of a beam: it has no shape");
                let help = "weld a body with a shape to it, and name that";
                return self.report(at.clone(), message, help);
            };
            if body.contact_shapes().is_empty() {
                let message = format!("`{name}` has no shape");
                let help = "add a `shape`, or `collision = [ … ]`, to the [[body]]";
                return self.report(at.clone(), message, help);
            }
        }
        let [a, b] = bodies.map(|(_, name)| self.model.body(name));
        if let Some([a, b]) = a.zip(b).and_then(|(a, b)| without_gap(a, b)) {
            let message = format!("there is no gap between a {a} and a {b}");
            self.report(at, message, AVAILABLE);
        }
    }

    /// The far end of a distance.
    fn sensor_end(&mut self, key: &str, sensor: &Sensor) {
        for (name, stated) in [("to", sensor.to.is_some()), ("point_to", sensor.point_to.is_some())]
        {
            let is_end = name == "to" && sensor.kind == SensorKind::Clearance;
            if stated && !is_end && !sensor.kind.is_distance() {
                let message = format!("`{name}` is only for distances");
                return self.report(format!("{key}.{name}"), message, format!("remove `{name}`"));
            }
        }
        if sensor.kind == SensorKind::Clearance {
            return;
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
        let kinds = ["joint", "spring", "load", "law", "bushing", "constraint"];
        let known = self.refers(of.clone(), &sensor.of, &kinds);
        let constraint = self.model.constraints.iter().find(|c| c.name() == sensor.of);
        let motion = constraint.is_some_and(|c| matches!(c, Constraint::Motion { .. }));
        let alone = self.model.only_motion() == Some(&sensor.of);
        if known && motion && !alone && sensor.kind == SensorKind::Work {
            let message = format!("the work of `{}` is kept with that of other motions", sensor.of);
            let help = "measure its power, or read `work_of_motions` in energy.csv";
            self.report(of, message, help);
        } else if known && constraint.is_some() && !motion {
            let message = format!("`{}` does no work: it prescribes no motion", sensor.of);
            self.report(of, message, "measure a motion, a joint, a spring or a load");
        } else if known {
            self.sensor_acts(of, &sensor.of);
        }
    }

    /// Whether anything acts along a joint that is measured.
    fn sensor_acts(&mut self, of: String, name: &str) {
        let idle = |joint: &Joint| {
            let parts = [joint.spring.is_none(), joint.damper.is_none(), joint.motor.is_none()];
            let smooth = joint.friction.is_some_and(|own| own.model.is_some());
            parts == [true; 3] && joint.bumper.is_none() && !smooth
        };
        if self.model.joint(name).is_some_and(idle) {
            let message = format!("joint `{name}` has no spring, no damper and no motor");
            let help = "measure its reaction, or the [[constraint]] that prescribes its motion";
            self.report(of, message, help);
        }
    }

    fn sensor_effort(&mut self, of: String, sensor: &Sensor) {
        let kinds = ["joint", "spring", "constraint", "bushing", "law"];
        self.reference(of.clone(), &sensor.of, &kinds);
        let name = &sensor.of;
        self.sensor_acts(of.clone(), name);
        if self.carries_a_body(name) {
            let message = format!("`{name}` has no single effort");
            return self.report(of, message, "write type = \"reaction\"");
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
        let bar =
            self.kinds.get(sensor.of.as_str()) == Some(&"bar") || self.carries_a_body(&sensor.of);
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
                "a point is only for positions, velocities, accelerations, distances and an imu"
                    .to_owned();
            self.report(key, message, "remove `point`");
        } else if self.kinds.get(sensor.of.as_str()) == Some(&"particle") {
            let message = format!("`{}` is a particle, it has no other points", sensor.of);
            self.report(key, message, "remove `point`");
        }
    }
}
