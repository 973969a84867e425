//! Every test of `vi-core` against its public interface, in one binary.
#![allow(clippy::unwrap_used, clippy::float_cmp)] // tests; they compare exactly representable numbers

mod eigen;
mod linear;
mod sparse_cholesky;
