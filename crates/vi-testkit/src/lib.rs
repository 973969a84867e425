//! Shared by the tests of this repository; not published.
//!
//! | file | concept |
//! |---|---|
//! | [`allocator`] | counts allocations and the memory in use |
//! | [`model`] | texts of model files, part by part; bodies with their motion |
//! | [`sample`] | random numbers, vectors, frames, reproducible by their seed |
//! | [`slopes`] | slot derivatives of discrete forces, and second ones, against central differences |
#![deny(missing_docs)]

pub mod allocator;
pub mod model;
pub mod sample;
pub mod slopes;

pub use allocator::CountingAllocator;
pub use sample::Sample;
pub use slopes::{bend_error, potential_bend_error, slope_error};
