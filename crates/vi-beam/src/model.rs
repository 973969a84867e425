//! Beams, rigid bodies and joints as one mechanism.
//!
//! A node is a frame without mass of its own: it carries joints as a body does, and the elements
//! add their mass and energy on top. A clamp is a fixed joint to the ground; a rigid corner is a
//! fixed joint between two coincident nodes. A loop closed only through elements is a tree for `P`.

use crate::element::{ElementError, Elements};
use crate::high_order::HighOrderElements;
use crate::mass_kind::MassKind;
use crate::mesh::Mesh;
use crate::section::Section;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::ops::{Deref, DerefMut, Range};
use vi_core::SparseMatrix;
use vi_multibody::builder::MechanismBuilder;
use vi_multibody::description::joint_at;
use vi_multibody::joint::{FrameId, complete_axis};
use vi_multibody::mechanism::{BodySpec, Description, Mechanism};
use vi_multibody::pair::PairKind;
use vi_rigid::load::{Load, LoadError, LoadKind};
use vi_rigid::time_history::TimeHistory;

/// The discrete potential of the elements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StrainRule {
    /// `V(q_{n+1/2})`, LMO08 (18): for soft beams and small steps.
    Midpoint,
    /// Averaged strains: free of strain in rigid rotation.
    Averaged,
    /// Averaged strains with selective mass scaling: for any step, see [`crate::averaged`].
    #[default]
    MassScaled,
    /// Averaged strains with algorithmic dissipation of what the step does not resolve, see
    /// [`crate::dissipation`].
    Dissipative,
}

/// The frames and elements of one beam.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Beam {
    /// Its nodes, indices of frames.
    pub nodes: Range<usize>,
    /// Its elements: among the two-node ones at order 1, else among those of higher order.
    pub elements: Range<usize>,
    /// Order of its elements: one less than nodes of an element.
    pub order: usize,
}

/// The elements of all beams of a mechanism.
#[derive(Clone, Debug, Default)]
pub struct BeamElements {
    /// Elements with two nodes.
    pub elements: Elements,
    /// Elements with three or four nodes.
    pub high_order: HighOrderElements,
    /// Bounds of the tension of some two-node elements that are stated, N; those of the others
    /// follow their tension ([`crate::averaged`]).
    pub tension: Vec<(Range<usize>, f64)>,
}

/// Beams in the description of a mechanism.
///
/// ```
/// use nalgebra::Vector3;
/// use vi_beam::{BeamBuilder, BeamElements, FrameRule, Mesh, Section, StrainRule};
/// use vi_constraints::Constraints;
/// use vi_multibody::builder::MechanismBuilder;
/// use vi_multibody::{FrameId, PairKind};
///
/// // a cantilever of eight elements
/// let rule = FrameRule::Normal(Vector3::z());
/// let mesh = Mesh::straight(Vector3::zeros(), Vector3::x(), 8, rule)?;
/// let section = Section::new([1e4, 1e4, 1e4, 500.0, 500.0, 500.0], [1.0, 10.0, 10.0, 0.0])?;
/// let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
/// let mut beams = BeamElements::default();
/// let beam = builder.beam(&mut beams, "beam", &mesh, section)?;
/// let root = FrameId::Frame(beam.nodes.start);
/// builder.joint("clamp", PairKind::Fixed, FrameId::Ground, root).at([0.0; 3]);
/// let mechanism = builder.build()?.mechanism;
/// let system = beams.system(&mechanism, StrainRule::Averaged);
/// assert_eq!(mechanism.dim(), 12 * 9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait BeamBuilder {
    /// Adds the nodes of a beam of two-node elements, stress-free and at rest along its mesh.
    ///
    /// # Errors
    /// [`ElementError`].
    fn beam(
        &mut self,
        beams: &mut BeamElements,
        name: &str,
        mesh: &Mesh,
        section: Section,
    ) -> Result<Beam, ElementError> {
        self.beam_of_nodes(beams, mesh.nodes(name), mesh, section, 1)
    }

    /// Adds these nodes of a mesh with elements of `order + 1` nodes, `order` 1, 2 or 3: that many
    /// intervals of the mesh make one element, and they should be equally long.
    ///
    /// # Errors
    /// [`ElementError`].
    fn beam_of_nodes(
        &mut self,
        beams: &mut BeamElements,
        nodes: Vec<BodySpec>,
        mesh: &Mesh,
        section: Section,
        order: usize,
    ) -> Result<Beam, ElementError>;
}

