//! The sweeps of the Galerkin scheme on closed loops of bodies.
//!
//! ```text
//! Z_i = null Ĝ_i,   Ĝ_i = G_c(q_i) P_tree(q_i),     Z_iᵀ P_treeᵀ w_i = 0,   g_c(q_j) = 0                 [2.35]
//! ρ_j = h Σ_i (K̂⁻¹)_ji Z_iᵀ P_treeᵀ w_i,            [A_j  −Ĝ_jᵀ; Ĝ_j  0] [δ_j; μ] = [ρ_j; g_c(q_j)]
//! ```
//! `Z_i` stands in the same independent unknowns at all control points of a step, so that it
//! changes little between them: the balance is `P_treeᵀ w_i` less the combination of the rows of
//! `Ĝ_i` that vanishes in the dependent ones, whose places are taken by `g_c`. Letters and
//! elimination are those of [`super`]. The tree stands at each control point: with `q_{n+1} = q_n =
//! q_j` its blocks are those of `A_j = P_treeᵀ M P_tree`, and `δu_j = T(u_j)⁻¹` of what the sweeps
//! find.

use super::cluster::Cluster;
use super::loop_rank::LoopRank;
use super::loops::Loops;
use super::path::{Maps, Placed};
use super::sweep::{Resolution, SMALLEST_REACH};
use crate::mechanism::Mechanism;
use crate::solver::tree_step::velocity::TreeVelocity;
use vi_constraints::Constraints;
use vi_constraints::galerkin::Sweeps;
use vi_constraints::galerkin::control_points::ControlPoints;
use vi_constraints::galerkin::sweeps::mix;
use vi_constraints::scheme::SubStep;
use vi_core::SeparableSystem;
use vi_core::galerkin::Stages;
use vi_core::linear::norm_inf;
use vi_core::mechanical_system::MechanicalSystem;
use vi_core::newton::{Block, Fault};
use vi_core::state::{Memory, State};

crate::opaque_debug!(LoopSweeps);

/// [`Sweeps`] of a mechanism with closed loops whose bodies no potential has to couple.
pub struct LoopSweeps {
    points: Vec<Point>, // s + 1  the control points
    dependent: Vec<bool>,
    fresh: bool,            // rows not chosen yet in this step
    resolution: Resolution, // of the last residual
    w: Vec<f64>,            // n  balance of a control point
    r: Vec<f64>,            // s d  residual, while corrections are made of it
}

/// The tree and its loops at a control point.
struct Point {
    tree: TreeVelocity,
    loops: Loops,
}

impl LoopSweeps {
    /// For a mechanism with cut joints, and the generic rank of its loop constraints; `None` where
    /// the sweeps of the tree do not apply.
    #[must_use]
    pub fn new(
        mechanism: &Mechanism,
        system: &SeparableSystem,
        rank: &LoopRank,
        stages: Stages,
    ) -> Option<Self> {
        let s = stages.count();
        let point = || {
            let mut tree = TreeVelocity::new(mechanism, system)?;
            let mut loops = rank.loops(mechanism);
            loops.carry(&mut tree.at);
            Some(Point { tree, loops })
        };
        let points: Vec<Point> = (0..=s).map(|_| point()).collect::<Option<_>>()?;
        let d = points[0].loops.dof();
        let (dependent, fresh, resolution) = (vec![false; d], true, Resolution::full());
        let (w, r) = (vec![0.0; mechanism.dim()], vec![0.0; s * d]);
        Some(Self { points, dependent, fresh, resolution, w, r })
    }

