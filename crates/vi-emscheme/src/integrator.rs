//! From a system, its constraints and a form of the scheme to an [`Integrator`].
//!
//! ```
//! use vi_constraints::{ConstraintFn, InitialValues};
//! use vi_core::{SeparableSystem, potential::LinearPotential};
//! use vi_emscheme::{EmForm, EmOptions, EmSystem, integrator};
//!
//! // a planar pendulum: M = I, V = −(0, −9.81)·q, g = ½(|q|² − 1), G = qᵀ
//! let free = SeparableSystem::with_diagonal_mass(&[1.0, 1.0])
//!     .potential(LinearPotential { force: vec![0.0, -9.81] });
//! let rod = ConstraintFn::new(2, 1,
//!     |q, g| g[0] = 0.5 * (q[0] * q[0] + q[1] * q[1] - 1.0),
//!     |q, G| { G[(0, 0)] = q[0]; G[(0, 1)] = q[1]; });
//! let options = EmOptions::new(EmForm::Dalembert, 0.01);
//! let at = InitialValues::new(0.0, &[1.0, 0.0], &[0.0, 0.0]);
//! let mut run = integrator::new(EmSystem::of_linear(&free), rod, options, at)?;
//! for _ in 0..100 {
//!     run.step()?;
//! }
//! let node = run.observe()?;
//! assert!(node.discrete_energy.total().abs() < 1e-12 && node.position_residual < 1e-14);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub use crate::setup::{EmAlgebra, EmOptions, EmSetupError};

use crate::constrained::EmConstrained;
use crate::constraint::DiscreteConstraints;
use crate::dalembert::EmDalembert;
use crate::dense_operators::DenseOperators;
use crate::em_system::EmSystem;
use crate::form::EmForm;
use crate::nodal::EmNodal;
use crate::null_space::{DiscreteNullSpace, DiscreteQr};
use vi_constraints::integrator::{SetupError, check_shapes};
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::scheme::Scheme;
use vi_constraints::{InitialValues, Integrator, Reparametrization};

/// A running integration by an energy–momentum scheme.
pub type EmIntegrator<C> = Integrator<EmSystem, C>;

/// One of the forms.
pub(crate) type BoxedEmScheme<C> = Box<dyn Scheme<EmSystem, C>>;

/// The constrained and the d'Alembert form, `P̄` from a pivoted QR of `Ḡᵀ`.
///
/// Energy is exact for constraints that are at most quadratic; others get `Ḡ = G(q_{n+1/2})` too.
///
/// # Errors
/// [`EmSetupError`].
pub fn new<C: DiscreteConstraints + 'static>(
    system: EmSystem,
    constraints: C,
    options: EmOptions,
    at: InitialValues<'_>,
) -> Result<EmIntegrator<C>, EmSetupError> {
    system.check()?;
    check_shapes(&system, &constraints, at)?;
    let (n, m) = (constraints.dim(), constraints.len());
    let rows = IndependentRows::find(&constraints, at.t, at.q);
    let scheme: BoxedEmScheme<C> = match options.scheme {
        EmForm::Constrained => Box::new(EmConstrained::new(n, m, rows.clone())),
        EmForm::Dalembert => {
            let source = DiscreteQr::new(n, m, rows.len());
            Box::new(EmDalembert::new(n, m, rows.clone(), source))
        }
        EmForm::Nodal => return Err(EmSetupError::NeedsReparametrization(options.scheme)),
    };
    with_scheme(system, constraints, scheme, rows, options, at)
}

/// All three forms, with the user's `P̄` and `F_d`.
///
/// # Errors
/// [`EmSetupError`].
pub fn with_null_space<C, N, R>(
    system: EmSystem,
    constraints: C,
    source: N,
    map: R,
    options: EmOptions,
    at: InitialValues<'_>,
) -> Result<EmIntegrator<C>, EmSetupError>
where
    C: DiscreteConstraints + 'static,
    N: DiscreteNullSpace<C> + 'static,
    R: Reparametrization + 'static,
{
    system.check()?;
    check_shapes(&system, &constraints, at)?;
    let (n, m) = (constraints.dim(), constraints.len());
    let rows = IndependentRows::find(&constraints, at.t, at.q);
    if map.dof() != n - rows.len() {
        let what = "the increment u of the reparametrization";
        let (found, expected) = (map.dof(), n - rows.len());
        return Err(SetupError::Shape { what, found, expected }.into());
    }
    let scheme: BoxedEmScheme<C> = match options.scheme {
        EmForm::Constrained => Box::new(EmConstrained::new(n, m, rows.clone())),
        EmForm::Dalembert => Box::new(EmDalembert::new(n, m, rows.clone(), source)),
        EmForm::Nodal => {
            Box::new(EmNodal::new(n, m, rows.clone(), DenseOperators::new(n, source, map)))
        }
    };
    with_scheme(system, constraints, scheme, rows, options, at)
}

/// All three forms, with the user's `F_d` and `P̄` from a pivoted QR.
///
/// # Errors
/// [`EmSetupError`].
pub fn with_reparametrization<C, R>(
    system: EmSystem,
    constraints: C,
    map: R,
    options: EmOptions,
    at: InitialValues<'_>,
) -> Result<EmIntegrator<C>, EmSetupError>
where
    C: DiscreteConstraints + 'static,
    R: Reparametrization + 'static,
{
    let (n, m, d) = (constraints.dim(), constraints.len(), map.dof());
    let source = DiscreteQr::new(n, m, n.saturating_sub(d));
    with_null_space(system, constraints, source, map, options, at)
}

fn with_scheme<C: DiscreteConstraints + 'static>(
    system: EmSystem,
    constraints: C,
    scheme: BoxedEmScheme<C>,
    rows: IndependentRows,
    options: EmOptions,
    at: InitialValues<'_>,
) -> Result<EmIntegrator<C>, EmSetupError> {
    Ok(Integrator::with_scheme(system, constraints, scheme, rows, options, at)?.consistent()?)
}
