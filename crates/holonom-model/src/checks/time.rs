//! Checks of functions of time: histories and paths.

use crate::checks::Checker;
use crate::expression::{ExpressionProgram, UndefinedPart};
use crate::formula::TIME;
use crate::quantity::{Quantities, Quantity};
use crate::{Formula, History, MotionPath};

impl Checker<'_> {
    /// The history of a load or a motor.
    pub(crate) fn history(&mut self, key: &str, history: &History, known: &Quantities<'_>) {
        if let Some(fault) = history.fault() {
            self.report(key, fault, "correct the history");
        }
        let History::Expression(formula) = history else { return };
        let instead = "write a [[law]]: its expressions read";
        self.of_time(key, formula, known, instead, |own| own.value(&[0.0]).err());
    }

    /// The path of a motor or a prescribed motion.
    pub(crate) fn path(&mut self, key: &str, path: &MotionPath, known: &Quantities<'_>) {
        if let Some(fault) = path.fault() {
            self.report(format!("{key}.{}", fault.key), fault.message, fault.help);
        }
        let Some(formula) = &path.expression else { return };
        let instead = "write a [[law]] that leads the joint: its expressions read";
        self.of_time(key, formula, known, instead, |own| own.taylor(0.0).err());
    }

    /// An expression of the time alone, which is defined at the start.
    fn of_time(
        &mut self,
        key: &str,
        formula: &Formula,
        known: &Quantities<'_>,
        instead: &str,
        undefined: impl Fn(&ExpressionProgram) -> Option<UndefinedPart>,
    ) {
        let mut reads = Vec::new();
        let Some(program) = self.formula(key, formula, &TIME, known, &mut reads) else { return };
        let names: Vec<String> = reads.iter().map(Quantity::name).collect();
        if let Some(name) = names.first() {
            let message = format!("a function of time does not read `{name}`");
            self.report(key, message, format!("{instead} `{name}`"));
        } else if let Some(undefined) = undefined(&program) {
            let message = format!("the expression `{}` at t = 0: {undefined}", formula.0.trim());
            self.report(key, message, "let its value be a finite number from the start on");
        }
    }
}
