//! Force elements: springs, dampers, motors, loads, as parts of a builder and as numbers.

use super::error::finite;
use super::{BodyId, BuildError, CoordinateId, ParticleId, PointOn, PointPlace};
use crate::constraint::joint_coordinate::JointCoordinate;
use crate::contact::Contacts;
use crate::contact::compliant_contact::CompliantContact;
use crate::force::bushing::{SixForce, SixSpring};
use crate::force::joint_force::{JointForce, JointLaw, JointSpring};
use crate::force::law::{LawForce, SignalStates};
use crate::force::spring::{Spring, SpringLaw};
use crate::force::stored_energy::Along;
use crate::force::tension::Tension;
use crate::force::wrench_law::{WrenchForce, WrenchLaw};
use crate::geometry::six_coordinates::{SixCoordinates, Vector6};
use crate::mechanism::Mechanism;
use crate::solver::run::{MechanismIntegrator, Solver, integrator, with_contacts};
use nalgebra::Vector3;
use std::sync::Arc;
use vi_constraints::InitialValues;
use vi_constraints::Options;
use vi_constraints::integrator::SetupError;
use vi_constraints::nonsmooth::NonsmoothOptions;
use vi_core::force::{DiscreteForce, Force, MidpointForce, Source};
use vi_core::{Motion, Quadrature, SeparableSystem};
use vi_rigid::load::{Load, LoadKind};
use vi_rigid::time_history::TimeHistory;

/// The energy of a bushing, with its name.
#[derive(Clone, Debug)]
pub struct NamedSixSpring {
    /// The name; empty where it was given none.
    pub name: String,
    /// The energy.
    pub spring: SixSpring,
}

/// What acts on a mechanism beside gravity, for any family of schemes.
#[derive(Clone, Debug, Default)]
pub struct ForceElements {
    /// Springs between points.
    pub springs: Vec<Spring>,
    /// Springs on joint coordinates.
    pub joint_springs: Vec<JointSpring>,
    /// The energies of bushings.
    pub bushings: Vec<NamedSixSpring>,
    /// Everything else, in the order in which systems list it.
    pub forces: Vec<NamedForce>,
    /// States and held values that laws read.
    pub signals: Option<SignalStates>,
    /// The energies of compliant contacts.
    pub compliant: Vec<CompliantContact>,
    /// Contacts, joint stops and dry friction: [`crate::run::with_contacts`].
    pub contacts: Contacts,
}

/// A force with the name of its element.
#[derive(Clone, Debug)]
pub struct NamedForce {
    /// The name; empty where it was given none.
    pub name: String,
    /// The force.
    pub force: ElementForce,
}

/// A force as the families of schemes discretize it.
#[derive(Clone)]
pub enum ElementForce {
    /// `f(t, q, v)`, at midpoints: dampers between points, forces on point masses, any other.
    Coordinates(Arc<dyn Force>),
    /// Along a joint coordinate: dampers, motors, controls.
    Joint(JointForce<Arc<dyn JointLaw>>),
    /// Between two points, by a law of their distance.
    Tension(Tension),
    /// On a body.
    Body(Load),
    /// On a body or a point mass, by a law of its motion.
    Wrench(WrenchForce),
    /// By a law of anything that moves.
    Law(LawForce),
    /// Along six coordinates between two frames: bushings, bearings.
    Six(SixForce),
}

impl std::fmt::Debug for ElementForce {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Coordinates(_) => f.debug_struct("Coordinates").finish_non_exhaustive(),
            Self::Joint(force) => f.debug_tuple("Joint").field(force).finish(),
            Self::Tension(force) => f.debug_tuple("Tension").field(force).finish(),
            Self::Body(load) => f.debug_tuple("Body").field(load).finish(),
            Self::Wrench(force) => f.debug_tuple("Wrench").field(force).finish(),
            Self::Law(force) => f.debug_tuple("Law").field(force).finish(),
            Self::Six(force) => f.debug_tuple("Six").field(force).finish(),
        }
    }
}

impl ElementForce {
    /// As variational schemes discretize it; `first`: where the internal variables of signals
    /// begin.
    #[must_use]
    pub fn discrete(&self, first: usize) -> Box<dyn DiscreteForce> {
        match self.clone() {
            Self::Coordinates(force) => Box::new(MidpointForce(force)),
            Self::Joint(force) => Box::new(force),
            Self::Tension(force) => Box::new(MidpointForce(force)),
            Self::Body(load) => Box::new(load),
            Self::Wrench(force) => Box::new(force),
            Self::Law(mut force) => {
                force.reading.first = first;
                Box::new(force)
            }
            Self::Six(mut force) => {
                force.reading.first = first;
                Box::new(force)
            }
        }
    }
}

