//! Twists, spatial matrices, and points and vectors as linear forms in the coordinates.

pub mod form;
pub(crate) mod lane_matrices;
pub(crate) mod lane_spatial;
pub(crate) mod lane_vectors;
pub(crate) mod lanes;
pub mod spatial;
pub(crate) mod twist;
