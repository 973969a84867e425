//! The sweeps of the Galerkin scheme on closed loops of bodies.
//!
//! ```text
//! Z_i = null Ĝ_i,   Ĝ_i = G_c(q_i) P_tree(q_i),     Z_iᵀ P_treeᵀ w_i = 0,   g_c(q_j) = 0                 [2.35]
//! ρ_j = h Σ_i (K̂⁻¹)_ji Z_iᵀ P_treeᵀ w_i,            [A_j  −Ĝ_jᵀ; Ĝ_j  0] [δ_j; μ] = [ρ_j; g_c(q_j)]
//! ```
//! `Z_i` stands in the same independent unknowns at all control points of a step, so that it
//! changes little between them: the balance is `P_treeᵀ w_i` less the combination of the rows of
//! `Ĝ_i` that vanishes in the dependent ones, whose places are taken by `g_c`. Letters and
//! elimination are those of [`super`]. The tree is swept at all control points at once, as without
//! loops ([`TreeSweeps`]); rows and complements follow point by point.

use super::cluster::Cluster;
use super::loop_rank::LoopRank;
use super::loops::Loops;
use super::path::{Maps, RowPlace};
use super::sweep::{LoopResolution, SMALLEST_REACH};
use crate::mechanism::Mechanism;
use crate::solver::tree_step::workspace::Workspace;
use crate::solver::tree_sweeps::TreeSweeps;
use std::ops::Range;
use vi_constraints::Constraints;
use vi_constraints::galerkin::Sweeps;
use vi_constraints::galerkin::control_points::ControlPoints;
use vi_constraints::scheme::SubStep;
use vi_core::SeparableSystem;
use vi_core::galerkin::Stages;
use vi_core::lanes::Register;
use vi_core::linear::norm_inf;
use vi_core::mechanical_system::MechanicalSystem;
use vi_core::newton::{Fault, UnknownBlock};
use vi_core::state::{Memory, State};

/// [`Sweeps`] of a mechanism with closed loops whose bodies no potential has to couple.
pub struct LoopSweeps<T: Register> {
    tree: TreeSweeps<T>,
    points: Vec<LoopPoint>, // s + 1  the control points
    dependent: Vec<bool>,
    fresh: bool,                // rows not chosen yet in this step
    resolution: LoopResolution, // of the last residual
    none: Vec<f64>,             // n  momenta, where these do not count
    x: Vec<f64>,                // d  right-hand side and solution of a control point
}

impl<T: Register> std::fmt::Debug for LoopSweeps<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LoopSweeps").finish_non_exhaustive()
    }
}

/// The loops at a control point, and the links there.
struct LoopPoint {
    at: Workspace,
    loops: Loops,
}

impl<T: Register> LoopSweeps<T> {
    /// For a mechanism with cut joints, and the generic rank of its loop constraints; `None` where
    /// the sweeps of the tree do not apply, or `lanes` are too few.
    #[must_use]
    pub fn new(
        lanes: T,
        mechanism: &Mechanism,
        system: &SeparableSystem,
        rank: &LoopRank,
        stages: Stages,
    ) -> Option<Self> {
        let s = stages.count();
        let mut tree = TreeSweeps::new(lanes, mechanism, system, stages)?;
        let point = || {
            let (mut at, mut loops) = (Workspace::new(mechanism, system)?, rank.loops(mechanism));
            loops.carry(&mut at);
            Some(LoopPoint { at, loops })
        };
        let points: Vec<LoopPoint> = (0..=s).map(|_| point()).collect::<Option<_>>()?;
        tree.carry_loops(points[0].loops.clusters.iter().filter_map(Cluster::apex));
        let d = points[0].loops.dof();
        let (dependent, fresh, resolution) = (vec![false; d], true, LoopResolution::full());
        let (none, x) = (vec![0.0; mechanism.dim()], vec![0.0; d]);
        Some(Self { tree, points, dependent, fresh, resolution, none, x })
    }

