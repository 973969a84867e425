//! Constraints of closed loops that follow from the others but for the digits of a file.
//!
//! The axes of a planar loop in a file with six digits are parallel within 1e-6 rad. Taken at their
//! word its constraints are independent, with singular values of 1e-6, and the loop is locked.
//! Instead the constraints of the clear rank are enforced, and the others keep a residual up to the
//! tolerance `τ` of loops:
//! ```text
//! g_s(q) = 0,    |g_d(q)| ≤ τ (rows that are angles),  ≤ τ ℓ (lengths),    ℓ the longest lever arm within the loop
//! ```
//! [`crate::loop_rank`] finds them.

/// Default tolerance of loops, rad or parts of their size: right angles in files with three digits.
pub const LOOP_TOLERANCE: f64 = 1e-3;

/// The constraints of a mechanism that are taken as redundant because they nearly are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NearlyRedundant {
    /// The residual that each constraint may keep where it is not enforced, shape `m`, in the unit
    /// of the constraint.
    pub allowances: Vec<f64>,
    /// The relative size of a pivot between those of enforced constraints and those of the others.
    pub rank_tolerance: f64,
    /// The rank of each cluster of loops where it is the clear rank.
    pub ranks: Vec<Option<usize>>,
    /// How many of the constraints that close loops of bodies are enforced.
    pub loop_rank: usize,
}
