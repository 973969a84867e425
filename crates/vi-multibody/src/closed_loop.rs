//! Closed loops on top of a tree: null space, redundancy, singular placements.
//!
//! Loops are cut at joints; `g_c` are the cut joints' constraints.
//! ```text
//! J_n = G_c(q_n) P_tree(q_n),      J_nᵀ Π = [W Z] [R; 0]        column-pivoted QR, Z = null J_n
//! b    = P_treeᵀ (p̄_n + D_1 L_d + f_d^-),     g = g_c(F_d(u, q_n)) (independent rows),   u ∈ R^{d_tree}
//! r(u) = (1 − W Wᵀ) b + W g = 0               balance along Z Zᵀ = 1 − W Wᵀ, closure along W
//! δ    = A⁻¹ ((1 − W Wᵀ) r + W μ),   (J' A⁻¹ W) μ = Wᵀr − J' A⁻¹ (1 − W Wᵀ) r
//! A    = P_treeᵀ D_2(D_1 L_d + f_d^-) ∂F_d/∂u
//! ```
//! `Z` is never formed: work and memory are `O(N·loops² + loops³)`.
//! `A` is solved by the articulated recursion, or by a sparse or dense factorization where the potential
//! couples bodies; the complement `J' A⁻¹ W` is small and dense.
//!
//! **Rank.** Permanent redundancy (overconstrained loops) shows as a clear gap in `R`; only the rows
//! of the first `rank` pivots are enforced, the others follow from them. The *generic* rank, the
//! largest met, is kept when a placement loses rank momentarily (a flat four-bar): `Z` is then the
//! last null space projected onto the new one, so the branch of the motion is the one its velocity
//! points along, and the rows enforced are chosen at `q_{n+1}`. A start in such a placement is compared
//! with placements nearby ([`crate::placement`]): with a velocity, `Z` at the start is the limit of the
//! generic null space along it; at rest it is refused, since nothing says which branch the motion takes.
//!
//! **Round-off.** `g_c` is a difference of stored coordinates, so the increments of a loop are known to
//! `ε |q|/σ` and not to `ε` of themselves, with `σ` the last kept entry of `R`, `~ 0.1 δ` at an angle `δ`
//! from a flat position: floors and noise of Newton's method are higher than those of a tree. A row sees
//! only the links of its own loop: what both of its ends share would cancel but for round-off, which
//! `1/σ` would turn into a drift of the momentum maps.
//!
//! Source: LMO08 §5.4, §5.5.
#![allow(non_snake_case)] // J, W, A

use crate::articulated::Articulated;
use crate::joint::{FrameId, Joint};
use crate::map::TreeMap;
use crate::mechanism::Mechanism;
use crate::pair::{PairKind, Twist};
use crate::scalar_constraint::ScalarRow;
use crate::sparse_nodal::SparseNodal;
use nalgebra::DMatrix;
use std::ops::Range;
use vi_constraints::null_space::NullSpaceQr;
use vi_constraints::{DenseNodal, NodalOperators};
use vi_core::discrete_lagrangian::MechanicalSystem;
use vi_core::interval::Interval;
use vi_core::linear::{DenseLu, norm_inf};
use vi_core::newton::{Block, BlockKind, Fault};

/// What carries the tree: its velocity map and `A`.
pub enum TreeSolver {
    /// The articulated recursion: no potential couples bodies.
    Recursion,
    /// Dense matrices.
    Dense(Box<DenseNodal<TreeMap>>),
    /// A sparse factorization; its unknowns are those of the loops, too.
    Sparse(Box<SparseNodal>),
}

/// [`NodalOperators`] of a mechanism with closed loops.
pub struct LoopNodal {
    tree: Articulated,
    solver: TreeSolver,
    rows: Vec<ScalarRow>,     // g_c
    scale: Vec<f64>,          // of the rows of J in rank decisions
    length: f64,              // longest lever arm
    rank: usize,              // generic rank of J
    apex: Vec<Option<usize>>, // of each row: the link at which the two sides of its loop meet
    blocks: Vec<Block>,
    sigma: f64, // last kept entry of R at q_{n+1}
    q_n: Vec<f64>,
    jacobian: DMatrix<f64>, // m_c × d_tree
    qr: NullSpaceQr,
    W: DMatrix<f64>,          // d_tree × rank
    W_last: DMatrix<f64>,     // d_tree × rank  of the last node
    chosen: Vec<usize>,       // rank rows of g_c enforced at q_{n+1}
    AW: DMatrix<f64>,         // d_tree × (rank + 1)  A⁻¹ (W, b)
    complement: DMatrix<f64>, // rank × rank
    lu: DenseLu,
    b: Vec<f64>,  // d_tree
    mu: Vec<f64>, // rank
    fresh: bool,  // rows not chosen yet in this step
    has_last: bool,
}

