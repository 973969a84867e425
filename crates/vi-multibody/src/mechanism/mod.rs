//! Bodies, point masses, joints and bars: one system on `q ∈ R^n`.
//!
//! Coordinates: 12 for each body in the order given (`φ, d_1, d_2, d_3`), then 2 or 3 for each
//! point mass. Constraints: six internal ones for each body, LMO08 (56), then the rows of the
//! joints, then those of the bars. A spanning tree defines the velocity map; joints and bars
//! outside it close loops.

mod components;
mod constraints;
pub mod description;
pub mod initial_rates;
mod nearly_redundant;
pub mod prescribed;
mod round_off;
pub(crate) mod spanning;

pub use description::{Attachment, Bar, BarEnd, BodySpec, Description, ParticleSpec};
pub use nearly_redundant::{LOOP_TOLERANCE, NearlyRedundant};

use crate::constraint::joint_coordinate::JointCoordinate;
use crate::constraint::scalar_constraint::ScalarRow;
use crate::geometry::form::{BilinearRow, Form};
use crate::pair::joint::{FrameId, Joint};
use crate::tree::Tree;
use crate::tree::particle::ParticleTree;
use components::Components;
use nalgebra::Vector3;
use round_off::RoundOff;
use spanning::{span_bodies, span_particles};
use std::collections::BTreeMap;
use std::ops::Range;
use vi_constraints::Constraints;
use vi_core::coordinate_force::SignedUnknown;
use vi_core::momentum_map::Momentum;
use vi_core::newton::UnknownBlock;
use vi_core::potential::LinearPotential;
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::{Quadrature, SeparableSystem};
use vi_rigid::directors;

/// A mechanism: its constraints, its mass matrix, its spanning tree.
///
/// ```
/// use vi_constraints::Constraints;
/// use vi_multibody::builder::{Inertia, MechanismBuilder};
/// use vi_multibody::{FrameId::Ground, PairKind};
///
/// let mut builder = MechanismBuilder::new();
/// let arm = builder.body("arm", Inertia::principal(1.0, [0.1; 3])).at([0.5, 0.0, 0.0]).id();
/// builder.joint("hinge", PairKind::Revolute, Ground, arm).at([0.0; 3]).axis([0.0, 1.0, 0.0]);
/// let mechanism = builder.build()?.mechanism;
/// // 12 coordinates; 6 internal constraints of the body, 5 of the hinge; a tree
/// assert_eq!((mechanism.dim(), mechanism.len()), (12, 11));
/// assert_eq!(mechanism.initial_configuration()[0], 0.5);
/// assert!(!mechanism.has_loops());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Mechanism {
    description: Description,
    rows: Vec<ScalarRow>,         // joints, then bars, then scalar constraints
    other_rows: Vec<usize>,       // those of `rows` that are no products of a joint
    step_rows: Vec<usize>,        // those of `rows` that the midpoint does not know: of rolling
    angles: Vec<JointCoordinate>, // whose revolutions count
    followed: Vec<Option<SignedUnknown>>, // of angles by the increments of steps
    coordinates: BTreeMap<(usize, usize), JointCoordinate>, // asked for: joint, freedom
    joint_rows: Vec<Range<usize>>, // into the constraints, for each joint
    bar_rows: Vec<Range<usize>>,
    scalar_rows: Vec<Range<usize>>,
    tree: Tree,
    particle_tree: ParticleTree,
    cut_joints: Vec<usize>,
    cut_bars: Vec<usize>,
    components: Components,
    round_off: RoundOff,
    loop_tolerance: f64,
    nearly: Option<Box<NearlyRedundant>>,
}

