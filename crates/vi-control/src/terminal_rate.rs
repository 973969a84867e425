//! The cost of a number of a node with its velocity, its multipliers, its acceleration.
//!
//! ```text
//! Φ = ½ (y(q_N, v̂_N) − target)²         [M Gᵀ; G 0](v̂, μ) = (p̄, −g_t)
//! ∂Φ/∂q, ∂Φ/∂p̄, ∂Φ/∂θ: of y at fixed v̂, and ∂y/∂v̂ pulled back through these equations
//! ```
//! Multipliers and accelerations are those of the acceleration level
//! ([`vi_multibody::design::acceleration`]), which follow from the same node; with steps of order 2
//! multipliers are those of the step from the node, `hλ`, which are unknowns of it, and
//! accelerations those of the steps on both sides ([`StepTerm`]).

use crate::node::{Node, Slopes};
pub use crate::node::{NodeQuantity, RateOf};
use crate::objective::{Known, Seen, StepTerm, Term};
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
use vi_multibody::design::velocity::NodeVelocity;
use vi_multibody::design::{DesignError, MechanismTangent};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::MechanismIntegrator;

/// What the acceleration level of a run follows from.
#[derive(Clone)]
pub struct Level {
    /// The system of the run.
    pub system: Arc<SeparableSystem>,
    /// How its forces change with parameters, where there are any.
    pub design: Option<Arc<dyn Design + Send + Sync>>,
}

impl std::fmt::Debug for Level {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Level").finish_non_exhaustive()
    }
}

