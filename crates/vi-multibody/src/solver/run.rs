//! From a mechanism to a running integrator: which operators solve the scheme.
//!
//! | mechanism | nodal and reduced | d'Alembert | constrained |
//! |---|---|---|---|
//! | tree of bodies, uncoupled potential | articulated recursion, `O(N)`; nodal: sweeps of their own | dense | sparse |
//! | tree with couplings or point masses | dense up to 60 degrees of freedom, then sparse or descriptor form | dense | sparse |
//! | tree with nodes of elements | sparse by blocks, descriptor form with point masses or many ancestors | dense | sparse |
//! | closed loops of bodies | that of their tree + small complement; nodal on R, P, fixed: its sweeps, too | dense, QR | sparse |
//! | loops of bars, loops beside point masses | dense, tangent space | dense, QR | sparse |
//!
//! By blocks: sparse LU with the blocks of joints as pivots where they have three unknowns in the mean, see
//! [`crate::solver::sparse_nodal::reduced_matrix`].
//!
//! Galerkin schemes:
//!
//! | mechanism | nodal | constrained |
//! |---|---|---|
//! | tree of bodies | articulated recursion at all control points at once, `O(N)` | sparse |
//! | tree with point masses | dense | sparse |
//! | closed loops of bodies | that of their tree + small complement at each control point | sparse |
//! | tree with nodes of elements, or when sparse matrices are asked for | modes of the step, sparse by blocks | sparse |
//! | other closed loops, elements beside point masses | none | sparse |

use crate::mechanism::Mechanism;
use crate::output::tree_multipliers::TreeMultipliers;
use crate::solver::closed_loop::control_points::LoopSweeps;
use crate::solver::closed_loop::loop_rank::LoopRank;
use crate::solver::closed_loop::step::LoopStep;
use crate::solver::closed_loop::{LoopNodal, TreeSolver};
use crate::solver::sparse_nodal::SparseNodal;
use crate::solver::sparse_nodal::control_points::CoupledSweeps;
use crate::solver::tree_control_points::TreeControlPoints;
use crate::solver::tree_descriptor::TreeDescriptor;
use crate::solver::tree_map::TreeMap;
use crate::solver::tree_nodal::TreeNodal;
use crate::solver::tree_step::TreeStep;
use crate::solver::tree_sweeps::TreeSweeps;
use crate::tree::Link;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use vi_constraints::InitialValues;
use vi_constraints::agreement::contradiction;
use vi_constraints::constrained::Constrained;
use vi_constraints::dalembert::{Dalembert, MapSource, QrSource};
use vi_constraints::discretization::Discretization;
use vi_constraints::galerkin::{DenseControlPoints, GalerkinConstrained, GalerkinNodal, Pointwise};
use vi_constraints::initialization::{StartReport, start};
use vi_constraints::integrator::{SetupError, SingularStart, check_dense};
use vi_constraints::nodal::Nodal;
use vi_constraints::node_solvers::{NodalVelocity, NodeSolvers};
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::scheme::Scheme;
use vi_constraints::{
    Constraints, DenseNodal, Integrator, Method, Options, SchemeKind, TangentSpace,
};
use vi_core::galerkin::Stages;
use vi_core::interval::Interval;
#[cfg(target_arch = "x86_64")]
use vi_core::lanes::Wide;
use vi_core::lanes::{Lanes, Plain, Register, Twice};
use vi_core::sparse::Entries;
use vi_core::{Configuration, MechanicalSystem, SeparableSystem};

/// How the nodal and reduced schemes solve their linear systems.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Solver {
    /// The fastest that applies.
    #[default]
    Auto,
    /// Dense matrices, for comparison.
    Dense,
    /// The articulated recursion, in Galerkin schemes one control point after the other; where it does not apply, as `Auto`.
    Articulated,
    /// Sparse factorizations; closed loops of bodies without couplings use the recursion.
    Sparse,
}

const LOOPS_BESIDE_POINTS: &str = "loops of bars, or loops beside point masses, in the nodal form";

/// Degrees of freedom up to which a coupled tree is solved densely.
const DENSE_UP_TO: usize = 60;

impl Solver {
    /// Whether a tree that the recursion does not solve gets sparse matrices: when asked for; with nodes of
    /// elements and with more than 60 degrees of freedom, when nothing is asked for.
    #[must_use]
    pub fn is_sparse(self, mechanism: &Mechanism) -> bool {
        let d = mechanism.tree().dof() + mechanism.particle_tree().dof();
        match self {
            Self::Dense => false,
            Self::Sparse => true,
            Self::Auto | Self::Articulated => has_nodes(mechanism) || d > DENSE_UP_TO,
        }
    }
}

