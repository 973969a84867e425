//! Every test of `vi-statics` against its public interface, in one binary.
#![allow(clippy::unwrap_used)] // tests

mod common;

mod equilibria;
mod frequency_bound;
mod modes;
mod rotation;
mod stability;
mod statics;
