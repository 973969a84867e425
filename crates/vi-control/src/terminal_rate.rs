//! The cost of a number of a node with its velocity, its multipliers, its acceleration.
//!
//! ```text
//! Φ = ½ (y(q_N, v̂_N) − target)², or y     [M Gᵀ; G 0](v̂, μ) = (p̄, −g_t)
//! ∂Φ/∂q, ∂Φ/∂p̄, ∂Φ/∂θ: of y at fixed v̂, and ∂y/∂v̂ pulled back through these equations
//! ```
//! Multipliers and accelerations are those of the acceleration level
//! ([`vi_multibody::design::acceleration`]), which follow from the same node; with steps of order 2
//! multipliers are those of the step from the node, `hλ`, which are unknowns of it, and
//! accelerations those of the steps on both sides ([`StepTerm`]).

use crate::node::{Node, NodeReads, NodeSlopes};
pub use crate::node::{NodeQuantity, RateOf};
use crate::objective::{ByKnown, CostTerm, Known, NotedNode, NumberCost, StepTerm};
use nalgebra::DMatrix;
use std::sync::{Arc, Mutex, PoisonError};
use vi_constraints::design::Design;
use vi_constraints::linearization::Costate;
use vi_constraints::saddle_point::IndependentRows;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::linear::{Singular, dot};
use vi_core::sparse::{Block, Product};
use vi_core::{Configuration, MechanicalSystem, SeparableSystem, SparseMatrix, State};
use vi_multibody::design::acceleration::NodeAcceleration;
use vi_multibody::design::velocity::{DifferentiatedVelocity, NodeMass};
use vi_multibody::design::{DesignError, MechanismTangent};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::MechanismIntegrator;

/// What the acceleration level of a run follows from.
#[derive(Clone)]
pub struct AccelerationLevel {
    /// The system of the run.
    pub system: Arc<SeparableSystem>,
    /// How its forces change with parameters, where there are any.
    pub design: Option<Arc<dyn Design + Send + Sync>>,
    /// Whether the nodes are equilibria: nothing moves or accelerates.
    pub rests: bool,
}

impl std::fmt::Debug for AccelerationLevel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Level").finish_non_exhaustive()
    }
}

/// Why a number of a node has no derivative.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TerminalRateError {
    /// The momentum of a node is not `M v` alone.
    #[error("velocities have no second derivatives where steps add to the masses")]
    AddedMass,
    /// The system that adds to them is not known.
    #[error("velocities where steps add to the masses need the system of the run")]
    UnknownMass,
    /// A direction that the constraints leave free has no mass.
    #[error("the velocity at a node is not determined: {0}")]
    Undetermined(#[from] Singular),
    /// A tangent is not available.
    #[error(transparent)]
    Design(#[from] DesignError),
}

/// What carries the momentum of nodes.
enum Mass {
    /// `M`.
    Constant(SparseMatrix),
    /// `M` and what the system adds to it in steps of this length, s.
    OfStep(Arc<SeparableSystem>, f64),
}

impl std::fmt::Debug for Mass {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Mass").finish_non_exhaustive()
    }
}

impl Mass {
    fn at_node(&self) -> NodeMass<'_> {
        match self {
            Self::Constant(mass) => NodeMass::Constant(mass),
            Self::OfStep(system, h) => NodeMass::OfStep(&**system, *h),
        }
    }

    /// Whether velocities are not those of the acceleration level.
    fn is_of_step(&self) -> bool {
        matches!(self, Self::OfStep(..))
    }
}

/// What numbers of nodes follow from beside the run itself.
#[derive(Clone, Debug, Default)]
pub struct NodeSources {
    /// The acceleration level, where numbers read multipliers or accelerations.
    pub level: Option<AccelerationLevel>,
    /// The system of the run, where numbers read velocities and steps add to the masses.
    pub masses: Option<AddedMasses>,
}

/// A system whose steps add to the masses.
#[derive(Clone)]
pub struct AddedMasses {
    /// The system of the run.
    pub system: Arc<SeparableSystem>,
    /// Its step, s.
    pub step: f64,
}