    /// `Ĝ_j` with the rows that are enforced in this step, and `g_c(q_j)`.
    fn close_loops(&mut self, points: &ControlPoints, u: &[f64]) -> Result<(), Fault> {
        let Self { points: own, fresh, resolution, .. } = self;
        let s = points.stages();
        let (first, rest) = own.split_at_mut(1);
        let first = &mut first[0].loops;
        if std::mem::take(fresh) {
            let reach = norm_inf(u).max(SMALLEST_REACH);
            let LoopPoint { at, loops } = &rest[s - 1];
            let at = loops.placed(Maps::Sweeps(at.at_links()), points.q(s));
            first.clusters.iter_mut().for_each(|cluster| _ = cluster.choose_rows(at, reach));
        }
        *resolution = LoopResolution::full();
        for (j, LoopPoint { at, loops }) in (1..).zip(rest) {
            let end = points.point(j).end();
            let Loops { tree: maps, clusters, home, column_of, .. } = loops;
            let links = Maps::Sweeps(at.at_links());
            let at = RowPlace {
                tree: maps,
                maps: links,
                home,
                column_of,
                q: end.q,
                next: false,
                step: None,
            };
            for (cluster, first) in clusters.iter_mut().zip(&first.clusters) {
                resolution.meet(cluster.take_rows_of(first, at)?);
                cluster.close(end);
            }
        }
        Ok(())
    }

    /// Eliminates cluster `c` at all control points, where the links `own` below its apex have
    /// been.
    fn eliminate_cluster(
        &mut self,
        c: usize,
        own: Range<usize>,
        points: &ControlPoints,
    ) -> Result<(), Fault> {
        let Self { tree, points: all, x, .. } = self;
        for (j, LoopPoint { at, loops }) in all.iter_mut().enumerate().skip(1) {
            tree.write_factors(own.clone(), j, at);
            let Loops { tree: pairs, clusters, home, column_of, .. } = loops;
            let (links, q) = (at.at_links(), points.q(j));
            let maps = Maps::Sweeps(links);
            let placed = RowPlace { tree: pairs, maps, home, column_of, q, next: true, step: None };
            let cluster = &mut clusters[c];
            for &k in &cluster.paths.columns {
                x[k] = tree.side(j, k);
            }
            cluster.eliminate(placed, links, x)?;
            if let Some(apex) = cluster.apex() {
                tree.change_sums(apex, j, |sums| cluster.relieve(sums));
            }
        }
        Ok(())
    }

    /// Adds what the multipliers of cluster `c` do, now that the motion of its apex is known.
    fn release_cluster(&mut self, c: usize) {
        let Self { tree, points, x, .. } = self;
        for (j, LoopPoint { loops, .. }) in points.iter_mut().enumerate().skip(1) {
            let cluster = &mut loops.clusters[c];
            let twist = cluster.apex().map(|apex| tree.twist(apex, j));
            for &k in &cluster.paths.columns {
                x[k] = tree.side(j, k);
            }
            cluster.release(twist.as_ref(), x);
            for &k in &cluster.paths.columns {
                tree.put_side(j, k, x[k]);
            }
        }
    }

    /// One sweep to the root and one back, clusters at their apexes.
    fn solve(&mut self, points: &ControlPoints) -> Result<(), Fault> {
        let count = self.points[0].loops.clusters.len();
        let mut rest = self.points[0].loops.home.len(); // links that are not eliminated yet
        self.tree.release_links();
        for c in 0..count {
            let first = self.first_below(c);
            self.tree.eliminate(first..rest)?;
            self.eliminate_cluster(c, first..rest, points)?;
            rest = first;
        }
        self.tree.eliminate(0..rest)?;
        let mut done = 0;
        for c in (0..count).rev() {
            let first = self.first_below(c);
            self.tree.substitute(done..first);
            done = first;
            self.release_cluster(c);
        }
        self.tree.substitute(done..self.points[0].loops.home.len());
        Ok(())
    }