impl NamedForce {
    /// What exerts it.
    #[must_use]
    pub fn source(&self) -> Source {
        Source::Element(self.name.clone())
    }

    /// What it acts along, with its law, where that reads nothing but this coordinate.
    #[must_use]
    pub fn potential(&self) -> Option<(Along, &Arc<dyn JointLaw>)> {
        let (along, law) = match &self.force {
            ElementForce::Joint(JointForce { coordinate, law }) => {
                (Along::Coordinate(Box::new(coordinate.clone())), law)
            }
            ElementForce::Tension(Tension { between, law }) => {
                (Along::Distance(between.clone()), law)
            }
            _ => return None,
        };
        law.is_potential().then_some((along, law))
    }

    /// What a law states at a node, and how many numbers that are: the effort along a joint
    /// coordinate or the tension between two points, N or N·m; force (N) and torque (N·m) on a
    /// body along the axes of its law, the force on a point mass followed by zeros. `None` where it
    /// is no law.
    #[must_use]
    pub fn efforts(&self, at: Motion<'_>) -> Option<([f64; 6], usize)> {
        let single = |effort| Some(([effort, 0.0, 0.0, 0.0, 0.0, 0.0], 1));
        match &self.force {
            ElementForce::Joint(JointForce { coordinate, law }) => single(law.effort(
                at.t,
                coordinate.at(at.configuration()),
                coordinate.rate(at.q, at.v),
            )),
            ElementForce::Tension(force) => single(force.tension_and_rate(at.t, at.q, at.v)[0]),
            ElementForce::Wrench(force) => Some((force.efforts(at.t, at.q, at.v), 6)),
            ElementForce::Law(force) => Some(force.efforts(at)),
            _ => None,
        }
    }
}

impl ForceElements {
    /// Whether there are springs between points or on joints.
    #[must_use]
    pub fn has_springs(&self) -> bool {
        !(self.springs.is_empty() && self.joint_springs.is_empty())
    }

    /// The efforts of the bushing of this name on its second frame, N and N·m; `None` where there
    /// is none that acts.
    #[must_use]
    pub fn bushing_efforts(&self, name: &str, at: Motion<'_>) -> Option<Vector6> {
        let springs = self.bushings.iter().filter(|own| own.name == name);
        let springs = springs.map(|own| own.spring.efforts(at.t, at.q));
        let forces = self.forces.iter().filter(|own| own.name == name);
        let forces = forces.filter_map(|own| match &own.force {
            ElementForce::Six(force) => Some(force.efforts(at)),
            _ => None,
        });
        springs.chain(forces).reduce(|sum, efforts| sum + efforts)
    }

    /// Those of this name alone.
    #[must_use]
    pub fn only(&self, name: &str) -> Self {
        let bushings = self.bushings.iter().filter(|own| own.name == name).cloned().collect();
        let forces = self.forces.iter().filter(|own| own.name == name).cloned().collect();
        Self { bushings, forces, ..Self::default() }
    }

    /// What bushings, laws and other forces put into the system in a second, W; springs take no
    /// part. `scratch`: shape `n`.
    #[must_use]
    pub fn power(&self, at: Motion<'_>, scratch: &mut Vec<f64>) -> f64 {
        let of_spring = |own: &NamedSixSpring| {
            let spring = &own.spring;
            spring.efforts(at.t, at.q).dot(&spring.coordinates.rate(at.q, at.v))
        };
        let stored: f64 = self.bushings.iter().map(of_spring).sum();
        scratch.clear();
        scratch.resize(at.v.len(), 0.0);
        for own in &self.forces {
            match &own.force {
                ElementForce::Coordinates(force) => force.add(at, 1.0, scratch),
                ElementForce::Joint(force) => force.add_continuous(at, scratch),
                ElementForce::Tension(force) => force.add(at, 1.0, scratch),
                ElementForce::Body(force) => force.add_continuous(at, scratch),
                ElementForce::Wrench(force) => force.add_continuous(at, scratch),
                ElementForce::Law(force) => force.add_continuous(at, scratch),
                ElementForce::Six(force) => force.add_continuous(at, scratch),
            }
        }
        stored + scratch.iter().zip(at.v).map(|(f, v)| f * v).sum::<f64>()
    }

    /// The coordinates of the bushing of this name.
    #[must_use]
    pub fn bushing_coordinates(&self, name: &str) -> Option<&SixCoordinates> {
        let springs = self.bushings.iter().filter(|own| own.name == name);
        let mut forces = self.forces.iter().filter(|own| own.name == name);
        springs.map(|own| &own.spring.coordinates).next().or_else(|| {
            forces.find_map(|own| match &own.force {
                ElementForce::Six(force) => Some(&force.coordinates),
                _ => None,
            })
        })
    }

