//! The facade: from a model file to a trajectory and a report.
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod sample;
