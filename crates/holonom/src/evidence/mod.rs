//! Evidence: what a scheme promises, measured on a system and judged.
//!
//! | file | concept |
//! |---|---|
//! | [`fit`] | power laws by least squares |
//! | [`order`] | the observed order of convergence, or why none can be read |
//! | [`trend`] | band and trend of a bounded quantity (energy) |
//! | [`growth`] | how an error grows with the number of steps (momentum maps) |
//!
//! Every statistic refuses with a reason where the numbers do not carry it.

pub mod fit;
pub mod growth;
pub mod order;
pub mod trend;
