//! The example of the README of `vi-beam`, compiled and run by a crate that depends on nothing
//! else.
#![doc = include_str!("../../../../crates/vi-beam/README.md")]
