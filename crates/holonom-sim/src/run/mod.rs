//! A run: what can be run, its state between two steps, its nodes, and how it ends.

pub mod contacts;
pub(crate) mod divided_steps;
pub(crate) mod energies;
pub(crate) mod energy_watch;
pub mod experiment;
pub(crate) mod outcome;
pub(crate) mod rolling;
pub(crate) mod run_state;
pub mod sample;
