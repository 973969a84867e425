//! Springs, dampers, bushings, motors, forces on point masses.

mod acts_on;
pub(crate) mod bends;
pub mod bumper;
pub mod bushing;
pub mod held_effort;
pub mod joint_force;
pub mod law;
pub mod particle_load;
pub mod spring;
pub mod stored_energy;
pub mod stribeck;
pub mod tension;
pub mod wrench_law;
