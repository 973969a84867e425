//! Modes in a scene: shapes about a configuration, which the viewer displaces.
//!
//! ```text
//! x + a (u cos φ − u' sin φ) e^{±δt}        a: the amplitude of the pictures, 0.15 of the size of the configuration
//! ```
//! Damping ratios and frequencies are not to scale: what a shape is drawn as is said in words.

use std::collections::BTreeMap;

use holonom_model::{Model, ModelError};
use holonom_sim::modes::{Mode, ModeKind, Report};
use holonom_sim::output::Frames;
use serde::Serialize;

use super::{NUMBERS, Scene, SceneMotion, SceneParameter, encoded};
use crate::facts::rounded;

/// A mode as the viewer draws it.
#[derive(Debug, Serialize)]
pub(super) struct SceneMode {
    /// In the list of modes.
    name: String,
    /// What it is, and what it is drawn as.
    words: String,
    kind: ModeKind,
    /// Whether a mode that grows also vibrates.
    vibrates: bool,
    /// Of each member: displacement, rotation vector, and both a quarter of a period before.
    shape: String,
}

impl Scene {
    /// The modes of a report; as many as a page of usual size holds. `None` where nothing can be
    /// shown.
    ///
    /// # Errors
    /// [`ModelError`] when the model cannot be assembled.
    pub fn of_modes(model: &Model, report: &Report) -> Result<Option<Self>, ModelError> {
        let initial = Frames::initial(model)?; // parts are described there
        let times = vec![report.t];
        let start = Frames { times: times.clone(), ..initial.clone() };
        let about = Frames { times, q: vec![report.configuration.clone()], ..initial };
        let Some(scene) = Self::new(model, &start, &BTreeMap::new(), None) else { return Ok(None) };
        let most = (NUMBERS / (12 * about.members.len().max(1))).max(1);
        let modes: Vec<SceneMode> =
            report.modes.iter().take(most).enumerate().map(|(k, mode)| shape(k, mode)).collect();
        let parameter = if modes.is_empty() { SceneParameter::None } else { SceneParameter::Mode };
        let motions = vec![SceneMotion::new("", true, &about)];
        Ok(Some(Self { parameter, motions, modes, ..scene }))
    }
}

fn shape(k: usize, mode: &Mode) -> SceneMode {
    let of_member = mode.shape.iter().flat_map(|m| {
        [m.translation, m.rotation, m.translation_before, m.rotation_before].into_iter().flatten()
    });
    SceneMode {
        name: format!("{}: {}", k + 1, short(mode)),
        words: format!("Mode {}, {}", k + 1, words(mode)),
        kind: mode.kind,
        vibrates: mode.omega > 0.0,
        shape: encoded(of_member),
    }
}

/// A mode in a list.
fn short(mode: &Mode) -> String {
    match mode.kind {
        ModeKind::Unstable => "unstable".to_owned(),
        ModeKind::Zero => "0 Hz".to_owned(),
        ModeKind::Vibration => format!("{} Hz", rounded(mode.frequency, 5)),
        ModeKind::Decay => "dies out".to_owned(),
        ModeKind::Buckling => {
            format!("{} × load", rounded(mode.load_factor.unwrap_or_default(), 5))
        }
    }
}

/// What a mode is, and what it is drawn as.
fn words(mode: &Mode) -> String {
    let [frequency, growth, decay] =
        [mode.frequency, mode.growth, mode.decay].map(|value| rounded(value, 7));
    match mode.kind {
        ModeKind::Unstable if mode.omega > 0.0 => format!(
            "unstable vibration of {frequency} Hz: grows as e^(δt), δ = {growth} 1/s. Drawn with three periods; their ratio \
             to the growth is not to scale."
        ),
        ModeKind::Unstable => {
            format!("unstable: grows as e^(δt), δ = {growth} 1/s, without a vibration.")
        }
        ModeKind::Zero => {
            "without stiffness: 0 Hz. No vibration: drawn to and fro to show the direction."
                .to_owned()
        }
        ModeKind::Vibration if mode.decay > 0.0 => format!(
            "vibration of {frequency} Hz, damping ratio {}: dies out as e^(−δt), δ = {decay} 1/s. Drawn without its decay.",
            rounded(mode.damping_ratio, 4)
        ),
        ModeKind::Vibration => format!("vibration of {frequency} Hz."),
        ModeKind::Decay => format!("dies out as e^(−δt), δ = {decay} 1/s, without a vibration."),
        ModeKind::Buckling => format!(
            "buckles at {} times the loads. Drawn to and fro to show the shape.",
            rounded(mode.load_factor.unwrap_or_default(), 7)
        ),
    }
}
