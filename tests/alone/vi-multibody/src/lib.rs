//! The example of the README of `vi-multibody`, compiled and run by a crate that depends on nothing
//! else.
#![doc = include_str!("../../../../crates/vi-multibody/README.md")]