impl BeamBuilder for MechanismBuilder {
    fn beam_of_nodes(
        &mut self,
        beams: &mut BeamElements,
        nodes: Vec<BodySpec>,
        mesh: &Mesh,
        section: Section,
        order: usize,
    ) -> Result<Beam, ElementError> {
        let first = self.frame_count();
        let mut q = vec![0.0; 12 * first]; // only nodes of the beam are read
        q.extend(nodes.iter().flat_map(BodySpec::frame));
        let beam = beams.add(first, mesh, section, order, &q)?;
        nodes.into_iter().for_each(|node| {
            self.frame(node);
        });
        Ok(beam)
    }
}

impl BeamElements {
    /// Adds the elements of a beam of some order whose nodes are the frames from `first` on, in the
    /// configuration `q`.
    fn add(
        &mut self,
        first: usize,
        mesh: &Mesh,
        section: Section,
        order: usize,
        q: &[f64],
    ) -> Result<Beam, ElementError> {
        let nodes = first..first + mesh.centers.len();
        if order == 1 {
            let start = self.elements.list().len();
            let section = self.elements.add_section(section);
            for (k, length) in mesh.lengths.iter().enumerate() {
                let nodes = [first + k, first + k + 1];
                self.elements.add_stress_free(nodes, *length, section, q)?;
            }
            return Ok(Beam { nodes, elements: start..self.elements.list().len(), order });
        }
        let intervals = mesh.lengths.len();
        if !(2..=3).contains(&order) || !intervals.is_multiple_of(order) {
            return Err(ElementError::Order { order, intervals });
        }
        let start = self.high_order.count();
        for (k, lengths) in mesh.lengths.chunks_exact(order).enumerate() {
            let nodes: Vec<usize> = (0..=order).map(|j| first + order * k + j).collect();
            self.high_order.add_stress_free(&nodes, lengths.iter().sum(), &section, q);
        }
        Ok(Beam { nodes, elements: start..self.high_order.count(), order })
    }

    /// A load per length along a beam, force (N/m) and torque (N·m/m): `∫ N_j ds` of it at the
    /// nodes of each element, `ℓ/2` at both ends of a two-node one. Where `φ` is interpolated with
    /// `d_3`, the force has also `±ℓ²/12` of itself on `d_3` of both nodes: the moments of a beam
    /// that is clamped at both ends, which cancel between equal elements. They are levers along
    /// `d_3`.
    ///
    /// # Errors
    /// [`LoadError`].
    pub fn line_load(
        &self,
        beam: &Beam,
        kind: LoadKind,
        force: Vector3<f64>,
        torque: Vector3<f64>,
        history: &TimeHistory,
    ) -> Result<Vec<Load>, LoadError> {
        let (mut shares, mut moments) = (vec![0.0; beam.nodes.end], vec![0.0; beam.nodes.end]);
        let weights: &[f64] = match beam.order {
            1 => &[0.5, 0.5],
            2 => &[1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0],
            _ => &[0.125, 0.375, 0.375, 0.125],
        };
        for (k, index) in beam.elements.clone().enumerate() {
            let length: f64 = self.intervals(beam, index).sum();
            let first = beam.nodes.start + k * beam.order;
            weights.iter().enumerate().for_each(|(j, w)| shares[first + j] += w * length);
            if self.bends_within(beam, index) {
                moments[first] += length * length / 12.0;
                moments[first + 1] -= length * length / 12.0;
            }
        }
        let loaded = shares.iter().enumerate().filter(|(_, share)| **share > 0.0);
        let load = |(node, share): (usize, &f64)| {
            let own = Load::new(12 * node, kind, *share * force, *share * torque, history.clone())?;
            own.at(Vector3::new(0.0, 0.0, moments[node] / share))
        };
        loaded.map(load).collect()
    }

    /// Whether `φ` of an element is interpolated with `d_3`.
    fn bends_within(&self, beam: &Beam, element: usize) -> bool {
        beam.order == 1 && self.elements.list()[element].mass == MassKind::Quadratic
    }

