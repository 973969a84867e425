//! The example of the README of `vi-core`, compiled and run by a crate that depends on nothing
//! else.
#![doc = include_str!("../../../../crates/vi-core/README.md")]
