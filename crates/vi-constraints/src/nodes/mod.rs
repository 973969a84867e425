//! Quantities of a node: projections, Legendre transforms, multipliers, vibrations about it.

pub mod fastest_motion;
mod inverse_mass;
pub mod legendre;
pub mod node;
pub mod node_solvers;
pub mod projection;