    /// The loads on bodies of this name, one for each place where they act.
    pub fn loads<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Load> {
        self.forces.iter().filter(move |own| own.name == name).filter_map(|own| match &own.force {
            ElementForce::Body(load) => Some(load),
            _ => None,
        })
    }

    pub(super) fn add(&mut self, name: &str, force: ElementForce) {
        self.forces.push(NamedForce { name: name.to_owned(), force });
    }

    /// Adds all of them to a variational system.
    #[must_use]
    pub fn add_to(&self, mut system: SeparableSystem) -> SeparableSystem {
        for spring in &self.springs {
            system = system.potential(spring.clone());
        }
        for spring in &self.joint_springs {
            system = system.discrete_potential(Box::new(spring.clone()));
        }
        for contact in &self.compliant {
            system = system.potential(contact.clone());
        }
        let first = system.variables_of_forces(); // of signals
        for own in &self.bushings {
            system = system.discrete_potential(Box::new(own.spring.clone()));
        }
        for own in &self.forces {
            system = system.force_of(own.source(), own.force.discrete(first));
        }
        if let Some(mut signals) = self.signals.clone() {
            signals.reading.first = first;
            system = system.signals(Box::new(signals));
        }
        system
    }
}

/// A mechanism, and what acts on it.
#[derive(Clone, Debug)]
pub struct BuiltMechanism {
    /// Bodies, joints, constraints, spanning tree.
    pub mechanism: Mechanism,
    /// Springs, dampers, motors, loads.
    pub forces: ForceElements,
}

impl BuiltMechanism {
    /// The variational system: masses, gravity, force elements.
    #[must_use]
    pub fn system(&self, quadrature: Quadrature) -> SeparableSystem {
        self.forces.add_to(self.mechanism.system(quadrature))
    }

    /// A joint coordinate, an angle with its revolutions: for reading along a run.
    ///
    /// `None` for degrees of freedom that are no coordinate; see [`Mechanism::coordinate`].
    pub fn coordinate(&mut self, coordinate: CoordinateId) -> Option<JointCoordinate> {
        self.mechanism.coordinate(coordinate.joint.index(), coordinate.freedom)
    }

    /// The motion from the initial configuration at `t = 0`, with the midpoint rule and the fastest
    /// solver that applies; [`integrator`] takes other choices.
    ///
    /// # Errors
    /// [`SetupError`].
    pub fn integrator(self, options: Options) -> Result<MechanismIntegrator, SetupError> {
        let (q, v) = (self.mechanism.initial_configuration(), self.mechanism.initial_velocity());
        let system = self.system(Quadrature::Midpoint);
        let (contacts, at) = (self.forces.contacts, InitialValues::new(0.0, &q, &v));
        let run = integrator(self.mechanism, system, options, Solver::Auto, at)?;
        with_contacts(run, options.scheme, contacts, NonsmoothOptions::default())
    }
}

/// A spring with a damper beside it, or a damper.
#[derive(Clone, Debug)]
pub(super) struct PointElement {
    pub(super) name: String,
    pub(super) from: PointOn,
    pub(super) to: PointOn,
    pub(super) stiffness: Option<f64>,
    pub(super) natural_length: f64,
    pub(super) law: SpringLaw,
    pub(super) damping: f64,
}

impl PointElement {
    pub(super) fn new(from: PointOn, to: PointOn, stiffness: Option<f64>, damping: f64) -> Self {
        let (name, law) = (String::new(), SpringLaw::Linear);
        Self { name, from, to, stiffness, natural_length: 0.0, law, damping }
    }
}

/// A spring that was added.
#[derive(Debug)]
pub struct SpringEntry<'a> {
    spring: &'a mut PointElement,
}

impl<'a> SpringEntry<'a> {
    pub(super) fn new(spring: &'a mut PointElement) -> Self {
        Self { spring }
    }

    /// Its name, under which the work of its damper is listed.
    pub fn named(self, name: &str) -> Self {
        name.clone_into(&mut self.spring.name);
        self
    }

    /// The length at which it is relaxed, m; 0 by default.
    pub fn natural_length(self, length: f64) -> Self {
        self.spring.natural_length = length;
        self
    }

    /// Its energy as a function of its length; the stiffness is then in the unit of the law.
    pub fn law(self, law: SpringLaw) -> Self {
        self.spring.law = law;
        self
    }

    /// A damper beside it, N·s/m.
    pub fn damping(self, damping: f64) -> Self {
        self.spring.damping = damping;
        self
    }
}

#[derive(Clone, Debug)]
pub(super) struct JointForceElement {
    pub(super) name: String,
    pub(super) coordinate: CoordinateId,
    pub(super) kind: JointElementKind,
}

#[derive(Clone, Debug)]
pub(super) enum JointElementKind {
    Spring { stiffness: f64, rest: f64 },
    Force(Arc<dyn JointLaw>),
}

