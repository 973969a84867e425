//! The example of the README of `vi-constraints`, compiled and run by a crate that depends on
//! nothing else.
#![doc = include_str!("../../../../crates/vi-constraints/README.md")]
