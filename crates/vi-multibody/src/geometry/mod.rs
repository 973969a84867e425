//! Twists, spatial matrices, and points and vectors as linear forms in the coordinates.

pub(crate) mod control_points;
pub mod form;
pub(crate) mod matrix;
pub(crate) mod members;
pub(crate) mod one_tree;
pub(crate) mod space;
pub mod spatial;
pub(crate) mod twist;
