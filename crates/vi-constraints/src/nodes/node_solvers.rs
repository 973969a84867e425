//! Quantities of a node from the structure of a mechanism, without a saddle-point matrix.
//!
//! ```text
//! v̂ = P ν,   (PᵀMP) ν = Pᵀp,   Q p = M v̂                                                (16)
//! closed loops:   P of the spanning tree, J ν = −∂g/∂t,   balance along the null space of J
//! ```
//! The operators are those of the nodal scheme (28) at `u = 0`, where `∂F_d/∂u = P(q_n)`, with `M`
//! in the place of `D_2(D_1 L_d + f_d^-)`: linear in the number of bodies where the step is.

use crate::reparametrization::{DenseNodal, Emission, NodalOperators, Reparametrization};
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_core::linear::Singular;
use vi_core::newton::Fault;
use vi_core::sparse::SparseMatrix;
use vi_core::state::Memory;

/// Finds `v̂` of a momentum.
pub trait MomentumVelocity: Send {
    /// `v ← v̂` at a node with the `memory` of its state, shape `n`; `mass` emits `M`.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank, or a direction they leave free has no
    /// mass.
    fn velocity(
        &mut self,
        mass: &Emission<'_>,
        at: Configuration<'_>,
        memory: &Memory,
        p: &[f64],
        v: &mut [f64],
    ) -> Result<(), Singular>;
}

/// Solves linear systems of the Jacobian of independent constraints.
pub trait MultiplierSweep: Send {
    /// `λ ←` the solution of `Gᵀλ = w`, shape `m`; `w` is in the range of `Gᵀ` up to round-off.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    fn multipliers(
        &mut self,
        jacobian: &SparseMatrix,
        w: &[f64],
        lambda: &mut [f64],
    ) -> Result<(), Singular>;
    /// `a ←` a solution of `G a = b`, shape `n`.
    ///
    /// # Errors
    /// As [`MultiplierSweep::multipliers`].
    fn particular(
        &mut self,
        jacobian: &SparseMatrix,
        b: &[f64],
        a: &mut [f64],
    ) -> Result<(), Singular>;
}

/// What a mechanism offers to read its nodes; the rest is solved with the saddle-point matrix.
#[derive(Default)]
pub struct NodeSolvers {
    /// `v̂`.
    pub velocity: Option<Box<dyn MomentumVelocity>>,
    /// `λ`.
    pub multipliers: Option<Box<dyn MultiplierSweep>>,
}

impl std::fmt::Debug for NodeSolvers {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("NodeSolvers")
            .field("velocity", &self.velocity.is_some())
            .field("multipliers", &self.multipliers.is_some())
            .finish()
    }
}

/// [`NodalOperators`] that act on rates, too.
pub trait RateOperators: NodalOperators {
    /// Opens the step `u = 0` from `q_n = s.q0 = s.q1`, where `∂F_d/∂u = P(q_n)`; `rest`: `u`.
    ///
    /// # Errors
    /// [`Fault`] where the map does not reach the node itself.
    fn stand(&mut self, s: &mut Interval, memory: &Memory, rest: &[f64]) -> Result<(), Fault> {
        self.begin(s, memory, None);
        self.reparametrize(rest, s)
    }
    /// Makes the balance of rates of a pulled back momentum: where loops are closed, `J ν = −∂g/∂t`
    /// takes the place of as many balances. Premise: the step of the interval is 1 s.
    fn close_rates(&mut self, _at: Configuration<'_>, _r: &mut [f64]) {}
    /// `v ← P(q_n) ν`, shape `n`.
    fn push_forward(&mut self, nu: &[f64], v: &mut [f64]);
}

impl<O: RateOperators + ?Sized> RateOperators for Box<O> {
    fn stand(&mut self, s: &mut Interval, memory: &Memory, rest: &[f64]) -> Result<(), Fault> {
        (**self).stand(s, memory, rest)
    }
    fn close_rates(&mut self, at: Configuration<'_>, r: &mut [f64]) {
        (**self).close_rates(at, r);
    }
    fn push_forward(&mut self, nu: &[f64], v: &mut [f64]) {
        (**self).push_forward(nu, v);
    }
}

/// [`MomentumVelocity`] by the operators of the nodal scheme.
#[derive(Debug)]
pub struct NodalVelocity<O> {
    operators: O,
    s: Interval,
    rest: Vec<f64>, // d  u = 0
    nu: Vec<f64>,   // d
}

impl<O: RateOperators> NodalVelocity<O> {
    /// For `n` coordinates.
    #[must_use]
    pub fn new(n: usize, operators: O) -> Self {
        let d = operators.dof();
        Self { operators, s: Interval::new(n), rest: vec![0.0; d], nu: vec![0.0; d] }
    }
}

impl<O: RateOperators> MomentumVelocity for NodalVelocity<O> {
    fn velocity(
        &mut self,
        mass: &Emission<'_>,
        at: Configuration<'_>,
        memory: &Memory,
        p: &[f64],
        v: &mut [f64],
    ) -> Result<(), Singular> {
        let Self { operators, s, rest, nu } = self;
        s.open(at.t, 1.0, at.q);
        s.angles.extend_from_slice(at.angles);
        operators.stand(s, memory, rest).map_err(|_| Singular)?; // q_{n+1} = q_n
        operators.pull_back(p, nu); // Pᵀp
        operators.close_rates(at, nu);
        operators.solve(mass, rest, s, nu).map_err(|_| Singular)?; // ν
        operators.push_forward(nu, v); // v̂ = P ν
        if v.iter().all(|v| v.is_finite()) { Ok(()) } else { Err(Singular) }
    }
}

impl<R: Reparametrization> RateOperators for DenseNodal<R> {
    fn push_forward(&mut self, nu: &[f64], v: &mut [f64]) {
        v.fill(0.0);
        for (column, nu) in self.null_space().column_iter().zip(nu) {
            v.iter_mut().zip(column.iter()).for_each(|(v, p)| *v += p * nu); // (6)
        }
    }
}
