//! Joint coordinates with derivatives, scalar constraints, constraints on velocities.

pub mod joint_coordinate;
pub mod rolling;
pub mod scalar_constraint;
pub mod velocity_constraint;
