//! Checks of laws and tables.

use crate::GROUND;
use crate::checks::Checker;
use crate::expression::{Program, is_reserved};
use crate::formula::{ALONG, Curves};
use crate::frames::start::coincide;
use crate::types::law::{Formula, Law};
use crate::types::table::Table;

impl Checker<'_> {
    pub(crate) fn table(&mut self, key: &str, table: &Table) {
        let name = table.name.as_str();
        let plain = name.chars().all(|c| c.is_alphanumeric() || c == '_')
            && !name.starts_with(|c: char| c.is_numeric());
        if is_reserved(name) || ALONG.contains(&name) || !plain {
            let message = format!("expressions cannot call a table `{name}`");
            let help = "choose another name: letters, digits and _, a letter first, no function of expressions";
            self.report(format!("{key}.name"), message, help);
        }
        if table.columns.is_some() {
            let message = "only a file has columns with headings".to_owned();
            self.report(format!("{key}.columns"), message, "remove `columns`, or add `file`");
        }
        if let Some(fault) = table.fault() {
            let help = "write points = [[x, y], …] with increasing x";
            self.report(format!("{key}.points"), fault, help);
        }
    }

    pub(crate) fn law(&mut self, key: &str, law: &Law, curves: &Curves<'_>) {
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
                let help =
                    "add `joint = …` with `effort = …`, or `from = …`, `to = …` with `tension = …`";
                self.report(key, "the law acts on nothing".into(), help);
            }
        }
        match law.formula() {
            Some((name, formula)) => {
                let at = format!("{key}.{name}");
                if let Some(program) = self.formula(&at, formula, &ALONG, curves)
                    && law.conservative
                    && !program.reads(2)
                {
                    let message = "a law that does not read `v` is conservative anyway".to_owned();
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

    /// Compiles an expression, or reports why it is none.
    pub(crate) fn formula(
        &mut self,
        key: &str,
        formula: &Formula,
        own: &[&str],
        curves: &Curves<'_>,
    ) -> Option<Program> {
        if let Some(rest) = formula.0.trim_start().strip_prefix('=') {
            let message = format!("a law has no `=`: it is evaluated along the run, not once");
            self.report(key, message, format!("write \"{}\"", rest.trim()));
            return None;
        }
        match curves.compile(formula, own) {
            Ok(program) => Some(program),
            Err(error) => {
                let message = format!("the expression `{}`: {}", formula.0.trim(), error.message);
                self.report(key, message, error.help);
                None
            }
        }
    }
}
