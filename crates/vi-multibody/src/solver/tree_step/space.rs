//! What is added to the sweeps is computed lane by lane.

use crate::geometry::one_tree::{Narrow, OneTree};

/// The numbers of what is added.
pub(in crate::solver) const SPACE: OneTree<Narrow> = OneTree(Narrow);
