//! From a mechanism to a running integrator: which operators carry the form.

use crate::constrained::EmConstrained;
use crate::dalembert::EmDalembert;
use crate::dense_operators::DenseOperators;
use crate::em_system::EmSystem;
use crate::form::EmForm;
use crate::integrator::{BoxedEmScheme, EmIntegrator};
use crate::loop_nodal::{LoopClosure, LoopRows};
use crate::nodal::EmNodal;
use crate::null_space::{
    AveragedTree, DiscreteNullSpace, DiscreteQr, EmLinearization, TreeComplement,
};
use crate::setup::{EmAlgebra, EmOptions, EmSetupError};
use crate::sparse_operators::SparseOperators;
use vi_constraints::initialization::StartError;
use vi_constraints::integrator::{SetupError, check_dense, check_shapes};
use vi_constraints::saddle_point::{IndependentRows, SaddlePoint};
use vi_constraints::{Constraints, InitialValues, Integrator, Reparametrization};
use vi_core::Configuration;
use vi_core::MechanicalSystem;
use vi_core::sparse::Entries;
use vi_multibody::closed_loop::with_floors;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::{IndependentLoops, begun, has_many_ancestors};
use vi_multibody::tree_map::TreeMap;
use vi_multibody::tree_multipliers::TreeMultipliers;

/// A mechanism from its start; loops and single constraints on a spanning tree.
///
/// | | `em-nodal` | `em-dalembert` | `em-constrained` |
/// |---|---|---|---|
/// | trees | averaged velocity maps; sparse with nodes of elements or more than 60 degrees of freedom, but for many ancestors | the same, dense | sparse |
/// | loops | the same and a small complement, `u` of the tree | QR of `Ḡᵀ` | sparse |
/// | screws in the tree | QR of `Ḡᵀ` | the same | sparse |
///
/// # Errors
/// [`EmSetupError`]: dense matrices over more than [`vi_constraints::connected::DENSE_COORDINATES`]
/// coordinates are refused; `em-constrained` and `em-dalembert` refuse to start in a singular
/// configuration.
pub fn integrator(
    system: EmSystem,
    mechanism: Mechanism,
    options: EmOptions,
) -> Result<EmIntegrator<Mechanism>, EmSetupError> {
    let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
    integrator_at(system, mechanism, options, EmAlgebra::default(), InitialValues::new(0.0, &q, &v))
}

/// The same from another start, and with another algebra of the nodal form.
///
/// # Errors
/// As [`integrator`].
pub fn integrator_at(
    system: EmSystem,
    mechanism: Mechanism,
    options: EmOptions,
    algebra: EmAlgebra,
    at: InitialValues<'_>,
) -> Result<EmIntegrator<Mechanism>, EmSetupError> {
    system.check()?;
    check_shapes(&system, &mechanism, at)?;
    if mechanism.has_velocity_constraints() {
        return Err(SetupError::VelocityConstraints.into());
    }
    let loops = IndependentLoops::find(&mechanism, at.t, at.q)?;
    let mechanism = mechanism.accepting(loops.nearly_redundant());
    let start = loops.singular_start(&system, &mechanism, at, options.scheme == EmForm::Nodal)?;
    let at = start.as_ref().map_or(at, |start| InitialValues { q: &start.q, v: &start.v, ..at });
    let (n, m, rows) = (mechanism.dim(), mechanism.len(), loops.rows.clone());
    let scheme = match options.scheme {
        EmForm::Constrained => Box::new(EmConstrained::new(n, m, rows.clone())),
        EmForm::Dalembert => dalembert(&mechanism, rows.clone())?,
        EmForm::Nodal if mechanism.has_loops() => nodal_on_loops(&mechanism, &loops, algebra, at)?,
        EmForm::Nodal => nodal_on_tree(&mechanism, &system, rows.clone(), algebra, at)?,
    };
    let at_start = start.as_ref().map_or(&rows, |start| &start.rows);
    inertia(&system, &mechanism, at_start, Configuration::new(at.t, at.q))?;
    let run = Integrator::with_scheme(system, mechanism, scheme, rows, options, at)?;
    let run = begun(run, start)?;
    loops.known(run.constraints(), run.state().configuration())?;
    Ok(run)
}

/// That every motion which the constraints allow has mass: `[M Gᵀ; G 0]` is regular.
fn inertia(
    system: &EmSystem,
    mechanism: &Mechanism,
    rows: &IndependentRows,
    at: Configuration<'_>,
) -> Result<(), SetupError> {
    let n = mechanism.dim();
    let mut x = vec![0.0; n + rows.len()];
    (0..n).for_each(|i| x[i] = 1.0);
    let emit = |out: &mut dyn Entries| system.mass().emit(out);
    let solved = SaddlePoint::new(n, rows.clone()).solve(mechanism, &emit, at, 1.0, at, &mut x);
    match solved {
        Ok(()) if x.iter().all(|x| x.is_finite()) => Ok(()),
        _ => Err(SetupError::Start(StartError::Singular)),
    }
}

/// That a scheme with dense matrices may have them.
fn dense(mechanism: &Mechanism, what: &'static str) -> Result<(), SetupError> {
    check_dense(mechanism.dim(), what, "write scheme = \"em-constrained\"")
}

