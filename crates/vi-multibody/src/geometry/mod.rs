//! Twists, spatial matrices, and points and vectors as linear forms in the coordinates.

pub mod form;
pub mod spatial;
pub(crate) mod twist;
