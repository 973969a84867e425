//! Beams, rigid bodies and joints as one mechanism.
//!
//! A node is a frame without mass of its own: it carries joints as a body does, and the elements
//! add their mass and energy on top. A clamp is a fixed joint to the ground; a rigid corner is a
//! fixed joint between two coincident nodes. A loop closed only through elements is a tree for `P`.

use crate::element::{Element, ElementError};
use crate::elements::Elements;
use crate::mesh::BeamMesh;
use crate::section::Section;
use crate::small::re;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::ops::{Deref, DerefMut, Range};
use vi_core::num_dual::Dual64;
use vi_core::{Number, SparseMatrix};
use vi_multibody::builder::MechanismBuilder;
use vi_multibody::description::joint_at;
use vi_multibody::joint::{FrameId, complete_axis};
use vi_multibody::mechanism::{BodySpec, Description, Mechanism};
use vi_multibody::pair::PairKind;
use vi_rigid::load::{Load, LoadChange, LoadError, LoadKind};
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
    /// Its elements.
    pub elements: Range<usize>,
}

/// The elements of all beams of a mechanism.
#[derive(Clone, Debug, Default)]
pub struct BeamElements {
    /// All of them.
    pub elements: Elements,
    /// Bounds of the tension of some elements that are stated, N; those of the others
    /// follow their tension ([`crate::averaged`]).
    pub tension: Vec<(Range<usize>, f64)>,
    /// Shorter steps have the added mass of a step of this length, s.
    pub whole: f64,
}

/// Beams in the description of a mechanism.
///
/// ```
/// use nalgebra::Vector3;
/// use vi_beam::{BeamBuilder, BeamElements, FrameRule, BeamMesh, Section, StrainRule};
/// use vi_constraints::Constraints;
/// use vi_multibody::builder::MechanismBuilder;
/// use vi_multibody::{FrameId, PairKind};
///
/// // a cantilever of eight elements
/// let rule = FrameRule::Normal(Vector3::z());
/// let mesh = BeamMesh::straight(Vector3::zeros(), Vector3::x(), 8, rule)?;
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
    /// Adds the nodes of a beam, stress-free and at rest along its mesh.
    ///
    /// # Errors
    /// [`ElementError`].
    fn beam(
        &mut self,
        beams: &mut BeamElements,
        name: &str,
        mesh: &BeamMesh,
        section: Section,
    ) -> Result<Beam, ElementError> {
        self.beam_of_nodes(beams, mesh.nodes(name), mesh, section)
    }

    /// Adds these nodes of a mesh with an element in each interval.
    ///
    /// # Errors
    /// [`ElementError`].
    fn beam_of_nodes(
        &mut self,
        beams: &mut BeamElements,
        nodes: Vec<BodySpec>,
        mesh: &BeamMesh,
        section: Section,
    ) -> Result<Beam, ElementError>;
}

impl BeamBuilder for MechanismBuilder {
    fn beam_of_nodes(
        &mut self,
        beams: &mut BeamElements,
        nodes: Vec<BodySpec>,
        mesh: &BeamMesh,
        section: Section,
    ) -> Result<Beam, ElementError> {
        let first = self.frame_count();
        let mut q = vec![0.0; 12 * first]; // only nodes of the beam are read
        q.extend(nodes.iter().flat_map(BodySpec::frame));
        let beam = beams.add(first, mesh, section, &q)?;
        nodes.into_iter().for_each(|node| {
            self.frame(node);
        });
        Ok(beam)
    }
}

/// How near a node a load counts as at it, in parts of an element.
const AT_NODE: f64 = 1e-9;

/// The part of a load on a beam that a node carries.
struct NodeShare<T = f64> {
    node: usize,
    share: T,
    moment: T, // on d_3, m
}

impl NodeShare {
    fn load(
        &self,
        kind: LoadKind,
        [force, torque]: [Vector3<f64>; 2],
        history: &TimeHistory,
    ) -> Result<Load, LoadError> {
        let Self { node, share, moment } = self;
        let own = Load::new(12 * node, kind, *share * force, *share * torque, history.clone())?;
        own.at(Vector3::new(0.0, 0.0, moment / share))
    }
}