/// A load as it was described.
#[derive(Clone, Debug)]
pub(super) enum LoadPart {
    Described(Box<DescribedLoad>),
    Given(String, Load),
}

/// A law between two points.
#[derive(Clone, Debug)]
pub(super) struct TensionPart {
    pub(super) name: String,
    pub(super) from: PointOn,
    pub(super) to: PointOn,
    pub(super) law: Arc<dyn JointLaw>,
}

/// A law on a body or a point mass.
#[derive(Clone)]
pub(super) struct WrenchPart {
    pub(super) name: String,
    pub(super) at: PointOn,
    pub(super) follows: bool,
    pub(super) law: Arc<dyn WrenchLaw>,
}

/// A force on any coordinates.
#[derive(Clone)]
pub(super) struct OwnForce {
    pub(super) name: String,
    pub(super) force: Arc<dyn Force>,
}

/// A force on a point mass as it was described.
#[derive(Clone, Debug)]
pub(super) struct ParticleLoadPart {
    pub(super) name: String,
    pub(super) particle: ParticleId,
    pub(super) force: Vector3<f64>,
    pub(super) history: TimeHistory,
}

#[derive(Clone, Debug)]
pub(super) struct DescribedLoad {
    pub(super) name: String,
    pub(super) body: BodyId,
    kind: LoadKind,
    force: Vector3<f64>,
    torque: Vector3<f64>,
    pub(super) place: PointPlace,
    history: TimeHistory,
}

impl LoadPart {
    pub(super) fn new(body: BodyId) -> Self {
        Self::Described(Box::new(DescribedLoad {
            name: String::new(),
            body,
            kind: LoadKind::Dead,
            force: Vector3::zeros(),
            torque: Vector3::zeros(),
            place: PointPlace::Components(Vector3::zeros()),
            history: TimeHistory::default(),
        }))
    }
}

impl DescribedLoad {
    /// The load at `point`; `along` takes components of the body to those along its directors.
    pub(super) fn resolve(
        &self,
        name: &str,
        point: Vector3<f64>,
        along: impl Fn(&Vector3<f64>) -> Vector3<f64>,
    ) -> Result<Load, BuildError> {
        finite(|| format!("load on body `{name}`"), "point", point.as_slice())?;
        let rotated = |vector: &Vector3<f64>| match self.kind {
            LoadKind::Dead => *vector,
            LoadKind::Follower => along(vector),
        };
        let offset = 12 * self.body.index();
        let (force, torque) = (rotated(&self.force), rotated(&self.torque));
        Load::new(offset, self.kind, force, torque, self.history.clone())
            .and_then(|load| load.at(point))
            .map_err(|source| BuildError::Load { body: name.to_owned(), source })
    }
}

/// A force element that was added, without a name until the entry says otherwise.
#[derive(Debug)]
pub struct ForceEntry<'a> {
    pub(super) name: &'a mut String,
}

impl ForceEntry<'_> {
    /// Its name, under which its work is listed.
    pub fn named(self, name: &str) {
        name.clone_into(self.name);
    }
}

/// A load that was added: no force and no torque, constant in time, until said otherwise.
#[derive(Debug)]
pub struct LoadEntry<'a> {
    load: &'a mut DescribedLoad,
}

impl<'a> LoadEntry<'a> {
    pub(super) fn new(part: &'a mut LoadPart) -> Self {
        match part {
            LoadPart::Described(load) => Self { load },
            LoadPart::Given(..) => unreachable!("an entry is of a described load"),
        }
    }

    /// Its name, under which its work is listed.
    pub fn named(self, name: &str) -> Self {
        name.clone_into(&mut self.load.name);
        self
    }

    /// The force, N: components in space, or along the axes of the body for a follower.
    pub fn force(self, force: impl Into<Vector3<f64>>) -> Self {
        self.load.force = force.into();
        self
    }

    /// The torque, N·m: components in space, or along the axes of the body for a follower.
    pub fn torque(self, torque: impl Into<Vector3<f64>>) -> Self {
        self.load.torque = torque.into();
        self
    }

    /// The load rotates with the body.
    pub fn follower(self) -> Self {
        self.load.kind = LoadKind::Follower;
        self
    }

    /// The point of the body where the force acts: components along its axes from its centre of
    /// mass, m; the centre by default.
    pub fn point(self, components: impl Into<Vector3<f64>>) -> Self {
        self.load.place = PointPlace::Components(components.into());
        self
    }

    /// The force acts at the point of the body that is at `position` (m, in space) in the initial
    /// configuration.
    pub fn point_at(self, position: impl Into<Vector3<f64>>) -> Self {
        self.load.place = PointPlace::Space(position.into());
        self
    }

    /// The factor in time.
    pub fn history(self, history: TimeHistory) -> Self {
        self.load.history = history;
        self
    }
}
