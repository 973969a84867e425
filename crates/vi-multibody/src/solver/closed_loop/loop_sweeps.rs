//! Loops on the sweeps of a tree: one sweep to the root and one back, clusters at their apexes.

use super::cluster::Cluster;
use super::cluster_link::ClusterLink;
use super::loop_rank::LoopRank;
use super::loops::Loops;
use super::path::{Maps, Placed};
use super::step_complement::StepComplement;
use crate::geometry::matrix::Spatial;
use crate::geometry::one_tree::Held;
use crate::mechanism::Mechanism;
use crate::solver::tree_step::part::Links;
use crate::solver::tree_step::workspace::Workspace;
use vi_core::newton::Fault;
use vi_core::state::Memory;

/// The loops of a mechanism with the complements of their clusters.
pub(super) struct LoopSweeps {
    pub(super) loops: Loops,
    complements: Vec<StepComplement>, // of the clusters
    initial: Memory,                  // before the first step
}

impl LoopSweeps {
    /// On the sweeps `at` of the tree; `None` where the initial configuration is singular.
    pub(super) fn new(mechanism: &Mechanism, rank: &LoopRank, at: &mut Workspace) -> Option<Self> {
        if rank.is_singular() {
            return None;
        }
        let mut loops = rank.loops(mechanism);
        let Loops { tree, clusters, home, .. } = &mut loops;
        clusters.iter_mut().for_each(|own| own.paths.compact_rows((tree, home), at.at_links()));
        let mut links = loops.clusters.iter().flat_map(|cluster| &cluster.paths.links);
        let turns = |own: &ClusterLink| {
            let kind = mechanism.tree().links()[own.link].joint.kind;
            kind.rotation_vector().is_some()
        };
        at.carry_loops(loops.clusters.iter().filter_map(Cluster::apex), links.any(turns));
        let complement = |cluster: &Cluster| StepComplement::new(&cluster.paths, cluster.rank());
        let complements = loops.clusters.iter().map(complement).collect();
        let mut initial = Memory::default();
        loops.remember(&mut initial);
        Some(Self { loops, complements, initial })
    }

    /// `U` at `q_n`, with the links at hand and the `memory` of the state.
    pub(super) fn begin(&mut self, links: Links<'_>, q: &[f64], memory: &Memory) {
        let memory = if memory.indices.is_empty() { &self.initial } else { memory };
        self.loops.begin(Maps::Sweeps(links), q, memory);
    }

    /// Solves at the increments `u`, with what is `added` to the blocks of the links, and rows at
    /// `q`: `x` is `−h` times the right-hand side, then `δ`.
    pub(super) fn solve(
        &mut self,
        (at, added, q): (&mut Workspace, &[Spatial<Held>], &[f64]),
        u: &[f64],
        x: &mut [f64],
    ) -> Result<(), Fault> {
        let Self { loops, complements, .. } = self;
        let Loops { tree, clusters, home, column_of, .. } = loops;
        let after = |apex: Option<usize>| apex.map_or(0, |apex| apex + 1);
        let mut rest = home.len(); // links that are not eliminated yet
        for (cluster, complement) in clusters.iter_mut().zip(&mut *complements) {
            let apex = cluster.apex();
            at.eliminate(after(apex)..rest, added, x)?;
            rest = after(apex);
            let links = at.at_links();
            let maps = Maps::Sweeps(links);
            let placed = Placed { tree, maps, home, column_of, q, next: true };
            complement.eliminate(cluster.rows(), (placed, links), x)?;
            if let Some(apex) = apex {
                complement.relieve(apex, at);
            }
        }
        at.eliminate(0..rest, added, x)?;
        let mut done = 0;
        for (cluster, complement) in clusters.iter().zip(complements).rev() {
            at.substitute(done..after(cluster.apex()), u, x);
            done = after(cluster.apex());
            let twist = cluster.apex().map(|apex| at.twist(apex));
            complement.release(&cluster.paths, twist.as_ref(), x);
        }
        at.substitute(done..home.len(), u, x);
        Ok(())
    }
}
