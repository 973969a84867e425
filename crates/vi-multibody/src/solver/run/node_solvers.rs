//! The solvers that nodes of a mechanism are read with.

use super::nodal::descriptor;
use super::start::IndependentLoops;
use super::structure::{Solver, probe, takes_descriptor};
use crate::mechanism::Mechanism;
use crate::output::tree_multipliers::TreeMultipliers;
use crate::solver::beside::{SideBySide, Subsystem, shares};
use crate::solver::body_blocks::couples_bodies;
use crate::solver::closed_loop::loop_rank::LoopRank;
use crate::solver::closed_loop::velocity::LoopVelocity;
use crate::solver::closed_loop::{LoopNodal, TreeSolver};
use crate::solver::sparse_nodal::SparseNodal;
use crate::solver::tree_map::TreeMap;
use crate::solver::tree_nodal::TreeNodal;
use crate::solver::tree_step::velocity::TreeVelocity;
use std::sync::Arc;
use vi_constraints::node_solvers::{NodalVelocity, NodeSolvers, RateOperators};
use vi_constraints::reparametrization::Emission;
use vi_constraints::{Constraints, DenseNodal, InitialValues};
use vi_core::sparse::Entries;
use vi_core::{MechanicalSystem, SeparableSystem};

/// How the nodes of a mechanism are read. The potential has no part in it; loops need the `memory`
/// of the nodal and the reduced scheme.
///
/// | mechanism | `v̂` | `λ` |
/// |---|---|---|
/// | tree of bodies | sweeps over the links, `O(N)` | sweep, `O(N)` |
/// | tree with elements | sparse or descriptor form | sweep, `O(N)` |
/// | tree of point masses | dense up to 12 degrees of freedom, then descriptor form | saddle point |
/// | bodies beside point masses | as the ones and as the others | saddle point |
/// | closed loops of bodies | sweeps of their tree + small complement | saddle point |
/// | loops of bars | saddle point | saddle point |
pub(super) fn node_solvers(
    mechanism: &Arc<Mechanism>,
    system: &SeparableSystem,
    solver: Solver,
    loops: &IndependentLoops,
    memory: bool,
    at: InitialValues<'_>,
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
    let s = probe(mechanism, system);
    let mass = |out: &mut dyn Entries| system.emit_mass_of_step(s.start(), s.h, out);
    let rank = loops.rank.as_ref();
    let whole = NodeSubject { mechanism, mass: &mass, solver, rank, memory, q: at.q };
    let operators = match shares(mechanism) {
        Some(shares) => beside(&whole, shares),
        None => operators(&whole),
    };
    if let Some(operators) = operators {
        found.velocity = Some(Box::new(NodalVelocity::new(n, operators)));
    }
    found
}

/// What the operators are chosen by: a mechanism, or the bodies or the point masses of one.
struct NodeSubject<'a> {
    mechanism: &'a Mechanism,
    mass: &'a Emission<'a>,
    solver: Solver,
    rank: Option<&'a LoopRank>,
    memory: bool,
    q: &'a [f64], // initially
}

type BoxedNodeOperators = Box<dyn RateOperators>;

/// The operators of bodies and point masses side by side: no body shares its mass with a point.
fn beside(whole: &NodeSubject<'_>, shares: [Subsystem; 2]) -> Option<BoxedNodeOperators> {
    let of = |share: &Subsystem, rank| {
        let mass = |out: &mut dyn Entries| share.emit(whole.mass, out);
        let (mechanism, q) = (&*share.mechanism, share.of(whole.q));
        operators(&NodeSubject { mechanism, mass: &mass, rank, q, ..*whole })
    };
    let both = [of(&shares[0], whole.rank)?, of(&shares[1], None)?];
    Some(Box::new(SideBySide::new(shares, both)))
}

/// The operators that `v̂` of a mechanism is found with; `None` where they are not of the nodal
/// scheme.
fn operators(of: &NodeSubject<'_>) -> Option<BoxedNodeOperators> {
    let NodeSubject { mechanism, mass, solver, rank, memory, q } = *of;
    let n = mechanism.dim();
    let particles = !mechanism.description().particles.is_empty();
    let sweeps = (!particles && !couples_bodies(mass)).then(|| TreeNodal::new(mechanism.tree()));
    let sweeps = sweeps.flatten();
    let sparse = || {
        let operators = SparseNodal::new(mechanism);
        let screws = mechanism.has_nodes() && solver.is_sparse(mechanism);
        if screws { operators.for_elements(q) } else { operators }
    };
    if mechanism.has_loops() {
        let rank = rank.filter(|_| memory && mechanism.cut_bars().is_empty())?;
        let tree = match sweeps {
            Some(sweeps) => TreeSolver::Sweeps(Box::new(sweeps)),
            None if rank.is_singular() => TreeSolver::Sparse(Box::new(SparseNodal::new(mechanism))),
            None => TreeSolver::Sparse(Box::new(sparse())),
        };
        return Some(Box::new(LoopNodal::new(mechanism, rank, tree)));
    }
    if let Some(sweeps) = sweeps {
        return Some(Box::new(sweeps));
    }
    if !solver.is_sparse(mechanism) {
        return Some(Box::new(DenseNodal::new(n, TreeMap::new(mechanism))));
    }
    if takes_descriptor(mechanism) {
        return Some(Box::new(descriptor(mechanism, mechanism.has_nodes(), q)));
    }
    Some(Box::new(sparse()))
}
