//! Checks of conditions and of `[optimize]`.

use super::Checker;
use crate::types::body::Body;
use crate::types::condition::{Condition, ConditionKind, ConditionTime};
use crate::types::connection::Joint;
use crate::types::control::{CountedAt, ObjectiveKind};
use crate::types::drive::Constraint;
use crate::types::optimize::Optimize;
use crate::types::sensor::SensorKind;

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
            let help = match [min, max].map(f64::is_finite) {
                [true, true] => format!("write a value from {min} to {max}"),
                [true, false] => format!("write a value of {min} or more"),
                _ => format!("write a value of at most {max}"),
            };
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
        self.rates_beside(own);
    }

    /// What rest states already, or contradicts: rates of its joints at the end, of everything all
    /// velocities and momenta there.
    fn rates_beside(&mut self, rest: &Condition) {
        let model = self.model;
        let stops = |name: &str| rest.of.iter().any(|own| own == name);
        let moves = |joint: &&Joint| joint.pair().dof() > 0;
        let carried = |body: &Body| model.joints.iter().any(|joint| joint.child == body.name);
        let names_all = || {
            model.joints.iter().filter(moves).all(|joint| stops(&joint.name))
                && model.bodies.iter().all(carried)
        };
        let driven = model.constraints.iter().any(|own| matches!(own, Constraint::Motion { .. }));
        let all = !driven && (rest.of.is_empty() || names_all());
        let last = |own: &Condition| match own.at {
            ConditionTime::Word(at) => at == CountedAt::End,
            ConditionTime::Time(t) => (t - model.settings.end).abs() < 0.5 * model.settings.step,
        };
        // bounds with zero between them ask for nothing more
        let binds = |own: &Condition| {
            let [min, max] = own.bounds();
            min >= 0.0 || max <= 0.0
        };
        for own in model.conditions.iter().filter(|own| last(own) && binds(own)) {
            let Some(named) = &own.sensor else { continue };
            let name = named.split_once('.').map_or(&**named, |(name, _)| name);
            let Some(sensor) = model.sensors.iter().find(|own| own.name == name) else { continue };
            let is_its_rate = sensor.kind == SensorKind::JointRate && stops(&sensor.of);
            if is_its_rate || all && sensor.kind.is_rate() {
                let message =
                    format!("`{}` brings to rest what `{named}` is the rate of", rest.name);
                let help = format!("remove the condition, or `{}`", rest.name);
                self.report(format!("condition.{}.sensor", own.name), message, help);
            }
        }
        let momenta = model.objectives.iter().filter(|own| own.kind == ObjectiveKind::Momentum);
        for own in momenta.filter(|_| all) {
            let message = format!("`{}` lets all momenta at the end vanish", rest.name);
            let help = format!("remove the objective, or `{}`", rest.name);
            self.report(format!("objective.{}.type", own.name), message, help);
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
        for (bounds, words) in [
            ("max = 2.0", "write a value of at most 2"),
            ("min = 4.0", "write a value of 4 or more"),
            ("min = 4.0, max = 5.0", "write a value from 4 to 5"),
        ] {
            let text = format!(
                "{HEAD}condition = [{{ name = \"c\", sensor = \"angle\", equals = 3.0 }}, \
                 {{ name = \"d\", sensor = \"angle\", at = \"path\", {bounds} }}]"
            );
            let said = format!("{:?}", Model::from_toml(&text));
            assert!(said.contains(words), "{bounds}: {said}");
        }
        assert_eq!(two("sensor = \"angle\", at = \"path\", max = 4.0"), "");
        let rest =
            "condition = [{ name = \"c\", type = \"rest\" }, { name = \"d\", type = \"rest\" }]";
        assert!(words(rest).contains("asks for rest as well"));
    }

    /// A rate at the end, of what rests there.
    #[test]
    fn rest_and_a_final_rate_of_the_same_are_refused() {
        let sensors = "[[sensor]]\nname = \"rate\"\ntype = \"joint_rate\"\nof = \"j\"\n\
                       [[sensor]]\nname = \"other\"\ntype = \"joint_rate\"\nof = \"k\"\n\
                       [[sensor]]\nname = \"speed\"\ntype = \"velocity\"\nof = \"b\"\n\
                       [[sensor]]\nname = \"spin\"\ntype = \"angular_velocity\"\nof = \"b\"\n\
                       [[sensor]]\nname = \"place\"\ntype = \"position\"\nof = \"b\"\n";
        let head = HEAD
            .replace("body = [", "body = [{ name = \"e\", mass = 1.0, inertia = [1.0, 1.0, 1.0] }, ")
            .replace("joint = [", "joint = [{ name = \"k\", type = \"revolute\", parent = \"b\", child = \"e\", position = [0, 0, 0], axis = [0, 0, 1] }, ")
            .lines()
            .filter(|line| !line.contains("sensor ="))
            .collect::<Vec<_>>()
            .join("\n");
        let one = |of: &str, keys: &str| {
            let text = format!(
                "{head}\n{sensors}[[condition]]\nname = \"stop\"\ntype = \"rest\"\nof = {of}\n\
                 [[condition]]\nname = \"c\"\n{keys}\n"
            );
            Model::from_toml(&text).err().map(|error| format!("{error:?}")).unwrap_or_default()
        };
        for (of, keys) in [
            ("[]", "sensor = \"rate\"\nequals = 0.0"),
            ("[]", "sensor = \"speed.x\"\nequals = 1.0"),
            ("[]", "sensor = \"spin.z\"\nmin = 0.0"),
            ("[\"j\", \"k\"]", "sensor = \"speed.x\"\nequals = 0.0\nat = 1.0"),
            ("[\"j\"]", "sensor = \"rate\"\nequals = 0.0"),
        ] {
            let said = one(of, keys);
            assert!(said.contains("brings to rest"), "{of} {keys}: {said}");
            assert!(said.contains("condition.c.sensor") && said.contains("`stop`"), "{said}");
        }
        for (of, keys) in [
            ("[]", "sensor = \"place.x\"\nequals = 0.0"),
            ("[]", "sensor = \"rate\"\nequals = 0.0\nat = 0.5"),
            ("[]", "sensor = \"rate\"\nmax = 2.0\nat = \"path\""),
            ("[]", "sensor = \"rate\"\nmin = -1.0\nmax = 2.0"),
            ("[\"j\"]", "sensor = \"other\"\nequals = 0.0"),
            ("[\"j\"]", "sensor = \"speed.x\"\nequals = 0.0"),
        ] {
            assert_eq!(one(of, keys), "", "{of} {keys}");
        }
        let momentum =
            HEAD.replace("\"effort\" }", "\"effort\" }, { name = \"p\", type = \"momentum\" }");
        for (of, refused) in [("[]", true), ("[\"j\"]", true), ("[\"k\"]", false)] {
            let more = format!("condition = [{{ name = \"stop\", type = \"rest\", of = {of} }}]");
            let said = Model::from_toml(&format!("{momentum}{more}")).err();
            let said = said.map(|error| format!("{error:?}")).unwrap_or_default();
            assert_eq!(said.contains("objective.p.type"), refused, "{of}: {said}");
        }
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
