//! The operators of the nodal form by dense matrices, `O(n d²)`: for any source of `P̄` and any map
//! `F_d`.

use crate::constraint::DiscreteConstraints;
use crate::loop_nodal::LoopClosure;
use crate::nodal::{EmIterate, EmOperators};
use crate::null_space::{DiscreteNullSpace, EmLinearization};
use nalgebra::DMatrix;
use vi_constraints::Reparametrization;
use vi_constraints::reparametrization::pull_back;
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::scheme::SubStep;
use vi_core::interval::Interval;
use vi_core::linear::DenseLu;
use vi_core::newton::{Fault, UnknownBlock};
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::state::State;

/// [`EmOperators`] of a source of `P̄` and a map `F_d`.
#[derive(Debug)]
pub struct DenseOperators<N, R> {
    source: N,
    map: R,
    linearization: EmLinearization,
    blocks: Vec<UnknownBlock>,
    loops: Option<LoopClosure>,
    null_space: DMatrix<f64>,      // n × d  P̄; on loops with fewer columns
    push: DMatrix<f64>,            // n × d  ∂F_d/∂u
    weighted: DMatrix<f64>,        // n × d  K̃ ∂F_d/∂u
    matrix: DMatrix<f64>,          // d × d
    tangent: Option<SparseMatrix>, // n × n  K̃
    lu: DenseLu,
    gram: DMatrix<f64>, // d × d  P̄ᵀ P̄
    gram_lu: DenseLu,
    shares: Vec<f64>, // d
}

impl<N, R: Reparametrization> DenseOperators<N, R> {
    /// For `n` coordinates, with the term of the multipliers in the Newton matrix.
    #[must_use]
    pub fn new(n: usize, source: N, map: R) -> Self {
        let (d, blocks) = (map.dof(), map.blocks());
        let nd = || DMatrix::zeros(n, d);
        Self {
            source,
            map,
            linearization: EmLinearization::Multipliers,
            blocks,
            loops: None,
            null_space: nd(),
            push: nd(),
            weighted: nd(),
            matrix: DMatrix::zeros(d, d),
            tangent: None,
            lu: DenseLu::new(d),
            gram: DMatrix::zeros(d, d),
            gram_lu: DenseLu::new(d),
            shares: vec![0.0; d],
        }
    }

    /// On closed loops: the map is that of the spanning tree; `blocks`: units and scales of its
    /// increments.
    #[must_use]
    pub fn on_loops(mut self, loops: LoopClosure, blocks: Vec<UnknownBlock>) -> Self {
        let n = self.null_space.nrows();
        let d = n - loops.rows().len();
        self.null_space = DMatrix::zeros(n, d);
        (self.gram, self.gram_lu, self.shares) =
            (DMatrix::zeros(d, d), DenseLu::new(d), vec![0.0; d]);
        (self.loops, self.blocks) = (Some(loops), blocks);
        self
    }

    /// With another linearization; `None` when the source of `P̄` has no derivative.
    #[must_use]
    pub fn linearized<C>(mut self, linearization: EmLinearization) -> Option<Self>
    where
        N: DiscreteNullSpace<C>,
    {
        self.linearization = linearization;
        let explicit = linearization == EmLinearization::NullSpaceDerivative;
        (!explicit || self.source.is_differentiable()).then_some(self)
    }
}

impl<C, N, R> EmOperators<C> for DenseOperators<N, R>
where
    C: DiscreteConstraints,
    N: DiscreteNullSpace<C>,
    R: Reparametrization,
{
    fn blocks(&self) -> &[UnknownBlock] {
        &self.blocks
    }

    fn begin(&mut self, step: SubStep, state: &mut State) {
        if let Some(loops) = &mut self.loops {
            loops.begin(step, state);
        }
    }

    fn reparametrize(&mut self, constraints: &C, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        self.map.reparametrize(u, s)?;
        s.close();
        if let Some(loops) = self.loops.as_mut().filter(|loops| loops.is_fresh()) {
            self.map.tangent(u, s, &mut self.push);
            loops.choose(constraints, s, &self.push);
        }
        self.source.null_space(constraints, s, &mut self.null_space);
        Ok(())
    }

    fn rows(&self) -> Option<&IndependentRows> {
        self.loops.as_ref().map(LoopClosure::rows)
    }

    fn pull_back(&mut self, w: &[f64], out: &mut [f64]) {
        pull_back(&self.null_space, w, out);
    }

    /// `P̄ (P̄ᵀ P̄)⁻¹ r`: columns of `P̄` may be others in the next step.
    fn carry_balance(&mut self, r: &[f64], carried: &mut Vec<f64>) {
        let Self { null_space, gram, gram_lu, shares, .. } = self;
        gram.gemm_tr(1.0, null_space, null_space, 0.0);
        shares.copy_from_slice(&r[..null_space.ncols()]);
        carried.clear();
        carried.resize(null_space.nrows(), 0.0);
        if gram_lu.solve(gram, shares).is_ok() {
            for (column, share) in null_space.column_iter().zip(&*shares) {
                carried.iter_mut().zip(column.iter()).for_each(|(sum, p)| *sum += share * p);
            }
        }
    }

    fn add_carried(&self, scale: f64, carried: &[f64], r: &mut [f64]) {
        for (r, column) in r.iter_mut().zip(self.null_space.column_iter()) {
            let along: f64 = column.iter().zip(carried).map(|(p, carried)| p * carried).sum();
            *r += scale * along;
        }
    }

    fn close(&mut self, constraints: &C, s: &Interval, r: &mut [f64]) {
        if let Some(loops) = &mut self.loops {
            loops.residual(constraints, s, &mut r[self.null_space.ncols()..]);
        }
    }

    fn linearization(&self) -> EmLinearization {
        self.linearization
    }

    fn solve(
        &mut self,
        constraints: &C,
        emit: &dyn Fn(&mut dyn Entries),
        EmIterate { u, s, bracket }: EmIterate<'_>,
        x: &mut [f64],
    ) -> Result<(), Fault> {
        let n = s.dim();
        self.map.tangent(u, s, &mut self.push);
        self.weighted.fill(0.0);
        let tangent = SparseMatrix::update(&mut self.tangent, (n, n), emit);
        tangent.mul_dense_add(1.0, &self.push, &mut self.weighted);
        let along = self.null_space.ncols();
        self.matrix.rows_mut(0, along).gemm_tr(1.0, &self.null_space, &self.weighted, 0.0);
        if let Some(loops) = &mut self.loops {
            loops.tangent(constraints, s, &self.push, &mut self.matrix);
        }
        if self.linearization == EmLinearization::NullSpaceDerivative {
            self.source.add_derivative(s, bracket, &self.push, &mut self.matrix);
        }
        Ok(self.lu.solve(&self.matrix, x)?)
    }

    fn noise(&self) -> f64 {
        self.loops.as_ref().map_or(1e-9, LoopClosure::noise)
    }

    fn clean(&mut self, t: f64, q: &mut [f64]) {
        self.map.clean(t, q);
    }

    fn matrix(&self) -> DMatrix<f64> {
        self.matrix.clone()
    }
}
