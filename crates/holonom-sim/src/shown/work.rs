//! Works of force elements since the start, with derivatives.
//!
//! ```text
//! y = W − V(q)        W: an internal variable of the run, V: what the element stores
//! ∂y/∂W = 1,   ∂y/∂q = −∇V,   y_θ = −V_θ
//! ```
//! How `W` changes along a run is known to its steps ([`vi_core::Working`]) and to its design.

use super::{Asked, OfNode};
use crate::design::stored::{self, StoredTangent};
use crate::sensor::columns_of;
use crate::system::works::force_of;
use holonom_model::{Model, Sensor, SensorKind};
use std::sync::Arc;
use vi_control::node::{Node, NodeQuantity, NodeReads, NodeSlopes};
use vi_core::potential::DiscretePotential;

/// The work of a force and of what its element stores.
struct Done {
    place: usize, // among the internal variables
    stored: Option<Arc<dyn DiscretePotential>>,
    by: Vec<Option<StoredTangent>>, // V_θ, in the order of the parameters
}

impl NodeQuantity for Done {
    fn value(&self, Node { at, .. }: Node<'_>) -> f64 {
        let stored = self.stored.as_ref().map_or(0.0, |own| own.potential(at));
        at.internal.get(self.place).map_or(f64::NAN, |own| own - stored)
    }
    fn add_slopes(&self, Node { at, .. }: Node<'_>, scale: f64, out: NodeSlopes<'_>) {
        if let Some(z) = out.z.get_mut(self.place) {
            *z += scale;
        }
        if let Some(own) = &self.stored {
            own.add_gradient(at, -scale, out.q);
        }
    }
    fn by_parameter(&self, parameter: usize, Node { at, .. }: Node<'_>) -> f64 {
        let by = self.by.get(parameter).and_then(Option::as_ref);
        by.map_or(0.0, |by| -by(at))
    }
    fn reads(&self) -> NodeReads {
        NodeReads { internal: true, ..NodeReads::default() }
    }
    fn reads_velocity(&self) -> bool {
        false
    }
}

/// The forces whose works these sensors show.
pub(crate) fn forces_of<'a>(
    model: &Model,
    sensors: impl Iterator<Item = &'a Sensor>,
) -> Vec<String> {
    let of = |own: &Sensor| -> Vec<String> {
        let columns = columns_of(model, own);
        columns.iter().map(|column| force(own, &column.part)).collect()
    };
    let mut all: Vec<String> =
        sensors.filter(|own| own.kind == SensorKind::Work).flat_map(of).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// The force of a part of what a sensor is of.
fn force(sensor: &Sensor, part: &str) -> String {
    match part {
        "" => sensor.of.clone(),
        part => force_of(&sensor.of, part),
    }
}

/// What a sensor of works shows; `None` of others.
///
/// # Errors
/// [`ModelError`] of one that has no derivative.
pub(super) fn of_sensor(asked: Asked<'_>) -> OfNode {
    let Asked { model, system, of: (sensor, _), tangents, .. } = asked;
    if sensor.kind != SensorKind::Work {
        return Ok(None);
    }
    let part = asked.number()?;
    let force = force(sensor, &columns_of(model, sensor)[part].part);
    let (mechanism, dynamics) = (&system.mechanism, &system.dynamics);
    let place = dynamics.works.iter().position(|own| own.force == force);
    let place = place.ok_or_else(|| asked.refused())?;
    let stored = dynamics.works[place].stored.as_ref();
    let by = |own| stored::by_parameter(stored?, &force, mechanism, own);
    let by = tangents.iter().map(by).collect();
    let first = dynamics.variational(mechanism).places_of_works().start;
    Ok(Some(Box::new(Done { place: first + place, stored: stored.map(|own| own.energy()), by })))
}