/// Why a number of a node has no derivative.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RateError {
    /// The momentum of a node is not `M v` alone.
    #[error("a rate has no derivative where steps add to the masses")]
    AddedMass,
    /// A direction that the constraints leave free has no mass.
    #[error("the velocity at a node is not determined: {0}")]
    Undetermined(#[from] Singular),
    /// The acceleration level is not known by the node alone.
    #[error(
        "accelerations, and forces at the start and at sub-steps, have no derivatives with {0}"
    )]
    Level(&'static str),
    /// A tangent is not available.
    #[error(transparent)]
    Design(#[from] DesignError),
}

/// What the numbers of nodes are read from.
#[derive(Debug)]
pub struct NodeReader {
    mechanism: Mechanism,
    mass: SparseMatrix,
    velocity: Option<Mutex<NodeVelocity>>,
    level: Option<(Level, Mutex<NodeAcceleration>)>,
    n: usize,
    m: usize,
}

impl NodeReader {
    /// In a run, where the numbers of its mechanism change so with parameters; with the
    /// acceleration level where it is read.
    ///
    /// # Errors
    /// [`RateError`].
    pub fn new(
        run: &MechanismIntegrator,
        tangents: &[MechanismTangent],
        level: Option<Level>,
    ) -> Result<Self, RateError> {
        let (rows, state) = (run.rows(), run.state());
        Self::at(run.constraints(), run.system(), (rows, state), tangents, level)
    }

    /// Of numbers that read no velocities.
    #[must_use]
    pub fn standing(run: &MechanismIntegrator) -> Self {
        let (mechanism, mass) = (run.constraints().clone(), run.system().mass().clone());
        let (n, m) = (run.state().q.len(), vi_constraints::Constraints::len(&mechanism));
        Self { mechanism, mass, velocity: None, level: None, n, m }
    }

    /// The same of a mechanism with its independent rows, at a node.
    ///
    /// # Errors
    /// [`RateError`].
    pub fn at(
        mechanism: &Mechanism,
        system: &SeparableSystem,
        (rows, state): (&IndependentRows, &State),
        tangents: &[MechanismTangent],
        level: Option<Level>,
    ) -> Result<Self, RateError> {
        if system.adds_mass() {
            return Err(RateError::AddedMass);
        }
        let (mechanism, mass) = (mechanism.clone(), system.mass().clone());
        let mut velocity = NodeVelocity::new(&mechanism, rows, tangents)?;
        velocity.find(&mechanism, &mass, state)?;
        let level = level.map(|level| {
            if level.system.interpolation().is_some() {
                return Err(RateError::Level("beams"));
            }
            if level.system.has_memory() {
                return Err(RateError::Level("forces with memory"));
            }
            let mut own = NodeAcceleration::new(&mechanism, rows, tangents)?;
            own.find(&mechanism, &*level.system, state)?;
            Ok((level, Mutex::new(own)))
        });
        let (n, m) = (state.q.len(), vi_constraints::Constraints::len(&mechanism));
        let (velocity, level) = (Some(Mutex::new(velocity)), level.transpose()?);
        Ok(Self { mechanism, mass, velocity, level, n, m })
    }

    /// With the node as a number reads it. `None` where the node is not determined.
    fn with<T>(
        &self,
        y: &dyn NodeQuantity,
        (state, known): (&State, Known<'_>),
        then: impl FnOnce(Node<'_>) -> T,
    ) -> Option<T> {
        let at = state.configuration();
        let (lambda, a) = match known {
            Known::State => (&[][..], &[][..]),
            Known::Multipliers(lambda) => (lambda, &[][..]),
            Known::Acceleration(a) => (&[][..], a),
        };
        if self.needs_no_velocity(y, known) {
            return Some(then(Node { at, v: &[], lambda, a }));
        }
        match (&self.level, known) {
            (Some((level, own)), Known::State) => {
                let own = &mut *own.lock().unwrap_or_else(PoisonError::into_inner);
                own.find(&self.mechanism, &*level.system, state).ok()?;
                Some(then(Node { at, v: own.v(), lambda: own.lambda(), a: own.a() }))
            }
            _ => {
                let own = self.velocity.as_ref()?;
                let own = &mut *own.lock().unwrap_or_else(PoisonError::into_inner);
                let v = own.find(&self.mechanism, &self.mass, state).ok()?;
                Some(then(Node { at, v, lambda, a }))
            }
        }
    }

    /// Whether a number follows from the configuration and from what is known.
    fn needs_no_velocity(&self, y: &dyn NodeQuantity, known: Known<'_>) -> bool {
        !y.reads_velocity() && (self.level.is_none() || !matches!(known, Known::State))
    }

    /// The number at a node. Not a number where the node is not determined.
    #[must_use]
    pub fn value(&self, y: &dyn NodeQuantity, state: &State, known: Known<'_>) -> f64 {
        self.with(y, (state, known), |node| y.value(node)).unwrap_or(f64::NAN)
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
        let v = own.find(mechanism, mass, state).ok()?.to_vec();
        let (node, curved) = (Node::moving(at, &v), y.curved()?);
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
    /// with these held, all times what `weigh` makes of the number. Where the state alone is known,
    /// by forces on the coordinates in the place of that, shape `n` or empty. Returns the number.
    pub fn add_slopes(
        &self,
        (y, weigh): (&dyn NodeQuantity, &dyn Fn(f64) -> f64),
        (state, known): (&State, Known<'_>),
        (Costate { q, p, z }, of_known): (&mut Costate, &mut [f64]),
        parameters: &mut [f64],
    ) -> f64 {
        let at = state.configuration();
        let Self { mechanism, n, m, .. } = self;
        let [mut of_v, mut of_a] = [(); 2].map(|()| vec![0.0; *n]);
        let mut of_level = vec![0.0; *m];
        let own = self.with(y, (state, known), |node| {
            let (lambda, a) = match known {
                Known::State => (&mut of_level[..], &mut of_a[..]),
                Known::Multipliers(_) => (&mut *of_known, &mut of_a[..]),
                Known::Acceleration(_) => (&mut of_level[..], &mut *of_known),
            };
            let out = Slopes { q: &mut *q, v: &mut of_v, lambda, a, z: &mut *z };
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
        match (&self.level, known) {
            (Some((level, own)), Known::State) => {
                let own = &mut *own.lock().unwrap_or_else(PoisonError::into_inner);
                let slopes = [&of_v[..], &of_a, &of_level];
                if own.pull(mechanism, &*level.system, at, slopes, [&mut *q, p]).is_err() {
                    q.fill(f64::NAN);
                    return f64::NAN;
                }
                of_known.iter_mut().zip(own.by_force()).for_each(|(out, by)| *out += by);
                let into = &mut Product { v: own.by_force(), out: z };
                let mut along = Block { into, row: 0, column: 0, scale: 1.0, transposed: true };
                level.system.state_slopes(at, own.v(), &mut along); // (∂f/∂z)ᵀ ∂y/∂f
                let Some(design) = &level.design else { return value };
                for (k, out) in parameters.iter_mut().enumerate() {
                    *out += own.pulled_by_parameter(at, &**design, k);
                }
            }
            _ => {
                let Some(own) = &self.velocity else { return value };
                let own = &mut *own.lock().unwrap_or_else(PoisonError::into_inner);
                if own.pull(mechanism, at, &of_v, [&mut *q, p]).is_err() {
                    q.fill(f64::NAN);
                    return f64::NAN;
                }
                for (k, out) in parameters.iter_mut().enumerate() {
                    *out += own.pulled_by_parameter(at, k);
                }
            }
        }
        value
    }
}

/// `½ (y − target)²` of a number of a node.
#[derive(Debug)]
pub struct TerminalRate<Q> {
    quantity: Q,
    target: f64,
    reader: NodeReader,
}

impl<Q: NodeQuantity> TerminalRate<Q> {
    /// Of what follows from configuration and velocity, in a run where the numbers of its mechanism
    /// change so with parameters.
    ///
    /// # Errors
    /// [`RateError`].
    pub fn new(
        number: (Q, f64),
        run: &MechanismIntegrator,
        tangents: &[MechanismTangent],
    ) -> Result<Self, RateError> {
        Self::with_level(number, run, tangents, None)
    }

    /// The same of what reads multipliers or accelerations, those of a level.
    ///
    /// # Errors
    /// [`RateError`].
    pub fn with_level(
        (quantity, target): (Q, f64),
        run: &MechanismIntegrator,
        tangents: &[MechanismTangent],
        level: Option<Level>,
    ) -> Result<Self, RateError> {
        let reader = match level {
            None if !quantity.reads_velocity() => NodeReader::standing(run),
            level => NodeReader::new(run, tangents, level)?,
        };
        Ok(Self { quantity, target, reader })
    }
}

impl<Q: NodeQuantity> Term for TerminalRate<Q> {
    fn of_end(&self, end: &State) -> f64 {
        self.of_node(end, Known::State)
    }
    fn add_of_end(&self, end: &State, scale: f64, out: &mut Costate) {
        self.add_of_node((end, Known::State), scale, (out, &mut []), &mut []);
    }
    fn add_parameters_of_end(&self, end: &State, scale: f64, out: &mut [f64]) {
        if out.is_empty() {
            return;
        }
        let mut by = Costate::zero(self.reader.n, end.internal.len());
        self.add_of_node((end, Known::State), scale, (&mut by, &mut []), out);
    }
    fn follow(&self, node: Configuration<'_>, seen: Seen) {
        self.quantity.follow(node, seen);
    }
}

impl<Q: NodeQuantity> StepTerm for TerminalRate<Q> {
    fn of_node(&self, node: &State, known: Known<'_>) -> f64 {
        let e = self.reader.value(&self.quantity, node, known) - self.target;
        0.5 * e * e
    }
    fn add_of_node(
        &self,
        node: (&State, Known<'_>),
        scale: f64,
        slopes: (&mut Costate, &mut [f64]),
        parameters: &mut [f64],
    ) -> f64 {
        let weigh = |y: f64| scale * (y - self.target);
        let y = self.reader.add_slopes((&self.quantity, &weigh), node, slopes, parameters);
        0.5 * (y - self.target) * (y - self.target)
    }
}
