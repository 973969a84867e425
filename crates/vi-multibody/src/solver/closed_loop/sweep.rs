//! What a step does to all clusters: their rows at its two ends, the sweeps that pass through their
//! apexes.

use super::cluster::{Cluster, Recall};
use super::cluster_link::ClusterLink;
use super::loops::Loops;
use super::path::{Maps, RowPlace};
use crate::geometry::matrix::Spatial;
use crate::geometry::one_tree::HeldVector;
use crate::solver::enforced::Enforced;
use crate::solver::tree_step::workspace::Workspace;
use nalgebra::DMatrix;
use vi_constraints::null_space::NullSpaceQr;
use vi_core::linear::norm_inf;
use vi_core::newton::{CLOSING_SIZE, Fault};
use vi_core::state::Memory;

/// Increments below which round-off is no correction ([`super::with_floors`]).
pub(super) const SMALLEST_REACH: f64 = 1e-5;

/// What `g_c` is rounded to, in parts of `ε`.
const PARTS: f64 = 8.0;

/// How precisely the loops determine the increments of a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct LoopResolution {
    sigma: f64, // smallest pivot at q_{n+1}
    reach: f64, // largest increment of the first trial
}

impl LoopResolution {
    /// Of a step that has not begun.
    pub(super) fn full() -> Self {
        Self { sigma: 1.0, reach: 1.0 }
    }

    /// Takes up another smallest pivot.
    pub(super) fn meet(&mut self, sigma: f64) {
        self.sigma = self.sigma.min(sigma);
    }

    /// Relative size of the corrections that round-off alone may cause.
    pub(super) fn noise(&self) -> f64 {
        1e-9 / self.sigma.clamp(1e-8, 1.0)
    }

    /// The balance is handed on. A correction of the relative size `s` of increments `u` leaves
    /// `s² |u|/σ` in them, and the rounding of `g_c` is a correction of some `ε/σ`.
    pub(super) fn closing_size(&self) -> f64 {
        let Self { sigma, reach } = self;
        let resolved = CLOSING_SIZE * (sigma / reach).min(1.0).sqrt();
        resolved.max(PARTS * f64::EPSILON / (sigma * reach)).min(self.noise())
    }
}

impl Loops {
    /// The null space of the first node, a singular configuration, is that of the branch, `Z_0`.
    pub(super) fn leave_along(&mut self, null_space: &DMatrix<f64>) {
        let (d, f) = null_space.shape();
        let mut qr = NullSpaceQr::new(d, f);
        qr.factorize(&null_space.transpose());
        let mut range = DMatrix::zeros(d, d - f);
        qr.null_space(f, &mut range);
        self.clusters.iter_mut().for_each(|cluster| cluster.leave_along(&range));
        self.keep_initial();
    }

    /// What the first step finds in the place of a last node.
    pub(super) fn keep_initial(&mut self) {
        let mut initial = std::mem::take(&mut self.initial);
        self.remember(&mut initial);
        self.initial = initial;
    }

    /// Prepares for the sweeps `at` of the tree.
    pub(super) fn carry(&mut self, at: &mut Workspace) {
        let Self { tree, clusters, home, .. } = self;
        clusters.iter_mut().for_each(|own| own.carry(tree, home, at.at_links()));
        let mut links = clusters.iter().flat_map(|cluster| &cluster.paths.links);
        let turns = |own: &ClusterLink| {
            tree.tree().links()[own.link].joint.kind.rotation_vector().is_some()
        };
        at.carry_loops(clusters.iter().filter_map(Cluster::apex), links.any(turns));
    }

    /// What the clusters say of the last node.
    pub(super) fn remember(&self, memory: &mut Memory) {
        memory.indices.clear();
        memory.values.clear();
        self.clusters.iter().for_each(|cluster| cluster.remember(memory));
        // which entries are zero changes along the motion
        memory.indices.reserve(memory.indices.len());
        memory.values.reserve(memory.values.len());
    }

    /// `U` at `q_n`, with the maps of the tree at hand and the `memory` of the state.
    pub(super) fn begin(&mut self, maps: Maps<'_>, q: &[f64], memory: &Memory) {
        let Self { tree, clusters, home, column_of, initial, .. } = self;
        let mut recall = Recall::new(if memory.indices.is_empty() { initial } else { memory });
        let at = RowPlace { tree, maps, home, column_of, q, next: false, step: None };
        clusters.iter_mut().for_each(|cluster| cluster.begin(at, &mut recall));
    }

    /// The rows to enforce, from the first trial `u` of the step and its `q_{n+1}`.
    pub(super) fn choose_rows(&mut self, maps: Maps<'_>, q: &[f64], u: &[f64]) -> LoopResolution {
        let Self { tree, clusters, home, column_of, .. } = self;
        let at = RowPlace { tree, maps, home, column_of, q, next: true, step: None };
        let reach = norm_inf(u).max(SMALLEST_REACH);
        let smallest = clusters.iter_mut().map(|cluster| cluster.choose_rows(at, reach));
        LoopResolution { sigma: smallest.fold(1.0, f64::min), reach }
    }

