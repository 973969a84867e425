//! Checks of what acts on joint coordinates and of scalar constraints.

use crate::checks::Checker;
use crate::frames::start::coincide;
use crate::text::problem::nearest;
use crate::{Constraint, GROUND, Interpolation, Joint, JointKind, JointSpring, Quantities};

impl Checker<'_> {
    pub(crate) fn drives(&mut self, key: &str, joint: &Joint, known: &Quantities<'_>) {
        let amounts = [
            ("spring.stiffness", joint.spring.as_ref().map(|s| s.stiffness)),
            ("damper.damping", joint.damper.as_ref().map(|d| d.damping)),
            ("motor.proportional", joint.motor.as_ref().map(|m| m.proportional)),
            ("motor.derivative", joint.motor.as_ref().map(|m| m.derivative)),
        ];
        for (field, amount) in amounts {
            if let Some(amount) = amount.filter(|a| *a < 0.0) {
                let message = match field {
                    "spring.stiffness" | "motor.proportional" => format!(
                        "{amount} is negative: the force would drive the joint away from its place of rest, without bound"
                    ),
                    _ => format!("{amount} is negative: it would feed energy in"),
                };
                self.report(format!("{key}.{field}"), message, "write 0 or more");
            }
        }
        if let Some(spring) = &joint.spring {
            self.joint_spring(&format!("{key}.spring"), spring);
        }
        if let Some(motor) = &joint.motor {
            self.history(&format!("{key}.motor.history"), &motor.history, known);
            self.path(&format!("{key}.motor.path"), &motor.path, known);
        }
        self.joint_contacts(key, joint);
        match (joint.kind, joint.pitch) {
            (JointKind::Screw, None) => {
                let help = "add `pitch = …`, the advance per revolution in m";
                self.report(key, "a screw joint needs a pitch".into(), help);
            }
            (kind, Some(_)) if kind != JointKind::Screw => {
                let message = "only screw joints have a pitch".to_owned();
                self.report(format!("{key}.pitch"), message, "remove `pitch`");
            }
            _ => {}
        }
    }

    fn joint_spring(&mut self, key: &str, spring: &JointSpring) {
        let Some(name) = &spring.table else {
            return;
        };
        let table = self.model.tables.iter().find(|own| own.name == *name);
        match table {
            None => {
                let known = self.model.tables.iter().map(|own| own.name.as_str());
                let help = match nearest(name, known) {
                    Some(best) => format!("did you mean `{best}`?"),
                    None => "add a [[table]] of this name".to_owned(),
                };
                self.report(format!("{key}.table"), format!("there is no table `{name}`"), help);
            }
            Some(table) if table.axes.is_some() => {
                let message = format!("`{name}` is a table of two numbers");
                let help = "write one of the elongation alone, or a [[law]]";
                self.report(format!("{key}.table"), message, help);
            }
            Some(table) if table.interpolation == Interpolation::Steps => {
                let message = format!("`{name}` jumps at its points");
                let help = "write interpolation = \"linear\": a spring pulls without jumps";
                self.report(format!("{key}.table"), message, help);
            }
            Some(_) => {}
        }
    }

    pub(crate) fn constraint(
        &mut self,
        key: &str,
        constraint: &Constraint,
        known: &Quantities<'_>,
    ) {
        let axis_of = |axis: &[f64; 3]| axis.iter().all(|a| a.abs() < 1e-100);
        match constraint {
            Constraint::Distance { from, to, length, point_from, point_to, .. } => {
                let known = [("from", from), ("to", to)].map(|(end, name)| {
                    self.refers(format!("{key}.{end}"), name, &["body", GROUND])
                });
                self.two_ends(&format!("{key}.to"), from, to);
                self.stated_length(&format!("{key}.length"), *length);
                let ends = [(from, point_from), (to, point_to)]
                    .map(|(member, point)| self.points.point(member, Some(&point[..])));
                if known == [true; 2] && from != to && coincide(&ends) {
                    let message =
                        "both ends start at the same point: the rod has no direction".to_owned();
                    let help = "write a [[joint]] with type = \"spherical\" to hold the points \
                                together, or move one of them";
                    self.report(key, message, help);
                }
            }
            Constraint::PointOnLine { parent, child, axis, .. }
            | Constraint::PointOnPlane { parent, child, axis, .. } => {
                self.reference(format!("{key}.parent"), parent, &["body", GROUND]);
                self.reference(format!("{key}.child"), child, &["body", GROUND]);
                self.two_ends(&format!("{key}.child"), parent, child);
                if axis_of(axis) {
                    let help = "write a direction, such as [0, 0, 1]";
                    let message = "the axis has zero length".to_owned();
                    self.report(format!("{key}.axis"), message, help);
                }
            }
            Constraint::Gear { joints, .. } => {
                for joint in joints {
                    self.reference(format!("{key}.joints"), joint, &["joint"]);
                }
                if joints[0] == joints[1] {
                    let message = format!("both ends are the joint `{}`", joints[0]);
                    let help = "name two joints; a rotation that advances along its axis is a joint of type = \"screw\"";
                    self.report(format!("{key}.joints"), message, help);
                }
            }
            Constraint::Motion { joint, path, .. } => {
                self.reference(format!("{key}.joint"), joint, &["joint"]);
                self.path(&format!("{key}.path"), path, known);
            }
            Constraint::Rolling { .. } => self.rolling(key, constraint),
            Constraint::Velocity { terms, value, .. } => {
                self.velocity(key, terms, value.as_ref());
            }
            Constraint::Blade { body, axis, .. } => {
                self.of_velocities(key);
                self.reference(format!("{key}.body"), body, &["body"]);
                if axis_of(axis) {
                    let help = "write the direction in which it does not slide, such as [0, 1, 0]";
                    let message = "the axis has zero length".to_owned();
                    self.report(format!("{key}.axis"), message, help);
                }
            }
        }
    }
}
