//! Section forces and strains at a place of a beam.

use super::finder::Finder;
use super::view::View;
use crate::system::load_kind;
use holonom_model::{Curves, Sensor, SensorKind};
use nalgebra::Vector3;
use std::sync::Arc;
use vi_beam::BeamElements;
use vi_beam::section_force::{BeamLoad, LineLoads, SectionPlace};
use vi_rigid::Load;

/// What a sensor of section forces or strains reads.
#[derive(Clone, Debug)]
pub(crate) struct SectionGauge {
    pub(crate) parts: Arc<BeamElements>,
    pub(crate) place: SectionPlace,
    pub(crate) strains: bool,
    gravity: Vector3<f64>, // γ, m/s²
    loads: Vec<BeamLoad>,
    beam: String,
    leg_start: f64, // m, from the start of the beam
}

impl SectionGauge {
    /// That of a sensor; `None` when the model is not valid.
    pub(super) fn of(sensor: &Sensor, from: &Finder<'_>) -> Option<Self> {
        let beam = from.beams.list.iter().find(|beam| beam.name == sensor.of)?;
        let (parts, model) = (&from.beams.parts, from.names.model);
        let mut along = sensor.at.unwrap_or_default(); // from the start of the leg
        let place = match (sensor.element, sensor.at) {
            (Some(mut element), _) => {
                let leg = beam.legs.iter().find(|leg| {
                    let inside = element < leg.elements.len();
                    element -= if inside { 0 } else { leg.elements.len() };
                    inside
                })?;
                SectionPlace::of_element(leg, element)
            }
            (None, Some(_)) => {
                let (last, legs) = beam.legs.split_last()?;
                let leg = legs.iter().find(|leg| {
                    let own = parts.length(leg);
                    let inside = along <= own;
                    along -= if inside { 0.0 } else { own };
                    inside
                });
                SectionPlace::at(parts, leg.unwrap_or(last), along)
            }
            (None, None) => return None,
        };
        let leg_start = sensor.at.unwrap_or_default() - along;
        let mut own = Self {
            parts: Arc::clone(parts),
            place,
            strains: sensor.kind == SensorKind::Strain,
            gravity: Vector3::from(model.gravity()),
            loads: Vec::new(),
            beam: beam.name.clone(),
            leg_start,
        };
        own.loads = own.loads_of(&Curves::new(model), &model.loads);
        Some(own)
    }

    /// Those of these loads that enter.
    pub(crate) fn loads_of(
        &self,
        curves: &Curves<'_>,
        loads: &[holonom_model::Load],
    ) -> Vec<BeamLoad> {
        let own = |load: &holonom_model::Load| {
            let [force, torque] = [load.force, load.torque].map(Vector3::from);
            let history = load.history.time_history(curves);
            let found = Load::new(0, load_kind(load), force, torque, history).ok()?;
            self.place.load(load.at.map(|at| at - self.leg_start), found)
        };
        let on_beam = loads.iter().filter(|load| load.beam.as_deref() == Some(&self.beam));
        on_beam.filter_map(own).collect()
    }

    /// Whether loads enter, which may have a history.
    pub(crate) fn has_loads(&self) -> bool {
        !self.loads.is_empty()
    }

    /// Whether the inertia of the beam enters.
    pub(crate) fn needs_acceleration(&self) -> bool {
        self.place.is_within_element()
    }

    pub(super) fn read(&self, at: &View<'_>, out: &mut Vec<f64>) {
        out.extend(self.numbers(at.t, at.q, at.a));
    }

    /// What acts along the beam at a time, with the accelerations of all frames.
    pub(crate) fn acting<'a>(&'a self, t: f64, acceleration: &'a [f64]) -> LineLoads<'a> {
        LineLoads { t, acceleration, gravity: self.gravity, loads: &self.loads }
    }

    /// The six numbers.
    pub(crate) fn numbers(&self, t: f64, q: &[f64], a: &[f64]) -> [f64; 6] {
        let loads = self.acting(t, a);
        self.place.read(&self.parts, q, &loads, |state| -> [f64; 6] {
            let [[a, b, c], [d, e, f]] = match self.strains {
                false => [state.force, state.moment],
                true => [state.shear_extension, state.curvature],
            };
            [a, b, c, d, e, f]
        })
    }
}