impl NodeShare<Dual64> {
    fn change(&self, [force, torque]: [Vector3<f64>; 2]) -> LoadChange {
        let by = self.share.eps;
        let point = Vector3::new(0.0, 0.0, (self.moment / self.share).eps);
        LoadChange { force: by * force, torque: by * torque, point }
    }
}

impl BeamElements {
    /// Adds the elements of a beam whose nodes are the frames from `first` on, in the configuration
    /// `q`.
    fn add(
        &mut self,
        first: usize,
        mesh: &BeamMesh,
        section: Section,
        q: &[f64],
    ) -> Result<Beam, ElementError> {
        let nodes = first..first + mesh.centers.len();
        let start = self.elements.list().len();
        let section = self.elements.add_section(section);
        for (k, length) in mesh.lengths.iter().enumerate() {
            self.elements.add_stress_free([first + k, first + k + 1], *length, section, q)?;
        }
        Ok(Beam { nodes, elements: start..self.elements.list().len() })
    }

    /// A load per length along a beam, force (N/m) and torque (N·m/m): `ℓ/2` of it at both nodes of
    /// each element. Where `φ` is interpolated with
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
        let lengths = |element: usize| self.elements.list()[element].length;
        let load = |own: NodeShare| own.load(kind, [force, torque], history);
        self.line_shares(beam, lengths).into_iter().map(load).collect()
    }

    /// How the loads of [`BeamElements::line_load`] change, in their order, with the lengths of all
    /// elements, which change by `longer`, m.
    #[must_use]
    pub fn line_load_changes(
        &self,
        beam: &Beam,
        longer: impl Fn(usize) -> f64,
        by: [Vector3<f64>; 2],
    ) -> Vec<LoadChange> {
        let length = |k: usize| Dual64::new(self.elements.list()[k].length, longer(k));
        self.line_shares(beam, length).into_iter().map(|own| own.change(by)).collect()
    }

    /// `ℓ/2` of both nodes of each element, `±ℓ²/12` on `d_3`.
    fn line_shares<T: Number>(
        &self,
        beam: &Beam,
        length: impl Fn(usize) -> T,
    ) -> Vec<NodeShare<T>> {
        let (share, moment) = (T::of(0.0), T::of(0.0));
        let mut all: Vec<NodeShare<T>> =
            beam.nodes.clone().map(|node| NodeShare { node, share, moment }).collect();
        for (k, index) in beam.elements.clone().enumerate() {
            let (element, length) = (&self.elements.list()[index], length(index));
            let (half, clamped) = (T::of(0.5) * length, length * length / T::of(12.0));
            let clamped = if element.bends_within() { clamped } else { T::of(0.0) };
            let own = &mut all[k..k + 2];
            own.iter_mut().for_each(|own| own.share += half);
            own[0].moment += clamped;
            own[1].moment -= clamped;
        }
        all.retain(|own| re(own.share) > 0.0);
        all
    }

    /// A force (N) and a torque (N·m) at the arc length `along` (m) from the start of a beam:
    /// `½ ∓ ξ` of them at both nodes of the element there and, where `φ` is
    /// interpolated with `d_3`, `±½ (¼ − ξ²) ℓ` of the force on `d_3`.
    ///
    /// # Errors
    /// [`LoadError`].
    pub fn load_at(
        &self,
        beam: &Beam,
        along: f64,
        kind: LoadKind,
        by: [Vector3<f64>; 2],
        history: &TimeHistory,
    ) -> Result<Vec<Load>, LoadError> {
        let lengths = |element: usize| self.elements.list()[element].length;
        let (shares, _) = self.shares_at(beam, along, lengths);
        shares.into_iter().map(|own| own.load(kind, by, history)).collect()
    }

    /// How the loads of [`BeamElements::load_at`] change, in their order, with the place and with
    /// the lengths of all elements, which change by `longer`, m; `None` where it passes a node, at
    /// which they have a kink.
    #[must_use]
    pub fn load_at_changes(
        &self,
        beam: &Beam,
        along: Dual64,
        longer: impl Fn(usize) -> f64,
        by: [Vector3<f64>; 2],
    ) -> Option<Vec<LoadChange>> {
        let length = |k: usize| Dual64::new(self.elements.list()[k].length, longer(k));
        let (shares, xi) = self.shares_at(beam, along, length);
        let passes = (re(xi).abs() - 0.5).abs() < AT_NODE && xi.eps.abs() > AT_NODE;
        (!passes).then(|| shares.into_iter().map(|own| own.change(by)).collect())
    }

    /// What both nodes of the element at a place carry, and `ξ` of the place.
    fn shares_at<T: Number>(
        &self,
        beam: &Beam,
        along: T,
        length: impl Fn(usize) -> T,
    ) -> (Vec<NodeShare<T>>, T) {
        let (k, _) = self.first_element(beam, |end| re(along) < end);
        let index = beam.elements.start + k;
        let before = (beam.elements.start..index).map(&length);
        let start = before.fold(T::of(0.0), |sum, own| sum + own);
        let (element, length, half) = (&self.elements.list()[index], length(index), T::of(0.5));
        let xi = (along - start) / length - half;
        let held = match re(xi) {
            own if own > 0.5 => half,
            own if own < -0.5 => -half,
            _ => xi,
        };
        let bend = half * (T::of(0.25) - held * held) * length;
        let bend = if element.bends_within() { bend } else { T::of(0.0) };
        let [a, b] = element.nodes;
        let mut all = vec![
            NodeShare { node: a, share: half - held, moment: bend },
            NodeShare { node: b, share: half + held, moment: -bend },
        ];
        all.retain(|own| re(own.share) > 0.0);
        (all, xi)
    }

    /// The elements of a beam.
    #[must_use]
    pub fn of(&self, beam: &Beam) -> &[Element] {
        &self.elements.list()[beam.elements.clone()]
    }

    /// The reference arc length of a beam, m.
    #[must_use]
    pub fn length(&self, beam: &Beam) -> f64 {
        self.of(beam).iter().map(|element| element.length).sum()
    }

    /// The first element of a beam at whose end, an arc length (m), `reaches` holds, and where it
    /// starts; else the last one.
    pub(crate) fn first_element(&self, beam: &Beam, reaches: impl Fn(f64) -> bool) -> (usize, f64) {
        let (own, mut start) = (self.of(beam), 0.0);
        for (k, element) in own.iter().enumerate() {
            if reaches(start + element.length) || k + 1 == own.len() {
                return (k, start);
            }
            start += element.length;
        }
        (0, 0.0)
    }

    /// Neighbouring nodes of all elements.
    #[must_use]
    pub fn neighbours(&self) -> Vec<[usize; 2]> {
        self.elements.list().iter().map(|element| element.nodes).collect()
    }

    /// `M` of bodies and elements.
    #[must_use]
    pub fn mass_matrix(&self, mechanism: &Mechanism) -> SparseMatrix {
        mechanism.mass(|out| self.elements.emit_mass(out))
    }
}

/// Beams and bodies as a [`Description`] that is edited by hand; [`BeamBuilder`] takes less care.
///
/// ```
/// use nalgebra::Vector3;
/// use vi_beam::{BeamModel, FrameRule, BeamMesh, Section, StrainRule};
/// use vi_constraints::Constraints;
///
/// // a cantilever of eight elements
/// let rule = FrameRule::Normal(Vector3::z());
/// let mesh = BeamMesh::straight(Vector3::zeros(), Vector3::x(), 8, rule)?;
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
        mesh: &BeamMesh,
        section: Section,
    ) -> Result<Beam, ElementError> {
        let (first, nodes) = (self.description.bodies.len(), mesh.nodes(name));
        let mut q = self.configuration()[..12 * first].to_vec();
        q.extend(nodes.iter().flat_map(BodySpec::frame));
        let beam = self.beams.add(first, mesh, section, &q)?;
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
        legs: &[BeamMesh],
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
