//! What an integration is set up with, and why it may be refused.

use crate::form::EmForm;
use crate::null_space::EmLinearization;
use vi_constraints::Options;
use vi_constraints::integrator::SetupError;
use vi_multibody::run::Solver;

/// What to integrate with. A composition is one of pairs of equal steps:
/// [`crate::scheme::sub_steps`].
pub type EmOptions = Options<EmForm>;

/// The algebra of the nodal form on mechanisms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EmAlgebra {
    /// The derivative of `P̄`.
    pub linearization: EmLinearization,
    /// On trees: [`Solver::Dense`], or sparse with nodes of elements and with more than 60 degrees
    /// of freedom.
    pub solver: Solver,
}

/// Why an integrator could not be set up.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EmSetupError {
    /// A reason that every family of schemes has.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The derivative of `P̄` was asked for where it is not known.
    #[error(
        "the derivative of the discrete null space is known for trees of bodies without screws and \
         closed loops: take the linearization by multipliers"
    )]
    Linearization,
    /// Laws read signals with states or held values.
    #[error(
        "energy–momentum schemes do not advance the states and held values of signals: take a \
         variational scheme"
    )]
    Signals,
    /// The form needs `F_d`.
    #[error(
        "the scheme `{}` needs a map F_d(u, q_n): give a reparametrization, or use the scheme \
         `em-constrained` or `em-dalembert`",
        .0.name()
    )]
    NeedsReparametrization(EmForm),
}