/// Whether a sparse tree is solved in descriptor form: with point masses, and with many ancestors.
fn takes_descriptor(mechanism: &Mechanism) -> bool {
    mechanism.particle_tree().dof() > 0 || has_many_ancestors(mechanism)
}

/// Whether members have so many ancestors that the matrix over the unknowns is dense.
#[must_use]
pub fn has_many_ancestors(mechanism: &Mechanism) -> bool {
    const MOST: usize = 64; // mean of the unknowns that move a member: root of the mean square
    let mut unknowns: Vec<usize> = Vec::new();
    for link in mechanism.tree().links() {
        unknowns.push(link.parent.map_or(0, |p| unknowns[p]) + link.dof());
    }
    let squares: usize = unknowns.iter().map(|count| count * count).sum();
    squares > MOST * MOST * unknowns.len()
}

type BoxedScheme = Box<dyn Scheme<SeparableSystem, Mechanism>>;

/// A running mechanism.
pub type MechanismIntegrator = Integrator<SeparableSystem, Mechanism>;

/// Sets up the integration of a mechanism from the initial values `at`.
///
/// # Errors
/// [`SetupError`].
pub fn integrator(
    mechanism: Mechanism,
    system: SeparableSystem,
    options: Options,
    solver: Solver,
    at: InitialValues<'_>,
) -> Result<MechanismIntegrator, SetupError> {
    let mechanism = Arc::new(mechanism);
    let loops = Loops::find(&mechanism, at.t, at.q)?;
    let rows = loops.rows.clone();
    let leaves = matches!(options.scheme, SchemeKind::Nodal | SchemeKind::Reduced);
    let moved = loops.singular_start(&system, &mechanism, at, leaves)?;
    let at = moved.as_ref().map_or(at, |start| InitialValues::new(at.t, &start.q, &start.v));
    let (n, m) = (mechanism.dim(), mechanism.len());
    let scheme: BoxedScheme = match options.scheme {
        kind if options.method.stages().is_some() => {
            galerkin(&mechanism, &system, (kind, options.method), solver, (&loops, at.q))?
        }
        SchemeKind::Constrained => Box::new(Constrained::new(n, m, rows.clone())),
        SchemeKind::Dalembert => {
            check_dense(n, "the scheme `dalembert`", "write scheme = \"nodal\"")?;
            dalembert(&mechanism, &rows)
        }
        SchemeKind::Nodal | SchemeKind::Reduced => {
            nodal(&mechanism, &system, &options, solver, (&loops, at))?
        }
    };
    let solvers = node_solvers(&mechanism, &system, solver, (&loops, leaves, at));
    let run = Integrator::with_scheme(system, mechanism, scheme, rows, options, at)?;
    let run = begun(run.reading_with(solvers), moved)?;
    loops.known(run.constraints(), run.state().configuration())?;
    Ok(run)
}

/// A run with consistent initial values, those of a singular initial configuration if there is one.
///
/// # Errors
/// [`SetupError::Contradiction`].
pub fn begun<S: Discretization<Mechanism>>(
    run: Integrator<S, Mechanism>,
    start: Option<ConsistentStart>,
) -> Result<Integrator<S, Mechanism>, SetupError> {
    match start {
        Some(start) => Ok(run.starting_singular(&start.rows, start.report)),
        None => run.consistent(),
    }
}

/// Initial values in a singular configuration, consistent with the constraints that are independent there.
#[derive(Clone, Debug)]
pub struct ConsistentStart {
    /// `q(0)`, shape `n`.
    pub q: Vec<f64>,
    /// `v(0)`, shape `n`.
    pub v: Vec<f64>,
    /// The constraints that are independent there.
    pub rows: IndependentRows,
    /// How consistent it was as given.
    pub report: StartReport,
}

/// The independent constraints of the motion, and of its initial configuration where fewer are independent there.
#[derive(Clone, Debug)]
pub struct Loops {
    /// Of the motion.
    pub rows: IndependentRows,
    /// Of the initial configuration, where it is singular.
    pub rows_at_start: Option<IndependentRows>,
    /// What is known of the loops; `None` without loops of bodies.
    pub rank: Option<LoopRank>,
}

impl Loops {
    /// Looks initially `(t, q)` of a mechanism.
    ///
    /// # Errors
    /// [`SetupError::RankAtStart`] where bars, or loops beside point masses, lose rank.
    pub fn find(mechanism: &Mechanism, t: f64, q: &[f64]) -> Result<Self, SetupError> {
        let particles = !mechanism.description().particles.is_empty();
        if mechanism.has_loops() && particles {
            let rows = IndependentRows::find_generic(mechanism, t, q)?;
            return Ok(Self { rows, rows_at_start: None, rank: None });
        }
        if !mechanism.has_loops() {
            let rows = IndependentRows::all(mechanism.len());
            return Ok(Self { rows, rows_at_start: None, rank: None });
        }
        let rank = LoopRank::find(mechanism, t, q);
        let rows_at_start = rank.is_singular().then(|| rank.rows_at_start(mechanism));
        Ok(Self { rows: rank.rows(mechanism), rows_at_start, rank: Some(rank) })
    }

