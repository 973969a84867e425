//! Beams of a model as numbers: nodes, elements, supports, corners.

use holonom_model::{BeamMass, End, Model, ModelError, Problem, Settings};
use nalgebra::Vector3;
use std::ops::Range;
use std::sync::Arc;
use vi_beam::element::ElementError;
use vi_beam::section_force::{SectionState, for_each_state};
use vi_beam::{BeamBuilder, BeamElements, ElementKind, MassKind};
use vi_multibody::builder::MechanismBuilder;
use vi_multibody::joint::FrameId;
use vi_multibody::mechanism::BodySpec;
use vi_multibody::pair::PairKind;
use vi_statics::limit::BendingBounds;

/// What one `[[beam]]` became.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BeamParts {
    /// Its name.
    pub name: String,
    /// Its nodes among all frames.
    pub nodes: Range<usize>,
    /// Its legs.
    pub legs: Vec<vi_beam::Beam>,
    /// What its elements measure.
    pub kind: ElementKind,
}

impl BeamParts {
    /// How far its elements may be bent.
    pub(crate) fn bounds(&self) -> BendingBounds {
        bending_bounds(self.kind)
    }
}

/// How far elements may be bent.
pub(crate) fn bending_bounds(kind: ElementKind) -> BendingBounds {
    match kind {
        ElementKind::MeanDirectors => BendingBounds::MEAN_DIRECTORS,
        _ => BendingBounds::HELICOIDAL,
    }
}

/// The beams of a system, with all of its elements.
#[derive(Clone, Debug, Default)]
pub struct Beams {
    /// The elements of all beams.
    pub parts: Arc<BeamElements>,
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
            let start = first;
            first += leg.elements.len();
            (start..first).zip((leg.nodes.start..).map(|node| [node, node + 1]))
        })
    }
}

/// A joint at a node that holds an end or a corner of a beam.
#[derive(Clone, Debug)]
pub(crate) struct NodeSupport {
    name: String,
    kind: PairKind,
    parent: FrameId,
    child: FrameId,
    point: Vector3<f64>,
}

impl NodeSupport {
    /// Adds it to a mechanism.
    pub(crate) fn add(&self, builder: &mut MechanismBuilder) {
        let Self { name, kind, parent, child, point } = self;
        builder.joint(name, *kind, *parent, *child).at(*point);
    }
}

/// The beams of a model, their elements, and what holds their ends and corners.
#[derive(Default)]
pub(crate) struct AddedBeams {
    pub(crate) list: Vec<BeamParts>,
    pub(crate) elements: BeamElements,
    pub(crate) supports: Vec<NodeSupport>,
}

/// Adds the nodes of all beams after the bodies of a mechanism.
///
/// # Errors
/// [`ModelError`]; none for a valid model.
pub(crate) fn add(model: &Model, builder: &mut MechanismBuilder) -> Result<AddedBeams, ModelError> {
    let mut added = AddedBeams::default();
    for beam in &model.beams {
        let parts = add_beam(beam, &model.settings, builder, &mut added)?;
        builder.start_together(parts.nodes.clone());
        added.list.push(parts);
    }
    Ok(added)
}

fn add_beam(
    beam: &holonom_model::Beam,
    settings: &Settings,
    builder: &mut MechanismBuilder,
    AddedBeams { elements, supports, .. }: &mut AddedBeams,
) -> Result<BeamParts, ModelError> {
    let name = &beam.name;
    let member = format!("beam.{name}");
    let below = |key: &str| {
        let prefix = format!("{member}{key}");
        move |problem: Problem| ModelError::Assembly(vec![problem.below(&prefix)])
    };
    let meshes = beam.meshes().map_err(below(""))?;
    let section = beam.mean_section().map_err(below(""))?;
    let mut along = beam.sections_along(&meshes).map_err(below(""))?.into_iter().flatten();
    let (first, kind) = (builder.frame_count(), beam.element_kind(settings));
    let (origin, omega) = (meshes[0].centers[0], Vector3::from(beam.angular_velocity));
    let mut legs: Vec<vi_beam::Beam> = Vec::new();
    for mesh in &meshes {
        let mut nodes = mesh.nodes(name);
        for (k, node) in (builder.frame_count() - first..).zip(&mut nodes) {
            node.name = format!("{name}.{k}"); // numbered along the whole beam
            node.velocity = Vector3::from(beam.velocity) + omega.cross(&(node.center - origin));
            node.omega = omega;
        }
        let mut q = vec![0.0; 12 * builder.frame_count()]; // only its own nodes are read
        q.extend(nodes.iter().flat_map(BodySpec::frame));
        let refused = |error: ElementError| {
            let problem = Problem::new(format!("{member}.elements"), error.to_string());
            ModelError::Assembly(vec![problem.help(String::new())])
        };
        let leg = builder.beam_of_nodes(elements, nodes, mesh, section);
        let leg = leg.map_err(refused)?;
        for (element, points) in leg.elements.clone().zip(along.by_ref()) {
            elements.elements.set_section_along(element, &points);
        }
        if kind != ElementKind::MeanDirectors {
            elements.elements.set_strains(leg.elements.clone(), kind, &q).map_err(refused)?;
        }
        if let Some(rest) = beam.rest().map_err(below(""))? {
            elements.elements.set_rest(leg.elements.clone(), &rest, &q);
        }
        if let Some(bound) = beam.tension {
            elements.tension.push((leg.elements.clone(), bound));
        }
        if beam.mass == BeamMass::Lumped {
            elements.elements.set_mass(leg.elements.clone(), MassKind::Lumped);
        }
        if let Some(last) = legs.last() {
            supports.push(NodeSupport {
                name: format!("{name}.corner{}", legs.len()),
                kind: PairKind::Fixed,
                parent: FrameId::Frame(last.nodes.end - 1),
                child: FrameId::Frame(leg.nodes.start),
                point: mesh.centers[0],
            });
        }
        legs.push(leg);
    }
    let nodes = first..builder.frame_count();
    let [start, end] = [meshes.first(), meshes.last()].map(|mesh| mesh.map(|mesh| &mesh.centers));
    let ends = [
        ("start", beam.start, nodes.start, start.and_then(|centers| centers.first())),
        ("end", beam.end, nodes.end - 1, end.and_then(|centers| centers.last())),
    ];
    for (place, end, node, point) in ends {
        let kind = match end {
            End::Free => continue,
            End::Clamped => PairKind::Fixed,
            End::Pinned => PairKind::Spherical,
        };
        supports.push(NodeSupport {
            name: format!("{name}.{place}"),
            kind,
            parent: FrameId::Ground,
            child: FrameId::Frame(node),
            point: point.copied().unwrap_or_default(),
        });
    }
    Ok(BeamParts { name: name.clone(), nodes, legs, kind })
}
