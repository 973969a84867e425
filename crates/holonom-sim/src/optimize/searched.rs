//! What a search for controls has found.

use super::found::{Refinement, SearchStep, StartFound};
use vi_control::optimum::Optimum;

/// What a search has found, with its iterations and what its beginnings came to.
pub(super) struct Searched {
    pub(super) found: Optimum,
    pub(super) rows: Vec<SearchStep>,
    pub(super) starts: Vec<StartFound>,
    /// The optima of the best one with fewer steps.
    pub(super) refinements: Vec<Refinement>,
    /// The names of the unknowns of the tree.
    pub(super) unknowns: Vec<String>,
}
