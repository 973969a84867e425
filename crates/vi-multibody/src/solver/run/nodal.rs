//! The nodal and the reduced scheme on a mechanism.

use super::start::Loops;
use super::structure::{BoxedScheme, Solver, probe, takes_descriptor};
use crate::mechanism::Mechanism;
use crate::solver::closed_loop::step::LoopStep;
use crate::solver::closed_loop::{LoopNodal, TreeSolver};
use crate::solver::sparse_nodal::SparseNodal;
use crate::solver::tree_descriptor::TreeDescriptor;
use crate::solver::tree_map::TreeMap;
use crate::solver::tree_nodal::TreeNodal;
use crate::solver::tree_step::TreeStep;
use std::sync::Arc;
use vi_constraints::integrator::{SetupError, check_dense};
use vi_constraints::nodal::Nodal;
use vi_constraints::{Constraints, DenseNodal, InitialValues, Options, SchemeKind, TangentSpace};
use vi_core::{MechanicalSystem, SeparableSystem};

const LOOPS_BESIDE_POINTS: &str = "loops of bars, or loops beside point masses, in the nodal form";

pub(super) fn nodal(
    mechanism: &Arc<Mechanism>,
    system: &SeparableSystem,
    options: &Options,
    solver: Solver,
    (loops, at): (&Loops, InitialValues<'_>),
) -> Result<BoxedScheme, SetupError> {
    let (n, reduced) = (mechanism.dim(), options.scheme == SchemeKind::Reduced);
    let particles = !mechanism.description().particles.is_empty();
    if mechanism.has_loops() && particles {
        check_dense(n, LOOPS_BESIDE_POINTS, "write scheme = \"constrained\"")?;
        let operators = TangentSpace::new(mechanism.clone(), &loops.rows);
        return Ok(Box::new(Nodal::new(n, operators, reduced)));
    }
    let elements = mechanism.has_nodes();
    let sparse = solver.is_sparse(mechanism);
    let dense = || check_dense(n, "the solver `dense`", "write solver = \"auto\"");
    let by_sweeps = !particles && !reduced && !matches!(solver, Solver::Dense | Solver::Sparse);
    if by_sweeps {
        let step: Option<BoxedScheme> = match &loops.rank {
            Some(rank) => LoopStep::new(mechanism, system, rank).map(|step| Box::new(step) as _),
            None => TreeStep::new(mechanism, system).map(|step| Box::new(step) as _),
        };
        if let Some(step) = step {
            return Ok(step);
        }
    }
    let mut recursion = TreeNodal::new(mechanism.tree().clone());
    let s = probe(mechanism, system);
    let uncoupled = !particles && recursion.applies(system, &s);
    if let Some(rank) = &loops.rank {
        if !uncoupled {
            let what = "springs between the bodies of so many closed loops";
            check_dense(rank.generic, what, "write scheme = \"constrained\"")?;
            if !sparse {
                dense()?;
            }
        }
        let tree = match (uncoupled, sparse) {
            (true, _) => TreeSolver::Recursion,
            (_, false) => TreeSolver::Dense(Box::new(DenseNodal::new(n, TreeMap::new(mechanism)))),
            // the rates of a departure are those of increments, not of screws
            _ if elements && !rank.is_singular() => {
                let operators = SparseNodal::new(mechanism).for_elements(at.q);
                TreeSolver::Sparse(Box::new(operators.in_flight(mechanism, system.mass())))
            }
            _ => TreeSolver::Sparse(Box::new(SparseNodal::new(mechanism))),
        };
        let operators = LoopNodal::new(mechanism, rank, tree);
        if !rank.is_singular() {
            return Ok(Box::new(Nodal::new(n, operators, reduced)));
        }
        let departure = rank.departure(mechanism, at)?;
        let operators = operators.leaving_along(&departure.null_space);
        let nodal = Nodal::new(n, operators, reduced);
        return Ok(Box::new(nodal.starting_with(departure.rates)));
    }
    let by_recursion = !matches!(solver, Solver::Dense | Solver::Sparse);
    let mut applies_near = || !particles && !elements && recursion.applies_near(system, &s);
    if by_recursion && (uncoupled || applies_near()) {
        return Ok(Box::new(Nodal::new(n, recursion, reduced)));
    }
    if !sparse {
        dense()?;
        let operators = DenseNodal::new(n, TreeMap::new(mechanism));
        let operators = if elements { operators } else { operators.closing() };
        return Ok(Box::new(Nodal::new(n, operators, reduced)));
    }
    if takes_descriptor(mechanism) {
        let operators = descriptor(mechanism, elements, at.q);
        let operators = operators.in_flight(mechanism, system.mass());
        return Ok(Box::new(Nodal::new(n, operators, reduced)));
    }
    let operators = SparseNodal::new(mechanism);
    let operators = if elements { operators.for_elements(at.q) } else { operators };
    let operators = operators.in_flight(mechanism, system.mass());
    Ok(Box::new(Nodal::new(n, operators, reduced)))
}

pub(super) fn descriptor(mechanism: &Mechanism, elements: bool, q: &[f64]) -> TreeDescriptor {
    let operators = TreeDescriptor::new(mechanism);
    if elements { operators.for_elements(q) } else { operators }
}