    /// The first link behind the apex of cluster `c`.
    fn first_below(&self, c: usize) -> usize {
        self.points[0].loops.clusters[c].apex().map_or(0, |apex| apex + 1)
    }
}

impl<T: Register> Sweeps for LoopSweeps<T> {
    fn dof(&self) -> usize {
        self.dependent.len()
    }

    fn blocks(&self) -> &[UnknownBlock] {
        &self.points[0].loops.blocks
    }

    fn noise(&self) -> f64 {
        self.resolution.noise()
    }

    fn open(
        &mut self,
        system: &impl MechanicalSystem,
        points: &mut ControlPoints,
        step: SubStep,
        state: &State,
    ) {
        self.tree.open(system, points, step, state);
        points.open(step, state);
        let Self { points: own, dependent, fresh, none, .. } = self;
        let (first, rest) = own.split_at_mut(1);
        let LoopPoint { at, loops } = &mut first[0];
        at.open([&state.q, none, none]);
        loops.begin(Maps::Sweeps(at.at_links()), &state.q, &state.memory);
        dependent.fill(false);
        let unknowns = loops.clusters.iter().flat_map(Cluster::dependent);
        unknowns.for_each(|unknown| dependent[unknown] = true);
        for own in rest {
            let clusters = own.loops.clusters.iter_mut();
            clusters.for_each(|cluster| cluster.pivot_in(dependent, loops.weights()));
        }
        *fresh = true;
    }

    fn residual(
        &mut self,
        system: &impl MechanicalSystem,
        points: &mut ControlPoints,
        u: &[f64],
        r: &mut [f64],
        _anew: bool,
    ) -> Result<(), Fault> {
        self.settle(system, points, u)?;
        self.tree.stand();
        for (j, own) in self.points.iter_mut().enumerate().skip(1) {
            self.tree.write_joints(j, &mut own.at);
        }
        self.close_loops(points, u)?;
        self.tree.write_balances(r);
        let (h, d) = (points.h(), self.dof());
        for (i, r) in r.chunks_exact_mut(d).enumerate() {
            self.points[i].loops.clusters.iter().for_each(|cluster| cluster.project_balance(r));
            let clusters = &self.points[i + 1].loops.clusters;
            clusters.iter().for_each(|cluster| cluster.put_gaps(h, r));
        }
        Ok(())
    }

    fn settle(
        &mut self,
        system: &impl MechanicalSystem,
        points: &mut ControlPoints,
        u: &[f64],
    ) -> Result<(), Fault> {
        self.tree.settle(system, points, u)?;
        self.tree.write_points(points);
        Ok(())
    }

    fn correction(
        &mut self,
        points: &ControlPoints,
        _u: &[f64],
        du: &mut [f64],
    ) -> Result<(), Fault> {
        let (h, d) = (points.h(), self.dof());
        for (own, r) in self.points[1..].iter_mut().zip(du.chunks_exact_mut(d)) {
            own.loops.clusters.iter_mut().try_for_each(|cluster| cluster.split(h, r))?;
        }
        self.tree.take_sides(du);
        self.solve(points)?;
        self.tree.write_corrections(du);
        if du.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(Fault::SingularTangent) }
    }

    fn close(&mut self, _: &impl MechanicalSystem, points: &mut ControlPoints, p: &mut [f64]) {
        self.tree.write_momenta(points, p);
        points.step_mut().close();
    }

    fn remember(&self, memory: &mut Memory) {
        if let Some(last) = self.points.last() {
            last.loops.remember(memory);
        }
    }

    fn write_increments(&self, points: &mut ControlPoints) {
        self.tree.write_increments(points);
    }

    fn compose(&self, first: &[f64], u: &mut [f64]) {
        self.tree.compose(first, u);
    }

    fn clean(&mut self, t: f64, q: &mut [f64]) {
        self.tree.clean(t, q);
    }
}