/// `em-dalembert`.
fn dalembert(
    mechanism: &Mechanism,
    rows: IndependentRows,
) -> Result<BoxedEmScheme<Mechanism>, EmSetupError> {
    dense(mechanism, "the scheme em-dalembert")?;
    let (n, m) = (mechanism.dim(), mechanism.len());
    let averaged = AveragedTree::new(mechanism).filter(|_| !mechanism.has_loops());
    Ok(match averaged {
        Some(source) => {
            let scheme = EmDalembert::new(n, m, rows, source);
            Box::new(scheme.on_tree(TreeMultipliers::new(mechanism)))
        }
        None => {
            let source = DiscreteQr::new(n, m, rows.len());
            Box::new(EmDalembert::new(n, m, rows, source))
        }
    })
}

/// Degrees of freedom up to which a tree is solved densely.
const DENSE_UP_TO: usize = 60;

/// `em-nodal` on a tree; of these rows where its velocity maps have no average.
fn nodal_on_tree(
    mechanism: &Mechanism,
    system: &EmSystem,
    rows: IndependentRows,
    algebra: EmAlgebra,
    at: InitialValues<'_>,
) -> Result<BoxedEmScheme<Mechanism>, EmSetupError> {
    let (n, m, map) = (mechanism.dim(), mechanism.len(), TreeMap::new(mechanism));
    let (averaged, tree) = (AveragedTree::new(mechanism), TreeMultipliers::new(mechanism));
    let explicit = algebra.linearization == EmLinearization::NullSpaceDerivative;
    let sparse = algebra.solver.is_sparse_above(DENSE_UP_TO, mechanism)
        && !explicit
        && !has_many_ancestors(mechanism)
        && averaged.is_some()
        && tree.is_some();
    if !sparse {
        dense(mechanism, "the scheme em-nodal on such a tree")?;
    }
    let scheme: BoxedEmScheme<Mechanism> = match averaged {
        Some(averaged) if sparse => {
            let operators = SparseOperators::new(mechanism, averaged);
            let elements = mechanism.has_nodes();
            let operators = if elements { operators.for_elements(at.q) } else { operators };
            let operators = operators.in_flight(mechanism, system.mass());
            Box::new(
                EmNodal::new::<Mechanism>(n, m, IndependentRows::all(m), operators).on_tree(tree),
            )
        }
        Some(averaged) => {
            let operators = DenseOperators::new(n, averaged, map);
            let operators = operators.linearized::<Mechanism>(algebra.linearization);
            let operators = operators.ok_or(EmSetupError::Linearization)?;
            Box::new(
                EmNodal::new::<Mechanism>(n, m, IndependentRows::all(m), operators).on_tree(tree),
            )
        }
        None if explicit => return Err(EmSetupError::Linearization),
        None => {
            let source = DiscreteQr::new(n, m, rows.len());
            let operators = DenseOperators::new(n, source, map);
            Box::new(EmNodal::new::<Mechanism>(n, m, rows, operators).on_tree(tree))
        }
    };
    Ok(scheme)
}

/// `em-nodal` with the unknowns of the spanning tree.
fn nodal_on_loops(
    mechanism: &Mechanism,
    loops: &IndependentLoops,
    algebra: EmAlgebra,
    at: InitialValues<'_>,
) -> Result<BoxedEmScheme<Mechanism>, EmSetupError> {
    if algebra.linearization == EmLinearization::NullSpaceDerivative {
        return Err(EmSetupError::Linearization);
    }
    dense(mechanism, "the scheme em-nodal on closed loops")?;
    let (n, m, map) = (mechanism.dim(), mechanism.len(), TreeMap::new(mechanism));
    let blocks = with_floors(mechanism, map.blocks());
    let rows = loop_rows(mechanism, &loops.rows, at);
    let mut rates = None;
    if let Some(rank) = loops.rank.as_ref().filter(|_| loops.rows_at_start.is_some()) {
        rates = Some(rank.departure(mechanism, at)?.rates);
    }
    let closure = LoopClosure::new(n, m, map.dof(), rows.clone(), rates);
    let source: Box<dyn DiscreteNullSpace<Mechanism>> = match TreeComplement::new(mechanism, rows) {
        Some(source) => Box::new(source),
        None => Box::new(DiscreteQr::new(n, m, loops.rows.len())),
    };
    let rows = closure.rows().clone();
    let operators = DenseOperators::new(n, source, map).on_loops(closure, blocks);
    Ok(Box::new(EmNodal::new::<Mechanism>(n, m, rows, operators)))
}

/// The constraints that the spanning tree leaves out; lengths weighed by the longest lever arm.
fn loop_rows(
    mechanism: &Mechanism,
    independent: &IndependentRows,
    InitialValues { t, q, .. }: InitialValues<'_>,
) -> LoopRows {
    let mut rows = mechanism.loop_rows();
    rows.extend(mechanism.cut_bars().iter().flat_map(|&k| mechanism.bar_rows(k)));
    rows.sort_unstable();
    let arm = mechanism.longest_arm();
    let frames = 12 * mechanism.description().bodies.len();
    let mut jacobian = nalgebra::DMatrix::zeros(mechanism.len(), mechanism.dim());
    mechanism.jacobian(t, q, &mut jacobian);
    let is_length = |j: usize| j >= frames || j % 12 < 3;
    let size = |row: &usize| {
        let entries = jacobian.row(*row);
        let weighed =
            entries.iter().enumerate().map(|(j, g)| if is_length(j) { arm * g } else { *g });
        let size = weighed.map(|g| g * g).sum::<f64>().sqrt();
        if size > 0.0 { 1.0 / size } else { 1.0 }
    };
    let scale = rows.iter().map(size).collect();
    let rank = rows.len() - (mechanism.len() - independent.len());
    LoopRows { rows, scale, rank }
}
