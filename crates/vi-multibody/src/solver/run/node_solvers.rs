//! The solvers that nodes of a mechanism are read with.

use super::nodal::descriptor;
use super::start::Loops;
use super::structure::{Solver, probe, takes_descriptor};
use crate::mechanism::Mechanism;
use crate::output::tree_multipliers::TreeMultipliers;
use crate::solver::closed_loop::velocity::LoopVelocity;
use crate::solver::closed_loop::{LoopNodal, TreeSolver};
use crate::solver::sparse_nodal::SparseNodal;
use crate::solver::tree_map::TreeMap;
use crate::solver::tree_nodal::TreeNodal;
use crate::solver::tree_step::velocity::TreeVelocity;
use std::sync::Arc;
use vi_constraints::node_solvers::{NodalVelocity, NodeSolvers};
use vi_constraints::{Constraints, DenseNodal, InitialValues};
use vi_core::sparse::Entries;
use vi_core::{MechanicalSystem, SeparableSystem};

/// How the nodes of a mechanism are read. The potential has no part in it; loops need the `memory` of the nodal
/// and the reduced scheme.
///
/// | mechanism | `v̂` | `λ` |
/// |---|---|---|
/// | tree of bodies | sweeps of a step or articulated recursion, `O(N)` | sweep, `O(N)` |
/// | tree with elements | sparse or descriptor form | sweep, `O(N)` |
/// | tree with point masses | dense up to 12 degrees of freedom, then descriptor form | saddle point |
/// | closed loops of bodies | sweeps of a step with loops, or their tree + small complement | saddle point |
/// | loops of bars, loops beside point masses | saddle point | saddle point |
pub(super) fn node_solvers(
    mechanism: &Arc<Mechanism>,
    system: &SeparableSystem,
    solver: Solver,
    (loops, memory, at): (&Loops, bool, InitialValues<'_>),
) -> NodeSolvers {
    let n = mechanism.dim();
    let particles = !mechanism.description().particles.is_empty();
    let mut found = NodeSolvers::default();
    if let Some(sweep) = TreeMultipliers::new(mechanism) {
        found.multipliers = Some(Box::new(sweep));
    }
    if !particles
        && !mechanism.has_loops()
        && let Some(sweeps) = TreeVelocity::new(mechanism, system)
    {
        found.velocity = Some(Box::new(sweeps));
        return found;
    }
    if memory
        && !particles
        && let Some(rank) = &loops.rank
        && let Some(sweeps) = LoopVelocity::new(mechanism, system, rank)
    {
        found.velocity = Some(Box::new(sweeps));
        return found;
    }
    let mut recursion = TreeNodal::new(mechanism.tree().clone());
    let s = probe(mechanism, system);
    let mass = |out: &mut dyn Entries| system.emit_mass_of_step(s.start(), s.h, out);
    let uncoupled = !particles && recursion.is_uncoupled(&mass, &s);
    let sparse = || {
        let operators = SparseNodal::new(mechanism);
        let screws = mechanism.has_nodes() && solver.is_sparse(mechanism);
        if screws { operators.for_elements(at.q) } else { operators }
    };
    found.velocity = match &loops.rank {
        Some(rank) if memory => {
            let tree = match uncoupled {
                true => TreeSolver::Recursion,
                false if rank.is_singular() => {
                    TreeSolver::Sparse(Box::new(SparseNodal::new(mechanism)))
                }
                false => TreeSolver::Sparse(Box::new(sparse())),
            };
            Some(Box::new(NodalVelocity::new(n, LoopNodal::new(mechanism, rank, tree))))
        }
        None if !mechanism.has_loops() && uncoupled => {
            Some(Box::new(NodalVelocity::new(n, recursion)))
        }
        None if !mechanism.has_loops()
            && solver.is_sparse(mechanism)
            && takes_descriptor(mechanism) =>
        {
            let operators = descriptor(mechanism, mechanism.has_nodes(), at.q);
            Some(Box::new(NodalVelocity::new(n, operators)))
        }
        None if !mechanism.has_loops() && solver.is_sparse(mechanism) => {
            Some(Box::new(NodalVelocity::new(n, sparse())))
        }
        None if !mechanism.has_loops() => {
            let operators = DenseNodal::new(n, TreeMap::new(mechanism));
            Some(Box::new(NodalVelocity::new(n, operators)))
        }
        _ => None,
    };
    found
}
