//! The sweeps of the Galerkin scheme on closed loops of bodies.
//!
//! ```text
//! Z_i = null Ĝ_i,   Ĝ_i = G_c(q_i) P_tree(q_i),     Z_iᵀ P_treeᵀ w_i = 0,   g_c(q_j) = 0                 [2.35]
//! ρ_j = h Σ_i (K̂⁻¹)_ji Z_iᵀ P_treeᵀ w_i,            [A_j  −Ĝ_jᵀ; Ĝ_j  0] [δ_j; μ] = [ρ_j; g_c(q_j)]
//! ```
//! `Z_i` stands in the same independent unknowns at all control points of a step, so that it
//! changes little between them: the balance is `P_treeᵀ w_i` less the combination of the rows of
//! `Ĝ_i` that vanishes in the dependent ones, whose places are taken by `g_c`. One set of loops for
//! each control point; letters and elimination are those of [`super`].

use super::cluster::Cluster;
use super::loop_rank::LoopRank;
use super::loops::Loops;
use super::path::{Maps, Placed};
use super::sweep::Resolution;
use crate::mechanism::Mechanism;
use vi_constraints::Constraints;
use vi_constraints::galerkin::Sweeps;
use vi_constraints::galerkin::control_points::ControlPoints;
use vi_constraints::galerkin::sweeps::mix;
use vi_constraints::scheme::SubStep;
use vi_core::galerkin::Stages;
use vi_core::linear::norm_inf;
use vi_core::mechanical_system::MechanicalSystem;
use vi_core::newton::{Block, Fault};
use vi_core::sparse::Entries;
use vi_core::state::{Memory, State};

crate::opaque_debug!(LoopSweeps);

/// Increments below which round-off is no correction ([`super::with_floors`]).
const SMALLEST_REACH: f64 = 1e-5;

/// [`Sweeps`] of a mechanism with closed loops whose bodies no potential has to couple.
pub struct LoopSweeps {
    loops: Vec<Loops>, // s + 1  at the control points
    initial: Memory,   // before the first step
    dependent: Vec<bool>,
    fresh: bool,            // rows not chosen yet in this step
    resolution: Resolution, // of the last residual
    w: Vec<f64>,            // n  balance of a control point
    r: Vec<f64>,            // s d  residual, while corrections are made of it
}

impl LoopSweeps {
    /// For a mechanism with cut joints, and the generic rank of its loop constraints.
    #[must_use]
    pub fn new(mechanism: &Mechanism, rank: &LoopRank, stages: Stages) -> Self {
        let s = stages.count();
        let loops: Vec<Loops> = (0..=s).map(|_| rank.loops(mechanism)).collect();
        let mut initial = Memory::default();
        loops[0].remember(&mut initial);
        let d = loops[0].dof();
        let (dependent, fresh, resolution) = (vec![false; d], true, Resolution::full());
        let (w, r) = (vec![0.0; mechanism.dim()], vec![0.0; s * d]);
        Self { loops, initial, dependent, fresh, resolution, w, r }
    }

    /// The velocity maps at the control points: `P(q_j)` and `∂F_d/∂u`.
    fn take_maps(&mut self, points: &ControlPoints, u: &[f64]) {
        for (j, u) in u.chunks_exact(self.dependent.len()).enumerate() {
            let (tree, q) = (&mut self.loops[j + 1].tree, points.q(j + 1));
            tree.begin_at(q, None);
            tree.tangent(u, q);
        }
    }

