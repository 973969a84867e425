//! Checks of events.

use std::collections::BTreeSet;

use crate::Scheme;
use crate::checks::Checker;
use crate::expression::renamed_parts;
use crate::observed::Observed;
use crate::quantity::Quantities;
use crate::types::bushing::Coefficients;
use crate::types::event::{Event, Locate, coordinate_of};
use crate::types::sensor::{Sensor, SensorKind};

impl Checker<'_> {
    pub(crate) fn event(&mut self, key: &str, event: &Event, quantities: &Quantities<'_>) {
        if self.model.settings.scheme == Scheme::Static {
            let message = "equilibria know no events".to_owned();
            return self.report(key, message, "remove the event, or take another scheme");
        }
        self.event_condition(key, event, quantities);
        if event.actions().next().is_none() {
            let help = "add `release`, `lock`, `set`, `enable`, `disable` or `end = true`";
            self.report(key, "the event does nothing".into(), help);
        }
        let released = ["joint", "bar", "constraint", "spring", "bushing", "law"];
        self.event_parts(&format!("{key}.release"), &event.release, &released);
        self.event_parts(&format!("{key}.enable"), &event.enable, &["law", "load", "joint"]);
        self.event_parts(&format!("{key}.disable"), &event.disable, &["law", "load", "joint"]);
        for name in event.set.keys() {
            let key = format!("{key}.set.{name}");
            let known = self.refers(key.clone(), name, &["signal"]);
            let signal = self.model.signals.iter().find(|signal| signal.name == *name);
            if known && signal.is_some_and(|signal| !signal.kinds().is_empty()) {
                let message = format!("`{name}` has a value of its own");
                self.report(key, message, "set a signal with `start` alone");
            }
        }
        for (list, names) in [("enable", &event.enable), ("disable", &event.disable)] {
            self.event_motors(&format!("{key}.{list}"), names);
        }
        if let Some(name) = event.enable.iter().find(|name| event.disable.contains(name)) {
            let message = format!("`{name}` is both enabled and disabled");
            self.report(format!("{key}.enable"), message, "remove it from one of the lists");
        }
        self.event_locks(&format!("{key}.lock"), &event.lock);
        for (list, names) in [("release", &event.release), ("lock", &event.lock)] {
            if !event.once && !names.is_empty() {
                let message = format!("`{list}` is done once, and the event acts again");
                self.report(format!("{key}.once"), message, "remove `once = false`");
            }
        }
        self.event_twice(key, event);
        for name in &event.release {
            self.event_readers(&format!("{key}.release"), name, event, quantities);
        }
        for name in &event.disable {
            self.event_readers(&format!("{key}.disable"), name, event, quantities);
        }
    }

    /// Laws, signals and bushings that read a part which is released or disabled: a joint by its
    /// name, any part by a sensor that has its value within the step.
    fn event_readers(&mut self, key: &str, gone: &str, event: &Event, quantities: &Quantities<'_>) {
        let model = self.model;
        let released = event.release.iter().any(|name| name == gone);
        let joint = model.joint(gone);
        if joint.is_some() && !released {
            return; // its motor
        }
        let of_part = |own: &&Sensor| {
            let of_joint = matches!(own.kind, SensorKind::JointCoordinate | SensorKind::JointRate);
            own.of == gone && (of_joint || quantities.is_at_once(own))
        };
        let sensors = model.sensors.iter().filter(of_part).map(|own| &own.name[..]);
        let names: BTreeSet<&str> =
            joint.map(|own| &own.name[..]).into_iter().chain(sensors).collect();
        let read = |text: &str| {
            let mut found = None;
            renamed_parts(text, &mut |part| {
                found = found.or_else(|| names.get(part).copied());
                part.to_owned()
            });
            found
        };
        let goes = |name: &String| name == gone || event.release.contains(name);
        let laws = model
            .laws
            .iter()
            .filter(|law| !(goes(&law.name) || released && law.joint.as_deref() == Some(gone)));
        let laws = laws.filter_map(|law| {
            Some((&law.name, law.formulas().find_map(|formula| read(&formula.0))?))
        });
        let signals = model.signals.iter().filter_map(|own| {
            Some((&own.name, own.formulas().find_map(|(_, formula)| read(&formula.0))?))
        });
        let bushings = model.bushings.iter().filter(|own| !goes(&own.name));
        let bushings = bushings.filter_map(|own| {
            let all = [&own.stiffness, &own.damping].into_iter().flatten();
            let entries = all.flat_map(Coefficients::entries).map(|(.., formula)| formula);
            let mut all = entries.chain(own.force.iter().flatten());
            Some((&own.name, all.find_map(|formula| read(&formula.0))?))
        });
        let Some((reader, found)) = laws.chain(signals).chain(bushings).next() else { return };
        let what = match found == gone {
            true => format!("the joint `{gone}`"),
            false => format!("the sensor `{found}` of `{gone}`"),
        };
        let help = match released {
            true => {
                "let it read positions and velocities of the body, a `distance` of two points, or \
                 release it, too"
            }
            false => "let it read a `distance` of the same two points",
        };
        self.report(key, format!("`{reader}` reads {what}"), help);
    }

    fn event_condition(&mut self, key: &str, event: &Event, quantities: &Quantities<'_>) {
        match (&event.when, event.at) {
            (Some(_), Some(_)) => {
                let message = "the event has a condition and a time".to_owned();
                self.report(format!("{key}.at"), message, "write two events");
            }
            (None, None) => {
                let help = "add `when = \"…\"`, such as \"knee > 0.5\", or `at = …`, s";
                self.report(key, "the event does not say when it acts".into(), help);
            }
            (None, Some(at)) if at < 0.0 => {
                let message = format!("{at} s is before the start");
                self.report(format!("{key}.at"), message, "write 0 or a later time");
            }
            (None, Some(_)) if !event.once => {
                let message = "a time comes once".to_owned();
                self.report(
                    format!("{key}.once"),
                    message,
                    "remove `once = false`, or write `when`",
                );
            }
            (None, Some(_)) if event.locate == Locate::Step => {
                let message = "a time is met exactly".to_owned();
                self.report(format!("{key}.locate"), message, "remove `locate`");
            }
            (None, Some(_)) => {}
            (Some(text), None) => self.event_when(&format!("{key}.when"), text, quantities),
        }
    }

    fn event_when(&mut self, key: &str, text: &str, quantities: &Quantities<'_>) {
        match Observed::condition(text, self.model, quantities) {
            Ok(found) if found.program.constant().is_some() => {
                let message = format!("the condition `{}` never changes", text.trim());
                self.report(key, message, "compare something that depends on time or state");
            }
            Ok(_) => {}
            Err(error) => {
                let message = format!("the condition `{}`: {}", text.trim(), error.message);
                self.report(key, message, error.help);
            }
        }
    }

    fn event_parts(&mut self, key: &str, names: &[String], kinds: &[&'static str]) {
        let mut known = BTreeSet::new();
        for name in names {
            self.reference(key.to_owned(), name, kinds);
            if !known.insert(name) {
                let message = format!("`{name}` stands twice in the list");
                self.report(key, message, "remove one of them");
            }
        }
    }

    /// Joints stand for their motors.
    fn event_motors(&mut self, key: &str, names: &[String]) {
        for name in names {
            let joint = self.model.joint(name);
            if joint.is_some_and(|joint| joint.motor.is_none()) {
                let message = format!("joint `{name}` has no motor");
                let help = "name a joint with a `motor`, a law or a load";
                self.report(key, message, help);
            }
        }
    }

    fn event_locks(&mut self, key: &str, names: &[String]) {
        let mut known = BTreeSet::new();
        for name in names {
            let (of, freedom) = coordinate_of(name);
            let Some(joint) = self.model.joint(of) else {
                self.reference(key.to_owned(), name, &["joint"]);
                continue;
            };
            let count = joint.pair().coordinate_count();
            if freedom >= count {
                let kind = joint.pair().name();
                let message = format!("a {kind} joint has no coordinate {freedom} to hold");
                let help = match count {
                    0 => "lock joints with angles or displacements: revolute, prismatic, …"
                        .to_owned(),
                    1 => format!("write `{of}`"),
                    _ => format!("its coordinates are `{of}` to `{of}.{}`", count - 1),
                };
                self.report(key, message, help);
            } else if !known.insert((of, freedom)) {
                self.report(key, format!("`{name}` stands twice"), "remove one of them");
            }
        }
    }

    /// What an earlier event releases or locks already.
    fn event_twice(&mut self, key: &str, event: &Event) {
        let others = || self.model.events.iter().take_while(|other| other.name != event.name);
        let mut found = Vec::new();
        for name in &event.release {
            if let Some(other) = others().find(|other| other.release.contains(name)) {
                found.push(("release", format!("`{name}` is released by `{}`, too", other.name)));
            }
        }
        for name in &event.lock {
            let same = |own: &String| coordinate_of(own) == coordinate_of(name);
            if let Some(other) = others().find(|other| other.lock.iter().any(same)) {
                found.push(("lock", format!("`{name}` is locked by `{}`, too", other.name)));
            }
        }
        for (list, message) in found {
            let help = "write one event, with both conditions joined by `or`";
            self.report(format!("{key}.{list}"), message, help);
        }
    }
}
