//! [`NodalOperators`] of closed loops on the operators of their spanning tree.
#![allow(non_snake_case)] // A, U, J

use super::cluster::Cluster;
use super::loop_rank::LoopRank;
use super::loops::{Loops, with_floors};
use super::path::{Maps, RowPlace};
use super::sweep::LoopResolution;
use crate::mechanism::Mechanism;
use crate::solver::chord::Chord;
use crate::solver::enforced::Enforced;
use crate::solver::sparse_nodal::{SparseNodal, SparseRow};
use crate::solver::tree_map::TreeMap;
use crate::solver::tree_nodal::TreeNodal;
use nalgebra::DMatrix;
use vi_constraints::node_solvers::RateOperators;
use vi_constraints::reparametrization::{Emission, LastStep};
use vi_constraints::{DenseNodal, NodalOperators};
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_core::linear::DenseLu;
use vi_core::newton::{Fault, Precision, UnknownBlock, largest_rotation};
use vi_core::state::Memory;

/// Constraints of loops from which on the complement is not formed: its matrix is dense.
const BORDERED_FROM: usize = 100;

/// The operators of the tree: its velocity map and `A`.
pub enum TreeSolver {
    /// The sweeps over its links: no potential couples bodies.
    Sweeps(Box<TreeNodal>),
    /// Dense matrices.
    Dense(Box<DenseNodal<TreeMap>>),
    /// A sparse factorization; its unknowns are those of the loops, too.
    Sparse(Box<SparseNodal>),
}

/// [`NodalOperators`] of a mechanism with closed loops.
pub struct LoopNodal {
    loops: Loops,
    blocks: Vec<UnknownBlock>, // of the tree, then of point masses
    dof: usize,
    solver: TreeSolver,
    coupled: Coupled, // of matrices that couple bodies
    elements: bool,   // between frames
    rounding: f64,    // of directions between nodes, in parts of that of rotations
    h: f64,
    resolution: LoopResolution,
    fresh: bool,    // rows not chosen yet in this step
    standing: bool, // rows are those of a node: rates are asked for
    current: bool,  // the tangent maps are those of the last trial
}

/// The complement of all loops together, where `A` is one matrix.
struct Coupled {
    bordered: bool,           // one sparse matrix in the place of the complement
    solutions: DMatrix<f64>,  // d × (rank + 1)  A⁻¹ (Uᵀ, b)
    complement: DMatrix<f64>, // rank × rank  J' A⁻¹ Uᵀ
    lu: DenseLu,
    mu: Vec<f64>, // rank
    chord: Chord,
}

impl LoopNodal {
    /// For a mechanism with cut joints, and the generic rank of its loop constraints.
    #[must_use]
    pub fn new(mechanism: &Mechanism, rank: &LoopRank, mut solver: TreeSolver) -> Self {
        let mut loops = rank.loops(mechanism);
        if let TreeSolver::Sweeps(tree) = &mut solver {
            loops.carry(tree.workspace());
        }
        let bordered = matches!(solver, TreeSolver::Sparse(_)) && rank.generic >= BORDERED_FROM;
        let dense = !bordered && !matches!(solver, TreeSolver::Sweeps(_));
        let size = if dense { rank.generic } else { 0 };
        let mut blocks = loops.blocks.clone();
        blocks.extend(mechanism.particle_tree().blocks());
        let blocks = with_floors(mechanism, blocks);
        let dof = loops.dof() + mechanism.particle_tree().dof();
        let coupled = Coupled {
            bordered,
            solutions: DMatrix::zeros(dof, size + 1),
            complement: DMatrix::zeros(size, size),
            lu: DenseLu::new(size),
            mu: vec![0.0; size],
            chord: Chord::new(&blocks),
        };
        let (h, resolution) = (1.0, LoopResolution::full());
        let (fresh, current, elements) = (true, false, mechanism.has_nodes());
        let standing = false;
        let rounding = mechanism.direction_rounding(&mechanism.initial_configuration());
        Self {
            loops,
            blocks,
            dof,
            solver,
            coupled,
            elements,
            rounding,
            h,
            resolution,
            fresh,
            standing,
            current,
        }
    }

