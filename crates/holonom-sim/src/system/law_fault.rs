//! Why an expression of a law, a bushing or a signal has no value.

use crate::run::outcome::RunFailure;
use holonom_model::expression::{ExpressionProgram, UndefinedPart};
use std::sync::{Mutex, PoisonError};

/// An expression without a value: the name of the law, why, and where.
#[derive(Clone, Debug)]
pub(crate) struct LawFault {
    pub(crate) t: f64,
    pub(crate) message: String,
}

/// What to do where a law has no value.
pub(crate) const REMEDY: &str =
    "let its arguments stay where it is defined, by max, clamp or a smaller step";

impl LawFault {
    /// The failure of a run at the node `step`.
    pub(crate) fn failure(self, step: u64, t: f64) -> RunFailure {
        let message = format!("{} at t = {:.6} s", self.message, self.t);
        RunFailure { step, t, message, remedy: REMEDY.into() }
    }
}

/// The last fault of a law; no part of the state.
#[derive(Debug, Default)]
pub(crate) struct LastFault(Mutex<Option<LawFault>>);

impl LastFault {
    /// Keeps why an expression of `owner` has no value where its inputs `names` have one; not a
    /// number, by which the step is refused.
    #[cold]
    pub(crate) fn note(
        &self,
        owner: &str,
        program: &ExpressionProgram,
        undefined: &UndefinedPart,
        names: &[&str],
        at: &[f64],
        t: f64,
    ) -> f64 {
        let mut message = format!("{owner}: {undefined}");
        for (k, (name, value)) in names.iter().zip(at).enumerate() {
            if program.reads(k) && *name != "t" {
                message += &format!(", {name} = {value:.6}");
            }
        }
        if at.iter().all(|input| input.is_finite()) {
            let found = Some(LawFault { t, message });
            *self.0.lock().unwrap_or_else(PoisonError::into_inner) = found;
        }
        f64::NAN
    }

    /// What was kept.
    pub(crate) fn get(&self) -> Option<LawFault> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}
