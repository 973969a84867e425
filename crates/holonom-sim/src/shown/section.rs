//! Strains and section forces of beams, with derivatives.
//!
//! ```text
//! y(q; θ)        ∂y/∂q of both nodes, y_θ: by dual numbers, one coordinate at a time
//! y(t, q, a; θ)  ∂y/∂a as well, within a helicoidal element, where inertia, weight and loads of the
//!                beam enter ([`vi_beam::section_force`])
//! ```
//! Places move with lengths, and with numbers of sensors and loads.
//! Those in the middle of an element, and between middles, do not read `a`.

use super::{Asked, OfNode};
use crate::design::{ModelTangent, refused};
use crate::sensor::{PlaceChange, SectionGauge};
use holonom_model::{Curves, Model, ModelError, SensorKind};
use nalgebra::Vector3;
use std::sync::Arc;
use vi_beam::design::ElementsTangent;
use vi_beam::section_force::{BeamLoad, SectionPlace};
use vi_beam::section_slopes::{MovedPlace, SectionChange};
use vi_control::node::{Node, NodeQuantity, NodeReads, NodeSlopes};
use vi_core::num_dual::Dual64;

/// One of six numbers of a section.
struct SectionNumber {
    gauge: SectionGauge,
    part: usize,
    by: Vec<ChangedSection>, // in the order of the parameters
}

/// What a parameter changes of a section.
struct ChangedSection {
    elements: Option<Arc<ElementsTangent>>,
    gravity: Vector3<f64>,
    loads: Vec<BeamLoad>,
    moved: Option<(SectionPlace<Dual64>, Vec<BeamLoad<Dual64>>)>,
}

impl ChangedSection {
    /// # Errors
    /// [`ModelError`] where the place passes one at which there is a jump or a kink.
    fn of(
        own: &ModelTangent,
        gauge: &SectionGauge,
        (model, curves, name): (&Model, &Curves<'_>, &str),
    ) -> Result<Self, ModelError> {
        let longer = |element: usize| own.elements.as_ref().map_or(0.0, |all| all.longer(element));
        let at = own.along.sensors.get(name).copied().unwrap_or_default();
        let by = PlaceChange { at, loads: &own.along.loads, longer: &longer };
        let moves = own.elements.is_some() || at != 0.0 || !own.along.loads.is_empty();
        let moved = moves.then(|| gauge.moved(curves, &model.loads, by)).flatten();
        if moved.as_ref().is_some_and(|(place, loads)| place.passes(loads)) {
            let what = format!(
                "the derivative by `{}`, with which its place passes a node or a load: a jump",
                own.name
            );
            let help = "state its place between nodes, or let it follow the length of the beam";
            return Err(refused(&format!("sensor.{name}.at"), what, help));
        }
        Ok(Self {
            elements: own.elements.clone(),
            gravity: own.numbers.gravity,
            loads: gauge.loads_of(curves, &own.along_beams),
            moved,
        })
    }

    fn is_empty(&self) -> bool {
        let still = self.elements.is_none() && self.moved.is_none();
        still && self.gravity == Vector3::zeros() && self.loads.is_empty()
    }
}

impl SectionNumber {
    /// The derivative along a change of coordinates and accelerations, and by a parameter.
    fn along(&self, node: Node<'_>, [dq, da]: [&[f64]; 2], by: Option<&ChangedSection>) -> f64 {
        let SectionGauge { parts, place, strains, .. } = &self.gauge;
        let change = SectionChange {
            position: dq,
            acceleration: da,
            elements: by.and_then(|own| own.elements.as_deref()),
            gravity: by.map_or_else(Vector3::zeros, |own| own.gravity),
            loads: by.map_or(&[], |own| &own.loads),
            moved: by
                .and_then(|own| own.moved.as_ref())
                .map(|(place, loads)| MovedPlace { place, loads }),
        };
        let acting = self.gauge.acting(node.at.t, node.a);
        let [strain, stress] = place.change(parts, node.at.q, &acting, &change);
        if *strains { strain[self.part].eps } else { stress[self.part].eps }
    }
}

impl NodeQuantity for SectionNumber {
    fn value(&self, Node { at, a, .. }: Node<'_>) -> f64 {
        self.gauge.numbers(at.t, at.q, a)[self.part]
    }
    fn add_slopes(&self, node: Node<'_>, scale: f64, out: NodeSlopes<'_>) {
        let (zero, mut unit) = (vec![0.0; node.at.q.len()], vec![0.0; node.at.q.len()]);
        let accelerates = self.gauge.needs_acceleration() && !out.a.is_empty();
        for i in self.gauge.place.coordinates(&self.gauge.parts) {
            unit[i] = 1.0;
            out.q[i] += scale * self.along(node, [&unit, &[]], None);
            if accelerates {
                out.a[i] += scale * self.along(node, [&zero, &unit], None);
            }
            unit[i] = 0.0;
        }
    }
    fn by_parameter(&self, parameter: usize, node: Node<'_>) -> f64 {
        let along = |own| self.along(node, [&vec![0.0; node.at.q.len()], &[]], Some(own));
        self.by.get(parameter).filter(|own| !own.is_empty()).map_or(0.0, along)
    }
    fn reads(&self) -> NodeReads {
        NodeReads { accelerations: self.gauge.needs_acceleration(), ..NodeReads::default() }
    }
    fn reads_velocity(&self) -> bool {
        false
    }
    fn reads_time(&self) -> bool {
        self.gauge.has_loads() // which may have a history
    }
}

/// What a sensor of a section shows; `None` of others.
///
/// # Errors
/// [`holonom_model::ModelError`] where it names none of its numbers.
pub(super) fn of_sensor(asked: Asked<'_>) -> OfNode {
    let Asked { model, system, of: (sensor, _), tangents, .. } = asked;
    if !matches!(sensor.kind, SensorKind::SectionForce | SensorKind::Strain) {
        return Ok(None);
    }
    let Some(gauge) = system.sensors.section(&sensor.name).cloned() else { return Ok(None) };
    let (part, curves) = (asked.number()?, Curves::new(model));
    let of = (model, &curves, sensor.name.as_str());
    let by =
        tangents.iter().map(|own| ChangedSection::of(own, &gauge, of)).collect::<Result<_, _>>()?;
    Ok(Some(Box::new(SectionNumber { gauge, part, by })))
}
