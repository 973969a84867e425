//! The nodal form on closed loops, `em-nodal` with `u` of the spanning tree.
//!
//! ```text
//! r(u) = [ P̄ᵀ h B       ]     q_{n+1} = F_d(u, q_n) of the tree,  u ∈ R^{d_tree}
//!        [ g_c(q_{n+1}) ]     independent rows of what the tree leaves out
//! Dr   = [ P̄ᵀ K̃          ] ∂F_d/∂u          K̃ as in the nodal form
//!        [ G_c(q_{n+1})  ]
//! ```
//! `P̄ = P̄_tree Z̄` with `Z̄ = null(Ḡ_c P̄_tree)` ([`crate::null_space::TreeComplement`]) or the null space
//! of the whole `Ḡ`; both annihilate the loops' rows of the averaged configuration. The joints of the tree
//! hold by construction, the loops to the tolerance of Newton's method.
//!
//! *Redundant loops.* The rows enforced are chosen anew in every step, at the first trial of `q_{n+1}`, by
//! pivoted QR of `G_c ∂F_d/∂u` with the generic rank: a choice made once may come close to dependent
//! later. Rows left out follow from the others at nodes; at `q_{n+1/2}` they do so where the
//! mechanism has one internal freedom (see [`crate::constrained`]).
//!
//! Increments are known to `ε |q|/σ`, `σ` the last kept pivot, as in
//! [`vi_multibody::closed_loop`]. Source: Betsch & Leyendecker 2006; the treatment of loops is ours.

use crate::balance::Balance;
use crate::constraint::DiscreteConstraints;
use crate::em_system::EmSystem;
use crate::null_space::DiscreteNullSpace;
use crate::scheme::advance_state;
use nalgebra::DMatrix;
use vi_constraints::Reparametrization;
use vi_constraints::null_space::NullSpaceQr;
use vi_constraints::saddle_point::{IndependentRows, JacobianPlace};
use vi_constraints::scheme::{Condition, Scheme, StepError, SubStep};
use vi_core::interval::Interval;
use vi_core::linear::{DenseLu, condition_number};
use vi_core::newton::{Block, Fault, Newton};
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

/// The nodal form on closed loops.
#[derive(Debug)]
pub struct EmLoopNodal<N, R> {
    rates: Option<Vec<f64>>, // d_tree  ν(0), where the first step cannot start from u = 0
    source: N,
    map: R,
    work: Work,
}

#[derive(Debug)]
struct Work {
    balance: Balance,
    loops: LoopRows,
    tree_rows: Vec<usize>,   // constraints that the tree fulfils
    cut: IndependentRows,    // all rows of the loops
    chosen: IndependentRows, // those enforced in this step
    fresh: bool,             // not chosen yet in this step
    sigma: f64,              // last kept pivot
    qr: NullSpaceQr,
    jacobian: DMatrix<f64>, // m_c × n  G_c
    reduced: DMatrix<f64>,  // m_c × d_tree  G_c ∂F_d/∂u
    g: Vec<f64>,            // m
    push: DMatrix<f64>,     // n × d_tree  ∂F_d/∂u
    weighted: DMatrix<f64>, // n × d_tree  K̃ ∂F_d/∂u
    matrix: DMatrix<f64>,   // d_tree × d_tree
    lu: DenseLu,
    blocks: Vec<Block>,
}

impl<N, R: Reparametrization> EmLoopNodal<N, R> {
    /// For `n` coordinates, `m` constraints, the loops among them, a source of `P̄` and the map `F_d` of
    /// the spanning tree; `blocks`: units and scales of `u`.
    #[must_use]
    pub fn new(
        (n, m): (usize, usize),
        loops: LoopRows,
        (source, map): (N, R),
        blocks: Vec<Block>,
    ) -> Self {
        let (d, cut) = (map.dof(), loops.rows.len());
        let tree_rows: Vec<usize> = (0..m).filter(|row| !loops.rows.contains(row)).collect();
        let mut rows = tree_rows.clone();
        rows.extend(&loops.rows[..loops.rank]);
        let zeros = DMatrix::zeros;
        let work = Work {
            balance: Balance::new(n, (IndependentRows::choose(m, &rows), m)),
            cut: IndependentRows::choose(m, &loops.rows),
            chosen: IndependentRows::choose(m, &loops.rows[..loops.rank]),
            fresh: true,
            sigma: 1.0,
            qr: NullSpaceQr::new(d, cut),
            jacobian: zeros(cut, n),
            reduced: zeros(cut, d),
            g: vec![0.0; m],
            push: zeros(n, d),
            weighted: zeros(n, d),
            matrix: zeros(d, d),
            lu: DenseLu::new(d),
            blocks,
            tree_rows,
            loops,
        };
        Self { rates: None, source, map, work }
    }

    /// Newton's method of the first step starts from `h ν`: at a singular configuration `u = 0` is no start
    /// value.
    #[must_use]
    pub fn starting_with(mut self, rates: Vec<f64>) -> Self {
        self.rates = Some(rates);
        self
    }
}

