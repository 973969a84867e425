//! Beams, rigid bodies and joints as one mechanism, and its integrators.
//!
//! A node is a frame without mass of its own: it carries joints as a body does, and the elements add
//! their mass and energy on top. A clamp is a fixed joint to the ground; a rigid corner is a fixed
//! joint between two coincident nodes. A loop closed only through elements is a tree for `P`.

use crate::averaged::AveragedStrains;
use crate::element::{ElementError, Elements, MassKind};
use crate::high_order::{AveragedHighOrder, HighOrderElements};
use crate::mesh::Mesh;
use crate::section::Section;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use vi_constraints::constrained::Constrained;
use vi_constraints::integrator::{SetupError, Start};
use vi_constraints::nodal::Nodal;
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::scheme::Scheme;
use vi_constraints::{Constraints, Integrator, Options, SchemeKind};
use vi_core::linear::norm_inf;
use vi_core::{Quadrature, SeparableSystem, SparseMatrix};
use vi_multibody::joint::{FrameId, GROUND, Joint, Side, complete_axis};
use vi_multibody::map::TreeMap;
use vi_multibody::mechanism::{BodySpec, Description, Mechanism};
use vi_multibody::pair::PairKind;
use vi_multibody::sparse_nodal::SparseNodal;
use vi_rigid::directors;
use vi_rigid::load::{Load, LoadError, LoadKind};
use vi_rigid::time_history::TimeHistory;

/// The discrete potential of the elements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StrainRule {
    /// `V(q_{n+1/2})`, LMO08 (18): for soft beams and small steps.
    Midpoint,
    /// Averaged strains: free of strain in rigid rotation; needed by stiff beams.
    #[default]
    Averaged,
}

/// The frames and elements of one beam.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Beam {
    /// Its nodes, indices of frames.
    pub nodes: Range<usize>,
    /// Its elements.
    pub elements: Range<usize>,
}

/// Beams and bodies under construction.
#[derive(Clone, Debug, Default)]
pub struct BeamModel {
    /// Bodies, nodes, joints, gravity.
    pub description: Description,
    /// Elements and sections.
    pub elements: Elements,
    /// Elements with three or four nodes.
    pub high_order: HighOrderElements,
    /// Distribution of the elements' mass.
    pub mass: MassKind,
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
        let first = self.add_nodes(name, mesh);
        let start = self.elements.list().len();
        let section = self.elements.add_section(section);
        let q = self.placement();
        for (k, length) in mesh.lengths.iter().enumerate() {
            let nodes = [first + k, first + k + 1];
            self.elements.add_stress_free(nodes, *length, section, &q)?;
        }
        let end = self.elements.list().len();
        Ok(Beam { nodes: first..first + mesh.centers.len(), elements: start..end })
    }

    /// Adds a beam of elements with `order + 1` nodes, `order` 2 or 3: that many intervals of the mesh
    /// make one element, and they should be equally long. Returns its nodes.
    ///
    /// # Errors
    /// [`ElementError::Order`].
    pub fn add_high_order_beam(
        &mut self,
        name: &str,
        mesh: &Mesh,
        section: Section,
        order: usize,
    ) -> Result<Range<usize>, ElementError> {
        let intervals = mesh.lengths.len();
        if !(2..=3).contains(&order) || !intervals.is_multiple_of(order) {
            return Err(ElementError::Order { order, intervals });
        }
        let first = self.add_nodes(name, mesh);
        let q = self.placement();
        for (k, lengths) in mesh.lengths.chunks_exact(order).enumerate() {
            let nodes: Vec<usize> = (0..=order).map(|j| first + order * k + j).collect();
            self.high_order.add_stress_free(&nodes, lengths.iter().sum(), &section, &q);
        }
        Ok(first..first + mesh.centers.len())
    }

    fn add_nodes(&mut self, name: &str, mesh: &Mesh) -> usize {
        let first = self.description.bodies.len();
        for (k, (center, triad)) in mesh.centers.iter().zip(&mesh.triads).enumerate() {
            self.add_frame(BodySpec {
                name: format!("{name}.{k}"),
                body: None,
                center: *center,
                triad: *triad,
                velocity: Vector3::zeros(),
                omega: Vector3::zeros(),
            });
        }
        first
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

    /// Joins two frames (`None`: the ground) by a pair at a world point with a world axis, both in the
    /// initial placement; pairs without an axis do not read it. Returns the index of the joint.
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
        let q = self.placement();
        let side = |frame: FrameId| match frame {
            FrameId::Ground => Side::at(frame, &GROUND, point, &axes),
            FrameId::Frame(k) => Side::at(frame, &q[12 * k..12 * k + 12], point, &axes),
        };
        let parent = parent.map_or(FrameId::Ground, FrameId::Frame);
        let count = self.description.joints.len();
        let name = format!("joint {count}");
        let (parent, child) = (side(parent), side(FrameId::Frame(child)));
        self.description.joints.push(Joint { name, kind, parent, child });
        count
    }

    /// Clamps a node: its twelve coordinates stay what they are.
    pub fn clamp(&mut self, node: usize) -> usize {
        let point = self.description.bodies[node].center;
        self.join(PairKind::Fixed, None, node, &point, &Vector3::z())
    }

    /// A load per length along a beam, force (N/m) and torque (N·m/m): `ℓ/2` of it at both ends of each
    /// element.
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
        let mut shares = vec![0.0; self.description.bodies.len()];
        for element in &self.elements.list()[beam.elements.clone()] {
            element.nodes.into_iter().for_each(|node| shares[node] += 0.5 * element.length);
        }
        let loaded = shares.iter().enumerate().filter(|(_, share)| **share > 0.0);
        let load = |(node, share): (usize, &f64)| {
            Load::new(12 * node, kind, *share * force, *share * torque, history.clone())
        };
        loaded.map(load).collect()
    }

    /// `q(0)`.
    #[must_use]
    pub fn placement(&self) -> Vec<f64> {
        let mut q = vec![0.0; 12 * self.description.bodies.len()];
        for (frame, own) in self.description.bodies.iter().zip(q.chunks_exact_mut(12)) {
            directors::set_frame(own, &frame.center, &frame.triad);
        }
        q
    }

    /// The mechanism: constraints and spanning tree.
    #[must_use]
    pub fn mechanism(&self) -> Mechanism {
        Mechanism::new(self.description.clone())
    }

    /// The system: mass of bodies and elements, gravity (midpoint), elastic energy.
    #[must_use]
    pub fn system(&self, mechanism: &Mechanism, rule: StrainRule) -> SeparableSystem {
        let mut system =
            mechanism.system_with_mass(self.mass_matrix(mechanism), Quadrature::Midpoint);
        let (elements, high_order) = (self.elements.clone(), self.high_order.clone());
        if !self.high_order.is_empty() {
            system = match rule {
                StrainRule::Midpoint => system.potential(high_order),
                StrainRule::Averaged => {
                    system.discrete_potential(Box::new(AveragedHighOrder(high_order)))
                }
            };
        }
        match rule {
            StrainRule::Midpoint => system.potential(elements),
            StrainRule::Averaged => system.discrete_potential(Box::new(AveragedStrains(elements))),
        }
    }

    /// `M` of bodies and elements.
    #[must_use]
    pub fn mass_matrix(&self, mechanism: &Mechanism) -> SparseMatrix {
        mechanism.mass(|out| {
            self.elements.emit_mass(self.mass, out);
            self.high_order.emit_mass(out);
        })
    }
}

