//! Operators of the Newton step for each topology, and the choice among them.

mod along_unknowns;
mod beside;
mod body_blocks;
mod chord;
pub mod closed_loop;
mod efforts;
mod enforced;
pub mod ensemble;
mod joint_costates;
mod law_along;
mod loop_costates;
mod loop_point_costates;
mod member_blocks;
mod point_costates;
mod point_slopes;
mod quantity_efforts;
pub mod run;
mod screws;
pub mod sparse_nodal;
mod tree_costates;
pub mod tree_descriptor;
pub mod tree_map;
pub mod tree_nodal;
pub mod tree_step;
pub mod tree_sweeps;
