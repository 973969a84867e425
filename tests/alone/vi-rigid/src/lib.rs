//! The example of the README of `vi-rigid`, compiled and run by a crate that depends on nothing
//! else.
#![doc = include_str!("../../../../crates/vi-rigid/README.md")]