impl LoopNodal {
    /// For a mechanism with cut joints, and the generic rank of its loop constraints.
    #[must_use]
    pub fn new(mechanism: &Mechanism, rank: usize, solver: TreeSolver) -> Self {
        Self { solver, ..Self::uncoupled(mechanism, rank) }
    }

    pub(crate) fn uncoupled(mechanism: &Mechanism, rank: usize) -> Self {
        let tree = Articulated::new(mechanism.tree().clone());
        let rows = mechanism.loop_constraints();
        let (d, m) = (mechanism.tree().dof(), rows.len());
        let zeros = |i, j| DMatrix::zeros(i, j);
        let length = longest_arm(mechanism);
        let scale = row_scales(mechanism, &rows, length);
        Self {
            apex: apexes(mechanism, &tree),
            blocks: blocks(mechanism),
            sigma: 1.0,
            q_n: vec![0.0; 12 * mechanism.tree().links().len()],
            jacobian: zeros(m, d),
            qr: NullSpaceQr::new(d, m),
            W: zeros(d, rank),
            W_last: zeros(d, rank),
            chosen: (0..rank).collect(),
            AW: zeros(d, rank + 1),
            complement: zeros(rank, rank),
            lu: DenseLu::new(rank),
            b: vec![0.0; d],
            mu: vec![0.0; rank],
            fresh: true,
            has_last: false,
            tree,
            solver: TreeSolver::Recursion,
            rows,
            scale,
            length,
            rank,
        }
    }

    /// The first node is a singular placement: its null space is that of the branch, `Z_0`.
    #[must_use]
    pub fn leaving_along(mut self, null_space: &DMatrix<f64>) -> Self {
        self.W_last.copy_from(&complement_of(null_space));
        self.has_last = true;
        self
    }

    /// Rank of the loop constraints' Jacobian `J` at `q`, which is kept and factorized.
    pub(crate) fn rank_here(&mut self, q: &[f64]) -> usize {
        self.begin_tree(q);
        self.write_jacobian(q, false);
        self.factorize_jacobian()
    }

    /// The rows of `J` in pivot order of the last factorization.
    pub(crate) fn pivots(&self) -> &[usize] {
        self.qr.pivots()
    }

    /// Orthonormal basis of `range Jᵀ` from the last factorization.
    pub(crate) fn range(&mut self, rank: usize) -> DMatrix<f64> {
        let mut range = DMatrix::zeros(self.jacobian.ncols(), rank);
        self.qr.range(&mut range);
        range
    }

    /// Orthonormal basis of the null space of `J` from the last factorization.
    pub(crate) fn null_space(&mut self, rank: usize) -> DMatrix<f64> {
        let d = self.jacobian.ncols();
        let mut null = DMatrix::zeros(d, d - rank);
        self.qr.null_space(rank, &mut null);
        null
    }

    /// Entry of the last `J`, scaled as its rows are in rank decisions.
    pub(crate) fn jacobian_entry(&self, i: usize, j: usize) -> f64 {
        self.scale[i] * self.jacobian[(i, j)]
    }

    /// Rows of the last `J`, scaled.
    pub(crate) fn scaled_rows(&self, rows: Range<usize>) -> DMatrix<f64> {
        let first = rows.start;
        DMatrix::from_fn(rows.len(), self.jacobian.ncols(), |i, j| {
            self.jacobian_entry(first + i, j)
        })
    }

    /// `g_c(t, q)`, scaled.
    pub(crate) fn values(&self, t: f64, q: &[f64]) -> Vec<f64> {
        self.rows.iter().zip(&self.scale).map(|(row, scale)| scale * row.value(t, q)).collect()
    }