    /// `Ĝ_j` with the rows that are enforced in this step, `g_c(q_j)`, and `A_j` of the emitted
    /// mass.
    fn close_loops(
        &mut self,
        points: &ControlPoints,
        mass: &dyn Fn(&mut dyn Entries),
        u: &[f64],
    ) -> Result<(), Fault> {
        let Self { loops, fresh, resolution, .. } = self;
        let s = points.stages();
        if std::mem::take(fresh) {
            let (first, rest) = loops.split_at_mut(1);
            let reach = norm_inf(u).max(SMALLEST_REACH);
            let Loops { tree, home, column_of, .. } = &rest[s - 1];
            let at = Placed {
                tree,
                maps: Maps::Recursion,
                home,
                column_of,
                q: points.q(s),
                next: false,
            };
            first[0].clusters.iter_mut().for_each(|cluster| _ = cluster.choose_rows(at, reach));
        }
        *resolution = Resolution::full();
        let (first, rest) = loops.split_at_mut(1);
        for (j, own) in (1..).zip(rest) {
            let end = points.point(j).end();
            let q = end.q;
            let Loops { tree, clusters, home, column_of, .. } = own;
            let at = Placed { tree, maps: Maps::Recursion, home, column_of, q, next: false };
            for (cluster, first) in clusters.iter_mut().zip(&first[0].clusters) {
                resolution.meet(cluster.take_rows_of(first, at)?);
                cluster.close(end);
            }
            tree.assemble_between(mass, q, q);
        }
        Ok(())
    }

    /// `q_j = F_d(u_j, q_n)`.
    fn move_to(&mut self, points: &mut ControlPoints, u: &[f64]) -> Result<(), Fault> {
        for (j, u) in u.chunks_exact(self.dependent.len()).enumerate() {
            self.loops[j + 1].tree.move_to(u, points.point_mut(j + 1))?;
        }
        Ok(())
    }
}

impl Sweeps for LoopSweeps {
    fn dof(&self) -> usize {
        self.dependent.len()
    }

    fn blocks(&self) -> &[Block] {
        &self.loops[0].blocks
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
        let Self { loops, initial, dependent, fresh, .. } = self;
        let memory = if state.memory.indices.is_empty() { initial } else { &state.memory };
        let (first, rest) = loops.split_at_mut(1);
        let first = &mut first[0];
        first.tree.begin_at(&state.q, None);
        first.begin(Maps::Recursion, &state.q, memory);
        dependent.fill(false);
        let unknowns = first.clusters.iter().flat_map(Cluster::dependent);
        unknowns.for_each(|unknown| dependent[unknown] = true);
        for own in rest {
            let weights = first.weights();
            own.clusters.iter_mut().for_each(|cluster| cluster.pivot_in(dependent, weights));
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
        self.take_maps(points, u);
        self.close_loops(points, &|out| system.mass().emit(out), u)?;
        points.evaluate(system);
        let (h, d) = (points.h(), self.dof());
        for (i, r) in r.chunks_exact_mut(d).enumerate() {
            points.balance(system, i, &mut self.w);
            let own = &mut self.loops[i];
            own.tree.pull_back_at(points.q(i), &self.w, r);
            own.clusters.iter().for_each(|cluster| cluster.project_balance(r));
            self.loops[i + 1].clusters.iter().for_each(|cluster| cluster.put_gaps(h, r));
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
        _u: &[f64],
        du: &mut [f64],
    ) -> Result<(), Fault> {
        let Self { loops, r, dependent, .. } = self;
        let (h, d) = (points.h(), dependent.len());
        for (own, r) in loops[1..].iter_mut().zip(du.chunks_exact_mut(d)) {
            own.clusters.iter_mut().try_for_each(|cluster| cluster.split(h, r))?;
        }
        r.copy_from_slice(du);
        for (j, du) in du.chunks_exact_mut(d).enumerate() {
            mix(|i| h * points.constants().K_hat_inverse[(j, i)], r, du);
            loops[j + 1].solve_by_sweeps(points.q(j + 1), du)?;
        }
        if du.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(Fault::SingularTangent) }
    }

    fn remember(&self, memory: &mut Memory) {
        self.loops[self.loops.len() - 1].remember(memory);
    }

    fn compose(&self, first: &[f64], u: &mut [f64]) {
        self.loops[0].tree.tree().compose(first, u);
    }

    fn clean(&mut self, _t: f64, q: &mut [f64]) {
        self.loops[0].tree.tree().clean(q);
    }
}
