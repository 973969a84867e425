//! The example of the README of `vi-statics`, compiled and run by a crate that depends on nothing
//! else.
#![doc = include_str!("../../../../crates/vi-statics/README.md")]
