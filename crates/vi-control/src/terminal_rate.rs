//! The cost of a rate at the end of a run.
//!
//! ```text
//! Φ = ½ (y(q_N, v̂_N) − target)²         [M Gᵀ; G 0](v̂, μ) = (p̄, −g_t)
//! ∂Φ/∂q, ∂Φ/∂p̄, ∂Φ/∂θ: of y at fixed v̂, and ∂y/∂v̂ pulled back through these equations
//! ```
//! A rate along the path has no momentum of its own between the nodes of a step: it is no term of a
//! sum over steps.

use crate::objective::{Quantity, Seen, Term};
use std::sync::{Mutex, PoisonError};
use vi_core::linear::Singular;
use vi_core::{Configuration, MechanicalSystem, SparseMatrix, State};
use vi_multibody::design::velocity::NodeVelocity;
use vi_multibody::design::{DesignError, MechanismTangent};
use vi_multibody::law::Input;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::MechanismIntegrator;

/// A number that a node with a velocity has.
pub trait NodeQuantity: Send + Sync {
    /// The number.
    fn value(&self, at: Configuration<'_>, v: &[f64]) -> f64;
    /// `q ← q + scale ∂y/∂q`, `of_v ← of_v + scale ∂y/∂v`, both of shape `n`.
    fn add_slopes(&self, at: Configuration<'_>, v: &[f64], scale: f64, slopes: [&mut [f64]; 2]);
    /// `∂y/∂θ` at fixed `q` and `v`.
    fn by_parameter(&self, _parameter: usize, _at: Configuration<'_>, _v: &[f64]) -> f64 {
        0.0
    }
    /// Takes note of a node, one after the other, where the number is continued along the motion.
    fn follow(&self, _node: Configuration<'_>, _seen: Seen) {}
}

impl<Y: NodeQuantity + ?Sized> NodeQuantity for Box<Y> {
    fn value(&self, at: Configuration<'_>, v: &[f64]) -> f64 {
        (**self).value(at, v)
    }
    fn add_slopes(&self, at: Configuration<'_>, v: &[f64], scale: f64, slopes: [&mut [f64]; 2]) {
        (**self).add_slopes(at, v, scale, slopes);
    }
    fn by_parameter(&self, parameter: usize, at: Configuration<'_>, v: &[f64]) -> f64 {
        (**self).by_parameter(parameter, at, v)
    }
    fn follow(&self, node: Configuration<'_>, seen: Seen) {
        (**self).follow(node, seen);
    }
}

/// The rate `ẏ = ∇y·v` of a quantity.
#[derive(Clone, Debug)]
pub struct RateOf<Q>(
    /// Of what.
    pub Q,
);

impl<Q: Quantity> NodeQuantity for RateOf<Q> {
    fn value(&self, at: Configuration<'_>, v: &[f64]) -> f64 {
        let mut slope = vec![0.0; v.len()];
        self.0.add_slope(at, 1.0, &mut slope);
        vi_core::linear::dot(&slope, v)
    }
    fn add_slopes(&self, at: Configuration<'_>, v: &[f64], scale: f64, [q, of_v]: [&mut [f64]; 2]) {
        self.0.add_slope(at, scale, of_v);
        let mut along = vec![0.0; v.len()];
        for (i, sum) in q.iter_mut().enumerate() {
            along[i] = 1.0;
            *sum += scale * self.0.second(at, v, &along); // D²y[v, e_i]
            along[i] = 0.0;
        }
    }
    fn by_parameter(&self, parameter: usize, at: Configuration<'_>, v: &[f64]) -> f64 {
        self.0.rate_by_parameter(parameter, at, v)
    }
    fn follow(&self, node: Configuration<'_>, seen: Seen) {
        self.0.follow(node, seen);
    }
}

/// What a law reads of a node, but what is held or past.
impl NodeQuantity for Input {
    fn value(&self, at: Configuration<'_>, v: &[f64]) -> f64 {
        self.at_node(at, v, &[])
    }
    fn add_slopes(&self, at: Configuration<'_>, v: &[f64], scale: f64, [q, of_v]: [&mut [f64]; 2]) {
        self.for_each_slope_by_position(at.q, v, &mut |i, slope| q[i] += scale * slope);
        self.for_each_slope_by_velocity(at.q, v, &mut |i, slope| of_v[i] += scale * slope);
    }
}

/// `½ (y(q_N, v̂_N) − target)²`.
#[derive(Debug)]
pub struct TerminalRate<Q> {
    quantity: Q,
    target: f64,
    mechanism: Mechanism,
    mass: SparseMatrix,
    node: Mutex<NodeVelocity>,
}

/// Why a rate has no derivative.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RateError {
    /// The momentum of a node is not `M v` alone.
    #[error("a rate has no derivative where steps add to the masses")]
    AddedMass,
    /// A direction that the constraints leave free has no mass.
    #[error("the velocity at a node is not determined: {0}")]
    Undetermined(#[from] Singular),
    /// A tangent is not available.
    #[error(transparent)]
    Design(#[from] DesignError),
}

impl<Q: NodeQuantity> TerminalRate<Q> {
    /// In a run, where the numbers of its mechanism change so with parameters.
    ///
    /// # Errors
    /// [`RateError`].
    pub fn new(
        (quantity, target): (Q, f64),
        run: &MechanismIntegrator,
        tangents: &[MechanismTangent],
    ) -> Result<Self, RateError> {
        if run.system().adds_mass() {
            return Err(RateError::AddedMass);
        }
        let (mechanism, mass) = (run.constraints().clone(), run.system().mass().clone());
        let mut node = NodeVelocity::new(&mechanism, run.rows(), tangents)?;
        node.find(&mechanism, &mass, run.state())?;
        Ok(Self { quantity, target, mechanism, mass, node: Mutex::new(node) })
    }

    /// With `e`, `v̂` and the slopes of `y` by `q` and `v`; not a number where `v̂` is none.
    fn at<T>(
        &self,
        end: &State,
        then: impl FnOnce(f64, &[f64], &mut NodeVelocity) -> Result<T, Singular>,
    ) -> Option<T> {
        let node = &mut *self.node.lock().unwrap_or_else(PoisonError::into_inner);
        let v = node.find(&self.mechanism, &self.mass, end).ok()?.to_vec();
        let e = self.quantity.value(end.configuration(), &v) - self.target;
        then(e, &v, node).ok()
    }
}

impl<Q: NodeQuantity> Term for TerminalRate<Q> {
    fn of_end(&self, end: &State) -> f64 {
        self.at(end, |e, _, _| Ok(0.5 * e * e)).unwrap_or(f64::NAN)
    }
    fn add_of_end(&self, end: &State, scale: f64, q: &mut [f64], p: &mut [f64]) {
        let (at, mut of_v) = (end.configuration(), vec![0.0; q.len()]);
        self.at(end, |e, v, node| {
            self.quantity.add_slopes(at, v, scale * e, [&mut *q, &mut of_v]);
            node.pull(&self.mechanism, at, &of_v, [q, p])
        });
    }
    fn add_parameters_of_end(&self, end: &State, scale: f64, out: &mut [f64]) {
        let (at, n) = (end.configuration(), end.q.len());
        let [mut q, mut p, mut of_v] = [(); 3].map(|()| vec![0.0; n]);
        self.at(end, |e, v, node| {
            self.quantity.add_slopes(at, v, scale * e, [&mut q, &mut of_v]);
            node.pull(&self.mechanism, at, &of_v, [&mut q, &mut p])?;
            for (k, sum) in out.iter_mut().enumerate() {
                *sum += scale * e * self.quantity.by_parameter(k, at, v);
                *sum += node.pulled_by_parameter(at, k);
            }
            Ok(())
        });
    }
    fn follow(&self, node: Configuration<'_>, seen: Seen) {
        self.quantity.follow(node, seen);
    }
}
