//! The example of the README of `vi-control`, compiled and run by a crate that depends on nothing
//! else.
#![doc = include_str!("../../../../crates/vi-control/README.md")]
