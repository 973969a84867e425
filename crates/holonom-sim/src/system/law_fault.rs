//! Why an expression of a law, a bushing or a signal has no value.

use holonom_model::expression::{Program, Undefined};
use std::sync::{Mutex, PoisonError};

/// An expression without a value: the name of the law, why, and where.
#[derive(Clone, Debug)]
pub(crate) struct LawFault {
    pub(crate) t: f64,
    pub(crate) message: String,
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
        (program, undefined): (&Program, &Undefined),
        names: &[&str],
        (at, t): (&[f64], f64),
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
