//! The nodal and the reduced scheme on a mechanism.

use super::start::IndependentLoops;
use super::structure::{BoxedScheme, Solver, probe, takes_descriptor};
use crate::mechanism::Mechanism;
use crate::solver::beside::{SideBySide, couples, shares};
use crate::solver::body_blocks::couples_bodies;
use crate::solver::closed_loop::loop_rank::{Departure, LoopRank};
use crate::solver::closed_loop::step::LoopStep;
use crate::solver::closed_loop::{LoopNodal, TreeSolver};
use crate::solver::sparse_nodal::SparseNodal;
use crate::solver::tree_descriptor::TreeDescriptor;
use crate::solver::tree_map::TreeMap;
use crate::solver::tree_nodal::TreeNodal;
use crate::solver::tree_step::TreeStep;
use std::sync::Arc;
use vi_constraints::integrator::{SetupError, SingularStart, check_dense};
use vi_constraints::nodal::Nodal;
use vi_constraints::nodal_operators::by_operators;
use vi_constraints::reparametrization::Emission;
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::{
    Constraints, DenseNodal, InitialValues, NodalOperators, Options, SchemeKind, TangentSpace,
};
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::{DiscreteLagrangian, MechanicalSystem, SeparableSystem};

const LOOPS_OF_BARS: &str = "loops of bars in the nodal form";
const LOOPS_BY_DENSE: &str = "loops beside point masses by the solver `dense`";

type BoxedOperators = Box<dyn NodalOperators>;

pub(super) fn nodal(
    mechanism: &Arc<Mechanism>,
    system: &SeparableSystem,
    options: &Options,
    solver: Solver,
    loops: &IndependentLoops,
    at: InitialValues<'_>,
) -> Result<BoxedScheme, SetupError> {
    let (n, reduced) = (mechanism.dim(), options.scheme == SchemeKind::Reduced);
    let particles = !mechanism.description().particles.is_empty();
    let singular = loops.rank.as_ref().filter(|rank| rank.is_singular());
    let departure = singular.map(|rank| rank.departure(mechanism, at)).transpose()?;
    let by_sweeps = !particles && !reduced && solver != Solver::Dense;
    let step: Option<BoxedScheme> = match &loops.rank {
        _ if !by_sweeps => None,
        Some(rank) => LoopStep::new(mechanism, system, rank).map(|step| {
            let step =
                if let Some(departure) = &departure { step.leaving(departure) } else { step };
            Box::new(Nodal::new(step)) as _
        }),
        None if solver == Solver::Sparse => None,
        None => TreeStep::new(mechanism, system).map(|step| Box::new(Nodal::new(step)) as _),
    };
    if let Some(step) = step {
        return Ok(step);
    }
    let s = probe(mechanism, system);
    let mixed = |out: &mut dyn Entries| system.forced_d2_d1(&s, out);
    let (rows, departure) = (&loops.rows, departure.as_ref());
    let whole = StepSubject {
        mechanism,
        mixed: &mixed,
        mass: system.mass(),
        rank: loops.rank.as_ref(),
        rows,
        departure,
        q: at.q,
    };
    let operators = beside(&whole, solver)
        .unwrap_or_else(|| operators(&whole, solver).map(|operators| operators as _))?;
    let mut rates = departure.map(|departure| departure.rates.clone());
    if let Some(rates) = &mut rates {
        rates.resize(operators.dof(), 0.0); // point masses start from u = 0
    }
    Ok(by_operators(options.scheme, n, operators, rates))
}

/// What nodal operators are chosen by: a mechanism, or the bodies or the point masses of one.
struct StepSubject<'a> {
    mechanism: &'a Arc<Mechanism>,
    mixed: &'a Emission<'a>, // D_2(D_1 L_d + f_d^-)  at `s`
    mass: &'a SparseMatrix,
    rank: Option<&'a LoopRank>,
    rows: &'a IndependentRows,
    departure: Option<&'a Departure>,
    q: &'a [f64], // initially
}

/// The operators of bodies and of point masses that no potential couples with them, side by side;
/// `None` where this does not apply or one solver is asked for.
fn beside(whole: &StepSubject<'_>, solver: Solver) -> Option<Result<BoxedOperators, SetupError>> {
    let separate =
        !matches!(solver, Solver::Dense | Solver::Sparse) && !couples(whole.mechanism, whole.mixed);
    let shares = separate.then(|| shares(whole.mechanism)).flatten()?;
    let of = |k: usize| {
        let share = &shares[k];
        let n = share.mechanism.dim();
        let mixed = |out: &mut dyn Entries| share.emit(whole.mixed, out);
        let mass = |out: &mut dyn Entries| whole.mass.emit(out);
        let mass = SparseMatrix::assemble(n, n, |out| share.emit(&mass, out));
        // bodies have all loops but those of bars
        let bodies = k == 0;
        let rows = match bodies {
            true => IndependentRows::all(0),
            false => points_rows(whole),
        };
        let own = StepSubject {
            mechanism: &share.mechanism,
            mixed: &mixed,
            mass: &mass,
            rank: whole.rank.filter(|_| bodies),
            rows: &rows,
            departure: whole.departure.filter(|_| bodies),
            q: share.of(whole.q),
        };
        operators(&own, solver)
    };
    let both = of(0).and_then(|bodies| Ok([bodies, of(1)?]));
    Some(both.map(|both| Box::new(SideBySide::new(shares.clone(), both)) as _))
}

