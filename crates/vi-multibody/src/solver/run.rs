//! From a mechanism to a running integrator: which operators solve the scheme.
//!
//! | mechanism | nodal and reduced | d'Alembert | constrained |
//! |---|---|---|---|
//! | tree of bodies, coupled at most with their parents | sweeps over the links, `O(N)` | dense | sparse |
//! | tree with couplings, or of point masses | sparse or descriptor form, dense up to 12 degrees of freedom with point masses | dense | sparse |
//! | bodies beside point masses, no potential between the two | as the ones and as the others, side by side | dense | sparse |
//! | tree with nodes of elements | sparse by blocks, descriptor form with point masses or many ancestors | dense | sparse |
//! | closed loops of bodies, uncoupled potential | sweeps of their tree + small complement, `O(N)` | dense, QR | sparse |
//! | closed loops of bodies that springs couple | sparse matrices of their tree + dense complement | dense, QR | sparse |
//! | closed loops of bodies coupled with point masses | sparse matrices of their tree + dense complement | dense, QR | sparse |
//! | loops of bars | dense, tangent space | dense, QR | sparse |
//!
//! Springs, dampers and motors on joint coordinates of the tree are no couplings
//! ([`vi_core::coordinate_force`]), but in Galerkin schemes; nor are up to 32 laws on them, on
//! trees of bodies by the nodal scheme, whatever they read ([`vi_core::quantity_effort`]).
//!
//! By blocks: sparse LU with the blocks of joints as pivots where they have three unknowns in the
//! mean, see [`crate::solver::sparse_nodal::reduced_matrix`].
//!
//! Galerkin schemes:
//!
//! | mechanism | nodal | constrained |
//! |---|---|---|
//! | tree of bodies | sweeps over the links at all control points at once, `O(N)` | sparse |
//! | tree with point masses | dense | sparse |
//! | closed loops of bodies | sweeps of their tree + small complement at each control point | sparse |
//! | tree with nodes of elements, or when sparse matrices are asked for | modes of the step, sparse by blocks | sparse |
//! | other closed loops, elements beside point masses | none | sparse |

mod galerkin;
mod nodal;
mod node_solvers;
mod start;
mod structure;

pub use start::{IndependentLoops, LoopStart, begun};
pub use structure::{Solver, has_many_ancestors};

use crate::contact::{Contacts, TransmittedImpulses};
use crate::mechanism::Mechanism;
use crate::solver::loop_point_costates::LoopPointCostates;
use crate::solver::point_costates::PointCostates;
use crate::solver::tree_costates::TreeCostates;
use crate::solver::tree_map::TreeMap;
use galerkin::galerkin;
use nodal::nodal;
use node_solvers::node_solvers;
use std::sync::Arc;
use structure::BoxedScheme;
use vi_constraints::constrained::Constrained;
use vi_constraints::costate_sweep::{CostateSweep, CostateTangents};
use vi_constraints::dalembert::{Dalembert, MapSource, QrSource};
use vi_constraints::integrator::{SetupError, check_dense};
use vi_constraints::nonsmooth::{Nonsmooth, NonsmoothOptions};
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::{Constraints, InitialValues, Integrator, Options, OrderMethod, SchemeKind};
use vi_core::SeparableSystem;

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
    let steps = options.scheme == SchemeKind::Nodal && options.method.stages().is_none();
    if mechanism.has_velocity_constraints() && !steps {
        return Err(SetupError::VelocityConstraints);
    }
    let loops = IndependentLoops::find(&mechanism, at.t, at.q)?;
    let mechanism = Arc::new(mechanism.accepting(loops.nearly_redundant()));
    let rows = loops.rows.clone();
    let leaves = matches!(options.scheme, SchemeKind::Nodal | SchemeKind::Reduced);
    let moved = loops.singular_start(&system, &mechanism, at, leaves)?;
    let at = moved.as_ref().map_or(at, |start| InitialValues { q: &start.q, v: &start.v, ..at });
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
            nodal(&mechanism, &system, &options, solver, &loops, at)?
        }
    };
    let solvers = node_solvers(&mechanism, &system, solver, &loops, leaves, at);
    let run = Integrator::with_scheme(system, mechanism, scheme, rows, options, at)?;
    let run = begun(run.reading_with(solvers).with_costates(costates), moved)?;
    loops.known(run.constraints(), run.state().configuration())?;
    Ok(run)
}

/// The sweep over the links of a tree, transposed, with few rows of loops on top; of Galerkin steps
/// on loops by the null space of few degrees of freedom. `None` of other mechanisms.
fn costates(
    system: &SeparableSystem,
    mechanism: &Mechanism,
    rows: &IndependentRows,
    (method, along): (OrderMethod, CostateTangents),
) -> Option<Box<dyn CostateSweep<SeparableSystem, Mechanism>>> {
    match method.stages() {
        None => TreeCostates::new(mechanism, system, rows, along).map(|own| Box::new(own) as _),
        Some(stages) => {
            let tree = PointCostates::new(mechanism, system, stages, along);
            tree.map(|own| Box::new(own) as _).or_else(|| {
                let loops = LoopPointCostates::new(mechanism, system, rows, stages, along);
                loops.map(|own| Box::new(own) as _)
            })
        }
    }
}

/// Adds contacts, joint stops and dry friction, where there are any, to an integration by a scheme.
///
/// # Errors
/// [`SetupError::Contacts`] of other schemes than the nodal one of order 2,
/// [`SetupError::Overlap`], [`SetupError::ReactionNotUnique`].
pub fn with_contacts(
    run: MechanismIntegrator,
    scheme: SchemeKind,
    contacts: Contacts,
    options: NonsmoothOptions,
) -> Result<MechanismIntegrator, SetupError> {
    if contacts.is_empty() {
        return Ok(run);
    }
    match scheme {
        SchemeKind::Nodal => {
            let Contacts { elements, by_reaction } = contacts;
            let mut nonsmooth = Nonsmooth::new(elements, options);
            if !by_reaction.is_empty() {
                let (mechanism, rows) = (run.constraints().clone(), run.rows().clone());
                let mut impulses = TransmittedImpulses::new(mechanism, rows, by_reaction);
                if let Some(joint) = impulses.not_unique(run.state().configuration()) {
                    return Err(SetupError::ReactionNotUnique { joint: joint.to_owned() });
                }
                nonsmooth = nonsmooth.with_transverse(Box::new(impulses));
            }
            run.with_contacts(nonsmooth)
        }
        SchemeKind::Constrained => Err(SetupError::Contacts { what: "the scheme `constrained`" }),
        SchemeKind::Dalembert => Err(SetupError::Contacts { what: "the scheme `dalembert`" }),
        SchemeKind::Reduced => Err(SetupError::Contacts { what: "the scheme `reduced`" }),
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