    /// A force (N) and a torque (N·m) at the arc length `along` (m) from the start of a beam of
    /// two-node elements: `½ ∓ ξ` of them at both nodes of the element there and, where `φ` is
    /// interpolated with `d_3`, `±½ (¼ − ξ²) ℓ` of the force on `d_3`.
    ///
    /// # Errors
    /// [`LoadError`].
    pub fn load_at(
        &self,
        beam: &Beam,
        along: f64,
        kind: LoadKind,
        [force, torque]: [Vector3<f64>; 2],
        history: &TimeHistory,
    ) -> Result<Vec<Load>, LoadError> {
        let (mut start, last) = (0.0, beam.elements.len() - 1);
        let length = |index: usize| self.intervals(beam, index).sum::<f64>();
        let (k, index) = beam
            .elements
            .clone()
            .enumerate()
            .find(|(k, index)| {
                let end = start + length(*index);
                let found = along < end || *k == last;
                start = if found { start } else { end };
                found
            })
            .expect("the last element is found");
        let own = length(index);
        let xi = ((along - start) / own - 0.5).clamp(-0.5, 0.5);
        let bend = if self.bends_within(beam, index) { 0.5 * (0.25 - xi * xi) * own } else { 0.0 };
        let first = beam.nodes.start + k * beam.order;
        let ends = [(first, 0.5 - xi, bend), (first + beam.order, 0.5 + xi, -bend)];
        let loaded = ends.into_iter().filter(|(_, share, _)| *share > 0.0);
        let load = |(node, share, moment): (usize, f64, f64)| {
            let own = Load::new(12 * node, kind, share * force, share * torque, history.clone())?;
            own.at(Vector3::new(0.0, 0.0, moment / share))
        };
        loaded.map(load).collect()
    }

    /// Reference arc lengths between the nodes of an element, m.
    pub fn intervals(&self, beam: &Beam, element: usize) -> impl Iterator<Item = f64> + use<> {
        self.intervals_of(beam.order, element)
    }

    pub(crate) fn intervals_of(
        &self,
        order: usize,
        element: usize,
    ) -> impl Iterator<Item = f64> + use<> {
        let length = match order {
            1 => self.elements.list()[element].length,
            order => self.high_order.length(element) / order as f64,
        };
        std::iter::repeat_n(length, order)
    }

    /// Neighbouring nodes of all elements, those of higher order last.
    #[must_use]
    pub fn neighbours(&self) -> Vec<[usize; 2]> {
        let elements = self.elements.list().iter().map(|element| element.nodes);
        elements.chain(self.high_order.pairs().iter().copied()).collect()
    }

    /// `M` of bodies and elements.
    #[must_use]
    pub fn mass_matrix(&self, mechanism: &Mechanism) -> SparseMatrix {
        mechanism.mass(|out| {
            self.elements.emit_mass(out);
            self.high_order.emit_mass(out);
        })
    }
}

/// Beams and bodies as a [`Description`] that is edited by hand; [`BeamBuilder`] takes less care.
///
/// ```
/// use nalgebra::Vector3;
/// use vi_beam::{BeamModel, FrameRule, Mesh, Section, StrainRule};
/// use vi_constraints::Constraints;
///
/// // a cantilever of eight elements
/// let rule = FrameRule::Normal(Vector3::z());
/// let mesh = Mesh::straight(Vector3::zeros(), Vector3::x(), 8, rule)?;
/// let mut model = BeamModel::new(Vector3::new(0.0, 0.0, -9.81));
/// let section = Section::new([1e4, 1e4, 1e4, 500.0, 500.0, 500.0], [1.0, 10.0, 10.0, 0.0])?;
/// let beam = model.add_beam("beam", &mesh, section)?;
/// model.clamp(beam.nodes.start);
/// let mechanism = model.mechanism();
/// let system = model.system(&mechanism, StrainRule::Averaged);
/// assert_eq!(mechanism.dim(), 12 * 9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct BeamModel {
    /// Bodies, nodes, joints, gravity.
    pub description: Description,
    /// The elements of its beams.
    pub beams: BeamElements,
}

impl Deref for BeamModel {
    type Target = BeamElements;

    fn deref(&self) -> &BeamElements {
        &self.beams
    }
}

impl DerefMut for BeamModel {
    fn deref_mut(&mut self) -> &mut BeamElements {
        &mut self.beams
    }
}