    /// Consistent initial values at a singular configuration `at`; `leaves`: whether the scheme can leave a singular
    /// configuration.
    ///
    /// # Errors
    /// [`SetupError`].
    pub fn singular_start(
        &self,
        system: &impl MechanicalSystem,
        mechanism: &Mechanism,
        at: InitialValues<'_>,
        leaves: bool,
    ) -> Result<Option<ConsistentStart>, SetupError> {
        let Some(rows) = &self.rows_at_start else { return Ok(None) };
        if !leaves {
            return Err(self.refusal(SingularStart::Scheme));
        }
        let found = start(system, mechanism, rows, at)?;
        if let Some(error) = contradiction(mechanism, rows, found.state.configuration(), &found.v) {
            return Err(error.into());
        }
        let (q, v, report) = (found.state.q, found.v, found.report);
        Ok(Some(ConsistentStart { q, v, rows: rows.clone(), report }))
    }

    /// That the rank of the loops is known, see [`LoopRank::known`].
    ///
    /// # Errors
    /// [`SetupError::RankUnknown`].
    pub fn known(&self, mechanism: &Mechanism, at: Configuration<'_>) -> Result<(), SetupError> {
        self.rank.as_ref().map_or(Ok(()), |rank| rank.known(mechanism, at))
    }

    /// The refusal of a singular initial configuration.
    #[must_use]
    pub fn refusal(&self, reason: SingularStart) -> SetupError {
        self.rank.as_ref().map_or_else(
            || SetupError::SingularStart { joint: String::new(), reason },
            |rank| rank.refusal(reason),
        )
    }
}

fn dalembert(mechanism: &Mechanism, rows: &IndependentRows) -> BoxedScheme {
    let (n, m) = (mechanism.dim(), mechanism.len());
    if mechanism.has_loops() {
        let source = QrSource::new(n, m, rows.len());
        return Box::new(Dalembert::new(n, m, rows.clone(), source));
    }
    Box::new(Dalembert::new(n, m, rows.clone(), MapSource(TreeMap::new(mechanism))))
}

