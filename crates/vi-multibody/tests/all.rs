//! Every test of `vi-multibody` against its public interface, in one binary.
#![allow(clippy::unwrap_used)] // tests

mod bed;
mod beside;
mod box_stacks;
mod builder;
mod builder_refusals;
mod bushings;
mod closing;
mod compliant_contacts;
mod contact_runs;
mod control_points;
mod cylinder_contacts;
mod dense;
mod design;
mod divided_steps;
mod ensemble;
mod ensemble_forces;
mod ensemble_recording;
mod force_slopes;
mod jammed_contacts;
mod joint_contacts;
mod joint_coordinates;
mod joint_efforts;
mod loaded_trees;
mod loop_step;
mod mesh_contacts;
mod moving_tree;
mod near_couplings;
mod node_laws;
mod pair_data;
mod quantity_efforts;
mod random_trees;
mod redundant_contacts;
mod settling;
mod shape_contacts;
mod tree_step;
