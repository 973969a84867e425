//! Parts stated in other frames, resolved into the inertial one; the initial configuration.

pub(crate) mod placements;
mod posed;
pub(crate) mod relative;
pub(crate) mod start;
