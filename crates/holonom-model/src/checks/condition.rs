//! Checks of conditions and of `[optimize]`.

use super::Checker;
use crate::types::condition::{Condition, ConditionKind, ConditionTime};
use crate::types::control::CountedAt;
use crate::types::optimize::Optimize;

/// Halvings at most.
const HALVINGS: u32 = 10;

impl Checker<'_> {
    pub(crate) fn condition(&mut self, key: &str, own: &Condition) {
        match own.kind {
            ConditionKind::Sensor => self.of_sensor(key, own),
            ConditionKind::Rest => self.of_rest(key, own),
        }
    }

    fn of_sensor(&mut self, key: &str, own: &Condition) {
        match &own.sensor {
            Some(sensor) => self.measured(key, sensor),
            None => {
                let help = "add `sensor = …`, the name of a [[sensor]], or write type = \"rest\"";
                self.report(key, "missing key `sensor`".to_owned(), help);
            }
        }
        if !own.of.is_empty() {
            let message = "only a condition of type `rest` is of joints".to_owned();
            self.report(format!("{key}.of"), message, "remove `of`, or write type = \"rest\"");
        }
        match (own.equals, own.min, own.max) {
            (None, None, None) => {
                let message = "the condition asks for nothing".to_owned();
                self.report(key, message, "add `equals`, or `min` and `max`");
            }
            (Some(_), Some(_), _) | (Some(_), _, Some(_)) => {
                let message = "the condition states a value and bounds".to_owned();
                self.report(format!("{key}.equals"), message, "keep `equals`, or `min` and `max`");
            }
            (None, Some(min), Some(max)) if min >= max => {
                let message = format!("the bounds leave nothing between them: {min} and {max}");
                self.report(format!("{key}.min"), message, "write a number below `max`");
            }
            _ => {}
        }
        self.time_of(key, own);
        let (Some(value), ConditionTime::Word(CountedAt::End) | ConditionTime::Time(_)) =
            (own.equals, own.at)
        else {
            return;
        };
        let path = |other: &&Condition| {
            other.sensor == own.sensor && other.at == ConditionTime::Word(CountedAt::Path)
        };
        let outside = |other: &&Condition| {
            let [min, max] = other.bounds();
            value < min || value > max
        };
        if let Some(other) = self.model.conditions.iter().filter(path).find(outside) {
            let [min, max] = other.bounds();
            let message = format!("{value} is outside of the bounds of `{}`", other.name);
            let help = format!("write a value from {min} to {max}");
            self.report(format!("{key}.equals"), message, help);
        }
    }

    /// A time follows the start. Whether it is that of a node is judged with a search: the steps
    /// are those of a run as well.
    fn time_of(&mut self, key: &str, own: &Condition) {
        let ConditionTime::Time(time) = own.at else { return };
        let message = if self.model.optimize.as_ref().is_some_and(|own| own.time.is_some()) {
            "the time is free: a condition has no time of its own".to_owned()
        } else if time <= 0.0 {
            format!("{time} s is not after the start")
        } else {
            return;
        };
        let help = "write \"end\", \"path\", or a multiple of the step up to the end";
        self.report(format!("{key}.at"), message, help);
    }

    fn of_rest(&mut self, key: &str, own: &Condition) {
        for (i, name) in own.of.iter().enumerate() {
            self.refers(format!("{key}.of.{i}"), name, &["joint"]);
        }
        let stated = [
            ("sensor", own.sensor.is_some()),
            ("equals", own.equals.is_some()),
            ("min", own.min.is_some()),
            ("max", own.max.is_some()),
            ("at", own.at != ConditionTime::default()),
        ];
        for (part, _) in stated.into_iter().filter(|(_, is)| *is) {
            let message = format!("rest at the end has no `{part}`");
            self.report(format!("{key}.{part}"), message, format!("remove `{part}`"));
        }
        let rest = |other: &&Condition| other.kind == ConditionKind::Rest;
        let first = self.model.conditions.iter().find(rest);
        if let Some(first) = first.filter(|first| first.name != own.name) {
            let message = format!("`{}` asks for rest as well", first.name);
            self.report(key, message, "keep one of them, with all joints in `of`");
        }
    }

    pub(crate) fn optimize(&mut self, own: &Optimize) {
        if let Some(time) = own.time {
            if time.min <= 0.0 || time.min >= time.max {
                let message = format!("the time lies between {} s and {} s", time.min, time.max);
                self.report("optimize.time.min", message, "write a positive time below `max`");
            } else if let Some(guess) = time.guess.filter(|guess| !time.contains(*guess)) {
                let message = format!("the search begins with {guess} s, outside of the bounds");
                let help = format!("write a `guess` from {} to {}", time.min, time.max);
                self.report("optimize.time.guess", message, help);
            }
        }
        for (name, bounds) in &own.parameters {
            if bounds.min >= bounds.max {
                let (min, max) = (bounds.min, bounds.max);
                let message = format!("the bounds leave nothing between them: {min} and {max}");
                let key = format!("optimize.parameters.{name}.min");
                self.report(key, message, "write a number below `max`");
            }
        }
        if own.guess.trim().is_empty() {
            let help = "write \"line\", \"run\" or the folder of an earlier optimum";
            self.report("optimize.guess", "the guess has no name".to_owned(), help);
        }
        let counts = [
            ("refine", own.refine > HALVINGS, "write a number from 0 to 10"),
            ("max_iterations", own.max_iterations == 0, "write 1, or more"),
            ("starts", own.starts == 0, "write 1, or more"),
        ];
        for (part, _, help) in counts.into_iter().filter(|(_, is, _)| *is) {
            let message = format!("`{part}` is out of range");
            self.report(format!("optimize.{part}"), message, help);
        }
        let free = !own.parameters.is_empty() || !self.model.controls.is_empty();
        if !free {
            let message = "nothing is free".to_owned();
            let help = "add a [[control]], or parameters = { NAME = { min = …, max = … } }";
            self.report("optimize", message, help);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::Model;

    const HEAD: &str = r#"
        model = { name = "m" }
        simulation = { step = 0.1, end = 1.0 }
        body = [{ name = "b", mass = 1.0, inertia = [1.0, 1.0, 1.0] }]
        joint = [{ name = "j", type = "revolute", parent = "ground", child = "b", position = [0, 0, 0], axis = [0, 0, 1] }]
        sensor = [{ name = "angle", type = "joint_coordinate", of = "j" }]
        objective = [{ name = "cheap", type = "effort" }]
        control = [{ name = "torque", joint = "j" }]
    "#;

    fn words(more: &str) -> String {
        Model::from_toml(&format!("{HEAD}{more}")).err().map(|e| e.to_string()).unwrap_or_default()
    }

    #[test]
    fn conditions_that_ask_for_nothing_or_for_too_much_are_refused() {
        let one = |keys: &str| words(&format!("condition = [{{ name = \"c\", {keys} }}]"));
        assert_eq!(one("sensor = \"angle\", equals = 1.0"), "");
        assert_eq!(one("type = \"rest\", of = [\"j\"]"), "");
        assert_eq!(one("sensor = \"angle\", at = 0.3, max = 1.0"), "");
        // a run may take other steps, or end before
        assert_eq!(one("sensor = \"angle\", at = 0.25, max = 1.0"), "");
        assert_eq!(one("sensor = \"angle\", at = 1.5, max = 1.0"), "");
        for (keys, words) in [
            ("sensor = \"angle\"", "asks for nothing"),
            ("equals = 1.0", "missing key `sensor`"),
            ("sensor = \"angel\", equals = 1.0", "no sensor named"),
            ("sensor = \"angle\", equals = 1.0, max = 2.0", "a value and bounds"),
            ("sensor = \"angle\", min = 2.0, max = 2.0", "leave nothing"),
            ("sensor = \"angle\", equals = 1.0, of = [\"j\"]", "of joints"),
            ("sensor = \"angle\", equals = 1.0, at = 0.0", "not after the start"),
            ("sensor = \"angle\", equals = 1.0, at = \"begin\"", "\"path\" or a time"),
            ("type = \"rest\", equals = 0.0", "has no `equals`"),
            ("type = \"rest\", at = \"path\"", "has no `at`"),
            ("type = \"rest\", of = [\"b\"]", "is a body"),
        ] {
            assert!(one(keys).contains(words), "{keys}: {}", one(keys));
        }
        let two = |keys: &str| {
            words(&format!(
                "condition = [{{ name = \"c\", sensor = \"angle\", equals = 3.0 }}, {{ name = \"d\", {keys} }}]"
            ))
        };
        assert!(two("sensor = \"angle\", at = \"path\", max = 2.0").contains("bounds of `d`"));
        assert_eq!(two("sensor = \"angle\", at = \"path\", max = 4.0"), "");
        let rest =
            "condition = [{ name = \"c\", type = \"rest\" }, { name = \"d\", type = \"rest\" }]";
        assert!(words(rest).contains("asks for rest as well"));
    }

    #[test]
    fn searches_without_sense_are_refused() {
        let one = |keys: &str| words(&format!("optimize = {{ {keys} }}"));
        assert_eq!(one("time = { min = 0.5, max = 2.0 }, guess = \"run\", refine = 0"), "");
        // `end` is that of a run as well: a search that begins there is judged when it begins
        assert_eq!(one("time = { min = 1.5, max = 2.0 }"), "");
        assert_eq!(one("time = { min = 0.2, max = 0.5 }"), "");
        for (keys, words) in [
            ("time = { min = 2.0, max = 1.0 }", "lies between"),
            ("time = { min = 0.0, max = 2.0 }", "lies between"),
            ("time = { min = 0.5, max = 2.0, guess = 3.0 }", "outside of the bounds"),
            ("parameters = { a = { min = 1.0, max = 1.0 } }", "leave nothing"),
            ("parameters = { a = { min = 1.0 } }", "the key `max` is missing"),
            ("guess = \" \"", "no name"),
            ("refine = 11", "`refine` is out of range"),
            ("starts = 0", "`starts` is out of range"),
            ("max_iterations = 0", "`max_iterations` is out of range"),
        ] {
            assert!(one(keys).contains(words), "{keys}: {}", one(keys));
        }
        let timed = "optimize = { time = { min = 0.5, max = 2.0 } }\n\
                     condition = [{ name = \"c\", sensor = \"angle\", equals = 1.0, at = 0.5 }]";
        assert!(words(timed).contains("the time is free"));
        let bare =
            HEAD.lines().filter(|line| !line.contains("control") && !line.contains("objective"));
        let bare: Vec<&str> = bare.collect();
        let error = Model::from_toml(&format!("{}\noptimize = {{ refine = 1 }}", bare.join("\n")));
        assert!(error.unwrap_err().to_string().contains("nothing is free"));
    }
}
