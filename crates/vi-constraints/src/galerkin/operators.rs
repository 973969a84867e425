//! What the nodal Galerkin scheme asks of a system, without matrices.

use crate::reparametrization::{DenseNewton, Emission, Reparametrization, pull_back};
use nalgebra::DMatrix;
use vi_core::interval::Interval;
use vi_core::newton::{Block, Fault};

/// Maps and factorizations at the control points `1 … s` of a step, numbered from 0.
pub trait ControlPointOperators: Send {
    /// Degrees of freedom `d`.
    fn dof(&self) -> usize;
    /// Units and scales of the increments `u`.
    fn blocks(&self) -> &[Block];
    /// Writes `s.q1 = F_d(u, s.q0)`, `s.dq` and closes the interval.
    ///
    /// # Errors
    /// [`Fault`] when `u` is outside the domain of the map.
    fn reparametrize(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault>;
    /// `out ← P(q)ᵀ w`, shape `d`.
    fn pull_back(&mut self, q: &[f64], w: &[f64], out: &mut [f64]);
    /// Factorizes `P(q_j)ᵀ M ∂F_d/∂u (u_j, q_n)` of control point `j`, where `s = (q_n, q_j)`; `mass` emits `M`.
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
    /// `u ←` the increment of `first` and then `u`; of use for initial guesses, so that the sum will do.
    fn compose(&self, first: &[f64], u: &mut [f64]) {
        u.iter_mut().zip(first).for_each(|(u, first)| *u += first);
    }
    /// See [`Reparametrization::clean`].
    fn clean(&mut self, t: f64, q: &mut [f64]);
}

/// [`ControlPointOperators`] from a [`Reparametrization`], by dense matrices.
#[derive(Debug)]
pub struct DenseControlPoints<R> {
    map: R,
    blocks: Vec<Block>,
    null_space: DMatrix<f64>, // n × d
    tangent: DMatrix<f64>,    // n × d
    newton: Vec<DenseNewton>, // s
}

impl<R: Reparametrization> DenseControlPoints<R> {
    /// Operators of `stages` control points for a map on `R^n`.
    pub fn new(n: usize, stages: usize, map: R) -> Self {
        let (d, blocks) = (map.dof(), map.blocks());
        let nd = || DMatrix::zeros(n, d);
        let newton = (0..stages).map(|_| DenseNewton::new(n, d)).collect();
        Self { map, blocks, null_space: nd(), tangent: nd(), newton }
    }
}

impl<R: Reparametrization> ControlPointOperators for DenseControlPoints<R> {
    fn dof(&self) -> usize {
        self.null_space.ncols()
    }

    fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    fn reparametrize(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        self.map.reparametrize(u, s)?; // (27)
        s.close();
        Ok(())
    }

    fn pull_back(&mut self, q: &[f64], w: &[f64], out: &mut [f64]) {
        self.map.null_space(q, &mut self.null_space);
        pull_back(&self.null_space, w, out);
    }

    fn factorize(
        &mut self,
        j: usize,
        mass: &Emission<'_>,
        u: &[f64],
        s: &Interval,
    ) -> Result<(), Fault> {
        self.map.null_space(&s.q1, &mut self.null_space);
        self.map.tangent(u, s, &mut self.tangent);
        self.newton[j].factorize(mass, &self.null_space, &self.tangent);
        Ok(())
    }

    fn solve(&mut self, j: usize, x: &mut [f64]) -> Result<(), Fault> {
        self.newton[j].solve(x)
    }

    fn clean(&mut self, t: f64, q: &mut [f64]) {
        self.map.clean(t, q);
    }
}
