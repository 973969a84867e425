//! The rows of a cluster in a step.

use super::echelon::Echelon;
use super::path::Paths;

/// The rows of a cluster in a step: those that `U` was found from where they are enforced, else
/// `U`.
pub(super) struct EnforcedRows<'a> {
    pub(super) paths: &'a mut Paths,
    pub(super) basis: &'a Echelon,  // U
    pub(super) order: &'a [usize],  // its pivots, by their rows; none of rows that are enforced
    pub(super) chosen: &'a [usize], // rows enforced at q_{n+1}
    pub(super) g: &'a [f64],        // of the chosen rows
}
