//! What is known of the equations of a step: how exactly they can be solved, and from where.

use crate::predictor::Degree;

/// `√ε/2`, the usual [`Precision::closing_size`].
pub const CLOSING_SIZE: f64 = 1.0 / (1 << 27) as f64;

/// When Newton's method stops, and what its solution is known to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Precision {
    /// Relative size of the corrections that round-off alone may cause: more than 1e-9 where the
    /// problem is ill-conditioned.
    pub noise: f64,
    /// Relative size of corrections up to which a residual that is round-off by
    /// [`NewtonProblem::is_round_off`](super::NewtonProblem::is_round_off) ends a solve, where that
    /// is more than `noise`: what is soft moves far for the rounding of what is stiff.
    pub floor: f64,
    /// Parts of `ε` that may be left over: 1/4 is below the rounding of `x`; less takes half an
    /// iteration more, for who uses [`Newton::rounding_error`](super::Newton::rounding_error).
    pub resolution: f64,
    /// Relative size of a correction whose square, the error of Newton's method after it, is below
    /// rounding. Only for problems whose residual is handed on, so that what rounding leaves in it
    /// is not lost: elsewhere zero.
    pub closing_size: f64,
    /// Part of the last correction that Newton's method leaves after it, at most, where it is
    /// known: the largest rotation of a body in rad, where rotations are all that is nonlinear.
    /// Only for problems whose residual is handed on; elsewhere infinite.
    pub turn: f64,
    /// Whether corrections only approximate those of Newton's method: they contract by a constant
    /// ratio.
    pub is_simplified: bool,
    /// Whether the corrections alone say how far the solution is: of equations whose residual is
    /// ruled by what is stiff, so that it falls to nothing long before what is soft has moved.
    pub is_judged_by_corrections: bool,
    /// Of which degree initial guesses are extrapolated.
    pub degree: Degree,
    /// Whether a step never finds the mirror image of a body.
    pub keeps_orientation: bool,
    /// Whether the last step has itself found all constraints met to round-off and all coordinates
    /// finite.
    pub meets_constraints: bool,
}

impl Default for Precision {
    fn default() -> Self {
        Self {
            noise: 1e-9,
            floor: 0.0,
            resolution: 0.25,
            closing_size: 0.0,
            turn: f64::INFINITY,
            is_simplified: false,
            is_judged_by_corrections: false,
            degree: Degree::Cubic,
            keeps_orientation: false,
            meets_constraints: false,
        }
    }
}

impl Precision {
    /// Of motions as smooth as those of rigid bodies, whose residual is a balance that the next
    /// step takes over in full: increments are extrapolated by polynomials of a fitting degree, and
    /// a correction whose square is below rounding is the last one.
    #[must_use]
    pub fn of_balances() -> Self {
        Self { degree: Degree::Fitting, closing_size: CLOSING_SIZE, ..Self::default() }
    }

    /// The same, or the usual one.
    #[must_use]
    pub fn of_balances_if(balances: bool) -> Self {
        if balances { Self::of_balances() } else { Self::default() }
    }
}