impl Mechanism {
    /// Assembles a mechanism; the spanning tree is found from the ground on, with short loops.
    ///
    /// # Panics
    /// When a joint or a bar names a member that does not exist.
    #[must_use]
    pub fn new(mut description: Description) -> Self {
        description.fit_threads();
        let bodies = description.bodies.len();
        let mut rows = Vec::new();
        let mut place = |new: Vec<ScalarRow>| {
            let start = 6 * bodies + rows.len();
            rows.extend(new);
            start..6 * bodies + rows.len()
        };
        let joint_rows: Vec<_> =
            description.joints.iter().map(|joint| place(joint_rows(joint))).collect();
        let bar_rows: Vec<_> = description
            .bars
            .iter()
            .map(|bar| {
                place(products(vec![BilinearRow::distance(&description.bar_form(bar), bar.length)]))
            })
            .collect();
        let scalar_rows = description.scalars.iter().map(|c| place(c.rows.clone())).collect();
        let other = |&row: &usize| {
            let of_joint = holder(&joint_rows, 6 * bodies + row).is_some();
            !(of_joint && matches!(rows[row], ScalarRow::Product(_)))
        };
        let other_rows = (0..rows.len()).filter(other).collect();
        let step_rows = (0..rows.len()).filter(|&k| rows[k].is_of_a_step()).collect();
        let mut angles = Vec::new();
        rows.iter_mut().for_each(|row| row.list_angles(&mut angles));
        let components = Components::find(&description, &rows, &description.configuration());
        let (tree, cut_joints) = span_bodies(&description);
        let (particle_tree, cut_bars) = span_particles(&description, tree.dof());
        let round_off = RoundOff::new(&description, &tree, &particle_tree);
        Self {
            description,
            rows,
            other_rows,
            step_rows,
            followed: vec![None; angles.len()],
            angles,
            coordinates: BTreeMap::new(),
            joint_rows,
            bar_rows,
            scalar_rows,
            tree,
            particle_tree,
            cut_joints,
            cut_bars,
            components,
            round_off,
            loop_tolerance: LOOP_TOLERANCE,
            nearly: None,
        }
    }

    /// What closed loops may miss, see [`NearlyRedundant`]: rad, or parts of the size of the loop;
    /// 0: nothing.
    #[must_use]
    pub fn with_loop_tolerance(mut self, tolerance: f64) -> Self {
        self.loop_tolerance = tolerance;
        self
    }

    /// See [`Mechanism::with_loop_tolerance`].
    #[must_use]
    pub fn loop_tolerance(&self) -> f64 {
        self.loop_tolerance
    }

    /// Takes constraints as redundant that nearly are.
    #[must_use]
    pub fn accepting(mut self, nearly: Option<NearlyRedundant>) -> Self {
        self.nearly = nearly.map(Box::new);
        self
    }

    /// The constraints that are taken as redundant because they nearly are.
    #[must_use]
    pub fn nearly_redundant(&self) -> Option<&NearlyRedundant> {
        self.nearly.as_deref()
    }

    /// What it was made from.
    #[must_use]
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Coordinate `freedom` of joint `joint` for springs, dampers and motors, an angle with its
    /// revolutions; `None` as [`JointCoordinate::principal`]. Before the integrator takes the
    /// mechanism.
    pub fn coordinate(&mut self, joint: usize, freedom: usize) -> Option<JointCoordinate> {
        let place = (joint, freedom);
        if let Some(known) = self.coordinates.get(&place) {
            if let Some(followed) = self.followed.get_mut(known.slot()) {
                *followed = None;
            }
            return Some(known.clone());
        }
        let own = self.description.joints.get(joint)?;
        let mut coordinate = JointCoordinate::principal(own, freedom)?.placed(joint, freedom);
        coordinate.note_unknown(self.tree.unknown_of(own, freedom));
        coordinate.list(&mut self.angles);
        self.followed.resize(self.angles.len(), None);
        self.coordinates.insert(place, coordinate.clone());
        Some(coordinate)
    }

    /// The same where it was asked for before; otherwise an angle by its principal value.
    #[must_use]
    pub fn known_coordinate(&self, joint: usize, freedom: usize) -> Option<JointCoordinate> {
        let known = self.coordinates.get(&(joint, freedom)).cloned();
        known.or_else(|| {
            let own = self.description.joints.get(joint)?;
            Some(JointCoordinate::principal(own, freedom)?.placed(joint, freedom))
        })
    }

    /// The same for contacts, which read the value of an angle next to a stop alone: unless others
    /// read it, too, it is followed by the increments of the steps.
    pub(crate) fn followed_coordinate(
        &mut self,
        joint: usize,
        freedom: usize,
    ) -> Option<JointCoordinate> {
        if let Some(known) = self.coordinates.get(&(joint, freedom)) {
            return Some(known.clone());
        }
        let coordinate = self.coordinate(joint, freedom)?;
        if let Some(followed) = self.followed.get_mut(coordinate.slot()) {
            *followed = coordinate.unknown();
        }
        Some(coordinate)
    }

    /// The angles whose revolutions count, in the order of [`vi_core::Configuration::angles`].
    #[must_use]
    pub fn angles(&self) -> &[JointCoordinate] {
        &self.angles
    }

    /// Whether a step in which a body moves by a distance, m, raises floors of increments.
    pub(crate) fn raises_floors(&self, distance: f64) -> bool {
        self.round_off.matters(distance)
    }

