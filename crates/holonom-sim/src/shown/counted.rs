//! What objectives count.

use super::named;
use holonom_model::{Model, ModelError, Objective, ObjectiveKind, Sensor};
use vi_control::objective::NumberCost;

/// What an objective counts; controls by their places.
pub(crate) enum CountedTerm<'a> {
    /// `½ Σ h w²`.
    Effort(Vec<usize>),
    /// `Σ w Δθ`.
    Work(Vec<usize>),
    /// `½ Σ (Δw)²/h`.
    Rate(Vec<usize>),
    /// `Σ h`.
    Time,
    /// `½ Σ ᴾp²` at the end.
    Momentum,
    /// What a sensor shows.
    Sensor {
        /// Of the model, where it is named.
        key: String,
        /// The sensor, and which of its numbers.
        of: (&'a Sensor, Option<&'a str>),
        /// What of it costs.
        judged: NumberCost,
    },
}

impl<'a> CountedTerm<'a> {
    /// Of an objective of a model.
    ///
    /// # Errors
    /// [`ModelError`] where its sensor is none.
    pub(crate) fn of(model: &'a Model, own: &'a Objective) -> Result<Self, ModelError> {
        let is_of = |name: &String| own.controls.is_empty() || own.controls.contains(name);
        let places = (0..model.controls.len()).filter(|&k| is_of(&model.controls[k].name));
        Ok(match own.kind {
            ObjectiveKind::Effort => Self::Effort(places.collect()),
            ObjectiveKind::Work => Self::Work(places.collect()),
            ObjectiveKind::Rate => Self::Rate(places.collect()),
            ObjectiveKind::Time => Self::Time,
            ObjectiveKind::Momentum => Self::Momentum,
            ObjectiveKind::Sensor | ObjectiveKind::Value => {
                let key = format!("objective.{}.sensor", own.name);
                let of = named(model, &key, own.sensor.as_deref().unwrap_or_default())?;
                let judged = match own.kind {
                    ObjectiveKind::Value => NumberCost::Itself,
                    _ => NumberCost::Deviation(own.target),
                };
                Self::Sensor { key, of, judged }
            }
        })
    }
}