    /// One sweep to the root and one back, clusters at their apexes. Solves at the increments `u`,
    /// with what is `added` to the blocks of the links, and the rows `enforced`: `x` is the
    /// right-hand side of these blocks, then `δ`.
    pub(super) fn solve(
        &mut self,
        (at, added, enforced): (&mut Workspace, &[Spatial<HeldVector>], Enforced<'_>),
        u: &[f64],
        x: &mut [f64],
    ) -> Result<(), Fault> {
        let Self { tree, clusters, home, column_of, .. } = self;
        let (q, step) = enforced.place();
        let after = |apex: Option<usize>| apex.map_or(0, |apex| apex + 1);
        let mut rest = home.len(); // links that are not eliminated yet
        for cluster in &mut *clusters {
            let first = after(cluster.apex());
            at.eliminate(first..rest, added, x)?;
            rest = first;
            let links = at.at_links();
            let maps = Maps::Sweeps(links);
            let placed = RowPlace { tree, maps, home, column_of, q, next: true, step };
            cluster.eliminate(placed, links, x)?;
            if let Some(sums) = cluster.apex().and_then(|apex| at.sums_mut(apex)) {
                cluster.relieve(sums);
            }
        }
        at.eliminate(0..rest, added, x)?;
        let mut done = 0;
        for cluster in clusters.iter_mut().rev() {
            let apex = cluster.apex();
            at.substitute(done..after(apex), u, x);
            done = after(apex);
            let twist = apex.map(|apex| at.twist(apex));
            cluster.release(twist.as_ref(), x);
        }
        at.substitute(done..home.len(), u, x);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::{Inertia, MechanismBuilder};
    use crate::geometry::matrix::Columns;
    use crate::geometry::one_tree::{Narrow, OneTree};
    use crate::geometry::space::Space;
    use crate::mechanism::Mechanism;
    use crate::pair::PairKind;
    use crate::pair::joint::FrameId;
    use crate::solver::closed_loop::loop_rank::LoopRank;
    use std::sync::Arc;
    use vi_testkit::Sample;

    const SPACE: OneTree<Narrow> = OneTree(Narrow);

    /// A rectangle of hinges on an arm, and another one beside it on the ground.
    fn rectangles() -> Arc<Mechanism> {
        let mut builder = MechanismBuilder::new();
        let inertia = Inertia::principal(1.0, [0.1; 3]);
        let arm = builder.body("arm", inertia).at([0.5, 0.0, 0.0]).id();
        let hinge = builder.joint("arm", PairKind::Revolute, FrameId::Ground, arm);
        hinge.at([0.0; 3]).axis([0.0, 1.0, 0.0]);
        for (carrier, x) in [(arm.into(), 0.5), (FrameId::Ground, 3.0)] {
            let mut bar = |dx: f64, y: f64| builder.body("bar", inertia).at([x + dx, y, 0.0]).id();
            let [left, right, top] = [(-0.2, 0.2), (0.2, 0.2), (0.0, 0.4)].map(|(x, y)| bar(x, y));
            for (parent, child, dx, y) in [
                (carrier, left, -0.2, 0.0),
                (carrier, right, 0.2, 0.0),
                (left.into(), top, -0.2, 0.4),
                (right.into(), top, 0.2, 0.4),
            ] {
                let hinge = builder.joint("hinge", PairKind::Revolute, parent, child);
                hinge.at([x + dx, y, 0.0]).axis([0.0, 0.0, 1.0]);
            }
        }
        Arc::new(builder.build().unwrap().mechanism)
    }

    #[test]
    fn few_and_many_loops_are_solved_alike() {
        let mechanism = rectangles();
        let q = mechanism.initial_configuration();
        let rank = LoopRank::find(&mechanism, 0.0, &q);
        let mut sample = Sample::new(5);
        let side: [f64; 7] = sample.array();
        let mass = |seed: usize| {
            let (m, tilt) = (1.0 + 0.1 * seed as f64, SPACE.vector([0.1, -0.2, 0.3]));
            let diagonal = |m: f64| Columns::multiple(SPACE, m);
            let (la, al) = (Columns::skew(tilt * -1.0), Columns::skew(tilt));
            Spatial { ll: diagonal(m), la, al, aa: diagonal(0.7 * m) }.held()
        };
        let tree = mechanism.tree();
        let blocks: Vec<Spatial<HeldVector>> = (0..tree.links().len()).map(mass).collect();
        let (none, rest) = (vec![0.0; q.len()], vec![0.0; tree.dof()]);
        let [few, many] = [false, true].map(|large| {
            let (mut loops, mut at) = (rank.loops(&mechanism), Workspace::massless(tree).unwrap());
            loops.carry(&mut at);
            if large {
                loops.clusters.iter_mut().for_each(|cluster| cluster.eliminate_as_large());
            }
            at.open([&q, &none, &none]);
            at.advance(&rest, None).unwrap();
            loops.begin(Maps::Sweeps(at.at_links()), &q, &Memory::default());
            let mut x = side.to_vec();
            loops.clusters.iter_mut().for_each(|cluster| cluster.split(1.0, &mut x).unwrap());
            at.release_links();
            loops.solve((&mut at, &blocks, Enforced::Node(&q)), &rest, &mut x).unwrap();
            x
        });
        let apart = few.iter().zip(&many).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("{apart:.1e} apart of {:.1e}", norm_inf(&few));
        assert!(apart < 1e-13 * norm_inf(&few) && norm_inf(&few) > 0.1, "{apart:e}");
    }
}