    /// Raises the floors of increments for a step in which a body moves by a distance, m.
    pub fn raise_floors_by(&self, distance: f64, blocks: &mut [UnknownBlock]) {
        self.round_off.raise_floors_by(distance, blocks);
    }

    /// Whether nothing connects it to the ground.
    #[must_use]
    pub fn is_unsupported(&self) -> bool {
        let Description { joints, bars, scalars, .. } = &self.description;
        let ends = |joint: &Joint| [joint.parent.frame, joint.child.frame];
        let to_ground = |bar: &Bar| matches!(bar.from, BarEnd::Ground(_));
        !joints.iter().flat_map(ends).any(|frame| frame == FrameId::Ground)
            && !bars.iter().any(to_ground)
            && scalars.is_empty()
    }

    /// The spanning tree of the bodies.
    #[must_use]
    pub fn tree(&self) -> &Tree {
        &self.tree
    }

    /// The spanning tree of the point masses.
    #[must_use]
    pub fn particle_tree(&self) -> &ParticleTree {
        &self.particle_tree
    }

    /// Joints outside the tree.
    #[must_use]
    pub fn cut_joints(&self) -> &[usize] {
        &self.cut_joints
    }

    /// Bars outside the tree.
    #[must_use]
    pub fn cut_bars(&self) -> &[usize] {
        &self.cut_bars
    }

    /// Whether anything constrains the motion of the spanning tree: a joint or a bar that closes a
    /// loop, a scalar constraint.
    #[must_use]
    pub fn has_loops(&self) -> bool {
        !(self.cut_joints.is_empty()
            && self.cut_bars.is_empty()
            && self.description.scalars.is_empty())
    }

    /// The same without bars, which constrain point masses alone.
    #[must_use]
    pub fn has_loops_of_bodies(&self) -> bool {
        !(self.cut_joints.is_empty() && self.description.scalars.is_empty())
    }

    /// Whether it has constraints on velocities: rolling, blades.
    #[must_use]
    pub fn has_velocity_constraints(&self) -> bool {
        !self.step_rows.is_empty()
    }

    /// The constraints on velocities, as numbered among all constraints, and what they are.
    pub fn velocity_rows(&self) -> impl Iterator<Item = (usize, &ScalarRow)> {
        let first = directors::INTERNAL * self.description.bodies.len();
        let rows = self.step_rows.iter().map(move |&k| (first + k, &self.rows[k]));
        rows.filter(|(_, row)| row.is_of_velocities())
    }

    /// Whether no constraint has coordinates of bodies and of point masses.
    #[must_use]
    pub fn separates_points(&self) -> bool {
        self.components.separate(self.description.bodies.len())
    }

    /// Whether some frame gets its mass from elements: it moves and has none of its own.
    #[must_use]
    pub fn has_nodes(&self) -> bool {
        let massless = |frame: usize| self.description.bodies[frame].body.is_none();
        self.tree.links().iter().any(|link| link.dof() > 0 && massless(link.frame))
    }

    /// The constraints beside the internal ones of the bodies: of joints, then bars, then scalar
    /// constraints.
    #[must_use]
    pub fn rows(&self) -> &[ScalarRow] {
        &self.rows
    }

    /// How many internal constraints of bodies stand before them.
    #[must_use]
    pub fn len_internal(&self) -> usize {
        directors::INTERNAL * self.description.bodies.len()
    }

    /// The constraints of joint `k`.
    #[must_use]
    pub fn joint_rows(&self, k: usize) -> Range<usize> {
        self.joint_rows[k].clone()
    }

    /// The constraints of joint `k`: number, row.
    pub(crate) fn rows_of_joint(&self, k: usize) -> impl Iterator<Item = (usize, &ScalarRow)> {
        let (first, own) =
            (directors::INTERNAL * self.description.bodies.len(), self.joint_rows(k));
        own.clone().zip(&self.rows[own.start - first..own.end - first])
    }

    /// The constraint of bar `k`.
    #[must_use]
    pub fn bar_rows(&self, k: usize) -> Range<usize> {
        self.bar_rows[k].clone()
    }

    /// The constraints of scalar constraint `k`.
    #[must_use]
    pub fn scalar_rows(&self, k: usize) -> Range<usize> {
        self.scalar_rows[k].clone()
    }

