//! Ensembles: the same mechanism with many initial values or parameters, four or eight members at
//! once.
//!
//! A lane of a wide register holds a member, and a sweep over the links moves all of them. The
//! sweeps are those of a tree alone; lanes take no part in each other, so a member moves as it does
//! alone, to the last bit. Newton's method stops lane by lane. A member whose step it
//! does not solve from the extrapolated increments (the first step, an event) takes this step by
//! its own integrator, which tries more.
//!
//! | members | how they move |
//! |---|---|
//! | trees of bodies, scheme `nodal` of order 2 or composed of it | in lanes |
//! | with springs, dampers, motors of joints, loads, springs and dampers between a body and the ground, constant or varying | in lanes; what acts is evaluated member by member |
//! | with springs between two bodies, closed loops, point masses, beams; other schemes | each by its own integrator, one after the other or on several threads |
//!
//! Lanes halve the time of the sweeps; where springs and loads on bodies take most of the time,
//! they gain nothing. Threads ([`Ensemble::advance_on`]) serve all members.
//!
//! A node of a member is read by [`Ensemble::record`] as that of an integrator
//! ([`Integrator::advance`](vi_constraints::Integrator::advance)), with the same bits.
//!
//! ```
//! use vi_multibody::ensemble::Ensemble;
//! use vi_multibody::builder::{Inertia, MechanismBuilder};
//! use vi_multibody::vi_constraints::{Options, SchemeKind};
//! use vi_multibody::{FrameId, PairKind};
//!
//! let pendulum = |rate: f64| {
//!     let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
//!     let bar = builder.body("bar", Inertia::principal(1.0, [0.01, 0.1, 0.1])).at([0.5, 0.0, 0.0]).id();
//!     let hinge = builder.joint("hinge", PairKind::Revolute, FrameId::Ground, bar);
//!     hinge.at([0.0; 3]).axis([0.0, 1.0, 0.0]).rate(rate);
//!     builder.build()
//! };
//! let members: Result<Vec<_>, _> = (0..20).map(|k| pendulum(0.1 * f64::from(k))).collect();
//! let mut ensemble = Ensemble::new(members?, Options::new(SchemeKind::Nodal, 0.01))?;
//! ensemble.advance(100);
//! assert!(ensemble.failures().all(|failure| failure.is_none()));
//! assert_eq!(ensemble.member(7).state().step, 100);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod failure;
mod group;
mod history;
mod kernel;
mod link;
mod member;
mod recorded;

pub use failure::MemberFailure;
pub use recorded::Recorded;

use crate::builder::BuiltMechanism;
use crate::mechanism::Mechanism;
use crate::solver::run::{MechanismIntegrator, Solver, integrator, with_contacts};
use crate::solver::tree_step::body_forces::BodyForces;
use crate::sweep::link::constants;
use group::{Group, MemberReader};
use member::MemberModel;
use recorded::Outputs;
use std::num::NonZeroUsize;
use vi_constraints::discretization::Discretization;
use vi_constraints::integrator::{ObserveError, SetupError};
use vi_constraints::node::Node;
use vi_constraints::nonsmooth::NonsmoothOptions;
use vi_constraints::scheme::StepError;
use vi_constraints::{InitialValues, Options, SchemeKind};
use vi_core::Quadrature;
use vi_core::linear::Singular;

/// Members of one topology that move together.
///
/// A member that fails stays at the node where it failed, and the others go on.
#[derive(Debug)]
pub struct Ensemble {
    members: Vec<MechanismIntegrator>,
    failures: Vec<Option<StepError>>,
    groups: Vec<Box<dyn Group>>, // the first members; the others move alone
    grouped: usize,
    scheme: SchemeKind,
}

/// Members that move together, or one that moves alone, and where they are recorded.
struct Share<'a, O, F> {
    group: Option<&'a mut Box<dyn Group>>,
    members: &'a mut [MechanismIntegrator],
    failures: &'a mut [Option<StepError>],
    outputs: Outputs<'a, O, F>,
}

