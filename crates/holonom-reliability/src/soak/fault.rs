//! What the harness finds wrong.

use holonom::model::Problem;
use holonom::{ModelError, RunFailure};
use serde::{Deserialize, Serialize};

/// What was violated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// A panic.
    Panic,
    /// A number that is NaN or infinite.
    NotFinite,
    /// A constraint residual beyond round-off.
    Residual,
    /// A contact or a stop that is passed.
    Gap,
    /// A residual that is reported otherwise than it is.
    Report,
    /// A momentum map of a free system that changes.
    Momentum,
    /// The energy balance of an energy–momentum scheme.
    Energy,
    /// Energy that contact gives.
    Gain,
    /// Two equivalent schemes with different motions.
    Agreement,
    /// Another motion, effort or reaction of the mechanism stated otherwise.
    Restated,
    /// A run continued from a stored state that differs.
    Restart,
    /// A state that a refused step has changed.
    State,
    /// An error without words, names or a remedy.
    Words,
    /// A model that its own text does not give back.
    RoundTrip,
    /// A certificate that a mechanism fails.
    Certificate,
}

/// Something wrong, in words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Violation {
    /// What was violated.
    pub kind: FaultKind,
    /// How, with numbers.
    pub words: String,
}

impl Violation {
    /// A fault with its words.
    pub fn new(kind: FaultKind, words: impl Into<String>) -> Self {
        Self { kind, words: words.into() }
    }

    /// Whether another one is of the same kind; panics at the same place.
    #[must_use]
    pub fn resembles(&self, other: &Self) -> bool {
        let place = |fault: &Self| fault.words.rsplit_once('(').map(|(_, at)| at.to_owned());
        self.kind == other.kind && (self.kind != FaultKind::Panic || place(self) == place(other))
    }
}

/// Whether a message names a component, a key or a number.
fn names(message: &str) -> bool {
    message.contains('`') || message.contains(|c: char| c.is_ascii_digit())
}

/// Whether a refused model is refused in words that help.
///
/// # Errors
/// [`FaultKind::Words`].
pub fn refusal(error: &ModelError, text: &str) -> Result<(), Violation> {
    let wrong = |words: String| Err(Violation::new(FaultKind::Words, words));
    let problems = error.problems(text);
    if problems.is_empty() || error.to_string().is_empty() {
        return wrong(format!("a refusal without words: {error:?}"));
    }
    let poor = |problem: &&Problem| {
        let helps = problem.help.as_ref().is_some_and(|help| !help.is_empty());
        let named = !problem.key.is_empty() || names(&problem.message);
        problem.message.is_empty() || !helps || !named
    };
    match problems.iter().find(poor) {
        Some(problem) => wrong(format!("without a name or a remedy: {problem:?}")),
        None => Ok(()),
    }
}

/// Whether a failed run tells where it failed, why, and what to do.
///
/// # Errors
/// [`FaultKind::Words`].
pub fn failure(failure: &RunFailure) -> Result<(), Violation> {
    let RunFailure { t, message, remedy, .. } = failure;
    if t.is_finite() && !message.is_empty() && !remedy.is_empty() {
        return Ok(());
    }
    Err(Violation::new(FaultKind::Words, format!("without words or a remedy: {failure:?}")))
}