    /// `Ĝ_j` with the rows that are enforced in this step, and `g_c(q_j)`.
    fn close_loops(&mut self, points: &ControlPoints, u: &[f64]) -> Result<(), Fault> {
        let Self { points: own, fresh, resolution, .. } = self;
        let s = points.stages();
        let (first, rest) = own.split_at_mut(1);
        let first = &mut first[0].loops;
        if std::mem::take(fresh) {
            let reach = norm_inf(u).max(SMALLEST_REACH);
            let Point { tree, loops } = &rest[s - 1];
            let at = loops.placed(Maps::Sweeps(tree.at.at_links()), points.q(s));
            first.clusters.iter_mut().for_each(|cluster| _ = cluster.choose_rows(at, reach));
        }
        *resolution = Resolution::full();
        for (j, Point { tree, loops }) in (1..).zip(rest) {
            let end = points.point(j).end();
            let Loops { tree: maps, clusters, home, column_of, .. } = loops;
            let links = Maps::Sweeps(tree.at.at_links());
            let at = Placed { tree: maps, maps: links, home, column_of, q: end.q, next: false };
            for (cluster, first) in clusters.iter_mut().zip(&first.clusters) {
                resolution.meet(cluster.take_rows_of(first, at)?);
                cluster.close(end);
            }
        }
        Ok(())
    }

    /// `q_j = F_d(u_j, q_n)`.
    fn move_to(&mut self, points: &mut ControlPoints, u: &[f64]) -> Result<(), Fault> {
        let at = &mut self.points[0].tree.at;
        for (j, u) in u.chunks_exact(self.dependent.len()).enumerate() {
            at.advance(u, None)?;
            at.close(points.point_mut(j + 1));
        }
        Ok(())
    }
}

impl Sweeps for LoopSweeps {
    fn dof(&self) -> usize {
        self.dependent.len()
    }

    fn blocks(&self) -> &[Block] {
        &self.points[0].loops.blocks
    }

    fn noise(&self) -> f64 {
        self.resolution.noise()
    }

    fn open(
        &mut self,
        _: &impl MechanicalSystem,
        points: &mut ControlPoints,
        step: SubStep,
        state: &State,
    ) {
        points.open(step, state);
        let Self { points: own, dependent, fresh, .. } = self;
        let (first, rest) = own.split_at_mut(1);
        let Point { tree, loops } = &mut first[0];
        tree.open(&state.q);
        loops.begin(Maps::Sweeps(tree.at.at_links()), &state.q, &state.memory);
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
        self.move_to(points, u)?;
        for (j, own) in self.points.iter_mut().enumerate().skip(1) {
            own.tree.rest_at(points.q(j))?;
        }
        self.close_loops(points, u)?;
        points.evaluate(system);
        let (h, d) = (points.h(), self.dof());
        for (i, r) in r.chunks_exact_mut(d).enumerate() {
            points.balance(system, i, &mut self.w);
            let Point { tree, loops } = &mut self.points[i];
            tree.at.pull_back_of(points.q(i), &self.w, r);
            loops.clusters.iter().for_each(|cluster| cluster.project_balance(r));
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
        self.move_to(points, u)?;
        points.evaluate(system);
        Ok(())
    }

    fn correction(
        &mut self,
        points: &ControlPoints,
        u: &[f64],
        du: &mut [f64],
    ) -> Result<(), Fault> {
        let Self { points: own, r, dependent, .. } = self;
        let (h, d) = (points.h(), dependent.len());
        for (own, r) in own[1..].iter_mut().zip(du.chunks_exact_mut(d)) {
            own.loops.clusters.iter_mut().try_for_each(|cluster| cluster.split(h, r))?;
        }
        r.copy_from_slice(du);
        for (j, (du, u)) in du.chunks_exact_mut(d).zip(u.chunks_exact(d)).enumerate() {
            mix(|i| h * points.constants().K_hat_inverse[(j, i)], r, du);
            let Point { tree, loops } = &mut own[j + 1];
            tree.at.release_links();
            loops.solve((&mut tree.at, &[], points.q(j + 1)), u, du)?;
        }
        if du.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(Fault::SingularTangent) }
    }

    fn remember(&self, memory: &mut Memory) {
        if let Some(last) = self.points.last() {
            last.loops.remember(memory);
        }
    }

    fn compose(&self, first: &[f64], u: &mut [f64]) {
        self.points[0].loops.tree.tree().compose(first, u);
    }

    fn clean(&mut self, _t: f64, q: &mut [f64]) {
        self.points[0].loops.tree.tree().clean(q);
    }
}
