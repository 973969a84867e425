//! Verification: the properties of a scheme, measured on a system and judged.
//!
//! | file | concept |
//! |---|---|
//! | [`fit`] | power laws by least squares |
//! | [`order`] | the observed order of convergence, or why none can be read |
//! | [`trend`] | band and trend of a bounded quantity (energy) |
//! | [`growth`] | how an error grows with the number of steps (momentum maps) |
//! | [`subject`] | what is verified: a system that can be set in motion by any method |
//! | [`running`], [`family`] | integrators of all families as motions |
//! | [`equations`], [`output`] | the equations of motion, and what an integrator reports against them |
//! | [`frequency`] | the fastest motion, `h ω_max` |
//! | [`symplectic`] | the symplectic form along real steps |
//! | [`convergence`] | errors of `q`, `p`, `λ` at shrinking steps |
//! | [`measure`] | conserved quantities, reversal, symplecticity, conditioning, agreement |
//! | [`certify`], [`judge`], [`certificate`] | everything measured and judged |
//! | [`table`] | its findings as tables |
//!
//! | type | is |
//! |---|---|
//! | [`Subject`](subject::Subject), [`RunningMotion`](subject::RunningMotion) | what is verified; its motion by any method |
//! | [`Certificate`](certificate::Certificate), [`Finding`](certificate::Finding) | findings with their reasons |
//!
//! Every statistic returns an error with the reason where the numbers are not sufficient for it.

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod certificate;
pub mod certify;
pub mod convergence;
pub mod equations;
pub mod family;
pub mod fit;
pub mod frequency;
pub mod growth;
mod horizons;
pub mod judge;
pub mod measure;
pub mod order;
pub mod output;
mod round_off;
pub mod running;
pub mod subject;
pub mod symplectic;
pub mod table;
pub mod trend;
