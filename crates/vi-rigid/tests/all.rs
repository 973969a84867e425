//! Every test of `vi-rigid` against its public interface, in one binary.
#![allow(clippy::unwrap_used)] // tests

mod common;

mod allocation;
mod fixed_point;
mod free_body;
mod heavy_top;
