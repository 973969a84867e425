//! Checks of controls and objectives.

use super::Checker;
use crate::quantity::Quantities;
use crate::text::problem::{nearest, some};
use crate::types::control::{Control, CountedAt, Objective, ObjectiveKind, is_zero};
use crate::types::frame::Frame;
use crate::types::load::Load;

impl Checker<'_> {
    pub(crate) fn control(&mut self, key: &str, control: &Control, known: &Quantities<'_>) {
        match (&control.joint, control.load()) {
            (Some(joint), None) => self.effort(key, control, joint),
            (None, Some(load)) => self.wrench(key, control, &load, known),
            (None, None) => {
                let help = "add `joint = …` for an effort, or `body = …` for a force or a torque";
                self.report(key, "the control acts on nothing".to_owned(), help);
            }
            (Some(_), Some(_)) => {
                let message = "the control acts along a joint and on a body".to_owned();
                self.report(format!("{key}.body"), message, "keep one of them");
            }
        }
        if let (Some(min), Some(max)) = (control.min, control.max)
            && min >= max
        {
            let message = format!("the bounds leave nothing between them: {min} and {max}");
            self.report(format!("{key}.min"), message, "write a number below `max`");
        }
        if control.hold == 0 {
            let message = "a value holds for at least one step".to_owned();
            self.report(format!("{key}.hold"), message, "write 1, or more");
        }
    }

    /// A control along a joint coordinate.
    fn effort(&mut self, key: &str, control: &Control, name: &str) {
        if self.refers(format!("{key}.joint"), name, &["joint"]) {
            let joint = self.model.joint(name);
            let count = joint.map_or(0, |joint| joint.pair().coordinate_count());
            if joint.is_some() && control.freedom >= count {
                let message = format!("`{name}` has no joint coordinate {}", control.freedom);
                let help = match count {
                    0 => "control a joint that slides or turns about an axis".to_owned(),
                    _ => format!("write a number below {count}"),
                };
                self.report(format!("{key}.freedom"), message, help);
            }
        }
        let of_body = [
            ("force", !is_zero(&control.force)),
            ("torque", !is_zero(&control.torque)),
            ("point", control.point.is_some()),
            ("frame", control.frame != Frame::Space),
            ("relative_to", control.relative_to.is_some()),
        ];
        for (part, _) in of_body.into_iter().filter(|(_, stated)| *stated) {
            let message = format!("an effort along a joint has no `{part}`");
            self.report(format!("{key}.{part}"), message, "remove it, or write `body`");
        }
        let own = |other: &&Control| {
            (&other.joint, other.freedom) == (&control.joint, control.freedom)
                && other.name != control.name
        };
        let twice = self.model.controls.iter().take_while(|other| other.name != control.name);
        if let Some(first) = twice.into_iter().find(own) {
            let message = format!("`{}` acts on the same coordinate", first.name);
            self.report(format!("{key}.joint"), message, "keep one of them");
        }
    }

    /// A control on a body: what a load has to state, and what it must not.
    fn wrench(&mut self, key: &str, control: &Control, load: &Load, known: &Quantities<'_>) {
        if control.freedom != 0 {
            let message = "a body has no joint coordinates".to_owned();
            let help = "remove `freedom`: `force` and `torque` say along what it acts";
            self.report(format!("{key}.freedom"), message, help);
        }
        if is_zero(&load.force) && is_zero(&load.torque) {
            let message = "the control has neither a force nor a torque".to_owned();
            let help = "add the one of the value 1, such as force = [1, 0, 0]";
            self.report(key, message, help);
        }
        if is_zero(&load.force) && load.point.is_some() {
            let message = "a torque acts at no point".to_owned();
            self.report(format!("{key}.point"), message, "remove `point`, or add `force`");
        }
        self.load(key, load, known);
    }

    pub(crate) fn objective(&mut self, key: &str, objective: &Objective) {
        let of_controls = matches!(
            objective.kind,
            ObjectiveKind::Effort | ObjectiveKind::Work | ObjectiveKind::Rate
        );
        let of_sensor = objective.kind.reads_sensor();
        for (i, name) in objective.controls.iter().enumerate() {
            self.refers(format!("{key}.controls.{i}"), name, &["control"]);
        }
        if !of_controls && !objective.controls.is_empty() {
            let message = "only an effort, a work and a rate are of controls".to_owned();
            self.report(format!("{key}.controls"), message, "remove `controls`");
        }
        if of_controls && self.model.controls.is_empty() {
            let message = "there is no control that it could be of".to_owned();
            self.report(key, message, "add a [[control]]");
        }
        match (&objective.sensor, of_sensor) {
            (Some(sensor), true) => self.measured(key, sensor),
            (None, true) => {
                let help = "add `sensor = …`, the name of a [[sensor]]";
                self.report(key, "missing key `sensor`".to_owned(), help);
            }
            (Some(_), false) => {
                let message = "only a term of type `sensor` or `value` has one".to_owned();
                self.report(format!("{key}.sensor"), message, "write type = \"sensor\"");
            }
            (None, false) => {}
        }
        if !of_sensor && (objective.target != 0.0 || objective.at != CountedAt::End) {
            let part = if objective.target != 0.0 { "target" } else { "at" };
            let message = "only a sensor has a target and a place".to_owned();
            self.report(format!("{key}.{part}"), message, format!("remove `{part}`"));
        }
        if objective.kind == ObjectiveKind::Value && objective.target != 0.0 {
            let message = "a value has no target".to_owned();
            let help = "write type = \"sensor\": half the square of a deviation";
            self.report(format!("{key}.target"), message, help);
        }
    }

    /// The name of a sensor, of one of several numbers with its part.
    pub(super) fn measured(&mut self, key: &str, sensor: &str) {
        let name = sensor.split_once('.').map_or(sensor, |(name, _)| name);
        let known: Vec<&str> = self.model.sensors.iter().map(|own| own.name.as_str()).collect();
        if known.contains(&name) {
            return;
        }
        let help = match nearest(name, known.iter().copied()) {
            Some(best) => format!("did you mean `{best}`?"),
            None if known.is_empty() => "add a [[sensor]]".to_owned(),
            None => format!("there are: {}", some(&known)),
        };
        self.report(format!("{key}.sensor"), format!("there is no sensor named `{name}`"), help);
    }
}
