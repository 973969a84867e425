//! What the nodal Galerkin scheme asks of a system, without matrices.

use crate::reparametrization::{DenseNewton, Emission, LastStep, Reparametrization, pull_back};
use nalgebra::DMatrix;
use vi_core::interval::Interval;
use vi_core::newton::{Fault, UnknownBlock};

/// Maps and factorizations at the control points `1 … s` of a step, numbered from 0.
pub trait ControlPointOperators: Send {
    /// Degrees of freedom `d`.
    fn dof(&self) -> usize;
    /// Units and scales of the increments `u`.
    fn blocks(&self) -> &[UnknownBlock];
    /// Writes `s.q1 = F_d(u, s.q0)`, `s.dq` and closes the interval.
    ///
    /// # Errors
    /// [`Fault`] when `u` is outside the domain of the map.
    fn reparametrize(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault>;
    /// `out ← P(q)ᵀ w`, shape `d`. Any basis of the null space will do that changes little along
    /// the step: `reached` is the increment that leads from `q_n` to `q`, none at `q_n`.
    fn pull_back(&mut self, q: &[f64], reached: Option<LastStep<'_>>, w: &[f64], out: &mut [f64]);
    /// Factorizes `P(q_j)ᵀ M ∂F_d/∂u (u_j, q_n)` of control point `j`, with the basis of
    /// `pull_back`, where `s = (q_n, q_j)`; `mass` emits `M`.
    ///
    /// # Errors
    /// [`Fault::SingularTangent`].
    fn factorize(
        &mut self,
        j: usize,
        mass: &Emission<'_>,
        u: &[f64],
        s: &Interval,
    ) -> Result<(), Fault>;
    /// `x ← (P(q_j)ᵀ M ∂F_d/∂u)⁻¹ x` with the last factorization of control point `j`.
    ///
    /// # Errors
    /// [`Fault::SingularTangent`].
    fn solve(&mut self, j: usize, x: &mut [f64]) -> Result<(), Fault>;
    /// `u ←` the increment of `first` and then `u`; of use for initial guesses, so that the sum
    /// will do.
    fn compose(&self, first: &[f64], u: &mut [f64]) {
        u.iter_mut().zip(first).for_each(|(u, first)| *u += first);
    }
    /// See [`Reparametrization::clean`].
    fn clean(&mut self, t: f64, q: &mut [f64]);
}

/// [`ControlPointOperators`] from a [`Reparametrization`], by dense matrices.
///
/// `∂F_d/∂u` takes the place of `P(q_j)`, whose range it has: it is smooth along the step, and the
/// basis of a map need not be (the axes of a bar are those farthest from it).
#[derive(Debug)]
pub struct DenseControlPoints<R> {
    map: R,
    blocks: Vec<UnknownBlock>,
    basis: DMatrix<f64>,      // n × d  P(q_n) or ∂F_d/∂u
    newton: Vec<DenseNewton>, // s
}

impl<R: Reparametrization> DenseControlPoints<R> {
    /// Operators of `stages` control points for a map on `R^n`.
    pub fn new(n: usize, stages: usize, map: R) -> Self {
        let (d, blocks) = (map.dof(), map.blocks());
        let newton = (0..stages).map(|_| DenseNewton::new(n, d)).collect();
        Self { map, blocks, basis: DMatrix::zeros(n, d), newton }
    }
}

impl<R: Reparametrization> ControlPointOperators for DenseControlPoints<R> {
    fn dof(&self) -> usize {
        self.basis.ncols()
    }

    fn blocks(&self) -> &[UnknownBlock] {
        &self.blocks
    }

    fn reparametrize(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        self.map.reparametrize(u, s)?; // (27)
        s.close();
        Ok(())
    }

    fn pull_back(&mut self, q: &[f64], reached: Option<LastStep<'_>>, w: &[f64], out: &mut [f64]) {
        match reached {
            Some(LastStep { u, s }) => self.map.tangent(u, s, &mut self.basis),
            None => self.map.null_space(q, &mut self.basis),
        }
        pull_back(&self.basis, w, out);
    }

    fn factorize(
        &mut self,
        j: usize,
        mass: &Emission<'_>,
        u: &[f64],
        s: &Interval,
    ) -> Result<(), Fault> {
        self.map.tangent(u, s, &mut self.basis);
        self.newton[j].factorize(mass, &self.basis, &self.basis);
        Ok(())
    }

    fn solve(&mut self, j: usize, x: &mut [f64]) -> Result<(), Fault> {
        self.newton[j].solve(x)
    }

    fn clean(&mut self, t: f64, q: &mut [f64]) {
        self.map.clean(t, q);
    }
}