/// The independent constraints of the bars, as numbered among them.
fn points_rows(whole: &StepSubject<'_>) -> IndependentRows {
    let bars = 0..whole.mechanism.description().bars.len();
    let enforced = |row| whole.rows.rows().binary_search(&row).is_ok();
    let independent = |&k: &usize| enforced(whole.mechanism.bar_rows(k).start);
    let chosen: Vec<usize> = bars.clone().filter(independent).collect();
    IndependentRows::choose(bars.len(), &chosen)
}

/// The operators of the nodal scheme on a mechanism.
fn operators(of: &StepSubject<'_>, solver: Solver) -> Result<BoxedOperators, SetupError> {
    let StepSubject { mechanism, mixed, mass, q, .. } = *of;
    let n = mechanism.dim();
    let particles = !mechanism.description().particles.is_empty();
    let points_close = mechanism.has_loops() && of.rank.is_none();
    if points_close || !mechanism.cut_bars().is_empty() {
        check_dense(n, LOOPS_OF_BARS, "write scheme = \"constrained\"")?;
        if let Some(rank) = of.rank.filter(|rank| rank.is_singular()) {
            return Err(rank.refusal(SingularStart::Scheme));
        }
        return Ok(Box::new(TangentSpace::new(mechanism.clone(), of.rows)));
    }
    let elements = mechanism.has_nodes();
    let sparse = solver.is_sparse(mechanism);
    let dense = || check_dense(n, "the solver `dense`", "write solver = \"auto\"");
    if let Some(rank) = of.rank {
        if particles && solver == Solver::Dense {
            check_dense(n, LOOPS_BY_DENSE, "write solver = \"auto\"")?;
            if rank.is_singular() {
                return Err(rank.refusal(SingularStart::Scheme));
            }
            return Ok(Box::new(TangentSpace::new(mechanism.clone(), of.rows)));
        }
        let sweeps = (!particles && solver != Solver::Dense && !couples_bodies(mixed))
            .then(|| TreeNodal::new(mechanism.tree()));
        let sweeps = sweeps.flatten();
        if !(sweeps.is_some() || sparse || particles) {
            dense()?;
        }
        let tree = match (sweeps, sparse || particles) {
            (Some(sweeps), _) => TreeSolver::Sweeps(Box::new(sweeps)),
            (None, false) => {
                TreeSolver::Dense(Box::new(DenseNodal::new(n, TreeMap::new(mechanism))))
            }
            // the rates of a departure are those of increments, not of screws
            _ if elements && !rank.is_singular() => {
                let operators = SparseNodal::new(mechanism).for_elements(q);
                TreeSolver::Sparse(Box::new(operators.in_flight(mechanism, mass)))
            }
            _ => TreeSolver::Sparse(Box::new(SparseNodal::new(mechanism))),
        };
        let operators = LoopNodal::new(mechanism, rank, tree);
        return Ok(Box::new(match of.departure {
            Some(departure) => operators.leaving_along(&departure.null_space),
            None => operators,
        }));
    }
    let by_sweeps = !particles && !matches!(solver, Solver::Dense | Solver::Sparse);
    // beams are coupled with their parents, and stiff: by factors that are kept
    if by_sweeps
        && (!elements || !couples_bodies(mixed))
        && let Some(sweeps) = TreeNodal::of(mechanism.tree(), mixed)
    {
        return Ok(Box::new(sweeps));
    }
    if !sparse {
        dense()?;
        let operators = DenseNodal::new(n, TreeMap::new(mechanism));
        return Ok(Box::new(if elements { operators } else { operators.closing() }));
    }
    if takes_descriptor(mechanism) {
        let operators = descriptor(mechanism, elements, q);
        return Ok(Box::new(operators.in_flight(mechanism, mass)));
    }
    let operators = SparseNodal::new(mechanism);
    let operators = if elements { operators.for_elements(q) } else { operators };
    Ok(Box::new(operators.in_flight(mechanism, mass)))
}

pub(super) fn descriptor(mechanism: &Mechanism, elements: bool, q: &[f64]) -> TreeDescriptor {
    let operators = TreeDescriptor::new(mechanism);
    if elements { operators.for_elements(q) } else { operators }
}