impl BeamModel {
    /// An empty model with the acceleration of gravity (m/s²).
    #[must_use]
    pub fn new(gravity: Vector3<f64>) -> Self {
        let description = Description { dimension: 3, gravity, ..Description::default() };
        Self { description, ..Self::default() }
    }

    /// Adds a rigid body or a single node; returns its frame.
    pub fn add_frame(&mut self, frame: BodySpec) -> usize {
        self.description.bodies.push(frame);
        self.description.bodies.len() - 1
    }

    /// Adds a beam, stress-free and at rest along its mesh.
    ///
    /// # Errors
    /// [`ElementError`].
    pub fn add_beam(
        &mut self,
        name: &str,
        mesh: &Mesh,
        section: Section,
    ) -> Result<Beam, ElementError> {
        self.add_of_order(name, mesh, section, 1)
    }

    /// Adds a beam of elements with `order + 1` nodes, `order` 2 or 3: that many intervals of the
    /// mesh make one element, and they should be equally long.
    ///
    /// # Errors
    /// [`ElementError::Order`].
    pub fn add_high_order_beam(
        &mut self,
        name: &str,
        mesh: &Mesh,
        section: Section,
        order: usize,
    ) -> Result<Beam, ElementError> {
        match order {
            1 => Err(ElementError::Order { order, intervals: mesh.lengths.len() }),
            _ => self.add_of_order(name, mesh, section, order),
        }
    }

    fn add_of_order(
        &mut self,
        name: &str,
        mesh: &Mesh,
        section: Section,
        order: usize,
    ) -> Result<Beam, ElementError> {
        let (first, nodes) = (self.description.bodies.len(), mesh.nodes(name));
        let mut q = self.configuration()[..12 * first].to_vec();
        q.extend(nodes.iter().flat_map(BodySpec::frame));
        let beam = self.beams.add(first, mesh, section, order, &q)?;
        self.description.bodies.extend(nodes);
        Ok(beam)
    }

    /// Adds the legs of a polyline, joined by rigid corners.
    ///
    /// # Errors
    /// [`ElementError`].
    pub fn add_frame_work(
        &mut self,
        name: &str,
        legs: &[Mesh],
        section: Section,
    ) -> Result<Vec<Beam>, ElementError> {
        let mut beams: Vec<Beam> = Vec::new();
        for (k, leg) in legs.iter().enumerate() {
            let beam = self.add_beam(&format!("{name}.{k}"), leg, section)?;
            if let Some(last) = beams.last() {
                let (parent, child) = (last.nodes.end - 1, beam.nodes.start);
                let corner = self.description.bodies[child].center;
                let axis = Vector3::z();
                self.join(PairKind::Fixed, Some(parent), child, &corner, &axis);
            }
            beams.push(beam);
        }
        Ok(beams)
    }

    /// Joins two frames (`None`: the ground) by a pair at a world point with a world axis, both in
    /// the initial configuration; pairs without an axis do not read it. Returns the index of the
    /// joint.
    pub fn join(
        &mut self,
        kind: PairKind,
        parent: Option<usize>,
        child: usize,
        point: &Vector3<f64>,
        axis: &Vector3<f64>,
    ) -> usize {
        let axes =
            if kind.has_axis() { complete_axis(&axis.normalize()) } else { Matrix3::identity() };
        let frames = [parent.map_or(FrameId::Ground, FrameId::Frame), FrameId::Frame(child)];
        let count = self.description.joints.len();
        let (name, bodies) = (format!("joint {count}"), &self.description.bodies);
        let joint = joint_at(&name, kind, frames, [*point; 2], &axes, bodies);
        self.description.joints.push(joint);
        count
    }

    /// Clamps a node: its twelve coordinates stay what they are.
    pub fn clamp(&mut self, node: usize) -> usize {
        let point = self.description.bodies[node].center;
        self.join(PairKind::Fixed, None, node, &point, &Vector3::z())
    }

    /// `q(0)`.
    #[must_use]
    pub fn configuration(&self) -> Vec<f64> {
        self.description.configuration()
    }

    /// The mechanism: constraints and spanning tree.
    #[must_use]
    pub fn mechanism(&self) -> Mechanism {
        Mechanism::new(self.description.clone())
    }
}
