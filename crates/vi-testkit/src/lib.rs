//! Shared by the tests of this repository; not published.
//!
//! | file | concept |
//! |---|---|
//! | [`allocator`] | counts allocations and the memory in use |
//! | [`sample`] | random numbers, vectors, frames, reproducible by their seed |
#![deny(missing_docs)]

pub mod allocator;
pub mod sample;

pub use allocator::CountingAllocator;
pub use sample::Sample;
