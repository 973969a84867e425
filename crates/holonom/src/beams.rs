//! Beams of a model as numbers: nodes, elements, supports, corners.

use crate::model::{self, BeamMass, End, Model, ModelError, Problem};
use nalgebra::Vector3;
use std::ops::Range;
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

/// Adds the nodes and elements of all beams after the bodies of `parts`, and the joints that hold
/// their ends and corners.
///
/// # Errors
/// [`ModelError`]; none for a valid model.
pub(crate) fn add(model: &Model, parts: &mut BeamModel) -> Result<Vec<BeamParts>, ModelError> {
    model.beams.iter().map(|beam| add_beam(beam, parts)).collect()
}

fn add_beam(beam: &model::Beam, parts: &mut BeamModel) -> Result<BeamParts, ModelError> {
    let key = |field: &str| format!("beam.{}.{field}", beam.name);
    let refuse = |key: String, message: String, help: String| {
        ModelError::Assembly(vec![Problem::new(key, message).help(help)])
    };
    let meshes = beam.meshes().map_err(|(f, m, h)| refuse(key(f), m, h.to_owned()))?;
    let section = beam.section.numbers();
    let section = section.map_err(|(f, m, h)| refuse(key("section"), format!("{f} {m}"), h))?;
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