/// `out ← ` rows of `G(q_{n+1})`.
fn closure_jacobian(
    rows: &IndependentRows,
    constraints: &impl DiscreteConstraints,
    s: &Interval,
    out: &mut DMatrix<f64>,
) {
    out.fill(0.0);
    let place = JacobianPlace { row: 0, column: 0, scale: 1.0, transposed: false };
    rows.emit_jacobian(constraints, (s.t_end(), &s.q1), place, out);
}

impl Work {
    /// Takes the rows of the leading pivots of `G_c ∂F_d/∂u`; `push` holds `∂F_d/∂u`.
    fn choose_rows(&mut self, constraints: &impl DiscreteConstraints) {
        closure_jacobian(&self.cut, constraints, &self.balance.s, &mut self.jacobian);
        self.reduced.gemm(1.0, &self.jacobian, &self.push, 0.0);
        let LoopRows { rows, scale, rank } = &self.loops;
        self.qr.factorize_scaled(&self.reduced, |i| scale[i]);
        self.sigma = rank.checked_sub(1).map_or(1.0, |last| self.qr.pivot_size(last));
        // the rows of the loops ascend, and so do those of `cut`
        let pivots: Vec<usize> = self.qr.pivots()[..*rank].iter().map(|&k| rows[k]).collect();
        let chosen = IndependentRows::choose(self.g.len(), &pivots);
        if chosen != self.chosen {
            let all: Vec<usize> = self.tree_rows.iter().chain(&pivots).copied().collect();
            self.balance.set_rows(IndependentRows::choose(self.g.len(), &all));
            self.chosen = chosen;
        }
    }
}

impl<C, N, R> Scheme<EmSystem, C> for EmLoopNodal<N, R>
where
    C: DiscreteConstraints,
    N: DiscreteNullSpace<C>,
    R: Reparametrization,
{
    fn blocks(&self) -> &[Block] {
        &self.work.blocks
    }

    fn begin(&mut self, _system: &EmSystem, _constraints: &C, step: SubStep, state: &mut State) {
        self.work.balance.open(state, step);
        self.work.fresh = true;
        step.depart(self.rates.as_deref(), state);
    }

    fn residual(
        &mut self,
        system: &EmSystem,
        constraints: &C,
        u: &[f64],
        r: &mut [f64],
    ) -> Result<(), Fault> {
        let Self { source, map, work, .. } = self;
        map.reparametrize(u, &mut work.balance.s)?;
        work.balance.s.close();
        if work.fresh {
            map.tangent(u, &work.balance.s, &mut work.push);
            work.choose_rows(constraints);
            work.fresh = false;
        }
        let balance = &mut work.balance;
        source.null_space(constraints, &balance.s, &mut balance.null_space);
        let (along, closure) = r.split_at_mut(balance.null_space.ncols());
        balance.residual(system, along);
        constraints.value(balance.s.end(), &mut work.g);
        work.chosen.gather(&work.g, closure);
        Ok(())
    }

    fn correction(
        &mut self,
        system: &EmSystem,
        constraints: &C,
        u: &[f64],
        du: &mut [f64],
    ) -> Result<(), Fault> {
        let Work { balance, push, weighted, matrix, lu, jacobian, reduced, chosen, .. } =
            &mut self.work;
        self.map.tangent(u, &balance.s, push);
        balance.pushed_tangent((system, constraints), push, weighted)?;
        let null_space = &balance.null_space;
        let (d, rank) = (null_space.ncols(), chosen.len());
        matrix.rows_mut(0, d).gemm_tr(1.0, null_space, weighted, 0.0);
        closure_jacobian(chosen, constraints, &balance.s, jacobian);
        reduced.rows_mut(0, rank).gemm(1.0, &jacobian.rows(0, rank), push, 0.0);
        matrix.rows_mut(d, rank).copy_from(&reduced.rows(0, rank));
        Ok(lu.solve(matrix, du)?)
    }

    fn noise(&self) -> f64 {
        1e-9 / self.work.sigma.clamp(1e-8, 1.0)
    }

    fn end(
        &mut self,
        system: &EmSystem,
        constraints: &C,
        _newton: &Newton,
        state: &mut State,
    ) -> Result<(), StepError> {
        let balance = &mut self.work.balance;
        balance.multipliers(constraints).map_err(|_| StepError::RankLost)?;
        let clean = |t: f64, q: &mut [f64]| self.map.clean(t, q);
        advance_state(state, system, (&balance.s, &balance.mu), None, clean);
        Ok(())
    }

    fn interval(&self) -> &Interval {
        &self.work.balance.s
    }

    fn interval_mut(&mut self) -> &mut Interval {
        &mut self.work.balance.s
    }

    fn condition(&mut self, _system: &EmSystem, _: &C, _u: &[f64]) -> Option<Condition> {
        Some(Condition::unscaled(condition_number(&self.work.matrix)))
    }
}
