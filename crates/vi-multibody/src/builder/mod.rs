//! A mechanism described in Rust: bodies, joints, constraints, force elements.
//!
//! Everything is stated in the initial configuration: positions, axes and velocities in space;
//! points of a body also in its own components from its centre of mass. SI units, angles in rad.
//! The parts return typed ids by which later parts refer to them; what is wrong is said by
//! [`MechanismBuilder::build`].

mod assembly;
mod body;
mod bushing;
mod contact;
mod effort_slopes;
mod error;
mod force;
mod id;
mod joint;
mod law;
mod rates;

pub use body::{BodyEntry, Inertia};
pub use bushing::BushingEntry;
pub use contact::{DryFriction, JointLimits};
pub use error::BuildError;
pub use force::{
    BuiltMechanism, ElementForce, ForceElements, ForceEntry, LoadEntry, NamedForce, NamedSixSpring,
    SpringEntry,
};
pub use id::{BodyId, CoordinateId, JointId, ParticleId, PointOn};
pub use joint::JointEntry;
pub use law::{ActOn, Read};
pub use rates::ConstrainedRate;

use crate::constraint::scalar_constraint::Reference;
use crate::contact::compliant_contact::CompliantContact;
use crate::force::joint_force::{JointLaw, Motor};
use crate::force::wrench_law::WrenchLaw;
use crate::mechanism::description::{BarEnd, BodySpec, ParticleSpec};
use crate::pair::PairKind;
use crate::pair::joint::{FrameId, Joint};
use body::BodyPart;
use bushing::BushingPart;
use contact::ContactPart;
use force::{
    JointElementKind, JointForceElement, LoadPart, OwnForce, ParticleLoadPart, PointElement,
    TensionPart, WrenchPart,
};
pub(crate) use id::PointPlace;
use joint::JointPart;
use law::{LawPart, SignalsPart};
use nalgebra::Vector3;
use rates::RatesPart;
use std::ops::Range;
use std::sync::Arc;
use vi_core::force::Force;
use vi_rigid::load::Load;
use vi_rigid::time_history::TimeHistory;

/// The parts of a mechanism.
///
/// ```
/// use vi_constraints::{Options, SchemeKind};
/// use vi_multibody::builder::{Inertia, MechanismBuilder};
/// use vi_multibody::{FrameId::Ground, PairKind};
/// use vi_rigid::Shape;
///
/// // a double pendulum: two bars of 1 m, hinges about y, released from the horizontal
/// let bar = Inertia::shape(Shape::Box { lengths: [1.0, 0.05, 0.05] }, 7800.0);
/// let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
/// let upper = builder.body("upper", bar).at([0.5, 0.0, 0.0]).id();
/// let lower = builder.body("lower", bar).at([1.5, 0.0, 0.0]).id();
/// let y = [0.0, 1.0, 0.0];
/// builder.joint("shoulder", PairKind::Revolute, Ground, upper).at([0.0; 3]).axis(y);
/// builder.joint("elbow", PairKind::Revolute, upper, lower).at([1.0, 0.0, 0.0]).axis(y);
///
/// let mut run = builder.build()?.integrator(Options::new(SchemeKind::Nodal, 1e-3))?;
/// for _ in 0..500 {
///     run.step()?;
/// }
/// let energy = run.observe()?.hamiltonian_projected.total(); // 0 J initially
/// assert!(energy.abs() < 1e-2, "E = {energy} J");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Default)]
pub struct MechanismBuilder {
    dimension: usize,
    gravity: Vector3<f64>,
    bodies: Vec<BodyPart>,
    particles: Vec<ParticleSpec>,
    joints: Vec<JointPart>,
    bars: Vec<BarPart>,
    constraints: Vec<ConstraintPart>,
    point_elements: Vec<PointElement>,
    joint_elements: Vec<JointForceElement>,
    loads: Vec<LoadPart>,
    particle_loads: Vec<ParticleLoadPart>,
    tensions: Vec<TensionPart>,
    wrenches: Vec<WrenchPart>,
    bushings: Vec<BushingPart>,
    contacts: Vec<ContactPart>,
    compliant: Vec<(String, CompliantContact)>,
    own_forces: Vec<OwnForce>,
    laws: Vec<LawPart>,
    signals: Option<SignalsPart>,
    beams: Vec<Range<usize>>,
}

