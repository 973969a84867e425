//! Every test of `vi-constraints` against its public interface, in one binary.
#![allow(clippy::unwrap_used)] // tests

mod common;

mod legendre;
mod legendre_identities;
mod tangent_space;
mod unconstrained;
