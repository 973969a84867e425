//! What is read from a motion: joint coordinates and rates, reactions.

pub mod joint_motion;
pub mod reaction;