    /// The constraints that act on the tree of bodies, as numbered among all constraints.
    #[must_use]
    pub fn loop_rows(&self) -> Vec<usize> {
        let joints = self.cut_joints.iter().flat_map(|&k| self.joint_rows[k].clone());
        let scalars = self.scalar_rows.iter().cloned().flatten();
        joints.chain(scalars).collect()
    }

    /// The rows that act on the tree of bodies: those of the cut joints and the scalar constraints
    /// (bars cut loops of point masses, which have no joint space).
    #[must_use]
    pub fn loop_constraints(&self) -> Vec<ScalarRow> {
        let first = 6 * self.description.bodies.len();
        self.loop_rows().into_iter().map(|row| self.rows[row - first].clone()).collect()
    }

    /// What a constraint belongs to: the name of a body, a joint or a bar.
    #[must_use]
    pub fn constraint_name(&self, row: usize) -> &str {
        let bodies = &self.description.bodies;
        if row < 6 * bodies.len() {
            return &bodies[row / 6].name;
        }
        let joint = holder(&self.joint_rows, row);
        let bar = || holder(&self.bar_rows, row);
        let scalar = || holder(&self.scalar_rows, row);
        match (joint, bar()) {
            (Some(k), _) => &self.description.joints[k].name,
            (_, Some(k)) => &self.description.bars[k].name,
            _ => scalar().map_or("", |k| &self.description.scalars[k].name),
        }
    }

    /// The member a coordinate belongs to.
    #[must_use]
    pub fn coordinate_name(&self, coordinate: usize) -> &str {
        let bodies = &self.description.bodies;
        if coordinate < 12 * bodies.len() {
            return &bodies[coordinate / 12].name;
        }
        let k = (coordinate - 12 * bodies.len()) / self.description.dimension;
        self.description.particles.get(k).map_or("", |p| &p.name)
    }

    /// The body that an increment of the spanning tree moves, and the joint that carries it.
    #[must_use]
    pub fn increment_name(&self, unknown: usize) -> Option<String> {
        let link = self.tree.owner(unknown)?;
        let body = &self.description.bodies[link.frame].name;
        Some(format!("body `{body}`, the child of `{}`", link.joint.name))
    }

    /// The joint of the spanning tree that a rate `ν_k` belongs to: its name, for free members
    /// their own, for point masses that of the mass.
    #[must_use]
    pub fn rate_name(&self, rate: usize) -> &str {
        match self.tree.owner(rate) {
            Some(link) => &link.joint.name,
            None => self.particle_tree.owner(rate).map_or("", |at| self.coordinate_name(at)),
        }
    }

    /// Offset of the coordinates of a point mass.
    #[must_use]
    pub fn particle_offset(&self, k: usize) -> usize {
        self.description.particle_offset(k)
    }

    /// The constant mass matrix, LMO08 (58), (65), plus what `extra` emits (beam elements).
    #[must_use]
    pub fn mass(&self, extra: impl FnOnce(&mut dyn Entries)) -> SparseMatrix {
        let n = self.dim();
        SparseMatrix::assemble(n, n, |out| {
            for (k, body) in self.description.bodies.iter().enumerate() {
                if let Some(body) = &body.body {
                    body.emit_mass(12 * k, out);
                }
            }
            for (k, particle) in self.description.particles.iter().enumerate() {
                let at = self.particle_offset(k);
                (0..self.description.dimension)
                    .for_each(|i| out.add(at + i, at + i, particle.mass));
            }
            extra(out);
        })
    }

    /// The bodies with their joints and scalar constraints, and the point masses with their bars,
    /// each as a mechanism of its own; `None` without bodies or without point masses, or where a
    /// constraint has coordinates of both.
    #[must_use]
    pub(crate) fn bodies_and_points(&self) -> Option<[Self; 2]> {
        let Description { dimension, gravity, bodies, particles, .. } = &self.description;
        if bodies.is_empty() || particles.is_empty() || !self.separates_points() {
            return None;
        }
        let of_bodies =
            Description { particles: Vec::new(), bars: Vec::new(), ..self.description.clone() };
        let of_points = Description {
            dimension: *dimension,
            gravity: *gravity,
            particles: particles.clone(),
            bars: self.description.bars.clone(),
            ..Description::default()
        };
        Some([Self::new(of_bodies), Self::new(of_points)])
    }

    /// The system with its mass matrix and gravity.
    #[must_use]
    pub fn system(&self, quadrature: Quadrature) -> SeparableSystem {
        self.system_with_mass(self.mass(|_| {}), quadrature)
    }