    pub(crate) fn begin_tree(&mut self, q: &[f64]) {
        self.tree.begin_at(q, false);
    }

    pub(crate) fn move_tree(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        self.tree.move_to(u, s)
    }

    /// What one is for each unknown: 1 rad, or the longest lever arm.
    pub(crate) fn unknown_scales(&self) -> Vec<f64> {
        let mut scales = vec![1.0; self.jacobian.ncols()];
        for block in self.blocks.iter().filter(|b| b.kind == BlockKind::Position) {
            scales[block.range.clone()].fill(self.length);
        }
        scales
    }

    /// `J` at `q`, with `S` of `q_n` or `S'` of `q_{n+1}`.
    fn write_jacobian(&mut self, q: &[f64], next: bool) {
        self.jacobian.fill(0.0);
        for i in 0..self.rows.len() {
            self.write_row(i, i, q, next);
        }
    }

    /// Row `out` of `jacobian` ← row `i` of `G_c P_tree`: wrenches of the row, carried to the root.
    fn write_row(&mut self, i: usize, out: usize, q: &[f64], next: bool) {
        let (tree, jacobian, apex) = (&self.tree, &mut self.jacobian, self.apex[i]);
        if let TreeSolver::Sparse(sparse) = &self.solver {
            self.rows[i].for_each_wrench(q, |frame, wrench: Twist| {
                let place = (tree.link_of(frame), apex);
                sparse.add_wrench(next, place, &wrench, |j, value| jacobian[(out, j)] += value);
            });
            return;
        }
        self.rows[i].for_each_wrench(q, |frame, wrench: Twist| {
            let (mut at, mut wrench) = (Some(tree.link_of(frame)), wrench);
            while let Some(k) = at.filter(|_| at != apex) {
                let link = &tree.tree().links()[k];
                let map = if next { tree.map_next(k) } else { tree.map_at(k) };
                for (j, column) in map.columns().iter().enumerate() {
                    jacobian[(out, link.offset + j)] += column.dot(&wrench);
                }
                wrench = map.transfer.apply_transposed(&wrench);
                at = link.parent;
            }
        });
    }

    /// `∂F_d/∂u` of the tree at the unknowns `u`, for the rows at `q_{n+1}`.
    fn take_tangent(&mut self, u: &[f64], s: &Interval) {
        match &mut self.solver {
            TreeSolver::Sparse(sparse) => sparse.take_tangent(u, s),
            _ => self.tree.keep(u, &s.q1),
        }
    }

    fn factorize_jacobian(&mut self) -> usize {
        let scale = &self.scale;
        self.qr.factorize_scaled(&self.jacobian, |i| scale[i])
    }

    /// `W` from the QR of `Jᵀ` at `q_n`. At a placement that loses rank the directions that are
    /// missing are those of the last `W` that lie in the new null space.
    fn split(&mut self) {
        let found = self.factorize_jacobian();
        if found < self.rank && self.has_last {
            let range = self.range(found);
            let left = &self.W_last - &range * (range.transpose() * &self.W_last);
            let missing = left.col_piv_qr().q();
            self.W.columns_mut(0, found).copy_from(&range);
            let count = self.rank - found;
            self.W.columns_mut(found, count).copy_from(&missing.columns(0, count));
        } else {
            self.qr.range(&mut self.W);
        }
        self.W_last.copy_from(&self.W);
    }

    /// Takes the rows of the leading pivots at the first trial of `q_{n+1}`.
    fn choose_rows(&mut self, q1: &[f64]) {
        self.write_jacobian(q1, true);
        let found = self.factorize_jacobian();
        self.chosen.copy_from_slice(&self.qr.pivots()[..self.rank]);
        let (kept, dropped) = self.qr.gap();
        self.sigma = if found < self.rank { dropped } else { kept };
    }
}

