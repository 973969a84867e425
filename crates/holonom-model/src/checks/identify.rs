//! Checks of measurements and of what is to be found from them.

use super::Checker;
use crate::text::problem::some;
use crate::types::identify::{Identify, Measurement, Unknown};

impl Checker<'_> {
    pub(crate) fn measurement(&mut self, key: &str, own: &Measurement) {
        self.measured(key, &own.sensor);
        self.deviation(&format!("{key}.sigma"), own.sigma);
        let before = self.model.measurements.iter().take_while(|other| !std::ptr::eq(*other, own));
        if before.into_iter().any(|other| other.column() == own.column()) {
            let message = format!("the column `{}` is measured twice", own.column());
            self.report(format!("{key}.column"), message, "keep one of them");
        }
    }

    /// A standard deviation is positive.
    fn deviation(&mut self, key: &str, sigma: f64) {
        if sigma <= 0.0 {
            let message = format!("the standard deviation {sigma} is not positive");
            let help = "write by how much measured values scatter, in the unit of the sensor";
            self.report(key, message, help);
        }
    }

    pub(crate) fn identify(&mut self, own: &Identify) {
        if own.parameters.is_empty() && own.initial.is_empty() {
            let message = "there is nothing to find".to_owned();
            let help = "write parameters = { NAME = { start = … } }, or initial = [\"JOINT\"]";
            self.report("identify", message, help);
        }
        if self.model.measurements.is_empty() {
            let message = "there is nothing from which to find it".to_owned();
            self.report("identify", message, "add a [[measurement]]");
        }
        if own.segments == 0 {
            let message = "`segments` is out of range".to_owned();
            self.report("identify.segments", message, "write 1, or more for long data");
        }
        for (name, unknown) in &own.parameters {
            self.unknown(&format!("identify.parameters.{name}"), unknown);
        }
        for (i, name) in own.initial.iter().enumerate() {
            let key = format!("identify.initial.{i}");
            if own.initial[..i].contains(name) {
                self.report(&key, format!("`{name}` stands twice"), "remove one of them");
            }
            if self.refers(key.clone(), name, &["joint"])
                && let Some(joint) = self.model.joint(name)
                && joint.pair().coordinate_count() == 0
            {
                let message = format!("`{name}` has no joint coordinate");
                let slides = |joint: &&crate::Joint| joint.pair().coordinate_count() > 0;
                let all = self.model.joints.iter().filter(slides);
                let known: Vec<&str> = all.map(|joint| joint.name.as_str()).collect();
                let help = match known.is_empty() {
                    true => "name a joint that slides or turns about an axis".to_owned(),
                    false => format!("there are: {}", some(&known)),
                };
                self.report(key, message, help);
            }
        }
    }

    fn unknown(&mut self, key: &str, own: &Unknown) {
        let (min, max) = (own.min.unwrap_or(f64::NEG_INFINITY), own.max.unwrap_or(f64::INFINITY));
        if min >= max {
            let message = format!("the bounds leave nothing between them: {min} and {max}");
            self.report(format!("{key}.min"), message, "write a number below `max`");
        } else if let Some(start) = own.start.filter(|start| !(min..=max).contains(start)) {
            let message = format!("the start {start} is not between the bounds");
            self.report(format!("{key}.start"), message, "write a number between `min` and `max`");
        }
        if let Some(prior) = own.prior {
            self.deviation(&format!("{key}.prior.sigma"), prior.sigma);
        }
    }
}