    /// The system with a given mass matrix and gravity, `V = −(M γ)·q`.
    #[must_use]
    pub fn system_with_mass(&self, mass: SparseMatrix, quadrature: Quadrature) -> SeparableSystem {
        let gravity = self.gravity(&mass);
        let system = SeparableSystem::new(mass).quadrature(quadrature);
        match gravity {
            Some(weight) => system.gravity(weight),
            None => system,
        }
    }

    /// Gravity, `V = −(M γ)·q`, with a given mass matrix; `None` without it.
    #[must_use]
    pub fn gravity(&self, mass: &SparseMatrix) -> Option<LinearPotential> {
        let weighs = self.description.gravity != Vector3::zeros();
        weighs.then(|| LinearPotential { force: self.weight(mass) })
    }

    /// The weight `M γ`, N, with the acceleration `γ` of gravity at every point, shape `n`.
    #[must_use]
    pub fn weight(&self, mass: &SparseMatrix) -> Vec<f64> {
        self.weight_in(&self.description.gravity, mass)
    }

    /// The same with another acceleration of gravity.
    #[must_use]
    pub(crate) fn weight_in(&self, gravity: &Vector3<f64>, mass: &SparseMatrix) -> Vec<f64> {
        let mut acceleration = vec![0.0; self.dim()]; // γ at every point, 0 at every director
        for k in 0..self.description.bodies.len() {
            (0..3).for_each(|i| acceleration[12 * k + i] = gravity[i]);
        }
        for k in 0..self.description.particles.len() {
            let at = self.particle_offset(k);
            (0..self.description.dimension).for_each(|i| acceleration[at + i] = gravity[i]);
        }
        let mut force = vec![0.0; self.dim()];
        mass.mul_add(1.0, &acceleration, &mut force);
        force
    }

    /// `q(0)` of the description.
    #[must_use]
    pub fn initial_configuration(&self) -> Vec<f64> {
        self.description.configuration()
    }

    /// `v(0)` of the description.
    #[must_use]
    pub fn initial_velocity(&self) -> Vec<f64> {
        let (q, mut v) = (self.initial_configuration(), vec![0.0; self.dim()]);
        for (k, body) in self.description.bodies.iter().enumerate() {
            let own = 12 * k..12 * k + 12;
            let rate = directors::spin_velocity(&q[own.clone()], &body.velocity, &body.omega);
            v[own].copy_from_slice(&rate);
        }
        for (k, particle) in self.description.particles.iter().enumerate() {
            let at = self.particle_offset(k);
            (0..self.description.dimension).for_each(|i| v[at + i] = particle.velocity[i]);
        }
        v
    }

    /// Linear and angular momentum of a momentum vector `p` at `q`.
    #[must_use]
    pub fn momentum(&self, q: &[f64], p: &[f64]) -> Momentum {
        let mut momentum = Momentum::default();
        for k in 0..self.description.bodies.len() {
            let own = 12 * k..12 * k + 12;
            directors::add_momentum(&q[own.clone()], &p[own], &mut momentum);
        }
        for k in 0..self.description.particles.len() {
            let (at, dimension) = (self.particle_offset(k), self.description.dimension);
            let read =
                |x: &[f64]| std::array::from_fn(|i| if i < dimension { x[at + i] } else { 0.0 });
            momentum.add(read(q), read(p), true);
        }
        momentum
    }

    /// The point of a member as a form: body components from `φ`; `point` is not read for
    /// particles.
    #[must_use]
    pub fn point_of(&self, member: Attachment, point: &Vector3<f64>) -> Form {
        match member {
            Attachment::Ground => Form::constant(*point),
            Attachment::Body(k) => Form::point(12 * k, point),
            Attachment::Particle(k) => {
                Form::particle(self.particle_offset(k), self.description.dimension)
            }
        }
    }
}

/// Which of these ranges, one after the other, holds a row.
fn holder(ranges: &[Range<usize>], row: usize) -> Option<usize> {
    let k = ranges.partition_point(|range| range.end <= row);
    ranges.get(k).is_some_and(|range| range.contains(&row)).then_some(k)
}

fn joint_rows(joint: &Joint) -> Vec<ScalarRow> {
    let mut rows = products(joint.kind.rows(joint));
    rows.extend(joint.kind.pitch().and_then(|pitch| ScalarRow::thread(joint, pitch)));
    rows
}

fn products(rows: Vec<BilinearRow>) -> Vec<ScalarRow> {
    rows.into_iter().map(ScalarRow::Product).collect()
}
