//! Joint stops and dry friction of joints.

pub mod joint_friction;
pub mod joint_stop;
