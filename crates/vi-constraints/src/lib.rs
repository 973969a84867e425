//! Holonomic constraints and the four equivalent variational schemes on any `q ∈ R^n`.
//!
//! This room knows constraints but no geometry.
#![forbid(unsafe_code)]
#![deny(missing_docs)]
#![cfg_attr(test, allow(clippy::float_cmp))] // tests compare exactly representable numbers

pub mod constraints;
pub mod reparametrization;

pub use constraints::{ConstraintFn, Constraints, Unconstrained};
pub use reparametrization::{DenseNodal, NodalOperators, Reparametrization};