/// Extent of a placement, m: the largest coordinate of a centre, at least the largest distance of one
/// from the first; the scale of round-off in the strains.
#[must_use]
pub fn extent(q: &[f64]) -> f64 {
    let size = |frame: &[f64]| {
        let shift: [f64; 3] = std::array::from_fn(|i| frame[i] - q[i]);
        norm_inf(&frame[..3]).max(norm_inf(&shift))
    };
    q.chunks_exact(12).map(size).fold(0.0, f64::max)
}

/// An integrator for a mechanism with couplings between its frames.
///
/// Trees: `nodal` and `reduced` by the sparse operators, `constrained` by the sparse saddle point (a
/// singular mass matrix is fine there), `dalembert` densely. Loops: `constrained` and `dalembert`.
/// Newton's floors follow from the [`extent`] of the start: increments are resolved to the round-off
/// of the strains, `1e-14` of the extent.
///
/// # Errors
/// [`SetupError`].
pub fn integrator(
    system: SeparableSystem,
    mechanism: Mechanism,
    options: Options,
    at: Start<'_>,
) -> Result<Integrator<SeparableSystem, Mechanism>, SetupError> {
    if mechanism.has_loops() {
        return Integrator::new(system, mechanism, options, at);
    }
    let (n, m) = (Constraints::dim(&mechanism), Constraints::len(&mechanism));
    let rows = IndependentRows::all(m);
    let (lanes, newton) = (options.gammas.len(), options.newton);
    let scheme: Box<dyn Scheme<SeparableSystem, Mechanism>> = match options.scheme {
        SchemeKind::Constrained => Box::new(Constrained::new(n, rows.clone(), m, newton, lanes)),
        SchemeKind::Nodal | SchemeKind::Reduced => {
            let length = 1e-5 * extent(at.1).max(1e-5);
            let operators = SparseNodal::new(&mechanism).with_floors(length, 1e-5).by_screws();
            let reduced = options.scheme == SchemeKind::Reduced;
            Box::new(Nodal::new(operators, (n, n - m), reduced, newton, lanes))
        }
        _ => {
            let map = TreeMap::new(&mechanism);
            return Integrator::with_reparametrization(system, mechanism, map, options, at);
        }
    };
    Integrator::with_scheme(system, mechanism, (scheme, rows), options, at)
}
