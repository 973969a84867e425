//! Why no start was found.

/// Why no consistent start was found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StartError {
    /// The projection does not converge.
    #[error(
        "no configuration that meets the constraints was found near the given one: \
         residual {residual:.1e} after {iterations} iterations"
    )]
    NoConfiguration {
        /// `|g|_∞` reached.
        residual: f64,
        /// Iterations made.
        iterations: usize,
    },
    /// A constraint that follows from the others wherever the mechanism may be is left with a
    /// residual: no motion closes it.
    #[error(
        "the constraints of a closed loop contradict each other: one that depends on the others is left with \
         {residual:.1e}, wherever the mechanism is"
    )]
    Misfit {
        /// The constraint.
        row: usize,
        /// `|g_i|`, in its unit.
        residual: f64,
    },
    /// Unilateral constraints that no motion opens, or none within reach.
    #[error("no motion nearby opens `{element}`")]
    Closed {
        /// One of them.
        element: String,
    },
    /// The matrix `[M Gᵀ; G 0]` is singular.
    #[error(
        "a free direction carries no mass, or constraints depend on one another in a way that \
         their rank does not show"
    )]
    Singular,
    /// A number of the start is not finite.
    #[error("the start holds a number that is not finite")]
    NotFinite,
}
