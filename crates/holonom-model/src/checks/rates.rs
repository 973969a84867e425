//! Checks of constraints on weighed rates.

use std::f64::consts::TAU;

use crate::checks::Checker;
use crate::expression::ExpressionProgram;
use crate::formula::TIME;
use crate::quantity::{Quantities, Quantity};
use crate::types::drive::VelocityTerm;
use crate::types::frame::Frame;
use crate::types::law::Formula;

/// An expression whose values differ by more than this part after a revolution has no period.
const PERIODIC: f64 = 1e-9;

impl Checker<'_> {
    pub(super) fn velocity(&mut self, key: &str, terms: &[VelocityTerm], value: Option<&Formula>) {
        self.of_velocities(key);
        let known = Quantities::new(self.model);
        if terms.is_empty() {
            let help = "write terms = [{ joint = \"…\", factor = \"…\" }, …]";
            self.report(format!("{key}.terms"), "there are no terms".to_owned(), help);
        }
        for (k, term) in terms.iter().enumerate() {
            let key = format!("{key}.terms[{k}]");
            self.velocity_term(&key, term);
            let at = format!("{key}.factor");
            if let Some(program) = self.of_places(&at, &term.factor, &known)
                && program.reads(0)
            {
                let message = "a factor does not change with time".to_owned();
                let help = "write what changes with time into `value`, or prescribe a motion";
                self.report(at, message, help);
            }
        }
        if let Some(value) = value {
            self.of_places(&format!("{key}.value"), value, &known);
        }
    }

    fn velocity_term(&mut self, key: &str, term: &VelocityTerm) {
        let of_point = [
            ("point", term.point.is_some()),
            ("direction", term.direction.is_some()),
            ("axes", term.axes != Frame::Space),
        ];
        match (&term.joint, &term.of) {
            (Some(joint), None) => {
                self.reference(format!("{key}.joint"), joint, &["joint"]);
                for (name, _) in of_point.into_iter().filter(|(_, stated)| *stated) {
                    let message = format!("`{name}` belongs to a point");
                    let help =
                        format!("remove `{name}`, or write `of = …` in the place of `joint`");
                    self.report(format!("{key}.{name}"), message, help);
                }
            }
            (None, Some(of)) => {
                self.reference(format!("{key}.of"), of, &["body"]);
                if term.freedom != 0 {
                    let message = "`freedom` belongs to a joint".to_owned();
                    self.report(format!("{key}.freedom"), message, "remove `freedom`");
                }
                if term.direction.is_none_or(|direction| direction.iter().all(|x| x.abs() < 1e-100))
                {
                    let message = "the term has no direction".to_owned();
                    self.report(
                        format!("{key}.direction"),
                        message,
                        "write one, such as [1, 0, 0]",
                    );
                }
            }
            _ => {
                let help = "write `joint = …`, or `of = …` with `direction = […]`";
                self.report(key, "a term is the rate of a joint or of a point".to_owned(), help);
            }
        }
    }

    /// An expression of the time and of places; rates and signals are of the step that follows.
    fn of_places(
        &mut self,
        key: &str,
        formula: &Formula,
        known: &Quantities<'_>,
    ) -> Option<ExpressionProgram> {
        let mut reads = Vec::new();
        let program = self.formula(key, formula, &TIME, known, &mut reads)?;
        let is_point = |quantity: &Quantity| match quantity {
            Quantity::Coordinate { .. } => true,
            Quantity::Position { of, .. } => !self.is_particle(of),
            _ => false,
        };
        if let Some(other) = reads.iter().find(|quantity| !is_point(quantity)) {
            let message =
                format!("`{}` is no joint coordinate and no place of a body", other.name());
            let help = "a constraint on velocities reads these and, in its value, the time; what a rate or a signal \
                        drives is a [[law]]";
            self.report(key, message, help);
            return None;
        }
        let turns = |quantity: &Quantity| match quantity {
            Quantity::Coordinate { joint, freedom } => {
                self.model.joint(joint).is_some_and(|own| own.pair().is_angle(*freedom))
            }
            _ => false,
        };
        let angles: Vec<usize> =
            (0..reads.len()).filter(|k| turns(&reads[*k]) && program.reads(1 + k)).collect();
        if let Some(k) = angles.into_iter().find(|k| !is_periodic(&program, 1 + k, reads.len())) {
            let name = reads[k].name();
            let message = format!("the expression has no period in the angle `{name}`");
            let help = format!(
                "read it within sin({name}), cos({name}) or tan({name}): revolutions are not counted here"
            );
            self.report(key, message, help);
        }
        Some(program)
    }
}

/// Whether a revolution of an input changes nothing, at a few places.
fn is_periodic(program: &ExpressionProgram, input: usize, count: usize) -> bool {
    let place = |k: usize, j: usize| (1.0 + (7 * k + j) as f64).sqrt().fract() - 0.5;
    let value = |y: &[f64]| program.value(y).unwrap_or(f64::NAN);
    (0..5).all(|k| {
        let mut y: Vec<f64> = (0..=count).map(|j| place(k, j)).collect();
        let here = value(&y);
        y[input] += TAU;
        let there = value(&y);
        (here - there).abs() <= PERIODIC * (1.0 + here.abs()) || here.is_nan() && there.is_nan()
    })
}
