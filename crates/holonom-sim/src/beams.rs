//! Beams of a model as numbers: nodes, elements, supports, corners.

use holonom_model::{BeamMass, End, Model, ModelError, Problem};
use nalgebra::Vector3;
use std::ops::Range;
use std::sync::Arc;
use vi_beam::section_force::{SectionState, for_each_state};
use vi_beam::{BeamModel, MassKind};
use vi_multibody::pair::PairKind;

/// What one `[[beam]]` became.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BeamParts {
    /// Its name.
    pub name: String,
    /// Its nodes among all frames.
    pub nodes: Range<usize>,
    /// Its legs.
    pub legs: Vec<vi_beam::Beam>,
}

/// The beams of a system, with all of its parts.
#[derive(Clone, Debug, Default)]
pub struct Beams {
    /// Bodies, nodes, joints, elements: what the mechanism was made from.
    pub parts: Arc<BeamModel>,
    /// The beams among them.
    pub list: Vec<BeamParts>,
}

impl Beams {
    /// Strains and section forces along a beam in the configuration `q`; elements and arc length
    /// (m) are counted along the whole beam.
    pub fn for_each_state(&self, beam: &BeamParts, q: &[f64], mut visit: impl FnMut(SectionState)) {
        let (mut elements, mut start) = (0, 0.0);
        for leg in &beam.legs {
            let mut length = 0.0;
            for_each_state(&self.parts, leg, q, |state| {
                length += state.length;
                let (element, arc_length) = (elements + state.element, start + state.arc_length);
                visit(SectionState { element, arc_length, ..state });
            });
            (elements, start) = (elements + leg.elements.len(), start + length);
        }
    }

    /// The elements of a beam as pairs of neighbouring nodes, with the number of their element.
    pub fn pairs<'a>(
        &self,
        beam: &'a BeamParts,
    ) -> impl Iterator<Item = (usize, [usize; 2])> + use<'a> {
        let mut first = 0;
        beam.legs.iter().flat_map(move |leg| {
            let (start, order) = (first, leg.order);
            first += leg.elements.len();
            let intervals = leg.nodes.start..leg.nodes.end - 1;
            intervals.enumerate().map(move |(i, node)| (start + i / order, [node, node + 1]))
        })
    }
}

/// Adds the nodes and elements of all beams after the bodies of `parts`, and the joints that hold
/// their ends and corners.
///
/// # Errors
/// [`ModelError`]; none for a valid model.
pub(crate) fn add(model: &Model, parts: &mut BeamModel) -> Result<Vec<BeamParts>, ModelError> {
    model.beams.iter().map(|beam| add_beam(beam, parts)).collect()
}

fn add_beam(beam: &holonom_model::Beam, parts: &mut BeamModel) -> Result<BeamParts, ModelError> {
    let key = |field: &str| format!("beam.{}.{field}", beam.name);
    let refuse = |key: String, message: String, help: String| {
        ModelError::Assembly(vec![Problem::new(key, message).help(help)])
    };
    let member = format!("beam.{}", beam.name);
    let below = |key: &str| {
        let prefix = format!("{member}{key}");
        move |problem: Problem| ModelError::Assembly(vec![problem.below(&prefix)])
    };
    let meshes = beam.meshes().map_err(below(""))?;
    let section = beam.section.numbers().map_err(below(".section"))?;
    let first = parts.description.bodies.len();
    let mut legs: Vec<vi_beam::Beam> = Vec::new();
    for mesh in &meshes {
        let added = match beam.order {
            1 => parts.add_beam(&beam.name, mesh, section),
            order => parts.add_high_order_beam(&beam.name, mesh, section, order),
        };
        let leg = added.map_err(|e| refuse(key("elements"), e.to_string(), String::new()))?;
        if beam.mass == BeamMass::Lumped {
            parts.elements.set_mass(leg.elements.clone(), MassKind::Lumped);
        }
        if let Some(last) = legs.last() {
            let name = format!("{}.corner{}", beam.name, legs.len());
            hold(parts, &name, PairKind::Fixed, Some(last.nodes.end - 1), leg.nodes.start);
        }
        legs.push(leg);
    }
    let nodes = first..parts.description.bodies.len();
    let own = &mut parts.description.bodies[nodes.clone()];
    let (origin, omega) = (own[0].center, Vector3::from(beam.angular_velocity));
    for (k, node) in own.iter_mut().enumerate() {
        node.name = format!("{}.{k}", beam.name); // numbered along the whole beam
        node.velocity = Vector3::from(beam.velocity) + omega.cross(&(node.center - origin));
        node.omega = omega;
    }
    for (place, end, node) in [("start", beam.start, nodes.start), ("end", beam.end, nodes.end - 1)]
    {
        let kind = match end {
            End::Free => continue,
            End::Clamped => PairKind::Fixed,
            End::Pinned => PairKind::Spherical,
        };
        hold(parts, &format!("{}.{place}", beam.name), kind, None, node);
    }
    Ok(BeamParts { name: beam.name.clone(), nodes, legs })
}

/// A joint at the place of the frame `child`.
fn hold(parts: &mut BeamModel, name: &str, kind: PairKind, parent: Option<usize>, child: usize) {
    let point = parts.description.bodies[child].center;
    let joint = parts.join(kind, parent, child, &point, &Vector3::z());
    parts.description.joints[joint].name = name.to_owned();
}
