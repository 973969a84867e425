//! The times of a search on the nodes of a run, and within their bounds.
//!
//! A step and an end are those of every verb: what they do not fit is refused where a search
//! begins, not where a model is read.

use crate::design::refused;
use holonom_model::{FreeTime, Model, ModelError};
use vi_control::transcription::SolvedMotion;

/// By how much a time may differ from that of a node, in steps.
const ON_NODE: f64 = 1e-6;

/// Gives a model the step and the end of a motion that was found.
pub(super) fn take_times(model: &mut Model, motion: &SolvedMotion) {
    model.settings.step = motion.step;
    model.settings.end = motion.step * motion.controls.len() as f64;
}

/// The node at the time `t` (s) of a condition.
///
/// # Errors
/// [`ModelError`] where there is none after the start.
pub(super) fn node(model: &Model, condition: &str, t: f64) -> Result<usize, ModelError> {
    let settings = &model.settings;
    let at = t / settings.step;
    let what = if !(0.5..settings.steps() as f64 + 0.5).contains(&at) {
        format!("a condition at {t} s, which is not after the start and not later than the end")
    } else if (at - at.round()).abs() > ON_NODE {
        format!("a condition at {t} s, where there is no node: steps are {} s", settings.step)
    } else {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // within the run
        return Ok(at.round() as usize);
    };
    let help = "write \"end\", \"path\", or a multiple of the step up to the end";
    Err(refused(&format!("condition.{condition}.at"), what, help))
}

/// The time (s) with which a search of the time begins.
///
/// # Errors
/// [`ModelError`] where it is outside of the bounds.
pub(super) fn begins(model: &Model, time: FreeTime) -> Result<f64, ModelError> {
    let guess = time.guess.unwrap_or(model.settings.end);
    if time.contains(guess) {
        return Ok(guess);
    }
    let what = format!("a search that begins with {guess} s, outside of the bounds");
    let help = format!("write a `guess` from {} to {}", time.min, time.max);
    Err(refused("optimize.time", what, help))
}