#[derive(Clone)]
struct BarPart {
    name: String,
    from: BarEnd,
    to: ParticleId,
    length: Option<f64>,
}

#[derive(Clone)]
struct ConstraintPart {
    name: String,
    kind: ConstraintKind,
}

#[derive(Clone)]
enum ConstraintKind {
    Distance { from: PointOn, to: PointOn, length: Option<f64> },
    PointOnLine(Guide),
    PointOnPlane(Guide),
    Gear { a: CoordinateId, b: CoordinateId, ratio: f64 },
    Motion { coordinate: CoordinateId, reference: Reference },
    Held { coordinate: CoordinateId, target: f64 },
    Rolling(RollingPart),
    Blade { body: BodyId, point: Vector3<f64>, axis: Vector3<f64> },
    Rates(RatesPart),
}

/// A wheel or a sphere on a plane, as it stands initially.
#[derive(Clone, Debug)]
pub struct RollingPart {
    /// What rolls.
    pub body: BodyId,
    /// Axis of a wheel, in space; `None`: a sphere.
    pub axis: Option<Vector3<f64>>,
    /// Outer radius, m.
    pub radius: f64,
    /// Radius of the section of the tyre, part of `radius`, m.
    pub tube: f64,
    /// A point of the plane, m.
    pub origin: Vector3<f64>,
    /// Its normal.
    pub normal: Vector3<f64>,
    /// It turns about its normal through this point, rad/s.
    pub spin: f64,
}

/// A point of the child on a line or a plane of the parent.
#[derive(Clone, Copy)]
struct Guide {
    parent: FrameId,
    child: FrameId,
    point: Vector3<f64>,
    axis: Vector3<f64>,
}

impl std::fmt::Debug for MechanismBuilder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let names = |names: &mut dyn Iterator<Item = &str>| names.collect::<Vec<_>>().join(", ");
        f.debug_struct("MechanismBuilder")
            .field("bodies", &names(&mut self.bodies.iter().map(BodyPart::name)))
            .field("particles", &names(&mut self.particles.iter().map(|p| &p.name[..])))
            .field("joints", &names(&mut self.joints.iter().map(|j| &j.name[..])))
            .field("bars", &names(&mut self.bars.iter().map(|b| &b.name[..])))
            .field("constraints", &names(&mut self.constraints.iter().map(|c| &c.name[..])))
            .finish_non_exhaustive()
    }
}

impl MechanismBuilder {
    /// An empty mechanism without gravity.
    #[must_use]
    pub fn new() -> Self {
        Self { dimension: 3, ..Self::default() }
    }

    /// The same for point masses in the plane: two coordinates each, third components are not read.
    #[must_use]
    pub fn planar() -> Self {
        Self { dimension: 2, ..Self::default() }
    }

    /// The acceleration of gravity, m/s².
    #[must_use]
    pub fn gravity(mut self, acceleration: impl Into<Vector3<f64>>) -> Self {
        self.gravity = acceleration.into();
        self
    }

