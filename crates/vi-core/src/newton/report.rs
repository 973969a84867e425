//! What Newton's method reports: how a solve went, and why one failed.

use super::BlockKind;
use crate::linear::Singular;

/// Why an evaluation was refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// The tangent is singular.
    #[error("the Newton matrix is singular to working precision")]
    SingularTangent,
    /// Local coordinates left the range in which they are one-to-one.
    #[error("a {kind} of {size:.3}{} in one step (unknown {unknown})", .kind.unit())]
    OutsideChart {
        /// What they measure.
        kind: BlockKind,
        /// The first unknown of the increment.
        unknown: usize,
        /// Its norm.
        size: f64,
    },
    /// An equation within the evaluation has no solution here.
    #[error("{what} (still corrected by {correction:.1e})")]
    Unsolved {
        /// What was not found, in words.
        what: &'static str,
        /// The last correction.
        correction: f64,
    },
    /// A solution far from the initial guess, perhaps on another branch of the motion.
    #[error("a solution {distance:.2} rad from the initial guess (unknown {unknown})")]
    FarFromGuess {
        /// The unknown that is farthest.
        unknown: usize,
        /// How far, rad.
        distance: f64,
    },
    /// A solution whose polynomial leaves the constraints between its points, perhaps on another
    /// branch of the motion.
    #[error("a solution whose polynomial leaves the constraints by {by:.2} of their size")]
    FarFromConstraints {
        /// How far, relative to the size of the terms of a constraint.
        by: f64,
    },
    /// A matrix has another rank than at the start.
    #[error("{of} have rank {found} here and rank {expected} at the start")]
    RankChanged {
        /// Whose rank, in words.
        of: &'static str,
        /// Rank found.
        found: usize,
        /// Rank at the start.
        expected: usize,
    },
    /// The residual or the correction is not finite.
    #[error("a value that is not finite")]
    NotFinite,
    /// The work of this thread is no longer wanted ([`crate::interruption`]).
    #[error("the work was interrupted")]
    Interrupted,
}

impl From<Singular> for Fault {
    fn from(_: Singular) -> Self {
        Self::SingularTangent
    }
}

/// How a solve went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NewtonReport {
    /// Corrections made.
    pub iterations: usize,
    /// Residual evaluations.
    pub evaluations: usize,
    /// `|r|_∞` at the solution; before the last correction where that one settled the solve
    /// ([`crate::newton::NewtonProblem::settle`]).
    pub residual: f64,
    /// Relative size of the last correction.
    pub last_correction: f64,
    /// Initial guesses that failed before.
    pub restarts: usize,
}

/// How a solve failed; the unknowns are left where the loop stood.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NewtonError {
    /// The corrections do not become small.
    #[error(
        "Newton's method did not converge in {iterations} iterations: the {kind} block is still \
         corrected by {correction:.1e} (relative), residual {residual:.1e}"
    )]
    NotConverged {
        /// Corrections made.
        iterations: usize,
        /// Block with the largest correction.
        kind: BlockKind,
        /// Unknown with the largest correction.
        unknown: usize,
        /// Relative size of that correction.
        correction: f64,
        /// `|r|_∞`.
        residual: f64,
    },
    /// An evaluation was refused.
    #[error("{fault} (iteration {iteration})")]
    Refused {
        /// What was refused.
        fault: Fault,
        /// In which iteration.
        iteration: usize,
    },
}
