//! Twists, spatial matrices, points and vectors as linear forms in the coordinates, the six
//! coordinates between two frames.

pub(crate) mod control_points;
pub mod form;
pub(crate) mod matrix;
pub(crate) mod members;
pub(crate) mod one_tree;
pub(crate) mod products;
pub(crate) mod rotation_vector;
pub mod six_coordinates;
pub(crate) mod space;
pub mod spatial;
pub(crate) mod twist;
