//! What objectives count.

use super::named;
use holonom_model::{Model, ModelError, Objective, ObjectiveKind, Sensor};

/// What an objective counts; controls by their places.
pub(crate) enum Counted<'a> {
    /// `½ Σ h w²`.
    Effort(Vec<usize>),
    /// `Σ w Δθ`.
    Work(Vec<usize>),
    /// `½ Σ (Δw)²/h`.
    Rate(Vec<usize>),
    /// `Σ h`.
    Time,
    /// The deviation of what a sensor shows.
    Sensor {
        /// Of the model, where it is named.
        key: String,
        /// The sensor, and which of its numbers.
        of: (&'a Sensor, Option<&'a str>),
    },
}

impl<'a> Counted<'a> {
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
            ObjectiveKind::Sensor => {
                let key = format!("objective.{}.sensor", own.name);
                let of = named(model, &key, own.sensor.as_deref().unwrap_or_default())?;
                Self::Sensor { key, of }
            }
        })
    }
}