    /// The first node is a singular configuration: its null space is that of the branch, `Z_0`.
    #[must_use]
    pub fn leaving_along(mut self, null_space: &DMatrix<f64>) -> Self {
        self.loops.leave_along(null_space);
        self
    }

    /// `∂F_d/∂u` of the tree at the last trial, for the rows at `q_{n+1}`.
    fn take_tangent(&mut self, u: &[f64], s: &Interval) {
        if self.current {
            return;
        }
        match &mut self.solver {
            TreeSolver::Sweeps(_) => {}
            TreeSolver::Dense(_) => self.loops.tree.reach(u, &s.q1),
            TreeSolver::Sparse(sparse) => sparse.take_tangent(u, s),
        }
        self.current = true;
    }

    /// The correction by the sweeps of the tree.
    fn solve_by_sweeps(
        &mut self,
        mixed: &Emission<'_>,
        u: &[f64],
        s: &Interval,
        x: &mut [f64],
    ) -> Result<(), Fault> {
        let TreeSolver::Sweeps(tree) = &mut self.solver else { return Err(Fault::SingularTangent) };
        let (at, added) = tree.assemble(mixed, s);
        let enforced = Enforced::of(s, self.standing);
        self.loops.solve((at, added, enforced), u, x)
    }

    /// The correction where `A` is one matrix, bordered by the rows of the loops.
    fn solve_bordered(
        &mut self,
        mixed: &Emission<'_>,
        u: &[f64],
        s: &Interval,
        x: &mut [f64],
    ) -> Result<(), Fault> {
        let (q, step) = Enforced::of(s, self.standing).place();
        let Self { loops, solver, coupled, .. } = self;
        let TreeSolver::Sparse(sparse) = solver else { return Err(Fault::SingularTangent) };
        sparse.assemble(mixed, u, s);
        let Loops { tree, clusters, home, column_of, .. } = loops;
        let maps = Maps::Columns(sparse);
        let at = RowPlace { tree, maps, home, column_of, q, next: true, step };
        let (mut basis, mut enforced): (Vec<SparseRow>, Vec<SparseRow>) = (Vec::new(), Vec::new());
        coupled.mu.clear();
        for cluster in clusters {
            let (first, rank) = (basis.len(), cluster.rank());
            basis.resize(first + rank, SparseRow::new());
            enforced.resize(first + rank, SparseRow::new());
            cluster.for_each_entry(|k, column, value| basis[first + k].push((column, value)));
            cluster.for_each_enforced(at, |i, column, value| {
                enforced[first + i].push((column, value));
            });
            coupled.mu.extend_from_slice(cluster.gaps());
        }
        sparse.solve_bordered([basis, enforced], &coupled.mu, x)
    }

    /// The correction where `A` is one matrix: `δ = A⁻¹ b + A⁻¹ Uᵀ μ`,
    /// `(J' A⁻¹ Uᵀ) μ = g − J' A⁻¹ b`.
    fn solve_coupled(
        &mut self,
        mixed: &Emission<'_>,
        u: &[f64],
        s: &Interval,
        x: &mut [f64],
    ) -> Result<(), Fault> {
        let (q, step) = Enforced::of(s, self.standing).place();
        let Self { loops, solver, coupled, .. } = self;
        let Coupled { solutions, complement, lu, mu, chord, .. } = coupled;
        let (d, rank) = (x.len(), mu.len());
        if d == 0 {
            return Ok(()); // all is welded
        }
        solutions.fill(0.0);
        solutions.column_mut(rank).copy_from_slice(x);
        let mut first = 0;
        for cluster in &loops.clusters {
            cluster.for_each_entry(|k, column, value| solutions[(column, first + k)] = value);
            mu[first..first + cluster.rank()].copy_from_slice(cluster.gaps());
            first += cluster.rank();
        }
        match solver {
            TreeSolver::Sweeps(_) => {}
            TreeSolver::Dense(dense) => {
                dense.factorize(mixed, u, s);
                let mut sides = solutions.as_mut_slice().chunks_exact_mut(d);
                sides.try_for_each(|x| dense.solve_factorized(x))?;
            }
            TreeSolver::Sparse(sparse) => {
                sparse.assemble(mixed, u, s);
                sparse.solve_assembled(solutions.as_mut_slice())?;
            }
        }
        let Loops { tree, clusters, home, column_of, .. } = loops;
        let maps = solver.maps();
        let at = RowPlace { tree, maps, home, column_of, q, next: true, step };
        complement.fill(0.0);
        let mut first = 0;
        for cluster in clusters {
            cluster.for_each_enforced(at, |i, column, value| {
                for k in 0..rank {
                    complement[(first + i, k)] += value * solutions[(column, k)];
                }
                mu[first + i] -= value * solutions[(column, rank)];
            });
            first += cluster.rank();
        }
        lu.solve(complement, mu)?;
        for (i, x) in x.iter_mut().enumerate() {
            let part: f64 = mu.iter().enumerate().map(|(k, mu)| solutions[(i, k)] * mu).sum();
            *x = solutions[(i, rank)] + part;
        }
        if solver.has_factors() {
            chord.renew(u, x);
        }
        Ok(())
    }

