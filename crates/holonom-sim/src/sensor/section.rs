//! Section forces and strains at a place of a beam.

use super::finder::Finder;
use super::view::View;
use crate::system::load_kind;
use holonom_model::{Curves, Sensor, SensorKind};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;
use vi_beam::BeamElements;
use vi_beam::section_force::{BeamLoad, LineLoads, SectionPlace};
use vi_core::num_dual::Dual64;
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
    along: Option<PlaceOnBeam>, // None: in the middle of an element
}

/// Where along a beam a sensor is.
#[derive(Clone, Debug)]
struct PlaceOnBeam {
    leg: vi_beam::Beam,
    at: f64,              // m, from the start of the beam
    start: f64,           // of the leg, m
    before: Range<usize>, // elements before the leg
}

/// How the place of a sensor and those of loads change, m.
#[derive(Clone, Copy)]
pub(crate) struct PlaceChange<'a> {
    /// Of the sensor.
    pub(crate) at: f64,
    /// Of loads, by their names.
    pub(crate) loads: &'a BTreeMap<String, f64>,
    /// Lengths of elements.
    pub(crate) longer: &'a dyn Fn(usize) -> f64,
}

impl SectionGauge {
    /// That of a sensor; `None` when the model is not valid.
    pub(super) fn of(sensor: &Sensor, from: &Finder<'_>) -> Option<Self> {
        let beam = from.beams.list.iter().find(|beam| beam.name == sensor.of)?;
        let (parts, model) = (&from.beams.parts, from.names.model);
        let mut along = None;
        let place = match (sensor.element, sensor.at) {
            (Some(mut element), _) => {
                let leg = beam.legs.iter().find(|leg| {
                    let inside = element < leg.elements.len();
                    element -= if inside { 0 } else { leg.elements.len() };
                    inside
                })?;
                SectionPlace::of_element(leg, element)
            }
            (None, Some(at)) => {
                let (last, legs) = beam.legs.split_last()?;
                let mut own = at; // from the start of the leg
                let leg = legs.iter().find(|leg| {
                    let length = parts.length(leg);
                    let inside = own <= length;
                    own -= if inside { 0.0 } else { length };
                    inside
                });
                let leg = leg.unwrap_or(last).clone();
                let before = beam.legs.first()?.elements.start..leg.elements.start;
                let place = SectionPlace::at(parts, &leg, own);
                along = Some(PlaceOnBeam { leg, at, start: at - own, before });
                place
            }
            (None, None) => return None,
        };
        let mut own = Self {
            parts: Arc::clone(parts),
            place,
            strains: sensor.kind == SensorKind::Strain,
            gravity: Vector3::from(model.gravity()),
            loads: Vec::new(),
            beam: beam.name.clone(),
            along,
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
            let start = self.along.as_ref().map_or(0.0, |along| along.start);
            self.place.load(load.at.map(|at| at - start), found)
        };
        let on_beam = loads.iter().filter(|load| load.beam.as_deref() == Some(&self.beam));
        on_beam.filter_map(own).collect()
    }

    /// The place with its derivative, and those of `loads` that enter; `None` in the middle of an
    /// element.
    pub(crate) fn moved(
        &self,
        curves: &Curves<'_>,
        loads: &[holonom_model::Load],
        by: PlaceChange<'_>,
    ) -> Option<(SectionPlace<Dual64>, Vec<BeamLoad<Dual64>>)> {
        let own = self.along.as_ref()?;
        let length = |element: usize| {
            let element_length = self.parts.elements.list()[element].length;
            Dual64::new(element_length, (by.longer)(element))
        };
        let start = Dual64::new(own.start, own.before.clone().map(by.longer).sum());
        let along = Dual64::new(own.at, by.at) - start;
        let place = SectionPlace::at_with(&self.parts, &own.leg, along, length);
        let load = |load: &holonom_model::Load| {
            let history = load.history.time_history(curves);
            let none = Vector3::zeros();
            let found = Load::new(0, load_kind(load), none, none, history).ok()?;
            let slope = by.loads.get(&load.name).copied().unwrap_or_default();
            place.load(load.at.map(|at| Dual64::new(at, slope) - start), found)
        };
        let on_beam = loads.iter().filter(|load| load.beam.as_deref() == Some(&self.beam));
        let loads = on_beam.filter_map(load).collect();
        Some((place, loads))
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
