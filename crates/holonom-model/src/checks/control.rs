//! Checks of controls and objectives.

use super::Checker;
use crate::text::problem::{nearest, some};
use crate::types::control::{Control, CountedAt, Objective, ObjectiveKind};

impl Checker<'_> {
    pub(crate) fn control(&mut self, key: &str, control: &Control) {
        if self.refers(format!("{key}.joint"), &control.joint, &["joint"]) {
            let joint = self.model.joint(&control.joint);
            let count = joint.map_or(0, |joint| joint.pair().coordinate_count());
            if joint.is_some() && control.freedom >= count {
                let message =
                    format!("`{}` has no joint coordinate {}", control.joint, control.freedom);
                let help = match count {
                    0 => "control a joint that slides or turns about an axis".to_owned(),
                    _ => format!("write a number below {count}"),
                };
                self.report(format!("{key}.freedom"), message, help);
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

    pub(crate) fn objective(&mut self, key: &str, objective: &Objective) {
        let of_controls = matches!(
            objective.kind,
            ObjectiveKind::Effort | ObjectiveKind::Work | ObjectiveKind::Rate
        );
        let of_sensor = objective.kind == ObjectiveKind::Sensor;
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
                let message = "only a term of type `sensor` has one".to_owned();
                self.report(format!("{key}.sensor"), message, "write type = \"sensor\"");
            }
            (None, false) => {}
        }
        if !of_sensor && (objective.target != 0.0 || objective.at != CountedAt::End) {
            let part = if objective.target != 0.0 { "target" } else { "at" };
            let message = "only a sensor has a target and a place".to_owned();
            self.report(format!("{key}.{part}"), message, format!("remove `{part}`"));
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
