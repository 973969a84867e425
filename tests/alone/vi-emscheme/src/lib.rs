//! The example of the README of `vi-emscheme`, compiled and run by a crate that depends on nothing
//! else.
#![doc = include_str!("../../../../crates/vi-emscheme/README.md")]
