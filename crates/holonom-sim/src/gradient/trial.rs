//! Runs of a model for other values of its parameters, with the tangents along them.

use super::prepared::{self, Begin, Prepared};
use super::quantity::{Measured, Reads};
use crate::design::{self, refused};
use crate::system::outside::Outside;
use holonom_model::{Model, ModelError, ModelText, Override};
use vi_constraints::linearization::Tangent;
use vi_control::identification::{Experiment, Trial};
use vi_control::least_squares::Refused;
use vi_control::objective::Quantity;
use vi_control::sensitivities::Direction;

/// A sensor that is read.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SensorRead {
    /// The key of the model where it is named.
    pub(crate) key: String,
    /// Its name, of one of several numbers with its part.
    pub(crate) sensor: String,
}

/// The runs of a model by some of its parameters.
pub(crate) struct ModelTrials<'a> {
    pub(crate) text: &'a ModelText,
    pub(crate) overrides: &'a [Override],
    /// Their names.
    pub(crate) parameters: Vec<String>,
    /// What is measured.
    pub(crate) reads: Vec<SensorRead>,
}

impl ModelTrials<'_> {
    /// The values of the model file with these of the parameters.
    pub(crate) fn overrides(&self, theta: &[f64]) -> Vec<Override> {
        let mut overrides = self.overrides.to_vec();
        for (name, value) in self.parameters.iter().zip(theta) {
            let key = format!("parameters.{name}");
            overrides.retain(|own| own.key != key);
            overrides.push(Override::new(key, format!("{value:?}")));
        }
        overrides
    }

    /// The model for some parameters.
    ///
    /// # Errors
    /// [`ModelError`].
    pub(crate) fn model(&self, theta: &[f64]) -> Result<Model, ModelError> {
        self.text.model(&self.overrides(theta))
    }

    /// The run for some parameters.
    ///
    /// # Errors
    /// [`ModelError`], where there is none.
    pub(crate) fn trial(&self, theta: &[f64]) -> Result<Trial, ModelError> {
        let overrides = self.overrides(theta);
        let model = self.text.model(&overrides)?;
        let mut prepared = Prepared::new(&model, &[], (&[], &Outside::default()))?;
        let wanted = |name: &str| self.parameters.iter().any(|own| own == name);
        let mut tangents =
            design::tangents_of(self.text, &overrides, &model, &prepared.system, wanted)?;
        let place = |name: &str| self.parameters.iter().position(|own| own == name);
        tangents.sort_by_key(|own| place(&own.name));
        if tangents.len() < self.parameters.len() {
            let moving = |name: &&String| tangents.iter().any(|own| own.name == **name);
            let idle = self.parameters.iter().find(|name| !moving(name));
            let name = idle.map_or("", String::as_str);
            let what = format!("`{name}`, on which nothing depends");
            return Err(refused(&format!("parameters.{name}"), what, "leave it out"));
        }
        let begin = Begin::new(&model, &mut prepared)?;
        let design = prepared::design(&prepared, &begin.mass, &tangents)?;
        let mut quantities: Vec<Box<dyn Quantity>> = Vec::new();
        for SensorRead { key, sensor } in &self.reads {
            let own = Measured::of(&model, &mut prepared.system.mechanism, key, sensor)?;
            if let Some((joint, freedom)) = own.joint() {
                let reads = Reads { key: key.clone(), joint, freedom };
                if let Some(error) = tangents.iter().find_map(|own| reads.moved(&model, own)) {
                    return Err(error);
                }
            }
            quantities.push(Box::new(own));
        }
        let of = begin.of(&model, &prepared.system.mechanism);
        let mut directions = Vec::new();
        for (k, own) in tangents.iter().enumerate() {
            let change = of.change(own)?;
            let start = Tangent { q: change.q, p: change.p, z: Vec::new() };
            directions.push(Direction { start, parameter: Some(k), ..Direction::default() });
        }
        let step = model.settings.step;
        let Prepared { simulation, controls, .. } = prepared;
        let run = simulation.into_integrator();
        let design: Option<Box<dyn vi_constraints::design::Design>> = Some(Box::new(design));
        let tangents = tangents.into_iter().map(|own| own.numbers).collect();
        Ok(Trial { run, step, controls, design, directions, tangents, quantities })
    }
}

impl Experiment for ModelTrials<'_> {
    fn begin(&mut self, theta: &[f64]) -> Result<Trial, Refused> {
        self.trial(theta).map_err(|error| Refused(error.to_string()))
    }
}