fn nodal(
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
    let mut recursion = TreeNodal::new(mechanism.tree().clone());
    let uncoupled = !particles && recursion.applies(system, &probe(mechanism, system));
    let elements = has_nodes(mechanism);
    let sparse = solver.is_sparse(mechanism);
    let dense = || check_dense(n, "the solver `dense`", "write solver = \"auto\"");
    if let Some(rank) = &loops.rank {
        if !uncoupled {
            let what = "springs between the bodies of so many closed loops";
            check_dense(rank.generic, what, "write scheme = \"constrained\"")?;
            if !sparse {
                dense()?;
            }
        }
        if uncoupled
            && !reduced
            && !matches!(solver, Solver::Dense | Solver::Sparse)
            && let Some(step) = LoopStep::new(mechanism, system, rank)
        {
            return Ok(Box::new(step));
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
    if uncoupled && !matches!(solver, Solver::Dense | Solver::Sparse) {
        if let Some(step) = TreeStep::new(mechanism, system).filter(|_| !reduced) {
            return Ok(Box::new(step));
        }
        return Ok(Box::new(Nodal::new(n, recursion, reduced)));
    }
    if !sparse {
        dense()?;
        let operators = DenseNodal::new(n, TreeMap::new(mechanism));
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

fn descriptor(mechanism: &Mechanism, elements: bool, q: &[f64]) -> TreeDescriptor {
    let operators = TreeDescriptor::new(mechanism);
    if elements { operators.for_elements(q) } else { operators }
}

/// The Galerkin schemes: trees of bodies and point masses in nodal form, any mechanism of these in constrained form.
fn galerkin(
    mechanism: &Mechanism,
    system: &SeparableSystem,
    (kind, method): (SchemeKind, Method),
    solver: Solver,
    (loops, q): (&Loops, &[f64]),
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
        mechanism.description().particles.is_empty()
            && TreeNodal::new(mechanism.tree().clone())
                .is_uncoupled(&mass, &probe(mechanism, system))
    };
    match kind {
        SchemeKind::Constrained => {
            Ok(Box::new(GalerkinConstrained::new(n, m, loops.rows.clone(), stages)))
        }
        SchemeKind::Dalembert => refused("by the scheme `dalembert`"),
        SchemeKind::Reduced => refused("by the scheme `reduced`"),
        SchemeKind::Nodal if mechanism.has_loops() => match &loops.rank {
            Some(rank) if !has_nodes(mechanism) && bodies() => {
                if rank.is_singular() {
                    return Err(loops.refusal(SingularStart::Scheme));
                }
                let sweeps = LoopSweeps::new(mechanism, rank, stages);
                Ok(Box::new(GalerkinNodal::new(n, stages, sweeps)))
            }
            _ => constrained_only(
                "closed loops of beams or point masses by the scheme `nodal`, but by `constrained`",
            ),
        },
        SchemeKind::Nodal if has_nodes(mechanism) && points => constrained_only(
            "beams beside point masses by the scheme `nodal`, but by `constrained`",
        ),
        SchemeKind::Nodal if has_nodes(mechanism) || solver == Solver::Sparse && !points => {
            if has_many_ancestors(mechanism) {
                // the matrix between the unknowns is full
                let what = "the Galerkin schemes of beams on so many bodies in series";
                check_dense(n, what, "write scheme = \"constrained\"")?;
            }
            let sweeps = CoupledSweeps::new(mechanism, stages, q);
            Ok(Box::new(GalerkinNodal::new(n, stages, sweeps)))
        }
        SchemeKind::Nodal => {
            if solver != Solver::Dense && bodies() {
                return Ok(tree_sweeps(mechanism, system, solver, stages));
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

/// The sweeps of a tree of bodies: all control points at once, in the widest registers there are; one after the other
/// when the recursion is asked for.
fn tree_sweeps(
    mechanism: &Mechanism,
    system: &SeparableSystem,
    solver: Solver,
    stages: Stages,
) -> BoxedScheme {
    let in_lanes = || {
        #[cfg(target_arch = "x86_64")]
        if let Some(wide) = Wide::detect() {
            return sweeps_in(wide, mechanism, system, stages);
        }
        sweeps_in(Plain, mechanism, system, stages)
    };
    let all = if solver == Solver::Articulated { None } else { in_lanes() };
    all.unwrap_or_else(|| {
        let (n, s) = (mechanism.dim(), stages.count());
        let operators = TreeControlPoints::new(mechanism.tree(), s);
        Box::new(GalerkinNodal::new(n, stages, Pointwise::new(n, s, operators)))
    })
}

/// The same in four or eight lanes.
fn sweeps_in<T: Register>(
    lanes: T,
    mechanism: &Mechanism,
    system: &SeparableSystem,
    stages: Stages,
) -> Option<BoxedScheme> {
    let (n, tree, mass) = (mechanism.dim(), mechanism.tree(), system.mass());
    if stages.count() <= T::Lanes::COUNT {
        let sweeps = TreeSweeps::new(lanes, tree, mass, stages)?;
        return Some(Box::new(GalerkinNodal::new(n, stages, sweeps)));
    }
    let sweeps = TreeSweeps::new(Twice(lanes), tree, mass, stages)?;
    Some(Box::new(GalerkinNodal::new(n, stages, sweeps)))
}

/// How the nodes of a mechanism are read. The potential has no part in it; loops need the `memory` of the nodal
/// and the reduced scheme.
///
/// | mechanism | `v̂` | `λ` |
/// |---|---|---|
/// | tree of bodies | articulated recursion, `O(N)` | sweep, `O(N)` |
/// | tree with elements | sparse or descriptor form | sweep, `O(N)` |
/// | tree with point masses | dense up to 60 degrees of freedom, then descriptor form | saddle point |
/// | closed loops of bodies | that of their tree + small complement | saddle point |
/// | loops of bars, loops beside point masses | saddle point | saddle point |
fn node_solvers(
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
    let mut recursion = TreeNodal::new(mechanism.tree().clone());
    let s = probe(mechanism, system);
    let mass = |out: &mut dyn Entries| system.emit_mass_of_step(s.start(), s.h, out);
    let uncoupled = !particles && recursion.is_uncoupled(&mass, &s);
    let sparse = || {
        let operators = SparseNodal::new(mechanism);
        let screws = has_nodes(mechanism) && solver.is_sparse(mechanism);
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
            let operators = descriptor(mechanism, has_nodes(mechanism), at.q);
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

/// Whether some frame gets its mass from elements: it moves and has none of its own.
#[must_use]
pub fn has_nodes(mechanism: &Mechanism) -> bool {
    let bodies = &mechanism.description().bodies;
    let moves = |link: &&Link| link.dof() > 0;
    mechanism.tree().links().iter().filter(moves).any(|link| bodies[link.frame].body.is_none())
}

/// An interval initially, to look at the pattern of the Newton matrix.
fn probe(mechanism: &Mechanism, system: &SeparableSystem) -> Interval {
    let mut s = Interval::new(system.dim());
    s.open(0.0, 1.0, &mechanism.initial_configuration());
    s
}