impl<O, F: Fn(&mut O, Recorded<'_>)> Share<'_, O, F> {
    fn advance(self, steps: u64) {
        let Self { group, members, failures, mut outputs } = self;
        if let Some(group) = group {
            return group.advance(members, failures, steps, &mut outputs);
        }
        for (k, (member, failure)) in members.iter_mut().zip(failures).enumerate() {
            for _ in 0..steps {
                if failure.is_some() {
                    break;
                }
                *failure = member.step().err();
                if failure.is_none() && outputs.wants(k) {
                    outputs.read(k, member);
                }
            }
        }
    }
}

impl Ensemble {
    /// Members with the initial configurations and velocities of their models.
    ///
    /// # Errors
    /// [`SetupError`] of the first member that cannot be set up.
    pub fn new(
        members: impl IntoIterator<Item = BuiltMechanism>,
        options: Options,
    ) -> Result<Self, SetupError> {
        let start = |built: BuiltMechanism| {
            let (q, v) =
                (built.mechanism.initial_configuration(), built.mechanism.initial_velocity());
            (built, 0.0, q, v)
        };
        Self::of(members.into_iter().map(start), options)
    }

    /// Members of one model that start from different values.
    ///
    /// # Errors
    /// [`SetupError`] of the first member that cannot be set up.
    pub fn starting_at(
        model: &BuiltMechanism,
        starts: &[InitialValues<'_>],
        options: Options,
    ) -> Result<Self, SetupError> {
        let start = |at: &InitialValues<'_>| (model.clone(), at.t, at.q.to_vec(), at.v.to_vec());
        Self::of(starts.iter().map(start), options)
    }

    fn of(
        members: impl Iterator<Item = (BuiltMechanism, f64, Vec<f64>, Vec<f64>)>,
        options: Options,
    ) -> Result<Self, SetupError> {
        let mut runs = Vec::new();
        for (built, t, q, v) in members {
            let system = built.system(Quadrature::Midpoint);
            let contacts = built.forces.contacts;
            let at = InitialValues::new(t, &q, &v);
            let run = integrator(built.mechanism, system, options, Solver::Auto, at)?;
            runs.push(with_contacts(run, options.scheme, contacts, NonsmoothOptions::default())?);
        }
        Ok(Self::of_integrators(runs, &options))
    }

    /// Members that are integrators with these options, from where they stand.
    #[must_use]
    pub fn of_integrators(members: Vec<MechanismIntegrator>, options: &Options) -> Self {
        let models: Option<Vec<_>> = members.iter().map(|run| model(run, options)).collect();
        let failures = members.iter().map(|_| None).collect();
        let (groups, scheme) = (Vec::new(), options.scheme);
        let mut ensemble = Self { members, failures, groups, grouped: 0, scheme };
        if let Some(models) = models {
            ensemble.group(&models, options);
        }
        ensemble
    }

    /// Whether members like this integrator with these options move in lanes.
    #[must_use]
    pub fn has_lanes_for(run: &MechanismIntegrator, options: &Options) -> bool {
        model(run, options).is_some()
    }

    /// Puts members of one topology into lanes.
    fn group(&mut self, models: &[MemberModel], options: &Options) {
        let mut first = 0;
        while first < self.members.len() {
            let members = &self.members[first..];
            let Some(group) = group::wide(&models[first..], members, options) else { return };
            first += group.count();
            self.grouped = first;
            self.groups.push(group);
        }
    }

    /// How many members there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.members.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.members.is_empty()
    }

    /// How many members move in lanes; the others move one after the other.
    #[must_use]
    pub fn in_lanes(&self) -> usize {
        self.grouped
    }

    /// Steps that members in lanes have taken by their own integrators: the first one, and those of
    /// events.
    #[must_use]
    pub fn steps_alone(&self) -> u64 {
        self.groups.iter().map(|group| group.alone()).sum()
    }

    /// Takes `steps` steps with every member that has not failed.
    pub fn advance(&mut self, steps: u64) {
        self.advance_on(NonZeroUsize::MIN, steps);
    }

    /// The same on several threads, which share the groups of members, and the members that move
    /// alone, among them: no bit depends on their number.
    pub fn advance_on(&mut self, threads: NonZeroUsize, steps: u64) {
        self.record_on(threads, steps, &mut [], |(): &mut (), _| {});
    }

    /// Takes `steps` steps and reads the members that have an output after each of them:
    /// `read(output, member)`. `outputs`: those of the first members; `None`: a member that is not
    /// read. Steps allocate nothing; a member that fails is not read any more.
    ///
    /// ```
    /// # use vi_multibody::ensemble::Ensemble;
    /// # use vi_multibody::builder::{Inertia, MechanismBuilder};
    /// # use vi_multibody::vi_constraints::{Options, SchemeKind};
    /// # use vi_multibody::{FrameId, PairKind};
    /// # let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    /// # let bar = builder.body("bar", Inertia::principal(1.0, [0.01, 0.1, 0.1])).at([0.5, 0.0, 0.0]).id();
    /// # builder.joint("hinge", PairKind::Revolute, FrameId::Ground, bar).at([0.0; 3]).axis([0.0, 1.0, 0.0]);
    /// # let pendulum = builder.build()?;
    /// let members = vec![pendulum; 8];
    /// let mut ensemble = Ensemble::new(members, Options::new(SchemeKind::Nodal, 0.01))?;
    /// let mut heights = [const { None }; 8];
    /// heights[3] = Some(Vec::with_capacity(100)); // one member alone
    /// ensemble.record(100, &mut heights, |heights, member| {
    ///     heights.push(member.transition().after.q[2]);
    /// });
    /// assert_eq!(heights[3].as_ref().map(Vec::len), Some(100));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Panics
    /// When there are more outputs than members.
    pub fn record<O: Send>(
        &mut self,
        steps: u64,
        outputs: &mut [Option<O>],
        read: impl Fn(&mut O, Recorded<'_>) + Sync,
    ) {
        self.record_on(NonZeroUsize::MIN, steps, outputs, read);
    }

    /// The same on several threads, each with members and outputs of its own: what is recorded does
    /// not depend on their number.
    ///
    /// # Panics
    /// When there are more outputs than members.
    pub fn record_on<O: Send>(
        &mut self,
        threads: NonZeroUsize,
        steps: u64,
        outputs: &mut [Option<O>],
        read: impl Fn(&mut O, Recorded<'_>) + Sync,
    ) {
        let Self { members, failures, groups, .. } = self;
        let given = outputs.len();
        assert!(given <= members.len(), "{given} outputs for {} members", members.len());
        let mut shares: Vec<Vec<_>> = (0..threads.get()).map(|_| Vec::new()).collect();
        let (mut members, mut failures) = (&mut members[..], &mut failures[..]);
        let (mut outputs, mut first) = (outputs, 0);
        let mut groups = groups.iter_mut();
        for turn in (0..threads.get()).cycle() {
            let group = groups.next();
            let count = group.as_ref().map_or(1, |group| group.count()).min(members.len());
            let (own, others) = members.split_at_mut(count);
            let (failed, other_failures) = failures.split_at_mut(count);
            let (written, other_outputs) = outputs.split_at_mut(count.min(outputs.len()));
            (members, failures, outputs) = (others, other_failures, other_outputs);
            if own.is_empty() {
                break;
            }
            let outputs = Outputs { first, outputs: written, read: &read };
            shares[turn].push(Share { group, members: own, failures: failed, outputs });
            first += count;
        }
        let advance = |shares: Vec<Share<'_, O, _>>| {
            shares.into_iter().for_each(|share| share.advance(steps));
        };
        let first = shares.swap_remove(0);
        std::thread::scope(|scope| {
            for own in shares.into_iter().filter(|own| !own.is_empty()) {
                scope.spawn(move || advance(own));
            }
            advance(first);
        });
    }

    /// A member where it stands: its state, its system, its constraints.
    ///
    /// # Panics
    /// When there is no such member.
    #[must_use]
    pub fn member(&self, k: usize) -> &MechanismIntegrator {
        &self.members[k]
    }

    /// What can be said of the node of a member without a step from there, see
    /// [`vi_constraints::Integrator::observe_state`].
    ///
    /// # Errors
    /// [`Singular`] when its constraints have lost rank.
    ///
    /// # Panics
    /// When there is no such member.
    pub fn observe_state(&mut self, k: usize) -> Result<&Node, Singular> {
        self.members[k].observe_state()
    }

    /// `v ← v̂` of the present node of a member, shape `n`, see
    /// [`vi_constraints::Integrator::velocity`].
    ///
    /// # Errors
    /// [`Singular`] when its constraints have lost rank.
    ///
    /// # Panics
    /// When there is no such member.
    pub fn velocity(&mut self, k: usize, v: &mut [f64]) -> Result<(), Singular> {
        self.members[k].velocity(v)
    }

    /// Everything at the node of a member, by a step from there on a copy of its state, see
    /// [`vi_constraints::Integrator::observe`].
    ///
    /// # Errors
    /// [`ObserveError`] when that step fails or the constraints have lost rank.
    ///
    /// # Panics
    /// When there is no such member.
    pub fn observe(&mut self, k: usize) -> Result<&Node, ObserveError> {
        self.members[k].observe()
    }

    /// The members, to go on one by one.
    #[must_use]
    pub fn into_members(self) -> Vec<MechanismIntegrator> {
        self.members
    }

    /// The members that have failed, with the node where they stand: that before the step.
    pub fn failed(&self) -> impl Iterator<Item = MemberFailure<'_>> {
        let members = self.members.iter().zip(&self.failures).enumerate();
        members.filter_map(|(k, (run, failure))| {
            Some(MemberFailure::new(k, run, self.scheme, failure.as_ref()?))
        })
    }

    /// Why members have failed, in their order.
    pub fn failures(&self) -> impl Iterator<Item = Option<&StepError>> {
        self.failures.iter().map(Option::as_ref)
    }
}

/// What lanes need of a member; `None` where they do not apply.
fn model(run: &MechanismIntegrator, options: &Options) -> Option<MemberModel> {
    let (mechanism, system) = (run.constraints(), run.system());
    let applies = options.scheme == SchemeKind::Nodal
        && options.method.stages().is_none()
        && !options.newton.line_search
        && run.nonsmooth().is_none()
        && !mechanism.has_loops()
        && mechanism.description().particles.is_empty()
        && mechanism.description().scalars.is_empty()
        && BodyForces::apply(mechanism, system, &[]);
    if !applies {
        return None;
    }
    let (links, _) = constants(mechanism, system)?;
    let composition = options.method.composition();
    let sub_steps = Discretization::<Mechanism>::sub_steps(system, composition);
    Some(MemberModel { links, weight: system.constant_force(), sub_steps })
}
