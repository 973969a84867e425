//! Every test of `vi-emscheme` against its public interface, in one binary.
#![allow(clippy::unwrap_used)] // tests

mod common;

mod allocation;
mod conservation;
mod joint_forces;
mod loads;
mod orders;
mod stepping;
