//! Why a step is refused, and what to do about it.

use crate::nonsmooth::ContactFault;
use vi_core::newton::{BlockKind, Fault, NewtonError};

/// Why a step was refused. The state is then what it was before the call.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// Newton's method failed from every initial guess that was tried.
    #[error("{0}")]
    Newton(#[from] NewtonError),
    /// The constraints lost the rank that the scheme relies on.
    #[error("the step matrix is singular: the constraints have lost rank")]
    RankLost,
    /// The configuration reached does not satisfy all constraints ([`crate::closure`]).
    #[error(
        "the constraints cannot all be satisfied: residual {residual:.1e}, where rounding leaves \
         less than {bound:.1e}"
    )]
    ConstraintViolated {
        /// The constraint that is violated most, relative to its bound.
        row: usize,
        /// `|g_i|`, in the unit of the constraint.
        residual: f64,
        /// The largest residual of round-off.
        bound: f64,
    },
    /// The step found the mirror image of a body ([`crate::closure`]).
    #[error("the step ends at the mirror image of a body: its directors are left-handed")]
    Reflected {
        /// Its first coordinate.
        coordinate: usize,
    },
    /// The impulses of contacts were not found.
    #[error("{0}")]
    Contact(#[from] ContactFault),
}

impl StepError {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Newton(NewtonError::Refused {
                fault: Fault::OutsideChart { kind: BlockKind::Rotation, .. },
                ..
            }) => {
                "a step must turn no body by more than half a turn, in the variational schemes of order 2 by less than \
                 1 rad (sin θ = h ω): reduce the time step"
            }
            Self::Newton(NewtonError::Refused {
                fault: Fault::FarFromGuess { .. } | Fault::FarFromConstraints { .. },
                ..
            }) => "the step has more than one solution: reduce the time step",
            Self::Newton(NewtonError::Refused { fault: Fault::SingularTangent, .. })
            | Self::Newton(NewtonError::Refused { fault: Fault::RankChanged { .. }, .. })
            | Self::RankLost => {
                "check for a singular configuration, for masses or inertias that are zero in a free \
                 direction, and for redundant constraints; or use another scheme"
            }
            Self::Newton(NewtonError::NotConverged { kind: BlockKind::Multiplier, .. }) => {
                "constraints are all but dependent here (a singular configuration): use the scheme \
                 `nodal`, or reduce the time step"
            }
            Self::ConstraintViolated { .. } => {
                "constraints that depend on one another disagree along this motion: remove one of \
                 them, or correct lengths, axes and prescribed motions so that they agree"
            }
            Self::Contact(ContactFault::Immovable { .. }) => {
                "let a joint or a prescribed motion give way, or remove the stop"
            }
            Self::Reflected { .. } => {
                "the step has more than one solution: reduce the time step, or use the scheme `nodal`"
            }
            _ => "reduce the time step",
        }
    }

    /// The constraint the failure is about, if one is.
    #[must_use]
    pub fn constraint(&self) -> Option<usize> {
        match self {
            Self::ConstraintViolated { row, .. } => Some(*row),
            _ => None,
        }
    }

    /// The coordinate the failure is about, if one is.
    #[must_use]
    pub fn coordinate(&self) -> Option<usize> {
        match self {
            Self::Reflected { coordinate } => Some(*coordinate),
            _ => None,
        }
    }

    /// The unknown the failure is about, if one is.
    #[must_use]
    pub fn unknown(&self) -> Option<usize> {
        match self {
            Self::Newton(
                NewtonError::NotConverged { unknown, .. }
                | NewtonError::Refused { fault: Fault::OutsideChart { unknown, .. }, .. },
            ) => Some(*unknown),
            _ => None,
        }
    }
}

impl StepError {
    /// Whether no impulses of contacts obey their laws, or none were found.
    pub(crate) fn has_no_impulses(&self) -> bool {
        matches!(self, Self::Contact(fault) if fault.has_no_impulses())
    }

    /// Whether a shorter step, or laws of contacts with a compliance, may end where this does not.
    pub(crate) fn may_end(&self) -> bool {
        match self {
            Self::Newton(_) => true,
            Self::Contact(fault) => fault.may_end(),
            _ => false,
        }
    }
}