    /// The same correction with the factors that the last one by a matrix has left.
    fn solve_by_factors(&mut self, s: &Interval, x: &mut [f64]) -> Result<(), Fault> {
        let (q, step) = Enforced::of(s, self.standing).place();
        let Self { loops, solver, coupled, .. } = self;
        let Coupled { solutions, lu, mu, .. } = coupled;
        let TreeSolver::Sparse(sparse) = solver else { return Err(Fault::SingularTangent) };
        sparse.solve_again(x)?;
        let Loops { tree, clusters, home, column_of, .. } = loops;
        let at = RowPlace { tree, maps: solver.maps(), home, column_of, q, next: true, step };
        let mut first = 0;
        for cluster in clusters {
            mu[first..first + cluster.rank()].copy_from_slice(cluster.gaps());
            cluster.for_each_enforced(at, |i, column, value| mu[first + i] -= value * x[column]);
            first += cluster.rank();
        }
        lu.solve_factorized(mu)?;
        for (column, mu) in solutions.column_iter().zip(mu) {
            x.iter_mut().zip(column.iter()).for_each(|(x, part)| *x += part * *mu);
        }
        Ok(())
    }
}

impl TreeSolver {
    /// Whether corrections are made with the factors of the last one: a small dense matrix is
    /// formed anew each time.
    fn has_factors(&self) -> bool {
        self.sparse().is_some_and(SparseNodal::has_factors)
    }

    fn sparse(&self) -> Option<&SparseNodal> {
        if let Self::Sparse(sparse) = self { Some(sparse) } else { None }
    }

    /// The velocity maps that rows are carried by.
    fn maps(&self) -> Maps<'_> {
        match self {
            Self::Sweeps(tree) => Maps::Sweeps(tree.at_links()),
            Self::Dense(_) => Maps::Pairs,
            Self::Sparse(sparse) => Maps::Columns(sparse),
        }
    }

    fn operators(&self) -> &dyn RateOperators {
        match self {
            Self::Sweeps(tree) => &**tree,
            Self::Dense(dense) => &**dense,
            Self::Sparse(sparse) => &**sparse,
        }
    }

    fn operators_mut(&mut self) -> &mut dyn RateOperators {
        match self {
            Self::Sweeps(tree) => &mut **tree,
            Self::Dense(dense) => &mut **dense,
            Self::Sparse(sparse) => &mut **sparse,
        }
    }
}

impl NodalOperators for LoopNodal {
    fn dof(&self) -> usize {
        self.dof
    }

    fn blocks(&self) -> &[UnknownBlock] {
        &self.blocks
    }

    fn take_momentum(&mut self, p: &[f64], h: f64) {
        self.solver.operators_mut().take_momentum(p, h);
    }