impl std::fmt::Debug for AddedMasses {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("AddedMasses").field("step", &self.step).finish_non_exhaustive()
    }
}

/// What the numbers of nodes are read from.
#[derive(Debug)]
pub struct NodeReader {
    mechanism: Mechanism,
    mass: Mass,
    velocity: Option<Mutex<DifferentiatedVelocity>>,
    level: Option<(AccelerationLevel, Mutex<NodeAcceleration>)>,
    n: usize,
    m: usize,
}

impl NodeReader {
    /// In a run, where the numbers of its mechanism change so with parameters.
    ///
    /// # Errors
    /// [`TerminalRateError`].
    pub fn new(
        run: &MechanismIntegrator,
        tangents: &[MechanismTangent],
        NodeSources { level, masses }: NodeSources,
    ) -> Result<Self, TerminalRateError> {
        let adds = run.system().adds_mass() && !run.reads_states();
        let mass = match masses.filter(|_| adds) {
            Some(AddedMasses { system, step }) => Mass::OfStep(system, step),
            None => Mass::Constant(run.system().mass().clone()),
        };
        Self::with_mass(run.constraints(), mass, run.rows(), run.state(), tangents, level)
    }

    /// Of numbers that read no velocities.
    #[must_use]
    pub fn standing(run: &MechanismIntegrator) -> Self {
        let mass = Mass::Constant(run.system().mass().clone());
        let mechanism = run.constraints().clone();
        let (n, m) = (run.state().q.len(), vi_constraints::Constraints::len(&mechanism));
        Self { mechanism, mass, velocity: None, level: None, n, m }
    }

    /// Of a mechanism with its independent rows, at a node, with second derivatives.
    ///
    /// # Errors
    /// [`TerminalRateError`].
    pub fn at(
        mechanism: &Mechanism,
        system: &SeparableSystem,
        rows: &IndependentRows,
        state: &State,
    ) -> Result<Self, TerminalRateError> {
        if system.adds_mass() {
            return Err(TerminalRateError::AddedMass);
        }
        Self::with_mass(mechanism, Mass::Constant(system.mass().clone()), rows, state, &[], None)
    }

    fn with_mass(
        mechanism: &Mechanism,
        mass: Mass,
        rows: &IndependentRows,
        state: &State,
        tangents: &[MechanismTangent],
        level: Option<AccelerationLevel>,
    ) -> Result<Self, TerminalRateError> {
        let mechanism = mechanism.clone();
        let mut velocity = DifferentiatedVelocity::new(&mechanism, rows, tangents)?;
        velocity.find(&mechanism, mass.at_node(), state)?;
        let level = level.map(|level| {
            let mut own = match level.rests {
                true => NodeAcceleration::at_rest(&mechanism, rows, tangents)?,
                false => NodeAcceleration::new(&mechanism, rows, tangents)?,
            };
            own.find(&mechanism, &*level.system, state)?;
            Ok::<_, TerminalRateError>((level, Mutex::new(own)))
        });
        let (n, m) = (state.q.len(), vi_constraints::Constraints::len(&mechanism));
        let (velocity, level) = (Some(Mutex::new(velocity)), level.transpose()?);
        Ok(Self { mechanism, mass, velocity, level, n, m })
    }

