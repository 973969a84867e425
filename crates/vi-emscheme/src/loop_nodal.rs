//! The nodal form on closed loops, `em-nodal` with `u` of the spanning tree.
//!
//! ```text
//! r(u) = [ P̄ᵀ h B       ]     q_{n+1} = F_d(u, q_n) of the tree,  u ∈ R^{d_tree}
//!        [ g_c(q_{n+1}) ]     independent rows of what the tree leaves out
//! Dr   = [ P̄ᵀ K̃          ] ∂F_d/∂u          K̃ as in the nodal form
//!        [ G_c(q_{n+1})  ]
//! ```
//! `P̄ = P̄_tree Z̄` with `Z̄ = null(Ḡ_c P̄_tree)` ([`crate::null_space::TreeComplement`]) or the
//! null space of the whole `Ḡ`; both annihilate the loops' rows of the averaged configuration. The
//! joints of the tree hold by construction, the loops to the tolerance of Newton's method.
//!
//! *Redundant loops.* The rows enforced are chosen anew in every step, at the first trial of
//! `q_{n+1}`, by pivoted QR of `G_c ∂F_d/∂u` with the generic rank: a choice made once may come
//! close to dependent later. Rows left out follow from the others at nodes; at `q_{n+1/2}` they do
//! so where the mechanism has one internal freedom (see [`crate::constrained`]).
//!
//! Increments are known to `ε |q|/σ`, `σ` the last kept pivot, as in
//! [`vi_multibody::closed_loop`]. Source: Betsch & Leyendecker 2006; the treatment of loops is
//! ours.

use crate::constraint::DiscreteConstraints;
use nalgebra::DMatrix;
use vi_constraints::null_space::NullSpaceQr;
use vi_constraints::saddle_point::{IndependentRows, JacobianPlace};
use vi_constraints::scheme::SubStep;
use vi_core::dense::set_product;
use vi_core::interval::Interval;
use vi_core::state::State;

/// The constraints that a spanning tree leaves out.
#[derive(Clone, Debug)]
pub struct LoopRows {
    /// Their rows among all constraints.
    pub rows: Vec<usize>,
    /// One over the size of each row, for rank decisions.
    pub scale: Vec<f64>,
    /// Generic rank of `G_c ∂F_d/∂u`.
    pub rank: usize,
}

/// The equations of the loops in a step.
#[derive(Debug)]
pub struct LoopClosure {
    loops: LoopRows,
    rates: Option<Vec<f64>>, // d_tree  ν(0), where the first step cannot start from u = 0
    tree_rows: Vec<usize>,   // constraints that the tree fulfils
    cut: IndependentRows,    // all rows of the loops
    chosen: IndependentRows, // those enforced in this step
    all: IndependentRows,    // those and the ones of the tree
    fresh: bool,             // not chosen yet in this step
    sigma: f64,              // last kept pivot
    qr: NullSpaceQr,
    jacobian: DMatrix<f64>, // m_c × n  G_c
    reduced: DMatrix<f64>,  // m_c × d_tree  G_c ∂F_d/∂u
    g: Vec<f64>,            // m
}

impl LoopClosure {
    /// For `n` coordinates, `m` constraints, the loops among them and `d` degrees of freedom of the
    /// tree. Newton's method of the first step starts from `h ν` of the `rates`: at a singular
    /// configuration `u = 0` is no start value.
    #[must_use]
    pub fn new(n: usize, m: usize, d: usize, loops: LoopRows, rates: Option<Vec<f64>>) -> Self {
        let cut = loops.rows.len();
        let first = &loops.rows[..loops.rank];
        let tree_rows: Vec<usize> = (0..m).filter(|row| !loops.rows.contains(row)).collect();
        Self {
            rates,
            cut: IndependentRows::choose(m, &loops.rows),
            chosen: IndependentRows::choose(m, first),
            all: IndependentRows::choose(m, &[&tree_rows, first].concat()),
            fresh: true,
            sigma: 1.0,
            qr: NullSpaceQr::new(d, cut),
            jacobian: DMatrix::zeros(cut, n),
            reduced: DMatrix::zeros(cut, d),
            g: vec![0.0; m],
            tree_rows,
            loops,
        }
    }

    /// The independent constraints of this step, those of the tree included.
    #[must_use]
    pub fn rows(&self) -> &IndependentRows {
        &self.all
    }

    /// Whether the rows of this step are still to be chosen.
    pub(crate) fn is_fresh(&self) -> bool {
        self.fresh
    }

    /// Opens a step.
    pub(crate) fn begin(&mut self, step: SubStep, state: &mut State) {
        self.fresh = true;
        step.depart(self.rates.as_deref(), state);
    }

    /// Takes the rows of the leading pivots of `G_c ∂F_d/∂u`; `push` holds `∂F_d/∂u`.
    pub(crate) fn choose(
        &mut self,
        constraints: &impl DiscreteConstraints,
        s: &Interval,
        push: &DMatrix<f64>,
    ) {
        self.fresh = false;
        jacobian_at_end(&self.cut, constraints, s, &mut self.jacobian);
        set_product(self.reduced.as_view_mut(), self.jacobian.as_view(), push.as_view());
        let LoopRows { rows, scale, rank } = &self.loops;
        self.qr.factorize_scaled(&self.reduced, |i| scale[i]);
        self.sigma = rank.checked_sub(1).map_or(1.0, |last| self.qr.pivot_size(last));
        // the rows of the loops ascend, and so do those of `cut`
        let pivots: Vec<usize> = self.qr.pivots()[..*rank].iter().map(|&k| rows[k]).collect();
        let chosen = IndependentRows::choose(self.g.len(), &pivots);
        if chosen != self.chosen {
            let all = [&self.tree_rows[..], &pivots].concat();
            self.all = IndependentRows::choose(self.g.len(), &all);
            self.chosen = chosen;
        }
    }

    /// `out ← g_c(q_{n+1})`.
    pub(crate) fn residual(
        &mut self,
        constraints: &impl DiscreteConstraints,
        s: &Interval,
        out: &mut [f64],
    ) {
        constraints.value(s.end(), &mut self.g);
        self.chosen.gather(&self.g, out);
    }

    /// Writes `G_c(q_{n+1}) ∂F_d/∂u` into the last rows of the Newton matrix.
    pub(crate) fn tangent(
        &mut self,
        constraints: &impl DiscreteConstraints,
        s: &Interval,
        push: &DMatrix<f64>,
        matrix: &mut DMatrix<f64>,
    ) {
        let Self { chosen, jacobian, .. } = self;
        let (rank, first) = (chosen.len(), matrix.nrows() - chosen.len());
        jacobian_at_end(chosen, constraints, s, jacobian);
        let rows = jacobian.rows(0, rank);
        set_product(matrix.rows_mut(first, rank).as_view_mut(), rows.as_view(), push.as_view());
    }

    /// See [`vi_core::newton::Precision::noise`].
    pub(crate) fn noise(&self) -> f64 {
        1e-9 / self.sigma.clamp(1e-8, 1.0)
    }
}

/// `out ← ` rows of `G(q_{n+1})`.
fn jacobian_at_end(
    rows: &IndependentRows,
    constraints: &impl DiscreteConstraints,
    s: &Interval,
    out: &mut DMatrix<f64>,
) {
    out.fill(0.0);
    let place = JacobianPlace { row: 0, column: 0, scale: 1.0, transposed: false };
    rows.emit_jacobian(constraints, s.end(), place, out);
}