/// For each row of the cut joints the lowest link that carries both of its sides, where they turn with
/// it: the child of a spherical pair does not, so its loop is felt by the rotation of what carries it.
fn apexes(mechanism: &Mechanism, tree: &Articulated) -> Vec<Option<usize>> {
    let carriers = |frame: usize| {
        let start = Some(tree.link_of(frame));
        std::iter::successors(start, |&k| tree.tree().links()[k].parent)
    };
    let apex = |joint: &Joint| match (joint.parent.frame, joint.child.frame) {
        (FrameId::Frame(a), FrameId::Frame(b)) => {
            let of_a: Vec<usize> = carriers(a).collect();
            let apex = carriers(b).find(|k| of_a.contains(k))?;
            let below = |frame| carriers(frame).take_while(move |k| *k != apex);
            let turns = |k: usize| tree.tree().links()[k].joint.kind != PairKind::Spherical;
            below(a).chain(below(b)).all(turns).then_some(apex)
        }
        _ => None,
    };
    let of =
        |&k: &usize| vec![apex(&mechanism.description().joints[k]); mechanism.joint_rows(k).len()];
    let mut apexes: Vec<_> = mechanism.cut_joints().iter().flat_map(of).collect();
    apexes.resize(mechanism.loop_constraints().len(), None); // scalar constraints: up to the root
    apexes
}

/// The longest lever arm of a joint at the start, 1 m when there is none.
fn longest_arm(mechanism: &Mechanism) -> f64 {
    let (q, _) = mechanism.start();
    let arm = |joint: &Joint| {
        let at = joint.placement(&q);
        at.rho_parent.norm().max(at.rho_child.norm()).max(at.gap.norm())
    };
    let length = mechanism.description().joints.iter().map(arm).fold(0.0, f64::max);
    if length > 0.0 { length } else { 1.0 }
}

/// The blocks of the tree with floors at which round-off of the loop constraints is no correction.
fn blocks(mechanism: &Mechanism) -> Vec<Block> {
    const RELATIVE: f64 = 1e-5; // what Newton's method calls small of this is about 50 ε
    let (q, arm) = (mechanism.start().0, longest_arm(mechanism));
    let extent =
        q.chunks(12).map(|frame| norm_inf(&frame[..3.min(frame.len())])).fold(arm, f64::max);
    let mut blocks = mechanism.tree().blocks();
    for block in &mut blocks {
        block.floor = match block.kind {
            BlockKind::Position => RELATIVE * extent,
            _ => RELATIVE * extent / arm,
        };
    }
    blocks
}

/// One over the size of each row's wrench at the start, forces weighed by the longest lever arm.
fn row_scales(mechanism: &Mechanism, rows: &[ScalarRow], length: f64) -> Vec<f64> {
    let (q, _) = mechanism.start();
    let scale = |row: &ScalarRow| {
        let mut square = 0.0;
        row.for_each_wrench(&q, |_, w| {
            square += length * length * w.linear.norm_squared() + w.angular.norm_squared();
        });
        if square > 0.0 { 1.0 / square.sqrt() } else { 1.0 }
    };
    rows.iter().map(scale).collect()
}

/// `x ← A⁻¹ x` with the last factorization, for right-hand sides of `d` numbers that follow one another.
fn apply_inverse(
    tree: &mut Articulated,
    solver: &mut TreeSolver,
    d: usize,
    x: &mut [f64],
) -> Result<(), Fault> {
    match solver {
        TreeSolver::Recursion => {
            x.chunks_exact_mut(d).for_each(|x| tree.solve_in_place(x));
            Ok(())
        }
        TreeSolver::Dense(dense) => {
            x.chunks_exact_mut(d).try_for_each(|x| dense.solve_factorized(x))
        }
        TreeSolver::Sparse(sparse) => sparse.solve_assembled(x),
    }
}

/// Orthonormal basis of the orthogonal complement of the range of `Z` (orthonormal columns).
fn complement_of(Z: &DMatrix<f64>) -> DMatrix<f64> {
    let (d, f) = Z.shape();
    let mut qr = NullSpaceQr::new(d, f);
    qr.factorize(&Z.transpose());
    let mut out = DMatrix::zeros(d, d - f);
    qr.null_space(f, &mut out);
    out
}

impl<S: MechanicalSystem> NodalOperators<S> for LoopNodal {
    fn dof(&self) -> usize {
        self.W.nrows()
    }

    fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    fn begin(&mut self, system: &S, s: &Interval, kept: bool) {
        self.q_n.copy_from_slice(&s.q0);
        self.rows.iter().for_each(|row| row.accept(&s.q0));
        self.tree.begin_at(&s.q0, kept);
        match &mut self.solver {
            TreeSolver::Recursion => {}
            TreeSolver::Dense(dense) => dense.begin(system, s, kept),
            TreeSolver::Sparse(sparse) => sparse.begin(system, s, kept),
        }
        self.write_jacobian(&s.q0, false);
        self.split();
        (self.fresh, self.has_last) = (true, true);
    }

    fn keep_tangent(&mut self, u: &[f64], s: &Interval) -> bool {
        self.take_tangent(u, s);
        if let TreeSolver::Dense(dense) = &mut self.solver {
            NodalOperators::<S>::keep_tangent(&mut **dense, u, s);
        }
        true
    }

    fn reparametrize(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        match &mut self.solver {
            TreeSolver::Sparse(sparse) => NodalOperators::<S>::reparametrize(&mut **sparse, u, s)?,
            _ => self.tree.move_to(u, s)?,
        }
        if self.fresh {
            self.take_tangent(u, s);
            self.choose_rows(&s.q1);
            self.fresh = false;
        }
        for (g, &row) in self.mu.iter_mut().zip(&self.chosen) {
            *g = self.rows[row].value(s.t_end(), &s.q1);
        }
        Ok(())
    }

    fn pull_back(&mut self, w: &[f64], out: &mut [f64]) {
        match &mut self.solver {
            TreeSolver::Sparse(sparse) => {
                NodalOperators::<S>::pull_back(&mut **sparse, w, &mut self.b);
            }
            _ => self.tree.pull_back_at(&self.q_n, w, &mut self.b),
        }
        out.copy_from_slice(&self.b);
        for (k, g) in self.mu.iter().enumerate() {
            let w = self.W.column(k);
            let along: f64 = w.iter().zip(&self.b).map(|(w, b)| w * b).sum();
            out.iter_mut().zip(w.iter()).for_each(|(r, w)| *r += (g - along) * w);
        }
    }

    fn solve(&mut self, system: &S, u: &[f64], s: &Interval, x: &mut [f64]) -> Result<(), Fault> {
        match &mut self.solver {
            TreeSolver::Recursion => self.tree.factorize(system, u, s)?,
            TreeSolver::Dense(dense) => {
                self.tree.keep(u, &s.q1);
                dense.factorize(system, u, s);
            }
            TreeSolver::Sparse(sparse) => sparse.assemble(system, u, s),
        }
        let (d, rank) = self.W.shape();
        self.b.copy_from_slice(x);
        for k in 0..self.rank {
            let w = self.W.column(k);
            let along: f64 = w.iter().zip(&*x).map(|(w, x)| w * x).sum();
            self.mu[k] = along; // g
            self.b.iter_mut().zip(w.iter()).for_each(|(b, w)| *b -= along * w);
        }
        let columns = self.AW.as_mut_slice();
        columns[..rank * d].copy_from_slice(self.W.as_slice());
        columns[rank * d..].copy_from_slice(&self.b);
        apply_inverse(&mut self.tree, &mut self.solver, d, columns)?;
        self.b.copy_from_slice(&columns[rank * d..]);
        self.jacobian.fill(0.0);
        for k in 0..self.rank {
            self.write_row(self.chosen[k], k, &s.q1, true);
        }
        for i in 0..self.rank {
            let row = self.jacobian.row(i);
            self.mu[i] -= row.iter().zip(&self.b).map(|(j, b)| j * b).sum::<f64>();
        }
        let J = self.jacobian.rows(0, self.rank);
        self.complement.gemm(1.0, &J, &self.AW.columns(0, rank), 0.0);
        self.lu.solve(&self.complement, &mut self.mu)?;
        for (i, x) in x.iter_mut().enumerate() {
            let correction: f64 = (0..self.rank).map(|k| self.AW[(i, k)] * self.mu[k]).sum();
            *x = self.b[i] + correction;
        }
        if x.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(Fault::SingularTangent) }
    }

    fn clean(&mut self, _t: f64, q: &mut [f64]) {
        self.tree.tree().clean(q);
    }

    fn noise(&self) -> f64 {
        1e-9 / self.sigma.clamp(1e-8, 1.0)
    }

    fn condition(&self) -> Option<f64> {
        Some(vi_core::linear::condition_number(&self.complement))
    }
}
