//! Every test of `vi-multibody` against its public interface, in one binary.
#![allow(clippy::unwrap_used)] // tests

mod builder;
mod control_points;
mod joint_coordinates;
mod random_trees;
mod tree_step;
