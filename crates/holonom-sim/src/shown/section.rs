//! Strains and section forces of beams, with derivatives.
//!
//! ```text
//! y(q; θ)        ∂y/∂q of both nodes, y_θ: by dual numbers, one coordinate at a time
//! ```
//! Those in the middle of an element, and between middles; within a helicoidal element the inertia
//! of the beam enters ([`vi_beam::section_force`]).

use super::{Asked, OfNode};
use crate::design::refused;
use crate::sensor::SectionGauge;
use holonom_model::SensorKind;
use nalgebra::Vector3;
use std::sync::Arc;
use vi_beam::design::ElementsTangent;
use vi_beam::section_slopes::SectionChange;
use vi_control::node::{Node, NodeQuantity, Slopes};

/// One of six numbers of a section.
struct Section {
    gauge: SectionGauge,
    part: usize,
    by: Vec<Option<Arc<ElementsTangent>>>, // in the order of the parameters
}

impl Section {
    /// The derivative along a change of coordinates, and of the numbers of elements.
    fn along(&self, node: Node<'_>, dq: &[f64], elements: Option<&ElementsTangent>) -> f64 {
        let SectionGauge { parts, place, strains, .. } = &self.gauge;
        let (position, gravity) = (dq, Vector3::zeros());
        let change = SectionChange { position, acceleration: &[], elements, gravity, loads: &[] };
        let acting = self.gauge.acting(node.at.t, &[]);
        let [strain, stress] = place.change(parts, node.at.q, &acting, &change);
        if *strains { strain[self.part].eps } else { stress[self.part].eps }
    }
}

impl NodeQuantity for Section {
    fn value(&self, Node { at, .. }: Node<'_>) -> f64 {
        self.gauge.numbers(at.t, at.q, &[])[self.part]
    }
    fn add_slopes(&self, node: Node<'_>, scale: f64, out: Slopes<'_>) {
        let mut unit = vec![0.0; node.at.q.len()];
        for i in self.gauge.place.coordinates(&self.gauge.parts) {
            unit[i] = 1.0;
            out.q[i] += scale * self.along(node, &unit, None);
            unit[i] = 0.0;
        }
    }
    fn by_parameter(&self, parameter: usize, node: Node<'_>) -> f64 {
        let own = self.by.get(parameter).and_then(Option::as_deref);
        own.map_or(0.0, |own| self.along(node, &vec![0.0; node.at.q.len()], Some(own)))
    }
    fn reads_velocity(&self) -> bool {
        false
    }
}

/// What a sensor of a section shows; `None` of others.
///
/// # Errors
/// [`ModelError`] where it names none of its numbers, or within an element.
pub(super) fn of_sensor(asked: Asked<'_>) -> OfNode {
    let Asked { system, key, of: (sensor, _), tangents, .. } = asked;
    if !matches!(sensor.kind, SensorKind::SectionForce | SensorKind::Strain) {
        return Ok(None);
    }
    let Some(gauge) = system.sensors.section(&sensor.name).cloned() else { return Ok(None) };
    let part = asked.number()?;
    if gauge.needs_acceleration() {
        let what = format!(
            "the derivative of the sensor `{}` within an element, where the inertia of the beam \
             enters",
            sensor.name
        );
        return Err(refused(key, what, "write `element` in the place of `at`: its middle"));
    }
    let by = tangents.iter().map(|own| own.elements.clone()).collect();
    Ok(Some(Box::new(Section { gauge, part, by })))
}
