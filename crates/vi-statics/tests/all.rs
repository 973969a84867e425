//! Every test of `vi-statics` against its public interface, in one binary.
#![allow(clippy::unwrap_used)] // tests

mod common;

mod branch;
mod buckling;
mod circulation;
mod equilibria;
mod frequency_bound;
mod lost_stability;
mod modes;
mod rotation;
mod slender;
mod stability;
mod statics;
