//! The operators of the nodal form by sparse matrices, for trees: beams and large mechanisms.
//!
//! `P̄` from averaged vectors has the pattern of `P`: each frame is moved by the unknowns of its
//! ancestors. `P̄ᵀ K̃ ∂F_d/∂u` is therefore the reduced matrix of [`SparseNodal`] with `P̄` in the
//! place of `P(q_n)` and `K̃` in the place of `D_2 D_1 L_d`: one symbolic factorization for ever,
//! `O(elements)` for beams. The multipliers in `K̃` come from [`vi_multibody::tree_multipliers`],
//! `O(N)` too.

use crate::nodal::{EmIterate, EmOperators};
use crate::null_space::{AveragedTree, EmLinearization};
use nalgebra::DMatrix;
use vi_constraints::NodalOperators;
use vi_constraints::scheme::SubStep;
use vi_core::interval::Interval;
use vi_core::newton::{Fault, UnknownBlock};
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::state::State;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::sparse_nodal::SparseNodal;

/// [`EmOperators`] of a tree.
pub struct SparseOperators {
    averaged: AveragedTree,
    sparse: SparseNodal,
}

impl std::fmt::Debug for SparseOperators {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SparseOperators").field("averaged", &self.averaged).finish_non_exhaustive()
    }
}

impl SparseOperators {
    /// For the spanning tree of a mechanism.
    #[must_use]
    pub fn new(mechanism: &Mechanism, averaged: AveragedTree) -> Self {
        Self { averaged, sparse: SparseNodal::new(mechanism) }
    }

    /// For elements that couple frames at `q`, as [`SparseNodal::for_elements`].
    #[must_use]
    pub fn for_elements(mut self, q: &[f64]) -> Self {
        self.sparse = self.sparse.for_elements(q);
        self
    }

    /// As [`SparseNodal::in_flight`].
    #[must_use]
    pub fn in_flight(mut self, mechanism: &Mechanism, mass: &SparseMatrix) -> Self {
        self.sparse = self.sparse.in_flight(mechanism, mass);
        self
    }
}

impl<C> EmOperators<C> for SparseOperators {
    fn blocks(&self) -> &[UnknownBlock] {
        self.sparse.blocks()
    }

    fn begin(&mut self, step: SubStep, state: &mut State) {
        self.sparse.take_momentum(&state.p, step.h);
    }

    fn reparametrize(
        &mut self,
        _constraints: &C,
        u: &[f64],
        s: &mut Interval,
    ) -> Result<(), Fault> {
        self.sparse.reparametrize(u, s)?;
        self.sparse.take_maps(&s.q_mid, self.averaged.maps_at(&s.q_mid));
        Ok(())
    }

    fn pull_back(&mut self, w: &[f64], out: &mut [f64]) {
        self.sparse.pull_back(w, out);
    }

    fn carry_balance(&mut self, r: &[f64], carried: &mut Vec<f64>) {
        carried.clear();
        carried.extend_from_slice(r);
        self.sparse.carry_balance(carried);
    }

    fn linearization(&self) -> EmLinearization {
        EmLinearization::Multipliers
    }

    fn solve(
        &mut self,
        _constraints: &C,
        emit: &dyn Fn(&mut dyn Entries),
        EmIterate { u, s, .. }: EmIterate<'_>,
        x: &mut [f64],
    ) -> Result<(), Fault> {
        self.sparse.solve(emit, u, s, x)
    }

    fn clean(&mut self, t: f64, q: &mut [f64]) {
        self.sparse.clean(t, q);
    }

    fn matrix(&self) -> DMatrix<f64> {
        self.sparse.matrix()
    }
}
