//! Impulses of unilateral contact, joint stops and dry friction at the nodes of a scheme.
//!
//! ```text
//! P(q_n)ᵀ [p̄_n + B(q_n)ᵀΛ_n + D_1 L_d + f_d^-] = 0,     q_{n+1} = F_d(u, q_n)
//! U⁻ = B v̂(p̄_n),   W = B P (PᵀMP)⁻¹ Pᵀ Bᵀ,   U⁺ = U⁻ + WΛ
//! ```
//! The impulse is an addition to the momentum before the step is opened: any scheme of order 2 that
//! starts from `(q_n, p̄_n)` takes it, and the equations of joints and loops know nothing of it. A
//! contact that stays closed is one more holonomic constraint of the scheme.
//!
//! | file | concept |
//! |---|---|
//! | [`unilateral`] | what an element has: gaps, rows, slip, law |
//! | `node_law`, `mean_direction` | the law of a contact at a node; of slip that turns |
//! | `impulses` | the contacts of a node and their impulses |
//! | `outer_iteration`, `friction_iteration` | how impulses are found; what friction decides on the way |
//! | `active_rows` | the laws of an island as one problem |
//! | `delassus`, `groups` | `W` in sparse rows; the coordinates that impulses move together |
//! | `response` | how the end of a step answers impulses, where springs and dampers are stiff |
//! | `holding`, `kept` | impulses that hold rows; what is kept closed beside an impact |
//! | `node_velocity` | the velocity of a node, to which its kinetic energy belongs |
//! | `accepted` | the state after the step of a node, and what is recorded |
//! | `impact_law`, `collisions` | impacts after Newton, after Moreau, or one after the other |
//! | `guard`, `islands` | restitution that would gain energy is reduced, island by island |
//! | `uniqueness` | which impulses follow from the motion |
//! | `events` | a step with nodes at first touches, or with fixed nodes |
//! | `options` | how steps with contacts are taken |
//! | `stepping` | what steps are solved with |
//! | `record` | what happened at the nodes of a step |
//! | `named` | what contacts remember, for a mechanism with other elements |
//!
//! Letters: `Λ` impulse of a row (N·s, N·m·s), `B` row, `U` velocity of a row, `W` Delassus
//! matrix, `g` gap, `γ = g(q_{n+1})/h`, `σ` slip of a step over `h`, `ξ` what a row drives to zero,
//! `b` bound of dry friction.

#![allow(non_snake_case)] // W

mod accepted;
mod active_rows;
mod collisions;
mod delassus;
mod events;
mod friction_iteration;
mod groups;
mod guard;
mod holding;
mod impact_law;
mod impulses;
mod islands;
mod kept;
mod mean_direction;
mod named;
mod node_law;
mod node_velocity;
mod options;
mod outer_iteration;
mod record;
mod response;
mod stepping;
pub mod unilateral;
mod uniqueness;

pub(crate) use stepping::Stepping;

pub use events::Nonsmooth;
pub use impact_law::ImpactLaw;
pub use named::NamedContacts;
pub use options::{Method, NonsmoothOptions};
pub use record::{ContactImpulse, ContactRecord, ContactStatus, NodeRecord, Unique};
pub use unilateral::{ContactLaw, ContactPlace, ContactRows, TransverseImpulses, Unilateral};

use vi_core::cone::ConeFault;

/// Why the impulses of a node were not found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ContactFault {
    /// The outer iteration does not end.
    #[error(
        "the impulses of {contacts} contacts do not converge in {iterations} solutions of the step \
         (largest change of a velocity {change:.1e}; most of `{element}`)"
    )]
    NoConvergence {
        /// The element with the largest change.
        element: String,
        /// How many contacts there are.
        contacts: usize,
        /// How often the step was solved.
        iterations: usize,
        /// m/s or rad/s.
        change: f64,
    },
    /// The laws have no solution, or none was found.
    #[error("contact of `{element}`: {fault}")]
    Laws {
        /// The element concerned.
        element: String,
        /// Why.
        fault: ConeFault,
    },
    /// A contact that no motion opens.
    #[error(
        "no motion opens the contact of `{element}`: what is prescribed, a joint or another contact \
         presses it together"
    )]
    Immovable {
        /// The element.
        element: String,
    },
    /// The constraints have lost rank at the node.
    #[error("the constraints have lost rank at a node with contacts")]
    RankLost,
}

impl ContactFault {
    /// Whether no impulses obey the laws, or none were found.
    pub(crate) fn has_no_impulses(&self) -> bool {
        self.may_end() || matches!(self, Self::Immovable { .. })
    }

    /// Whether a shorter step, or laws with a compliance, may have impulses where this has none.
    pub(crate) fn may_end(&self) -> bool {
        matches!(
            self,
            Self::NoConvergence { .. } | Self::Laws { fault: ConeFault::NoConvergence { .. }, .. }
        )
    }
}
