//! Springs, dampers and motors.

pub mod joint_force;
pub mod spring;
