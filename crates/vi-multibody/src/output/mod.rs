//! What is read from a motion: joint coordinates and rates, wrenches and reactions of joints,
//! multipliers of trees.

mod bar_tensions;
pub mod joint_motion;
pub(crate) mod joint_wrenches;
pub mod reaction;
pub mod tree_multipliers;