    /// With the node as a number reads it. `None` where the node is not determined.
    fn with<T>(
        &self,
        y: &dyn NodeQuantity,
        state: &State,
        known: Known<'_>,
        then: impl FnOnce(Node<'_>) -> T,
    ) -> Option<T> {
        let at = state.configuration();
        let [lambda, a] = [known.lambda, known.a].map(Option::unwrap_or_default);
        if self.needs_no_velocity(y, known) {
            return Some(then(Node { at, v: &[], lambda, a }));
        }
        match self.level_of(y, known) {
            Some((level, own)) => {
                let own = &mut *own.lock().unwrap_or_else(PoisonError::into_inner);
                own.find(&self.mechanism, &*level.system, state).ok()?;
                let lambda = known.lambda.unwrap_or(own.lambda());
                let a = known.a.unwrap_or(own.a());
                if !(self.mass.is_of_step() && y.reads_velocity()) {
                    return Some(then(Node { at, v: own.v(), lambda, a }));
                }
                let own = self.velocity.as_ref()?;
                let own = &mut *own.lock().unwrap_or_else(PoisonError::into_inner);
                let v = own.find(&self.mechanism, self.mass.at_node(), state).ok()?;
                Some(then(Node { at, v, lambda, a }))
            }
            _ => {
                let own = self.velocity.as_ref()?;
                let own = &mut *own.lock().unwrap_or_else(PoisonError::into_inner);
                let v = own.find(&self.mechanism, self.mass.at_node(), state).ok()?;
                Some(then(Node { at, v, lambda, a }))
            }
        }
    }

    /// Adds what the derivatives by `v̂` are by the state and by parameters, at the node that was
    /// read last; `None` where it is not determined.
    fn pull_velocity(
        &self,
        at: Configuration<'_>,
        of_v: &[f64],
        (q, p, z): OfState<'_>,
        parameters: &mut [f64],
    ) -> Option<()> {
        let own = self.velocity.as_ref()?;
        let own = &mut *own.lock().unwrap_or_else(PoisonError::into_inner);
        own.pull(&self.mechanism, at, of_v, [q, p]).ok()?;
        own.pull_internal(z);
        for (k, out) in parameters.iter_mut().enumerate() {
            *out += own.pulled_by_parameter(at, k);
        }
        Some(())
    }

    /// The acceleration level, where a number reads of it what is not known otherwise.
    fn level_of(
        &self,
        y: &dyn NodeQuantity,
        Known { lambda, a }: Known<'_>,
    ) -> Option<&(AccelerationLevel, Mutex<NodeAcceleration>)> {
        let reads = y.reads();
        let is_known = (lambda.is_some() || !reads.forces) && (a.is_some() || !reads.accelerations);
        self.level.as_ref().filter(|_| !is_known)
    }

    /// Whether a number follows from the configuration and from what is known.
    fn needs_no_velocity(&self, y: &dyn NodeQuantity, known: Known<'_>) -> bool {
        !y.reads_velocity() && self.level_of(y, known).is_none()
    }

    /// The velocity `v̂` of a node; `None` where it is not determined.
    pub(crate) fn velocity(&self, state: &State) -> Option<Vec<f64>> {
        let own = self.velocity.as_ref()?;
        let own = &mut *own.lock().unwrap_or_else(PoisonError::into_inner);
        own.find(&self.mechanism, self.mass.at_node(), state).ok().map(<[f64]>::to_vec)
    }

    /// The number at a node. Not a number where the node is not determined.
    #[must_use]
    pub fn value(&self, y: &dyn NodeQuantity, state: &State, known: Known<'_>) -> f64 {
        self.with(y, state, known, |node| y.value(node)).unwrap_or(f64::NAN)
    }

    /// The derivatives of a number of a node that follows from its state, by `q` and by `p̄`, and
    /// its second derivatives along `changes` of both [2.54]; `None` where the node is not
    /// determined, or the number has none.
    pub(crate) fn second(
        &self,
        y: &dyn NodeQuantity,
        state: &State,
        changes: &[[Vec<f64>; 2]],
    ) -> Option<([Vec<f64>; 2], DMatrix<f64>)> {
        let Self { mechanism, mass, n, .. } = self;
        let at = state.configuration();
        let own = self.velocity.as_ref()?;
        let own = &mut *own.lock().unwrap_or_else(PoisonError::into_inner);
        if mass.is_of_step() {
            return None;
        }
        let v = own.find(mechanism, mass.at_node(), state).ok()?.to_vec();
        let (node, curved) = (Node::moving(at.moving(&v)), y.curved()?);
        let ([mut q, of_v], mut p) = (y.slopes_at(node), vec![0.0; *n]);
        own.pull(mechanism, at, &of_v, [&mut q, &mut p]).ok()?;
        let mut all = Vec::with_capacity(changes.len());
        for [dq, dp] in changes {
            let change = own.change_with_second(mechanism, at, [dq, dp]).ok()?;
            let mut bend = [(); 2].map(|()| vec![0.0; *n]);
            let [of_q, of_v] = &mut bend;
            curved.add_bend(node, [dq, change.v()], 1.0, [of_q, of_v]);
            all.push((change, bend));
        }
        let second = |i: usize, j: usize| {
            let ((one, [of_q, of_v]), (other, _)) = (&all[i], &all[j]);
            dot(of_q, &changes[j][0]) + dot(of_v, other.v()) + one.second(other)
        };
        Some(([q, p], DMatrix::from_fn(all.len(), all.len(), second)))
    }

    /// Adds the derivatives of a number by the state and by what is known, and those by parameters
    /// with these held, all times what `weigh` makes of the number. Returns the number.
    pub fn add_slopes(
        &self,
        (y, weigh): (&dyn NodeQuantity, &dyn Fn(f64) -> f64),
        (state, known): (&State, Known<'_>),
        (Costate { q, p, z }, by_known): (&mut Costate, ByKnown<'_>),
        parameters: &mut [f64],
    ) -> f64 {
        let at = state.configuration();
        let Self { mechanism, n, m, .. } = self;
        let [mut of_v, mut of_a] = [(); 2].map(|()| vec![0.0; *n]);
        let mut of_level = vec![0.0; *m];
        let ByKnown { lambda: by_lambda, a: by_a, force } = by_known;
        let own = self.with(y, state, known, |node| {
            let lambda = if known.lambda.is_some() { by_lambda } else { &mut of_level[..] };
            let a = if known.a.is_some() { by_a } else { &mut of_a[..] };
            let out = NodeSlopes { q: &mut *q, v: &mut of_v, lambda, a, z: &mut *z };
            let value = y.value(node);
            let scale = weigh(value);
            y.add_slopes(node, scale, out);
            for (k, out) in parameters.iter_mut().enumerate() {
                *out += scale * y.by_parameter(k, node);
            }
            value
        });
        let Some(value) = own else {
            q.fill(f64::NAN);
            return f64::NAN;
        };
        if self.needs_no_velocity(y, known) {
            return value;
        }
        let pulled = match self.level_of(y, known) {
            Some(level) => {
                let apart = self.mass.is_of_step().then(|| std::mem::take(&mut of_v));
                let still = if apart.is_some() { vec![0.0; *n] } else { of_v };
                let slopes = [&still[..], &of_a, &of_level];
                let out: OfState<'_> = (&mut *q, &mut *p, &mut *z);
                let out = (out, force);
                let level = pull_level((mechanism, level), at, slopes, out, parameters);
                match apart {
                    Some(of_v) => {
                        level.and_then(|()| self.pull_velocity(at, &of_v, (q, p, z), parameters))
                    }
                    None => level,
                }
            }
            _ => self.pull_velocity(at, &of_v, (q, p, z), parameters),
        };
        if pulled.is_none() {
            q.fill(f64::NAN);
            return f64::NAN;
        }
        value
    }
}

/// Derivatives by `q`, `p̄` and internal variables.
type OfState<'a> = (&'a mut [f64], &'a mut [f64], &'a mut [f64]);

/// The same of the derivatives by `v̂`, `a` and `λ` of the acceleration level; also by forces on
/// the coordinates, shape `n` or empty.
fn pull_level(
    (mechanism, (level, own)): (&Mechanism, &(AccelerationLevel, Mutex<NodeAcceleration>)),
    at: Configuration<'_>,
    slopes: [&[f64]; 3],
    ((q, p, z), by_force): (OfState<'_>, &mut [f64]),
    parameters: &mut [f64],
) -> Option<()> {
    let own = &mut *own.lock().unwrap_or_else(PoisonError::into_inner);
    own.pull(mechanism, &*level.system, at, slopes, [q, p]).ok()?;
    by_force.iter_mut().zip(own.by_force()).for_each(|(out, by)| *out += by);
    let into = &mut Product { v: own.by_force(), out: z };
    let mut along = Block { into, row: 0, column: 0, scale: 1.0, transposed: true };
    level.system.state_slopes(at.moving(own.v()), &mut along); // (∂f/∂z)ᵀ ∂y/∂f
    if let Some(design) = &level.design {
        for (k, out) in parameters.iter_mut().enumerate() {
            *out += own.pulled_by_parameter(at, &**design, k);
        }
    }
    Some(())
}

/// `½ (y − target)²` of a number of a node, or the number itself.
#[derive(Debug)]
pub struct TerminalRate<Q> {
    quantity: Q,
    judged: NumberCost,
    reader: NodeReader,
}

impl<Q: NodeQuantity> TerminalRate<Q> {
    /// Of what follows from configuration and velocity, in a run where the numbers of its mechanism
    /// change so with parameters.
    ///
    /// # Errors
    /// [`TerminalRateError`].
    pub fn new(
        quantity: Q,
        cost: NumberCost,
        run: &MechanismIntegrator,
        tangents: &[MechanismTangent],
    ) -> Result<Self, TerminalRateError> {
        Self::with(quantity, cost, run, tangents, NodeSources::default())
    }

    /// The same of what follows from more than that.
    ///
    /// # Errors
    /// [`TerminalRateError`], also of a velocity where steps add to the masses and the system is
    /// not there.
    pub fn with(
        quantity: Q,
        judged: NumberCost,
        run: &MechanismIntegrator,
        tangents: &[MechanismTangent],
        sources: NodeSources,
    ) -> Result<Self, TerminalRateError> {
        let reads_velocity = quantity.reads_velocity();
        if reads_velocity && sources.masses.is_none() && run.system().adds_mass() {
            return Err(TerminalRateError::UnknownMass);
        }
        let reader = match sources.level {
            None if !reads_velocity => NodeReader::standing(run),
            _ => NodeReader::new(run, tangents, sources)?,
        };
        Ok(Self { quantity, judged, reader })
    }
}

impl<Q: NodeQuantity> CostTerm for TerminalRate<Q> {
    fn of_end(&self, end: &State) -> f64 {
        self.of_node(end, Known::STATE)
    }
    fn add_of_end(&self, end: &State, scale: f64, out: &mut Costate) {
        let none = ByKnown::default();
        self.add_of_node((end, Known::STATE), scale, (out, none), &mut []);
    }
    fn add_forces_of_end(&self, end: &State, scale: f64, out: &mut [f64]) {
        if self.reader.level.is_some() {
            let mut by = Costate::zero(self.reader.n, end.internal.len());
            let out = ByKnown { force: out, ..ByKnown::default() };
            self.add_of_node((end, Known::STATE), scale, (&mut by, out), &mut []);
        }
    }
    fn add_parameters_of_end(&self, end: &State, scale: f64, out: &mut [f64]) {
        if out.is_empty() {
            return;
        }
        let mut by = Costate::zero(self.reader.n, end.internal.len());
        self.add_of_node((end, Known::STATE), scale, (&mut by, ByKnown::default()), out);
    }
    fn follow(&self, node: Configuration<'_>, seen: NotedNode) {
        self.quantity.follow(node, seen);
    }
}

impl<Q: NodeQuantity> StepTerm for TerminalRate<Q> {
    fn of_node(&self, node: &State, known: Known<'_>) -> f64 {
        self.judged.cost(self.reader.value(&self.quantity, node, known))
    }
    fn add_of_node(
        &self,
        (state, known): (&State, Known<'_>),
        scale: f64,
        (of_state, of_known): (&mut Costate, ByKnown<'_>),
        parameters: &mut [f64],
    ) -> f64 {
        let weigh = |y: f64| scale * self.judged.slope(y);
        let y = self.reader.add_slopes(
            (&self.quantity, &weigh),
            (state, known),
            (of_state, of_known),
            parameters,
        );
        self.judged.cost(y)
    }
    fn reads(&self) -> NodeReads {
        self.quantity.reads()
    }
}
