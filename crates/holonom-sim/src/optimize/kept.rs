//! Where a search ended, to go on from there.

use holonom_model::{ModelError, ModelText, Override};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use vi_control::program::Multipliers;
use vi_control::transcription::HeldPoint;

/// A search that has not found its optimum, as `search.json` has it: the model as it was asked for,
/// and where the search ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeptSearch {
    /// The file of the model, beside which its meshes are.
    model: PathBuf,
    /// Its text, with what it includes.
    text: String,
    /// What was set beside it.
    set: Vec<Override>,
    /// Where the search ended.
    #[serde(flatten)]
    kept: SearchEnd,
}

impl KeptSearch {
    /// Of a model file.
    ///
    /// # Errors
    /// [`ModelError`] of a text that cannot be read.
    pub fn new(
        file: &Path,
        (text, set): (&ModelText, &[Override]),
        kept: SearchEnd,
    ) -> Result<Self, ModelError> {
        let model = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
        Ok(Self { model, text: text.text()?.to_owned(), set: set.to_vec(), kept })
    }

    /// The file of the model, and its text.
    #[must_use]
    pub fn text(&self) -> (&Path, ModelText) {
        (&self.model, ModelText::from_text(&self.model, self.text.clone()))
    }

    /// What was set beside the model, and the parameters that were free, at their last values.
    #[must_use]
    pub fn overrides(&self) -> Vec<Override> {
        let free = self.kept.parameters.iter();
        let free = free
            .map(|(name, value)| Override::new(format!("parameters.{name}"), format!("{value:?}")));
        let key = |own: &Override| own.key.clone();
        let free: Vec<Override> = free.collect();
        let is_free = |own: &&Override| !free.iter().map(key).any(|free| free == own.key);
        self.set.iter().filter(is_free).cloned().chain(free.iter().cloned()).collect()
    }

    /// The point of controls.
    #[must_use]
    pub fn point(&self) -> Option<&ProgramPoint> {
        self.kept.point.as_ref()
    }
}

/// Where a search ended.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SearchEnd {
    /// The parameters that are free, with their values.
    #[serde(default)]
    pub parameters: BTreeMap<String, f64>,
    /// Of controls: the point of the nonlinear program.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point: Option<ProgramPoint>,
}

/// A point of a nonlinear program with its multipliers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProgramPoint {
    /// Steps of the motion.
    steps: usize,
    /// The configurations of its nodes, those within steps as well.
    nodes: Vec<Vec<f64>>,
    /// What joint coordinates that add up have changed by at each of them.
    travel: Vec<Vec<f64>>,
    /// The variables about these nodes.
    variables: Vec<f64>,
    /// Multipliers of equations and conditions.
    rows: Vec<f64>,
    /// Of least values.
    lower: Vec<f64>,
    /// Of largest values.
    upper: Vec<f64>,
}

impl ProgramPoint {
    /// `None` where a number is not finite: nothing goes on from there.
    pub(super) fn of(held: HeldPoint) -> Option<Self> {
        let HeldPoint { steps, nodes, travel, x: variables, multipliers } = held;
        let Multipliers { rows, lower, upper } = multipliers;
        let flat = [&variables, &rows, &lower, &upper].into_iter().chain(&nodes).chain(&travel);
        let finite = flat.flatten().all(|value| value.is_finite());
        finite.then_some(Self { steps, nodes, travel, variables, rows, lower, upper })
    }

    pub(super) fn held(&self) -> HeldPoint {
        let Self { steps, nodes, travel, variables, rows, lower, upper } = self.clone();
        let multipliers = Multipliers { rows, lower, upper };
        HeldPoint { steps, nodes, travel, x: variables, multipliers }
    }
}
