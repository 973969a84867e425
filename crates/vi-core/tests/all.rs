//! Every test of `vi-core` against its public interface, in one binary.
// tests; they compare exactly representable numbers
#![allow(clippy::unwrap_used, clippy::float_cmp)]

mod cone;
mod cone_beds;
mod convex;
mod eigen;
mod linear;
mod sparse_cholesky;
