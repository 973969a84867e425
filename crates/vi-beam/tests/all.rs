//! Every test of `vi-beam` against its public interface, in one binary.
#![allow(clippy::unwrap_used)] // tests

mod common;

mod allocation;
mod block_elimination;
mod elbow;
mod free_flight;
mod order;
mod sparse_nodal;
