//! Checks of laws and tables.

use crate::checks::Checker;
use crate::expression::{ExpressionProgram, is_reserved, is_word};
use crate::formula::{ALONG, MOTION};
use crate::frames::start::{coincide, distance};
use crate::quantity::{Quantities, Quantity};
use crate::types::frame::Frame;
use crate::types::law::{Formula, Law};
use crate::types::table::Table;
use crate::{GROUND, Spring, SpringLaw};

impl Checker<'_> {
    pub(crate) fn table(&mut self, key: &str, table: &Table) {
        let name = table.name.as_str();
        if is_reserved(name) || ALONG.contains(&name) || !is_word(name) {
            let message = format!("expressions cannot call a table `{name}`");
            let help = "choose another name: letters, digits and _, a letter first, no function of expressions";
            self.report(format!("{key}.name"), message, help);
        }
        if table.columns.is_some() {
            let message = "only a file has columns with headings".to_owned();
            self.report(format!("{key}.columns"), message, "remove `columns`, or add `file`");
        }
        if table.grid {
            let message = "only a file has a grid of its own".to_owned();
            let help = "write axes = [[x, …], [y, …]] and values = [[…], …]";
            self.report(format!("{key}.grid"), message, help);
        }
        let on_grid = table.axes.is_some();
        if on_grid && !table.points.is_empty() {
            let message = "the values are stated twice".to_owned();
            self.report(format!("{key}.points"), message, "keep `points`, or `axes` and `values`");
        }
        if !on_grid && !table.values.is_empty() {
            let message = "nothing says where these values are".to_owned();
            self.report(format!("{key}.values"), message, "add axes = [[x, …], [y, …]]");
        } else if let Some(fault) = table.fault() {
            let (part, help) = match on_grid {
                true => {
                    ("axes", "write axes = [[x, …], [y, …]], increasing, and values = [[…], …]")
                }
                false => ("points", "write points = [[x, y], …] with increasing x"),
            };
            self.report(format!("{key}.{part}"), fault, help);
        }
    }

    pub(crate) fn law(&mut self, key: &str, law: &Law, known: &Quantities<'_>) {
        if law.on.is_some() {
            return self.law_on(key, law, known);
        }
        self.unwanted(
            key,
            "a body",
            &[
                ("point", law.point.is_some()),
                ("force", law.force.is_some()),
                ("torque", law.torque.is_some()),
                ("axes", law.axes != Frame::Space),
            ],
        );
        let points = law.from.is_some() || law.to.is_some();
        match (&law.joint, points) {
            (Some(joint), false) => {
                self.reference(format!("{key}.joint"), joint, &["joint"]);
                self.unwanted(
                    key,
                    "points",
                    &[
                        ("tension", law.tension.is_some()),
                        ("point_from", law.point_from.is_some()),
                        ("point_to", law.point_to.is_some()),
                        ("relative_to", law.relative_to.is_some()),
                    ],
                );
            }
            (None, true) => {
                self.unwanted(
                    key,
                    "a joint",
                    &[("effort", law.effort.is_some()), ("freedom", law.freedom != 0)],
                );
                self.law_between_points(key, law);
            }
            (Some(_), true) => {
                let message = "the law acts on a joint and between points".to_owned();
                self.report(format!("{key}.joint"), message, "write two laws");
            }
            (None, false) => {
                let help = "add `joint = …` with `effort = …`, `from = …` and `to = …` with `tension = …`, or `on = …` with `force = […]`";
                self.report(key, "the law acts on nothing".into(), help);
            }
        }
        match law.formula() {
            Some((name, formula)) => {
                let at = format!("{key}.{name}");
                let mut reads = Vec::new();
                if let Some(program) = self.formula(&at, formula, &ALONG, known, &mut reads)
                    && law.conservative
                    && !program.reads(2)
                    && !reads.iter().any(Quantity::is_rate)
                {
                    let message = "a law that reads no rate is conservative anyway".to_owned();
                    self.report(format!("{key}.conservative"), message, "remove `conservative`");
                }
            }
            None => {
                let name = if points { "tension" } else { "effort" };
                let help = format!("add `{name} = \"…\"`, an expression of t, x and v");
                self.report(key, "the law has no expression".into(), help);
            }
        }
    }

    /// On a body or a particle.
    fn law_on(&mut self, key: &str, law: &Law, known: &Quantities<'_>) {
        self.unwanted(
            key,
            "points or a joint",
            &[
                ("joint", law.joint.is_some()),
                ("freedom", law.freedom != 0),
                ("effort", law.effort.is_some()),
                ("from", law.from.is_some()),
                ("to", law.to.is_some()),
                ("point_from", law.point_from.is_some()),
                ("point_to", law.point_to.is_some()),
                ("tension", law.tension.is_some()),
            ],
        );
        let on = law.on.as_deref().unwrap_or_default();
        self.reference(format!("{key}.on"), on, &["body", "particle"]);
        self.base_of_law(key, law);
        let particle = self.is_particle(on);
        let parts = [
            ("torque", law.torque.is_some(), "has no rotation"),
            ("point", law.point.is_some(), "has no other points"),
            ("axes", law.axes == Frame::Body, "has no axes of its own"),
        ];
        for (part, _, why) in parts.into_iter().filter(|(_, stated, _)| particle && *stated) {
            let message = format!("`{on}` is a particle, it {why}");
            self.report(format!("{key}.{part}"), message, format!("remove `{part}`"));
        }
        if law.force.is_none() && law.torque.is_none() {
            let help = "add `force = [\"…\", \"…\", \"…\"]`, or `torque`";
            self.report(key, "the law has no expression".into(), help);
        }
        if !particle && self.model.settings.scheme.is_energy_momentum() {
            let scheme = self.model.settings.scheme.name();
            let message = format!("the scheme {scheme} has no laws on bodies");
            let help = "write a variational scheme, such as \"nodal\"";
            self.report(format!("{key}.on"), message, help);
        }
        let own = &MOTION[..if particle { 7 } else { MOTION.len() }];
        let (mut reads_rates, mut reads) = (false, Vec::new());
        for (name, vector) in [("force", &law.force), ("torque", &law.torque)] {
            for (k, formula) in vector.iter().flatten().enumerate() {
                let key = format!("{key}.{name}[{k}]");
                let program = self.formula(&key, formula, own, known, &mut reads);
                let rates =
                    |program: ExpressionProgram| (4..own.len()).any(|input| program.reads(input));
                reads_rates |= program.is_none_or(rates) || reads.iter().any(Quantity::is_rate);
            }
        }
        if law.conservative && !reads_rates {
            let message = "a law that reads no rate is conservative anyway".to_owned();
            self.report(format!("{key}.conservative"), message, "remove `conservative`");
        }
    }

    /// The body along whose axes a law on another member reads and acts.
    fn base_of_law(&mut self, key: &str, law: &Law) {
        let Some(base) = &law.relative_to else { return };
        let key = format!("{key}.relative_to");
        if base == GROUND {
            let message = "laws on bodies are relative to the ground by themselves".to_owned();
            return self.report(key, message, "remove `relative_to`");
        }
        if law.on.as_ref() == Some(base) {
            let message = format!("`{base}` does not move relative to itself");
            return self.report(key, message, "name another body");
        }
        self.reference(key, base, &["body"]);
    }

    /// The tension of a spring at the start, from which its natural length follows.
    pub(crate) fn initial_tension(&mut self, key: &str, spring: &Spring) {
        let Some(tension) = spring.tension else { return };
        let [a, b] = self.points.spring(spring);
        let length = distance([a, b]);
        let natural = length - tension / spring.stiffness;
        let fault = match () {
            () if spring.natural_length.is_some() => {
                Some("the length is stated, too: remove `natural_length`")
            }
            () if spring.law != SpringLaw::Linear => {
                Some("the spring is not linear: write `natural_length`")
            }
            () if spring.stiffness <= 0.0 => {
                Some("a spring without stiffness has none: write a [[law]]")
            }
            () if coincide(&[a, b]) => Some("both ends start at the same point: move one of them"),
            () => None,
        };
        if let Some(fault) = fault {
            let message = format!("the spring cannot have a tension of {tension} N at the start");
            return self.report(format!("{key}.tension"), message, fault);
        }
        if natural < 0.0 {
            let message = format!("the natural length would be {natural} m");
            let most = spring.stiffness * length;
            let help = format!("write at most {most} N, a greater stiffness, or a [[law]]");
            self.report(format!("{key}.tension"), message, help);
        }
    }

    /// What belongs to another kind of law.
    fn unwanted(&mut self, key: &str, of: &str, stated: &[(&str, bool)]) {
        for (name, _) in stated.iter().filter(|(_, stated)| *stated) {
            let message = format!("`{name}` belongs to a law of {of}");
            self.report(format!("{key}.{name}"), message, format!("remove `{name}`"));
        }
    }

    fn law_between_points(&mut self, key: &str, law: &Law) {
        let ends = [("from", &law.from, &law.point_from), ("to", &law.to, &law.point_to)];
        let mut known = true;
        for (end, name, point) in ends {
            let Some(name) = name else {
                known = false;
                let help = format!("add `{end} = …`, a body, a particle, or `ground`");
                self.report(key, format!("the law has no `{end}`"), help);
                continue;
            };
            known &= self.refers(format!("{key}.{end}"), name, &["body", "particle", GROUND]);
            if let Some(point) = point {
                self.length(&format!("{key}.point_{end}"), point, false);
                if self.kinds.get(name.as_str()) == Some(&"particle") {
                    let message = format!("`{name}` is a particle, it has no other points");
                    let help = format!("remove `point_{end}`");
                    self.report(format!("{key}.point_{end}"), message, help);
                }
            }
        }
        let (Some(from), Some(to)) = (&law.from, &law.to) else { return };
        self.two_ends(&format!("{key}.to"), from, to);
        let [a, b] = [(from, &law.point_from), (to, &law.point_to)]
            .map(|(name, point)| self.points.point(name, point.as_deref()));
        if known && from != to && coincide(&[a, b]) {
            let message =
                "both ends start at the same point: its force has no direction".to_owned();
            self.report(key, message, "move one of them, or let the law act on a joint");
        }
    }

    /// Compiles an expression that is evaluated within steps, or reports why it is none.
    pub(crate) fn formula(
        &mut self,
        key: &str,
        formula: &Formula,
        own: &[&str],
        known: &Quantities<'_>,
        reads: &mut Vec<Quantity>,
    ) -> Option<ExpressionProgram> {
        let first = reads.len();
        let program = self.formula_of_node(key, formula, own, known, reads)?;
        let Some(late) = reads[first..].iter().find(|read| read.is_of_step()) else {
            return Some(program);
        };
        let name = late.name();
        let message = format!(
            "the expression `{}`: `{name}` is known with the step that follows",
            formula.0.trim()
        );
        let help = format!(
            "read it by a signal: [[signal]] with every = {:?} and value = \"{name}\", or by `delay`",
            self.model.settings.step
        );
        self.report(key, message, help);
        None
    }

    /// Compiles an expression that is evaluated at nodes, where it may read every sensor.
    pub(crate) fn formula_of_node(
        &mut self,
        key: &str,
        formula: &Formula,
        own: &[&str],
        known: &Quantities<'_>,
        reads: &mut Vec<Quantity>,
    ) -> Option<ExpressionProgram> {
        if let Some(rest) = formula.0.trim_start().strip_prefix('=') {
            let message = "a law has no `=`: it is evaluated along the run, not once".to_owned();
            self.report(key, message, format!("write \"{}\"", rest.trim()));
            return None;
        }
        match known.compile(formula, own, reads) {
            Ok(program) => Some(program),
            Err(error) => {
                let message = format!("the expression `{}`: {}", formula.0.trim(), error.message);
                self.report(key, message, error.help);
                None
            }
        }
    }
}
