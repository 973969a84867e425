//! The Galerkin schemes on a mechanism.

use super::start::IndependentLoops;
use super::structure::{BoxedScheme, Solver, has_many_ancestors};
use crate::mechanism::Mechanism;
use crate::solver::body_blocks::couples_bodies;
use crate::solver::closed_loop::control_points::LoopSweeps;
use crate::solver::closed_loop::loop_rank::LoopRank;
use crate::solver::sparse_nodal::control_points::CoupledSweeps;
use crate::solver::tree_map::TreeMap;
use crate::solver::tree_sweeps::TreeSweeps;
use vi_constraints::galerkin::{DenseControlPoints, GalerkinConstrained, GalerkinNodal, Pointwise};
use vi_constraints::integrator::{SetupError, SingularStart, check_dense};
use vi_constraints::{Constraints, OrderMethod, SchemeKind};
use vi_core::galerkin::Stages;
#[cfg(target_arch = "x86_64")]
use vi_core::lanes::Wide;
use vi_core::lanes::{Lanes, Plain, Register, Twice};
use vi_core::sparse::Entries;
use vi_core::{MechanicalSystem, SeparableSystem};

const OTHER_LOOPS: &str =
    "closed loops of beams or point masses by the scheme `nodal`, but by `constrained`";

/// The Galerkin schemes: trees of bodies and point masses in nodal form, any mechanism of these in
/// constrained form.
pub(super) fn galerkin(
    mechanism: &Mechanism,
    system: &SeparableSystem,
    (kind, method): (SchemeKind, OrderMethod),
    solver: Solver,
    (loops, q): (&IndependentLoops, &[f64]),
) -> Result<BoxedScheme, SetupError> {
    let refused = |what| Err(SetupError::no_galerkin(what));
    let constrained_only = |what| {
        let instead = "write scheme = \"constrained\", or method = \"composition\"";
        Err(SetupError::NoGalerkin { what, instead })
    };
    let Some(stages) = method.stages() else { return refused("without control points") };
    let (n, m) = (mechanism.dim(), mechanism.len());
    let points = mechanism.particle_tree().dof() > 0;
    let bodies = || {
        let mass = |out: &mut dyn Entries| system.mass().emit(out);
        mechanism.description().particles.is_empty() && !couples_bodies(&mass)
    };
    match kind {
        SchemeKind::Constrained => {
            Ok(Box::new(GalerkinConstrained::new(n, m, loops.rows.clone(), stages)))
        }
        SchemeKind::Dalembert => refused("by the scheme `dalembert`"),
        SchemeKind::Reduced => refused("by the scheme `reduced`"),
        SchemeKind::Nodal if mechanism.has_loops() => match &loops.rank {
            Some(rank) if !mechanism.has_nodes() && bodies() => {
                if rank.is_singular() {
                    return Err(loops.refusal(SingularStart::Scheme));
                }
                match in_lanes(mechanism, system, Some(rank), stages) {
                    Some(scheme) => Ok(scheme),
                    None => constrained_only(OTHER_LOOPS),
                }
            }
            _ => constrained_only(OTHER_LOOPS),
        },
        SchemeKind::Nodal if mechanism.has_nodes() && points => constrained_only(
            "beams beside point masses by the scheme `nodal`, but by `constrained`",
        ),
        SchemeKind::Nodal if mechanism.has_nodes() || solver == Solver::Sparse && !points => {
            if has_many_ancestors(mechanism) {
                // the matrix between the unknowns is full
                let what = "the Galerkin schemes of beams on so many bodies in series";
                check_dense(n, what, "write scheme = \"constrained\"")?;
            }
            let sweeps = CoupledSweeps::new(mechanism, stages, q);
            Ok(Box::new(GalerkinNodal::new(n, stages, sweeps)))
        }
        SchemeKind::Nodal => {
            let sweeps = (solver != Solver::Dense && bodies())
                .then(|| in_lanes(mechanism, system, None, stages))
                .flatten();
            if let Some(sweeps) = sweeps {
                return Ok(sweeps);
            }
            check_dense(
                n,
                "the Galerkin schemes of this system",
                "write method = \"composition\"",
            )?;
            let map = TreeMap::new(mechanism);
            let operators = DenseControlPoints::new(n, stages.count(), map);
            let sweeps = Pointwise::new(n, stages.count(), operators);
            Ok(Box::new(GalerkinNodal::new(n, stages, sweeps)))
        }
    }
}

/// The sweeps of bodies, with or without closed loops of a rank: all control points at once, in the
/// widest registers there are; `None` where the mass matrix is not one of bodies.
fn in_lanes(
    mechanism: &Mechanism,
    system: &SeparableSystem,
    rank: Option<&LoopRank>,
    stages: Stages,
) -> Option<BoxedScheme> {
    #[cfg(target_arch = "x86_64")]
    if let Some(wide) = Wide::detect() {
        return in_enough(wide, mechanism, system, rank, stages);
    }
    in_enough(Plain, mechanism, system, rank, stages)
}

/// The same in four or eight lanes.
fn in_enough<T: Register>(
    lanes: T,
    mechanism: &Mechanism,
    system: &SeparableSystem,
    rank: Option<&LoopRank>,
    stages: Stages,
) -> Option<BoxedScheme> {
    match stages.count() <= T::Lanes::COUNT {
        true => sweeps(lanes, mechanism, system, rank, stages),
        false => sweeps(Twice(lanes), mechanism, system, rank, stages),
    }
}

/// The same in lanes of one kind.
fn sweeps<T: Register>(
    lanes: T,
    mechanism: &Mechanism,
    system: &SeparableSystem,
    rank: Option<&LoopRank>,
    stages: Stages,
) -> Option<BoxedScheme> {
    let n = mechanism.dim();
    let Some(rank) = rank else {
        let sweeps = TreeSweeps::new(lanes, mechanism, system, stages)?;
        return Some(Box::new(GalerkinNodal::new(n, stages, sweeps)));
    };
    let sweeps = LoopSweeps::new(lanes, mechanism, system, rank, stages)?;
    Some(Box::new(GalerkinNodal::new(n, stages, sweeps)))
}