    /// Adds a rigid body, at rest in the origin along the axes of space until the entry says
    /// otherwise.
    pub fn body(&mut self, name: &str, inertia: impl Into<Inertia>) -> BodyEntry<'_> {
        let id = BodyId(self.bodies.len());
        self.bodies.push(BodyPart::new(name, inertia.into()));
        BodyEntry::new(id, &mut self.bodies[id.0])
    }

    /// Adds a frame as it is: its triad along principal axes, or without mass (a node of a beam).
    pub fn frame(&mut self, frame: BodySpec) -> BodyId {
        self.bodies.push(BodyPart::Given(frame));
        BodyId(self.bodies.len() - 1)
    }

    /// How many bodies and frames there are: the number of the next one.
    #[must_use]
    pub fn frame_count(&self) -> usize {
        self.bodies.len()
    }

    /// The ids of all bodies and frames, in order.
    pub fn frames(&self) -> impl Iterator<Item = BodyId> + use<> {
        (0..self.bodies.len()).map(BodyId)
    }

    /// These frames start as one rigid body: without velocities of their own they take the motion
    /// of the first of them that a joint moves (the nodes of a beam).
    pub fn start_together(&mut self, frames: Range<usize>) {
        self.beams.push(frames);
    }

    /// Adds a point mass: kg, m, m/s.
    pub fn particle(
        &mut self,
        name: &str,
        mass: f64,
        position: impl Into<Vector3<f64>>,
        velocity: impl Into<Vector3<f64>>,
    ) -> ParticleId {
        let (position, velocity) = (position.into(), velocity.into());
        self.particles.push(ParticleSpec { name: name.to_owned(), mass, position, velocity });
        ParticleId(self.particles.len() - 1)
    }

    /// Adds a joint from a parent to a child; the entry takes its position and its axes.
    pub fn joint(
        &mut self,
        name: &str,
        kind: PairKind,
        parent: impl Into<FrameId>,
        child: impl Into<FrameId>,
    ) -> JointEntry<'_> {
        let id = JointId(self.joints.len());
        self.joints.push(JointPart::new(name, kind, parent.into(), child.into()));
        JointEntry::new(id, &mut self.joints[id.0])
    }

    /// Adds a joint whose sides are known in the components of their frames.
    pub fn joint_of_sides(&mut self, joint: Joint) -> JointEntry<'_> {
        let id = JointId(self.joints.len());
        self.joints.push(JointPart::given(joint));
        JointEntry::new(id, &mut self.joints[id.0])
    }

    /// Adds a massless rigid bar between a point mass or a point of the ground and a point mass, as
    /// long as their initial distance.
    pub fn bar(&mut self, name: &str, from: impl Into<BarEnd>, to: ParticleId) {
        self.bars.push(BarPart { name: name.to_owned(), from: from.into(), to, length: None });
    }

    /// Adds a bar of a given length, m.
    pub fn bar_of_length(
        &mut self,
        name: &str,
        from: impl Into<BarEnd>,
        to: ParticleId,
        length: f64,
    ) {
        let length = Some(length);
        self.bars.push(BarPart { name: name.to_owned(), from: from.into(), to, length });
    }

    fn constraint(&mut self, name: &str, kind: ConstraintKind) {
        self.constraints.push(ConstraintPart { name: name.to_owned(), kind });
    }

    /// Two points keep their initial distance: a massless rod between bodies.
    pub fn distance(&mut self, name: &str, from: impl Into<PointOn>, to: impl Into<PointOn>) {
        let (from, to) = (from.into(), to.into());
        self.constraint(name, ConstraintKind::Distance { from, to, length: None });
    }

    /// Two points keep the distance `length`, m.
    pub fn distance_of_length(
        &mut self,
        name: &str,
        from: impl Into<PointOn>,
        to: impl Into<PointOn>,
        length: f64,
    ) {
        let (from, to, length) = (from.into(), to.into(), Some(length));
        self.constraint(name, ConstraintKind::Distance { from, to, length });
    }

    /// The point of the child at `point` stays on the line of the parent through it along
    /// `direction`, both in space in the initial configuration.
    pub fn point_on_line(
        &mut self,
        name: &str,
        parent: impl Into<FrameId>,
        child: impl Into<FrameId>,
        point: impl Into<Vector3<f64>>,
        direction: impl Into<Vector3<f64>>,
    ) {
        let (parent, child, point) = (parent.into(), child.into(), point.into());
        let guide = Guide { parent, child, point, axis: direction.into() };
        self.constraint(name, ConstraintKind::PointOnLine(guide));
    }

    /// The point of the child at `point` stays on the plane of the parent through it with normal
    /// `normal`, both in space in the initial configuration.
    pub fn point_on_plane(
        &mut self,
        name: &str,
        parent: impl Into<FrameId>,
        child: impl Into<FrameId>,
        point: impl Into<Vector3<f64>>,
        normal: impl Into<Vector3<f64>>,
    ) {
        let (parent, child, point) = (parent.into(), child.into(), point.into());
        let guide = Guide { parent, child, point, axis: normal.into() };
        self.constraint(name, ConstraintKind::PointOnPlane(guide));
    }

    /// `θ_a + ratio θ_b` keeps its initial value: gears (ratio: teeth of b over teeth of a for
    /// gears that rotate in opposite directions), racks.
    pub fn gear(&mut self, name: &str, a: CoordinateId, b: CoordinateId, ratio: f64) {
        self.constraint(name, ConstraintKind::Gear { a, b, ratio });
    }

    /// The coordinate keeps the value `target` (m or rad, revolutions counted).
    pub fn hold(&mut self, name: &str, coordinate: CoordinateId, target: f64) {
        self.constraint(name, ConstraintKind::Held { coordinate, target });
    }

    /// The coordinate follows `θ_ref(t)`; `reference` gives `θ_ref`, `θ̇_ref` and `θ̈_ref`. The
    /// initial velocities should agree with `θ̇_ref(0)`.
    pub fn motion(
        &mut self,
        name: &str,
        coordinate: CoordinateId,
        reference: impl Fn(f64) -> [f64; 3] + Send + Sync + 'static,
    ) {
        let reference: Reference = Arc::new(reference);
        self.constraint(name, ConstraintKind::Motion { coordinate, reference });
    }

    /// A wheel or a sphere rolls on a plane of the ground.
    pub fn rolling(&mut self, name: &str, part: RollingPart) {
        self.constraint(name, ConstraintKind::Rolling(part));
    }

    /// The point of a body at `point` has no velocity along `axis` of the body, both in space in
    /// the initial configuration: a blade, a keel.
    pub fn blade(
        &mut self,
        name: &str,
        body: BodyId,
        point: impl Into<Vector3<f64>>,
        axis: impl Into<Vector3<f64>>,
    ) {
        let (point, axis) = (point.into(), axis.into());
        self.constraint(name, ConstraintKind::Blade { body, point, axis });
    }

    /// Adds a spring between two points: stiffness in N/m, natural length 0 until the entry says
    /// otherwise.
    pub fn spring(
        &mut self,
        from: impl Into<PointOn>,
        to: impl Into<PointOn>,
        stiffness: f64,
    ) -> SpringEntry<'_> {
        let element = PointElement::new(from.into(), to.into(), Some(stiffness), 0.0);
        SpringEntry::new(added(&mut self.point_elements, element))
    }

    /// Adds a damper between two points, along their line: N·s/m.
    pub fn damper(
        &mut self,
        from: impl Into<PointOn>,
        to: impl Into<PointOn>,
        damping: f64,
    ) -> ForceEntry<'_> {
        let element = PointElement::new(from.into(), to.into(), None, damping);
        ForceEntry { name: &mut added(&mut self.point_elements, element).name }
    }

    fn joint_element(
        &mut self,
        coordinate: CoordinateId,
        kind: JointElementKind,
    ) -> ForceEntry<'_> {
        let element = JointForceElement { name: String::new(), coordinate, kind };
        ForceEntry { name: &mut added(&mut self.joint_elements, element).name }
    }

    /// Adds `½ k (θ − θ_0)²` on a joint coordinate: `stiffness` in N/m or N·m/rad, `rest` in m or
    /// rad, revolutions counted.
    pub fn joint_spring(&mut self, coordinate: CoordinateId, stiffness: f64, rest: f64) {
        self.joint_element(coordinate, JointElementKind::Spring { stiffness, rest });
    }

    /// Adds a force or torque on a joint coordinate: [`crate::force::joint_force::Viscous`]
    /// friction, a [`crate::force::joint_force::PdControl`], or a law of your own.
    pub fn joint_force(
        &mut self,
        coordinate: CoordinateId,
        law: impl JointLaw + 'static,
    ) -> ForceEntry<'_> {
        self.joint_element(coordinate, JointElementKind::Force(Arc::new(law)))
    }

    /// Adds a motor on a joint coordinate: its effort as a function of time, N or N·m.
    pub fn motor(
        &mut self,
        coordinate: CoordinateId,
        effort: impl Fn(f64) -> f64 + Send + Sync + 'static,
    ) -> ForceEntry<'_> {
        self.joint_force(coordinate, Motor(Arc::new(effort)))
    }

    /// Adds a force of your own on the coordinates of the mechanism, at midpoints in every family
    /// of schemes.
    pub fn force(&mut self, force: impl Force + 'static) -> ForceEntry<'_> {
        let own = OwnForce { name: String::new(), force: Arc::new(force) };
        ForceEntry { name: &mut added(&mut self.own_forces, own).name }
    }

    /// Adds a tension between two points by a law of their distance (m) and its rate (m/s), N:
    /// positive where it pulls them together.
    pub fn tension(
        &mut self,
        from: impl Into<PointOn>,
        to: impl Into<PointOn>,
        law: impl JointLaw + 'static,
    ) -> ForceEntry<'_> {
        let (name, law): (_, Arc<dyn JointLaw>) = (String::new(), Arc::new(law));
        let part = TensionPart { name, from: from.into(), to: to.into(), law };
        ForceEntry { name: &mut added(&mut self.tensions, part).name }
    }

    /// Adds a force (N) at a point of a body or on a point mass, and a torque (N·m), by a law of
    /// its motion: components in space, or along the axes of the body for one that `follows`.
    pub fn wrench(
        &mut self,
        at: impl Into<PointOn>,
        follows: bool,
        law: impl WrenchLaw + 'static,
    ) -> ForceEntry<'_> {
        let part = WrenchPart { name: String::new(), at: at.into(), follows, law: Arc::new(law) };
        ForceEntry { name: &mut added(&mut self.wrenches, part).name }
    }

    /// Adds a bushing between two frames: the entry takes its place, its axes and its efforts.
    pub fn bushing(
        &mut self,
        from: impl Into<FrameId>,
        to: impl Into<FrameId>,
    ) -> BushingEntry<'_> {
        let part = BushingPart::new(from.into(), to.into());
        BushingEntry::new(added(&mut self.bushings, part))
    }

    /// Adds a load on a body; the entry takes force, torque, point and time history.
    pub fn load(&mut self, body: BodyId) -> LoadEntry<'_> {
        LoadEntry::new(added(&mut self.loads, LoadPart::new(body)))
    }

    /// Adds a force on a point mass, N: components in space, times a history.
    pub fn particle_load(
        &mut self,
        particle: ParticleId,
        force: impl Into<Vector3<f64>>,
        history: TimeHistory,
    ) -> ForceEntry<'_> {
        let (name, force) = (String::new(), force.into());
        let load = ParticleLoadPart { name, particle, force, history };
        ForceEntry { name: &mut added(&mut self.particle_loads, load).name }
    }

    /// Adds a load of this name as it is: components along principal axes, frame by its offset.
    pub fn load_of_frame(&mut self, name: &str, load: Load) {
        self.loads.push(LoadPart::Given(name.to_owned(), load));
    }
}

/// Adds a part to a list.
fn added<T>(parts: &mut Vec<T>, part: T) -> &mut T {
    parts.push(part);
    parts.last_mut().expect("it was just added")
}
