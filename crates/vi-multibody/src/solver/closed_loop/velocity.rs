//! The velocity of a momentum on closed loops, by the sweeps of a step.
//!
//! ```text
//! v̂ = P ν,   J ν = −∂g/∂t,   Zᵀ (PᵀMP ν − Pᵀp) = 0,   Z = null J                         (16)
//! ```
//! As in [`crate::solver::tree_step::velocity`], with the loops of [`super::step`] on top.

use super::cluster::Cluster;
use super::loop_rank::LoopRank;
use super::loops::Loops;
use super::path::Maps;
use crate::mechanism::Mechanism;
use crate::solver::enforced::Enforced;
use crate::solver::tree_step::velocity::TreeVelocity;
use vi_constraints::node_solvers::MomentumVelocity;
use vi_constraints::reparametrization::Emission;
use vi_core::linear::Singular;
use vi_core::newton::Fault;
use vi_core::state::Memory;
use vi_core::{Configuration, SeparableSystem};

crate::opaque_debug!(LoopVelocity);

/// [`MomentumVelocity`] of the mechanisms that [`super::step::LoopStep`] applies to.
pub(in crate::solver) struct LoopVelocity {
    tree: TreeVelocity,
    loops: Loops,
}

impl LoopVelocity {
    /// `None` where the sweeps do not apply. The potential has no part in it.
    pub(in crate::solver) fn new(
        mechanism: &Mechanism,
        system: &SeparableSystem,
        rank: &LoopRank,
    ) -> Option<Self> {
        let mut tree = TreeVelocity::new(mechanism, system)?;
        let mut loops = rank.loops(mechanism);
        loops.carry(&mut tree.at);
        Some(Self { tree, loops })
    }

    fn solve(&mut self, at: Configuration<'_>, memory: &Memory, p: &[f64]) -> Result<(), Fault> {
        let Self { tree, loops } = self;
        tree.stand(at.q, p)?; // q_{n+1} = q_n, Pᵀp
        let TreeVelocity { at: links, rest, nu, .. } = tree;
        loops.begin(Maps::Sweeps(links.at_links()), at.q, memory);
        if !loops.clusters.iter_mut().all(Cluster::take_rows_of_basis) {
            loops.choose_rows(Maps::Sweeps(links.at_links()), at.q, rest);
        }
        for cluster in &mut loops.clusters {
            cluster.close_rates(at);
            cluster.project(1.0, nu);
            cluster.split(1.0, nu)?;
        }
        links.release_links();
        loops.solve((links, &[], Enforced::Node(at.q)), rest, nu) // ν
    }
}

impl MomentumVelocity for LoopVelocity {
    fn velocity(
        &mut self,
        _mass: &Emission<'_>,
        at: Configuration<'_>,
        memory: &Memory,
        p: &[f64],
        v: &mut [f64],
    ) -> Result<(), Singular> {
        self.solve(at, memory, p).map_err(|_| Singular)?;
        self.tree.push_forward(at.q, v)
    }
}