    fn begin(&mut self, s: &Interval, memory: &Memory, last: Option<LastStep<'_>>) {
        self.h = s.h;
        self.solver.operators_mut().begin(s, memory, last);
        if let TreeSolver::Dense(_) = self.solver {
            self.loops.tree.begin(&s.q0, last);
        }
        self.loops.begin(self.solver.maps(), &s.q0, memory);
        (self.fresh, self.standing, self.current) = (true, false, false);
        self.coupled.chord.forget();
    }

    fn remember(&self, memory: &mut Memory) {
        self.loops.remember(memory);
    }

    fn reparametrize(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        self.current = false;
        self.solver.operators_mut().reparametrize(u, s)?;
        if self.fresh {
            self.take_tangent(u, s);
            let Self { loops, solver, .. } = self;
            self.resolution = loops.choose_rows(solver.maps(), &s.q1, u);
            self.fresh = false;
        }
        self.loops.clusters.iter_mut().for_each(|cluster| cluster.close_step(s));
        Ok(())
    }

    fn pull_back(&mut self, w: &[f64], out: &mut [f64]) {
        self.solver.operators_mut().pull_back(w, out);
    }

    fn close(&mut self, r: &mut [f64]) {
        self.loops.clusters.iter().for_each(|cluster| cluster.project(self.h, r));
        self.solver.operators_mut().close(r);
    }

    fn carry_balance(&self, r: &mut [f64]) {
        self.solver.operators().carry_balance(r);
        self.loops.clusters.iter().for_each(|cluster| cluster.clear_closure(r));
    }

    fn solve(
        &mut self,
        mixed: &Emission<'_>,
        u: &[f64],
        s: &Interval,
        x: &mut [f64],
    ) -> Result<(), Fault> {
        if let TreeSolver::Sweeps(tree) = &self.solver {
            tree.turn_back(x);
        }
        self.loops.clusters.iter_mut().try_for_each(|cluster| cluster.split(self.h, x))?;
        let mut chord = std::mem::take(&mut self.coupled.chord);
        let kept = chord.correct(u, x, |x| self.solve_by_factors(s, x));
        self.coupled.chord = chord;
        if !kept {
            self.take_tangent(u, s);
            if let TreeSolver::Sweeps(_) = self.solver {
                self.solve_by_sweeps(mixed, u, s, x)?;
            } else if self.coupled.bordered {
                self.solve_bordered(mixed, u, s, x)?;
            } else {
                self.solve_coupled(mixed, u, s, x)?;
            }
        }
        if x.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(Fault::SingularTangent) }
    }

    fn clean(&mut self, t: f64, q: &mut [f64]) {
        self.solver.operators_mut().clean(t, q);
    }

    fn forget_factors(&mut self) {
        self.coupled.chord.forget();
    }

    fn precision(&self) -> Precision {
        let (noise, balances) = (self.resolution.noise(), !self.elements);
        let noise = noise.max((noise * self.rounding).min(1e-6));
        let closing_size = match balances && !self.coupled.chord.keeps_factors() {
            true => self.resolution.closing_size(),
            false => 0.0,
        };
        Precision { noise, closing_size, ..Precision::of_balances_if(balances) }
    }

    /// Gaps of loops, and prescribed motions, beside momenta.
    fn rotation(&self, u: &[f64]) -> f64 {
        largest_rotation(self.blocks(), u)
    }
}

impl RateOperators for LoopNodal {
    fn stand(&mut self, s: &mut Interval, memory: &Memory, rest: &[f64]) -> Result<(), Fault> {
        self.begin(s, memory, None);
        self.standing = true;
        let regular = self.loops.clusters.iter_mut().all(Cluster::take_rows_of_basis);
        self.fresh = !(regular && matches!(self.solver, TreeSolver::Sweeps(_)));
        self.reparametrize(rest, s)
    }

    fn close_rates(&mut self, at: Configuration<'_>, r: &mut [f64]) {
        for cluster in &mut self.loops.clusters {
            cluster.close_rates(at);
            cluster.project(self.h, r);
        }
    }

    fn push_forward(&mut self, nu: &[f64], v: &mut [f64]) {
        self.solver.operators_mut().push_forward(nu, v);
    }
}
