//! Joint coordinates with derivatives, and scalar constraints.

pub mod joint_coordinate;
pub mod scalar_constraint;
