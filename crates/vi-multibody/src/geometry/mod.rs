//! Twists, spatial matrices, and points and vectors as linear forms in the coordinates.

pub mod form;
pub(crate) mod lane_vectors;
pub(crate) mod matrix;
pub(crate) mod members;
pub(crate) mod one_tree;
pub(crate) mod space;
pub mod spatial;
pub(crate) mod twist;
